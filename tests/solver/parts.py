"""Small meshes, bodies and contacts, put together by hand for tests of the solver's terms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from dolfinx import fem
from dolfinx.cpp.graph import AdjacencyList_int32
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI
from petsc4py import PETSc

from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.pin_in_block import quarter_joint
from archord.kernels.compat import ghosted_vector
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.solver.bulk.bulk import Bulk
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Interaction, Interface
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from archord.solver.problem import Problem
from tests.geometry.shapes.measures import Cells

E = 1.82
NU = 0.3
FRICTION = 0.3
YIELD_STRESS = 0.01
ELASTIC = Elastic(E, NU, "strain")
PERFECT = J2Material(E, NU, "strain", LinearHardening(YIELD_STRESS))
HARDENING = J2Material(E, NU, "strain", LinearHardening(YIELD_STRESS, 0.1 * E))
PLANE_STRESS = J2Material(E, NU, "stress", LinearHardening(YIELD_STRESS, 0.02 * E))
R = 1.0
DR = 0.005


def partition(owner: Callable[[np.ndarray, np.ndarray], np.ndarray]):
    """Partitioner that sends cell ``i`` with vertices ``v`` to the rank ``owner(i, v) % size``."""

    def partitioner(comm, n_parts, cell_types, cells):
        mine = np.asarray(cells[0]).reshape(-1, 3)
        rank = owner((comm.exscan(len(mine)) or 0) + np.arange(len(mine)), mine) % n_parts
        return AdjacencyList_int32(rank.astype(np.int32).reshape(-1, 1))

    return partitioner


def space(mesh: Mesh) -> fem.FunctionSpace:
    return fem.functionspace(mesh, ("Lagrange", 2, (2,)))


def n_nodes(V) -> int:
    """Nodes of this rank, ghosts included."""
    return V.dofmap.index_map.size_local + V.dofmap.index_map.num_ghosts


def coordinates(V) -> np.ndarray:
    return V.tabulate_dof_coordinates()[:, :2]


def nodes_of(V, cells: MeshTags, tag: int) -> np.ndarray:
    return np.unique(V.dofmap.list[cells.find(tag)])


def edge_nodes(V, facets: MeshTags, tag: int) -> np.ndarray:
    V.mesh.topology.create_connectivity(1, 2)
    return fem.locate_dofs_topological(V, 1, facets.find(tag))


def scipy_matrix(A: PETSc.Mat) -> sp.csr_matrix:
    rows, columns, values = A.getValuesCSR()
    return sp.csr_matrix((values, columns, rows), shape=A.getSize())


def internal_force(bulk: Bulk, u: np.ndarray) -> np.ndarray:
    """Internal force ``(n_owned, 2)`` of the bulk at the nodal displacements ``u`` ``(n, 2)``."""
    function = fem.Function(bulk.V)
    function.x.array[:] = u.ravel()
    force = ghosted_vector(bulk.V.dofmap.index_map, 2)
    with force.localForm() as local:
        local.set(0.0)
    bulk.update(u)
    bulk.add_force(function.x.petsc_vec, force)
    return force.array_r.reshape(-1, 2).copy()


def commit(part: Bulk | Contact) -> None:
    """Accept the history of the last evaluation."""
    for _, points in part.histories().values():
        points.commit()


def contact_force(contact: Contact, u: np.ndarray) -> np.ndarray:
    """What the contact adds to the residual ``(n_owned, 2)`` at ``u``."""
    contact.evaluate(u)
    force = np.zeros((contact.surfaces[0].V.dofmap.index_map.size_local, 2))
    contact.add_force(force)
    return force


@dataclass
class Parts:
    """A joint in pieces; ``sides`` are pin and hole, or the hole alone."""

    V: fem.FunctionSpace
    cells: MeshTags
    facets: MeshTags
    bulk: Bulk
    sides: list[Surface]
    contact: Contact

    def pressed(self, depth: float, noise: float = 0.0, seed: int = 0) -> np.ndarray:
        """Pin moved down by ``depth``, both bodies bent smoothly, and ``noise`` at every node
        (serial only)."""
        x = coordinates(self.V)
        u = (
            0.2
            * depth
            * np.stack([np.sin(2 * x[:, 0] + x[:, 1]), np.cos(3 * x[:, 0] - 2 * x[:, 1])], axis=1)
        )
        if self.cells.find(Cells.PIN).size:
            u[nodes_of(self.V, self.cells, Cells.PIN), 1] -= depth
        if noise:
            u += noise * np.random.default_rng(seed).normal(size=u.shape)
        return u


def joint_parts(
    comm: MPI.Comm = MPI.COMM_SELF,
    pin=ELASTIC,
    block=ELASTIC,
    *,
    size: float = 0.2,
    partitioner=None,
    **contact_options,
) -> Parts:
    """A small quarter joint; without a ``pin`` material the pin is a rigid disc."""
    joint = quarter_joint(
        comm, R, DR, 4.0, size, 0.4, rigid_pin=pin is None, partitioner=partitioner
    )
    V = space(joint.mesh)
    materials = {Cells.BLOCK: block}
    sides = [Surface(V, joint.facets_in("hole"), block)]
    opposite = RigidSurface(RigidCircle(np.array([0.0, -DR]), R))
    if pin is not None:
        materials = {Cells.PIN: pin} | materials
        opposite = Surface(V, joint.facets_in("pin"), pin)
        sides.insert(0, opposite)
    bulk = Bulk(V, {tag: joint.cells.find(tag) for tag in materials}, materials)
    return Parts(
        V,
        joint.cells,
        joint.facets,
        bulk,
        sides,
        interact([opposite, sides[-1]], **contact_options),
    )


def interact(surfaces, *, kinematics="current", integrated=None, **options) -> Contact:
    """The contact of two surfaces, of which one or both are integrated; "tied" is a law that has no
    kinematics, and "rubbing" ones have friction."""
    kinematics, *rubbing = kinematics.split(", ")
    options |= {"law": "tied"} if kinematics == "tied" else {"kinematics": kinematics}
    options |= {"friction": FRICTION} if rubbing else {}
    chosen = "" if integrated is None else str(integrated)
    return Contact(
        surfaces[1].V,
        [Interface(Interaction("contact", ("0", "1"), integrated=chosen, **options), surfaces)],
    )


def blocks(comm: MPI.Comm, *edges: int, width: float = 1.0, **options) -> TaggedMesh:
    """Rectangles of a ``width`` and height 1 on top of each other from y = -1, with so many
    ``edges`` on their sides.

    Sets are "lower", "middle" (of three) and "upper", their tops and bottoms, all "left" and all
    "right" sides; "base" and "lid" are the outermost bottom and top.
    """
    names = ("lower", "middle", "upper") if len(edges) == 3 else ("lower", "upper")

    def build(gmsh) -> None:
        walls: dict[str, list[int]] = {"left": [], "right": []}
        for k, (name, n) in enumerate(zip(names, edges, strict=True)):
            face = gmsh.model.occ.addRectangle(0, k - 1, 0, width, 1)
            gmsh.model.occ.synchronize()
            gmsh.model.addPhysicalGroup(2, [face], name=name)
            bottom, right, top, left = (
                line for _, line in gmsh.model.getBoundary([(2, face)], oriented=False)
            )
            for line in (bottom, right, top, left):
                gmsh.model.mesh.setTransfiniteCurve(line, n + 1)
            gmsh.model.addPhysicalGroup(1, [bottom], name=f"{name} bottom")
            gmsh.model.addPhysicalGroup(1, [top], name=f"{name} top")
            walls["left"].append(left)
            walls["right"].append(right)
        for name, lines in walls.items():
            gmsh.model.addPhysicalGroup(1, lines, name=name)

    mesh = gmsh_to_mesh(comm, build, **options)
    sets = mesh.facet_sets
    return replace(
        mesh, facet_sets={**sets, "base": sets["lower bottom"], "lid": sets["upper top"]}
    )


INNER, OUTER, ON_X, ON_Y = range(1, 5)


def quarter_annulus(comm: MPI.Comm, a: float, b: float, size: float, **options) -> TaggedMesh:
    """A quarter of a "ring" between the radii ``a`` and ``b``, with edges "inner", "outer", "x" and
    "y"."""

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        centre = geo.addPoint(0, 0, 0)
        p = [geo.addPoint(x, y, 0) for x, y in ((a, 0), (b, 0), (0, b), (0, a))]
        edges = [
            geo.addLine(p[0], p[1]),
            geo.addCircleArc(p[1], centre, p[2]),
            geo.addLine(p[2], p[3]),
            geo.addCircleArc(p[3], centre, p[0]),
        ]
        face = geo.addPlaneSurface([geo.addCurveLoop(edges)])
        geo.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], 1, "ring")
        for edge, tag, name in zip(
            edges, (ON_X, OUTER, ON_Y, INNER), ("x", "outer", "y", "inner"), strict=True
        ):
            gmsh.model.addPhysicalGroup(1, [edge], tag, name)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)

    return gmsh_to_mesh(
        comm, build, [Circle("inner", (0.0, 0.0), a), Circle("outer", (0.0, 0.0), b)], **options
    )


def notched_bar(comm: MPI.Comm, width: float, finest: float) -> TaggedMesh:
    """A quarter of a square "bar" of ``width`` with two cracks in line: its "ligament" of 1 on y =
    0, the sides "axis" on x = 0 and "lid"; elements grow from the size ``finest`` at the crack's
    tip."""

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        corners = (0.0, 0.0), (1.0, 0.0), (width, 0.0), (width, width), (0.0, width)
        p = [geo.addPoint(x, y, 0) for x, y in corners]
        lines = [geo.addLine(a, b) for a, b in zip(p, [*p[1:], p[0]], strict=True)]
        face = geo.addPlaneSurface([geo.addCurveLoop(lines)])
        geo.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="bar")
        for line, name in ((lines[0], "ligament"), (lines[3], "lid"), (lines[4], "axis")):
            gmsh.model.addPhysicalGroup(1, [line], name=name)
        field = gmsh.model.mesh.field
        field.add("MathEval", 1)
        field.setString(1, "F", f"{finest} + 0.12 * Sqrt((x - 1)^2 + y^2)")
        field.setAsBackgroundMesh(1)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)

    return gmsh_to_mesh(comm, build)


def solve(problem: Problem, loads) -> System:
    """Step through ``loads`` from rest and return the system at the last; no step may be cut."""
    system = System(problem)
    system.solve(loads, StepRules(minimum=1.0))
    return system

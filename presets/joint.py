"""The joint of a scene as a problem to solve: meshes, bodies, contact and supports."""

from __future__ import annotations

from typing import TYPE_CHECKING

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.la import InsertMode
from mpi4py import MPI

from archord.geometry.basis import Array, bulk_quadrature, cell_basis
from archord.geometry.curve import RigidCircle
from archord.geometry.half_ring import half_ring
from archord.geometry.joint_mesh import Cells, Facets, JointMesh, refinements
from archord.geometry.quarter_joint import quarter_joint
from archord.scene.scene import Scene
from archord.solver.bulk import Body, Bulk
from archord.solver.contact.contact import Contact
from archord.solver.contact.surface import ContactSide
from archord.solver.equilibrium import Equilibrium, Support
from archord.solver.load_path import Position, Walk
from archord.solver.newton import NewtonSolver
from archord.solver.timer import Timer

if TYPE_CHECKING:
    from archord.solver.coarse_start import CoarseStart

SIDES = ("pin", "hole")
_MOST_CONDENSED = 8_000  # dofs
_LARGE_GAMMA = 5.0


class Joint:
    """Half a joint, cut at its symmetry axis, ready to be loaded; forces and energies are reported for the whole.

    ``sides`` holds the contact edges by name ("pin" unless it is rigid, and "hole"). Collective over ``comm``. Raises
    `InputError` if the scene leaves the mesh open.
    """

    def __init__(self, scene: Scene, comm: MPI.Comm, *, timer: Timer | None = None, partitioner=None) -> None:
        scene.require_mesh()
        self.scene, self.comm = scene, comm
        self.timer = timer or Timer()
        geometry, analysis = scene.joint, scene.analysis
        with self.timer("mesh"):
            self.model = self._mesh(partitioner)
        with self.timer("setup"):
            self.V = fem.functionspace(
                self.model.mesh,
                basix.ufl.element(
                    "P", "triangle", analysis.degree, shape=(2,), lagrange_variant=basix.LagrangeVariant.equispaced
                ),
            )
            solids = {Cells.PIN: scene.pin.solid, Cells.BLOCK: scene.block}
            materials = {tag: s.material(analysis.plane) for tag, s in solids.items() if s is not None}
            self.bulk = Bulk(self.V, self.model.cells, [Body(tag, m) for tag, m in materials.items()])
            self.sides: dict[str, ContactSide] = {}
            for name, cells, facets in zip(SIDES, Cells, (Facets.PIN_ARC, Facets.HOLE_ARC), strict=True):
                if cells in materials:
                    self.sides[name] = ContactSide(self.V, self.model.facets, facets, materials[cells])
            rigid = RigidCircle(np.array([0.0, -geometry.dR]), geometry.radius) if scene.pin.rigid else None
            one_sided = {"both": None, "pin": 0, "block": len(self.sides) - 1}[analysis.integration]
            self.contact = Contact(
                list(self.sides.values()),
                rigid=rigid,
                kinematics=analysis.kinematics,
                gamma_factor=analysis.gamma_factor,
                one_sided=one_sided,
                slide=self._travel() - abs(geometry.dR),
            )
            self.equilibrium = Equilibrium(
                self.V,
                self.bulk,
                self._supports(),
                self.contact,
                None if rigid is None else np.array([0.0, -1.0]),
                applied=self._core_force() if geometry.model == "ring" else None,
                by_force=0.5 if scene.force_controlled and geometry.model == "block" else None,
                load_name="P" if scene.force_controlled else "delta",
                travel=self._travel(),
                condense=self._condensable(),
                timer=self.timer,
            )
            self.solver = NewtonSolver(
                self.equilibrium, tolerance=analysis.tolerance, max_iterations=analysis.max_iterations
            )
            self._in_core: np.ndarray | None = None  # which points of the pin; found when they are first asked for

    def _mesh(self, partitioner) -> JointMesh:
        g = self.scene.joint
        sizes = (g.radius, g.dR, g.W, g.h, g.growth)
        options = {"size_ratio": g.size_ratio, "degree": self.scene.analysis.degree, "partitioner": partitioner}
        options["refinements"] = refinements(g.expected_cells)
        if g.model == "ring":
            return half_ring(self.comm, *sizes, self.scene.load.core_radius * g.radius, **options)
        edge = None if g.edge_angle is None else (g.edge_angle, g.edge_ratio * g.h)
        return quarter_joint(self.comm, *sizes, edge=edge, rigid_pin=self.scene.pin.rigid, **options)

    def _condensable(self) -> bool:
        """Whether the linear systems shrink to the contact (`condensed`): the bodies are elastic and held, the mesh is
        small (the work on contact dofs grows faster than a factorisation), gamma leaves the small system regular."""
        held = self.scene.joint.model == "block" and not self.scene.force_controlled
        small = self.n_dofs < _MOST_CONDENSED
        return held and small and not self.bulk.plastic and self.scene.analysis.gamma_factor <= _LARGE_GAMMA

    def _core_force(self) -> Array:
        """Downward nodal forces ``(n_owned, 2)`` of half a unit force, spread over the core as ``1 - (r/core)^2``."""
        core = self.scene.load.core_radius * self.scene.joint.radius
        x, v = ufl.SpatialCoordinate(self.model.mesh), ufl.TestFunction(self.V)
        bump = ufl.max_value(1 - ufl.dot(x, x) / core**2, 0)
        dx = ufl.dx(subdomain_data=self.model.cells, subdomain_id=int(Cells.PIN), metadata={"quadrature_degree": 6})
        total = self.comm.allreduce(fem.assemble_scalar(fem.form(bump * dx)))
        vector = fem.assemble_vector(fem.form(-bump / (2 * total) * v[1] * dx))
        vector.scatter_reverse(InsertMode.add)
        self._core = -2 * vector.array[: 2 * self.V.dofmap.index_map.size_local].reshape(-1, 2)
        return -self._core / 2

    def _travel(self) -> float:
        """Size of the displacements to be expected."""
        largest = max(map(abs, self.scene.targets))
        return abs(self.scene.joint.dR) + largest / (self.scene.E_star if self.scene.force_controlled else 1.0)

    def _supports(self) -> list[Support]:
        supports = [
            Support("axis", 0, self._nodes(Facets.SYMMETRY)),
            Support("block", 0, self._nodes(Facets.BLOCK_HELD)),
            Support("block", 1, self._nodes(Facets.BLOCK_HELD)),
        ]
        if not self.scene.pin.rigid and self.scene.joint.model == "block":
            supports.append(Support("pin", 1, self._nodes(Facets.PIN_TOP), -1.0))
        return supports

    def _nodes(self, tag: Facets) -> np.ndarray:
        return fem.locate_dofs_topological(self.V, 1, self.model.facets.find(tag))

    def rigid_translation(self, load: float) -> Array:
        """A first guess of the state of the equilibrium: the pin moved down, the block at rest.

        By the load, if that is a displacement; by about what a force would press it, if the load is one.
        """
        scene = self.scene
        shift = load / scene.E_star if scene.force_controlled else load
        if scene.joint.model == "ring":
            shift += max(scene.joint.dR, 0.0)
        u = np.zeros((self.equilibrium.n_local, 2))
        if not scene.pin.rigid:
            u[np.unique(self.V.dofmap.list[self.model.cells.find(Cells.PIN)]), 1] = -shift
        return np.append(u, shift)

    def walk(self, at: Position | None = None, coarse: CoarseStart | None = None) -> Walk:
        """The way of this joint along its path of loads, from the position ``at`` or the beginning."""
        return Walk(self.solver, self.rigid_translation, from_rest=self.scene.joint.dR > 0, at=at, coarse=coarse)

    def delta(self) -> float:
        """Displacement of the pin from first touch: of its diameter, or in a ring the mean over the core."""
        if self.scene.joint.model == "block":
            return self.equilibrium.level
        u = self.equilibrium.displacement()[: self.equilibrium.n_owned]
        return self.comm.allreduce(-float((self._core * u).sum())) - max(self.scene.joint.dR, 0.0)

    def core_peeq(self) -> float:
        """Largest PEEQ within the core of a ring's pin, whose mean displacement is delta; 0 for a block. Collective."""
        if self.scene.joint.model != "ring" or self.scene.pin.yield_stress is None:
            return 0.0
        cells, points = self.bulk.histories()[Cells.PIN]
        if self._in_core is None:
            x = cell_basis(self.V.mesh, self.bulk.degree, cells, bulk_quadrature(self.bulk.degree)[0]).point
            core = self.scene.load.core_radius * self.scene.joint.radius
            self._in_core = (np.linalg.norm(x, axis=-1) < core).ravel()
        return self.comm.allreduce(float(points.trial.peeq[self._in_core].max(initial=0.0)), op=MPI.MAX)

    def forces(self) -> dict[str, float]:
        """Downward force of the whole joint at pin, contact and block's support, per unit thickness."""
        contact = -2 * self.contact.resultant()[1]
        block = 2 * self.equilibrium.reaction("block")[1]
        ring = self.scene.joint.model == "ring"
        pin = self.equilibrium.load if ring else 2 * self.equilibrium.force_on_level()
        return {"pin": pin, "contact": contact, "block": block}

    @property
    def tangent_factorisations(self) -> int:
        """Number of sparse factorisations so far."""
        return self.equilibrium.tangent.factorisations

    @property
    def n_dofs(self) -> int:
        """Number of displacement dofs, prescribed ones included."""
        return 2 * self.V.dofmap.index_map.size_global

    @property
    def n_cells(self) -> int:
        """Number of triangles."""
        return self.model.mesh.topology.index_map(2).size_global

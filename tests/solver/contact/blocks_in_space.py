"""Two blocks in space, one on the other, of tetrahedra or hexahedra that do not match."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import basix
import basix.ufl
import numpy as np
from dolfinx import fem
from dolfinx.mesh import (
    CellType,
    Mesh,
    compute_midpoints,
    create_mesh,
    exterior_facet_indices,
    meshtags,
)

from archord.geometry.basis import lagrange_element
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.elasticity import Elastic
from archord.materials.kinematics import SPACE
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Interaction, Interface
from archord.solver.contact.surface import Surface
from archord.solver.path.system import displacement_space

E = 1.82
NU = 0.3
IN_SPACE = Elastic(E, NU, "space")
# corners of the cells of a cube, numbered x first, then y, then z
_CUBE = [[0, 1, 2, 3, 4, 5, 6, 7]]
_KUHN = [[0, 1 << a, (1 << a) + (1 << b), 7] for a, b, _ in permutations(range(3))]


def flat(x):
    return x


@dataclass
class Box:
    """A box from ``low`` to ``high``, cut into cubes and these into cells."""

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    cubes: tuple[int, int, int]

    def nodes(self, kind: CellType) -> np.ndarray:
        """The nodes ``(n, k, 3)`` of its cells of second order."""
        is_cube = kind == CellType.hexahedron
        places = lagrange_element(getattr(basix.CellType, kind.name), 2).points
        unit = np.array([[k & 1, k >> 1 & 1, k >> 2] for k in range(8)])
        cells = []
        for origin in np.ndindex(*self.cubes):
            for corners in _CUBE if is_cube else _KUHN:
                vertices = (np.array(origin) + unit[corners]) / self.cubes
                start = vertices[0]
                ends = vertices[[1, 2, 4]] if is_cube else vertices[1:]
                cells.append(start + places @ (ends - start))
        low = np.array(self.low)
        return low + np.array(cells) * (np.array(self.high) - low)


LOWER = Box((0.0, 0.0, -1.0), (1.0, 1.0, 0.0), (3, 2, 2))
UPPER = Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (2, 3, 2))


@dataclass
class Blocks:
    """The blocks with their displacements, and what lies where."""

    V: fem.FunctionSpace
    x: np.ndarray  # (nodes, 3) on the boxes, before they are bent
    facets: dict[str, np.ndarray]  # the facets of "lower" and of "upper" in contact
    cells: dict[str, np.ndarray]  # their cells

    def nodes(self, body: str) -> np.ndarray:
        return np.unique(self.V.dofmap.list[self.cells[body]])

    def contact(self, material=IN_SPACE, order=("upper", "lower"), **options) -> Contact:
        """Contact of the blocks, by default with the upper one first."""
        surfaces = [Surface(self.V, self.facets[n], material, n, SPACE) for n in order]
        interaction = Interaction("joint", order, **options)
        return Contact(self.V, [Interface(interaction, surfaces)])


def tagged(blocks: Blocks) -> TaggedMesh:
    """The mesh of the blocks, with the sets "base", "lid", "left" (x = 0), "front" (y = 0), if
    they are flat, and "around", the facets without contact."""
    mesh = blocks.V.mesh
    exterior = exterior_facet_indices(mesh.topology)
    middle = compute_midpoints(mesh, 2, exterior)
    of_planes = {"base": (2, -1.0), "lid": (2, 1.0), "left": (0, 0.0), "front": (1, 0.0)}
    sets = dict(blocks.facets)
    for name, (axis, at) in of_planes.items():
        sets[name] = exterior[np.abs(middle[:, axis] - at) < 1e-9]
    facets = np.concatenate(list(sets.values()))
    sets["others"] = np.setdiff1d(exterior, facets)
    facets = np.concatenate([facets, sets["others"]])
    tags = np.repeat(np.arange(1, 1 + len(sets), dtype=np.int32), [len(f) for f in sets.values()])
    order = np.argsort(facets)
    of_facets = meshtags(mesh, 2, facets[order].astype(np.int32), tags[order])
    is_upper = np.zeros(sum(map(len, blocks.cells.values())), dtype=np.int32)
    is_upper[blocks.cells["upper"]] = 1
    of_cells = meshtags(mesh, 3, np.arange(len(is_upper), dtype=np.int32), 1 + is_upper)
    names = {name: (k,) for k, name in enumerate(sets, 1)}
    names["around"] = sum((tags for name, tags in names.items() if name not in blocks.facets), ())
    return TaggedMesh(mesh, of_cells, of_facets, {"lower": (1,), "upper": (2,)}, names)


def bodies(comm, lower=LOWER, upper=UPPER, kind=CellType.tetrahedron, bend=flat) -> Blocks:
    """The blocks, their nodes moved by ``bend``."""
    of_boxes = [box.nodes(kind) for box in (lower, upper)]
    points, cells = [], []
    for nodes in of_boxes:
        places = nodes.reshape(-1, 3)
        rounded = np.round(places, 9)
        _, first, node = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
        cells.append(node.reshape(nodes.shape[:2]) + sum(map(len, points)))
        points.append(places[first])
    straight = np.concatenate(points)
    even = basix.LagrangeVariant.equispaced  # as all meshes of archord
    element = basix.ufl.element("P", kind.name, 2, even, shape=(3,))
    chosen = slice(None) if comm.rank == 0 else slice(0, 0)
    mesh = create_mesh(comm, np.concatenate(cells)[chosen], x=straight[chosen], e=element)
    V = displacement_space(mesh, 2)
    x = V.tabulate_dof_coordinates().copy()
    is_upper = mesh.topology.original_cell_index >= len(cells[0])
    facets = _facets_at(mesh, is_upper)
    mesh.geometry.x[:] = bend(mesh.geometry.x)
    where = {"lower": np.flatnonzero(~is_upper), "upper": np.flatnonzero(is_upper)}
    return Blocks(displacement_space(mesh, 2), x, facets, where)


def _facets_at(mesh: Mesh, is_upper):
    """The facets of both boxes at z = 0."""
    mesh.topology.create_connectivity(2, 3)
    facets = exterior_facet_indices(mesh.topology)
    at = facets[np.abs(compute_midpoints(mesh, 2, facets)[:, 2]) < 1e-9]
    to_cell = mesh.topology.connectivity(2, 3)
    upper = np.array([is_upper[to_cell.links(f)[0]] for f in at], dtype=bool)
    return {"lower": at[~upper], "upper": at[upper]}

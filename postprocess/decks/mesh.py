"""A problem's mesh as programs of the Abaqus family number it: elements, node sets and surfaces."""

from __future__ import annotations

import re
from dataclasses import dataclass

import basix
import numpy as np
import numpy.typing as npt

from archord.geometry.basis import Array
from archord.geometry.curve import RigidCircle
from archord.solver.path.system import System
from archord.solver.problem import Interaction, Rigid

Ints = npt.NDArray[np.int64]

# Abaqus counts corners counterclockwise, then the midpoint behind each, then the centre; its edges
# begin at a corner. These are basix' nodes of degree 2 in that order, and its facets as edges.
_NODES = {
    basix.CellType.triangle: [0, 1, 2, 5, 3, 4],
    basix.CellType.quadrilateral: [0, 1, 3, 2, 4, 6, 7, 5, 8],
}
_EDGES = {basix.CellType.triangle: [1, 2, 0], basix.CellType.quadrilateral: [0, 3, 1, 2]}
_OF_MIDDLE = np.array([-0.25] * 4 + [0.5] * 4)  # the middle of a quadrilateral of 8 nodes by these
_RIM = 0.8  # inner over outer radius of the ring that stands for a rigid disc


@dataclass(frozen=True)
class Surface:
    """The ``elements`` ``(n,)`` behind a surface, their ``edges`` ``(n,)``, edge i going from
    corner i to the next, and those edges' nodes ``(n, 3)``: start, end, midpoint."""

    elements: Ints
    edges: Ints
    nodes: Ints


@dataclass(frozen=True)
class DeckMesh:
    """Nodes ``x`` ``(n, 2)`` and per body the nodes ``(m, 6 or 8)`` of its ``elements``,
    counterclockwise, corners before midpoints; both are numbered from 0, elements through all
    bodies.

    ``node_sets`` ``(k,)`` and ``surfaces`` have the names of the problem's sets; the ring of
    elements that stands for a rigid disc is a body and a surface with the `surface_name`. ``dofs``
    ``(n,)`` are the nodes' block dofs in the system, and larger than those on a ring. ``middles``
    ``(m, 9)`` are the dofs of quadrilaterals without their last.
    """

    x: Array
    dofs: Ints
    middles: Ints
    elements: dict[str, Ints]
    node_sets: dict[str, Ints]
    surfaces: dict[str, Surface]

    def forces(self, of_dofs: Array) -> Array:
        """Nodal forces ``(n, 2)`` that do the work of those of the dofs."""
        out = np.zeros((max(len(of_dofs), self.dofs.max() + 1), 2))
        out[: len(of_dofs)] = of_dofs
        np.add.at(out, self.middles[:, :8], _OF_MIDDLE[:, None] * out[self.middles[:, 8:]])
        return out[self.dofs]


def label(name: str) -> str:
    """A name as decks have it: capitals, digits and underscores, a letter first."""
    plain = re.sub(r"[^A-Z0-9_]", "_", name.upper())
    return plain if plain[:1].isalpha() else f"SET_{plain}"


def surface_name(interaction: Interaction, side: int) -> str:
    """Name of a surface of the interaction in a `DeckMesh`."""
    given = interaction.surfaces[side]
    return f"{interaction.name} disc" if isinstance(given, Rigid) else given


def deck_mesh(system: System) -> DeckMesh:
    """The mesh of ``system``, of degree 2 and on one rank."""
    problem, V = system.problem, system.V
    mesh, kind, x = V.mesh, V.mesh.basix_cell(), V.tabulate_dof_coordinates()[:, :2]
    corners, nodes = len(_EDGES[kind]), V.dofmap.list[:, _NODES[kind]].astype(np.int64)
    one, two, last = (x[nodes[:, i]] for i in (0, 1, corners - 1))
    clockwise = np.linalg.det(np.stack([two - one, last - one], axis=1)) < 0
    turned = [0, *range(corners - 1, 0, -1), *range(2 * corners - 1, corners - 1, -1), 8][
        : nodes.shape[1]
    ]
    nodes[clockwise] = nodes[clockwise][:, turned]
    cells = {body.name: problem.mesh.cells_in(body.cells or body.name) for body in problem.bodies}
    numbered = np.concatenate(list(cells.values()))
    number = np.full(len(nodes), -1)
    number[numbered] = np.arange(len(numbered))
    bodies = {name: nodes[own, : 2 * corners] for name, own in cells.items()}
    mesh.topology.create_connectivity(2, 1)
    facets_of = mesh.topology.connectivity(2, 1).array.reshape(-1, corners)

    def surface(name: str) -> Surface:
        cell, facet = np.nonzero(
            np.isin(facets_of, problem.mesh.facets_in(name)) & (number >= 0)[:, None]
        )
        edge = np.array(_EDGES[kind])[facet]
        edge = np.where(clockwise[cell], corners - 1 - edge, edge)
        along = np.stack([edge, (edge + 1) % corners, edge + corners], axis=1)
        return Surface(number[cell], edge, nodes[cell[:, None], along])

    names = [
        name for i in problem.interactions for name in i.surfaces if not isinstance(name, Rigid)
    ]
    surfaces = {name: surface(name) for name in names}
    node_sets = {s.facets: problem.mesh.dofs_in(V, s.facets) for s in problem.supports}
    for i in problem.interactions:
        if isinstance(disc := i.surfaces[0], Rigid):
            start, end = x[surfaces[i.surfaces[1]].nodes[:, :2]].swapaxes(0, 1)
            n = int(
                np.ceil(2 * np.pi * disc.circle.radius / np.linalg.norm(end - start, axis=1).mean())
            )
            name, (rim, ring) = surface_name(i, 0), _ring(disc.circle, n)
            ring, x, first = ring + len(x), np.concatenate([x, rim]), sum(map(len, bodies.values()))
            bodies[name], node_sets[name] = ring, np.unique(ring)
            surfaces[name] = Surface(
                first + np.arange(n), np.ones(n, dtype=np.int64), ring[:, [1, 2, 5]]
            )
    used = np.unique(np.concatenate([own.ravel() for own in bodies.values()]))
    place = np.full(len(x), -1)
    place[used] = np.arange(len(used))
    middles = nodes[numbered] if corners == 4 else np.zeros((0, 9), int)
    elements = {name: place[own] for name, own in bodies.items()}
    node_sets = {name: place[own][place[own] >= 0] for name, own in node_sets.items()}
    surfaces = {name: Surface(s.elements, s.edges, place[s.nodes]) for name, s in surfaces.items()}
    return DeckMesh(x[used], used, middles, elements, node_sets, surfaces)


def _ring(circle: RigidCircle, n: int) -> tuple[Array, Ints]:
    """Nodes and ``n`` quadrilaterals of a ring below a circle, whose edges 1 lie on it."""
    angle, k = np.pi * np.arange(2 * n) / n, 2 * np.arange(n)
    ray, after = circle.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1), (k + 2) % (2 * n)
    x = circle.centre + np.concatenate([r * ray for r in (_RIM, (1 + _RIM) / 2, 1.0)])
    nodes = [k, 4 * n + k, 4 * n + after, after, 2 * n + k, 4 * n + k + 1, 2 * n + after, k + 1]
    return x, np.stack(nodes, axis=1)

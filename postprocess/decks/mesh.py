"""A problem's mesh as programs of the Abaqus family number it: elements, node sets and surfaces."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

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
class DeckSurface:
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
    surfaces: dict[str, DeckSurface]

    def forces(self, of_dofs: Array) -> Array:
        """Nodal forces ``(n, 2)`` that do the work of the forces on the dofs."""
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
    problem = system.problem
    cells = _Cells(system, {body.name: problem.cells_of(body) for body in problem.bodies})
    x = cells.x
    elements = dict(cells.elements)
    surfaces = {}
    node_sets = {}
    for support in problem.supports:
        node_sets[support.facets] = problem.mesh.dofs_in(system.V, support.facets)
    for interaction in problem.interactions:
        for given in interaction.surfaces:
            if not isinstance(given, Rigid):
                surfaces[given] = cells.surface(problem.mesh.facets_in(given))
    for interaction in problem.interactions:
        disc = interaction.surfaces[0]
        if isinstance(disc, Rigid):
            ends = x[surfaces[interaction.surfaces[1]].nodes[:, :2]]
            length = np.linalg.norm(np.diff(ends, axis=1), axis=2).mean()
            n = int(np.ceil(2 * np.pi * disc.circle.radius / length))
            rim, ring = _ring(disc.circle, n)
            ring += len(x)
            x = np.concatenate([x, rim])
            first = sum(map(len, elements.values()))
            name = surface_name(interaction, 0)
            elements[name] = ring
            node_sets[name] = np.unique(ring)
            edges = np.ones(n, dtype=np.int64)
            surfaces[name] = DeckSurface(first + np.arange(n), edges, ring[:, [1, 2, 5]])
    used = np.unique(np.concatenate([own.ravel() for own in elements.values()]))
    place = np.full(len(x), -1)
    place[used] = np.arange(len(used))
    elements = {name: place[own] for name, own in elements.items()}
    node_sets = {name: place[own][place[own] >= 0] for name, own in node_sets.items()}
    surfaces = {name: replace(s, nodes=place[s.nodes]) for name, s in surfaces.items()}
    return DeckMesh(x[used], used, cells.middles, elements, node_sets, surfaces)


class _Cells:
    """The cells of a system as elements, and the surfaces that lie on them.

    Attributes
    ----------
    x : array (n, 2)
        The nodes, in the order of the system's block dofs.
    elements : dict of arrays (m, 6 or 8)
        Nodes of the elements, counterclockwise, by the names of bodies.
    middles : array (m, 9)
        The nodes of quadrilaterals, with the one in the middle; none of triangles.
    """

    def __init__(self, system: System, bodies: dict[str, Ints]) -> None:
        V = system.V
        mesh = V.mesh
        kind = mesh.basix_cell()
        self.x = V.tabulate_dof_coordinates()[:, :2]
        self._edges = np.array(_EDGES[kind])
        self._corners = corners = len(self._edges)
        self._nodes = nodes = V.dofmap.list[:, _NODES[kind]].astype(np.int64)
        one, two, last = np.moveaxis(self.x[nodes[:, [0, 1, corners - 1]]], 1, 0)
        self._clockwise = np.linalg.det(np.stack([two - one, last - one], axis=1)) < 0
        turned = [0, *range(corners - 1, 0, -1), *range(2 * corners - 1, corners - 1, -1), 8]
        nodes[self._clockwise] = nodes[self._clockwise][:, turned[: nodes.shape[1]]]
        numbered = np.concatenate(list(bodies.values()))
        self._number = np.full(len(nodes), -1)  # of every cell's element
        self._number[numbered] = np.arange(len(numbered))
        self.elements = {name: nodes[own, : 2 * corners] for name, own in bodies.items()}
        is_quadrilateral = kind == basix.CellType.quadrilateral
        self.middles = nodes[numbered] if is_quadrilateral else np.zeros((0, 9), dtype=np.int64)
        mesh.topology.create_connectivity(2, 1)
        self._facets = mesh.topology.connectivity(2, 1).array.reshape(-1, corners)

    def surface(self, facets: Ints) -> DeckSurface:
        """The edges of elements that are these ``facets``."""
        on_surface = np.isin(self._facets, facets) & (self._number >= 0)[:, None]
        cell, facet = np.nonzero(on_surface)
        edge = self._edges[facet]
        edge = np.where(self._clockwise[cell], self._corners - 1 - edge, edge)
        along = np.stack([edge, (edge + 1) % self._corners, edge + self._corners], axis=1)
        return DeckSurface(self._number[cell], edge, self._nodes[cell[:, None], along])


def _ring(circle: RigidCircle, n: int) -> tuple[Array, Ints]:
    """Nodes and ``n`` quadrilaterals of a ring below a circle, whose edges 1 lie on it."""
    angle = np.pi * np.arange(2 * n) / n
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radii = [circle.radius * part for part in (_RIM, (1 + _RIM) / 2, 1.0)]
    x = circle.centre + np.concatenate([radius * ray for radius in radii])
    begin = 2 * np.arange(n)
    end = (begin + 2) % (2 * n)
    corners = [begin, 4 * n + begin, 4 * n + end, end]
    midpoints = [2 * n + begin, 4 * n + begin + 1, 2 * n + end, begin + 1]
    return x, np.stack([*corners, *midpoints], axis=1)

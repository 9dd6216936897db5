"""A problem's mesh as programs of the Abaqus family number it: elements, node sets and surfaces."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from archord.geometry.basis import Array, dimension_of
from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.cells import are_mirrored, lengths
from archord.materials.kinematics import Ints
from archord.postprocess.decks.numbering import numbering
from archord.solver.path.system import System
from archord.solver.problem import Interaction, Rigid

_OF_MIDDLE = np.array([-0.25] * 4 + [0.5] * 4)  # the middle of a quadrilateral of 8 nodes by these
_RIM = 0.8  # inner over outer radius of the ring that stands for a rigid disc


@dataclass(frozen=True)
class DeckSurface:
    """The ``elements`` ``(n,)`` behind a surface, their ``sides`` ``(n,)``, and the nodes ``(n, 3,
    6 or 8)`` of these sides, corners before midpoints: in a plane start, end, midpoint."""

    elements: Ints
    sides: Ints
    nodes: Ints


@dataclass(frozen=True)
class DeckMesh:
    """Nodes ``x`` ``(n, d)`` and per body the nodes ``(m, k)`` of its ``elements``, which turn
    counterclockwise in a plane, corners before midpoints; both are numbered from 0, elements
    through all bodies.

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
        """Nodal forces ``(n, d)`` that do the work of the forces on the dofs."""
        n_dofs = max(len(of_dofs), self.dofs.max() + 1)
        out = np.zeros((n_dofs, self.x.shape[1]))
        out[: len(of_dofs)] = of_dofs
        around = self.middles[:, :8]
        on_middles = out[self.middles[:, 8:]]
        np.add.at(out, around, _OF_MIDDLE[:, None] * on_middles)
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
    """The mesh of ``system``, of degree 2 and on one rank. Raises ValueError for a rigid ball or
    cylinder."""
    problem = system.problem
    of_bodies = {body.name: problem.cells_of(body) for body in problem.bodies}
    cells = _Cells(system, of_bodies)
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
        disc, opposite = interaction.surfaces
        if isinstance(disc, Rigid):
            if not isinstance(disc.circle, RigidCircle):
                raise ValueError("a rigid ball or cylinder cannot be exported; a body can")
            length = lengths(x, surfaces[opposite].nodes).mean()
            rim, ring = _ring(disc.circle, length)
            ring = ring + len(x)
            x = np.concatenate([x, rim])
            n_before = sum(map(len, elements.values()))
            number = n_before + np.arange(len(ring))
            name = surface_name(interaction, 0)
            elements[name] = ring
            node_sets[name] = np.unique(ring)
            edge = np.ones(len(ring), dtype=np.int64)
            surfaces[name] = DeckSurface(number, edge, ring[:, [1, 2, 5]])
    of_elements = [own.ravel() for own in elements.values()]
    used = np.unique(np.concatenate(of_elements))
    place = np.full(len(x), -1)
    place[used] = np.arange(len(used))
    elements = {name: place[own] for name, own in elements.items()}
    for name, own in node_sets.items():
        places = place[own]
        node_sets[name] = places[places >= 0]
    surfaces = {name: replace(s, nodes=place[s.nodes]) for name, s in surfaces.items()}
    return DeckMesh(x[used], used, cells.middles, elements, node_sets, surfaces)


class _Cells:
    """The cells of a system as elements, and the surfaces that lie on them.

    Attributes
    ----------
    x : array (n, d)
        The nodes, in the order of the system's block dofs.
    elements : dict of arrays (m, k)
        Nodes of the elements by the names of bodies.
    middles : array (m, 9)
        The nodes of quadrilaterals, with the one in the middle; none of others.
    """

    def __init__(self, system: System, bodies: dict[str, Ints]) -> None:
        V = system.V
        mesh = V.mesh
        self._kind = mesh.basix_cell()
        d = dimension_of(self._kind)
        self.x = V.tabulate_dof_coordinates()[:, :d]
        self._cells = V.dofmap.list.astype(np.int64)
        self._mirrored = are_mirrored(self._kind, self.x[self._cells])
        nodes = self._numbered("nodes", np.arange(len(self._cells)))
        numbered = np.concatenate(list(bodies.values()))
        self._number = np.full(len(nodes), -1)  # of every cell's element
        self._number[numbered] = np.arange(len(numbered))
        self.elements = {name: nodes[own] for name, own in bodies.items()}
        self.middles = np.zeros((0, 9), dtype=np.int64)
        if self._cells.shape[1] == 9:
            middle = self._cells[numbered, -1:]
            self.middles = np.hstack([nodes[numbered], middle])
        mesh.topology.create_connectivity(d, d - 1)
        facets = mesh.topology.connectivity(d, d - 1).array
        self._facets = facets.reshape(len(self._cells), -1)

    def _numbered(self, part: str, cells: Ints, sides: Ints | None = None) -> Ints:
        """The nodes of ``cells`` ``(n,)`` that a ``part`` of their `Numbering` says, of these
        ``sides`` of them."""
        straight, mirrored = (
            getattr(numbering(self._kind, mirrored=m), part) for m in (False, True)
        )
        tables = np.stack([straight, mirrored])[self._mirrored[cells].astype(int)]
        if sides is not None:
            tables = tables[np.arange(len(cells)), sides]
        return np.take_along_axis(self._cells[cells], tables, axis=1)

    def surface(self, facets: Ints) -> DeckSurface:
        """The sides of elements that are these ``facets``."""
        on_surface = np.isin(self._facets, facets) & (self._number >= 0)[:, None]
        cell, facet = np.nonzero(on_surface)
        straight, mirrored = (numbering(self._kind, mirrored=m).side_of for m in (False, True))
        sides = np.where(self._mirrored[cell], mirrored[facet], straight[facet])
        return DeckSurface(self._number[cell], sides, self._numbered("on_sides", cell, sides))


def _ring(circle: RigidCircle, length: float) -> tuple[Array, Ints]:
    """Nodes ``(6 n, 2)`` and quadrilaterals ``(n, 8)`` of a ring below a circle, whose edges 1 lie
    on it and are not longer than ``length``."""
    n = int(np.ceil(2 * np.pi * circle.radius / length))
    angle = np.pi * np.arange(2 * n) / n
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    radii = [circle.radius * part for part in (_RIM, (1 + _RIM) / 2, 1.0)]
    x = circle.centre + np.concatenate([radius * ray for radius in radii])
    begin = 2 * np.arange(n)
    end = (begin + 2) % (2 * n)
    corners = [begin, 4 * n + begin, 4 * n + end, end]
    midpoints = [2 * n + begin, 4 * n + begin + 1, 2 * n + end, begin + 1]
    return x, np.stack([*corners, *midpoints], axis=1)

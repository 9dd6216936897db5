"""The lines of a deck that tie surfaces: in a plane or around an axis an equation a node, in space
how far ``*TIE`` reaches.

CalculiX makes bricks of plane elements, and ``*TIE`` cannot take most of the nodes that it adds. It
says so in warnings, and goes on with what is left. (CalculiX CrunchiX 2.20, found with two blocks
under tension.)
"""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.meshes.cells import lengths
from archord.materials.kinematics import Ints
from archord.postprocess.decks.mesh import DeckSurface, label, surface_name
from archord.postprocess.decks.model import DeckModel
from archord.postprocess.decks.rows import number
from archord.presets.held import drawn_gaps
from archord.solver.problem import Interaction

_ITERATIONS = 30
_BEYOND = 1e-6  # how far beyond the end of an edge a node is on it, in half its length
_SMALL = 1e-12  # a weight that is round-off
_TOUCHING = 1e-3  # of the shortest edge: a gap within the default reach, 0.025 of a typical one
_REACH = 2.0  # over the largest gap at contact points, as nodes can be farther apart


class Ties:
    """Nodes of a surface of every tie as parts of the edges that they are tied to.

    Attributes
    ----------
    dependent : dict
        By a tied (node, axis) the nodes that its equation has.
    """

    def __init__(self, model: DeckModel) -> None:
        self._model = model
        self._taken = {(int(node), m.axis) for m in model.moved for node in m.nodes}
        self.dependent: dict[tuple[int, int], Ints] = {}

    def lines(self, interaction: Interaction) -> list[str]:
        """The lines of a tied ``interaction``. What is held or moved already is not tied, so that
        the surface is tied to the other one that has less of it; in a plane the finer one, if both
        have as much."""
        mesh = self._model.mesh
        in_plane = mesh.x.shape[1] == 2

        def order(name: str) -> tuple[int, float]:
            surface = mesh.surfaces[name]
            length = lengths(mesh.x, surface.nodes).mean() if in_plane else 0.0
            return self._n_taken(surface), length

        both = [surface_name(interaction, side) for side in (0, 1)]
        names = sorted(both, key=order)
        if in_plane:
            tied, opposite = (mesh.surfaces[name] for name in names)
            return self._equations(tied, opposite)
        over_gap = reach(self._model, interaction)
        tie = f"*TIE, NAME={label(interaction.name)}, ADJUST=NO{over_gap}"
        return [tie, ", ".join(f"{label(name)}_SURFACE" for name in names)]

    def _equations(self, tied: DeckSurface, opposite: DeckSurface) -> list[str]:
        """An equation for each free node and axis of the surface that is ``tied``."""
        mesh = self._model.mesh
        nodes = np.unique(tied.nodes)
        edge, weights = closest_on_edges(mesh.x[nodes], mesh.x[opposite.nodes])
        lines = []
        for k in np.flatnonzero(edge >= 0):
            node = int(nodes[k])
            large = np.abs(weights[k]) > _SMALL
            others = opposite.nodes[edge[k]][large]
            for axis in (0, 1):
                if self._is_free(node, axis, others):
                    self.dependent[node, axis] = others
                    lines += _equation(node, axis, others, weights[k][large])
        return lines

    def _n_taken(self, surface: DeckSurface) -> int:
        nodes = np.unique(surface.nodes)
        axes = range(self._model.mesh.x.shape[1])
        return sum((int(node), axis) in self._taken for node in nodes for axis in axes)

    def _is_free(self, node: int, axis: int, others: Ints) -> bool:
        """Whether the node can be made to depend on ``others``, none of which depends on it."""
        if (node, axis) in self._taken or (node, axis) in self.dependent:
            return False
        return not any(node in self.dependent.get((int(n), axis), ()) for n in others)


def reach(model: DeckModel, interaction: Interaction) -> str:
    """The parameter of ``*TIE`` in space that lets it tie surfaces over the gap that they are drawn
    with; empty where they touch. Without it nodes are left loose, and warnings alone say so."""
    pairs = model.system.contact.interface(interaction.name).pairs
    gap = float(np.abs(np.concatenate([*map(drawn_gaps, pairs)])).max(initial=0.0))
    shortest = np.inf
    for side in (0, 1):
        nodes = model.mesh.surfaces[surface_name(interaction, side)].nodes
        n_corners = nodes.shape[1] // 2
        corners = model.mesh.x[nodes[:, :n_corners]]
        edges = np.roll(corners, 1, axis=1) - corners
        lengths = np.linalg.norm(edges, axis=2)
        shortest = min(shortest, float(lengths.min()))
    if gap <= _TOUCHING * shortest:
        return ""
    return f", POSITION TOLERANCE={number(_REACH * gap)}"


def closest_on_edges(x: Array, edges: Array) -> tuple[Ints, Array]:
    """The closest of ``edges`` ``(m, 3, 2)`` (start, end, midpoint) to each point ``x`` ``(n, 2)``:
    its number ``(n,)``, -1 where a point lies beyond all ends, and the ``weights`` ``(n, 3)`` of
    its nodes at the closest point."""
    start, end, middle = (edges[None, :, k] for k in range(3))
    slope = (end - start) / 2
    bend = (start + end) / 2 - middle
    points = x[:, None]

    def off(t: Array) -> Array:
        return middle + t * slope + t**2 * bend - points

    t = np.clip(_dot(points - middle, slope) / _dot(slope, slope), -2, 2)
    for _ in range(_ITERATIONS):
        along = slope + 2 * t[..., None] * bend
        step = _dot(off(t[..., None]), along) / _dot(along, along)
        t = np.clip(t - step, -2, 2)
    distance = np.linalg.norm(off(t[..., None]), axis=-1)
    distance[np.abs(t) > 1 + _BEYOND] = np.inf
    nearest = distance.argmin(axis=1)
    every = np.arange(len(x))
    at = t[every, nearest]
    first = at * (at - 1) / 2
    last = at * (at + 1) / 2
    middle = 1 - at**2
    weights = np.stack([first, last, middle], axis=1)
    return np.where(np.isfinite(distance[every, nearest]), nearest, -1), weights


def _dot(a: Array, b: Array) -> Array:
    return (a * b).sum(axis=-1)


def _equation(node: int, axis: int, others: Ints, weights: Array) -> list[str]:
    words = [f"{node + 1}, {axis + 1}, {number(1)}"]
    words += [
        f"{other + 1}, {axis + 1}, {number(-weight)}"
        for other, weight in zip(others, weights, strict=True)
    ]
    return ["*EQUATION", str(len(words)), ", ".join(words)]

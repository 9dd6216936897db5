"""Prescribed displacements of nodes, and what holds where the sets of several supports share a
node.

What fixes a node wins over a displacement. Whatever else meets at a node must move it alike. So the
order of supports has no part in a result.

Nodes on the axis of an axisymmetric problem cannot move away from it, whatever the supports say:
their radial displacement is prescribed, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.meshes.quality import place
from archord.materials.kinematics import Ints
from archord.report.by_name import Amounts
from archord.solver.problem import Dirichlet, Drive, Problem

_ALIKE = 1e-9  # of the larger of two displacements: a difference that is round-off
Place = tuple[float, ...]


@dataclass
class _Motion:
    """What the supports of one name prescribe for one set along one axis.

    nodes : (k,) block dofs on this rank, ghosts included
    rate : (l, k) their displacement per unit of each drive
    moves : whether any drive moves the set; if not, it is fixed
    together : whether the set must move as one, as it does under a force, or where other axes are
        prescribed, too
    """

    name: str
    facets: str
    axis: int
    nodes: Ints
    rate: Array
    moves: bool = False
    together: bool = False

    def __str__(self) -> str:
        where = "" if self.name == self.facets else f" (on {self.facets!r})"
        return f"{self.name!r}{where}"


class Prescribed:
    """What the supports of ``problem`` prescribe for the nodes of ``V``, by its ``drives``.
    Collective.

    names : names of the supports
    rate : (l, n_local, d) displacements of the nodes per unit of each drive
    holder : (n_local, d) number of the name that a displacement is prescribed by, the last of
        several; -1 if it is free, the number behind the last if the kinematics demand it
    warnings : displacements that nodes do not follow, as supports fix them

    Raises ValueError on all ranks where supports contradict each other, or nodes lie beyond the
    axis.
    """

    def __init__(self, problem: Problem, V: fem.FunctionSpace, drives: list[Drive]) -> None:
        kinematics = problem.kinematics
        d = kinematics.dimension
        self._problem = problem
        self._V = V
        self._drives = drives
        self._comm = V.mesh.comm
        self._axes = kinematics.axes
        self._x = V.tabulate_dof_coordinates()[:, :d]
        self._size = self._comm.allreduce(np.abs(self._x).max(initial=0.0), op=MPI.MAX)
        n_local = len(self._x)
        self.names = list(dict.fromkeys(s.name for s in problem.supports))
        self.rate = np.zeros((len(drives), n_local, d))
        self.holder = np.full((n_local, d), -1)
        self.warnings: list[str] = []
        self._holds = np.zeros((len(self.names), n_local, d), dtype=bool)
        self._course = _courses(drives)
        motions = self._collected()
        fixing = [motion for motion in motions if not motion.moves]
        moving = [motion for motion in motions if motion.moves]
        for motion in fixing:
            self._note(motion, motion.nodes)
        if kinematics.has_hoop:
            fixing.append(self._axis())
        self._prescribe(moving, fixing)

    def _axis(self) -> _Motion:
        """The axis, which its nodes do not leave."""
        r = self._x[:, 0]
        near = _ALIKE * self._size
        is_beyond = bool((r < -near).any())
        if self._comm.allreduce(is_beyond, op=MPI.LOR):
            raise ValueError("axisymmetric bodies have no places at x < 0: x is the radius")
        nodes = np.flatnonzero(r <= near)
        held = self.holder[:, 0]
        by_supports = held[nodes]
        held[nodes] = np.where(by_supports < 0, len(self.names), by_supports)
        return _Motion("the axis", "the axis", 0, nodes, self._at_rest(nodes))

    def _at_rest(self, nodes: Ints) -> Array:
        """Rates ``(l, k)`` of ``nodes`` that no drive moves."""
        return np.zeros((len(self._drives), len(nodes)))

    def _prescribe(self, moving: list[_Motion], fixing: list[_Motion]) -> None:
        """Prescribe what moves, where nothing fixes it. Raises ValueError for contradictions."""
        fixed = self.holder >= 0
        sizes = [np.abs(self._displaced(motion)).max(initial=0.0) for motion in moving]
        largest = np.array(sizes)
        self._comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        # along an axis in which a turn displaces nothing all is round-off
        of_name: Amounts = {}
        for motion, size in zip(moving, largest, strict=True):
            of_name[motion.name] = max(size, of_name.get(motion.name, 0.0))
        round_off = _ALIKE * np.array([of_name[motion.name] for motion in moving])
        self._require_free(moving, fixing, fixed, round_off)
        self._require_alike(moving, fixed, round_off)
        meeting = np.zeros(self.holder.shape)
        for motion in moving:
            free = ~fixed[motion.nodes, motion.axis]
            nodes = motion.nodes[free]
            self._note(motion, nodes)
            self.rate[:, nodes, motion.axis] += motion.rate[:, free]
            meeting[nodes, motion.axis] += 1
        self.rate /= np.maximum(meeting, 1)

    def share_of(self, name: str) -> Array:
        """The part ``(n_local, d)`` of the reaction at each node that is of the supports ``name``:
        equal parts where several hold a node."""
        if name not in self.names:
            return np.zeros(self.holder.shape)
        held = self._holds[self.names.index(name)]
        n_holding = self._holds.sum(axis=0)
        return held / np.maximum(n_holding, 1)

    def _collected(self) -> list[_Motion]:
        """All motions, sorted by their names. Raises ValueError for a drive that is given twice."""
        found: dict[tuple[str, str, int], _Motion] = {}
        given: set[tuple[str, str, int, str]] = set()
        number = {drive.name: k for k, drive in enumerate(self._drives)}
        by_force = {drive.name for drive in self._drives if drive.control == "force"}
        for s in self._problem.supports:
            key = s.name, s.facets, s.axis
            if key not in found:
                nodes = self._problem.mesh.dofs_in(self._V, s.facets)
                found[key] = _Motion(*key, nodes, self._at_rest(nodes))
            if not s.moves:
                continue
            if (*key, s.drive) in given:
                axis = self._axes[s.axis]
                raise ValueError(
                    f"{s.name!r} gives {s.facets!r} two rates in {axis} by the drive {s.drive!r}"
                )
            given.add((*key, s.drive))
            motion = found[key]
            motion.rate[number[s.drive]] = self._rate(s, motion.nodes)
            motion.moves = True
            motion.together |= s.drive in by_force
        for (name, facets, axis), motion in found.items():
            others = set(range(len(self._axes))) - {axis}
            motion.together |= any((name, facets, other) in found for other in others)
        return [found[key] for key in sorted(found)]

    def _rate(self, support: Dirichlet, nodes: Ints) -> Array | float:
        return support.rate(self._x[nodes]) if callable(support.rate) else support.rate

    def _note(self, motion: _Motion, nodes: Ints) -> None:
        name = self.names.index(motion.name)
        self.holder[nodes, motion.axis] = name
        self._holds[name, nodes, motion.axis] = True

    def _displaced(self, motion: _Motion) -> Array:
        """What tells apart how the motion's nodes are displaced along the path ``(k, d)``."""
        return motion.rate.T @ self._course

    def _require_free(
        self, moving: list[_Motion], fixing: list[_Motion], fixed: np.ndarray, round_off: Array
    ) -> None:
        """Warn where a motion meets what fixes. Raises ValueError where that leaves nothing of it,
        or bends a set that must move as one."""
        free = np.zeros(len(moving), dtype=np.int64)
        met: list[tuple[int, int, Place]] = []
        for m, motion in enumerate(moving):
            held = fixed[motion.nodes, motion.axis]
            free[m] = np.count_nonzero(~held)
            away = np.abs(self._displaced(motion)).max(axis=1, initial=0.0) > round_off[m]
            stopped = motion.nodes[held & away]
            for f, fix in enumerate(fixing):
                if fix.axis == motion.axis:
                    common = np.intersect1d(stopped, fix.nodes)
                    met += self._first_place(m, f, common)
        free = self._comm.allreduce(free)
        for m, f, x in self._everywhere(met):
            motion = moving[m]
            fix = fixing[f]
            axis = self._axes[motion.axis]
            at = place(x)
            if not free[m]:
                raise ValueError(
                    f"{motion} moves nothing: supports fix all its nodes in {axis}, "
                    f"{fix} the one at {at}; move another set, or fix less"
                )
            if motion.together:
                raise ValueError(
                    f"{fix} fixes the node at {at} in {axis}, which {motion} moves together "
                    f"with all its set: fix what moves the set in {axis}, too, leave the node out "
                    "of one of the sets, or load the set by a pressure or a distributing coupling"
                )
            self.warnings.append(
                f"{fix} fixes nodes that {motion} would move in {axis}, as at {at}: "
                "they stay where they are, and the stress beside them grows as the mesh gets finer"
            )

    def _require_alike(self, moving: list[_Motion], fixed: np.ndarray, round_off: Array) -> None:
        """Raise ValueError where two motions of a node that nothing fixes differ."""
        met: list[tuple[int, int, Place]] = []
        for a, b in combinations(range(len(moving)), 2):
            first = moving[a]
            second = moving[b]
            if first.axis != second.axis:
                continue
            common, i, j = np.intersect1d(first.nodes, second.nodes, return_indices=True)
            difference = np.abs(self._displaced(first)[i] - self._displaced(second)[j])
            unlike = difference.max(axis=1, initial=0.0) > max(round_off[a], round_off[b])
            is_free = ~fixed[common, first.axis]
            met += self._first_place(a, b, common[unlike & is_free])
        for a, b, x in self._everywhere(met):
            raise ValueError(
                f"{moving[a]} and {moving[b]} move their common node at {place(x)} "
                f"differently in {self._axes[moving[a].axis]}: leave it out of one of the sets, "
                "let both move alike, or load one of them by a pressure or a distributing coupling"
            )

    def _first_place(self, a: int, b: int, nodes: Ints) -> list[tuple[int, int, Place]]:
        """Where the motions ``a`` and ``b`` meet first, by coordinates, at ``nodes`` of this
        rank; nothing without any."""
        digits = _ALIKE * self._size
        rounded = np.round(self._x[nodes] / digits) * digits + 0.0
        places = [tuple(x) for x in rounded.tolist()]
        return [(a, b, min(places))] if places else []

    def _everywhere(self, met: list[tuple[int, int, Place]]) -> list[tuple[int, int, Place]]:
        """What met on any rank, each pair once, in an order that all ranks agree on. Collective."""
        first: dict[tuple[int, int], Place] = {}
        for a, b, x in sorted(found for here in self._comm.allgather(met) for found in here):
            first.setdefault((a, b), x)
        return [(a, b, x) for (a, b), x in first.items()]


def _courses(drives: list[Drive]) -> Array:
    """What tells drives apart ``(d, d)``: rows of drives that move alike along the path are equal.

    Displacements are compared at the load factors 0, 1, 2, ..., where paths have their corners. A
    drive under a force, whose displacement is unknown, is like itself alone. Rows keep their scalar
    products when columns are reduced to d.
    """
    count = len(drives)
    factors = np.arange(max((len(drive.path) for drive in drives), default=0) + 2.0)
    courses = np.zeros((count, len(factors) + count))
    for k, drive in enumerate(drives):
        if drive.control == "force":
            courses[k, len(factors) + k] = 1.0
        else:
            courses[k, : len(factors)] = drive.values(factors)
    reduced: Array = np.asarray(np.linalg.qr(courses.T, mode="r"))
    return reduced.T

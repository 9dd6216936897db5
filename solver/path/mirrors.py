"""The lines and planes in which a part of a problem is mirrored.

A part tells how often it makes up the whole, not where its mirrors are. They are the flat sets of
facets at an end of the mesh that are held across themselves alone.
"""

from __future__ import annotations

from collections import defaultdict
from typing import NamedTuple

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.solver.problem import Problem

_FLAT = 1e-6  # of the size of the mesh: coordinates of files have so many digits


class Mirror(NamedTuple):
    """A plane across an axis, in a plane a line.

    - ``axis``: number of the axis
    - ``at``: the coordinate of the mirror along it
    - ``near``: the distance within which points are in the mirror
    - ``nodes``: block dofs ``(n,)`` in the mirror, on this rank, ghosts included
    """

    axis: int
    at: float
    near: float
    nodes: np.ndarray


def mirrors_of(problem: Problem, V: fem.FunctionSpace) -> list[Mirror]:
    """The mirrors of a ``problem`` whose displacements are in ``V``; none where more sets are held
    so than the part has mirrors, as nothing tells which of them are rollers. Collective."""
    if problem.symmetry == 1:
        return []
    found = flat_held(problem, V)
    if 2 ** len(found) > problem.symmetry:
        return []
    return found


def flat_held(problem: Problem, V: fem.FunctionSpace) -> list[Mirror]:
    """The flat sets of facets at an end of the mesh that are held across themselves alone: mirrors
    or rollers. Collective."""
    d = problem.kinematics.dimension
    x = V.tabulate_dof_coordinates()[:, :d]
    lowest, highest = _ends(V.mesh.comm, x)
    near = _FLAT * float((highest - lowest).max())
    found: dict[tuple[int, float], list[np.ndarray]] = defaultdict(list)
    for facets, axis in _held_across(problem).items():
        nodes = problem.mesh.dofs_in(V, facets)
        first, last = _ends(V.mesh.comm, x[nodes])
        if last[axis] - first[axis] > near:
            continue
        for end in (lowest[axis], highest[axis]):
            if abs(first[axis] - end) < near:
                found[axis, float(end)].append(nodes)
    return [
        Mirror(axis, at, near, np.unique(np.concatenate(nodes)))
        for (axis, at), nodes in sorted(found.items())
    ]


def _held_across(problem: Problem) -> dict[str, int]:
    """The axis of each set of facets that is held along one axis, and moved along none."""
    prescribed: dict[str, set[int]] = defaultdict(set)
    moved = set()
    for support in problem.supports:
        prescribed[support.facets].add(support.axis)
        if support.moves:
            moved.add(support.facets)
    sets = problem.mesh.facet_sets
    return {
        facets: min(axes)
        for facets, axes in sorted(prescribed.items())
        if len(axes) == 1 and facets in sets and facets not in moved
    }


def _ends(comm: MPI.Comm, x: Array) -> tuple[Array, Array]:
    """The lowest and the highest coordinates ``(d,)`` of points ``x`` ``(n, d)`` on all ranks."""
    ends = np.concatenate([-x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
    d = x.shape[1]
    return -ends[:d], ends[d:]

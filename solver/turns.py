"""Finite rotations of rigid couplings in space, at large strain.

The rotation vector is the vector of the levels of three drives, whose rates are the linear
rotation. What the rotation matrix, its exponential, displaces beyond that is added here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from archord.geometry.basis import Array
from archord.solver.conditions import Turn

_SKEW = np.array([np.cross(axis, np.eye(3)).T for axis in np.eye(3)])  # e_k x, (3, 3, 3)
_SKEW.flags.writeable = False


@dataclass(frozen=True)
class _Turned:
    """What one coupling turns.

    nodes : (k,) nodes on this rank, ghosts included
    arms : (k, 3) from the reference point to them
    held : (k, 3) whether the coupling prescribes their displacement
    levels : (3,) the levels of its rotation vector, -1 where it does not turn
    """

    nodes: np.ndarray
    arms: Array
    held: np.ndarray
    levels: np.ndarray

    def generator(self, levels: Array) -> Array:
        """The cross product ``(3, 3)`` with the rotation vector."""
        vector = np.where(self.levels < 0, 0.0, levels[self.levels])
        return np.tensordot(vector, _SKEW, 1)


class Turns:
    """The finite rotations of the conditions ``turns``, by the ``names`` of drives and the
    ``nodes`` at ``x`` of each, which it holds where ``held``."""

    def __init__(self, turned: Sequence[_Turned] = ()) -> None:
        self._turned = turned

    @classmethod
    def of(
        cls, turns: Sequence[Turn], names: Sequence[str], x: Array, held: dict[str, np.ndarray]
    ) -> Turns:
        """The ``turns`` by drives of these ``names``, of nodes at ``x`` ``(n, 3)``;
        ``held`` ``(n, 3)`` says which displacements each name prescribes."""
        found: list[_Turned] = []
        for turn in turns:
            mask = held[turn.name]
            nodes = np.flatnonzero(mask.any(axis=1))
            levels = [names.index(drive) if drive else -1 for drive in turn.drives]
            arms = x[nodes] - np.array(turn.point)
            found.append(_Turned(nodes, arms, mask[nodes], np.array(levels)))
        return cls(found)

    def displace(self, u: Array, levels: Array) -> None:
        """Add to displacements ``u`` ``(n, 3)`` what rotations are beyond linear ones."""
        from scipy.linalg import expm

        for turned in self._turned:
            spin = turned.generator(levels)
            beyond = turned.arms @ (expm(spin) - np.eye(3) - spin).T
            u[turned.nodes] += np.where(turned.held, beyond, 0.0)

    def moments(self, levels: Array, reaction: Array) -> Array:
        """What the ``reaction`` ``(n_owned, 3)`` adds to the conjugates ``(l,)`` of the levels."""
        from scipy.linalg import expm_frechet

        moments = np.zeros(len(levels))
        for turned in self._turned:
            spin = turned.generator(levels)
            own = turned.nodes < len(reaction)
            forces = np.where(turned.held, 1.0, 0.0)[own] * reaction[turned.nodes[own]]
            for axis, level in enumerate(turned.levels):
                if level >= 0:
                    rate = expm_frechet(spin, _SKEW[axis], compute_expm=False) - _SKEW[axis]
                    moments[level] += (forces * (turned.arms[own] @ rate.T)).sum()
        return moments

"""Finite rotations of rigid couplings at large strain.

The rotation vector is the vector of the levels of three drives, in a plane of one, whose rates are
the linear rotation. What the rotation matrix, its exponential, displaces beyond that is added here.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from archord.geometry.basis import Array
from archord.materials.kinematics import Bools
from archord.solver.conditions import Turn

# e_k x: (3, 3, 3), in a plane (1, 2, 2)
_IN_SPACE = np.array([np.cross(axis, np.eye(3)).T for axis in np.eye(3)])
_SKEW = {2: _IN_SPACE[2:, :2, :2], 3: _IN_SPACE}


class FiniteTurn:
    """The finite rotation of a ``turn`` by drives of these ``names``, of nodes at ``x`` ``(n, d)``.

    held : (n, d) whether it prescribes a displacement
    arms : (n, d) from the reference point
    skew : (t, d, d) the linear rotations
    levels : (t,) numbers of the drives; behind the last one where it does not turn
    """

    def __init__(self, turn: Turn, names: Sequence[str], x: Array, held: Bools) -> None:
        self.held = held
        self.arms = x - np.array(turn.point)
        self.skew = _SKEW[x.shape[1]]
        numbers = {name: level for level, name in enumerate(names)}
        self.levels = [numbers.get(drive, len(names)) for drive in turn.drives]

    def _spin(self, levels: Array) -> Array:
        """The cross product ``(d, d)`` with the rotation vector."""
        return np.tensordot(np.append(levels, 0.0)[self.levels], self.skew, 1)

    def displace(self, u: Array, levels: Array) -> None:
        """Add to displacements ``u`` ``(n, d)`` what the rotation is beyond a linear one."""
        from scipy.linalg import expm

        spin = self._spin(levels)
        u += self.held * (self.arms @ (expm(spin) - np.eye(len(spin)) - spin).T)

    def add_moments(self, conjugates: Array, levels: Array, reaction: Array) -> None:
        """Add to the ``conjugates`` ``(l,)`` of the levels what the ``reaction`` ``(n_owned, d)``
        does on the rotation beyond a linear one."""
        from scipy.linalg import expm_frechet

        spin = self._spin(levels)
        n = len(reaction)
        moment = (self.held[:n] * reaction).T @ self.arms[:n]
        for level, unit in zip(self.levels, self.skew, strict=True):
            if level < len(levels):
                rate = expm_frechet(spin, unit, compute_expm=False)
                conjugates[level] += (moment * (rate - unit)).sum()

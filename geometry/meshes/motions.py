"""Which rigid motions nothing prevents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import compress

import numpy as np
from scipy.linalg import null_space

from archord.geometry.basis import Array

PLANE: Sequence[str] = ("x", "y", "rotation")
SPACE: Sequence[str] = ("x", "y", "z", "rotation x", "rotation y", "rotation z")
AXISYMMETRIC: Sequence[str] = ("y",)  # along the axis
_FREE = 1e-8  # singular value over the largest one, below which a motion is free

Holds = Sequence[tuple[Array, Array]]
Links = Sequence[tuple[str, str, Array, Array]]


def free_motions(
    held: Mapping[str, Holds], links: Links = (), motions: Sequence[str] = PLANE
) -> dict[str, list[str]]:
    """Which of the rigid ``motions`` nothing prevents, by body.

    Each body is ``held`` at points ``(k, d)`` in directions ``(k, d)``, or ``(k, len(motions))``
    along motions themselves. Two bodies hold each other likewise by ``links``: contact without
    friction along its normals, ties in all directions.
    """
    bodies = list(held)
    everything = [(a, a, x, n) for a, holds in held.items() for x, n in holds]
    everything += links
    size = max((np.ptp(x, axis=0).max() for _, _, x, _ in everything), default=0.0) or 1.0
    centre = {name: x[0] for a, b, x, _ in reversed(everything) for name in (a, b)}
    rows = [np.zeros((1, len(bodies), len(motions)))]
    for a, b, x, n in everything:
        row = np.zeros((len(x), len(bodies), len(motions)))
        for body, sign in {b: -1, a: 1}.items():
            row[:, bodies.index(body)] = sign * _along(n, (x - centre[body]) / size, motions)
        rows.append(row)
    matrix = np.concatenate(rows)
    free = np.zeros((len(bodies), len(motions)), dtype=bool)
    # rotations first, which translations can be a part of, then translations alone
    translations = np.array([not motion.startswith("rotation") for motion in motions])
    for kept in (np.ones_like(translations), translations):
        reduced = np.linalg.qr(matrix[:, :, kept].reshape(len(matrix), -1), mode="r")
        modes = null_space(reduced, rcond=_FREE)
        free[:, kept] = (np.abs(modes) > _FREE).any(axis=1).reshape(len(bodies), -1)
    return {name: list(compress(motions, moves)) for name, moves in zip(bodies, free, strict=True)}


def _along(n: Array, x: Array, motions: Sequence[str]) -> Array:
    """By how much each of the unit ``motions`` moves the points ``x`` ``(k, d)`` along ``n`` ``(k,
    d)``."""
    if n.shape[1] == len(motions):
        return n
    moved: dict[str, Array] = dict(zip("xyz", n.T, strict=False))
    if x.shape[1] == 3:
        moved |= zip(SPACE[3:], np.cross(x, n).T, strict=True)
    else:
        moved["rotation"] = x[:, 0] * n[:, 1] - x[:, 1] * n[:, 0]
    return np.column_stack([moved[motion] for motion in motions])

"""Which rigid motions nothing prevents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import compress

import numpy as np
from scipy.linalg import null_space

from archord.geometry.basis import Array

PLANE: Sequence[str] = ("x", "y", "rotation")
AXISYMMETRIC: Sequence[str] = ("y",)  # along the axis
_FREE = 1e-8  # singular value over the largest one, below which a motion is free

Holds = Sequence[tuple[Array, Array]]
Links = Sequence[tuple[str, str, Array, Array]]


def free_motions(
    held: Mapping[str, Holds], links: Links = (), motions: Sequence[str] = PLANE
) -> dict[str, list[str]]:
    """Which of the rigid ``motions`` nothing prevents, by body.

    Each body is ``held`` at points ``(k, 2)`` in directions ``(k, 2)``. Two bodies hold each other
    likewise by ``links``: contact without friction along its normals, ties in both directions.
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
            along = _along(n, (x - centre[body]) / size)
            moved = [along[motion] for motion in motions]
            row[:, bodies.index(body)] = sign * np.column_stack(moved)
        rows.append(row)
    matrix = np.concatenate(rows)
    free = np.zeros((len(bodies), len(motions)), dtype=bool)
    # rotations first, which translations can be a part of, then translations alone
    translations = np.array([motion != "rotation" for motion in motions])
    for kept in (np.ones_like(translations), translations):
        reduced = np.linalg.qr(matrix[:, :, kept].reshape(len(matrix), -1), mode="r")
        modes = null_space(reduced, rcond=_FREE)
        free[:, kept] = (np.abs(modes) > _FREE).any(axis=1).reshape(len(bodies), -1)
    return {name: list(compress(motions, moves)) for name, moves in zip(bodies, free, strict=True)}


def _along(n: Array, x: Array) -> dict[str, Array]:
    """By how much each unit motion moves the points ``x`` ``(k, 2)`` along ``n`` ``(k, 2)``."""
    return {"x": n[:, 0], "y": n[:, 1], "rotation": x[:, 0] * n[:, 1] - x[:, 1] * n[:, 0]}

"""Which rigid motions nothing prevents."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import compress

import numpy as np
from scipy.linalg import null_space

from archord.geometry.basis import Array
from archord.geometry.vectors import crossed
from archord.materials.material import Arrays

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
    own = [(body, body, x, n) for body, holds in held.items() for x, n in holds]
    matrix = _prevented(list(held), [*own, *links], motions)
    free = np.zeros(matrix.shape[1:], dtype=bool)
    # rotations first, which translations can be a part of, then translations alone
    is_translation = np.array([not motion.startswith("rotation") for motion in motions])
    all_motions = np.ones_like(is_translation)
    for kept in (all_motions, is_translation):
        of_kept = matrix[:, :, kept]
        conditions = of_kept.reshape(len(matrix), -1)
        reduced = np.linalg.qr(conditions, mode="r")
        modes = null_space(reduced, rcond=_FREE)
        moves = (np.abs(modes) > _FREE).any(axis=1)
        free[:, kept] = moves.reshape(of_kept.shape[1:])
    return {body: list(compress(motions, moves)) for body, moves in zip(held, free, strict=True)}


def _prevented(bodies: Sequence[str], links: Links, motions: Sequence[str]) -> Array:
    """How much every unit motion of every body violates each condition of the ``links``: a matrix
    ``(conditions, bodies, motions)``. A body that is held links to itself. Rotations are about a
    body's first point, and lengths are in sizes of the largest link."""
    sizes = [np.ptp(x, axis=0).max() for _, _, x, _ in links]
    size = max(sizes, default=0.0) or 1.0
    centre = {body: x[0] for a, b, x, _ in reversed(links) for body in (a, b)}
    blocks = [np.zeros((1, len(bodies), len(motions)))]
    for a, b, x, n in links:
        block = np.zeros((len(x), len(bodies), len(motions)))
        for body, sign in {b: -1, a: 1}.items():
            ray = (x - centre[body]) / size
            block[:, bodies.index(body)] = sign * _along(n, ray, motions)
        blocks.append(block)
    return np.concatenate(blocks)


def _along(n: Array, x: Array, motions: Sequence[str]) -> Array:
    """By how much each of the unit ``motions`` moves the points ``x`` ``(k, d)`` along ``n`` ``(k,
    d)``."""
    if n.shape[1] == len(motions):
        return n
    moved: Arrays = dict(zip("xyz", n.T, strict=False))
    if x.shape[1] == 3:
        moments = np.cross(x, n)
        moved |= zip(SPACE[3:], moments.T, strict=True)
    else:
        moved["rotation"] = crossed(x, n)
    return np.column_stack([moved[motion] for motion in motions])

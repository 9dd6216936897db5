"""What is told of the contact along a surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from archord.measures.edge import SurfaceProfile


def profile(chords: list[tuple[float, float]], pressed: list[bool]) -> SurfaceProfile:
    """Facets on the x axis, from one end to the other, of one point at each end; a facet that is
    ``pressed`` carries a pressure of 1."""
    ends = np.array(chords, dtype=float)
    X = np.stack([ends, np.zeros_like(ends)], axis=-1)
    weight = np.abs(np.diff(ends, axis=1)) / 2 * np.ones(2)
    raw = np.where(pressed, 1.0, 0.0)[:, None] * np.ones(2)
    zero = np.zeros_like(raw)
    return SurfaceProfile(
        s=ends,
        weight=weight,
        coordinates=X,
        pressure=raw,
        raw_pressure=raw,
        gap=zero,
        X=X,
        slip=zero,
    )


ONE_PIECE = [(0, 1), (1, 2), (2, 3), (3, 4)]
TWO_PIECES = [(0, 1), (1, 2), (5, 6), (6, 7)]
RING = [(0, 1), (1, 2), (2, 1), (1, 0)]  # there and back: its end is its start


@pytest.mark.parametrize(
    ("chords", "pressed", "arcs"),
    [
        (ONE_PIECE, [0, 0, 0, 0], 0),
        (ONE_PIECE, [1, 1, 1, 1], 1),
        (ONE_PIECE, [1, 0, 1, 1], 2),
        (ONE_PIECE, [1, 0, 0, 1], 2),
        (TWO_PIECES, [1, 1, 1, 1], 2),
        (TWO_PIECES, [0, 1, 1, 0], 2),
        (TWO_PIECES, [0, 0, 1, 1], 1),
        (TWO_PIECES, [1, 0, 1, 0], 2),
        (RING, [1, 0, 0, 1], 1),
        (RING, [1, 1, 1, 1], 1),
        (RING, [0, 1, 0, 1], 2),
    ],
)
def test_arcs_of_pieces_that_lie_apart_are_counted_apart(chords, pressed, arcs):
    """Stretches under pressure end where the surface does; on a ring the last and the first facet
    meet."""
    assert profile(chords, list(map(bool, pressed))).n_arcs == arcs


@pytest.mark.parametrize("radius", [0.01, 100.0])
def test_arcs_are_told_apart_by_lengths_not_by_the_areas_of_rings(radius):
    """The weights of a body of revolution hold 2 pi r, which gaps must not be compared with."""
    plane = profile(TWO_PIECES, [True] * 4)
    ring = replace(plane, weight=2 * np.pi * radius * plane.weight)
    assert ring.n_arcs == plane.n_arcs == 2

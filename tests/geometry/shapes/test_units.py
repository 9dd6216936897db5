"""Drawings that do not depend on the unit of length, to the last bit: gmsh makes other triangles of
other bits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from archord import boxes, rectangles
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.shapes.sketch import in_radii

INCH = 1 / 25.4
DRAWINGS = {
    "a bushed lug": (9.5, [9.55, 24.0, 26.0, 72.0, 0.38, 2.0, 0.02]),
    "a bushing": (10.0, [10.05, 14.0, 13.98, 30.0, 1.0]),
    "a lug": (9.9, [9.9 + 0.1, 20.0, 20.0, 60.0, 0.495]),
    "an inner plate": (9.95, [22.5, 22.5, 67.5]),
}


@pytest.mark.parametrize("unit", [1e-3, 1e3, 1e6, INCH])
@pytest.mark.parametrize(("radius", "lengths"), DRAWINGS.values(), ids=DRAWINGS)
def test_lengths_over_the_radius_have_the_same_bits(radius, lengths, unit):
    """In all units, as the quotients in millimetres."""
    found = in_radii(radius * unit, *(length * unit for length in lengths))
    assert found == [length / radius for length in lengths]


@pytest.mark.parametrize("unit", [1e-3, INCH])
@pytest.mark.parametrize("lengths", [[math.pi, math.e, 2 / 7, 1e-7 / 3], [1.7145, 6.35, 10.16]])
def test_odd_lengths_have_the_same_bits(lengths, unit):
    """No decimals, and inches."""
    radius = 1.5875
    found = in_radii(radius * unit, *(length * unit for length in lengths))
    assert found == in_radii(radius, *lengths)
    np.testing.assert_allclose(np.array(found), np.array(lengths) / radius, rtol=0, atol=1e-12)


@pytest.mark.parametrize("unit", [1e-3, 1e3])
@pytest.mark.parametrize("draw", [rectangles, boxes], ids=["rectangles", "boxes"])
def test_blocks_have_the_same_cells(draw, unit):
    d = 2 if draw is rectangles else 3
    sizes = {"foot": ((-15, -8.1, -11), (30, 8.1, 22)), "punch": ((-4.7, 0, -3), (9.3, 6, 7))}
    drawn = {name: (*at[:d], *sides[:d]) for name, (at, sides) in sizes.items()}
    scaled = {name: tuple(unit * length for length in box) for name, box in drawn.items()}
    one = gathered(draw(drawn, 2.3))
    other = gathered(draw(scaled, 2.3 * unit))
    assert (one.cells == other.cells).all()
    np.testing.assert_allclose(other.x, unit * one.x, rtol=1e-14, atol=1e-14 * unit)

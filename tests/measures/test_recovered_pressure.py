"""The pressure at the corners of facets in space, recovered from the points."""

from __future__ import annotations

import numpy as np
import pytest

from archord.geometry.overlay import broken_facets, piece_rule
from archord.measures.edge import project_on_patches, recovered
from tests.geometry.test_overlay import every_kind, sheet


def smooth(x, y):
    return 100.0 + 30.0 * np.sin(2 * x) * np.cos(3 * y)


def linear(x, y):
    return 100.0 - 30.0 * x + 7.0 * y


def at_points(cell, cells, pressure):
    """A flat sheet broken by another one, the facets and places of its points, their weights, and a
    ``pressure`` there."""
    own = sheet(cell, cells)
    facet, _, pieces = broken_facets(own, sheet(cell, cells + 1, up=False))
    xi, w = piece_rule(pieces, 4)
    shape = own.shapes(xi.reshape(-1, 2))[0].reshape(*w.shape, -1)
    x, y, _ = np.einsum("nqa,nai->inq", shape, own.X[own.connectivity[facet]])
    covered = np.bincount(facet, w.sum(axis=1))
    weight = w * (own.areas() / covered)[facet, None]
    return own, facet, xi, weight, pressure(x, y)


def at_corners(own, pressure):
    x, y, _ = np.moveaxis(own.X[own.vertices], -1, 0)
    return pressure(x, y)


@every_kind
def test_linear_pressures_are_recovered_exactly(cell):
    own, facet, xi, weight, values = at_points(cell, 3, linear)
    found = recovered(own, xi, weight, facet, values)
    np.testing.assert_allclose(found, at_corners(own, linear), rtol=1e-12)
    projected = project_on_patches(values, xi, weight, facet)
    np.testing.assert_allclose(projected, values, rtol=1e-12)


@every_kind
def test_the_force_is_kept(cell):
    own, facet, xi, weight, values = at_points(cell, 3, smooth)
    found = recovered(own, xi, weight, facet, values)
    at = own.corner_shapes(xi.reshape(-1, 2)).reshape(*weight.shape, -1)
    force = (weight * np.einsum("nqc,nc->nq", at, found[facet])).sum()
    assert force == pytest.approx((weight * values).sum(), rel=1e-13)


@every_kind
def test_smooth_pressures_converge_with_the_second_order(cell):
    off = []
    for cells in (4, 8):
        own, facet, xi, weight, values = at_points(cell, cells, smooth)
        found = recovered(own, xi, weight, facet, values)
        off.append(np.abs(found - at_corners(own, smooth)).max())
    assert off[0] < 2.0
    assert off[1] < 0.35 * off[0]

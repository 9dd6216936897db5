"""The sign of the Jacobian determinant all over curved cells, by its Bernstein coefficients.

The determinant of a cell's map is a polynomial, which lies between its smallest and largest
Bernstein coefficient (Johnen, Remacle and Geuzaine 2013, "Geometrical validity of curvilinear
finite elements"). Where these leave the sign open, the cell is cut in four, which brings
coefficients and values together.
"""

from __future__ import annotations

from functools import cache
from math import factorial

import basix
import numpy as np

from archord.geometry.basis import TRIANGLE, Array, lagrange_element, tabulate
from archord.geometry.meshes.cells import quarters
from archord.geometry.meshes.plane_mesh import PlaneMesh

_DEEPEST = 6  # cuts in four; a part that is open then is 1/64 of its cell long
_NEAR = 1e-3  # of a cell's largest determinant: how far the bounds of a smallest one may be apart


def smallest_determinants(mesh: PlaneMesh) -> tuple[Array, Array]:
    """For each cell of ``mesh`` the smallest and the largest determinant ``(n,)`` of its map,
    positive for cells whose corners run either way round.

    The smallest is a value of the determinant, at most a thousandth of the largest one above the
    true minimum.
    """
    kind = mesh.kind
    degree = 2 * (mesh.order - 1) if kind == TRIANGLE else 2 * mesh.order - 1
    value = _determinants(mesh, degree)
    to_bernstein = _bernstein_of_values(kind, degree)
    # all Bernstein polynomials have the same integral
    signed_area = (value @ to_bernstein.T).mean(axis=1)
    value[signed_area < 0] *= -1
    smallest = value.min(axis=1)
    largest = value.max(axis=1)
    if degree == 0:
        return smallest, largest
    parts = _values_on_parts(kind, degree)
    cell = np.arange(len(value))
    for _ in range(_DEEPEST):
        bound = (value @ to_bernstein.T).min(axis=1)
        still_open = bound < smallest[cell] - _NEAR * np.abs(largest[cell])
        if not still_open.any():
            break
        value = np.einsum("pqr,nr->npq", parts, value[still_open]).reshape(-1, value.shape[1])
        cell = cell[still_open].repeat(len(parts))
        np.minimum.at(smallest, cell, value.min(axis=1))
    return smallest, largest


def _determinants(mesh: PlaneMesh, degree: int) -> Array:
    """Determinants ``(n, q)`` at the Lagrange nodes of the ``degree``, which determine the
    polynomial."""
    slopes = tabulate(mesh.kind, mesh.order, _points(mesh.kind, degree))[1:]
    by_X, by_Y = np.tensordot(slopes, mesh.x[mesh.cells], axes=(2, 1))  # (q, n, 2) each
    return (by_X[..., 0] * by_Y[..., 1] - by_X[..., 1] * by_Y[..., 0]).T


def _points(kind: basix.CellType, degree: int) -> Array:
    """Equispaced nodes ``(q, 2)`` of a ``degree``; the middle of the cell for degree 0."""
    if degree == 0:
        return np.full((1, 2), 1 / 3)
    return lagrange_element(kind, degree).points


@cache
def _bernstein_of_values(kind: basix.CellType, degree: int) -> Array:
    """The matrix ``(q, q)`` from values at the nodes to Bernstein coefficients."""
    X, Y = _points(kind, degree).T[:, :, None]
    i, j = np.indices((degree + 1, degree + 1)).reshape(2, -1)
    if kind == TRIANGLE:
        inside = i + j <= degree
        i = i[inside]
        j = j[inside]
        rest = degree - i - j
        values = _choose(degree, i, j, rest) * X**i * Y**j * (1 - X - Y) ** rest
    else:
        of_x = _choose(degree, i, degree - i) * X**i * (1 - X) ** (degree - i)
        of_y = _choose(degree, j, degree - j) * Y**j * (1 - Y) ** (degree - j)
        values = of_x * of_y
    return np.linalg.inv(values)


def _choose(degree: int, *parts: np.ndarray) -> Array:
    """Multinomial coefficients of ``degree`` over ``parts`` ``(k,)``."""
    factorials = np.array([factorial(n) for n in range(degree + 1)], dtype=float)
    return factorials[degree] / np.prod(factorials[np.array(parts)], axis=0)


@cache
def _values_on_parts(kind: basix.CellType, degree: int) -> Array:
    """Matrices ``(4, q, q)`` from values at the nodes of a cell to those at the nodes of its four
    parts."""
    return tabulate(kind, degree, quarters(kind, _points(kind, degree)))[0]

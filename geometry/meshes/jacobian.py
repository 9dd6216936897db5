"""The sign of the Jacobian determinant all over curved cells, by its Bernstein coefficients.

The determinant of a cell's map is a polynomial, which lies between its smallest and largest
Bernstein coefficient (Johnen, Remacle and Geuzaine 2013, "Geometrical validity of curvilinear
finite elements"). Where these leave the sign open, the cell is cut in the middles of its edges,
which brings coefficients and values together.
"""

from __future__ import annotations

from functools import cache, partial

import basix
import numpy as np

from archord.geometry.basis import Array, dimension_of, lagrange_element, tabulate
from archord.geometry.meshes.cells import is_simplex, parts_of
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.vectors import crossed
from archord.materials.kinematics import Ints

_DEEPEST = 6  # cuts; a part that is open then is 1/64 of its cell long
# in space, of a cell's largest determinant: a smallest one above this is not looked for
_SOUND = 0.05
_AT_ONCE = 500_000  # determinants
_NEAR = 1e-3  # of a cell's largest determinant: how far the bounds of a smallest one may be apart


def smallest_determinants(mesh: MeshArrays) -> tuple[Array, Array]:
    """For each cell of ``mesh`` the smallest and the largest determinant ``(n,)`` of its map,
    positive for cells whose corners run either way round.

    The smallest is a value of the determinant, at most a thousandth of the largest one above the
    true minimum. In space this holds where it is small.
    """
    d = mesh.dimension
    degree = d * (mesh.order - 1) if is_simplex(mesh.kind) else d * mesh.order - 1
    n_values = len(mesh.cells) * len(_points(mesh.kind, degree))
    found = []
    for cells in np.array_split(mesh.cells, 1 + n_values // _AT_ONCE):
        values = _determinants(mesh, cells, degree)
        found.append(_extremes(mesh.kind, values, degree))
    smallest, largest = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return smallest, largest


def _extremes(kind: basix.CellType, value: Array, degree: int) -> tuple[Array, Array]:
    """`smallest_determinants` of cells from the values ``(n, q)`` at the nodes of the ``degree``,
    which are changed."""
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
        if dimension_of(kind) == 3:
            still_open &= bound < _SOUND * largest[cell]
        if not still_open.any():
            break
        on_parts = np.einsum("pqr,nr->npq", parts, value[still_open])
        value = on_parts.reshape(-1, value.shape[1])
        cell = cell[still_open].repeat(len(parts))
        np.minimum.at(smallest, cell, value.min(axis=1))
    return smallest, largest


def _determinants(mesh: MeshArrays, cells: Ints, degree: int) -> Array:
    """Determinants ``(n, q)`` of ``cells`` at the Lagrange nodes of the ``degree``, which determine
    the polynomial."""
    slopes = tabulate(mesh.kind, mesh.order, _points(mesh.kind, degree))[1:]
    by_X, by_Y, *by_Z = np.tensordot(slopes, mesh.x[cells], axes=(2, 1))  # (q, n, d) each
    if by_Z:
        return np.einsum("qni,qni->nq", np.cross(by_X, by_Y), by_Z[0])
    return crossed(by_X, by_Y).T


def _points(kind: basix.CellType, degree: int) -> Array:
    """Equispaced nodes ``(q, d)`` of a ``degree``; the middle of the cell for degree 0."""
    if degree == 0:
        return basix.geometry(kind).mean(axis=0, keepdims=True)
    return lagrange_element(kind, degree).points


@cache
def _bernstein_of_values(kind: basix.CellType, degree: int) -> Array:
    """The matrix ``(q, q)`` from values at the nodes to Bernstein coefficients."""
    X = _points(kind, degree)
    polynomials = partial(basix.tabulate_polynomials, basix.PolynomialType.bernstein)
    if is_simplex(kind):
        return np.linalg.inv(polynomials(kind, degree, X).T)
    values = np.ones((len(X), 1))
    for x in X.T:
        along = polynomials(basix.CellType.interval, degree, x[:, None]).T
        values = (values[:, :, None] * along[:, None]).reshape(len(X), -1)
    return np.linalg.inv(values)


@cache
def _values_on_parts(kind: basix.CellType, degree: int) -> Array:
    """Matrices ``(2^d, q, q)`` from values at the nodes of a cell to those at the nodes of its
    parts."""
    return tabulate(kind, degree, parts_of(kind, _points(kind, degree)))[0]

"""The logarithmic strain in space, by the eigenvalues of 3 by 3 tensors, and its derivatives.

With ``C = F^T F`` the strain is ``E = g(C)``, ``g = 1/2 ln``. Along the principal axes of C its
derivatives are divided differences of g at the eigenvalues (Daleckii and Krein 1965; Higham 2008,
theorem 3.11): ``dE_ij = g[i, j] dC_ij`` and ``d2E_ij = sum over k of g[i, k, j] (A_ik B_kj + B_ik
A_kj)``. Where eigenvalues are close or equal, the divided differences are series.

Symmetric tensors have the components ``[xx, yy, zz, xy, yz, zx]``, gradients and nominal stresses
the nine of `SPACE.gradient`.
"""

from __future__ import annotations

from itertools import combinations_with_replacement, permutations

import numpy as np

from archord.materials.elasticity import ENGINEERING
from archord.materials.kinematics import SPACE
from archord.materials.material import Array

_NEAR = 0.05  # relative distance of eigenvalues below which divided differences are series
_TERMS = 16  # of the series
_ROWS = np.array([0, 1, 2, 0, 1, 2])  # of the components of symmetric tensors
_COLUMNS = np.array([0, 1, 2, 1, 2, 0])
_COMPONENT, _DERIVATIVE = np.array(SPACE.terms).T
# takes engineering shears to tensors (6, 3, 3), and what is summed over A_pq B_qs to (6, 6)
_TO_TENSORS = np.zeros((6, 3, 3))
_TO_TENSORS[range(6), _ROWS, _COLUMNS] = 1 / ENGINEERING
_TO_TENSORS[range(6), _COLUMNS, _ROWS] = 1 / ENGINEERING
_SYMMETRIC = np.einsum("apq,bqs->pqsab", _TO_TENSORS, _TO_TENSORS).reshape(27, 36)


class SpatialLogarithm:
    """The logarithmic strain of displacement gradients ``(n, 9)``, with its derivatives.

    - ``working`` ``(6,)``: places in a stress of the components that do work on the strain: all
    - ``_F`` ``(n, 3, 3)``: the deformation; not a number where what is deformed is turned inside
      out
    - ``_values`` ``(n, 3)``, ``_axes`` ``(n, 3, 3)``: eigenvalues of C, and eigenvectors as columns
    - ``strain`` ``(n, 6)``: the logarithmic strain, with engineering shear
    - ``_first`` ``(n, 3, 3)``: divided differences ``g[i, j]``
    """

    def __init__(self, gradient: Array) -> None:
        self.working = list(SPACE.working)
        H = np.zeros((len(gradient), 3, 3))
        H[:, _COMPONENT, _DERIVATIVE] = gradient
        F = np.eye(3) + H
        with np.errstate(invalid="ignore"):
            is_right = np.linalg.det(F) > 0
        H[~is_right] = 0.0
        self._F = np.where(is_right[:, None, None], F, np.nan)
        transposed = np.swapaxes(H, 1, 2)
        # C is one and more, whose digits small strains need
        more, self._axes = np.linalg.eigh(H + transposed + transposed @ H)
        self._values = 1 + more
        self._first = _first_differences(self._values)
        principal = np.where(is_right[:, None], 0.5 * np.log1p(more), np.nan)
        strain = np.einsum("nip,np,njp->nij", self._axes, principal, self._axes)
        self.strain = _components(strain) * ENGINEERING

    def nominal(self, T: Array, moduli: Array) -> tuple[Array, Array]:
        """The nominal stress ``(n, 9)`` and its derivative ``(n, 9, 9)`` by the gradient, from
        ``T`` ``(n, 6)`` and its derivative ``(n, 6, 6)`` by the logarithmic strain.

        ``P = T : dE/dF`` is linear in the stress along the principal axes, and its derivative has
        three parts: the material, the second derivative of the logarithm, and of C.
        """
        metric = self._metric()  # (n, 6, 9)
        to_axes = self._to_axes()
        T_axes = np.einsum("nij,nj->ni", to_axes, T)
        first = _components(self._first)
        half = first * T_axes  # of the second Piola-Kirchhoff stress along the principal axes
        stress = np.einsum("nki,nk->ni", metric, half)
        slope = first[:, :, None] * to_axes
        of_material = slope @ moduli @ np.swapaxes(slope, 1, 2)
        by_metric = of_material + self._bent(T_axes)
        tangent = np.swapaxes(metric, 1, 2) @ by_metric @ metric
        return stress, tangent + self._turning(half)

    def _turning(self, half: Array) -> Array:
        """The part ``(n, 9, 9)`` of the tangent from the second derivative of C, with the halved
        second Piola-Kirchhoff stress ``(n, 6)`` along the principal axes: terms of the same
        component of the displacement are coupled by the stress along their derivatives."""
        S = 2 * self._axes @ _tensors(half) @ np.swapaxes(self._axes, 1, 2)
        coupled = S[:, _DERIVATIVE[:, None], _DERIVATIVE]
        return np.where(_COMPONENT[:, None] == _COMPONENT, coupled, 0.0)

    def kirchhoff(self, stress: Array, T: Array) -> Array:
        """Kirchhoff's stress ``(n, 6)`` of nominal ones ``(n, 9)``; ``T`` tells nothing more."""
        P = np.zeros((len(stress), 3, 3))
        P[:, _COMPONENT, _DERIVATIVE] = stress
        return _components(P @ np.swapaxes(self._F, 1, 2))

    def _metric(self) -> Array:
        """``dC/dF`` ``(n, 6, 9)`` along the principal axes, with engineering shear."""
        deformed = (self._F @ self._axes)[:, _COMPONENT]  # (n, 9, 3)
        along = self._axes[:, _DERIVATIVE]
        products = _symmetric_products(deformed, along)
        return np.swapaxes(products * ENGINEERING, 1, 2)

    def _to_axes(self) -> Array:
        """Takes a stress ``(n, 6)`` to the principal axes, ``(n, 6, 6)``."""
        along = self._axes[:, _ROWS]  # (n, 6, 3): the first axis of each component
        across = self._axes[:, _COLUMNS]
        products = _symmetric_products(along, across)
        return np.swapaxes(products * (ENGINEERING / 2)[:, None], 1, 2)

    def _bent(self, T: Array) -> Array:
        """``T : d2E/dC2`` ``(n, 6, 6)`` along the principal axes, of engineering shears."""
        second = _second_differences(self._values, self._first)
        bent = 2 * _tensors(T)[:, :, None] * second
        return (bent.reshape(-1, 27) @ _SYMMETRIC).reshape(-1, 6, 6)


def _symmetric_products(a: Array, b: Array) -> Array:
    """Components ``(n, k, 6)`` of ``a b^T + b a^T`` of vectors ``(n, k, 3)``."""
    product = a[..., _ROWS] * b[..., _COLUMNS]
    transposed = a[..., _COLUMNS] * b[..., _ROWS]
    return product + transposed


def _components(tensors: Array) -> Array:
    """The components ``(n, 6)`` of symmetric tensors ``(n, 3, 3)``."""
    return tensors[:, _ROWS, _COLUMNS]


def _tensors(components: Array) -> Array:
    """Symmetric tensors ``(n, 3, 3)`` with these ``components`` ``(n, 6)``."""
    tensors = np.empty((len(components), 3, 3))
    tensors[:, _ROWS, _COLUMNS] = components
    tensors[:, _COLUMNS, _ROWS] = components
    return tensors


def _first_differences(values: Array) -> Array:
    """Divided differences ``(n, 3, 3)`` of ``1/2 ln`` at pairs of ``values`` ``(n, 3)``:
    ``artanh(x) / x`` over their sum, with x half their difference over their mean."""
    one = values[:, :, None]
    two = values[:, None, :]
    total = one + two
    x = np.abs(one - two) / total
    square = x**2
    ratio = np.zeros_like(x)
    for k in reversed(range(_TERMS // 2)):
        ratio = ratio * square + 1 / (2 * k + 1)
    far = x >= _NEAR
    y = x[far]
    ratio[far] = np.arctanh(y) / y
    return ratio / total


def _second_differences(values: Array, first: Array) -> Array:
    """Divided differences ``(n, 3, 3, 3)`` of ``1/2 ln`` at triples of the ascending ``values``
    ``(n, 3)``, from the ``first`` ones ``(n, 3, 3)`` or, where all three are near, from a
    series."""
    found = np.empty((len(values), 3, 3, 3))
    for i, j, k in combinations_with_replacement(range(3), 3):
        triple = values[:, [i, j, k]]
        spread = triple[:, 2] - triple[:, 0]
        near = spread < _NEAR * triple.mean(axis=1)
        between = np.where(near, 1.0, spread)
        rise = first[:, j, k] - first[:, i, j]
        difference = rise / between
        difference[near] = _series(triple[near])
        for a, b, c in permutations((i, j, k)):
            found[:, a, b, c] = difference
    return found


def _series(triples: Array) -> Array:
    """The second divided difference ``(n,)`` of ``1/2 ln`` at ``triples`` ``(n, 3)`` of values that
    are close.

    Taylor's series about their mean m: of the power k it has the sum of all products of k factors
    of their relative distances from m, which follows from their symmetric functions.
    """
    mean = triples.mean(axis=1)
    distances = triples / mean[:, None] - 1
    a, b, c = distances.T
    pairs = a * b + b * c + c * a
    product = a * b * c
    sums = [np.ones_like(mean), np.zeros_like(mean), -pairs]
    for k in range(3, _TERMS):
        sums.append(product * sums[k - 3] - pairs * sums[k - 2])
    series = sum((-1) ** (k + 1) / (k + 2) * term for k, term in enumerate(sums))
    return 0.5 / mean**2 * series

"""The logarithmic strain, by the eigenvalues of tensors, and its derivatives.

With ``C = F^T F`` the strain is ``E = g(C)``, ``g = 1/2 ln``. Along the principal axes of C its
derivatives are divided differences of g at the eigenvalues (Daleckii and Krein 1965; Higham 2008,
theorem 3.11): ``dE_ij = g[i, j] dC_ij`` and ``d2E_ij = sum over k of g[i, k, j] (A_ik B_kj + B_ik
A_kj)``. Where eigenvalues are close or equal, the divided differences are series.

Tensors are 2 by 2 in a plane, with the ``m`` components ``[xx, yy, xy]``, and 3 by 3 in space, with
``[xx, yy, zz, xy, yz, zx]``. Around an axis they are those of the plane, and the hoop direction is
a principal one, with ``E = ln(1 + u_r / r)``. Points are the last axis of arrays within, over which
loops are quick.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations_with_replacement, permutations

import numpy as np

from archord.materials.kinematics import AXISYMMETRIC, PLANE_STRAIN, SPACE
from archord.materials.material import Array

_NEAR = 0.05  # relative distance of eigenvalues below which divided differences are series
_TERMS = 12  # of the series
_HOOP = 2  # place in a stress


class _Places:
    """Where components stand in tensors ``(d, d)``.

    - ``in_stress`` ``(m,)``: places of the components of symmetric tensors in a stress
    - ``component``, ``derivative`` ``(p,)``: rows and columns of the components of gradients
    - ``rows``, ``columns`` ``(m,)``: of the components of symmetric tensors
    - ``engineering`` ``(m, 1)``: engineering strains over tensor strains
    - ``pairs`` ``(m, m, d, d, d)``: takes what is summed over A_pq B_qs to engineering strains
    """

    def __init__(
        self,
        rows: Sequence[int],
        columns: Sequence[int],
        in_stress: Sequence[int],
        terms: Sequence[tuple[int, int]],
    ) -> None:
        self.in_stress = list(in_stress)
        self.rows = np.array(rows)
        self.columns = np.array(columns)
        self.component, self.derivative = np.array(terms).T
        self.engineering = np.where(self.rows == self.columns, 1.0, 2.0)[:, None]
        to_tensors = self.tensors(np.eye(len(rows)) / self.engineering)
        self.pairs = np.einsum("pqa,qsb->abpqs", to_tensors, to_tensors)

    def components(self, tensors: Array) -> Array:
        """The components ``(m, n)`` of symmetric tensors ``(d, d, n)``."""
        return tensors[self.rows, self.columns]

    def tensors(self, components: Array) -> Array:
        """Symmetric tensors ``(d, d, n)`` with these ``components`` ``(m, n)``."""
        d = self.rows.max() + 1
        tensors = np.empty((d, d, components.shape[1]))
        tensors[self.rows, self.columns] = components
        tensors[self.columns, self.rows] = components
        return tensors

    def gradients(self, components: Array) -> Array:
        """Tensors ``(d, d, n)`` with these ``components`` ``(p, n)``."""
        d = self.rows.max() + 1
        tensors = np.zeros((d, d, components.shape[1]))
        tensors[self.component, self.derivative] = components
        return tensors

    def symmetric_products(self, a: Array, b: Array) -> Array:
        """Components ``(m, i, n)`` of ``a b^T + b a^T`` of vectors ``(d, i, n)``."""
        return a[self.rows] * b[self.columns] + a[self.columns] * b[self.rows]


_IN_PLANE = _Places([0, 1, 0], [0, 1, 1], [0, 1, 3], PLANE_STRAIN.terms)
_IN_SPACE = _Places([0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0], range(6), SPACE.terms)
_PLACES = {
    4: (PLANE_STRAIN, _IN_PLANE),
    5: (AXISYMMETRIC, _IN_PLANE),
    9: (SPACE, _IN_SPACE),
}  # by the number of components of a gradient


class Logarithm:
    """The logarithmic strain of displacement gradients ``(n, k_gradient)``, with its derivatives.

    - ``working`` ``(k,)``: places in a stress of the components that do work on the strain
    - ``strain`` ``(n, k)``: the logarithmic strain, with engineering shear
    - ``_hoops`` ``(1, n)``, or ``(0, n)`` where there is no hoop: ``u_r / r``
    - ``_F`` ``(d, d, n)``: the deformation; not a number where what is deformed is turned inside
      out
    - ``_values`` ``(d, n)``, ``_axes`` ``(d, d, n)``: eigenvalues of C, and eigenvectors as columns
    - ``_first`` ``(d, d, n)``: divided differences ``g[i, j]``
    """

    def __init__(self, gradient: Array) -> None:
        kinematics, places = _PLACES[gradient.shape[1]]
        self.working = list(kinematics.working)
        self._places = places
        p = len(places.component)
        hoops = gradient.T[p:]
        H = places.gradients(gradient.T[:p])
        F = H + np.eye(len(H))[:, :, None]
        with np.errstate(invalid="ignore"):
            is_right = (_determinant(F) > 0) & (hoops > -1).all(axis=0)
        H[..., ~is_right] = 0.0
        self._F = np.where(is_right, F, np.nan)
        self._hoops = np.where(is_right, hoops, np.nan)
        # C is one and more, whose digits small strains need
        more, self._axes = _principal(H + np.swapaxes(H, 0, 1) + np.einsum("kin,kjn->ijn", H, H))
        self._values = 1 + more
        self._first = _first_differences(self._values)
        principal = np.where(is_right, 0.5 * np.log1p(more), np.nan)
        strain = np.einsum("ipn,jpn->ijn", self._axes * principal, self._axes)
        of_tensors = places.components(strain) * places.engineering
        of_hoops = np.log1p(self._hoops)
        self.strain = np.concatenate([of_tensors[:2], of_hoops, of_tensors[2:]]).T.copy()

    def nominal(self, T: Array, moduli: Array) -> tuple[Array, Array]:
        """The nominal stress ``(n, k_gradient)`` and its derivative by the gradient, from ``T``
        ``(n, k)`` and its derivative ``(n, k, k)`` by the logarithmic strain.

        The derivative of ``P = T : dE/dF`` has three parts: the material, the second derivative of
        the logarithm, and of C.
        """
        n, k = T.shape
        metric = self._metric()  # (m, p, n)
        to_axes = self._to_axes()  # (m, m, n)
        p = metric.shape[1]
        first = self._places.components(self._first)
        inside = [self.working.index(place) for place in self._places.in_stress]
        T_axes = np.einsum("mkn,nk->mn", to_axes, T[:, inside])
        derivative = np.zeros((k, p + len(self._hoops), n))  # of E by F
        derivative[inside, :p] = np.einsum("mkn,mpn->kpn", first[:, None] * to_axes, metric)
        for hoop in self._hoops:
            derivative[_HOOP, p] = 1 / (1 + hoop)
        stress = np.einsum("nk,kpn->np", T, derivative)
        whole = _in_other_axes(derivative, np.moveaxis(moduli, 0, -1).copy())
        whole[:p, :p] += _in_other_axes(metric, self._bent(T_axes)) + self._turning(first * T_axes)
        for hoop in self._hoops:
            whole[p, p] -= T[:, _HOOP] / (1 + hoop) ** 2
        return stress, np.moveaxis(whole, -1, 0).copy()

    def _turning(self, half: Array) -> Array:
        """The part of the tangent from the second derivative of C, with the halved second
        Piola-Kirchhoff stress ``(m, n)`` along the principal axes: terms of the same component of
        the displacement are coupled by the stress along their derivatives."""
        component = self._places.component
        along = self._places.derivative
        S = _in_other_axes(np.swapaxes(self._axes, 0, 1), 2 * self._places.tensors(half))
        is_coupled = component[:, None] == component
        return S[along[:, None], along] * is_coupled[:, :, None]

    def kirchhoff(self, stress: Array, T: Array) -> Array:
        """Kirchhoff's stress of nominal ones ``(n, k_gradient)``; ``T``, of as many components, has
        the one out of a plane."""
        p = len(self._places.component)
        P = self._places.gradients(stress.T[:p])
        kirchhoff = T.copy()
        in_tensors = self._places.components(np.einsum("ikn,jkn->ijn", P, self._F))
        kirchhoff[:, self._places.in_stress] = in_tensors.T
        return kirchhoff

    def _metric(self) -> Array:
        """``dC/dF`` ``(m, p, n)`` along the principal axes, with engineering shear."""
        places = self._places
        deformed = np.einsum("ikn,kjn->jin", self._F, self._axes)[:, places.component]
        along = np.swapaxes(self._axes, 0, 1)[:, places.derivative]
        return places.symmetric_products(deformed, along) * places.engineering[:, None]

    def _to_axes(self) -> Array:
        """Takes a stress ``(m,)`` to the principal axes, ``(m, m, n)``."""
        places = self._places
        axes = np.swapaxes(self._axes, 0, 1)
        products = places.symmetric_products(axes[:, places.rows], axes[:, places.columns])
        return products * (places.engineering / 2)

    def _bent(self, T: Array) -> Array:
        """``T : d2E/dC2`` ``(m, m, n)`` along the principal axes, of engineering shears."""
        second = _second_differences(self._values, self._first)
        bent = 2 * self._places.tensors(T)[:, None] * second
        return np.tensordot(self._places.pairs, bent, 3)


def _in_other_axes(change: Array, matrices: Array) -> Array:
    """``change^T M change`` ``(j, j, n)`` of ``matrices`` M ``(i, i, n)``, for ``change`` ``(i, j,
    n)``."""
    i, j, n = change.shape
    half = np.zeros((i, j, n))
    for k in range(i):
        half += matrices[:, k, None] * change[k]
    changed = np.zeros((j, j, n))
    for k in range(i):
        changed += change[k, :, None] * half[k]
    return changed


def _determinant(tensors: Array) -> Array:
    if len(tensors) == 2:
        return tensors[0, 0] * tensors[1, 1] - tensors[0, 1] * tensors[1, 0]
    return np.linalg.det(np.moveaxis(tensors, -1, 0))


def _principal(tensors: Array) -> tuple[Array, Array]:
    """The eigenvalues ``(d, n)`` of symmetric ``tensors`` ``(d, d, n)``, rising, and eigenvectors
    ``(d, d, n)`` as columns; in a plane by a formula, which is quicker."""
    if len(tensors) == 3:
        values, axes = np.linalg.eigh(np.moveaxis(tensors, -1, 0))
        return values.T.copy(), np.moveaxis(axes, 0, -1).copy()
    (xx, xy), (_, yy) = tensors
    middle = (xx + yy) / 2
    radius = np.hypot((xx - yy) / 2, xy)
    angle = np.arctan2(2 * xy, xx - yy) / 2
    cos = np.cos(angle)
    sin = np.sin(angle)
    return np.stack([middle - radius, middle + radius]), np.array([[-sin, cos], [cos, sin]])


def _first_differences(values: Array) -> Array:
    """Divided differences ``(d, d, n)`` of ``1/2 ln`` at pairs of ``values`` ``(d, n)``:
    ``artanh(x) / x`` over their sum, with x half their difference over their mean."""
    one = values[:, None]
    two = values[None]
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
    """Divided differences ``(d, d, d, n)`` of ``1/2 ln`` at triples of the ascending ``values``
    ``(d, n)``, from the ``first`` ones ``(d, d, n)`` or, where all three are near, from a
    series."""
    d, n = values.shape
    found = np.empty((d, d, d, n))
    found[range(d), range(d), range(d)] = -0.25 / values**2
    for i, j, k in combinations_with_replacement(range(d), 3):
        if i == k:
            continue
        triple = values[[i, j, k]]
        spread = triple[2] - triple[0]
        near = spread < _NEAR * triple.mean(axis=0)
        between = np.where(near, 1.0, spread)
        rise = first[j, k] - first[i, j]
        difference = rise / between
        difference[near] = _series(triple[:, near])
        for a, b, c in permutations((i, j, k)):
            found[a, b, c] = difference
    return found


def _series(triples: Array) -> Array:
    """The second divided difference ``(n,)`` of ``1/2 ln`` at ``triples`` ``(3, n)`` of values that
    are close.

    Taylor's series about their mean m: of the power k it has the sum of all products of k factors
    of their relative distances from m, which follows from their symmetric functions.
    """
    mean = triples.mean(axis=0)
    a, b, c = triples / mean - 1
    pairs = a * b + b * c + c * a
    product = a * b * c
    sums = [np.ones_like(mean), np.zeros_like(mean), -pairs]
    for k in range(3, _TERMS):
        sums.append(product * sums[k - 3] - pairs * sums[k - 2])
    series = sum((-1) ** (k + 1) / (k + 2) * term for k, term in enumerate(sums))
    return 0.5 / mean**2 * series

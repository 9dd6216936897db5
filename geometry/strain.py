"""Strains at points of cells from nodal displacements, in any kinematics."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from archord.geometry.basis import Array, CellBasis
from archord.kernels.compiled import library, pointer
from archord.materials.kinematics import Ints, Kinematics

_SOURCE = Path(__file__).with_name("strain.c")
_ON_AXIS = 1e-9  # radius over the largest one, below which a point lies on the axis


def strain_terms(kinematics: Kinematics, *, large: bool = False) -> Ints:
    """A component of the displacement, a derivative, and the component of the strain, or of the
    gradient at ``large`` strain, that gets their product ``(t, 3)``."""
    places = np.arange(len(kinematics.terms)) if large else kinematics.small.argmax(axis=0)
    return np.column_stack([kinematics.terms, places]).astype(np.int32)


class PointStrain:
    """The strain of ``n`` cells at ``q`` points each, or at ``large`` strain the displacement
    gradient: ``k`` components in the order of the ``kinematics``.

    - ``dofs`` ``(n, a)``: the nodes of the cells
    - ``derivative`` ``(n, q, a, m)``: the basis by the axes, and around an axis over the radius
    - ``terms`` ``(t, 3)``: a component of the displacement, a derivative, and the component of the
      strain that gets their product
    """

    def __init__(
        self,
        kinematics: Kinematics,
        basis: CellBasis,
        dofs: Ints,
        *,
        large: bool = False,
    ) -> None:
        self.k = kinematics.n_components(large=large)
        self.dimension = kinematics.dimension
        self.dofs = np.ascontiguousarray(dofs)
        self.derivative = _derivative(kinematics, basis)
        self.terms = strain_terms(kinematics, large=large)

    def __call__(self, u: Array) -> Array:
        """The strain ``(n, q, k)`` at the nodal displacements ``u`` ``(nodes, d)``."""
        n, q, a, m = self.derivative.shape
        strain = np.empty((n, q, self.k))
        sizes = n, q, a, m, self.dimension, len(self.terms), self.k
        arrays = self.terms, self.derivative, self.dofs, u, strain
        library(_SOURCE).strains(*sizes, *map(pointer, arrays))
        return strain

    def add_forces(self, stress: Array, force: Array) -> None:
        """Add to the forces ``(nodes, d)`` of all nodes what the stresses ``(n, q, k)``, times the
        volumes of their points, do on the strain."""
        n, q, a, m = self.derivative.shape
        sizes = n, q, a, m, self.dimension, len(self.terms), self.k
        arrays = self.terms, self.derivative, self.dofs, np.ascontiguousarray(stress), force
        library(_SOURCE).add_forces(*sizes, *map(pointer, arrays))

    def matrix(self) -> Array:
        """``B`` ``(n, q, k, d a)``, which takes nodal displacements ``[ux0, uy0, ux1, ...]`` to the
        strain."""
        n, q, a, _ = self.derivative.shape
        B = np.zeros((n, q, self.k, a, self.dimension))
        for component, derivative, place in self.terms:
            B[:, :, place, :, component] += self.derivative[..., derivative]
        return B.reshape(n, q, self.k, a * self.dimension)


def _derivative(kinematics: Kinematics, basis: CellBasis) -> Array:
    """The basis by the axes ``(n, q, a, 2)``; around an axis also over the radius ``(n, q, a, 3)``,
    whose limit on the axis is the derivative by the radius."""
    if not kinematics.has_hoop:
        return basis.gradient
    radius = basis.point[..., :1]
    on_axis = radius <= _ON_AXIS * np.abs(radius).max(initial=0.0)
    shape = np.broadcast_to(basis.shape, basis.gradient.shape[:3])
    over_radius = np.where(on_axis, basis.gradient[..., 0], shape / np.where(on_axis, 1.0, radius))
    return np.concatenate([basis.gradient, over_radius[..., None]], axis=-1)

"""The integration points of one body: strains, stresses and history, and what is told of them."""

from __future__ import annotations

from typing import Any, NamedTuple

import basix
import numpy as np
from dolfinx import fem

from archord.geometry.basis import Array, cell_basis
from archord.geometry.strain import PointStrain
from archord.materials.kinematics import Bools, Ints, Kinematics
from archord.materials.material import Material, Points, of_small_strain
from archord.report.errors import InputError


class PointFields(NamedTuple):
    """Fields at the ``q`` integration points of a body's ``n`` cells.

    - ``cells`` ``(n,)``: local numbers
    - ``coordinates`` ``(n, q, d)``
    - ``weight`` ``(n, q)``: area of a plane, volume of a ring or in space
    - ``stress`` ``(n, q, n_stress)``: Cauchy's
    - ``plastic_strain`` ``(n, q, n_stress)``
    - ``peeq`` ``(n, q)``
    - ``material``, and ``state``: its history at these ``n q`` points
    """

    cells: Ints
    coordinates: Array
    weight: Array
    stress: Array
    plastic_strain: Array
    peeq: Array
    material: Material
    state: Any


class BodyPoints:
    """The ``q`` integration points of each of ``n`` cells of a body, by the ``rule`` of a degree,
    with ``k`` components of strain.

    - ``cells`` ``(n,)``: local numbers
    - ``point`` ``(n, q, d)``: coordinates
    - ``weight`` ``(n, q)``: area of a plane, volume of a ring or in space
    - ``elastic`` ``(k, k)``: the elastic tangent
    - ``strain`` ``(n q, k)``: at the last update; a displacement gradient at large strain
    - ``stress`` ``(n q, n_stress)``: at the last update; nominal ``(n q, k)`` at large strain
    - ``flows`` ``(n,)``: whether a point of the cell has left its elastic tangent
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        cells: Ints,
        material: Material,
        kinematics: Kinematics,
        rule: int,
    ) -> None:
        X, w = basix.make_quadrature(V.mesh.basix_cell(), rule)
        basis = cell_basis(V.mesh, V.element.basix_element.degree, cells, X)
        large = material.finite
        self.cells = cells
        self.kinematics = kinematics
        self.point = basis.point
        self.weight = basis.measure * w * kinematics.measure(basis.point)
        self.measure = PointStrain(kinematics, basis, V.dofmap.list[cells], large=large)
        self.points = Points(material, self.weight.size)
        self.elastic = material.elastic_tangent
        if large:
            self.elastic = kinematics.small.T @ self.elastic @ kinematics.small
        self._working = slice(None) if large else list(kinematics.working)
        self.strain: Array = np.zeros((self.weight.size, self.measure.k))
        components = self.measure.k if large else kinematics.n_stress
        self.stress: Array = np.zeros((self.weight.size, components))
        self.flows: Bools = np.zeros(len(cells), dtype=bool)

    @property
    def flowing(self) -> Ints:
        """The cells ``(m,)`` with a point that has left its elastic tangent."""
        return self.cells[self.flows]

    def update(self, u: Array) -> Array:
        """Keep strain, stress and trial history at the nodal displacements ``u``; returns the
        tangent ``(n, q, k, k)``."""
        k = self.measure.k
        self.strain = self.measure(u).reshape(-1, k)
        self.stress, tangent = self.points.update(self.strain)
        flows = self.points.flows.reshape(self.weight.shape)
        self.flows = np.logical_or.reduce(flows, axis=1)
        return tangent.reshape(*self.weight.shape, k, k)

    def forces(self) -> Array:
        """What of the stress does work on the strain ``(n, q, k)``."""
        working = self.stress[:, self._working].reshape(*self.weight.shape, self.measure.k)
        return np.ascontiguousarray(working)

    def energies(self) -> tuple[float, float]:
        """Elastic energy and plastic dissipation at the last update."""
        material = self.points.material
        weight = self.weight.ravel()
        stored = material.stored(self.strain.copy(), self.stress.copy(), self.points.told())
        stored = np.broadcast_to(stored, weight.shape)
        dissipated = np.broadcast_to(material.dissipation(self.points.told()), weight.shape)
        return float(weight @ stored), float(weight @ dissipated)

    def fields(self) -> PointFields:
        """The fields at the last update. Raises `InputError` for tensors of other shapes."""
        shape = self.weight.shape
        trial = self.points.told()
        strain_and_stress = self.strain.copy(), self.stress.copy()
        stress = self.points.material.true_stress(*strain_and_stress, self.points.told())
        plastic_strain = getattr(trial, "plastic_strain", np.zeros_like(stress))
        wanted = self.weight.size, self.kinematics.n_stress
        for name, tensor in (("true_stress", stress), ("state.plastic_strain", plastic_strain)):
            if np.shape(tensor) != wanted:
                kind = type(of_small_strain(self.points.material)).__name__
                said = f"must have the shape {wanted}, not {np.shape(tensor)}"
                raise InputError(f"archord.solve: {kind}.{name} {said}.")
        return PointFields(
            self.cells,
            self.point,
            self.weight,
            stress.reshape(*shape, stress.shape[1]),
            plastic_strain.reshape(*shape, plastic_strain.shape[1]),
            self.points.peeq.reshape(shape),
            self.points.material,
            trial,
        )

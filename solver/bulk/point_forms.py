"""Internal forces of stresses at integration points, and forms of tangents that are given
there."""

from __future__ import annotations

from collections.abc import Mapping

import basix.ufl
import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.strain import strain_terms
from archord.materials.kinematics import Ints, Kinematics
from archord.solver.bulk.assembly import assemble
from archord.solver.bulk.body_points import BodyPoints
from archord.solver.bulk.stiffness import CellStiffness


class PointForms:
    """The ``bodies`` that are not linear, by their tags, in cells with the same ``rule``: their
    internal forces, and what tangents are above the elastic ones.

    With ``k`` components of strain at ``q`` points of a cell:

    - ``_stress`` ``(n, q, k)``: the stresses of the ``n`` cells of a body, by its tag
    - ``_correction`` ``(n_cells, q, k, k)``: the tangents of all cells less the elastic ones
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        rule: int,
        bodies: Mapping[int, BodyPoints],
        kinematics: Kinematics,
        *,
        large: bool,
    ) -> None:
        self.V = V
        self.bodies = bodies
        self._q = next(iter(bodies.values())).weight.shape[1]
        k = self._k = kinematics.n_components(large=large)
        cell = V.mesh.basix_cell()
        tensors = basix.ufl.quadrature_element(cell, (k, k), degree=rule)
        self._stress: dict[int, Array] = {}
        self._correction = fem.Function(fem.functionspace(V.mesh, tensors))
        terms = strain_terms(kinematics, large=large)
        self._stiffness = CellStiffness(V, kinematics, rule, terms, self._correction)
        self._corrected_cells: Ints | None = None  # cells of the form that was made last
        self._correction_forms: list[fem.Form] = []

    def _corrections(self) -> Array:
        """The corrections ``(n_cells, q, k, k)``, a view."""
        return self._correction.x.array.reshape(-1, self._q, self._k, self._k)

    def update(self, u: Array) -> None:
        """Return-map the bodies at the nodal displacements ``u`` ``(n_nodes, d)`` of this rank."""
        correction = self._corrections()
        for tag, body in self.bodies.items():
            correction[body.flowing] = 0.0
            tangent = body.update(u)
            correction[body.flowing] = tangent[body.flows] - body.elastic
            self._stress[tag] = body.forces()

    def let_stresses_be_of_tangent(self, direction: Array) -> None:
        """Put the last tangent, applied to the ``direction`` ``(n_nodes, d)``, in the place of the
        stresses."""
        correction = self._corrections()
        for tag, body in self.bodies.items():
            tangent = correction[body.cells] + body.elastic
            self._stress[tag] = np.einsum("nqij,nqj->nqi", tangent, body.measure(direction))

    def add_force(self, force: Array) -> None:
        """Add the force of the stresses to the ``force`` ``(n_nodes, d)`` of this rank's nodes,
        ghosts included."""
        for tag, body in self.bodies.items():
            body.measure.add_forces(self._stress[tag] * body.weight[..., None], force)

    def assemble_correction(self, A: PETSc.Mat, bcs: list[fem.DirichletBC]) -> None:
        """Add the consistent minus the elastic tangent to ``A``, in the cells with points that
        flow."""
        cells = np.sort(np.concatenate([body.flowing for body in self.bodies.values()]))
        if self._corrected_cells is None or not np.array_equal(cells, self._corrected_cells):
            self._corrected_cells = cells
            self._correction_forms = [self._stiffness.over(cells)]
        assemble(A, self._correction_forms, bcs)

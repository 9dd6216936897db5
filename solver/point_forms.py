"""Forms of stresses and tangents that are given at integration points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.materials.kinematics import Kinematics
from archord.solver.assembly import assemble
from archord.solver.body_points import BodyPoints


def strain_of(V: fem.FunctionSpace, kinematics: Kinematics, u: Any, *, large: bool = False) -> Any:
    """The strain of a UFL displacement ``u`` in ``V`` as a vector, or at ``large`` strain its
    gradient."""
    derivative = ufl.grad(u)
    radius = ufl.SpatialCoordinate(V.mesh)[0]
    gradient = [
        derivative[component, axis] if axis < kinematics.dimension else u[component] / radius
        for component, axis in kinematics.terms
    ]
    if large:
        return ufl.as_vector(gradient)
    rows = [np.flatnonzero(row) for row in kinematics.small]
    return ufl.as_vector([sum(gradient[k] for k in row) for row in rows])


def integral(
    V: fem.FunctionSpace,
    kinematics: Kinematics,
    integrand: Any,
    cells: np.ndarray,
    rule: int,
    **metadata: str,
) -> Any:
    """The integral over these ``cells`` by the ``rule`` of this degree."""
    mesh = V.mesh
    how = {"quadrature_degree": rule, **metadata}
    dx = ufl.Measure("dx", mesh, subdomain_data=[(1, cells)], metadata=how)
    return integrand * kinematics.measure(ufl.SpatialCoordinate(mesh)) * dx(1)


class PointForms:
    """The ``bodies`` that are not linear, by their tags, in cells with the same ``rule``: their
    internal forces, and what tangents are above the elastic ones.

    Arrays at the ``q`` points of all cells, with ``k`` components of strain:

    - ``_sigma`` ``(n_cells, q, k)``: the stresses
    - ``_correction`` ``(n_cells, q, k, k)``: the tangents less the elastic ones
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
        vectors = basix.ufl.quadrature_element(cell, (k,), degree=rule)
        tensors = basix.ufl.quadrature_element(cell, (k, k), degree=rule)
        self._sigma = fem.Function(fem.functionspace(V.mesh, vectors))
        self._correction = fem.Function(fem.functionspace(V.mesh, tensors))
        u = strain_of(V, kinematics, ufl.TrialFunction(V), large=large)
        v = strain_of(V, kinematics, ufl.TestFunction(V), large=large)
        cells = np.sort(np.concatenate([body.cells for body in bodies.values()]))

        def integrated(integrand: Any) -> Any:
            return integral(V, kinematics, integrand, cells, rule, quadrature_rule="default")

        self._force = fem.form(integrated(ufl.inner(self._sigma, v)))
        correction = integrated(ufl.inner(ufl.dot(self._correction, u), v))
        self._correction_kernel = fem.compile_form(V.mesh.comm, correction)
        self._corrected_cells: np.ndarray | None = None  # cells of the form that was made last
        self._correction_forms: list[fem.Form] = []

    def _at_points(self, function: fem.Function, *shape: int) -> Array:
        """The values of a quadrature ``function`` as ``(n_cells, q, ...)``."""
        return function.x.array.reshape(-1, self._q, *shape)

    def update(self, u: Array) -> None:
        """Return-map the bodies at the nodal displacements ``u`` ``(n_nodes, d)`` of this rank."""
        for body in self.bodies.values():
            correction = self._at_points(self._correction, self._k, self._k)
            correction[body.flowing] = 0.0
            tangent = body.update(u)
            correction[body.flowing] = tangent[body.flows] - body.elastic
            self._at_points(self._sigma, self._k)[body.cells] = body.forces()

    def let_stresses_be_of_tangent(self, direction: Array) -> None:
        """Put the last tangent, applied to the ``direction`` ``(n_nodes, d)``, in the place of the
        stresses."""
        for body in self.bodies.values():
            correction = self._at_points(self._correction, self._k, self._k)[body.cells]
            stress = np.einsum("nqij,nqj->nqi", correction + body.elastic, body.measure(direction))
            self._at_points(self._sigma, self._k)[body.cells] = stress

    def add_force(self, force: PETSc.Vec) -> None:
        """Add the force of the stresses to this rank's part of ``force``, ghosts included."""
        fem_petsc.assemble_vector(force, self._force)

    def assemble_correction(self, A: PETSc.Mat, bcs: list[fem.DirichletBC]) -> None:
        """Add the consistent minus the elastic tangent to ``A``, in the cells with points that
        flow."""
        cells = np.sort(np.concatenate([body.flowing for body in self.bodies.values()]))
        if self._corrected_cells is None or not np.array_equal(cells, self._corrected_cells):
            domains = {fem.IntegralType.cell: [(1, cells)]}
            coefficients = {self._correction: self._correction}
            form = fem.create_form(
                self._correction_kernel, [self.V, self.V], self.V.mesh, domains, coefficients, {}
            )
            self._corrected_cells = cells
            self._correction_forms = [form]
        assemble(A, self._correction_forms, bcs)

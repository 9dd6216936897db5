"""Bulk terms: internal forces and tangents of elastic and elastic-plastic bodies, assembled by
dolfinx.

Elastic bodies contribute one constant stiffness matrix. Only cells of plastic bodies, and of all at
large strain, carry history, a return map and a tangent that changes; without them nothing of it is
compiled or stored.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import basix.ufl
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc

from archord.geometry.basis import Array, bulk_quadrature_degree
from archord.materials.kinematics import PLANE_STRAIN, Kinematics
from archord.materials.material import Material, Points
from archord.solver.assembly import assemble, matrix
from archord.solver.body_points import BodyPoints, PointFields
from archord.solver.distortion import DistortionMeter

Index = npt.NDArray[np.integer]


class Bulk:
    """Internal forces of all bodies in the displacement space ``V``, whose ``cells`` and
    ``materials`` are given by their tags.

    - ``cells``: the cells ``(n,)`` of a tag that this rank owns
    - ``elastic_forms``: one a body; they span the matrix's pattern
    - ``stiffness``: the matrix of the bodies that stay linear, or None
    - ``distortion``: measures how far cells are strained and turned
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        cells: Mapping[int, Index],
        materials: Mapping[int, Material],
        kinematics: Kinematics = PLANE_STRAIN,
    ) -> None:
        self.V = V
        self.materials = materials
        self.kinematics = kinematics
        self.degree = V.element.basix_element.degree
        self._rule = bulk_quadrature_degree(V.mesh.basix_cell(), self.degree)
        n_owned = self.n_cells
        self.cells = {tag: cells[tag][cells[tag] < n_owned] for tag in materials}
        self.distortion = DistortionMeter(V, self.cells, kinematics)
        self.plastic = any(m.yields for m in materials.values())
        self.finite = any(m.finite for m in materials.values())
        self._nonlinear = self._points_with_history()
        forms = {tag: self._elastic_form(tag) for tag in materials}
        self.elastic_forms = list(forms.values())
        if self._nonlinear:
            self._make_nonlinear_forms()
        self._corrected_cells: np.ndarray | None = None  # cells of the form that was made last
        self._correction_forms: list[fem.Form] = []
        self.stiffness: PETSc.Mat | None = None
        linear = [form for tag, form in forms.items() if tag not in self._nonlinear]
        if linear:
            self.stiffness = matrix(V, linear)
            assemble(self.stiffness, linear)
            self.stiffness.assemble()

    @property
    def n_cells(self) -> int:
        """Cells that this rank owns."""
        topology = self.V.mesh.topology
        return topology.index_map(topology.dim).size_local

    def _points_with_history(self) -> dict[int, BodyPoints]:
        """The points of the bodies that do not stay linear."""
        nonlinear = {tag: m for tag, m in self.materials.items() if m.yields or m.finite}
        if len({m.finite for m in nonlinear.values()}) > 1:
            raise ValueError(
                "bodies at large strain go with linear ones, "
                "or all that yield must be at large strain, too"
            )
        return {tag: self._body_points(tag) for tag in nonlinear}

    def _body_points(self, tag: int) -> BodyPoints:
        return BodyPoints(self.V, self.cells[tag], self.materials[tag], self.kinematics)

    def _elastic_form(self, tag: int) -> fem.Form:
        """The stiffness of a body's elastic tangent."""
        material = self.materials[tag]
        _check_elastic_tangent(material, self.kinematics)
        moduli = fem.Constant(self.V.mesh, np.array(material.elastic_tangent))
        u = self._strain(ufl.TrialFunction(self.V))
        v = self._strain(ufl.TestFunction(self.V))
        return fem.form(self._integral(ufl.inner(ufl.dot(moduli, u), v), self.cells[tag]))

    def _strain(self, u: Any, *, large: bool = False) -> Any:
        """The strain of a UFL displacement ``u`` as a vector, or at ``large`` strain its
        gradient."""
        kinematics = self.kinematics
        derivative = ufl.grad(u)
        radius = ufl.SpatialCoordinate(self.V.mesh)[0]
        gradient = [
            derivative[component, axis] if axis < kinematics.dimension else u[component] / radius
            for component, axis in kinematics.terms
        ]
        if large:
            return ufl.as_vector(gradient)
        rows = [np.flatnonzero(row) for row in kinematics.small]
        return ufl.as_vector([sum(gradient[k] for k in row) for row in rows])

    def _integral(self, integrand: Any, cells: np.ndarray, **metadata: str) -> Any:
        """The integral over these ``cells`` by the bulk rule."""
        mesh = self.V.mesh
        rule = {"quadrature_degree": self._rule, **metadata}
        dx = ufl.Measure("dx", mesh, subdomain_data=[(1, cells)], metadata=rule)
        return integrand * self.kinematics.measure(ufl.SpatialCoordinate(mesh)) * dx(1)

    def _make_nonlinear_forms(self) -> None:
        """Forms of stresses, and of what tangents are above the elastic ones, given at points."""
        V = self.V
        cell = V.mesh.basix_cell()
        bodies = list(self._nonlinear.values())
        self._q = bodies[0].weight.shape[1]
        k = self._k = self.kinematics.n_components(large=self.finite)
        vectors = basix.ufl.quadrature_element(cell, (k,), degree=self._rule)
        tensors = basix.ufl.quadrature_element(cell, (k, k), degree=self._rule)
        self._sigma = fem.Function(fem.functionspace(V.mesh, vectors))
        self._correction = fem.Function(fem.functionspace(V.mesh, tensors))
        u = self._strain(ufl.TrialFunction(V), large=self.finite)
        v = self._strain(ufl.TestFunction(V), large=self.finite)
        cells = np.sort(np.concatenate([body.cells for body in bodies]))
        force = self._integral(ufl.inner(self._sigma, v), cells, quadrature_rule="default")
        correction = self._integral(
            ufl.inner(ufl.dot(self._correction, u), v), cells, quadrature_rule="default"
        )
        self._force = fem.form(force)
        self._correction_kernel = fem.compile_form(V.mesh.comm, correction)

    def _at_points(self, function: fem.Function, *shape: int) -> Array:
        """The values of a quadrature ``function`` as ``(n_cells, q, ...)``."""
        return function.x.array.reshape(-1, self._q, *shape)

    def histories(self) -> dict[int, tuple[np.ndarray, Points]]:
        """Cells ``(n,)`` of this rank and their ``n q`` points, by the tag of a body that is not
        linear."""
        return {tag: (body.cells, body.points) for tag, body in self._nonlinear.items()}

    def update(self, u: Array) -> None:
        """Return-map the bodies that are not linear at the nodal displacements ``u`` ``(n_nodes,
        d)`` of this rank."""
        for body in self._nonlinear.values():
            correction = self._at_points(self._correction, self._k, self._k)
            correction[body.flowing] = 0.0
            tangent = body.update(u)
            correction[body.flowing] = tangent[body.flows] - body.elastic
            self._at_points(self._sigma, self._k)[body.cells] = body.forces()

    def add_force(self, u: PETSc.Vec, force: PETSc.Vec) -> None:
        """Add the internal force of the displacement ``u`` (last passed to `update`) to
        ``force``."""
        if self.stiffness is not None:
            self.stiffness.multAdd(u, force, force)
        if self._nonlinear:
            with force.localForm() as local:
                fem_petsc.assemble_vector(local, self._force)
        force.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def add_action(self, direction: fem.Function, out: PETSc.Vec) -> None:
        """Add the last tangent, applied to ``direction``, to ``out``; `add_force` then needs
        another `update`."""
        u = direction.x.array.reshape(-1, self.kinematics.dimension)
        for body in self._nonlinear.values():
            correction = self._at_points(self._correction, self._k, self._k)[body.cells]
            stress = np.einsum("nqij,nqj->nqi", correction + body.elastic, body.measure(u))
            self._at_points(self._sigma, self._k)[body.cells] = stress
        self.add_force(direction.x.petsc_vec, out)

    def assemble_correction(self, A: PETSc.Mat, bcs: list[fem.DirichletBC]) -> None:
        """Add the tangent correction to ``A``: the consistent minus the elastic tangent, in the
        cells with points that flow."""
        if not self._nonlinear:
            return
        cells = np.sort(np.concatenate([body.flowing for body in self._nonlinear.values()]))
        if self._corrected_cells is None or not np.array_equal(cells, self._corrected_cells):
            domains = {fem.IntegralType.cell: [(1, cells)]}
            coefficients = {self._correction: self._correction}
            form = fem.create_form(
                self._correction_kernel, [self.V, self.V], self.V.mesh, domains, coefficients, {}
            )
            self._corrected_cells = cells
            self._correction_forms = [form]
        assemble(A, self._correction_forms, bcs)

    def energies(self, u: Array) -> tuple[float, float]:
        """Elastic energy and plastic dissipation, this rank's part; collective."""
        stored = dissipated = 0.0
        for body in self._nonlinear.values():
            elastic, plastic = body.energies()
            stored += elastic
            dissipated += plastic
        if self.stiffness is not None:
            x, force = self.stiffness.createVecs()
            x.array[:] = u.ravel()[: x.local_size]
            self.stiffness.mult(x, force)
            stored += 0.5 * float(x.array_r @ force.array_r)
            x.destroy()
            force.destroy()
        return stored, dissipated

    def peeq(self) -> tuple[float, float]:
        """Largest PEEQ at a quadrature point, and the integral of PEEQ over this rank's cells."""
        largest = integral = 0.0
        for body in self._nonlinear.values():
            peeq = np.asarray(body.points.peeq)
            largest = max(largest, float(peeq.max(initial=0.0)))
            integral += float(body.weight.ravel() @ peeq)
        return largest, integral

    def peeq_of(self, tag: int) -> tuple[Array, Array]:
        """PEEQ ``(n q,)`` and places ``(n q, d)`` of this rank's points of a plastic body."""
        body = self._nonlinear[tag]
        return np.asarray(body.points.peeq), body.point.reshape(-1, body.point.shape[-1])

    def at_points(self, u: Array) -> Iterator[PointFields]:
        """The state at this rank's integration points, body by body, at ``u`` ``(n_nodes, d)`` of
        the last update."""
        for tag in self.cells:
            body = self._nonlinear.get(tag)
            if body is None:
                body = self._body_points(tag)
                body.update(u)
            yield body.fields()


def _check_elastic_tangent(material: Material, kinematics: Kinematics) -> None:
    """Raise ValueError for what would be assembled wrongly: an elastic tangent that is not
    symmetric or of other kinematics, or a response that is not that tangent's though the material
    does not yield."""
    material = getattr(material, "inner", material)
    working = list(kinematics.working)
    C = material.elastic_tangent
    if C.shape != (len(working), len(working)):
        raise ValueError(
            f"elastic_tangent of a material must be {len(working)} by {len(working)} "
            f"in a problem whose kinematics are {kinematics.name!r}"
        )
    if not np.allclose(C, C.T, rtol=0, atol=1e-12 * C.max()):
        raise ValueError("elastic_tangent of a material must be symmetric")
    if material.yields:
        return
    strains = [[3.0, -1.0, 4.0, 2.0, -3.0, 1.0], [-20.0, 5.0, 7.0, 10.0, 8.0, -6.0]]
    probe = 1e-3 * np.array(strains)[:, working]
    expected = probe @ C
    found = material.update(probe, material.state(2))[0][:, working]
    if np.abs(found - expected).max() > 1e-9 * np.abs(expected).max():
        raise ValueError(
            "a material whose update is not its elastic_tangent's must say yields = True"
        )

"""Bulk terms: internal forces and tangents of elastic and elastic-plastic bodies, assembled by
dolfinx.

Elastic bodies contribute one constant stiffness matrix. Only cells of plastic bodies, and of all at
large strain, carry history, a return map and a tangent that changes; without them nothing of it is
compiled or stored.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import basix
import basix.ufl
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc

from archord.geometry.basis import (
    Array,
    bulk_quadrature,
    bulk_quadrature_degree,
    cell_basis,
    displacement_gradient,
    strain,
)
from archord.materials.elasticity import mean_stress, von_mises
from archord.materials.material import Material, Points

Index = npt.NDArray[np.integer]
_NO_SLOTS = np.zeros((2, 0), dtype=np.int64)


def _voigt(u):
    e = ufl.sym(ufl.grad(u))
    return ufl.as_vector([e[0, 0], e[1, 1], 2 * e[0, 1]])


def _gradient(u):
    g = ufl.grad(u)
    return ufl.as_vector([g[0, 0], g[1, 1], g[0, 1], g[1, 0]])


_SMALL = np.array(
    [[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1]]
)  # the small strain of a displacement gradient


def matrix(
    V: fem.FunctionSpace, forms: list[fem.Form], extra: Iterable[np.ndarray] = _NO_SLOTS
) -> PETSc.Mat:
    """An empty matrix with room for the bilinear ``forms`` of separate bodies and ``extra`` blocks
    (rows, columns), in global block dofs and rows that this rank owns. PETSc gives back what is not
    written before the first assembly."""
    index_map = V.dofmap.index_map
    n, start = index_map.size_local, index_map.local_range[0]
    rows, columns = extra
    slots = [
        (rows - start, (columns >= start) & (columns < start + n))
    ]  # local rows, and which are in owned columns
    for form in forms:
        pattern = fem.create_sparsity_pattern(form)
        pattern.finalize()
        columns, offsets = pattern.graph
        owned = columns[: offsets[n]] < n
        slots.append((np.repeat(np.arange(n), np.diff(offsets[: n + 1])), owned))
    rows, inside = (np.concatenate(part) for part in zip(*slots, strict=True))
    room = (rows[inside], n), (rows[~inside], index_map.size_global - n)
    nnz = [
        np.minimum(np.bincount(of, minlength=n), most).astype(PETSc.IntType) for of, most in room
    ]
    A = PETSc.Mat().createBAIJ([[2 * n, None]] * 2, bsize=2, nnz=nnz, comm=V.mesh.comm)
    nodes = index_map.local_to_global(np.arange(n + index_map.num_ghosts, dtype=np.int32))
    lgmap = PETSc.LGMap().create(nodes.astype(PETSc.IntType), bsize=2, comm=V.mesh.comm)
    A.setLGMap(lgmap, lgmap)
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, True)
    return A


def assemble(A: PETSc.Mat, forms: list[fem.Form], bcs: Sequence[fem.DirichletBC] = ()) -> None:
    """Add bilinear ``forms`` to ``A``, with ones on the diagonal of the rows of ``bcs``. dolfinx
    inserts those ones; without a flush after each form the next one's additions would be dropped
    silently."""
    for form in forms:
        fem_petsc.assemble_matrix(A, form, list(bcs))
        A.assemblyBegin(PETSc.Mat.AssemblyType.FLUSH)
        A.assemblyEnd(PETSc.Mat.AssemblyType.FLUSH)


class _BodyPoints:
    """The integration points of one body: gradients, weights, points with history."""

    def __init__(self, V: fem.FunctionSpace, cells: np.ndarray, material: Material) -> None:
        degree = V.element.basix_element.degree
        X, w = bulk_quadrature(V.mesh.basix_cell(), degree)
        basis = cell_basis(V.mesh, degree, cells, X)
        self.cells, self.dofs = cells, V.dofmap.list[cells]
        self.gradient, self.point, self.weight = basis.gradient, basis.point, basis.measure * w
        self.points = Points(material, self.weight.size)
        self.strain: Array = np.zeros((self.weight.size, 4))
        self.stress: Array = np.zeros((self.weight.size, 4))
        self.finite, C = material.finite, material.elastic_tangent
        self.elastic = _SMALL.T @ C @ _SMALL if self.finite else C
        self.yielding = cells[
            :0
        ]  # cells that had a point off its elastic tangent at the last update

    def update(self, u: Array) -> Array:
        """Keep the stress at the nodal displacements ``u``; returns the tangent ``(n q, k, k)``, k
        = 3 or 4."""
        self.strain = self.measure(u).reshape(-1, len(self.elastic))
        self.stress, tangent = self.points.update(self.strain)
        return tangent

    def measure(self, u: Array) -> Array:
        """Strain ``(n, q, 3)`` at the nodal displacements ``u``, or displacement gradient ``(n, q,
        4)``."""
        return (displacement_gradient if self.finite else strain)(self.gradient, self.dofs, u)

    def forces(self) -> Array:
        """What of the stress does work on the strain ``(n, q, k)``."""
        stress = self.stress if self.finite else self.stress[:, [0, 1, 3]]
        return stress.reshape(*self.weight.shape, len(self.elastic))


class Distortion(NamedTuple):
    """The largest principal ``strain`` at the middle of a cell, of the body with this ``tag``; the
    largest ``angle`` by which one turns, in radians; and how many cells are turned ``inside_out``,
    at a corner at least."""

    strain: float = 0.0
    tag: int = -1
    angle: float = 0.0
    inside_out: int = 0

    def joined(self, other: Distortion) -> Distortion:
        """Of the cells of both."""
        strain, tag = max(self[:2], other[:2])
        return Distortion(
            strain, tag, max(self.angle, other.angle), self.inside_out + other.inside_out
        )


class PointFields(NamedTuple):
    """Fields at the integration points ``coordinates`` ``(n, q, 2)`` of a body's ``cells``
    ``(n,)``: ``weight`` and ``peeq`` ``(n, q)``, ``stress`` and ``plastic_strain`` ``(n, q,
    4)``."""

    cells: np.ndarray
    coordinates: Array
    weight: Array
    stress: Array
    plastic_strain: Array
    peeq: Array


def _check_elastic_tangent(material: Material) -> None:
    """Raise ValueError for what would be assembled wrongly: an elastic tangent that is not
    symmetric, or a response that is not that tangent's though the material does not yield."""
    material = getattr(material, "inner", material)
    C, probe = material.elastic_tangent, 1e-3 * np.array([[3.0, -1.0, 2.0], [-20.0, 5.0, 10.0]])
    if not np.allclose(C, C.T, rtol=0, atol=1e-12 * C.max()):
        raise ValueError("elastic_tangent of a material must be symmetric")
    expected, found = probe @ C, material.update(probe, material.state(2))[0][:, [0, 1, 3]]
    if not material.yields and np.abs(found - expected).max() > 1e-9 * np.abs(expected).max():
        raise ValueError(
            "a material whose update is not its elastic_tangent's must say yields = True"
        )


class Bulk:
    """Internal forces of all bodies in the displacement space ``V`` (blocked, two components),
    whose ``cells`` and ``materials`` are given by their tags. ``elastic_forms``, one a body, span
    the matrix's pattern."""

    def __init__(
        self, V: fem.FunctionSpace, cells: Mapping[int, Index], materials: Mapping[int, Material]
    ) -> None:
        self.V, self.materials = V, materials
        self.degree = V.element.basix_element.degree
        rule = bulk_quadrature_degree(V.mesh.basix_cell(), self.degree)
        n_owned = V.mesh.topology.index_map(2).size_local
        self.cells = {tag: cells[tag][cells[tag] < n_owned] for tag in materials}
        u, v = _voigt(ufl.TrialFunction(V)), _voigt(ufl.TestFunction(V))
        nonlinear = {tag: m for tag, m in materials.items() if m.yields or m.finite}
        if len({m.finite for m in nonlinear.values()}) > 1:
            raise ValueError(
                "bodies at large strain go with linear ones, or all that yield must be at large strain, too"
            )
        self._nonlinear = {tag: _BodyPoints(V, self.cells[tag], m) for tag, m in nonlinear.items()}
        self.plastic = any(m.yields for m in materials.values())
        self.finite = any(m.finite for m in materials.values())
        self._at_corners: dict[int, Array] = {}
        elastic = {}
        for tag, material in materials.items():
            _check_elastic_tangent(material)
            moduli = fem.Constant(V.mesh, np.array(material.elastic_tangent))
            domain = [(1, self.cells[tag])]
            dx = ufl.Measure(
                "dx", V.mesh, subdomain_data=domain, metadata={"quadrature_degree": rule}
            )(1)
            elastic[tag] = fem.form(ufl.inner(ufl.dot(moduli, u), v) * dx)
        self.elastic_forms = list(elastic.values())
        if self._nonlinear:
            cell, metadata = (
                V.mesh.basix_cell(),
                {"quadrature_degree": rule, "quadrature_rule": "default"},
            )
            k = self._k = len(next(iter(self._nonlinear.values())).elastic)
            element = [
                basix.ufl.quadrature_element(cell, shape, degree=rule) for shape in ((k,), (k, k))
            ]
            self._sigma, self._correction = (
                fem.Function(fem.functionspace(V.mesh, e)) for e in element
            )
            if k == 4:
                u, v = _gradient(ufl.TrialFunction(V)), _gradient(ufl.TestFunction(V))
            domain = [(1, np.sort(np.concatenate([p.cells for p in self._nonlinear.values()])))]
            dx = ufl.Measure("dx", V.mesh, subdomain_data=domain, metadata=metadata)(1)
            self._force = fem.form(ufl.inner(self._sigma, v) * dx)
            self._correction_kernel = fem.compile_form(
                V.mesh.comm, ufl.inner(ufl.dot(self._correction, u), v) * dx
            )
        self._corrected_cells: np.ndarray | None = None  # those of the form that was made last
        self._correction_forms: list[fem.Form] = []
        self.stiffness = None  # of the bodies that stay linear
        stiff = [form for tag, form in elastic.items() if tag not in self._nonlinear]
        if stiff:
            self.stiffness = matrix(V, stiff)
            assemble(self.stiffness, stiff)
            self.stiffness.assemble()

    def histories(self) -> dict[int, tuple[np.ndarray, Points]]:
        """Cells ``(n,)`` of this rank and their ``n q`` points, by the tag of a body that is not
        linear."""
        return {tag: (body.cells, body.points) for tag, body in self._nonlinear.items()}

    def update(self, u: Array) -> None:
        """Return-map the bodies that are not linear at the nodal displacements ``u`` ``(n_nodes,
        2)`` of this rank."""
        for body in self._nonlinear.values():
            tangent, (n, q), k = body.update(u), body.weight.shape, self._k
            self._sigma.x.array.reshape(-1, q, k)[body.cells] = body.forces()
            # points that do not flow have its diagonal
            a, b, c = (tangent[:, i, i] != body.elastic[i, i] for i in range(3))
            flows = (a | b | c).reshape(n, q).any(axis=1)
            correction = self._correction.x.array.reshape(-1, k * k * q)
            correction[body.yielding] = 0.0
            body.yielding = body.cells[flows]
            correction[body.yielding] = (tangent.reshape(n, q, k, k)[flows] - body.elastic).reshape(
                -1, k * k * q
            )

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
        for body in self._nonlinear.values():
            eps, k = body.measure(direction.x.array.reshape(-1, 2)), self._k
            q = eps.shape[1]
            moduli = self._correction.x.array.reshape(-1, q, k, k)[body.cells] + body.elastic
            self._sigma.x.array.reshape(-1, q, k)[body.cells] = np.einsum(
                "nqij,nqj->nqi", moduli, eps
            )
        self.add_force(direction.x.petsc_vec, out)

    def assemble_correction(self, A: PETSc.Mat, bcs: list[fem.DirichletBC]) -> None:
        """Add the tangent correction to ``A``: the consistent minus the elastic tangent, in the
        cells that yield."""
        if not self._nonlinear:
            return
        cells = np.sort(np.concatenate([body.yielding for body in self._nonlinear.values()]))
        if self._corrected_cells is None or not np.array_equal(cells, self._corrected_cells):
            domains = {fem.IntegralType.cell: [(1, cells)]}
            coefficients = {self._correction: self._correction}
            form = fem.create_form(
                self._correction_kernel, [self.V, self.V], self.V.mesh, domains, coefficients, {}
            )
            self._corrected_cells, self._correction_forms = cells, [form]
        assemble(A, self._correction_forms, bcs)

    def energies(self, u: Array) -> tuple[float, float]:
        """Elastic energy and plastic dissipation, this rank's part; collective."""
        stored = dissipated = 0.0
        for data in self._nonlinear.values():
            w, points = data.weight.ravel(), data.points
            stored += float(w @ points.material.stored(data.strain, data.stress, points.trial))
            dissipated += float(
                w @ np.broadcast_to(points.material.dissipation(points.trial), w.shape)
            )
        if self.stiffness is not None:
            x, force = self.stiffness.createVecs()
            x.array[:] = u[: x.local_size // 2].ravel()
            self.stiffness.mult(x, force)
            stored += 0.5 * float(x.array_r @ force.array_r)
            x.destroy()
            force.destroy()
        return stored, dissipated

    def peeq(self) -> tuple[float, float]:
        """Largest PEEQ at a quadrature point, and the integral of PEEQ over this rank's cells."""
        largest = integral = 0.0
        for data in self._nonlinear.values():
            peeq = np.asarray(data.points.peeq)
            largest = max(largest, float(peeq.max(initial=0.0)))
            integral += float(data.weight.ravel() @ peeq)
        return largest, integral

    def peeq_of(self, tag: int) -> tuple[Array, Array]:
        """PEEQ ``(n q,)`` and places ``(n q, 2)`` of this rank's points of a plastic body."""
        body = self._nonlinear[tag]
        return np.asarray(body.points.peeq), body.point.reshape(-1, 2)

    def at_points(self, u: Array) -> Iterator[PointFields]:
        """The state at this rank's integration points, body by body, at ``u`` ``(n_nodes, 2)`` of
        the last update."""
        for tag, cells in self.cells.items():
            body = self._nonlinear.get(tag)
            if body is None:
                body = _BodyPoints(self.V, cells, self.materials[tag])
                body.update(u)
            shape, points = (*body.weight.shape, 4), body.points
            stress = points.material.true_stress(body.strain, body.stress, points.trial).reshape(
                shape
            )
            plastic_strain = getattr(points.trial, "plastic_strain", np.zeros_like(stress)).reshape(
                shape
            )
            peeq = points.peeq.reshape(body.weight.shape)
            yield PointFields(cells, body.point, body.weight, stress, plastic_strain, peeq)

    def distortion(self, u: Array) -> Distortion:
        """How far the cells of this rank are strained, turned and turned over at ``u`` ``(n_nodes,
        2)``."""
        worst = Distortion()
        for tag in self.cells:
            H = displacement_gradient(self._corners(tag), self.V.dofmap.list[self.cells[tag]], u)
            xx, yy, xy, yx = np.moveaxis(H, 2, 0)
            over = ((1 + xx) * (1 + yy) <= xy * yx).any(axis=1)
            principal = np.abs(xx + yy) / 2 + np.hypot(xx - yy, xy + yx) / 2
            largest = float(principal[:, 0].max(initial=0.0))
            angle = float(np.abs(yx - xy)[:, 0].max(initial=0.0)) / 2
            worst = worst.joined(Distortion(largest, tag, angle, int(over.sum())))
        return worst

    def _corners(self, tag: int) -> Array:
        """Gradients ``(n, q, a, 2)`` of the basis at the middle and at the corners of a body's
        cells."""
        if tag not in self._at_corners:
            corners = basix.geometry(self.V.mesh.basix_cell())
            X = np.vstack([corners.mean(axis=0), corners])
            self._at_corners[tag] = cell_basis(
                self.V.mesh, self.degree, self.cells[tag], X
            ).gradient
        return self._at_corners[tag]

    def cell_fields(self, parts: Iterable[PointFields]) -> dict[str, Array]:
        """Cell means of `at_points`: "von_mises" and "mean_stress" ``(n_cells,)``, "stress"
        ``(n_cells, 4)``; where a body can yield "peeq" and "plastic_strain"."""
        fields: dict[str, Array] = {}
        for part in parts:
            values = {
                "von_mises": von_mises(part.stress),
                "mean_stress": mean_stress(part.stress),
                "stress": part.stress,
            }
            if self.plastic:
                values |= {"peeq": part.peeq, "plastic_strain": part.plastic_strain}
            share = part.weight / part.weight.sum(axis=1, keepdims=True)
            for name, value in values.items():
                whole = fields.setdefault(
                    name, np.zeros((self.V.mesh.topology.index_map(2).size_local, *value.shape[2:]))
                )
                whole[part.cells] = np.einsum("nq,nq...->n...", share, value)
        return fields

"""Bulk terms: internal forces and tangents of elastic and elastic-plastic bodies, assembled by
dolfinx.

Elastic bodies contribute one constant stiffness matrix. Only cells of plastic bodies, and of all at
large strain, carry history, a return map and a tangent that changes; without them nothing of it is
stored.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from archord.geometry.basis import Array
from archord.geometry.cell_rules import CellRule, cell_rules
from archord.geometry.strain import strain_terms
from archord.materials.faults import overwrites
from archord.materials.kinematics import PLANE_STRAIN, Ints, Kinematics
from archord.materials.material import Material, Points, of_small_strain
from archord.solver.bulk.assembly import assemble, matrix
from archord.solver.bulk.body_points import BodyPoints, PointFields
from archord.solver.bulk.distortion import DistortionMeter
from archord.solver.bulk.point_forms import PointForms
from archord.solver.bulk.stiffness import CellStiffness

_NONE = np.zeros(0, dtype=np.int32)


class Bulk:
    """Internal forces of all bodies in the displacement space ``V``, whose ``cells`` and
    ``materials`` are given by their tags; cells ``in_contact`` may need more points than others.

    - ``cells``: the cells ``(n,)`` of a tag that this rank owns
    - ``elastic_forms``: one a body and rule; they span the matrix's pattern
    - ``stiffness``: the matrix of the bodies that stay linear, or None
    - ``distortion``: measures how far cells are strained and turned
    """

    def __init__(
        self,
        V: fem.FunctionSpace,
        cells: Mapping[int, Ints],
        materials: Mapping[int, Material],
        kinematics: Kinematics = PLANE_STRAIN,
        in_contact: Ints = _NONE,
    ) -> None:
        self.V = V
        self.materials = materials
        self.kinematics = kinematics
        self.degree = V.element.basix_element.degree
        self._rules = cell_rules(V.mesh, self.degree, in_contact)
        n_owned = self.n_cells
        self.cells = {tag: cells[tag][cells[tag] < n_owned] for tag in materials}
        self.distortion = DistortionMeter(V, self.cells, kinematics)
        self.plastic = any(m.yields for m in materials.values())
        self.finite = any(m.finite for m in materials.values())
        self._nonlinear = [tag for tag, m in materials.items() if m.yields or m.finite]
        self._forms = self._point_forms()
        self.elastic_forms: list[fem.Form] = []
        linear = []
        for tag in materials:
            forms = [self._elastic_form(tag, rule) for rule in self._rules]
            self.elastic_forms += forms
            if tag not in self._nonlinear:
                linear += forms
        self.stiffness: PETSc.Mat | None = None
        if linear:
            self.stiffness = matrix(V, linear)
            assemble(self.stiffness, linear)
            self.stiffness.assemble()

    @property
    def n_cells(self) -> int:
        """Cells that this rank owns."""
        topology = self.V.mesh.topology
        return topology.index_map(topology.dim).size_local

    def _point_forms(self) -> list[PointForms]:
        """The forms of the bodies that do not stay linear, one a rule."""
        if not self._nonlinear:
            return []
        if len({self.materials[tag].finite for tag in self._nonlinear}) > 1:
            raise ValueError(
                "bodies at large strain go with linear ones, "
                "or all that yield must be at large strain, too"
            )
        found = []
        for rule in self._rules:
            bodies = {tag: self._body_points(tag, rule) for tag in self._nonlinear}
            forms = PointForms(self.V, rule.degree, bodies, self.kinematics, large=self.finite)
            found.append(forms)
        return found

    def _body_points(self, tag: int, rule: CellRule) -> BodyPoints:
        cells = rule.among(self.cells[tag])
        return BodyPoints(self.V, cells, self.materials[tag], self.kinematics, rule.degree)

    def _elastic_form(self, tag: int, rule: CellRule) -> fem.Form:
        """The stiffness of a body's elastic tangent in the cells that have the ``rule``."""
        material = self.materials[tag]
        _check_elastic_tangent(material, self.kinematics)
        terms = strain_terms(self.kinematics)
        moduli = material.elastic_tangent
        form = CellStiffness(self.V, self.kinematics, rule.degree, terms, moduli)
        return form.over(rule.among(self.cells[tag]))

    def histories(self) -> dict[str, tuple[Ints, Points]]:
        """Cells ``(n,)`` of this rank and their ``n q`` points, of the bodies that are not linear:
        by the body's tag, in cells with the full rule by its tag and "full"."""
        found = {}
        for forms, ending in zip(self._forms, ("", " full"), strict=False):
            for tag, body in forms.bodies.items():
                found[f"{tag}{ending}"] = body.cells, body.points
        return found

    def update(self, u: Array) -> None:
        """Return-map the bodies that are not linear at the nodal displacements ``u`` ``(n_nodes,
        d)`` of this rank."""
        for forms in self._forms:
            forms.update(u)

    def add_force(self, u: PETSc.Vec, force: PETSc.Vec) -> None:
        """Add the internal force of the displacement ``u`` (last passed to `update`) to
        ``force``."""
        if self.stiffness is not None:
            self.stiffness.multAdd(u, force, force)
        if self._forms:
            with force.localForm() as local:
                of_nodes = local.array.reshape(-1, self.kinematics.dimension)
                for forms in self._forms:
                    forms.add_force(of_nodes)
        force.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)

    def add_action(self, direction: fem.Function, out: PETSc.Vec) -> None:
        """Add the last tangent, applied to ``direction``, to ``out``; `add_force` then needs
        another `update`."""
        u = direction.x.array.reshape(-1, self.kinematics.dimension)
        for forms in self._forms:
            forms.let_stresses_be_of_tangent(u)
        self.add_force(direction.x.petsc_vec, out)

    def assemble_correction(self, A: PETSc.Mat, bcs: list[fem.DirichletBC]) -> None:
        """Add the tangent correction to ``A``: the consistent minus the elastic tangent, in the
        cells with points that flow."""
        for forms in self._forms:
            forms.assemble_correction(A, bcs)

    def _bodies(self) -> Iterator[BodyPoints]:
        """The points of the bodies that are not linear, rule by rule."""
        for forms in self._forms:
            yield from forms.bodies.values()

    def energies(self, u: Array) -> tuple[float, float]:
        """Elastic energy and plastic dissipation, this rank's part; collective."""
        stored = dissipated = 0.0
        for body in self._bodies():
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
        for body in self._bodies():
            peeq = np.asarray(body.points.peeq)
            largest = max(largest, float(peeq.max(initial=0.0)))
            integral += float(body.weight.ravel() @ peeq)
        return largest, integral

    def peeq_of(self, tag: int) -> tuple[Array, Array]:
        """PEEQ ``(n q,)`` and places ``(n q, d)`` of this rank's points of a plastic body."""
        bodies = [forms.bodies[tag] for forms in self._forms]
        peeq = np.concatenate([np.asarray(body.points.peeq) for body in bodies])
        places = [body.point.reshape(-1, body.point.shape[-1]) for body in bodies]
        return peeq, np.concatenate(places)

    def at_points(self, u: Array) -> Iterator[PointFields]:
        """The state at this rank's integration points, body by body and rule by rule, at ``u``
        ``(n_nodes, d)`` of the last update."""
        for tag in self.cells:
            if tag in self._nonlinear:
                yield from (forms.bodies[tag].fields() for forms in self._forms)
                continue
            for rule in self._rules:
                body = self._body_points(tag, rule)
                body.update(u)
                yield body.fields()


def _check_elastic_tangent(material: Material, kinematics: Kinematics) -> None:
    """Raise ValueError for what would be assembled wrongly: an elastic tangent that is not
    symmetric or of other kinematics, or a response that is not that tangent's though the material
    does not yield."""
    material = of_small_strain(material)
    working = list(kinematics.working)
    C = material.elastic_tangent
    if C.shape != (len(working), len(working)):
        raise ValueError(
            f"elastic_tangent of a material must be {len(working)} by {len(working)} "
            f"in a problem whose kinematics are {kinematics.name!r}"
        )
    if not np.allclose(C, C.T, rtol=0, atol=1e-12 * C.max()):
        raise ValueError("elastic_tangent of a material must be symmetric")
    strains = [[3.0, -1.0, 4.0, 2.0, -3.0, 1.0], [-20.0, 5.0, 7.0, 10.0, 8.0, -6.0]]
    probe = 1e-3 * np.array(strains)[:, working]
    if material.finite:
        _check_answers(material, 1e-3 * np.eye(2, len(kinematics.gradient)), kinematics)
    else:
        _check_answers(material, probe, kinematics)
    if material.yields or material.finite:
        return
    expected = probe @ C
    found = material.update(probe, material.state(2))[0][:, working]
    if np.abs(found - expected).max() > 1e-9 * np.abs(expected).max():
        raise ValueError(
            "a material whose update is not its elastic_tangent's must say yields = True"
        )


def _check_answers(material: Material, probe: Array, kinematics: Kinematics) -> None:
    """Raise ValueError for answers of a ``material`` that would be read wrongly: of other shapes or
    types, or in arrays that later answers, as at the strain ``probe`` ``(2, k)``, change."""
    state = material.state(2)
    name = type(material).__name__

    def answer_at(strain: Array) -> tuple[Array, Array, Any]:
        return material.update(strain.copy(), deepcopy(state))

    at_rest = np.zeros_like(probe)
    stress, tangent, new = answer_at(at_rest)
    k = probe.shape[1]
    shape = (2, k if material.finite else kinematics.n_stress)
    found = np.asarray(stress)
    if found.shape != shape or found.dtype != float:
        raise ValueError(
            f"{name}.update must give float64 stresses of the shape {shape} at 2 points, "
            f"not {found.dtype} of the shape {found.shape}"
        )
    if np.shape(tangent) != (2, k, k):
        raise ValueError(
            f"{name}.update must give tangents of the shape {(2, k, k)} at 2 points, not "
            f"{np.shape(tangent)}"
        )
    if overwrites(answer_at, [at_rest], [probe]):
        raise ValueError(
            f"{name}.update must give new arrays, and not write into arrays that it gave before"
        )
    of_new = at_rest.copy(), np.array(stress), deepcopy(new)
    told = {
        "flows": material.flows(deepcopy(state), deepcopy(new)),
        "peeq": material.peeq(deepcopy(new)),
        "dissipation": material.dissipation(deepcopy(new)),
    }
    if material.yields or material.finite:
        told["stored"] = material.stored(*of_new)
    for method, answer in told.items():
        found = np.asarray(answer)
        if found.shape not in ((), (2,)) or found.dtype == object:
            raise ValueError(
                f"{name}.{method} must give numbers of the shape (2,) at 2 points, not "
                f"{found.dtype} of the shape {found.shape}"
            )

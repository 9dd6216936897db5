"""The paper's quarter joint by asimov-contact: ``python3 asimov_joint.py --case elastic --steps 2
--output r.json``.

Needs dolfinx 0.9 and gmsh (of archord's image), asimov-contact, which `asimov_build.sh` makes, and
nothing of archord but `joint_script` beside it. asimov-contact has no plasticity.

- Bodies: curved second-order triangles (gmsh's, nodes on the circles), P2 displacements.
- Contact: asimov-contact's unbiased Nitsche method, frictionless, on both arcs. A ray along the
normal of a point finds its partner. Pairs and normals are those of the deformed mesh (kinematics
"current"): they are found again until Newton's method has nothing to do.
- asimov-contact's Newton solver with PETSc's LU by MUMPS.
"""

from __future__ import annotations

import io
import sys
from contextlib import redirect_stdout
from importlib.metadata import version
from pathlib import Path

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem import petsc
from dolfinx.graph import adjacencylist
from joint_script import (
    BLOCK,
    DR,
    ITERATIONS,
    LAME,
    MU,
    PIN,
    E,
    axis_pressure,
    main,
    mesh_bodies,
)
from mpi4py import MPI

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / ".cache" / "asimov" / "python"))

from dolfinx_contact import NewtonSolver
from dolfinx_contact.cpp import ContactMode, pack_gradient_quadrature
from dolfinx_contact.general_contact.contact_problem import ContactProblem, FrictionLaw

GAMMA = 10 * E  # Nitsche's parameter over the order squared, as in asimov-contact's demos
QUADRATURE = 6  # degree on the arcs
TOLERANCE = 1e-10  # of the residual's norm; a usual P is 1e-2
SEARCHES = 20  # for the pairs of one step
LU = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}
NEWTON = {"atol": TOLERANCE, "rtol": np.inf, "max_it": ITERATIONS}


class Joint:
    """asimov-contact's model of half of the joint below the pin's diameter."""

    def __init__(self, size: float, growth: float, order: int, plastic: bool) -> None:
        if plastic:
            raise SystemExit("asimov-contact has no plasticity")
        self.mesh = self._mesh(size, growth)
        self.V = fem.functionspace(self.mesh, ("Lagrange", order, (2,)))
        self.u = fem.Function(self.V)
        self.du = fem.Function(self.V)
        self._forms()
        self._hold()
        self._contact(order)
        self._solver()
        self.dofs = 2 * self.V.dofmap.index_map.size_global
        self.zero = self.u.x.array.copy()

    def _mesh(self, size: float, growth: float):
        points, cells = mesh_bodies(size, growth, PIN, BLOCK)
        # midpoints: gmsh's first is between the first two corners, dolfinx's between the last two
        cells = cells[:, [0, 1, 2, 4, 5, 3]]
        element = basix.ufl.element("Lagrange", "triangle", 2, shape=(2,))
        return mesh.create_mesh(MPI.COMM_SELF, cells, points, element)

    def _facets(self, where):
        """The facets on the boundary at whose ends ``where(x, y)`` is true."""
        return mesh.locate_entities_boundary(self.mesh, 1, lambda x: where(x[0], x[1]))

    def _forms(self) -> None:
        """The bodies without contact, linear in the increment ``du`` after ``u``."""
        v = ufl.TestFunction(self.V)
        strain = ufl.sym(ufl.grad(self.u + self.du))
        stress = 2 * MU * strain + LAME * ufl.tr(strain) * ufl.Identity(2)
        forces = ufl.inner(stress, ufl.grad(v)) * ufl.dx
        self.forces = fem.form(forces)
        self.stiffness = fem.form(ufl.derivative(forces, self.du))

    def _hold(self) -> None:
        """Hold increments on the axis, on the block's top, and on the pin's diameter in y."""
        on_axis = self._facets(lambda x, y: np.abs(x) < 1e-9)
        on_block = self._facets(lambda x, y: np.abs(y) < 1e-9)
        on_pin = self._facets(lambda x, y: np.abs(y + DR) < 1e-9)
        supports = ((0, on_axis), (0, on_block), (1, on_block), (1, on_pin))
        held = [
            fem.locate_dofs_topological(self.V.sub(component), 1, facets)
            for component, facets in supports
        ]
        self.top = held[-1]
        self.held = np.unique(np.concatenate(held))
        of_pin = mesh.locate_entities(self.mesh, 2, lambda x: np.hypot(x[0], x[1] + DR) < 1 + 1e-9)
        self.pin = 2 * np.unique(self.V.dofmap.list[of_pin]) + 1

    def _contact(self, order: int) -> None:
        """The contact of both arcs, each with points that look for the other one."""
        arcs = [
            self._facets(lambda x, y, c=c, r=r: np.abs(np.hypot(x, y - c) - r) < 1e-9)
            for c, r in (PIN, BLOCK)
        ]
        tags = np.repeat(np.arange(2, dtype=np.int32), [len(arc) for arc in arcs])
        facets = np.concatenate(arcs)
        sorting = np.argsort(facets)
        marked = mesh.meshtags(self.mesh, 1, facets[sorting], tags[sorting])
        self.contact = ContactProblem(
            [marked],
            adjacencylist(np.array([0, 1], dtype=np.int32), np.array([0, 2], dtype=np.int32)),
            [(0, 1), (1, 0)],
            self.mesh,
            QUADRATURE,
            [ContactMode.Raytracing] * 2,
        )
        constants = fem.functionspace(self.mesh, ("DG", 0))
        data = {"u": self.u, "du": self.du}
        for name, value in (("mu", MU), ("lambda", LAME)):
            data[name] = fem.Function(constants)
            data[name].x.array[:] = value
        symmetric = 1
        self.contact.generate_contact_data(
            FrictionLaw.Frictionless, self.V, data, GAMMA * order**2, symmetric
        )

    def _solver(self) -> None:
        residual = petsc.create_vector(self.forces)
        matrix = self.contact.create_matrix(self.stiffness)
        self.newton = NewtonSolver(self.mesh.comm, matrix, residual, self.contact.coeffs)
        self.newton.set_coefficients(lambda x, _: self.contact.update_contact_data(self.du))
        self.newton.set_residual(self._assemble_residual)
        self.newton.set_jacobian(self._assemble_matrix)
        self.newton.set_newton_options(NEWTON)
        self.newton.set_krylov_options(LU)

    def _assemble_residual(self, x, b, _) -> None:
        b.zeroEntries()
        self.contact.assemble_vector(b, self.V)
        petsc.assemble_vector(b, self.forces)
        b.array_w[self.held] = 0.0

    def _assemble_matrix(self, x, matrix, _) -> None:
        matrix.zeroEntries()
        self.contact.assemble_matrix(matrix, self.V)
        petsc.assemble_matrix(matrix, self.stiffness)
        matrix.assemble()
        # asimov-contact leaves entries of the contact in rows that are held
        matrix.zeroRows(self.held)

    def _find_pairs(self) -> None:
        """Pairs, gaps and normals of the mesh deformed by ``u``, before a new increment."""
        self.contact.update_contact_detection(self.u)
        self.newton.set_petsc_matrix(self.contact.create_matrix(self.stiffness))

    def elastic(self, delta: float):
        """The state at ``delta``, from a pin that moved as a rigid body."""
        start = self.zero.copy()
        start[self.pin] = -delta
        return self.solve(start, delta)[0]

    def solve(self, guess, delta: float):
        """State of equilibrium from ``guess`` on, and iterations."""
        self.u.x.array[:] = guess
        iterations = 0
        for _ in range(SEARCHES):
            self.du.x.array[:] = 0.0
            self._find_pairs()
            with redirect_stdout(io.StringIO()):
                count, converged = self.newton.solve(self.du)
            if not converged:
                break
            if not count:
                return self.u.x.array.copy(), iterations
            iterations += count
            self.u.x.array[:] += self.du.x.array
        raise RuntimeError("no equilibrium")

    def commit(self) -> None:
        """Nothing: elastic bodies have no history."""

    def results(self) -> dict[str, float | None]:
        """Force of the whole joint, and pressure on the axis from the stress on both arcs."""
        forces = petsc.assemble_vector(self.forces)
        force = -2 * float(forces.array[self.top].sum())
        arcs = [self._pressure(pair, height) for pair, (height, _) in enumerate((PIN, BLOCK))]
        angle, pressure = np.concatenate(arcs, axis=1)
        return {"P": force, "p0": axis_pressure(angle, pressure)}

    def _pressure(self, pair: int, height: float):
        """Angles and negative normal stresses ``(2, n)`` of the points of an arc, whose centre is
        at ``height``."""
        facets = self.contact.entities[pair]
        x = np.array([self.contact.qp_phys(pair, facet) for facet in range(len(facets))])
        normal = self.contact.pack_nx(pair).reshape(x.shape)
        strain = pack_gradient_quadrature(self.u._cpp_object, QUADRATURE, facets)
        strain = strain.reshape(*x.shape, 2)
        stretch = np.einsum("fqi,fqij,fqj->fq", normal, strain, normal)
        stress = 2 * MU * stretch + LAME * np.trace(strain, axis1=2, axis2=3)
        angle = np.arctan2(x[..., 0], height - x[..., 1])
        return angle.ravel(), -stress.ravel()


if __name__ == "__main__":
    main(Joint, "current", version("dolfinx_contact"))

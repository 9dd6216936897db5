"""The paper's quarter joint by scikit-fem: ``python3 skfem_joint.py --case plastic --steps 20 --output r.json``.

Needs scikit-fem, gmsh and pypardiso (all of PyPI), and nothing of archord but `joint_script` beside it.

- Bodies: MeshTri2 (gmsh's second-order triangles, nodes on the circles), P2 displacements, three points a triangle.
  Elements have the size h on the arcs and grow by 0.25 times the distance from there, below h = 0.04 by 6.25 h times.
- Contact: kinematics "reference". A point x of the pin's arc, with its normal n, faces the point y of the hole on
  that normal in the touching configuration; the gap g = (y - x) . n - (u(x) - u(y)) . n is linear and the pressure is
  k <-g>, k = 1e5 E*/R (penalty): a usual pressure E* dR/R goes 1e-5 dR deep. Two Gauss points a facet, as many as it
  has own nodes.
- Plasticity: J2, perfect, radial return with its consistent tangent (Simo and Hughes 1998, box 3.2).
- Newton's method with full steps; where it fails, the step is cut. Residual: 1e-8 of the reaction. All element
  matrices at once by numpy, their sum by slots of the sparse matrix found once; MKL's PARDISO.
"""

from __future__ import annotations

import os
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from joint_script import BLOCK, DR, ITERATIONS, LAME, MU, PIN, SIGY, NoConvergence, R, axis_pressure, main, mesh_bodies

PENALTY, POINTS = 1e5, 2
TOLERANCE, FAR = 1e-8, 1e3  # residuals over the reaction


class Sum:
    """Sparse sum of element matrices ``(m, k, k)`` over rows ``dofs`` ``(m, k)``: the slots are found once."""

    def __init__(self, dofs, free) -> None:
        """``free`` ``(n,)`` numbers the unconstrained dofs, -1 elsewhere."""
        rows, cols = (np.broadcast_to(a, (*dofs.shape, dofs.shape[1])) for a in (dofs[:, :, None], dofs[:, None, :]))
        self.n = int(free.max()) + 1
        # of the free dofs the upper triangle, which is all that the solver reads
        self.kept = (free[rows] >= 0) & (free[cols] >= free[rows])
        keys, self.slot = np.unique(free[rows][self.kept] * self.n + free[cols][self.kept], return_inverse=True)
        self.indices = keys % self.n
        self.indptr = np.searchsorted(keys, self.n * np.arange(self.n + 1))

    def __call__(self, blocks):
        """Upper triangle of the summed matrix, CSR."""
        data = np.bincount(self.slot, blocks[self.kept], len(self.indices))
        return sparse.csr_matrix((data, self.indices, self.indptr), (self.n, self.n))


def make_solver():
    """A function of an upper triangle and a right-hand side: MKL's PARDISO for positive definite matrices."""
    for library in sorted(Path(sys.prefix).glob("lib/libmkl_rt.so*")):
        os.environ.setdefault("PYPARDISO_MKL_RT", str(library))  # the package would search the whole environment
    from pypardiso import PyPardisoSolver
    from pypardiso.pardiso_wrapper import PyPardisoError

    solver = PyPardisoSolver(mtype=2)

    def solve(a, b):
        a.indptr, a.indices = a.indptr.astype(np.int32), a.indices.astype(np.int32)
        # PyPardisoSolver.solve orders the unknowns each time (phase 11); their pattern never changes.
        try:
            for phase in (23,) if solver.phase == 23 else (11, 23):
                solver.set_phase(phase)
                x = solver._call_pardiso(a, b[:, None])
        except PyPardisoError as error:
            raise NoConvergence(str(error)) from None
        return x.ravel()

    return solve


def return_map(strain, history, sigy: float):
    """Stress ``(m, q, 3)`` (xx, yy, xy), tangent ``(m, q, 3, 3)`` and new history of total strains (xx, yy, 2 xy).

    ``history`` ``(m, q, 4)`` is the plastic strain (xx, yy, zz, xy).
    """
    volumetric = strain[..., 0] + strain[..., 1]
    deviator = np.stack([strain[..., 0], strain[..., 1], 0 * volumetric, strain[..., 2] / 2], axis=-1) - history
    deviator[..., :3] -= (volumetric / 3)[..., None]
    s = 2 * MU * deviator
    norm = np.sqrt((s[..., :3] ** 2).sum(-1) + 2 * s[..., 3] ** 2)
    radius = np.sqrt(2 / 3) * sigy
    plastic = norm > radius
    ratio = np.where(plastic, radius / np.maximum(norm, 1e-300), 1.0)
    n = s / np.maximum(norm, 1e-300)[..., None]
    stress = ratio[..., None] * s
    new = history + np.where(plastic, (norm - radius) / (2 * MU), 0.0)[..., None] * n
    stress[..., :3] += ((LAME + 2 * MU / 3) * volumetric)[..., None]
    # Box 3.2: bulk modulus, 2 mu theta times the deviatoric projection, less 2 mu theta n x n (perfect plasticity).
    bulk = np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 0]])
    projection = np.diag([1, 1, 0.5]) - bulk / 3
    directions = n[..., [0, 1, 3]]
    tangent = (LAME + 2 * MU / 3) * bulk + 2 * MU * ratio[..., None, None] * projection
    tangent -= (2 * MU * ratio * plastic)[..., None, None] * (directions[..., :, None] * directions[..., None, :])
    return stress[..., [0, 1, 3]], tangent, new


class Joint:
    """Half of the joint below the pin's diameter, discretised: elements first, then contact points, 12 dofs each."""

    def __init__(self, size: float, growth: float, order: int, plastic: bool) -> None:
        points, cells = mesh_bodies(gmsh, size, growth, PIN, BLOCK)
        triangles = skfem.MeshTri2(points.T, cells.T)
        basis = skfem.Basis(triangles, skfem.ElementVector(skfem.ElementTriP2()), intorder=2)
        self.plastic, self.sigy, self.solver = plastic, np.inf, make_solver()
        self.dofs, self.cells, self.zero = int(basis.N), len(cells), np.zeros(basis.N)
        grad = np.stack([basis.basis[a][0].grad for a in range(12)], axis=-1)  # (2, 2, m, q, 12)
        self.B = np.stack([grad[0, 0], grad[1, 1], grad[0, 1] + grad[1, 0]], axis=-2)
        self.weight = basis.dx
        self.history = np.zeros((*self.weight.shape, 4))

        x, y = basis.doflocs  # of every dof
        vertical = np.zeros(basis.N, dtype=bool)
        vertical[basis.nodal_dofs[1]] = vertical[basis.facet_dofs[1]] = True
        self.top = np.flatnonzero(vertical & (np.abs(y + DR) < 1e-9) & (x < R + DR / 2))
        self.pin = vertical & (np.hypot(x, y + DR) < R + 1e-9)
        fixed = (np.abs(y) < 1e-9) | (~vertical & (np.abs(x) < 1e-9))
        fixed[self.top] = True
        self.free = np.where(fixed, -1, np.cumsum(~fixed) - 1)

        contact = self._pair(triangles, basis)
        self.rows = np.concatenate([basis.element_dofs.T, contact])
        self.sum = Sum(self.rows, self.free)
        self.C = return_map(np.zeros((1, 1, 3)), np.zeros((1, 1, 4)), np.inf)[1][0, 0]
        self.unyielding = self._element_matrices(self.C[None, None])

    def _pair(self, mesh, basis):
        """Contact points ``(f, g)`` on the pin's arc and their points on the hole; returns their dofs ``(f g, 12)``."""
        gauss, weights = np.polynomial.legendre.leggauss(POINTS)

        def shapes(xi):
            return np.stack([xi * (xi - 1) / 2, xi * (xi + 1) / 2, 1 - xi * xi], axis=-1)

        def arc(centre, radius):
            """Dofs ``(f, 3, 2)`` and nodes ``(f, 3, 2)`` of the facets on a circle, from the axis on."""
            on = np.abs(np.hypot(mesh.p[0], mesh.p[1] - centre) - radius) < 1e-9
            facets = mesh.boundary_facets()
            facets = facets[on[mesh.facets[:, facets]].all(0)]
            ends = np.take_along_axis(mesh.facets[:, facets], np.argsort(mesh.p[0][mesh.facets[:, facets]], axis=0), 0)
            order = np.argsort(mesh.p[0][ends[0]])
            dofs = np.stack([basis.nodal_dofs[:, ends[0]], basis.nodal_dofs[:, ends[1]], basis.facet_dofs[:, facets]])
            dofs = dofs.transpose(2, 0, 1)[order]
            return dofs, basis.doflocs[:, dofs[..., 0]].transpose(1, 2, 0)

        pin, pin_nodes = arc(-DR, R)
        hole, hole_nodes = arc(0.0, R + DR)
        N = shapes(gauss)
        x = N @ pin_nodes
        slope = np.stack([gauss - 0.5, gauss + 0.5, -2 * gauss], axis=-1) @ pin_nodes
        self.ds = weights * np.linalg.norm(slope, axis=-1)
        # The facet of the hole and the place on it (xi) that lie at the angle of x about the pin's centre.
        self.angle = np.arctan2(x[..., 0], -x[..., 1] - DR)
        ends = np.arctan2(hole_nodes[:, 1, 0], -hole_nodes[:, 1, 1] - DR)
        facet = np.minimum(np.searchsorted(ends, self.angle), len(ends) - 1)
        xi = np.zeros_like(self.angle)
        for _ in range(5):
            y = (shapes(xi)[..., None] * hole_nodes[facet]).sum(-2)
            xi += (self.angle - np.arctan2(y[..., 0], -y[..., 1] - DR)) * 2 * len(ends) / (np.pi / 2)
        direction = np.stack([np.sin(self.angle), -np.cos(self.angle)], axis=-1)
        self.gap = ((y - x) * direction).sum(-1)
        N = np.concatenate([np.broadcast_to(N, (len(pin), *N.shape)), -shapes(xi)], axis=-1)
        self.N = (N[..., None] * direction[..., None, :]).reshape(-1, 12)
        dofs = np.concatenate([np.broadcast_to(pin[:, None], (*xi.shape, 3, 2)), hole[facet]], axis=-2)
        return dofs.reshape(-1, 12)

    def _element_matrices(self, tangent):
        """Stiffness ``(m, 12, 12)`` of tangents ``(m, q, 3, 3)``."""
        m, q = self.weight.shape
        stress = (tangent * self.weight[..., None, None]) @ self.B
        return self.B.reshape(m, 3 * q, 12).transpose(0, 2, 1) @ stress.reshape(m, 3 * q, 12)

    def pressure(self, u):
        """Contact pressure ``(f, g)``."""
        gap = self.gap - (self.N * u[self.rows[self.cells :]]).sum(-1).reshape(self.gap.shape)
        return PENALTY * np.maximum(-gap, 0)

    def equilibrium(self, u):
        """Internal forces ``(n,)``, new history, and the blocks of the tangent."""
        local = u[self.rows[: self.cells]]
        m, q = self.weight.shape
        B = self.B.reshape(m, 3 * q, 12)
        strain = (B @ local[..., None]).reshape(m, q, 3)
        if np.isinf(self.sigy):
            stress, new, blocks = strain @ self.C, self.history, self.unyielding
        else:
            stress, D, new = return_map(strain, self.history, self.sigy)
            blocks = self._element_matrices(D)
        bulk = ((stress * self.weight[..., None]).reshape(m, 1, 3 * q) @ B)[:, 0]
        pressure = self.pressure(u)
        contact = (pressure * self.ds).reshape(-1, 1) * self.N
        stiff = (PENALTY * (pressure > 0) * self.ds).reshape(-1, 1, 1) * (self.N[:, :, None] * self.N[:, None, :])
        forces = np.bincount(self.rows.ravel(), np.concatenate([bulk, contact]).ravel(), self.dofs)
        return forces, new, np.concatenate([blocks, stiff])

    def results(self) -> dict[str, float | None]:
        """Force of the whole joint, and pressure on the axis from the means of the facets."""
        mean, angle = ((values * self.ds).sum(1) / self.ds.sum(1) for values in (self.pressure(self.u), self.angle))
        return {"P": -2 * self.forces[self.top].sum(), "p0": axis_pressure(angle, mean)}

    def elastic(self, delta: float):
        """The displacements at ``delta`` of bodies that do not yield; from then on they do."""
        found, _ = self.solve(np.where(self.pin, -delta, 0.0), delta)
        self.sigy = SIGY if self.plastic else np.inf
        return found

    def solve(self, u, delta: float):
        """Equilibrium from the displacements ``u`` on, whose constrained ones stay: those, and iterations."""
        free = self.free >= 0
        for iteration in range(ITERATIONS):
            self.forces, self.next, blocks = self.equilibrium(u)
            residual = np.linalg.norm(self.forces[free]) / np.abs(self.forces[self.top].sum())
            if iteration and residual < TOLERANCE:
                self.u = u
                return u, iteration
            if iteration and not residual < FAR:
                break
            u = u.copy()
            u[free] -= self.solver(self.sum(blocks), self.forces[free])
        raise NoConvergence

    def commit(self) -> None:
        """Take over the plastic strain of the last equilibrium."""
        self.history = self.next


if __name__ == "__main__":
    try:
        import gmsh
        import skfem
        from scipy import sparse
    except ImportError as missing:
        sys.exit(f"scikit-fem cannot run here: {missing}")
    sys.exit(main(Joint, "reference", lambda: version("scikit-fem")))

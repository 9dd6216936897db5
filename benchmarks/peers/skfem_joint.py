"""The paper's quarter joint by scikit-fem: ``python3 skfem_joint.py --case plastic --steps 20
--output r.json``.

Needs scikit-fem, gmsh and pypardiso (all of PyPI), and nothing of archord but `joint_script` beside
it.

- Bodies: MeshTri2 (gmsh's second-order triangles, nodes on the circles), P2 displacements, three
points a triangle.
- Contact: kinematics "reference". A point x of the pin's arc faces the point y of the hole on its
normal n in the
  touching configuration; the pressure is 1e5 E*/R (penalty) times -g, the gap g = (y - x) . n -
  (u(x) - u(y)) . n.
- Plasticity: J2, perfect, radial return with its consistent tangent (Simo and Hughes 1998, box
3.2).
- Newton's method; element matrices at once by numpy, summed into slots that are found once; MKL's
PARDISO.
"""

from __future__ import annotations

import os
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import skfem
from joint_script import (
    BLOCK,
    DR,
    LAME,
    MU,
    PENALTY,
    PIN,
    SIGY,
    R,
    axis_pressure,
    main,
    mesh_bodies,
    newton,
)
from scipy import sparse


class UpperTriangle:
    """Solves with the sparse sum of element matrices ``(m, k, k)`` over rows ``dofs`` ``(m, k)``,
    by PARDISO, which reads the upper triangle of a positive definite matrix. Places and order of
    the unknowns are found once."""

    def __init__(self, dofs, free) -> None:
        """``free`` ``(n,)`` numbers the unconstrained dofs, -1 elsewhere."""
        unknowns = free[dofs]
        rows, cols = np.broadcast_arrays(unknowns[:, :, None], unknowns[:, None, :])
        n = int(free.max()) + 1
        self.kept = (rows >= 0) & (cols >= rows)
        places = rows[self.kept] * n + cols[self.kept]
        keys, self.slot = np.unique(places, return_inverse=True)
        indptr = np.searchsorted(keys, n * np.arange(n + 1))
        columns = keys % n
        zeros = np.zeros(len(keys))
        self.matrix = sparse.csr_matrix((zeros, columns, indptr), (n, n))
        self.matrix.indptr = indptr.astype(np.int32)
        self.matrix.indices = columns.astype(np.int32)
        for library in sorted(Path(sys.prefix).glob("lib/libmkl_rt.so*")):
            os.environ.setdefault(
                "PYPARDISO_MKL_RT", str(library)
            )  # pypardiso would search the whole environment
        import pypardiso.pardiso_wrapper as pardiso

        self.solver = pardiso.PyPardisoSolver(mtype=2)
        self.fault = pardiso.PyPardisoError

    def solve(self, blocks, b):
        """The solution for element matrices ``blocks`` and right-hand side ``b``. Raises
        RuntimeError."""
        self.matrix.data = np.bincount(self.slot, blocks[self.kept], len(self.matrix.indices))
        # PyPardisoSolver.solve would order the unknowns each time (phase 11).
        is_ordered = self.solver.phase == 23
        phases = (23,) if is_ordered else (11, 23)
        try:
            for phase in phases:
                self.solver.set_phase(phase)
                x = self.solver._call_pardiso(self.matrix, b[:, None])
        except self.fault as error:
            raise RuntimeError(str(error)) from None
        return x.ravel()


def return_map(strain, history, sigy: float):
    """Stress ``(m, q, 3)`` (xx, yy, xy), tangent ``(m, q, 3, 3)`` and new history of total strains
    (xx, yy, 2 xy).

    ``history`` ``(m, q, 4)`` is the plastic strain (xx, yy, zz, xy).
    """
    xx, yy, shear = np.moveaxis(strain, -1, 0)
    volumetric = xx + yy
    mean = volumetric / 3
    deviator = np.stack([xx, yy, 0 * xx, shear / 2], axis=-1) - history
    deviator[..., :3] -= mean[..., None]
    s = 2 * MU * deviator
    normal = (s[..., :3] ** 2).sum(-1)
    squared = normal + 2 * s[..., 3] ** 2
    norm = np.maximum(np.sqrt(squared), 1e-300)
    radius = np.sqrt(2 / 3) * sigy
    plastic = norm > radius
    ratio = np.where(plastic, radius / norm, 1.0)
    n = s / norm[..., None]
    stress = ratio[..., None] * s
    growth = np.where(plastic, (norm - radius) / (2 * MU), 0.0)
    new = history + growth[..., None] * n
    bulk_modulus = LAME + 2 * MU / 3
    pressure = bulk_modulus * volumetric
    stress[..., :3] += pressure[..., None]
    # Box 3.2: bulk modulus, 2 mu theta times the deviatoric projection, less 2 mu theta n x n
    # (perfect plasticity).
    bulk = np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 0]])
    projection = np.diag([1, 1, 0.5]) - bulk / 3
    in_plane = [0, 1, 3]
    directions = n[..., in_plane]
    deviatoric = 2 * MU * ratio[..., None, None] * projection
    tangent = bulk_modulus * bulk + deviatoric
    dyad = directions[..., :, None] * directions[..., None, :]
    along_flow = 2 * MU * ratio * plastic
    tangent -= along_flow[..., None, None] * dyad
    return stress[..., in_plane], tangent, new


def shapes(xi):
    """Quadratic shape functions ``(..., 3)`` of a facet's ends and midpoint at ``xi`` in [-1,
    1]."""
    first = xi * (xi - 1) / 2
    last = xi * (xi + 1) / 2
    middle = 1 - xi * xi
    return np.stack([first, last, middle], axis=-1)


class Joint:
    """Half of the joint below the pin's diameter, discretised: elements first, then contact points,
    12 dofs each."""

    def __init__(self, size: float, growth: float, order: int, plastic: bool) -> None:
        points, cells = mesh_bodies(size, growth, PIN, BLOCK)
        mesh = skfem.MeshTri2(points.T, cells.T)
        element = skfem.ElementVector(skfem.ElementTriP2())
        basis = skfem.Basis(mesh, element, intorder=2)
        self.plastic = plastic
        self.sigy = np.inf
        self.dofs = int(basis.N)
        self.cells = len(cells)
        self.zero = np.zeros(basis.N)
        gradients = [basis.basis[a][0].grad for a in range(12)]
        grad = np.stack(gradients, axis=-1)  # (2, 2, m, q, 12)
        shear = grad[0, 1] + grad[1, 0]
        B = np.stack([grad[0, 0], grad[1, 1], shear], axis=-2)
        self.weight = basis.dx
        self.B = B.reshape(len(cells), -1, 12)
        self.history = np.zeros((*self.weight.shape, 4))

        x, y = basis.doflocs  # of every dof
        vertical = np.zeros(basis.N, dtype=bool)
        vertical[basis.nodal_dofs[1]] = vertical[basis.facet_dofs[1]] = True
        on_diameter = np.abs(y + DR) < 1e-9
        self.top = np.flatnonzero(vertical & on_diameter & (x < R + DR / 2))
        from_pin_centre = np.hypot(x, y + DR)
        self.pin = vertical & (from_pin_centre < R + 1e-9)
        on_block_top = np.abs(y) < 1e-9
        on_axis = np.abs(x) < 1e-9
        fixed = on_block_top | (~vertical & on_axis)
        fixed[self.top] = True
        self.free = ~fixed

        self.rows = np.concatenate([basis.element_dofs.T, self._pair(basis)])
        number = np.cumsum(self.free) - 1
        self.system = UpperTriangle(self.rows, np.where(fixed, -1, number))
        unstrained = np.zeros((1, 1, 3))
        virgin = np.zeros((1, 1, 4))
        _, tangent, _ = return_map(unstrained, virgin, np.inf)
        self.C = tangent[0, 0]
        self.unyielding = self._element_matrices(self.C[None, None])

    def _pair(self, basis):
        """Contact points ``(f, 2)`` on the pin's arc and their points on the hole; returns their
        dofs ``(f 2, 12)``."""

        def arc(centre, radius):
            """Dofs ``(f, 3, 2)`` and nodes ``(f, 3, 2)`` of the facets on a circle, ends and
            midpoint, from the axis on."""
            of_cells = basis.element_dofs.T.reshape(-1, 6, 2)
            edges = [[0, 1, 3], [1, 2, 4], [0, 2, 5]]
            dofs = of_cells[:, edges].reshape(-1, 3, 2)
            x, y = basis.doflocs[:, dofs[..., 0]]
            off_circle = np.hypot(x, y - centre) - radius
            on = (np.abs(off_circle) < 1e-9).all(axis=1)
            x_on = x[on]
            from_axis = np.argsort(x_on, axis=1)[:, [0, 2, 1], None]
            dofs = np.take_along_axis(dofs[on], from_axis, axis=1)
            dofs = dofs[np.argsort(x_on.min(axis=1))]
            nodes = basis.doflocs[:, dofs[..., 0]]
            return dofs, nodes.transpose(1, 2, 0)

        def angle(x):
            """About the pin's centre, from the axis."""
            return np.arctan2(x[..., 0], -x[..., 1] - DR)

        gauss, weights = np.polynomial.legendre.leggauss(2)
        (pin, pin_nodes) = arc(*PIN)
        (hole, hole_nodes) = arc(*BLOCK)
        N = shapes(gauss)
        x = N @ pin_nodes
        derivatives = np.stack([gauss - 0.5, gauss + 0.5, -2 * gauss], axis=-1)
        slope = derivatives @ pin_nodes
        self.ds = weights * np.linalg.norm(slope, axis=-1)
        # The facet of the hole and the place on it (xi) that lie at the angle of x.
        self.angle = angle(x)
        ends = angle(hole_nodes[:, 1])
        facet = np.minimum(np.searchsorted(ends, self.angle), len(ends) - 1)
        xi = np.zeros_like(self.angle)
        for _ in range(5):
            y = (shapes(xi)[..., None] * hole_nodes[facet]).sum(-2)
            missed = self.angle - angle(y)
            xi += missed * 2 * len(ends) / (np.pi / 2)
        direction = np.stack([np.sin(self.angle), -np.cos(self.angle)], axis=-1)
        self.gap = ((y - x) * direction).sum(-1)
        on_pin = np.broadcast_to(N, (len(pin), *N.shape))
        N = np.concatenate([on_pin, -shapes(xi)], axis=-1)
        normal = N[..., None] * direction[..., None, :]
        self.N = normal.reshape(-1, 12)
        of_pin = np.broadcast_to(pin[:, None], (*xi.shape, 3, 2))
        dofs = np.concatenate([of_pin, hole[facet]], axis=-2)
        return dofs.reshape(-1, 12)

    def _element_matrices(self, tangent):
        """Stiffness ``(m, 12, 12)`` of tangents ``(m, q, 3, 3)``."""
        B = self.B.reshape(*self.weight.shape, 3, 12)
        stress = (tangent * self.weight[..., None, None]) @ B
        return self.B.transpose(0, 2, 1) @ stress.reshape(self.B.shape)

    def pressure(self, u):
        """Contact pressure ``(f, g)``."""
        of_contact = self.rows[self.cells :]
        closing = (self.N * u[of_contact]).sum(-1)
        gap = self.gap - closing.reshape(self.gap.shape)
        return PENALTY * np.maximum(-gap, 0)

    def _equilibrium(self) -> float:
        """Evaluate forces ``(n,)``, new history and tangent; the residual over the reaction."""
        of_cells = self.rows[: self.cells]
        strain = (self.B @ self.u[of_cells, None]).reshape(*self.weight.shape, 3)
        if np.isinf(self.sigy):
            stress = strain @ self.C
            self.next = self.history
            blocks = self.unyielding
        else:
            stress, tangent, self.next = return_map(strain, self.history, self.sigy)
            blocks = self._element_matrices(tangent)
        weighted = (stress * self.weight[..., None]).reshape(self.cells, 1, -1)
        bulk = (weighted @ self.B)[:, 0]
        pressure = self.pressure(self.u)
        contact = (pressure * self.ds).reshape(-1, 1) * self.N
        stiffness = PENALTY * (pressure > 0) * self.ds
        dyads = self.N[:, :, None] * self.N[:, None, :]
        stiff = stiffness.reshape(-1, 1, 1) * dyads
        parts = np.concatenate([bulk, contact])
        self.forces = np.bincount(self.rows.ravel(), parts.ravel(), self.dofs)
        self.blocks = np.concatenate([blocks, stiff])
        residual = np.linalg.norm(self.forces[self.free])
        reaction = np.abs(self.forces[self.top].sum())
        return float(residual / reaction)

    def _improve(self) -> None:
        self.u[self.free] -= self.system.solve(self.blocks, self.forces[self.free])

    def solve(self, guess, delta: float):
        """Displacements of equilibrium from ``guess`` on, and iterations."""
        self.u = guess.copy()
        iterations = newton(self._equilibrium, self._improve)
        return self.u.copy(), iterations

    def elastic(self, delta: float):
        """The displacements at ``delta`` of bodies that do not yield; from then on they do."""
        found, _ = self.solve(np.where(self.pin, -delta, 0.0), delta)
        self.sigy = SIGY if self.plastic else np.inf
        return found

    def commit(self) -> None:
        """Take over the plastic strain of the last equilibrium."""
        self.history = self.next

    def results(self) -> dict[str, float | None]:
        """Force of the whole joint, and pressure on the axis from the means of the facets."""
        length = self.ds.sum(axis=1)
        mean = (self.pressure(self.u) * self.ds).sum(axis=1) / length
        angle = (self.angle * self.ds).sum(axis=1) / length
        reaction = self.forces[self.top].sum()
        return {"P": -2 * reaction, "p0": axis_pressure(angle, mean)}


if __name__ == "__main__":
    main(Joint, "reference", version("scikit-fem"))

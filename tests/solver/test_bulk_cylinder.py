"""A thick-walled cylinder under internal pressure, against Lame's and Hill's closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.basis import bulk_quadrature, cell_basis
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Problem
from tests.solver.parts import (
    INNER,
    OUTER,
    coordinates,
    edge_nodes,
    internal_force,
    quarter_annulus,
)

A = 1.0
B = 2.0
E = 1.0
SIGY = 0.001
# Hill's axial stress is the mean of the others, which von Mises yields with if elastically
# incompressible
NU = 0.499
K = SIGY / np.sqrt(3)


def elastic_wall(pressure, r, inner=A):
    """Radial displacement at ``r`` of an elastic ring from ``inner`` to B under internal
    ``pressure`` (Lame)."""
    return (1 + NU) / E * pressure * inner**2 / (B**2 - inner**2) * ((1 - 2 * NU) * r + B**2 / r)


every_cell = pytest.mark.parametrize("quads", [False, True], ids=["triangles", "quads"])
FIRST_YIELD = elastic_wall(K * (1 - A**2 / B**2), A)
ALL_PLASTIC = 4 * FIRST_YIELD  # by incompressibility a u_a = c u_c, and u_c ~ c


class Cylinder:
    """A quarter of the cylinder whose inner wall moves outward by ``load``."""

    def __init__(self, size: float, quads: bool, hardening: float = 0.0) -> None:
        mesh = quarter_annulus(MPI.COMM_SELF, A, B, size, quads=quads)
        body = Body("ring", J2Material(E, NU, "strain", LinearHardening(SIGY, hardening)))
        supports = [Dirichlet("wall", "inner", k, lambda x, k=k: x[:, k] / A) for k in range(2)]
        supports += [Dirichlet("x", "x", 1), Dirichlet("y", "y", 0)]
        system = System(Problem(mesh, [body], supports=supports))
        self.cells = mesh.cells
        self.V = system.V
        self.bulk = system.bulk
        self.problem = system.equilibrium
        self.solver = system.solver
        inner = edge_nodes(self.V, mesh.facets, INNER)
        self.outer = edge_nodes(self.V, mesh.facets, OUTER)
        self.radial = np.zeros_like(coordinates(self.V))
        self.radial[inner] = coordinates(self.V)[inner] / A

    def step(self, wall: float) -> None:
        result = self.solver.solve(wall, [(self.problem.state(), False)])
        assert result.converged, result.reason
        self.u = self.problem.displacement()
        force = internal_force(self.bulk, self.u)
        self.pressure = (force * self.radial).sum() / (
            A * np.pi / 2
        )  # work on a unit radial motion of the wall
        x = coordinates(self.V)[self.outer]
        self.outer_displacement = (self.u[self.outer] * x).sum(axis=1) / B
        self.problem.commit()

    def yielded_radius(self) -> float:
        """Radius of the disc whose area inside the wall has yielded."""
        X, w = bulk_quadrature(self.V.mesh.basix_cell(), 2)
        weight = cell_basis(self.V.mesh, 2, self.cells.indices, X).measure * w
        area = weight.ravel() @ (self.problem.evaluation.plastic_points()[0].state.peeq > 0)
        return np.sqrt(A**2 + 4 * area / np.pi)


@every_cell
def test_pressure_below_yield_is_lames(quads):
    """Wall displacement to pressure and outer displacement; the rules do not lock at nu = 0.499."""
    cylinder = Cylinder(0.1, quads)
    cylinder.step(0.9 * FIRST_YIELD)
    pressure = 0.9 * K * (1 - A**2 / B**2)
    assert cylinder.bulk.peeq()[0] == 0
    assert cylinder.pressure == pytest.approx(pressure, rel=1e-3)
    np.testing.assert_allclose(cylinder.outer_displacement, elastic_wall(pressure, B), rtol=1e-3)


@every_cell
def test_pressure_against_plastic_radius_is_hills(quads):
    """p = 2 k (ln(c/a) + (1 - c^2/b^2) / 2) within 0.1 % at every step until the ring is plastic
    throughout.

    Perfect plasticity, k = sigY / sqrt(3). c is that of the elastic ring outside which leaves the
    outer displacement (1 - nu^2) 2 k c^2 / (E b), and agrees with the yielded area to a tenth of an
    element.
    """
    size = 0.12
    cylinder = Cylinder(size, quads)
    for wall in np.linspace(FIRST_YIELD, ALL_PLASTIC, 13)[1:-1]:
        cylinder.step(wall)
        outer = cylinder.outer_displacement.mean()
        c = np.sqrt(outer * E * B / (2 * K * (1 - NU**2)))
        assert A < c < B
        assert cylinder.pressure == pytest.approx(
            2 * K * (np.log(c / A) + (1 - c**2 / B**2) / 2), rel=1e-3
        )
        assert cylinder.yielded_radius() == pytest.approx(c, abs=size / 10)


@every_cell
def test_the_collapse_pressure_is_hills(quads):
    """A ring that is plastic throughout carries 2 k ln(b/a), no more however far it is driven."""
    cylinder = Cylinder(0.08 if quads else 0.15, quads)
    for wall in ALL_PLASTIC * np.array([0.5, 1.1, 1.5, 2.0]):
        cylinder.step(wall)
    assert cylinder.pressure == pytest.approx(2 * K * np.log(B / A), rel=5e-4)


@every_cell
def test_the_solution_has_the_cylinders_symmetry(quads):
    """The outer wall stays round as far as the mesh allows, elastic or not."""
    cylinder = Cylinder(0.1 if quads else 0.15, quads)
    for wall in (FIRST_YIELD, 2.5 * FIRST_YIELD):
        cylinder.step(wall)
    assert np.ptp(cylinder.outer_displacement) < 5e-3 * cylinder.outer_displacement.mean()

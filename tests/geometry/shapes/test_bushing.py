"""The mesh of a pin in sleeves in a housing, and its press fit by Lame's formulas."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.shapes.bushing import bushing
from archord.materials.elasticity import Elastic
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Interaction, Problem
from tests.geometry.shapes.measures import area, facet_nodes

R = 10.0
BORE = 13.98
OUTER = 30.0
SLEEVE = (10.05, 14.0)
WALLS = [(10.02, 10.22), (10.22, 10.42)]  # of 0.02 R


def made(
    sleeves=(SLEEVE,), bore=BORE, outer=OUTER, size=1.0, comm=MPI.COMM_SELF, scale=1.0, **options
):
    rings = [[scale * r for r in ring] for ring in [*sleeves, (bore, outer)]]
    return bushing(comm, scale * R, rings, scale * size, 0.3, **options)


@pytest.mark.mpi
@pytest.mark.parametrize("touching", [False, True])
@pytest.mark.parametrize(("sleeves", "bore"), [([SLEEVE], BORE), (WALLS, 10.41), ([], 10.05)])
def test_areas_and_circles(sleeves, bore, touching, comm):
    """Half rings, overlaps drawn as given; all nodes of every circle on it to round-off."""
    joint = made(sleeves, bore, comm=comm, touching=touching, pin="whole", degree=3)
    assert area(joint, "pin", comm) == pytest.approx(np.pi * R**2 / 2, rel=1e-6)
    rings = [*sleeves, (bore, OUTER)]
    names = [f"sleeve {k + 1}" for k in range(len(sleeves))]
    sets = [*((f"{name} inside", f"{name} outside") for name in names), ("bore", "outer edge")]
    edge = R
    shift = (
        sum(
            max(inner - within, 0)
            for (inner, _), within in zip(rings, [R, *(o for _, o in rings)], strict=False)
        )
        * touching
    )
    for name, pair, (inner, outer) in zip([*names, "housing"], sets, rings, strict=True):
        shift -= touching * max(inner - edge, 0.0)
        edge = outer
        assert area(joint, name, comm) == pytest.approx(np.pi * (outer**2 - inner**2) / 2, rel=1e-5)
        for place, radius in zip(pair, (inner, outer), strict=True):
            x = facet_nodes(joint, place) - [shift, 0.0]
            np.testing.assert_allclose(np.linalg.norm(x, axis=-1), radius, rtol=4e-16)
            np.testing.assert_array_less(-1e-12, x[..., 1])


def test_bodies_that_touch_do_so_on_the_axis():
    """From the housing inward: each gap closes at x > 0, that of an interference stays."""
    joint = made([(10.05, 12.0), (12.03, 14.0)], BORE, touching=True)
    for outer, inner in (("sleeve 1 inside", "pin"), ("sleeve 2 inside", "sleeve 1 outside")):
        ends = [facet_nodes(joint, name)[..., 0].max() for name in (inner, outer)]
        assert ends[0] == pytest.approx(ends[1], abs=1e-13)
    assert facet_nodes(joint, "sleeve 2 outside")[..., 0].max() == pytest.approx(14.0)


@pytest.mark.parametrize("sleeves", [WALLS, [(10.02, 10.22)]])
def test_thin_walls_have_two_layers_of_sound_triangles(sleeves):
    """Nodes of a P2 mesh at five depths; no edge longer than four times the shortest one."""
    joint = made(sleeves, sleeves[-1][1] - 0.01)
    corners = joint.mesh.geometry.x[
        joint.mesh.geometry.dofmap[joint.cells_in("sleeve 1")][:, :3], :2
    ]
    radii = np.linalg.norm(corners.reshape(-1, 2), axis=1)
    assert len(np.unique(radii.round(6))) == 3
    edges = np.linalg.norm(np.roll(corners, 1, axis=1) - corners, axis=2)
    assert (edges.max(axis=1) / edges.min(axis=1)).max() < 4.5


def test_meshes_do_not_depend_on_units():
    in_mm = made()
    in_m = made(scale=1e-3)
    np.testing.assert_allclose(
        in_m.mesh.geometry.x, 1e-3 * in_mm.mesh.geometry.x, rtol=1e-13, atol=1e-17
    )


def lame(
    pressure: float, inner: float, outer: float, material: Elastic, *, held: bool
) -> tuple[float, float]:
    """Radial displacement at inner and outer radius of a ring in plane strain, with the pressure
    within and held outside, or with it outside and free within: u = a r + b/r, sigma_r = 2 G (a/(1
    - 2 nu) - b/r^2)."""
    G = material.E / 2 / (1 + material.nu)
    k = 1 - 2 * material.nu
    at = lambda r: [2 * G / k, -2 * G / r**2]  # noqa: E731
    rows, right = (
        ([at(inner), [outer, 1 / outer]], [-pressure, 0])
        if held
        else ([at(inner), at(outer)], [0, -pressure])
    )
    a, b = np.linalg.solve(rows, right)
    return a * inner + b / inner, a * outer + b / outer


def test_a_press_fit_follows_lame():
    """Pressure and radial displacements of a bronze sleeve pressed into aluminium, 0.02 on a radius
    of 14; what is left is of the order of the displacement over the radius, as contact closes the
    gap of the deformed bodies."""
    bronze, aluminium, steel = (
        Elastic(E, nu, "strain") for E, nu in ((110e3, 0.34), (70e3, 0.33), (210e3, 0.3))
    )
    unit = (
        lame(1.0, BORE, OUTER, aluminium, held=True)[0] - lame(1.0, *SLEEVE, bronze, held=False)[1]
    )
    pressure = (SLEEVE[1] - BORE) / unit
    assert pressure == pytest.approx(47.526, abs=1e-3)
    joint = made(size=0.5)
    supports = [Dirichlet("outer edge", "outer edge", axis) for axis in (0, 1)]
    supports += [Dirichlet("flat", "flat", 0, 1.0), Dirichlet("axis", "axis", 1)]
    bodies = [Body("pin", steel), Body("sleeve 1", bronze), Body("housing", aluminium)]
    contacts = [
        Interaction("play", ("pin", "sleeve 1 inside")),
        Interaction("fit", ("sleeve 1 outside", "bore")),
    ]
    system = System(Problem(joint, bodies, contacts, supports, symmetry=2.0, from_rest=False))
    system.solve([0.0])
    inside, outside = lame(pressure, *SLEEVE, bronze, held=False)
    bore, _ = lame(pressure, BORE, OUTER, aluminium, held=True)
    u = system.equilibrium.displacement()
    for name, expected in (
        ("sleeve 1 inside", inside),
        ("sleeve 1 outside", outside),
        ("bore", bore),
    ):
        nodes = joint.dofs_in(system.V, name)
        x = system.V.tabulate_dof_coordinates()[nodes, :2]
        radial = (u[nodes] * x).sum(axis=1) / np.linalg.norm(x, axis=1)
        assert radial.mean() == pytest.approx(expected, rel=1e-3)
        assert np.ptp(radial) < 1e-3 * abs(expected)
    for name in ("bore", "sleeve 1 outside"):
        side = system.sides[name]
        mean = (side.weight * system.contact.pair_of(side).pressure).sum() / side.weight.sum()
        assert mean == pytest.approx(pressure, rel=2e-3)

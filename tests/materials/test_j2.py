"""J2 plasticity: laws that hold at every point of every path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from archord.materials.elasticity import von_mises
from archord.materials.hardening import (
    LinearHardening,
    SwiftHardening,
    TabularHardening,
    VoceHardening,
)
from archord.materials.j2 import J2Material
from archord.materials.return_map import PlasticState, return_map
from archord.report.errors import InputError
from tests.materials.test_elasticity import NU, E, hooke, turned

SIGY = 250.0
YIELD_STRAIN = SIGY / E
ROUND_OFF = np.finfo(float).eps
N = 2000

HARDENINGS = {
    "H = 0": LinearHardening(SIGY),
    "H = 0.02 E": LinearHardening(SIGY, 0.02 * E),
    "H = E": LinearHardening(SIGY, E),
    "Voce": VoceHardening(SIGY, 2 * SIGY, 0.2 / YIELD_STRAIN),
    "Swift": SwiftHardening(SIGY / YIELD_STRAIN**0.2, YIELD_STRAIN, 0.2),
    "plateau": TabularHardening(
        (
            (0, SIGY),
            (4 * YIELD_STRAIN, SIGY),
            (5 * YIELD_STRAIN, 2 * SIGY),
            (90 * YIELD_STRAIN, 2.5 * SIGY),
        )
    ),
}
MATERIALS = [
    pytest.param(J2Material(E, NU, plane, hardening), id=f"plane {plane}, {name}")
    for plane in ("strain", "stress")
    for name, hardening in HARDENINGS.items()
]
every_material = pytest.mark.parametrize("m", MATERIALS)
in_plane_stress = pytest.mark.parametrize("m", MATERIALS[len(HARDENINGS) :])


@pytest.fixture
def rng():
    return np.random.default_rng(2)


def random_path(
    m: J2Material, rng, n: int = N, steps: int = 4, size: float = 1.0
) -> tuple[np.ndarray, PlasticState]:
    """Strains and histories after ``steps`` random increments of ``size`` yield strains: some
    points never yielded."""
    strain = np.zeros((n, 3))
    state = m.state(n)
    for _ in range(steps):
        strain = strain + size * YIELD_STRAIN * rng.normal(size=(n, 3))
        _, _, state = m.update(strain, state)
    return strain, state


def random_increment(m: J2Material, rng, size: float = 1.0) -> tuple[np.ndarray, PlasticState]:
    """Strains ``size`` yield strains away from random paths, and the histories of these."""
    strain, state = random_path(m, rng)
    return strain + size * YIELD_STRAIN * rng.normal(size=strain.shape), state


def on_the_surface(m: J2Material, rng, n: int = N) -> tuple[np.ndarray, PlasticState, np.ndarray]:
    """States on the yield surface, and strain increments (unit length) that load them
    plastically."""
    strain = np.zeros((n, 3))
    state = m.state(n)
    for _ in range(3):
        strain = strain + 20 * YIELD_STRAIN * rng.normal(size=(n, 3))
        stress, _, state = m.update(strain, state)
    at_yield = np.abs(von_mises(stress) / strength(m, state) - 1) < 1e-13
    assert at_yield.mean() > 0.5
    normal = yield_gradient(m, stress)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    outward = rng.normal(size=(n, 3))
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    outward *= np.sign((outward * normal).sum(1))[:, None]
    outward = outward + 0.2 * normal  # not just along the surface
    pick = np.flatnonzero(at_yield)
    return strain[pick], PlasticState(state.plastic_strain[pick], state.peeq[pick]), outward[pick]


def yield_gradient(m, stress):
    """Derivative of the trial von Mises stress with respect to strain, up to a factor, at yield."""
    deviator = stress[:, [0, 1, 3]] - stress[:, :3].mean(axis=1)[:, None] * np.array(
        [1.0, 1.0, 0.0]
    )
    if m.plane == "strain":
        return deviator
    return (deviator * np.array([1.0, 1.0, 2.0])) @ m.elastic_tangent


def strength(m, state):
    return m.hardening.stress(state.peeq)


def assert_tangent_is_derivative(m, strain, old, h, *, flowing):
    """The consistent tangent is symmetric and the derivative of the stress, to 1e-6, by differences
    of step ``h`` where these keep to one branch."""
    _, tangent, new = m.update(strain, old)
    D = np.zeros((len(strain), 3, 3))
    flows = new.peeq > old.peeq
    one_branch = np.ones(len(strain), dtype=bool)
    for j in range(3):
        (plus, _, ahead), (minus, _, behind) = (
            m.update(strain + sign * h * np.eye(3)[j], old) for sign in (1, -1)
        )
        D[:, :, j] = (plus - minus)[:, [0, 1, 3]] / (2 * h)
        one_branch &= (flows == (ahead.peeq > old.peeq)) & (flows == (behind.peeq > old.peeq))
    assert one_branch.mean() > 0.99
    assert flows.mean() >= flowing
    error = np.abs(tangent - D).max(axis=(1, 2)) / np.abs(tangent).max(axis=(1, 2))
    assert error[one_branch].max() < 1e-6
    np.testing.assert_allclose(tangent, np.swapaxes(tangent, 1, 2), rtol=0, atol=1e-13 * E)


@every_material
@pytest.mark.parametrize(("size", "flowing"), [(0.3, 0.1), (3.0, 0.1), (100.0, 0.99)])
def test_tangent_is_the_derivative_of_the_stress(m, size, flowing, rng):
    """Any history, any increment, also far beyond what a solver takes."""
    strain, old = random_increment(m, rng, size)
    assert_tangent_is_derivative(
        m, strain, old, (1e-3 if size > 10 else 1e-5) * YIELD_STRAIN, flowing=flowing
    )


@every_material
@pytest.mark.parametrize("size", [1e-3, 1.0])
def test_tangent_when_loading_from_the_yield_surface(m, size, rng):
    """Points that sit on the yield surface and are pushed outward, by little or by much."""
    strain, old, outward = on_the_surface(m, rng)
    strain = strain + size * YIELD_STRAIN * outward
    assert_tangent_is_derivative(m, strain, old, 1e-5 * YIELD_STRAIN, flowing=1.0)


@in_plane_stress
def test_tangent_of_equibiaxial_tension_in_plane_stress(m):
    """Neither shear nor difference: two of the three parts of the stress are zero."""
    e = YIELD_STRAIN * np.linspace(-5, 5, 100)
    strain = np.stack([e, e, 0 * e], axis=1)
    assert_tangent_is_derivative(m, strain, m.state(len(e)), 1e-5 * YIELD_STRAIN, flowing=0.8)


@every_material
def test_pressure_alone_never_yields(m):
    """At zero deviator, however large the pressure, the response is elastic and finite."""
    if m.plane == "stress":
        strain = np.zeros((1, 3))
        old = m.state(1)
    else:
        e = YIELD_STRAIN * np.array([-1e3, -1.0, 0.0, 1.0, 1e3])
        strain = np.stack(
            [1.5 * e, 1.5 * e, 0 * e], axis=1
        )  # elastic strain e in all three directions
        old = PlasticState(np.stack([e / 2, e / 2, -e, 0 * e], axis=1), np.abs(e))
    stress, tangent, new = m.update(strain, old)
    np.testing.assert_allclose(von_mises(stress), 0, atol=1e-12 * np.abs(stress).max(initial=1))
    np.testing.assert_array_equal(new.peeq, old.peeq)
    np.testing.assert_array_equal(tangent, np.broadcast_to(m.elastic_tangent, tangent.shape))
    if m.plane == "strain":
        np.testing.assert_allclose(stress[:, 0], E / (1 - 2 * NU) * e, rtol=1e-12)


@every_material
@pytest.mark.parametrize("size", [1.0, 100.0])
def test_stress_returns_to_the_yield_surface(m, size, rng):
    """Flowing points have exactly the current yield stress, the others less."""
    strain, old = random_increment(m, rng, size)
    stress, _, new = m.update(strain, old)
    flows = new.peeq > old.peeq
    assert flows.mean() > 0.05
    excess = von_mises(stress) - strength(m, new)
    round_off = 8 * ROUND_OFF * (E * np.abs(strain).max(axis=1) + strength(m, new))
    assert np.all(excess <= round_off)
    assert np.all(np.abs(excess[flows]) <= round_off[flows])


@every_material
def test_flow_is_incompressible_and_peeq_is_its_length(m, rng):
    """trace(eps_p) = 0; PEEQ never decreases and grows by sqrt(2/3) of the length of the plastic
    increment."""
    strain, old = random_increment(m, rng)
    _, _, new = m.update(strain, old)
    scale = np.abs(new.plastic_strain).max()
    assert np.abs(new.plastic_strain[:, :3].sum(axis=1)).max() < 8 * ROUND_OFF * scale
    flow = new.plastic_strain - old.plastic_strain
    grown = new.peeq - old.peeq
    assert grown.min() >= 0
    length = np.sqrt(2 / 3 * ((flow[:, :3] ** 2).sum(axis=1) + 2 * flow[:, 3] ** 2))
    np.testing.assert_allclose(grown, length, rtol=0, atol=32 * ROUND_OFF * scale)


@every_material
def test_stress_is_the_elastic_stress_of_the_elastic_strain(m, rng):
    """Stress and plastic strain belong together by Hooke's law, with s_zz = 0 or eps_zz = 0 out of
    the plane."""
    strain, old = random_path(m, rng)
    stress, _, new = m.update(strain, old)
    total = hooke(stress) + new.plastic_strain * [1, 1, 1, 2]
    np.testing.assert_allclose(
        total[:, [0, 1, 3]], strain, rtol=0, atol=1e-13 * np.abs(strain).max()
    )
    if m.plane == "strain":
        assert np.abs(total[:, 2]).max() < 1e-13 * np.abs(strain).max()
    else:
        np.testing.assert_array_equal(stress[:, 2], 0.0)


@every_material
def test_unloading_is_elastic(m, rng):
    """A small step back from the yield surface moves the stress by the elastic moduli and leaves
    the history alone."""
    strain, old, outward = on_the_surface(m, rng)
    before, _, _ = m.update(strain - 1e-9 * YIELD_STRAIN * outward, old)
    step = -0.05 * YIELD_STRAIN * outward
    stress, tangent, new = m.update(strain - 1e-9 * YIELD_STRAIN * outward + step, old)
    np.testing.assert_allclose(
        stress - before, m.elastic().update(step, m.state(len(step)))[0], rtol=0, atol=1e-9 * SIGY
    )
    np.testing.assert_array_equal(new.peeq, old.peeq)
    np.testing.assert_array_equal(new.plastic_strain, old.plastic_strain)
    np.testing.assert_array_equal(tangent, np.broadcast_to(m.elastic_tangent, tangent.shape))


@every_material
def test_below_yield_the_material_is_elastic(m, rng):
    """The same stress as the elastic solid, to the last bits."""
    strain = 0.2 * YIELD_STRAIN * rng.uniform(-1, 1, size=(N, 3))
    stress, _, new = m.update(strain, m.state(N))
    np.testing.assert_allclose(
        stress, m.elastic().update(strain, m.state(N))[0], rtol=0, atol=1e-13 * SIGY
    )
    assert not new.peeq.any()


@every_material
def test_return_map_is_a_pure_function(m, rng):
    """Neither strain nor old state change, and the same input gives the same output."""
    strain, old = random_increment(m, rng)
    kept = strain.copy(), old.plastic_strain.copy(), old.peeq.copy()
    results = [
        (stress, C, new.plastic_strain)
        for stress, C, new in (m.update(strain, old) for _ in range(2))
    ]
    for now, then in ((kept, (strain, old.plastic_strain, old.peeq)), results):
        for a, b in zip(now, then, strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("name", ["H = 0", "H = 0.02 E", "H = E"])
@pytest.mark.parametrize("size", [0.3, 3.0, 100.0])
def test_the_kernel_of_linear_hardening_is_the_return_map_of_any(name, size, rng):
    """Closed form in C and Newton's method in numpy: the same stress, tangent and history."""
    m = J2Material(E, NU, "strain", HARDENINGS[name])
    strain, old = random_increment(m, rng, size)
    (stress, tangent, new) = m.update(strain, old)
    found = return_map(strain, old, m, m.hardening)
    assert (new.peeq > old.peeq).mean() > 0.05
    np.testing.assert_array_equal(found[2].peeq > old.peeq, new.peeq > old.peeq)
    np.testing.assert_allclose(found[0], stress, rtol=0, atol=1e-13 * np.abs(stress).max())
    np.testing.assert_allclose(found[1], tangent, rtol=0, atol=1e-12 * np.abs(tangent).max())
    np.testing.assert_allclose(found[2].peeq, new.peeq, rtol=0, atol=1e-13 * new.peeq.max())
    np.testing.assert_allclose(
        found[2].plastic_strain, new.plastic_strain, rtol=0, atol=1e-13 * new.peeq.max()
    )


@every_material
def test_a_material_without_a_solution_says_so(m, rng):
    """Points whose strain is not a number get a stress that is none; the others do not notice."""
    strain, old = random_path(m, rng, n=20)
    expected = m.update(strain, old)[0]
    strain[3] = np.nan
    stress = m.update(strain, old)[0]
    assert np.isnan(stress[3]).any()
    np.testing.assert_array_equal(np.delete(stress, 3, axis=0), np.delete(expected, 3, axis=0))


@every_material
def test_points_do_not_know_of_each_other(m, rng):
    """A point alone gives what it gives among others."""
    strain, old = random_path(m, rng, n=200, size=5.0)
    together = m.update(strain, old)[0]
    alone = np.concatenate(
        [
            m.update(strain[[i]], PlasticState(old.plastic_strain[[i]], old.peeq[[i]]))[0]
            for i in range(len(strain))
        ]
    )
    np.testing.assert_allclose(together, alone, rtol=0, atol=1e-13 * np.abs(together).max())


def _in_pascal(hardening):
    """The same law with stresses in Pa instead of MPa."""
    if isinstance(hardening, TabularHardening):
        return TabularHardening(tuple((peeq, 1e6 * stress) for peeq, stress in hardening.points))
    stresses = {"yield_stress", "modulus", "saturation", "strength"} & set(vars(hardening))
    return replace(hardening, **{name: 1e6 * getattr(hardening, name) for name in stresses})


@every_material
def test_units_do_not_matter(m, rng):
    """E, yield stress and hardening in Pa instead of MPa: the same strains, stresses times 1e6."""
    strain, old = random_increment(m, rng)
    in_pascal = replace(m, E=1e6 * m.E, hardening=_in_pascal(m.hardening))
    stress, tangent, new = m.update(strain, old)
    stress_pa, tangent_pa, new_pa = in_pascal.update(strain, old)
    np.testing.assert_allclose(new_pa.peeq, new.peeq, rtol=0, atol=1e-14 * new.peeq.max())
    np.testing.assert_allclose(
        stress_pa, 1e6 * stress, rtol=0, atol=1e-13 * np.abs(stress_pa).max()
    )
    np.testing.assert_allclose(
        tangent_pa, 1e6 * tangent, rtol=0, atol=1e-9 * np.abs(tangent_pa).max()
    )


@every_material
def test_axes_do_not_matter(m, rng):
    """The material is isotropic: a rotated strain gives the rotated stress."""
    strain = 3 * YIELD_STRAIN * rng.normal(size=(N, 3))
    xx, yy, xy = turned(*(strain * [1, 1, 0.5]).T)
    stress, _, _ = m.update(strain, m.state(N))
    found, _, _ = m.update(np.stack([xx, yy, 2 * xy], axis=1), m.state(N))
    expected = np.stack(turned(*stress[:, [0, 1, 3]].T), axis=1)
    np.testing.assert_allclose(
        found[:, [0, 1, 3]], expected, rtol=0, atol=1e-12 * np.abs(stress).max()
    )


def follow(m, strains):
    """Stresses and PEEQ ``(n, 4)``, ``(n,)`` of one point along a path of strains ``(n, 3)``."""
    state = m.state(1)
    stresses = []
    peeqs = []
    for strain in strains:
        stress, _, state = m.update(strain[None], state)
        stresses.append(stress[0])
        peeqs.append(state.peeq[0])
    return np.array(stresses), np.array(peeqs)


# Proportional paths: the stress per yield stress, and the strain of the yield stress s and PEEQ p.
PATHS = {
    "uniaxial": ([1, 0, 0, 0], lambda s, p: (s / E + p, -NU * s / E - p / 2, 0 * p)),
    "equibiaxial": (
        [1, 1, 0, 0],
        lambda s, p: ((1 - NU) * s / E + p / 2, (1 - NU) * s / E + p / 2, 0 * p),
    ),
    "shear": (
        [0, 0, 0, 3**-0.5],
        lambda s, p: (0 * p, 0 * p, 2 * (1 + NU) * s / E / 3**0.5 + 3**0.5 * p),
    ),
}


@every_material
@pytest.mark.parametrize("sign", [1, -1])
def test_proportional_paths_are_exact(m, sign):
    """Tension in one direction or two in plane stress, shear in both planes, and their
    opposites."""
    peeq = YIELD_STRAIN * np.linspace(0, 20, 12) ** 1.3
    sigma = m.hardening.stress(peeq)
    for path in PATHS if m.plane == "stress" else ["shear"]:
        direction, strains = PATHS[path]
        stress, found = follow(m, sign * np.stack(strains(sigma, peeq), axis=1))
        np.testing.assert_allclose(found, peeq, rtol=0, atol=1e-13 * peeq.max())
        np.testing.assert_allclose(
            stress, sign * np.outer(sigma, direction), rtol=1e-12, atol=1e-12 * sigma.max()
        )


@every_material
def test_energy_balance(m, rng):
    """Work of the stress = elastic energy + plastic work, up to the second order of the time
    step."""
    end = 5 * YIELD_STRAIN * rng.normal(size=(50, 3))

    def missing(steps):
        work = np.zeros(len(end))
        before = np.zeros((len(end), 4))
        state = m.state(len(end))
        for k in range(1, steps + 1):
            stress, _, state = m.update(end * (k / steps), state)
            work += ((stress + before)[:, [0, 1, 3]] / 2 * end / steps).sum(axis=1)
            before = stress
        energy = m.energy(stress) + m.dissipation(state)
        return np.abs(work - energy).sum() / work.sum()

    errors = np.array([missing(n) for n in (20, 80, 320)])
    assert errors[-1] < 1e-5
    assert np.all(errors[1:] < errors[:-1] / 4**1.8)


@every_material
def test_elastic_energy_is_half_stress_times_elastic_strain(m, rng):
    """Of the whole stress, in three dimensions."""
    stress = SIGY * rng.normal(size=(N, 4))
    np.testing.assert_allclose(
        m.energy(stress), 0.5 * (stress * hooke(stress)).sum(axis=1), rtol=1e-12
    )


SMOOTH = pytest.mark.parametrize("name", ["H = 0.02 E", "Voce", "Swift", "plateau"])


@SMOOTH
def test_slope_is_the_derivative_and_work_the_integral_of_the_yield_stress(name):
    """By differences, away from the kinks of a table and beyond its end."""
    hardening = HARDENINGS[name]
    h = 1e-4 * YIELD_STRAIN
    peeq = YIELD_STRAIN * np.array([0.5, 3.0, 4.5, 20.0, 100.0])
    for function, derivative in (
        (hardening.stress, hardening.slope),
        (hardening.work, hardening.stress),
    ):
        found = (function(peeq + h) - function(peeq - h)) / (2 * h)
        assert found == pytest.approx(derivative(peeq), rel=1e-6, abs=1e-6 * SIGY)
    assert hardening.work(np.zeros(1))[0] == pytest.approx(0.0, abs=1e-12 * SIGY)


def test_a_tension_test_becomes_a_table_of_true_stress():
    """Strain 10 % at 400 MPa: true stress 440 MPa, PEEQ ln 1.1 - 440 / E."""
    table = TabularHardening.from_engineering([(SIGY / E, SIGY), (0.1, 400.0)], E)
    (start, first), (end, last) = table.points
    assert (start, first) == (0.0, pytest.approx(SIGY * (1 + SIGY / E)))
    assert (end, last) == (pytest.approx(np.log(1.1) - 440 / E), pytest.approx(440.0))


@pytest.mark.parametrize(
    "points", [(), ((0.1, 1.0),), ((0, 2.0), (0.1, 1.0)), ((0, 1.0), (0, 2.0)), ((0, 0.0),)]
)
def test_a_table_that_is_no_hardening_law_is_refused(points):
    with pytest.raises(InputError, match="must"):
        TabularHardening(points)

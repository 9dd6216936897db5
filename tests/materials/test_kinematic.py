"""Kinematic hardening: closed forms of loops, ratcheting, and the laws that hold at every point of
every path."""

from __future__ import annotations

import numpy as np
import pytest

from archord.materials.hardening import LinearHardening, VoceHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematic import KinematicMaterial
from archord.report.errors import InputError
from tests.materials.test_elasticity import NU, E, hooke
from tests.materials.test_j2 import SIGY, YIELD_STRAIN

BACK = ((0.3 * E, 600.0), (0.02 * E, 40.0), (0.002 * E, 0.0))  # moduli and rates of recovery
ISOTROPIC = VoceHardening(SIGY, 1.2 * SIGY, 50.0)
PLANES = "strain", "stress"
in_both_planes = pytest.mark.parametrize("plane", PLANES)


@pytest.fixture
def rng():
    return np.random.default_rng(3)


def on_random_paths(m, rng, n=200, steps=4, size=2.0):
    strain = np.zeros((n, 3))
    state = m.state(n)
    for _ in range(steps):
        strain = strain + size * YIELD_STRAIN * rng.normal(size=(n, 3))
        stress, tangent, state = m.update(strain, state)
    return strain, stress, tangent, state


@in_both_planes
@pytest.mark.parametrize(
    "isotropic", [LinearHardening(SIGY), LinearHardening(SIGY, 0.02 * E), ISOTROPIC]
)
def test_without_back_stresses_it_is_isotropic(plane, isotropic, rng):
    m = KinematicMaterial(E, NU, plane, isotropic, ())
    j2 = J2Material(E, NU, plane, isotropic)
    state = m.state(300)
    expected = j2.state(300)
    strain = np.zeros((300, 3))
    for _ in range(5):
        strain = strain + 3 * YIELD_STRAIN * rng.normal(size=strain.shape)
        stress, tangent, state = m.update(strain, state)
        stress_j2, tangent_j2, expected = j2.update(strain, expected)
        np.testing.assert_allclose(stress, stress_j2, rtol=0, atol=1e-11 * np.abs(stress).max())
        np.testing.assert_allclose(tangent, tangent_j2, rtol=0, atol=1e-9 * E)
        np.testing.assert_allclose(
            state.plastic_strain, expected.plastic_strain, rtol=0, atol=1e-11
        )
        np.testing.assert_allclose(m.dissipation(state), j2.dissipation(expected), rtol=1e-9)


@in_both_planes
@pytest.mark.parametrize(("size", "nu"), [(0.3, NU), (3.0, NU), (100.0, NU), (3.0, 0.4999)])
def test_tangent_is_the_derivative_of_the_stress(plane, size, nu, rng):
    m = KinematicMaterial(E, nu, plane, ISOTROPIC, BACK)
    strain, _, _, old = on_random_paths(m, rng)
    strain = strain + size * YIELD_STRAIN * rng.normal(size=strain.shape)
    h = (1e-3 if size > 10 else 1e-5) * YIELD_STRAIN
    _, tangent, new = m.update(strain, old)
    D = np.zeros_like(tangent)
    flows = new.peeq > old.peeq
    one_branch = np.ones(len(strain), dtype=bool)
    for j in range(3):
        (plus, _, ahead), (minus, _, behind) = (
            m.update(strain + sign * h * np.eye(3)[j], old) for sign in (1, -1)
        )
        D[:, :, j] = (plus - minus)[:, [0, 1, 3]] / (2 * h)
        one_branch &= (flows == (ahead.peeq > old.peeq)) & (flows == (behind.peeq > old.peeq))
    assert one_branch.mean() > 0.99
    assert flows.mean() > 0.1
    assert np.abs(tangent - D).max(axis=(1, 2))[one_branch].max() < 2e-6 * E
    np.testing.assert_array_equal(
        tangent[~flows], np.broadcast_to(m.elastic_tangent, tangent.shape)[~flows]
    )


@pytest.mark.parametrize(
    ("plane", "nu"), [("strain", NU), *(("stress", nu) for nu in (-0.5, NU, 0.4999, 0.499999))]
)
def test_every_point_obeys_the_laws_of_the_model(plane, nu, rng):
    """Hooke's law with the plane's condition; the relative stress on the yield surface; flow along
    it."""
    m = KinematicMaterial(E, nu, plane, ISOTROPIC, BACK)
    strain, _, _, old = on_random_paths(m, rng)
    strain = strain + 2 * YIELD_STRAIN * rng.normal(size=strain.shape)
    stress, _, new = m.update(strain, old)
    total = hooke(stress, nu) + new.plastic_strain * [1, 1, 1, 2]
    np.testing.assert_allclose(
        total[:, [0, 1, 3]], strain, rtol=0, atol=1e-12 * np.abs(strain).max()
    )
    out_of_plane = total[:, 2] if plane == "strain" else stress[:, 2] / E
    assert np.abs(out_of_plane).max() < 1e-12 * np.abs(strain).max()
    twice = np.array([1, 1, 1, 2])
    deviator = stress - stress[:, :3].mean(axis=1)[:, None] * [1, 1, 1, 0]
    relative = deviator - new.back_stress.sum(axis=1)
    q = np.sqrt(1.5 * relative**2 @ twice)
    flows = new.peeq > old.peeq
    excess = q - m.hardening.stress(new.peeq)
    assert excess.max() < 1e-10 * SIGY
    assert np.abs(excess[flows]).max() < 1e-10 * SIGY
    flow = new.plastic_strain - old.plastic_strain
    grown = new.peeq - old.peeq
    np.testing.assert_allclose(
        flow, 1.5 * (grown / q)[:, None] * relative, rtol=0, atol=1e-12 * grown.max()
    )
    for k, (C, gamma) in enumerate(BACK):
        step = new.back_stress[:, k] - old.back_stress[:, k]
        expected = 2 / 3 * C * flow - gamma * grown[:, None] * new.back_stress[:, k]
        np.testing.assert_allclose(step, expected, rtol=0, atol=1e-10 * np.abs(step).max())


def uniaxial(m, state, strain, stress):
    """One step of uniaxial plane stress to the ``stress`` in x: its strain and state."""
    for _ in range(50):
        found, tangent, new = m.update(strain, state)
        off = found[:, [0, 1, 3]] - [[stress, 0, 0]]
        if np.abs(off).max() < 1e-11 * SIGY:
            return strain, new
        strain = strain - np.linalg.solve(tangent, off[:, :, None])[:, :, 0]
    raise AssertionError("no equilibrium")


def test_linear_kinematic_hardening_is_exact_and_shakes_down():
    """Prager: tension to sigY + C p, back elastically over 2 sigY, and the same cycle for ever."""
    C = 0.05 * E
    m = KinematicMaterial(E, NU, "stress", LinearHardening(SIGY), ((C, 0.0),))
    strain, state = uniaxial(m, m.state(1), np.zeros((1, 3)), 1.5 * SIGY)
    assert state.peeq[0] == pytest.approx(0.5 * SIGY / C)
    assert m.dissipation(state)[0] == pytest.approx(
        SIGY * state.peeq[0] + 0.5 * C * state.peeq[0] ** 2
    )
    for stress in 3 * [-0.499 * SIGY, 1.5 * SIGY]:
        strain, state = uniaxial(m, state, strain, stress)
        assert state.peeq[0] == pytest.approx(0.5 * SIGY / C)


def sheared(m, stress, strain, state):
    """One step of shear to the von Mises stress ``stress``, signed: the shear strain and state."""
    for _ in range(50):
        found, tangent, new = m.update(np.array([[0, 0, strain]]), state)
        off = found[0, 3] - stress / 3**0.5
        if abs(off) < 1e-11 * SIGY:
            return strain, new
        strain -= off / tangent[0, 2, 2]
    raise AssertionError("no equilibrium")


@in_both_planes
def test_a_stable_loop_has_the_closed_form_range(plane):
    """Armstrong and Frederick: between plastic strains -a and a the stress swings by sigY + C /
    gamma tanh(gamma a)."""
    C = 0.2 * E
    gamma = 300.0
    steps = 200
    m = KinematicMaterial(E, NU, plane, LinearHardening(SIGY), ((C, gamma),))
    state = m.state(1)
    for shear in 0.01 * np.concatenate(
        [np.linspace(0, 1, steps), np.linspace(1, -1, steps), np.linspace(-1, 1, steps)]
    ):
        stress, _, state = m.update(np.array([[0, 0, shear]]), state)
    amplitude = 2 / 3**0.5 * state.plastic_strain[0, 3]
    assert amplitude > 0.003
    assert 3**0.5 * stress[0, 3] == pytest.approx(
        SIGY + C / gamma * np.tanh(gamma * amplitude), rel=5e-3
    )


def test_ratcheting_is_the_closed_form():
    """Under stresses with a mean each cycle adds the same plastic strain (Chaboche and Nouailhas,
    1989)."""
    C = 0.1 * E
    gamma = 200.0
    top = 1.3 * SIGY
    bottom = -1.1 * SIGY
    limit = (C / gamma) ** 2
    expected = np.log((limit - (bottom + SIGY) ** 2) / (limit - (top - SIGY) ** 2)) / gamma
    errors = []
    m = KinematicMaterial(E, NU, "strain", LinearHardening(SIGY), ((C, gamma),))
    for steps in (20, 40):
        strain = 0.0
        state = m.state(1)
        ends = []
        for _ in range(5):
            for stress in np.concatenate(
                [
                    np.linspace(bottom + 2 * SIGY, top, steps),
                    np.linspace(top - 2 * SIGY, bottom, steps),
                ]
            ):
                strain, state = sheared(m, stress, strain, state)
            ends.append(2 / 3**0.5 * state.plastic_strain[0, 3])
        per_cycle = np.diff(ends)[1:]
        assert per_cycle == pytest.approx(per_cycle[-1], rel=1e-6)
        errors.append(abs(per_cycle[-1] / expected - 1))
    assert errors[1] < 0.05
    assert errors[1] < 0.6 * errors[0]


@in_both_planes
def test_energy_balance(plane, rng):
    """Work = elastic energy + plastic work, better with smaller steps."""
    m = KinematicMaterial(E, NU, plane, ISOTROPIC, BACK)
    ends = 4 * YIELD_STRAIN * rng.normal(size=(2, 20, 3))

    def missing(steps):
        work = np.zeros(20)
        before = np.zeros((20, 4))
        state = m.state(20)
        strain = np.zeros((20, 3))
        for end in ends:
            step = (end - strain) / steps
            for _ in range(steps):
                strain = strain + step
                stress, _, state = m.update(strain, state)
                work += ((stress + before)[:, [0, 1, 3]] / 2 * step).sum(axis=1)
                before = stress
        return np.abs(work - m.energy(stress) - m.dissipation(state)).sum() / work.sum()

    errors = [missing(n) for n in (10, 40, 160)]
    assert errors[-1] < 2e-4
    assert errors[1] < errors[0] / 3.5
    assert errors[2] < errors[1] / 3.5


def test_moduli_without_a_meaning_are_refused():
    for back in ([(0.0, 1.0)], [(1.0, -1.0)], (1.0, 1.0), [["1 GPa", 1.0]], 1.0):
        with pytest.raises(InputError, match="must be pairs of a positive modulus"):
            KinematicMaterial(E, NU, "strain", LinearHardening(SIGY), back)

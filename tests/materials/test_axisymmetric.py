"""Materials around an axis: tangents, the same answers as in plane strain, and large strain."""

import numpy as np
import pytest

from archord.materials.elasticity import Elastic, von_mises
from archord.materials.finite import LargeStrain
from archord.materials.hardening import LinearHardening, TabularHardening, VoceHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematic import KinematicMaterial
from archord.materials.kinematics import AXISYMMETRIC

E = 210000.0
NU = 0.3
TABLE = TabularHardening(((0.0, 355.0), (0.02, 400.0), (0.1, 500.0), (0.3, 550.0)))
MATERIALS = {
    "elastic": Elastic(E, NU),
    "linear hardening": J2Material(E, NU, hardening=LinearHardening(300.0, 1e4)),
    "Voce": J2Material(E, NU, hardening=VoceHardening(300.0, 400.0, 20.0)),
    "a table": J2Material(E, NU, hardening=TABLE),
    "back stresses": KinematicMaterial(
        E, NU, hardening=LinearHardening(300.0), back_stresses=((20000.0, 100.0),)
    ),
}
every_material = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)


def differences(m, strain, state, h):
    """The derivative ``(n, k, k)`` of the stress by central differences."""
    working = slice(None) if m.finite else list(AXISYMMETRIC.working)
    columns = [
        m.update(strain + d, state)[0][:, working] - m.update(strain - d, state)[0][:, working]
        for d in h * np.eye(strain.shape[1])
    ]
    return np.stack(columns, axis=2) / (2 * h)


@every_material
def test_the_tangent_is_the_derivative_of_the_stress(material):
    m = material.under(AXISYMMETRIC)
    strain = 0.004 * np.random.default_rng(0).normal(size=(200, 4))
    _, tangent, new = m.update(strain, m.state(200))
    off = np.abs(tangent - differences(m, strain, m.state(200), 1e-8)).max(axis=(1, 2))
    assert np.median(off) < 1e-6 * E
    assert (off < 1e-5 * E).mean() > 0.98  # others change their branch between
    assert (not m.yields) or np.mean(m.flows(m.state(200), new)) > 0.5


@every_material
def test_without_hoop_strain_it_is_plane_strain(material):
    """The same stresses, tangents and states, step by step."""
    ring = material.under(AXISYMMETRIC)
    state = material.state(50)
    state_ring = ring.state(50)
    for seed in range(3):
        plane = 0.003 * np.random.default_rng(seed).normal(size=(50, 3))
        stress, tangent, state = material.update(plane, state)
        whole = np.insert(plane, 2, 0.0, axis=1)
        stress_ring, tangent_ring, state_ring = ring.update(whole, state_ring)
        np.testing.assert_allclose(stress_ring, stress, atol=1e-9)
        in_plane = np.array([0, 1, 3])
        found = tangent_ring[:, in_plane[:, None], in_plane]
        np.testing.assert_allclose(found, tangent, atol=1e-9 * E)
        np.testing.assert_allclose(ring.peeq(state_ring), material.peeq(state), atol=1e-15)


@every_material
@pytest.mark.parametrize("size", [1e-4, 1e-2, 0.3])
def test_the_tangent_at_large_strain_is_the_derivative_of_the_nominal_stress(material, size):
    m = LargeStrain(material).under(AXISYMMETRIC)
    gradient = size * np.random.default_rng(1).normal(size=(60, 5))
    state = m.state(60)
    _, tangent, _ = m.update(gradient, state)
    found = differences(m, gradient, state, 1e-6 * max(size, 1e-3))
    off = np.abs(found - tangent).max(axis=(1, 2)) / np.nanmax(np.abs(tangent))
    known = ~np.isnan(off)
    assert known.sum() > 40
    assert off[known].max() < 2e-6


@every_material
def test_small_strains_are_a_limit(material):
    small = material.under(AXISYMMETRIC)
    m = LargeStrain(material).under(AXISYMMETRIC)
    gradient = 1e-7 * np.random.default_rng(2).normal(size=(20, 5))
    stress, _, new = m.update(gradient, m.state(20))
    expected, _, _ = small.update(gradient @ AXISYMMETRIC.small.T, small.state(20))
    limit = 1e-5 * np.abs(expected).max()
    np.testing.assert_allclose(stress, expected[:, [0, 1, 3, 3, 2]], atol=limit)
    np.testing.assert_allclose(m.true_stress(gradient, stress, new), expected, atol=limit)


def test_a_stretched_bar_has_hencky_stress():
    """Kirchhoff's stress is E times the logarithmic strain, Cauchy's is over J, the nominal one
    over the stretch; ring and slice alike."""
    m = LargeStrain(Elastic(E, NU)).under(AXISYMMETRIC)
    stretch = np.array([0.6, 1.3, 2.0])
    lateral = stretch**-NU
    zero = np.zeros(3)
    gradient = np.column_stack([lateral - 1, stretch - 1, zero, zero, lateral - 1])
    stress, _, _ = m.update(gradient, None)
    kirchhoff = E * np.log(stretch)
    np.testing.assert_allclose(stress[:, 1], kirchhoff / stretch, rtol=1e-12)
    np.testing.assert_allclose(stress[:, [0, 2, 3, 4]], 0.0, atol=1e-9 * E)
    true = m.true_stress(gradient, stress, None)
    J = stretch * lateral**2
    np.testing.assert_allclose(true[:, 1], kirchhoff / J, rtol=1e-12)
    np.testing.assert_allclose(von_mises(true), np.abs(true[:, 1]), rtol=1e-10)


@pytest.mark.parametrize("k", range(5))
def test_the_nominal_stress_is_the_derivative_of_the_stored_energy(k):
    m = LargeStrain(Elastic(E, NU)).under(AXISYMMETRIC)
    gradient = np.array([[0.2, -0.1, 0.3, -0.15, 0.25]])
    stress, _, _ = m.update(gradient, None)
    h = 1e-5 * np.eye(5)[k]
    up, down = (m.stored(gradient + d, stress, None) for d in (h, -h))
    assert (up - down) / 2e-5 == pytest.approx(stress[:, k], rel=1e-7)


@pytest.mark.parametrize("plane", ["strain", "stress", "axisymmetric"])
def test_cauchys_stress_is_nominal_stress_over_the_deformed_area(plane):
    """``J sigma = P F^T`` with J the determinant of F, of which the thickness is a part."""
    m = LargeStrain(Elastic(E, NU, plane))
    gradient = np.array([[0.2, -0.1, 0.3, -0.15, 0.25]])[:, : 5 if plane == "axisymmetric" else 4]
    stress, _, _ = m.update(gradient, None)
    xx, yy, _, xy = m.true_stress(gradient, stress, None)[0]
    F = np.array([[1.2, 0.3], [-0.15, 0.9]])
    P = stress[0, [0, 2, 3, 1]].reshape(2, 2)
    # E_zz out of the plane is -nu / E (T_xx + T_yy) without stress, whose trace J shares with sigma
    det = np.linalg.det(F)
    outward = {"strain": 1.0, "axisymmetric": 1.25}.get(plane)
    if outward is None:
        J = det
        for _ in range(50):
            J = det * np.exp(-NU / E * J * (xx + yy))
    else:
        J = det * outward
    np.testing.assert_allclose(J * np.array([[xx, xy], [xy, yy]]), P @ F.T, rtol=1e-9)
    assert abs(J - 1) > 0.01


@pytest.mark.parametrize("plane", ["strain", "stress", "axisymmetric"])
@pytest.mark.parametrize("name", ["linear hardening", "back stresses"])
def test_the_work_of_large_strains_is_stored_or_dissipated(name, plane):
    """Confined compression of a soft metal, whose volume shrinks by a fifth and more: plastic work
    is that of Kirchhoff's stress. What the balance lacks is proportional to the step: 3e-4."""
    material = MATERIALS[name]
    soft = type(material)(E, NU, plane, LinearHardening(0.04 * E, 0.05 * E))
    if name == "back stresses":
        soft = type(material)(E, NU, plane, LinearHardening(0.04 * E), ((0.2 * E, 5.0),))
    m = LargeStrain(soft)
    n = 100
    k = 5 if plane == "axisymmetric" else 4
    end = np.zeros((1, k))
    end[0, :2] = -0.3, 0.05
    state = m.state(1)
    work = 0.0
    last = np.zeros((1, k))
    for at in np.linspace(0, 1, n + 1)[1:]:
        stress, _, state = m.update(at * end, state)
        work += float(((stress + last) / 2 * end / n).sum())
        last = stress
    stored = m.stored(end, stress, state)[0]
    dissipated = m.dissipation(state)[0]
    assert dissipated > 0.1 * stored
    assert stored + dissipated == pytest.approx(work, rel=4e-4)

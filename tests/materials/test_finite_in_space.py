"""Large strain in space: closed forms, rotations, tangents where eigenvalues are close or equal."""

import numpy as np
import pytest
from scipy.linalg import expm, logm

from archord.materials.elasticity import Elastic, von_mises
from archord.materials.finite import LargeStrain
from archord.materials.hardening import LinearHardening, VoceHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematic import KinematicMaterial
from archord.materials.kinematics import SPACE
from archord.materials.logarithm import Logarithm
from tests.materials.test_space import ASKEW, TWICE, components, tensors, turned

E = 210000.0
NU = 0.3
MATERIALS = {
    "elastic": Elastic(E, NU),
    "linear hardening": J2Material(E, NU, hardening=LinearHardening(300.0, 1e4)),
    "Voce": J2Material(E, NU, hardening=VoceHardening(300.0, 400.0, 20.0)),
    "back stresses": KinematicMaterial(
        E, NU, hardening=LinearHardening(300.0), back_stresses=((20000.0, 100.0),)
    ),
}
every_material = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
COMPONENT, DERIVATIVE = np.array(SPACE.terms).T


def gradients(F):
    """Displacement gradients ``(n, 9)`` of deformations ``(n, 3, 3)``."""
    return (F - np.eye(3))[:, COMPONENT, DERIVATIVE]


def matrices(nine):
    """Tensors ``(n, 3, 3)`` with the components ``(n, 9)`` of gradients."""
    found = np.zeros((len(nine), 3, 3))
    found[:, COMPONENT, DERIVATIVE] = nine
    return found


def in_space(material):
    return LargeStrain(material).under(SPACE)


def differences(f, x, h):
    """The derivative ``(n, i, j)`` of ``f`` by central differences."""
    return np.stack([f(x + d) - f(x - d) for d in h * np.eye(x.shape[1])], axis=2) / (2 * h)


@every_material
@pytest.mark.parametrize("size", [1e-8, 1e-4, 1e-2, 0.3])
def test_the_tangent_is_the_derivative_of_the_nominal_stress(material, size):
    m = in_space(material)
    gradient = size * np.random.default_rng(1).normal(size=(60, 9))
    state = m.state(60)
    _, tangent, _ = m.update(gradient, state)
    found = differences(lambda x: m.update(x, state)[0], gradient, 1e-6 * max(size, 1e-3))
    off = np.abs(found - tangent).max(axis=(1, 2)) / np.nanmax(np.abs(tangent))
    known = ~np.isnan(off)
    assert known.sum() > 40
    assert off[known].max() < 2e-6


# principal stretches: equal ones, and close ones on either side of where series begin
STRETCHES = [
    (1.0, 1.0, 1.0),
    (1.3, 1.3, 1.3),
    (1.2, 1.2, 0.8),
    (0.9, 1.1, 1.1),
    (1.0, 1.0 + 1e-9, 1.0 - 1e-9),
    (1.1, 1.1 + 1e-5, 1.1 - 2e-5),
    (1.1, 1.1 * 1.0125, 1.1 * 1.025),
    (1.1, 1.1 * 1.0124, 1.1 * 1.0255),
    (1.4, 1.4 * (1 + 1e-12), 0.7),
    (2.0, 1.0, 0.5),
]


@pytest.mark.parametrize("stretches", STRETCHES, ids=str)
@every_material
def test_equal_and_close_eigenvalues(material, stretches):
    """The tangent is the derivative there, too, along any axes and behind any rotation."""
    m = in_space(material)
    F = np.array([np.diag(stretches), ASKEW @ np.diag(stretches), np.diag(stretches) @ ASKEW])
    gradient = gradients(F)
    state = m.state(3)
    stress, tangent, _ = m.update(gradient, state)
    assert np.isfinite(stress).all()
    found = differences(lambda x: m.update(x, state)[0], gradient, 1e-6)
    np.testing.assert_allclose(found, tangent, rtol=0, atol=1e-5 * np.abs(tangent).max())


def test_divided_differences_are_smooth_where_series_begin():
    """Tangents of a series and of differences agree on both sides of the limit."""
    m = in_space(Elastic(E, NU))
    spread = np.linspace(0.04, 0.06, 201)  # of eigenvalues of C
    for middle in (0.0, 0.3, 1.0):
        zero = 0 * spread
        C = np.stack([1 + zero, 1 + middle * spread, 1 + spread], axis=1)
        F = np.sqrt(C)[:, :, None] * np.eye(3)
        _, tangent, _ = m.update(gradients(ASKEW @ F @ ASKEW.T), None)
        bend = np.diff(tangent, n=3, axis=0)
        assert np.abs(bend).max() < 1e-8 * E  # smooth: no more than round-off


def test_the_strain_is_the_logarithm():
    """Of scipy's matrices; and of small strains all digits are kept."""
    F = np.eye(3) + 0.3 * np.random.default_rng(0).normal(size=(40, 3, 3))
    F = F[np.linalg.det(F) > 0.05]
    expected = np.array([logm(f.T @ f).real / 2 for f in F])
    found = Logarithm(gradients(F)).strain
    np.testing.assert_allclose(found, components(expected) * TWICE, atol=1e-12)
    H = 1e-9 * np.random.default_rng(1).normal(size=(40, 9))
    found = Logarithm(H).strain
    np.testing.assert_allclose(found, H @ SPACE.small.T, rtol=0, atol=1e-16)


@every_material
def test_small_strains_are_a_limit(material):
    small = material.under(SPACE)
    m = in_space(material)
    gradient = 1e-7 * np.random.default_rng(2).normal(size=(20, 9))
    stress, _, new = m.update(gradient, m.state(20))
    expected, _, _ = small.update(gradient @ SPACE.small.T, small.state(20))
    limit = 1e-5 * np.abs(expected).max()
    np.testing.assert_allclose(matrices(stress), tensors(expected), atol=limit)
    np.testing.assert_allclose(m.true_stress(gradient, stress, new), expected, atol=limit)


@every_material
@pytest.mark.parametrize("size", [1e-3, 0.2])
def test_a_rotation_turns_the_stress_with_it(material, size):
    """And makes none; turned material axes do not matter either."""
    m = in_space(material)
    assert np.abs(m.update(gradients(ASKEW[None]), m.state(1))[0]).max() < 1e-12 * E
    F = np.eye(3) + size * np.random.default_rng(3).normal(size=(20, 3, 3))
    F = F[np.linalg.det(F) > 0.2]
    state = m.state(len(F))
    stress, _, new = m.update(gradients(F), state)
    true = m.true_stress(gradients(F), stress, new)
    atol = 1e-11 * np.abs(true).max()
    for deformed in (ASKEW @ F, ASKEW @ F @ ASKEW.T):
        found, _, after = m.update(gradients(deformed), state)
        again = m.true_stress(gradients(deformed), found, after)
        np.testing.assert_allclose(again, turned(true), rtol=0, atol=max(atol, 1e-12 * E))
        np.testing.assert_allclose(m.peeq(after), m.peeq(new), rtol=0, atol=1e-13)


@every_material
def test_a_plane_is_deformed_as_in_plane_strain(material):
    """The same stresses, tangents and histories, step by step."""
    m = in_space(material)
    plane = LargeStrain(material)
    state = m.state(30)
    state_plane = plane.state(30)
    names = SPACE.gradient
    at = np.array([names.index(name) for name in ("xx", "yy", "xy", "yx")])
    for seed in range(3):
        four = 0.05 * np.random.default_rng(seed).normal(size=(30, 4))
        nine = np.zeros((30, 9))
        nine[:, at] = four
        expected, moduli, state_plane = plane.update(four, state_plane)
        stress, tangent, state = m.update(nine, state)
        limit = 1e-10 * E
        np.testing.assert_allclose(stress[:, at], expected, rtol=0, atol=limit)
        np.testing.assert_allclose(tangent[:, at[:, None], at], moduli, rtol=0, atol=1e-9 * E)
        true = plane.true_stress(four, expected, state_plane)
        found = m.true_stress(nine, stress, state)
        np.testing.assert_allclose(found[:, :4], true, rtol=0, atol=limit)
        np.testing.assert_allclose(m.peeq(state), plane.peeq(state_plane), rtol=0, atol=1e-14)


def test_a_stretched_bar_has_hencky_stress():
    """Kirchhoff's stress is E times the logarithmic strain, Cauchy's is over J."""
    m = in_space(Elastic(E, NU))
    stretch = np.array([0.6, 1.3, 2.0])
    lateral = stretch**-NU
    F = np.stack([lateral, lateral, stretch], axis=1)[:, :, None] * np.eye(3)
    P, _, _ = m.update(gradients(F), None)
    kirchhoff = E * np.log(stretch)
    zz = SPACE.gradient.index("zz")
    np.testing.assert_allclose(P[:, zz], kirchhoff / stretch, rtol=1e-12)
    np.testing.assert_allclose(np.delete(P, zz, axis=1), 0.0, atol=1e-9 * E)
    true = m.true_stress(gradients(F), P, None)
    np.testing.assert_allclose(true[:, 2], kirchhoff / (stretch * lateral**2), rtol=1e-12)
    np.testing.assert_allclose(von_mises(true), np.abs(true[:, 2]), rtol=1e-10)


def test_cauchys_stress_is_nominal_stress_over_the_deformed_area():
    """``J sigma = P F^T``, which is symmetric, with J the determinant of F."""
    m = in_space(Elastic(E, NU))
    F = np.eye(3) + 0.2 * np.random.default_rng(4).normal(size=(20, 3, 3))
    P, _, _ = m.update(gradients(F), None)
    expected = matrices(P) @ np.swapaxes(F, 1, 2) / np.linalg.det(F)[:, None, None]
    true = tensors(m.true_stress(gradients(F), P, None))
    np.testing.assert_allclose(true, expected, rtol=0, atol=1e-9 * E)


@pytest.mark.parametrize("plane", ["xy", "yz", "zx"])
@pytest.mark.parametrize("g", [1e-3, 0.5, 2.0])
def test_simple_shear_of_hencky(plane, g):
    """tau/G = 4 asinh(g/2)/sqrt(4 + g^2) in any plane; the energy's derivative is the stress."""
    m = in_space(Elastic(2.6, 0.3))
    nine = np.array([[g if name == plane else 0.0 for name in SPACE.gradient]])
    stress, _, _ = m.update(nine, None)
    tau = 4 * np.arcsinh(g / 2) / np.sqrt(4 + g * g)
    true = m.true_stress(nine, stress, None)[0, SPACE.names.index(plane)]
    assert true == pytest.approx(tau, rel=1e-12)
    h = 1e-5 * g
    up, down = (m.stored(nine * (1 + s * 1e-5), stress, None)[0] for s in (1, -1))
    place = SPACE.gradient.index(plane)
    assert (up - down) / (2 * h) == pytest.approx(stress[0, place], rel=1e-6)


@pytest.mark.parametrize("name", ["linear hardening", "back stresses"])
def test_the_work_of_large_strains_is_stored_or_dissipated(name):
    """Compression of a soft metal while it is sheared in all planes: plastic work is the work of
    Kirchhoff's stress, to 2e-4 in steps of this length."""
    soft = J2Material(E, NU, hardening=LinearHardening(0.04 * E, 0.05 * E))
    if name == "back stresses":
        back = ((0.2 * E, 5.0),)
        soft = KinematicMaterial(E, NU, hardening=LinearHardening(0.04 * E), back_stresses=back)
    m = in_space(soft)
    end = np.array([[-0.3, 0.05, -0.1, 0.1, 0.0, -0.1, 0.05, 0.0, 0.1]])
    n = 100
    state = m.state(1)
    work = 0.0
    last = np.zeros((1, 9))
    for at in np.linspace(0, 1, n + 1)[1:]:
        stress, _, state = m.update(at * end, state)
        work += float(((stress + last) / 2 * end / n).sum())
        last = stress
    stored = m.stored(end, stress, state)[0]
    dissipated = m.dissipation(state)[0]
    assert dissipated > 0.1 * stored
    assert stored + dissipated == pytest.approx(work, rel=4e-4)


def test_pure_stretches_add_up_as_logarithms():
    """Stretches along fixed axes that are askew, in one step and in ten."""
    m = in_space(MATERIALS["linear hardening"])
    end = ASKEW @ np.diag([0.2, -0.05, -0.12]) @ ASKEW.T
    found = []
    for steps in (1, 10):
        state = m.state(1)
        for k in range(1, steps + 1):
            F = expm(end * k / steps)[None]
            stress, _, state = m.update(gradients(F), state)
        found.append((stress, state.peeq))
    np.testing.assert_allclose(found[1][0], found[0][0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=1e-10)


def test_what_is_turned_inside_out_has_no_stress():
    """Nor has what is not a number; the other points do not notice."""
    m = in_space(Elastic(E, NU))
    good = 0.1 * np.random.default_rng(0).normal(size=(3, 9))
    bad = np.zeros((2, 9))
    bad[0, 0] = -1.5
    bad[1, 3] = np.nan
    stress, tangent, _ = m.update(np.concatenate([good, bad]), None)
    assert np.isnan(stress[3:]).all()
    expected = m.update(good, None)
    np.testing.assert_array_equal(stress[:3], expected[0])
    np.testing.assert_array_equal(tangent[:3], expected[1])

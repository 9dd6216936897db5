"""Materials in space: closed forms, tangents, turned axes, and the same answers as in a plane."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from archord.materials.elasticity import Elastic, mean_stress, principal_stresses, von_mises
from archord.materials.hardening import (
    LinearHardening,
    SwiftHardening,
    TabularHardening,
    VoceHardening,
)
from archord.materials.j2 import J2Material
from archord.materials.kinematic import KinematicMaterial
from archord.materials.kinematics import AXISYMMETRIC, SPACE
from archord.materials.named import named_material
from archord.materials.return_map import return_map

E = 210000.0
NU = 0.3
TABLE = TabularHardening(((0.0, 355.0), (0.02, 400.0), (0.1, 500.0), (0.3, 550.0)))
HARDENINGS = {
    "perfect": LinearHardening(300.0),
    "linear": LinearHardening(300.0, 1e4),
    "a table": TABLE,
    "Voce": VoceHardening(300.0, 400.0, 20.0),
    "Swift": SwiftHardening(800.0, 0.002, 0.2),
}
YIELDING = {
    **{name: J2Material(E, NU, hardening=law) for name, law in HARDENINGS.items()},
    "back stresses": KinematicMaterial(
        E, NU, hardening=LinearHardening(300.0), back_stresses=((60000.0, 400.0), (2000.0, 0.0))
    ),
    "a named metal": named_material("S355", "MPa"),
}
MATERIALS = {"elastic": Elastic(E, NU), **YIELDING}
every_material = pytest.mark.parametrize("material", MATERIALS.values(), ids=MATERIALS)
yielding_materials = pytest.mark.parametrize("material", YIELDING.values(), ids=YIELDING)
ASKEW = Rotation.from_rotvec(np.radians(37) * np.array([1.0, 2.0, 3.0]) / np.sqrt(14)).as_matrix()
TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


def tensors(six):
    """Tensors ``(n, 3, 3)`` with the components ``(n, 6)``."""
    xx, yy, zz, xy, yz, zx = six.T
    return np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]).transpose(2, 0, 1)


def components(tensors):
    """The components ``(n, 6)`` of tensors ``(n, 3, 3)``."""
    return tensors[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]


def turned(six, Q=ASKEW):
    """Components of tensors that are turned by ``Q``."""
    return components(Q @ tensors(six) @ Q.T)


def hooke(stress, E=E, nu=NU):
    """Engineering strains by Hooke's law."""
    return ((1 + nu) * stress - nu * 3 * mean_stress(stress)[:, None] * (TWICE == 1)) / E * TWICE


def path(material, n=300, steps=3, size=0.002, seed=0):
    """Strains and states behind a random path, and how the strain goes on."""
    rng = np.random.default_rng(seed)
    m = material.under(SPACE)
    strain = np.zeros((n, 6))
    state = m.state(n)
    for _ in range(steps):
        strain = strain + size * rng.normal(size=(n, 6))
        _, _, state = m.update(strain, state)
    return m, strain + size * rng.normal(size=(n, 6)), state


@every_material
def test_the_tangent_is_the_derivative_of_the_stress(material):
    m, strain, state = path(material)
    _, tangent, new = m.update(strain, state)
    h = 1e-8
    columns = [
        m.update(strain + d, state)[0] - m.update(strain - d, state)[0] for d in h * np.eye(6)
    ]
    off = np.abs(tangent - np.stack(columns, axis=2) / (2 * h)).max(axis=(1, 2))
    assert np.median(off) < 1e-6 * E
    assert (off < 1e-5 * E).mean() > 0.98  # others change their branch between
    assert not m.yields or 0.5 < np.mean(m.flows(state, new)) < 1


@every_material
def test_the_stress_is_hookes_of_the_elastic_strain(material):
    """And plastic strains keep the volume."""
    m, strain, state = path(material)
    stress, _, new = m.update(strain, state)
    plastic = new.plastic_strain if m.yields else np.zeros_like(stress)
    assert stress.shape == plastic.shape == (300, 6)
    elastic = hooke(stress, m.E, m.nu)
    np.testing.assert_allclose(elastic + plastic * TWICE, strain, rtol=0, atol=1e-15)
    assert np.abs(plastic[:, :3].sum(axis=1)).max() < 1e-16
    energy = 0.5 * (stress * elastic).sum(axis=1)
    np.testing.assert_allclose(m.energy(stress), energy, rtol=1e-12)


@yielding_materials
def test_the_stress_returns_to_the_yield_surface(material):
    """Around the sum of the back stresses, if there are any."""
    m, strain, state = path(material)
    stress, _, new = m.update(strain, state)
    flows = m.flows(state, new)
    strength = m.hardening.stress(new.peeq)
    excess = von_mises(stress - m.centre(new)) - strength
    assert excess.max() < 1e-10 * strength.max()
    assert np.abs(excess[flows]).max() < 1e-10 * strength.max()


@every_material
def test_without_strain_out_of_the_plane_it_is_plane_strain(material):
    """The same stresses, tangents and states, step by step."""
    m = material.under(SPACE)
    state = material.state(50)
    state_space = m.state(50)
    for seed in range(3):
        plane = 0.003 * np.random.default_rng(seed).normal(size=(50, 3))
        stress, tangent, state = material.update(plane, state)
        whole = np.zeros((50, 6))
        whole[:, [0, 1, 3]] = plane
        found, moduli, state_space = m.update(whole, state_space)
        np.testing.assert_allclose(found[:, :4], stress, rtol=0, atol=1e-9)
        assert not found[:, 4:].any()
        in_plane = np.array([0, 1, 3])
        moduli = moduli[:, in_plane[:, None], in_plane]
        np.testing.assert_allclose(moduli, tangent, rtol=0, atol=1e-9 * E)
        np.testing.assert_allclose(m.peeq(state_space), material.peeq(state), rtol=0, atol=1e-15)


@every_material
def test_it_is_a_ring_whose_hoop_goes_along_z(material):
    m = material.under(SPACE)
    ring = material.under(AXISYMMETRIC)
    four = 0.003 * np.random.default_rng(3).normal(size=(50, 4))
    expected = ring.update(four, ring.state(50))[0]
    found = m.update(np.pad(four, ((0, 0), (0, 2))), m.state(50))[0]
    np.testing.assert_allclose(found[:, :4], expected, rtol=0, atol=1e-9)


@every_material
def test_axes_do_not_matter(material):
    """Turned strains give turned stresses and histories, over several steps."""
    m, strain, state = path(material, size=0.004)
    stress, _, new = m.update(strain, state)
    along = m.state(len(strain))
    rng = np.random.default_rng(0)
    step = np.zeros_like(strain)
    for _ in range(4):
        step = step + 0.004 * rng.normal(size=strain.shape)
        found, _, along = m.update(turned(step / TWICE) * TWICE, along)
    np.testing.assert_allclose(found, turned(stress), rtol=0, atol=1e-9)
    np.testing.assert_allclose(m.peeq(along), m.peeq(new), rtol=0, atol=1e-14)
    if m.yields:
        expected = turned(new.plastic_strain)
        np.testing.assert_allclose(along.plastic_strain, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", HARDENINGS)
@pytest.mark.parametrize("Q", [np.eye(3), ASKEW], ids=["straight", "askew"])
def test_tension_and_shear_are_closed_forms(name, Q):
    """Of a stress s at the PEEQ p: s/E + p along tension, -nu s/E - p/2 across; gamma = s/(sqrt(3)
    G) + sqrt(3) p."""
    m = J2Material(E, NU, "space", HARDENINGS[name])
    peeq = np.linspace(0, 0.05, 9)
    s = m.hardening.stress(peeq)
    zero = 0 * s
    along = s / E + peeq
    across = -NU * s / E - peeq / 2
    half = (1 + NU) * s / E / np.sqrt(3) + np.sqrt(3) / 2 * peeq
    for strain, direction in (
        ([across, across, along, zero, zero, zero], [0, 0, 1, 0, 0, 0]),
        ([zero, zero, zero, half, zero, zero], [0, 0, 0, 3**-0.5, 0, 0]),
        ([zero, zero, zero, zero, half, zero], [0, 0, 0, 0, 3**-0.5, 0]),
        ([zero, zero, zero, zero, zero, half], [0, 0, 0, 0, 0, 3**-0.5]),
    ):
        state = m.state(1)
        expected = turned(np.outer(s, direction), Q)
        for k, at in enumerate(turned(np.stack(strain, axis=1), Q) * TWICE):
            stress, _, state = m.update(at[None], state)
            np.testing.assert_allclose(stress[0], expected[k], rtol=0, atol=1e-9)
            np.testing.assert_allclose(state.peeq, peeq[k], rtol=0, atol=1e-14)


def test_the_kernel_of_linear_hardening_is_the_return_map_of_any():
    """Closed form in C and Newton's method in numpy: the same stress, tangent and history."""
    m, strain, state = path(YIELDING["linear"])
    stress, tangent, new = m.update(strain, state)
    found = return_map(strain, state, m, m.hardening)
    np.testing.assert_allclose(found[0], stress, rtol=0, atol=1e-13 * np.abs(stress).max())
    np.testing.assert_allclose(found[1], tangent, rtol=0, atol=1e-12 * np.abs(tangent).max())
    np.testing.assert_allclose(found[2].peeq, new.peeq, rtol=0, atol=1e-16)
    np.testing.assert_allclose(found[2].plastic_strain, new.plastic_strain, rtol=0, atol=1e-16)


@yielding_materials
def test_work_is_stored_or_dissipated(material):
    """To the second order of the step."""
    m = material.under(SPACE)
    end = 0.01 * np.random.default_rng(5).normal(size=(20, 6))
    missing = []
    for steps in (100, 400):
        work = np.zeros(20)
        last = np.zeros((20, 6))
        state = m.state(20)
        for k in range(1, steps + 1):
            stress, _, state = m.update(end * k / steps, state)
            work += ((stress + last) / 2 * end / steps).sum(axis=1)
            last = stress
        energy = m.energy(stress) + m.dissipation(state)
        missing.append(np.abs(work - energy).sum() / work.sum())
    assert missing[1] < missing[0] / 8
    assert missing[1] < 1e-4


def test_invariants_are_of_the_tensor():
    """Principal stresses are eigenvalues; von Mises and mean stress are made of them."""
    stress = 100 * np.random.default_rng(0).normal(size=(40, 6))
    one, two, three = np.linalg.eigvalsh(tensors(stress)).T
    principal, _ = principal_stresses(stress)
    np.testing.assert_allclose(principal, np.stack([three, two, one], axis=1), atol=1e-10)
    mises = np.sqrt(((one - two) ** 2 + (two - three) ** 2 + (three - one) ** 2) / 2)
    np.testing.assert_allclose(von_mises(stress), mises, rtol=1e-12)
    np.testing.assert_allclose(mean_stress(stress), (one + two + three) / 3, atol=1e-12)
    plane = np.pad(stress[:, :4], ((0, 0), (0, 2)))
    for of_plane, of_space in zip(
        principal_stresses(plane[:, :4]), principal_stresses(plane), strict=True
    ):
        np.testing.assert_allclose(of_space, of_plane, atol=1e-10)

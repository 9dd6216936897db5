"""Linear elasticity in the plane."""

from __future__ import annotations

import numpy as np
import pytest

from archord.materials.elasticity import Elastic, contact_modulus, mean_stress, von_mises

E = 200e3
NU = 0.3


@pytest.fixture
def rng():
    return np.random.default_rng(1)


def hooke(stress, nu=NU):
    """Strains [xx, yy, zz, gamma_xy] from Hooke's law in three dimensions."""
    xx, yy, zz, xy = stress.T
    return (
        np.stack(
            [xx - nu * (yy + zz), yy - nu * (xx + zz), zz - nu * (xx + yy), 2 * (1 + nu) * xy],
            axis=1,
        )
        / E
    )


def turned(xx, yy, xy):
    """Components of a tensor in the plane along axes at 0.7 rad."""
    c = np.cos(0.7)
    s = np.sin(0.7)
    Q = np.array([[c, s], [-s, c]])
    t = np.array([[xx, xy], [xy, yy]])
    t = np.einsum("ik,kl...,jl->ij...", Q, t, Q)
    return t[0, 0], t[1, 1], t[0, 1]


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_stress_obeys_hookes_law_in_three_dimensions(plane, rng):
    """The strain of the stress is the strain put in, and the out-of-plane strain or stress is
    zero."""
    strain = rng.normal(size=(100, 3))
    stress, _, _ = Elastic(E, NU, plane).update(strain, None)
    back = hooke(stress)
    np.testing.assert_allclose(back[:, [0, 1, 3]], strain, rtol=0, atol=1e-14)
    np.testing.assert_allclose(back[:, 2] if plane == "strain" else stress[:, 2], 0, atol=1e-14)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_tangent_is_symmetric_and_positive(plane):
    """Elasticity has an energy, and it is positive."""
    C = Elastic(E, NU, plane).elastic_tangent
    np.testing.assert_array_equal(C, C.T)
    assert np.linalg.eigvalsh(C)[0] > 0


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_contact_modulus_is_that_of_a_uniaxial_stress_in_the_plane(plane):
    """E / (1 - nu^2) or E: the stiffness of a strip that may contract within the plane."""
    assert contact_modulus(E, NU, plane) == pytest.approx(
        1 / np.linalg.inv(Elastic(E, NU, plane).elastic_tangent)[0, 0], rel=1e-14
    )


def test_von_mises_of_uniaxial_shear_and_hydrostatic_stress():
    """s, sqrt(3) s and 0."""
    stress = np.array([[2.0, 0, 0, 0], [0, 0, -2.0, 0], [0, 0, 0, 2.0], [2.0, 2.0, 2.0, 0]])
    np.testing.assert_allclose(von_mises(stress), [2, 2, 2 * np.sqrt(3), 0], rtol=1e-15)
    np.testing.assert_allclose(mean_stress(stress), [2 / 3, -2 / 3, 0, 2], rtol=1e-15)


def test_invariants_do_not_change_with_the_axes(rng):
    """Von Mises and mean stress of a rotated stress are the same."""
    stress = rng.normal(size=(100, 4))
    xx, yy, xy = turned(*stress[:, [0, 1, 3]].T)
    rotated = np.stack([xx, yy, stress[:, 2], xy], axis=1)
    np.testing.assert_allclose(von_mises(rotated), von_mises(stress), rtol=1e-13)
    np.testing.assert_allclose(mean_stress(rotated), mean_stress(stress), rtol=0, atol=1e-14)

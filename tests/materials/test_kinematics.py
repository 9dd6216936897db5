"""Kinematics: strains of given displacements, rigid motions, tractions, what a name means."""

import pickle

import numpy as np
import pytest

from archord.materials.kinematics import (
    AXISYMMETRIC,
    PLANE_STRAIN,
    PLANE_STRESS,
    SPACE,
    kinematics,
)

EVERY = pytest.mark.parametrize(
    "kind", [PLANE_STRAIN, PLANE_STRESS, AXISYMMETRIC, SPACE], ids=lambda kind: kind.name
)


def gradient_of(kind, H, hoop):
    """The components of the gradient ``H`` ``(n, d, d)`` with the ``hoop`` strain ``(n,)``."""
    whole = np.concatenate([H, np.zeros_like(H[:, :, :1])], axis=2)
    whole[:, 0, -1] = hoop
    return np.stack([whole[:, i, j] for i, j in kind.terms], axis=1)


def test_a_strain_has_engineering_shear():
    H = np.array([[[1.0, 2.0], [3.0, 4.0]]])
    assert (gradient_of(PLANE_STRAIN, H, 9.0) @ PLANE_STRAIN.small.T).tolist() == [[1, 4, 5]]
    ring = gradient_of(AXISYMMETRIC, H, 9.0) @ AXISYMMETRIC.small.T
    assert ring.tolist() == [[1, 4, 9, 5]]
    H = np.array([[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]])
    assert (gradient_of(SPACE, H, 0.0) @ SPACE.small.T).tolist() == [[1, 5, 9, 6, 14, 10]]


@pytest.mark.parametrize("kind", [PLANE_STRAIN, AXISYMMETRIC, SPACE], ids=lambda kind: kind.name)
def test_components_of_a_stress_are_named_by_the_axes(kind):
    """In space the first four are named as in a plane."""
    assert kind.n_stress == len(kind.names) == (6 if kind is SPACE else 4)
    assert SPACE.names[:4] == PLANE_STRAIN.names
    for name, (component, derivative) in zip(kind.gradient, kind.terms, strict=True):
        assert name == "tt" or name == kind.axes[component] + kind.axes[derivative]


@EVERY
def test_rigid_motions_make_no_strain(kind):
    """The motions are linear in the position, so that differences are derivatives."""
    d = kind.dimension
    x = np.array([2.0, 1.0, 4.0])[:d] + np.eye(d + 1, d, -1)
    motions = kind.rigid_motions(x)
    assert motions.shape == (kind.n_rigid, d + 1, d)
    H = np.swapaxes(motions[:, 1:] - motions[:, :1], 1, 2)
    hoop = motions[:, 0, 0] / x[0, 0] if kind.has_hoop else np.zeros(len(motions))
    assert np.abs(gradient_of(kind, H, hoop) @ kind.small.T).max() == 0
    assert np.linalg.matrix_rank(motions.reshape(kind.n_rigid, -1)) == kind.n_rigid


@EVERY
def test_tractions_are_cauchys(kind):
    """The force is the stress tensor times the normal, small; the nominal one's at large strain."""
    rng = np.random.default_rng(0)
    d = kind.dimension
    normal = rng.normal(size=(5, d))
    xx, yy, zz, xy, yz, zx = stress = rng.normal(size=6)
    sigma = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])[:d, :d]
    force = kind.traction(normal) @ stress[list(kind.working)]
    np.testing.assert_allclose(force, normal @ sigma, atol=1e-15)
    P = rng.normal(size=(1, d, d))
    force = kind.traction(normal, large=True) @ gradient_of(kind, P, zz)[0]
    np.testing.assert_allclose(force, normal @ P[0].T, atol=1e-15)


def test_the_turns_of_space_are_about_the_axes():
    """By the right hand: a turn about z takes x to y."""
    motions = SPACE.rigid_motions(np.eye(3))
    np.testing.assert_array_equal(motions[3:], [np.cross(axis, np.eye(3)) for axis in np.eye(3)])


def test_the_measure_is_the_length_of_the_ring():
    x = np.array([[1.0, 7.0], [2.0, 7.0]])
    assert PLANE_STRESS.measure(x) == 1
    assert SPACE.measure(x) == 1
    assert AXISYMMETRIC.measure(x) == pytest.approx([2 * np.pi, 4 * np.pi])


def test_kinematics_are_known_by_name():
    assert kinematics("stress") == PLANE_STRESS
    assert pickle.loads(pickle.dumps(AXISYMMETRIC)) == AXISYMMETRIC
    assert kinematics("strain", 2.5).thickness == PLANE_STRAIN.with_thickness(2.5).thickness == 2.5
    with pytest.raises(ValueError, match="only a plane has a thickness"):
        kinematics("axisymmetric", 2.0)
    with pytest.raises(ValueError, match="bodies in space are drawn whole"):
        kinematics("space", 2.0)
    with pytest.raises(
        ValueError, match="kinematics are strain, stress, axisymmetric, space, not 'plane'"
    ):
        kinematics("plane")

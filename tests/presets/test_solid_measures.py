"""What presets in space tell in their own words."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

from archord.output.run import solve_scene
from archord.presets.solid_measures import Bearing, mean_over, shear_factor, solid_measures
from archord.scene.file import parse_any

STEEL = {"E": 210000.0, "nu": 0.3}
JOINT = {
    "joint": {
        "radius": 10.0,
        "clearance": 0.05,
        "block_size": 30.0,
        "relative_element_size": 0.15,
        "growth": 0.4,
    },
    "pin": STEEL,
    "block": STEEL,
    "load": {"displacement": 2.0, "steps": 1},
    "output": {"fields": False},
}


def last_of(data, folder):
    """The values of the last step of a scene."""
    folder.mkdir()
    return solve_scene(parse_any(data), folder, MPI.COMM_SELF).steps[-1]


def test_a_joint_in_space_lies_between_the_planes(tmp_path):
    """Of a thickness like its radius, in P and in p0 at its middle; at its rim p is smaller."""
    thickness = 8.0
    space = {"space": {"thickness": thickness, "rim_ratio": 1.0}}
    solid = last_of(JOINT | space, tmp_path / "space")
    strain, stress = (
        last_of(JOINT | {"analysis": {"plane": plane}}, tmp_path / plane)
        for plane in ("strain", "stress")
    )
    assert solid["delta"] == pytest.approx(0.1, rel=1e-12)
    assert 0.99 * stress["P"] < solid["P"] / thickness < strain["P"]
    assert 0.97 * stress["p0"] < solid["p0"] < 1.03 * strain["p0"]
    assert 0.8 * solid["p0"] < solid["rim pressure"] < 0.98 * solid["p0"]
    assert solid["eps"] == pytest.approx(stress["eps"], rel=0.04)


def test_a_pin_that_ends_in_its_hole_presses_there(tmp_path):
    """The rim pressure is told beside its end, where nothing is at the face."""
    space = {"space": {"thickness": 8.0, "pin_length": 4.0}}
    solid = last_of(JOINT | space, tmp_path / "joint")
    assert solid["rim pressure"] > 1.05 * solid["p0"]


@pytest.mark.parametrize("rim", [{}, {"chamfer": 0.5}, {"fillet": 0.5}])
def test_plates_bear_between_their_rims_by_hand(rim):
    """The moment about the mid-plane of half the force on the middles of what bears."""
    plate = STEEL | {"width": 40.0, "length": 40.0}
    scene = parse_any(
        {
            "clevis": {"radius": 10.0, "clearance": 0.02},
            "space": {"gap": 2.0, **rim},
            "inner": plate | {"thickness": 16.0},
            "outer": plate | {"thickness": 10.0},
            "pin": STEEL,
            "load": {"force": 20000.0},
        }
    )
    told = {measure.name: measure.value for measure in solid_measures(scene)}
    state = SimpleNamespace(contact_force=lambda name: [2e4, 0.0, 0.0])
    blunt = max(rim.values(), default=0.0)
    inner = (8.0 - blunt) / 2
    outer = 8.0 + 2.0 + 10.0 / 2
    assert told["pin bending moment by hand"](state) == pytest.approx(1e4 * (outer - inner))


@pytest.mark.parametrize("size", [3.0, 2.5])
def test_the_angle_that_bears_does_not_depend_on_the_mesh(size, tmp_path):
    """Points of facets lie denser at some angles than at others: the mean over points is off by
    4 and 9 %, the mean over their weights by 4 and 3 %."""
    lug = {"radius": 9.9, "clearance": 0.1, "width": 40.0, "length": 50.0, "growth": 0.5}
    scene = {
        "lug": lug | {"element_size": size},
        "space": {"thickness": 12.0, "pin_length": 16.0},
        "plate": STEEL,
        "pin": STEEL,
        "load": {"displacement": 0.15, "steps": 1},
        "output": {"fields": False},
    }
    found = last_of(scene, tmp_path / "lug")["pin in lug eps"]
    assert found == pytest.approx(0.986, rel=0.012)  # as finer meshes


def test_values_count_up_to_halfway_to_the_next_angles():
    """However dense these lie, and in any order."""
    angle = np.array([2.0, 0.1, 0.2, 0.2, 0.3, 1.0, 3.0])
    values = np.array([0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0])
    weight = np.array([1.0, 2.0, 3.0, 1.0, 1.0, 9.0, 1.0])
    expected = 0.15 + 0.75 * 0.1 + (1.5 - 0.25)
    assert math.pi * mean_over(angle, values, weight, math.pi) == pytest.approx(expected)


def test_hollow_beams_shear_more():
    """Of a solid one the factor is 6 (1 + nu)/(7 + 6 nu), of a thin tube 2 (1 + nu)/(4 + 3 nu)."""
    assert shear_factor(0.0, 0.3) == pytest.approx(7.8 / 8.8)
    assert shear_factor(1.0, 0.3) == pytest.approx(2.6 / 4.9)


def test_the_motion_of_a_pin_is_its_mean_around_wherever_points_lie():
    """Its sides come nearer to each other by more than it moves."""
    rng = np.random.default_rng(5)
    angle = np.pi * rng.random(80) ** 2
    z = rng.uniform(7.0, 9.0, 80)
    X = np.stack([10 * np.cos(angle), 10 * np.sin(angle), z], axis=1)[:, None]
    moved = 0.2 + 0.3 * np.cos(angle) + 0.1 * np.cos(3 * angle) + 0.05 * (z - 8.0)
    pin = SimpleNamespace(X=X, weight=np.ones((80, 1)), coordinates=X.copy())
    pin.coordinates[:, 0, 0] += moved
    bearing = Bearing("joint", 10.0, (0.0, 0.0), (1.0, 0.0), np.pi, (7.0, 9.0), (0.0, 1.0))
    state = SimpleNamespace(met={"joint": [pin]})
    assert bearing.moved(state) == pytest.approx(0.2, rel=1e-9)


def test_the_pin_of_a_clevis_bends_as_a_beam(tmp_path):
    """Its moment is below the one by hand, as plates press less evenly than that."""
    plate = STEEL | {"width": 40.0, "length": 40.0}
    made = last_of(
        {
            "clevis": {"radius": 10.0, "clearance": 0.02, "element_size": 5.0, "growth": 0.5},
            "space": {"gap": 2.0, "rim_ratio": 1.0},
            "inner": plate | {"thickness": 16.0},
            "outer": plate | {"thickness": 10.0},
            "pin": STEEL,
            "load": {"force": 20000.0, "steps": 1},
            "output": {"fields": False},
        },
        tmp_path / "clevis",
    )
    by_hand = 20000.0 / 2 * (16.0 / 4 + 2.0 + 10.0 / 2)
    assert made["pin bending moment by hand"] == pytest.approx(by_hand, rel=1e-5)
    assert 0.85 * by_hand < made["pin bending moment"] < by_hand
    deflection = made["pin deflection by hand"]
    assert deflection == pytest.approx(beam(20000.0), rel=1e-5)
    assert 0.6 * deflection < made["pin deflection"] < deflection
    assert made["pin in inner rim pressure"] > made["pin in inner mid pressure"]


def beam(force):
    """Deflection of a round steel beam on two supports, 30 apart, under an even load on 16."""
    inertia = math.pi * 10.0**4 / 4
    area = math.pi * 10.0**2
    shear_modulus = 210e3 / 2.6
    bent = (8 * 30.0**3 - 4 * 30.0 * 16.0**2 + 16.0**3) / (384 * 210e3 * inertia)
    sheared = (16.0 / 4 + 2.0 + 10.0 / 2) / 2 / (7.8 / 8.8 * shear_modulus * area)
    return force * (bent + sheared)

"""What holds for every law: derivative, inverse, units, and a word at the end of the range."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from archord.materials.hardening import LinearHardening, TabularHardening
from archord.postprocess.laws.general.joint import LARGE, LawJoint
from archord.postprocess.laws.law import LawRangeWarning, rising_root
from archord.postprocess.laws.laws import LAWS
from archord.scene.file import load_scene
from tests.solver.solving import scene, solve

JOINT = LawJoint(7.0, 0.03, 1.2e5, 300.0, 300.0, length=11.0, plane="strain", nu=0.3)
WITH_DISPLACEMENT = [name for name, law in LAWS.items() if law.gives_displacement]
SCENES = Path(__file__).parents[3] / "scenes"


@pytest.fixture(autouse=True)
def _warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        yield


@pytest.mark.parametrize("name", WITH_DISPLACEMENT)
def test_stiffness_is_the_derivative(name):
    """Central differences within the range, away from the kink in curvature at first yield."""
    law = LAWS[name]
    delta = law.limit(JOINT) * np.array([1e-4, 0.05, 0.21, 0.6, 0.9])
    h = 1e-5 * delta
    slope = (law.force(JOINT, delta + h) - law.force(JOINT, delta - h)) / (2 * h)
    assert law.stiffness(JOINT, delta) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("name", WITH_DISPLACEMENT)
def test_displacement_inverts_force(name):
    """For a table of any shape, from first touch to the end of the range."""
    law = LAWS[name]
    delta = law.limit(JOINT) * np.array([[0.0, 1e-9, 1e-3], [0.3, 0.8, 1.0]])
    P = law.force(JOINT, delta)
    assert P.shape == delta.shape
    assert P[0, 0] == 0
    assert (np.diff(P.ravel()) > 0).all()
    assert law.displacement(JOINT, P) == pytest.approx(delta, rel=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_units_do_not_matter(name):
    """In millimetres and MPa or in metres and Pa, the dimensionless state is the same."""
    law = LAWS[name]
    metres = LawJoint(7e-3, 3e-5, 1.2e11, 3e8, 3e8, length=11e-3, plane="strain", nu=0.3)
    a, b = (law.at_load(joint, 0.02 * joint.unit) for joint in (JOINT, metres))
    assert a.angle == pytest.approx(b.angle, rel=1e-9, nan_ok=True)
    for of, unit in (("peak_pressure", 1e6), ("stiffness", 1e6), ("delta", 1e-3)):
        assert unit * getattr(a, of) == pytest.approx(getattr(b, of), rel=1e-9, nan_ok=True)


@pytest.mark.parametrize("name", WITH_DISPLACEMENT)
def test_outside_the_range_every_law_says_so(name):
    """nan and a warning; inside no word."""
    law = LAWS[name]
    inside = LAWS[name].limit(JOINT) * np.array([0.0, 0.5, 1.0])
    assert np.isfinite(law.force(JOINT, inside)).all()
    both = law.limit(JOINT) * np.array([-0.1, 0.5, 1.01])
    with pytest.warns(LawRangeWarning, match=re.escape(f"{name}: delta = ")):
        P = law.force(JOINT, both)
    assert np.isnan(P[[0, 2]]).all()
    assert P[1] == law.force(JOINT, both[1])
    largest = law.force(JOINT, law.limit(JOINT))
    with pytest.warns(LawRangeWarning, match="E\\* dR is outside"):
        assert np.isnan(law.displacement(JOINT, 1.01 * largest))
    with pytest.warns(LawRangeWarning, match=r"P = -[\d.]+ E\* dR is outside"):
        assert np.isnan(law.displacement(JOINT, -largest))


def test_extrapolation_ends_with_the_formula():
    """Hu et al.'s formula goes on, Johnson's has no number beyond its load limit."""
    dR = JOINT.clearance
    with pytest.warns(LawRangeWarning):
        assert LAWS["paper"].force(JOINT, 5 * dR, extrapolate=True) > LAWS["paper"].force(
            JOINT, 2 * dR
        )
    with pytest.warns(LawRangeWarning):
        assert np.isnan(LAWS["johnson"].force(JOINT, dR, extrapolate=True))


@pytest.mark.parametrize("name", ["johnson", "radzimovsky"])
def test_half_space_laws_have_hertz_pressure_in_its_range(name):
    """Their forces go further, and there they tell none."""
    loads = JOINT.unit * np.array([0.01, 0.1, 1.0])
    state = LAWS[name].at_load(JOINT, loads)
    with pytest.warns(LawRangeWarning):
        hertz = LAWS["hertz"].at_load(JOINT, loads)
    assert np.isfinite(state.delta).all()
    assert np.isnan(hertz.angle).tolist() == [False, False, True]
    np.testing.assert_allclose(
        [state.peak_pressure, state.angle], [hertz.peak_pressure, hertz.angle], rtol=1e-12
    )


WIDE = {"clearance": 0.3}
UNLIKE = {"pin_share": 0.25, "plane": "strain", "nu": 0.3}
STRAY = [
    (name, WIDE, "no small clearance")
    for name in ("paper", "paper-plastic", "winkler", "liu", "persson")
]


@pytest.mark.parametrize(
    ("name", "change", "said"), [*STRAY, ("persson", UNLIKE, "beta = 0.143 is not zero")]
)
def test_joints_that_a_law_does_not_hold_for(name, change, said):
    """A wide clearance, unlike bodies: no number, or that of the formula on request."""
    joint = LawJoint(
        **{"radius": 1.0, "clearance": 0.01, "E_star": 1.0, "block_yield": 0.01} | change
    )
    with pytest.warns(LawRangeWarning, match=said):
        assert np.isnan(LAWS[name].at_load(joint, 0.001).peak_pressure)
    with pytest.warns(LawRangeWarning, match=said):
        assert LAWS[name].at_load(joint, 0.001, extrapolate=True).peak_pressure > 0


@pytest.mark.parametrize(
    ("of_scene", "said"),
    [
        ({"friction": 0.1}, "without friction; with the coefficient 0.1"),
        ({"large_strain": True}, "of small strain"),
    ],
)
def test_what_no_law_knows_of_a_scene_is_told(of_scene, said):
    """With a number all the same."""
    joint = LawJoint(radius=1.0, clearance=0.005, E_star=1.0, **of_scene)
    with pytest.warns(LawRangeWarning, match=said):
        assert LAWS["paper"].force(joint, 0.005) > 0


def test_what_a_law_needs_or_lacks_is_a_sentence():
    bare = LawJoint(radius=7.0, clearance=0.03, E_star=1.2e5)
    with pytest.raises(ValueError, match="paper-plastic: this law needs yield_stress"):
        LAWS["paper-plastic"].force(bare, 0.01)
    with pytest.raises(ValueError, match="needs length"):
        LAWS["lankarani-nikravesh"].force(bare, 0.01)
    with pytest.raises(ValueError, match="gives no displacement"):
        LAWS["persson"].force(bare, 0.01)
    assert np.isnan(LAWS["persson"].displacement(bare, 1.0))
    assert np.isnan(LAWS["esdu-78035"].at_load(bare, 1.0).angle)


NO_JOINT = {
    "radius": 0.0,
    "clearance": -1.0,
    "E_star": np.nan,
    "pin_share": 1.5,
    "length": 0.0,
    "plane": "axial",
}
NO_JOINT |= {"nu": 0.5, "pin_nu": -1.0, "pin_yield": 0.0, "block_yield": np.nan}


@pytest.mark.parametrize("name", NO_JOINT)
def test_values_that_make_no_joint_are_refused(name):
    with pytest.raises(ValueError, match=f"{name} = "):
        LawJoint(**({"radius": 1.0, "clearance": 0.01, "E_star": 1.0} | {name: NO_JOINT[name]}))


def test_a_curve_begins_at_the_yield_stress():
    with pytest.raises(ValueError, match="begins at 2, not at block_yield = 1"):
        LawJoint(1.0, 0.01, 1.0, block_yield=1.0, block_hardening=LinearHardening(2.0))


def test_a_curve_without_its_yield_stress_is_no_elastic_joint():
    """Its force was the elastic one."""
    curve = LinearHardening(2.0, 10.0)
    with pytest.raises(ValueError, match="block_hardening needs block_yield"):
        LawJoint(1.0, 0.01, 1.0, block_hardening=curve)
    with pytest.raises(ValueError, match=r"must be a Hardening, like LinearHardening, not 10\.0"):
        LawJoint(1.0, 0.01, 1.0, block_yield=1.0, block_hardening=10.0)
    assert not LawJoint(1.0, 0.01, 1.0, block_yield=2.0, block_hardening=curve).elastic.hardens


def test_joint_of_a_scene():
    """Like bodies have neither alpha nor beta; a rigid pin has alpha = 1, and beta from the block
    alone."""
    steel = LawJoint.from_scene(load_scene(SCENES / "steel_pin.toml"))
    assert (steel.radius, steel.clearance, steel.dundurs_alpha, steel.dundurs_beta) == (
        10.0,
        0.05,
        0.0,
        0.0,
    )
    assert steel.E_star == pytest.approx(105000 / 0.91)
    assert steel.yield_stress == pytest.approx(0.002 * steel.E_star)
    rigid = LawJoint.from_scene(load_scene(SCENES / "rigid_pin.toml"))
    assert rigid.dundurs_alpha == 1.0
    assert rigid.dundurs_beta == pytest.approx(
        (1 - 0.34) / 2
    )  # (kappa - 1)/(kappa + 1), kappa = (3 - nu)/(1 + nu)
    soft = LawJoint.from_scene(load_scene(SCENES / "steel_pin.toml", ["block.E=70000"]))
    assert soft.dundurs_alpha == pytest.approx(0.5)
    assert soft.dundurs_beta == pytest.approx(
        0.5 * 0.4 / 1.4
    )  # like nu: beta = alpha (1 - 2 nu)/(2 (1 - nu))


TABLE = TabularHardening(((0.0, 230.77), (0.1, 300.0)))
METALS = [
    ([], "both", 1.0, {}),
    (["pin.yield_stress=400"], "unlike", 400 / 230.77, {}),
    (["pin.hardening=2100"], "both", 1.0, {"pin": LinearHardening(230.77, 2100.0)}),
    (["block.hardening=[[0, 230.77], [0.1, 300]]"], "both", 1.0, {"block": TABLE}),
    (["block.hardening=[[0, 230.77]]"], "both", 1.0, {}),
    (["block.back_stresses=[[1000, 10]]"], "both", 1.0, {"kinematic": True}),
]


@pytest.mark.parametrize(("change", "yielding", "ratio", "hardening"), METALS)
def test_yielding_of_a_scene(change, yielding, ratio, hardening):
    """Each body's yield stress and hardening; the weaker body's decides the onset."""
    scene = load_scene(
        SCENES / "steel_pin.toml", ["pin.yield_stress=230.77", "block.yield_stress=230.77", *change]
    )
    joint = LawJoint.from_scene(scene)
    assert joint.yielding == yielding
    assert (joint.pin_yield, joint.block_yield, joint.yield_stress) == pytest.approx(
        (230.77 * ratio, 230.77, 230.77)
    )
    found = {"pin": joint.pin_hardening, "block": joint.block_hardening}
    found["kinematic"] = joint.kinematic or None
    assert {name: law for name, law in found.items() if law} == hardening
    assert joint.hardens == bool(hardening)


def test_roots_of_rising_functions():
    """Against the inverse, over twenty decades; nothing for nothing, nan for nan and for what is
    never reached."""
    target = np.array([0.0, 1e-12, 1e-3, 1.0, 1e8, np.nan, -1.0])
    root = rising_root(lambda x: x**1.5, target, 1.0)
    assert root[:5] == pytest.approx(target[:5] ** (2 / 3), rel=1e-13)
    assert np.isnan(root[5])
    assert root[6] == 0
    bounded = rising_root(np.tanh, np.array([0.5, 2.0]), 1.0)
    assert bounded[0] == pytest.approx(np.arctanh(0.5), rel=1e-13)
    assert np.isnan(bounded[1])
    ended = rising_root(lambda x: np.where(x > 3, np.nan, x), np.array([2.9, 3.1]), 1.0)
    assert ended[0] == pytest.approx(2.9, rel=1e-15)
    assert np.isnan(ended[1])


TEXT = (Path(__file__).parents[3] / "docs" / "laws.md").read_text(encoding="utf-8")


def rows(heading):
    """The cells of the table below ``heading`` in docs/laws.md, a list for each row."""
    lines = TEXT.split(f"### {heading}\n")[1].split("\n###")[0].splitlines()
    return [
        [cell.strip() for cell in line.split("|")[1:-1]] for line in lines if line.startswith("|")
    ]


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_documentation_has_the_words_of_every_law(law):
    needs = f" Needs {', '.join(law.needs)}." if law.needs else ""
    said = (
        f"### {law.name}\n\n{law.title[0].upper()}{law.title[1:]}.{needs}\n\n    {law.formula}\n\n"
    )
    assert f"{said}- Range: {law.range}.\n- Source: {law.source}.\n- {law.remarks}\n" in TEXT


def test_documentation_has_the_numbers_of_the_laws():
    """P/(E* dR) at some displacements, in brackets outside the range; load limits; readings of
    Radzimovsky's d."""
    joint = LawJoint(
        1.0, 0.005, 1.0, pin_yield=0.002, block_yield=0.002, length=2.0, plane="strain", nu=0.3
    )
    (_, *heads), _, *table = rows("P/(E* dR) against each other")
    assert [row[0] for row in table] == WITH_DISPLACEMENT
    for name, *cells in table:
        for head, cell in zip(heads, cells, strict=True):
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                P = float(LAWS[name].force(joint, float(head) * 0.005, extrapolate=True)) / 0.005
            assert cell == ("" if np.isnan(P) else f"({P:.4f})" if caught else f"{P:.4f}")
    for name, load, deepest in rows("Load limits")[2:]:
        delta = LAWS[name].limit(joint)
        assert (load, deepest) == (
            f"{LAWS[name].force(joint, delta) / 0.005:.4f}",
            f"{delta / 0.005:.4f}",
        )
    for _, width, limit in rows("Readings of Radzimovsky's d")[2:]:
        assert 16 * np.exp(-1 / 3) / float(width) ** 2 == pytest.approx(float(limit), rel=1e-4)


@pytest.mark.parametrize(
    ("width", "sections"),
    [(2.5, {}), (5.0, {}), (5.0, {"pin": {"rigid": True}}), (10.0, {"yield_stress": 0.002})],
)
def test_a_small_block_is_as_soft_as_is_said(width, sections):
    """P of archord's solutions falls by what the joint tells: that share, and up to twice as much
    for other bodies."""
    blocks = [scene(0.1, 2, joint={"block_size": size}, **sections) for size in (width, LARGE)]
    small, wide = ([m["P"] for m in solve(problem).steps] for problem in blocks)
    fall = 1 - np.array(small) / wide
    about, most = LawJoint.from_scene(blocks[0]).softer
    assert (fall < most).all()
    assert fall == pytest.approx(about, rel=0.7 if sections else 0.2)
    assert LawJoint.from_scene(blocks[1]).softer[0] < 2e-4


def test_the_room_needs_no_finite_elements():
    """Formulas and fits are imported without any library of the solver, or one that draws."""
    code = (
        "import importlib, pkgutil, sys; import archord.postprocess.laws as room\n"
        "names = [module.name for module in pkgutil.iter_modules(room.__path__)]\n"
        "for name in names: importlib.import_module(f'{room.__name__}.{name}')\n"
        "print(len(names), {'dolfinx', 'basix', 'petsc4py', 'mpi4py', 'gmsh', 'matplotlib'} & "
        "{*sys.modules})"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    number, _, loaded = result.stdout.strip().partition(" ")
    assert int(number) > 8
    assert loaded == "set()"

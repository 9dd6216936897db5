"""What holds for every law: derivative, inverse, units, and a word at the end of the range."""

import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from archord.postprocess.laws.joint import LARGE, LawJoint
from archord.postprocess.laws.law import LawRangeWarning, rising_root
from archord.postprocess.laws.laws import LAWS, find_law
from archord.scene.file import load_scene
from tests.solver.solving import scene, solve

JOINT = LawJoint(radius=7.0, clearance=0.03, E_star=1.2e5, yield_stress=300.0, length=11.0, plane="strain", nu=0.3)
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
    metres = LawJoint(7e-3, 3e-5, 1.2e11, yield_stress=3e8, length=11e-3, plane="strain", nu=0.3)
    a = law.at_load(JOINT, 0.02 * JOINT.E_star * JOINT.clearance)
    b = law.at_load(metres, 0.02 * metres.E_star * metres.clearance)
    assert a.peak_pressure / JOINT.E_star == pytest.approx(b.peak_pressure / 1.2e11, rel=1e-9, nan_ok=True)
    assert a.angle == pytest.approx(b.angle, rel=1e-9, nan_ok=True)
    assert a.stiffness / JOINT.E_star == pytest.approx(b.stiffness / 1.2e11, rel=1e-9, nan_ok=True)
    if law.gives_displacement:
        assert a.delta / 7.0 == pytest.approx(b.delta / 7e-3, rel=1e-9)


@pytest.mark.parametrize("name", WITH_DISPLACEMENT)
def test_outside_the_range_every_law_says_so(name):
    """nan and a warning; inside no word."""
    law, inside = LAWS[name], LAWS[name].limit(JOINT) * np.array([0.0, 0.5, 1.0])
    assert np.isfinite(law.force(JOINT, inside)).all()
    both = law.limit(JOINT) * np.array([-0.1, 0.5, 1.01])
    with pytest.warns(LawRangeWarning, match=re.escape(f"{name}: delta = ")):
        P = law.force(JOINT, both)
    assert np.isnan(P[[0, 2]]).all()
    assert P[1] == law.force(JOINT, both[1])
    largest = law.force(JOINT, law.limit(JOINT))
    with pytest.warns(LawRangeWarning, match="E\\* dR is outside"):
        assert np.isnan(law.displacement(JOINT, 1.01 * largest))
    with pytest.warns(LawRangeWarning):
        assert np.isnan(law.displacement(JOINT, -largest))


def test_extrapolation_ends_with_the_formula():
    """Hu et al.'s formula goes on, Johnson's has no number beyond its load limit."""
    dR = JOINT.clearance
    with pytest.warns(LawRangeWarning):
        assert LAWS["paper"].force(JOINT, 5 * dR, extrapolate=True) > LAWS["paper"].force(JOINT, 2 * dR)
    with pytest.warns(LawRangeWarning):
        assert np.isnan(LAWS["johnson"].force(JOINT, dR, extrapolate=True))


def test_half_space_pressure_has_its_own_range():
    """Johnson's force goes further than Hertz's pressure, and there tells none."""
    P = JOINT.E_star * JOINT.clearance
    state = LAWS["johnson"].at_load(JOINT, P)
    assert np.isfinite(state.delta)
    assert np.isnan([state.peak_pressure, state.angle]).all()
    with pytest.warns(LawRangeWarning):
        assert np.isnan(LAWS["hertz"].at_load(JOINT, P).peak_pressure)


@pytest.mark.parametrize("name", ["paper", "paper-plastic", "winkler", "liu", "persson"])
def test_thin_clearance_laws_refuse_a_wide_one(name):
    wide = LawJoint(radius=1.0, clearance=0.3, E_star=1.0, yield_stress=0.01)
    with pytest.warns(LawRangeWarning, match="no small clearance"):
        assert np.isnan(LAWS[name].at_load(wide, 0.001).peak_pressure)


def test_persson_refuses_bodies_with_beta():
    unlike = LawJoint(radius=1.0, clearance=0.01, E_star=1.0, dundurs_alpha=0.5, dundurs_beta=0.14)
    with pytest.warns(LawRangeWarning, match="beta = 0.14 is not zero"):
        assert np.isnan(LAWS["persson"].at_load(unlike, 0.01).angle)
    with pytest.warns(LawRangeWarning):
        assert LAWS["persson"].at_load(unlike, 0.01, extrapolate=True).angle > 0


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
    with pytest.raises(ValueError, match="did you mean radzimovsky"):
        find_law("radzimowsky")


@pytest.mark.parametrize(
    "values", [{"radius": 0.0}, {"clearance": -1.0}, {"E_star": float("nan")}, {"dundurs_alpha": 1.5}, {"length": 0.0}]
)
def test_values_that_make_no_joint_are_refused(values):
    with pytest.raises(ValueError, match=next(iter(values))):
        LawJoint(**({"radius": 1.0, "clearance": 0.01, "E_star": 1.0} | values))


def test_joint_of_a_scene():
    """Like bodies have neither alpha nor beta; a rigid pin has alpha = 1, and beta from the block alone."""
    steel = LawJoint.from_scene(load_scene(SCENES / "steel_pin.toml"))
    assert (steel.radius, steel.clearance, steel.dundurs_alpha, steel.dundurs_beta) == (10.0, 0.05, 0.0, 0.0)
    assert steel.E_star == pytest.approx(105000 / 0.91)
    assert steel.yield_stress == pytest.approx(0.002 * steel.E_star)
    rigid = LawJoint.from_scene(load_scene(SCENES / "rigid_pin.toml"))
    assert rigid.dundurs_alpha == 1.0
    assert rigid.dundurs_beta == pytest.approx((1 - 0.34) / 2)  # (kappa - 1)/(kappa + 1), kappa = (3 - nu)/(1 + nu)
    soft = LawJoint.from_scene(load_scene(SCENES / "steel_pin.toml", ["block.E=70000"]))
    assert soft.dundurs_alpha == pytest.approx(0.5)
    assert soft.dundurs_beta == pytest.approx(0.5 * 0.4 / 1.4)  # like nu: beta = alpha (1 - 2 nu)/(2 (1 - nu))


def test_roots_of_rising_functions():
    """Against the inverse, over twenty decades; nothing for nothing, nan for nan and for what is never reached."""
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
    return [[cell.strip() for cell in line.strip("| ").split(" |")] for line in lines if line.startswith("|")]


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_documentation_has_the_words_of_every_law(law):
    needs = f" Needs {', '.join(law.needs)}." if law.needs else ""
    said = f"### {law.name}\n\n{law.title[0].upper()}{law.title[1:]}.{needs}\n\n    {law.formula}\n\n"
    assert f"{said}- Range: {law.range}.\n- Source: {law.source}.\n- {law.remarks}\n" in TEXT


def test_documentation_has_the_numbers_of_the_laws():
    """P/(E* dR) at some displacements, in brackets outside the range; load limits; readings of Radzimovsky's d."""
    joint = LawJoint(radius=1.0, clearance=0.005, E_star=1.0, yield_stress=0.002, length=2.0, plane="strain", nu=0.3)
    (_, *heads), _, *table = rows("P/(E* dR) against each other")
    assert [row[0] for row in table] == WITH_DISPLACEMENT
    for name, *cells in table:
        for head, cell in zip(heads, cells + [""] * (len(heads) - len(cells)), strict=True):
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                P = float(LAWS[name].force(joint, float(head) * 0.005, extrapolate=True)) / 0.005
            number = "" if np.isnan(P) else f"({P:.4f})" if caught else f"{P:.4f}"
            assert cell.strip("| ") == number
    for name, load, deepest in rows("Load limits")[2:]:
        delta = LAWS[name].limit(joint)
        assert (load, deepest) == (f"{LAWS[name].force(joint, delta) / 0.005:.4f}", f"{delta / 0.005:.4f}")
    for _, width, limit in rows("Readings of Radzimovsky's d")[2:]:
        assert 16 * np.exp(-1 / 3) / float(width) ** 2 == pytest.approx(float(limit), rel=1e-4)


@pytest.mark.parametrize(
    ("width", "sections"), [(2.5, {}), (5.0, {}), (5.0, {"pin": {"rigid": True}}), (10.0, {"yield_stress": 0.002})]
)
def test_a_small_block_is_as_soft_as_is_said(width, sections):
    """P of archord's solutions falls by what the joint tells: that share, and up to twice as much for other bodies."""
    blocks = [scene(0.1, 2, joint={"block_size": size}, **sections) for size in (width, LARGE)]
    small, wide = ([m.P for m in solve(problem).steps] for problem in blocks)
    fall = 1 - np.array(small) / wide
    about, most = LawJoint.from_scene(blocks[0]).softer
    assert (fall < most).all()
    assert fall == pytest.approx(about, rel=0.7 if sections else 0.2)
    assert LawJoint.from_scene(blocks[1]).softer[0] < 2e-4


def test_the_room_needs_no_finite_elements():
    """Formulas, fits and the study are imported without any library of the solver, or one that draws."""
    code = (
        "import importlib, pkgutil, sys; import archord.postprocess.laws as room\n"
        "names = [module.name for module in pkgutil.iter_modules(room.__path__)]\n"
        "for name in names: importlib.import_module(f'{room.__name__}.{name}')\n"
        "print(len(names), {'dolfinx', 'basix', 'petsc4py', 'mpi4py', 'gmsh', 'matplotlib'} & {*sys.modules})"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    number, _, loaded = result.stdout.strip().partition(" ")
    assert int(number) > 10
    assert loaded == "set()"

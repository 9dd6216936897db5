"""What a run is warned of where loads, curves and decks mean something else than they seem to:
pressures at large strain, hardening beyond its curve or in percent, elements of another plane."""

import re

import numpy as np
import pytest

import archord
from archord import Body, Elastic, J2Material, Load, Problem, Support, TabularHardening
from archord.solver.path.system import System


def strip(material, loads, **options):
    """A strip from (1, 0) to (2, 1), held in y at its lower and its upper side."""
    mesh = archord.rectangles({"strip": (1.0, 0.0, 1.0, 1.0)}, size=0.5)
    supports = [Support("strip bottom", fixed="y"), Support("strip top", fixed="y")]
    if options.get("kinematics") != "axisymmetric":
        supports.append(Support("strip right", fixed="x"))
    return Problem(mesh, [Body("strip", material)], supports=supports, loads=loads, **options)


def told(problem, folder):
    return archord.solve(problem, folder, fields=False).warnings


@pytest.mark.parametrize(("strain", "is_told"), [("small", False), ("large", True)])
def test_a_pressure_that_does_not_follow_a_widened_bore_is_told(strain, is_told, tmp_path):
    """By the part by which the bore is wider, as a pressure that follows would act on all of it."""
    load = Load("oil", on="strip left", pressure=1.5)
    options = {"kinematics": "axisymmetric", "strain": strain, "steps": 2}
    problem = strip(Elastic(10.0, 0.4), [load], **options)
    run = archord.solve(problem, tmp_path / "run")
    fields = run.fields()
    at_bore = np.isclose(fields.coordinates[:, 0], 1.0)
    widened = 100 * float(fields.displacement[at_bore, 0].mean())
    found = [said for said in run.warnings if "undeformed areas" in said]
    assert len(found) == is_told
    for said in found:
        percent = float(re.findall(r"by ([0-9.e+]+) %", said)[0])
        assert percent == pytest.approx(widened, rel=0.02)


def test_the_error_of_a_dead_pressure_is_that_of_the_area_vector():
    """A rigid turn by an angle a takes the normal by 2 sin(a/2) elsewhere; a stretch of the side
    by s adds s, around an axis as much again."""
    load = Load("oil", on="strip left", pressure=0.0)
    found = {}
    for kinematics in ("plane strain", "axisymmetric"):
        system = System(strip(Elastic(1.0, 0.3), [load], kinematics=kinematics, strain="large"))
        x = system.V.tabulate_dof_coordinates()[:, :2]
        loads = system.equilibrium.drives.loads
        turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
        turned = loads.dead_error("strip left", x @ turn.T - x)
        found[kinematics] = turned, loads.dead_error("strip left", 0.1 * x)
    assert found["plane strain"] == pytest.approx((2 * np.sin(0.15), 0.1), rel=1e-12)
    _, stretched = found["axisymmetric"]
    assert stretched == pytest.approx(1.1**2 - 1, rel=1e-12)


@pytest.mark.parametrize(("last", "is_told"), [(0.01, True), (0.2, False)])
def test_peeq_beyond_the_hardening_curve_is_told(last, is_told, tmp_path):
    """With what a straight line on would add, unless that is little, as after a curve that has
    become flat."""
    curve = ((0.0, 200.0), (last, 200.0 + 1000.0 * last))
    pull = [Load("pull", on="strip left", direction="x", displacement=-0.05)]
    options = {"steps": 2, "strain": "large"}
    said = told(
        strip(J2Material(2e5, 0.3, hardening=TabularHardening(curve)), pull, **options),
        tmp_path / "a",
    )
    beyond = [s for s in said if "whose hardening ends at" in s]
    assert len(beyond) == is_told
    flat = (*curve, (last + 0.001, curve[-1][1]))
    said = told(
        strip(J2Material(2e5, 0.3, hardening=TabularHardening(flat)), pull, **options),
        tmp_path / "b",
    )
    assert not [s for s in said if "whose hardening ends at" in s]


@pytest.mark.parametrize(
    ("hardening", "is_told"),
    [
        ([[0.0, 300.0], [20.0, 400.0]], True),
        ([[0.0, 300.0], [1.0, 400.0]], False),
        ({"engineering": [[0.2, 300.0], [20.0, 400.0]]}, True),
        ({"saturation": 500.0, "rate": 0.1}, False),
        (1000.0, False),
    ],
)
def test_hardening_that_may_be_in_percent_is_told(hardening, is_told):
    steel = {"E": 2e5, "nu": 0.3}
    block = steel | {"hardening": hardening}
    if not isinstance(hardening, dict) or "rate" in hardening:
        block["yield_stress"] = 300.0
    joint = {"radius": 10.0, "clearance": 0.1, "relative_element_size": 0.2}
    scene = archord.Scene(joint=joint, pin=steel, block=block, load={"displacement": 1.0})
    assert any("look whether it is in percent" in said for said in scene.doubts) == is_told


DECK = """*NODE
1, 1., 0.
2, 2., 0.
3, 2., 1.
4, 1., 1.
*ELEMENT, TYPE={}4, ELSET=strip
1, 1, 2, 3, 4
*NSET, NSET=foot
1, 2
*NSET, NSET=head
3, 4
"""


@pytest.mark.parametrize(
    ("named", "given", "is_told"),
    [
        ("CPS", None, True),
        ("CAX", None, True),
        ("CPE", None, False),
        ("CPS", "plane stress", False),
        ("CPS", "plane strain", False),
    ],
)
def test_a_deck_for_other_kinematics_is_told_where_the_user_said_none(
    named, given, is_told, tmp_path
):
    deck = tmp_path / "strip.inp"
    deck.write_text(DECK.format(named))
    pull = [Load("pull", on="head", direction="y", displacement=0.01)]
    parts = {"supports": [Support("foot")], "loads": pull, "kinematics": given, "steps": 1}
    said = told(Problem(deck, [Body("strip", Elastic(2e5, 0.3))], **parts), tmp_path / "run")
    assert any("are named for" in s for s in said) == is_told

"""What a run tells of numbers that are not what they seem, and does not tell of those that are."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.measures.parts import part_measures
from archord.output.run import solve_scene
from archord.presets.account import account_of
from archord.presets.views import given
from archord.presets.words import words_of
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_scene
from archord.scene.parts import InteractionSection
from tests.solver.parts import blocks

BODIES = [archord.Body(name, archord.Elastic(1000.0, 0.3)) for name in ("lower", "upper")]


def ring(**load):
    like = {"E": 1.82, "nu": 0.3}
    joint = {
        "model": "ring",
        "radius": 1.0,
        "clearance": 0.001,
        "relative_element_size": 0.2,
        "growth": 1.0,
    }
    return parse_scene({"joint": joint, "pin": like, "block": like, "load": {"steps": 1} | load})


def test_the_largest_peeq_is_told_with_its_place():
    """In the columns of their names, of each body that can yield."""
    scene = load_scene(Path(__file__).parents[2] / "scenes" / "lug.toml")
    places = {body.name: (0.1 + k, 2.0 + k, 3.0 + k) for k, body in enumerate(scene.body)}
    state = SimpleNamespace(largest_peeq=places.get, axes=("x", "y"))
    told = {measure.name: measure for measure in part_measures(scene)}
    yielding = [body.name for body in scene.body if body.plastic]
    assert yielding
    for name in yielding:
        columns = [told[f"{name} {what}"] for what in ("peeq_max", "at x", "at y")]
        assert tuple(column.value(state) for column in columns) == places[name]


def block(**analysis):
    like = {"E": 1.82, "nu": 0.3}
    joint = {"radius": 1.0, "clearance": 0.005, "relative_element_size": 0.1, "growth": 1.0}
    load = {"displacement": 2.0, "steps": 1}
    return parse_scene(
        {"joint": joint, "pin": like, "block": like, "load": load, "analysis": analysis}
    )


def told(scene, folder):
    """The warnings of a run that comes to its end."""
    folder.mkdir()
    outcome = solve_scene(scene, folder, MPI.COMM_SELF)
    assert outcome.status == "done"
    return outcome.warnings


def test_a_ring_pressed_the_other_way_has_no_peak_on_the_axis(tmp_path):
    """Under the opposite force it touches on the other side: p0 was -0 and eps pi, without a
    word."""
    assert not any("axis" in said for said in told(ring(relative_force=0.001), tmp_path / "down"))
    (said,) = [
        said for said in told(ring(relative_force=-0.001), tmp_path / "up") if "axis" in said
    ]
    assert said.startswith("step 1: the bodies touch, but not on the contact axis")


def test_a_tolerance_that_was_asked_for_is_no_round_off(tmp_path):
    said = told(block(tolerance=1e-4), tmp_path / "loose")
    assert not any("round-off" in text for text in said)


def test_a_gamma_that_is_not_coercive_is_told(tmp_path):
    """P is 5 % and more off there."""
    (said,) = [
        said for said in told(block(gamma_factor=0.001), tmp_path / "run") if "coercive" in said
    ]
    assert said.startswith("analysis.gamma_factor = 0.001 is below 0.25, where")


def problem(interactions, gap=0.0, **changes):
    """Two squares, the upper one drawn ``gap`` above the lower one and pulled along x."""
    mesh = blocks(MPI.COMM_SELF, 4, 3)
    mesh.mesh.geometry.x[np.unique(mesh.mesh.geometry.dofmap[mesh.cells_in("upper")]), 1] += gap
    sets = mesh.facet_sets | {
        "again": mesh.facet_sets["lower top"],
        "other": mesh.facet_sets["upper bottom"],
    }
    data = {
        "bodies": BODIES,
        "interactions": interactions,
        "supports": [archord.Support("base")],
        "loads": [archord.Load("pull", on="lid", direction="y", displacement=0.01)],
        "steps": 1,
    }
    return archord.Problem(replace(mesh, facet_sets=sets), **(data | changes))


def told_first(problem):
    words = words_of(problem, "mesh.npz")
    return account_of(words, MPI.COMM_SELF, given=problem).warnings


def told_of(problem, folder):
    """The warnings of a run of ``problem`` that comes to its end."""
    run = archord.solve(problem, folder)
    assert run.status == "done"
    return run.summary["warnings"]


TIE = archord.Interaction("tie", ("lower top", "upper bottom"), law="tied")
CONTACT = archord.Interaction("contact", ("lower top", "upper bottom"))


def test_a_run_folder_has_one_strain_for_all_bodies():
    """Of a body at large strain beside one at small strain the scene said large for both, and gave
    other numbers when it was solved again."""
    one, other = BODIES
    mixed = [replace(one, material=archord.LargeStrain(one.material)), other]
    with pytest.raises(archord.InputError, match="bodies are at small and at large strain"):
        words_of(problem([CONTACT], bodies=mixed), "mesh.npz")


def test_a_facet_belongs_to_one_interaction():
    """Two on the same facets counted contact twice: forces rose by 2 %, without a word."""
    twice = [CONTACT, archord.Interaction("second", ("again", "other"))]
    said = (
        r"'lower top' of the interaction 'contact' and 'again' of 'second' have 4 facets in "
        r"common, .* \(0.125, 0\)"
    )
    with pytest.raises(InputError, match=said):
        told_first(problem(twice))


@pytest.mark.parametrize(("gap", "warned"), [(0.0, 0), (0.005, 0), (0.03, 1)])
def test_a_tie_over_a_gap_is_told(gap, warned):
    said = told_first(problem([TIE], gap))
    assert len(said) == warned
    assert all("'tie' ties are drawn up to 0.03 apart" in text for text in said)


def test_tied_surfaces_that_are_pulled_are_no_open_contact(tmp_path):
    """A tie in tension "never touched", and one that is bent had "few facets in contact"."""
    bent = archord.Load("push", on="right", pressure=1.0)
    assert told_of(problem([TIE]), tmp_path / "pulled") == []
    assert told_of(problem([TIE], loads=[bent]), tmp_path / "bent") == []


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_partners_of_the_beginning_are_told_of_where_surfaces_slide_far(tmp_path, kinematics):
    """At two facets' slip P was that of surfaces which still cover each other: four times too
    much."""
    press = archord.Load("press", on="lid", direction="y", displacement=-0.01)
    slide = archord.Load("slide", on="lid", direction="x", displacement=[0.0, 0.4])
    contact = replace(CONTACT, kinematics=kinematics)
    stated = problem([contact], loads=[press, slide])
    said = [text for text in told_of(stated, tmp_path / "run") if "partners" in text]
    assert len(said) == 2 * (kinematics == "reference")


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_gaps_of_fixed_partners_that_turn_are_told_of(tmp_path, kinematics):
    """By how much they are wrong: slip times the angle of the blocks, which turn together and slide
    by less than a facet, and a little where they deform."""
    angle = 0.01
    slide = 0.3
    mesh = archord.rectangles({"low": (-2, -1, 4, 1), "up": (-1, 0, 2, 1)}, size=0.5)
    steel = archord.Elastic(1000.0, 0.3)
    couplings = [
        archord.Coupling("base", "low bottom", point=(0.0, 0.0)),
        archord.Coupling("lid", "up top", point=(0.0, 0.0)),
    ]
    lifted = [-0.005, -0.005 + slide * angle]
    loads = [
        archord.Load("turn", on="base", direction="rotation", displacement=[angle, angle]),
        archord.Load("follow", on="lid", direction="rotation", displacement=[angle, angle]),
        archord.Load("press", on="lid", direction="y", displacement=lifted),
        archord.Load("slide", on="lid", direction="x", displacement=[0.0, slide]),
    ]
    stated = archord.Problem(
        mesh,
        [archord.Body(name, steel) for name in ("low", "up")],
        [archord.Interaction("contact", ("up bottom", "low top"), kinematics=kinematics)],
        [archord.Support("held", on="base", fixed="xy")],
        loads,
        couplings=couplings,
        steps=1,
    )
    said = [text for text in told_of(stated, tmp_path / "run") if "normals" in text]
    if kinematics == "current":
        assert said == []
        return
    wrong = [float(re.search(r"wrong by up to (\S+),", text)[1]) for text in said]
    assert wrong == pytest.approx(2 * [slide * angle], rel=0.25)


def test_a_contact_with_friction_is_not_called_frictionless():
    parts = {"name": "contact", "surfaces": ["a", "b"]}
    assert "law" not in given(InteractionSection(**parts, friction=0.1))
    assert "law = frictionless" in given(InteractionSection(**parts))
    assert "law = coulomb" in given(InteractionSection(**parts, law="coulomb", friction=0.1))

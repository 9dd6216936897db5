"""A quarter tells the numbers of the whole, whose images it lacks."""

from __future__ import annotations

import numpy as np
import pytest

import archord
from archord import (
    Body,
    Coupling,
    Elastic,
    Interaction,
    Load,
    Problem,
    Support,
    boxes,
    rectangles,
)

SOFT = Elastic(1000.0, 0.3)
HARD = Elastic(3000.0, 0.3)
HELD = [Support("lower bottom"), Support("lid", on="upper top", fixed="xz")]
MIRRORS = [Support("across x", on="x = 0", fixed="x"), Support("across z", on="z = 0", fixed="z")]


def pressed(quarter: bool, **changes) -> Problem:
    """A block that is pressed on another one, whose end is coupled to a point."""
    x, z, width, length, symmetry = (0, 0, 1, 2, 4) if quarter else (-1, -2, 2, 4, 1)
    drawn = {"lower": (x, -1, z, width, 1, length), "upper": (x, 0, z, width, 1, length)}
    mesh = boxes(drawn, size=1, kind="hexahedra")
    sets = mesh.facet_sets
    sets["x = 0"] = sets["lower left"] + sets["upper left"]
    sets["z = 0"] = sets["lower back"] + sets["upper back"]
    given = {
        "mesh": mesh,
        "bodies": [Body("lower", SOFT), Body("upper", HARD)],
        "interactions": [Interaction("joint", ("upper bottom", "lower top"))],
        "supports": [*HELD, *(MIRRORS if quarter else [])],
        "loads": [Load("press", on="upper top", direction="y", displacement=-0.05)],
        "couplings": [Coupling("end", "lower front", (0.0, 0.3, 2.0), "distributing")],
        "symmetry": symmetry,
        "steps": 1,
    }
    return Problem(**given | changes)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """The whole, and its quarter."""
    folder = tmp_path_factory.mktemp("mirrors")
    return [archord.solve(pressed(k), folder / str(k)) for k in (False, True)]


def test_a_face_that_a_mirror_cuts_moves_as_the_whole_face(runs):
    """Its other half moves across the mirror as far, and turns as far the other way."""
    whole, quarter = ({name: v[-1] for name, v in run.columns.items()} for run in runs)
    motions = [f"end {kind} {axis}" for kind in ("displacement", "rotation") for axis in "xyz"]
    np.testing.assert_allclose(
        [quarter[name] for name in motions], [whole[name] for name in motions], atol=1e-12
    )
    assert quarter["end rotation x"] != 0
    assert quarter["joint force y"] == pytest.approx(whole["joint force y"], rel=1e-9)


def test_a_line_load_is_of_both_sides_of_a_mirror(runs):
    """A quarter has it at each place of the axis as the whole, beyond the mirror, too."""
    whole, quarter = (run.line_load("joint", along=[-2, -1, 0, 0.5, 2]).load for run in runs)
    np.testing.assert_allclose(quarter[:, 1:], whole[:, 1:], atol=1e-9 * np.abs(whole).max())
    by_default = runs[1].line_load("joint")
    assert by_default.along[0] == pytest.approx(-2.0)
    force = np.diff(by_default.along) @ by_default.load
    assert force[1] == pytest.approx(runs[1].columns["joint force y"][-1], rel=1e-12)


def test_a_line_load_tells_of_mirrors_that_are_not_known(runs, monkeypatch, caplog):
    _, quarter = runs
    for run in runs:
        run.line_load("joint")
    assert not caplog.records
    monkeypatch.setitem(quarter.summary["model"], "mirrors", [])
    load = quarter.line_load("joint", along=[0, 2]).load
    assert 2 * load[0, 1] == pytest.approx(quarter.columns["joint force y"][-1], rel=1e-9)
    [told] = caplog.records
    assert "not all mirrors of the modelled part are known" in told.getMessage()


def test_motions_without_images_are_told(runs, tmp_path):
    supports = [*MIRRORS, Support("lower bottom", fixed="y")]
    run = archord.solve(pressed(True, supports=supports), tmp_path / "rollers")
    assert any("not all mirrors" in warning and "('end')" in warning for warning in run.warnings)
    for known in runs:
        assert not any("mirrors" in warning for warning in known.warnings)


def test_rollers_that_might_be_mirrors_are_none(comm):
    """Where three sides are held across themselves, nothing tells which two are mirrors."""
    supports = [*MIRRORS, Support("lower bottom", fixed="y")]
    assert archord.System(pressed(True, supports=supports)).mirrors == []
    found = archord.System(pressed(True)).mirrors
    assert [mirror.axis for mirror in found] == [0, 2]
    assert [mirror.at for mirror in found] == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize(("place", "turns"), [(2.0, False), (0.0, False), (5.0, True)])
def test_a_point_beside_a_face_of_a_quarter_is_refused(place, turns, tmp_path):
    """A force on it would turn the face, which took none of its moment; at the mirror it is the
    point of both ends of the whole, where their moments cancel."""
    problem = pressed(
        True,
        couplings=[Coupling("end", "upper front", (0.0, 0.5, place), "distributing")],
        loads=[Load("push", on="end", direction="y", force=-1.0)],
        supports=[Support("lower bottom"), *MIRRORS],
    )
    if not turns:
        assert archord.solve(problem, tmp_path / "run").steps == 1
        return
    said = "has its point beside its facets, where 'push' would turn them: move the point along z"
    with pytest.raises(archord.InputError, match=said):
        archord.solve(problem, tmp_path / "run")


@pytest.mark.parametrize(("height", "turns"), [(1.0, False), (0.0, False), (3.0, True)])
def test_a_point_beside_an_edge_of_a_half_is_refused(height, turns, tmp_path):
    """In a plane, too."""
    problem = Problem(
        rectangles({"block": (0, 0, 2, 1)}, size=0.5),
        bodies=[Body("block", SOFT)],
        supports=[Support("block left"), Support("axis", on="block bottom", fixed="y")],
        loads=[Load("push", on="end", direction="x", force=1.0)],
        couplings=[Coupling("end", "block top", (1.0, height), "distributing")],
        symmetry=2,
        steps=1,
    )
    if not turns:
        assert archord.solve(problem, tmp_path / "run").steps == 1
        return
    with pytest.raises(archord.InputError, match="move the point along y to the middle"):
        archord.solve(problem, tmp_path / "run")

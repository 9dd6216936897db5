"""The stability benchmark: its command, its table of cases, and what makes a line wrong."""

import csv
import json
import math
import re
from dataclasses import replace

import h5py
import pytest
from mpi4py import MPI

from archord.benchmarks.case import Expected, slug
from archord.benchmarks.stability.cases import FILE, FINE, cases, fine_scene
from archord.benchmarks.stability.eye import drawn_eye
from archord.benchmarks.stability.picture import what_happened
from archord.benchmarks.stability.run import (
    Check,
    Result,
    chosen,
    judge,
    not_finite,
    solve_case,
    with_references,
)
from archord.cli import run
from archord.output.run import solve_scene
from archord.scene.presets.joint import Scene


def test_three_cases_through_the_command(tmp_path, capsys, refused):
    """Two loads of zero and one that must stop: table and summary, exit code 0."""
    assert run(["benchmark", "stability", "--only", "zero*", "-o", str(tmp_path)]) == 0
    assert "2 converged of the 2" in capsys.readouterr().out
    assert (tmp_path / "stability.png").stat().st_size > 1000
    assert "| load | zero force | done |" in (tmp_path / "stability.md").read_text(encoding="utf-8")
    assert run(["benchmark", "stability", "--only", "pulled*", "-q", "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out == ""
    with (tmp_path / "stability.csv").open(newline="", encoding="utf-8") as file:
        assert [(row["status"], row["verdict"]) for row in csv.DictReader(file)] == [
            ("stopped", "stops, as it must")
        ]
    assert "singular mode" in (tmp_path / "stability.md").read_text(encoding="utf-8")
    assert "no case has such a name or group; groups are modulus" in refused(
        ["benchmark", "stability", "--only", "no one"]
    )


DONE = Result("done", steps=4, quantities={"P/(E* R)": 0.01})


def a_case(**changes):
    return replace(cases()["E_pin/E_block = 1"], **changes)


def test_the_table_is_whole():
    """At least 160 scenes, 40 of them general; what a case is compared with exists and is another.
    Fine scenes are the same joint with smaller elements of one size, and more steps where a body
    can yield."""
    table = cases()
    fine = json.loads(FILE.read_text(encoding="utf-8"))
    assert len({slug(name) for name in table}) == len(table) >= 160
    assert sum(not isinstance(case.scene, Scene) for case in table.values()) >= 40
    for case in table.values():
        assert case.expected or case.stops or not isinstance(case.scene, Scene)
        for expected in case.expected:
            assert expected.value != case.name
            if expected.value == FINE:
                assert expected.quantity in fine[case.name]
                own = case.scene
                scene = fine_scene(case.scene)
                assert (scene.pin, scene.block, scene.load.stages) == (
                    own.pin,
                    own.block,
                    own.load.stages,
                )
                assert (scene.joint.dR, scene.joint.size_ratio) == (own.joint.dR, 1)
                assert scene.joint.h <= 0.025 * scene.joint.radius
                assert not scene.plastic or len(scene.targets) >= 20
            else:
                assert isinstance(expected.value, float) or expected.value in table


def test_a_pattern_brings_what_it_is_compared_with():
    """--only solves the references too, in the table's order."""
    assert chosen("E_pin/E_block = 1e6")[0] == "E_pin/E_block = 1e6"
    assert with_references(["E_pin/E_block = 1e6"]) == ["E_pin/E_block = 1e6", "rigid pin"]
    assert chosen("GAMMA") == chosen("*gamma*")


def test_verdicts():
    """Each check alone turns a good line into a wrong one."""
    other = a_case(name="b", expected=(Expected("P/(E* R)", "a", 1e-3, "a law"),))
    results = {"a": DONE, "b": DONE}
    assert judge(other, results, {}).verdict == "converges"
    for change, said in (
        ({"quantities": {"P/(E* R)": 0.0101}}, "P/\\(E\\* R\\) is 0.0101, not 0.01 \\(a law\\)"),
        ({"quantities": {"P/(E* R)": math.nan}}, "is nan"),
        ({"forces": Check(1e-7, 1e-8, "forces differ")}, "forces differ"),
        ({"energy": Check(math.nan, 1e-8, "energy is off")}, "energy is off"),
        ({"not_finite": ["run.json: NaN"]}, "not finite: run.json: NaN"),
        ({"status": "stopped", "message": "no equilibrium"}, "stopped: no equilibrium"),
        ({"status": "failed", "message": "TypeError: x"}, "failed: TypeError: x"),
    ):
        line = judge(other, results | {"b": replace(DONE, **change)}, {})
        assert len(line.faults) == 1
        assert re.search(said, line.verdict)
    assert judge(replace(other, warns="end of"), results, {}).faults == ['does not warn "end of"']
    stops = replace(other, stops="singular mode", expected=())
    assert judge(stops, results, {}).faults == ["went on"]
    stopped = replace(DONE, status="stopped", message="nothing resists the force (singular mode)")
    assert judge(stops, results | {"b": stopped}, {}).verdict == "stops, as it must"


@pytest.mark.parametrize(
    ("verdict", "status", "iterations", "kind"),
    [
        ("converges", "done", 12, "up to 6 iterations a step"),
        ("converges", "done", 13, "up to 20"),
        ("converges", "done", 41, "more"),
        ("stops, as it must", "stopped", 9, "no solution: stops and says why"),
        ("stopped: no equilibrium", "stopped", 9, "not as it should be"),
    ],
)
def test_the_map_tells_what_happened(verdict, status, iterations, kind):
    row = {"verdict": verdict, "status": status, "iterations": iterations, "steps": 2}
    assert what_happened(row)[0] == kind


def test_blocks_of_quadrilaterals_and_triangles(tmp_path):
    """Contact and ties between meshes that do not fit, 20:1, pass on a uniform stress; the line is
    as it should be."""
    table = cases()
    for name in ("20:1, contact", "1:20, triangles, tied"):
        line = judge(table[name], {name: solve_case(table[name], tmp_path)}, {})
        assert (line.verdict, line.result.quantities["pull displacement"]) == ("converges", -0.01)


def test_an_eye_is_let_go_on_a_coarse_mesh(tmp_path):
    """Nothing pushes its pins then, so that no step is too short to fail: the out-of-balance forces
    of the fit moved them by more than their clearances in an iteration."""
    scene = cases()["eye, pulled and let go"].scene
    mesh = scene.mesh.model_copy(update={"file": str(drawn_eye(14))})
    at_once = scene.path.model_copy(update={"steps": 1})
    uncut = scene.stepping.model_copy(update={"minimum": 1.0})
    coarse = scene.model_copy(update={"mesh": mesh, "path": at_once, "stepping": uncut})
    outcome = solve_scene(coarse, tmp_path, MPI.COMM_SELF)
    assert outcome.status == "done"
    pulled, let_go = outcome.steps[1:]
    pressure = "joint A largest pressure"
    assert let_go[pressure] < 1e-3 * pulled[pressure]


def test_a_budget_ends_a_case(tmp_path):
    """With the sentence that says so, and what was reached before: forces and energies in
    balance."""
    short = solve_case(a_case(name="short", budget=5), tmp_path)
    assert (short.status, short.message, short.steps) == (
        "stopped",
        "more than the 5 Newton iterations allowed",
        1,
    )
    assert short.forces.share < 1e-2
    assert short.energy.share < 1


def test_a_nan_is_found_wherever_it_is(tmp_path):
    """In a table, in a report, deep in a file."""
    (tmp_path / "run.json").write_text('{"a": [1, NaN]}', encoding="utf-8")
    (tmp_path / "history.csv").write_text("step,P [N/mm]\n1,inf\n", encoding="utf-8")
    with h5py.File(tmp_path / "contact.h5", "w") as file:
        file["pin/gap"] = [1.0, math.nan]
        file["pin/s"] = [1.0, 2.0]
    assert not_finite(tmp_path) == ["run.json: NaN", "history.csv: P", "contact.h5: pin/gap"]

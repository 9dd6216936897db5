"""The work-precision benchmark: reference values, errors, envelopes, the codes' results, and its command."""

import csv
import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

from archord.benchmarks.case import Case
from archord.benchmarks.cost import work_precision_codes as codes
from archord.benchmarks.cost import work_precision_reference
from archord.benchmarks.cost.work_precision import (
    envelope,
    envelopes,
    judge,
    lasting,
    own_limit,
    seconds_at,
    warm_curves,
    warm_seconds,
)
from archord.benchmarks.cost.work_precision_cases import CASES, DECKS, SERIES, Series, families, meshes
from archord.benchmarks.cost.work_precision_codes import Task, Values
from archord.benchmarks.cost.work_precision_reference import (
    ANGLES,
    combined,
    interpolated,
    profile_error,
    read_reference,
    sampled,
    smooth_profile,
    smoothed,
)
from archord.benchmarks.cost.work_precision_report import markdown, ratio_table, reference_table, row
from archord.benchmarks.timing import Failure, Run, Timing, time_all
from archord.cli import run
from tests.postprocess.synthetic import arc


def task(folder=".", *command, **names):
    given = {"case": "elastic", "code": "archord", "series": "s", "size": 0.1, "steps": 2} | names
    return Task(command or ("true",), Path(folder), **given)


def line(code, series, size, seconds, P, **values):
    """A point that was run once and found this P."""
    found = Values({"P": P}, round(100 / size), **values)
    made = task(code=code, series=series, size=size)
    return judge(Timing(made, [Run(seconds, seconds, 10**8, found)]))


def test_two_families_that_differ_make_the_error():
    """The value is their mean; the error is relative, and at least their difference."""
    sizes = [0.04, 0.02, 0.01]
    entry = combined([[(h, 2 + h**2) for h in sizes], [(h, 2.002 - h**2) for h in sizes]])
    assert entry["value"] == pytest.approx(2.001, abs=1e-7)
    assert entry["error"] == pytest.approx(1e-3, rel=1e-3)


def test_a_profile_has_no_error_against_itself_and_errors_scale():
    """Relative: k times the difference is k times the error, and units do not matter."""
    reference = np.sqrt(np.maximum(0, 1 - (ANGLES / 1.2) ** 2))
    bump = 1e-3 * np.cos(5 * ANGLES)
    assert profile_error(reference, reference) == 0
    one = profile_error(reference + bump, reference)
    assert profile_error(reference + 3 * bump, reference) == pytest.approx(3 * one)
    assert profile_error(7 * (reference + bump), 7 * reference) == pytest.approx(one)
    assert profile_error(1.01 * reference, reference) == pytest.approx(0.01)


def test_sampling_keeps_a_linear_profile():
    """Of a run's side in whatever order its points are, and of nodal values."""
    angle = np.linspace(0, np.pi / 2, 60).reshape(20, 3)
    side = arc(angle[:, ::-1], 2 - angle[:, ::-1], np.ones_like(angle))
    np.testing.assert_allclose(sampled(side), 2 - ANGLES, atol=1e-12)
    np.testing.assert_allclose(interpolated(angle.ravel(), 2 - angle.ravel()), 2 - ANGLES, atol=1e-12)


def test_smoothing_keeps_a_smooth_profile_and_removes_scatter():
    """An elastic pressure is kept to 1e-4; waves from facet to facet leave no more than a quarter of themselves."""
    edge = 1.1717
    x = np.minimum(ANGLES / edge, 1)
    exact = np.sqrt(1 - x**2) * (1 + 0.3 * x**2 - 0.1 * x**4)
    assert profile_error(smoothed(exact, 6), exact) < 1e-4
    rough = exact * (1 + 0.01 * np.sin(60 * ANGLES))
    assert profile_error(smoothed(rough, 6), exact) < 0.25 * profile_error(rough, exact)
    profile, error = smooth_profile([[{"hole": exact}], [{"hole": rough}]], 6)
    assert profile_error(profile["hole"], exact) < error


def test_envelopes_keep_what_nothing_beats():
    """Straight in log-log between points; never beyond the ends. A lucky coarse mesh counts as good as the worst of
    those that follow; unknown ones are left out."""
    assert lasting([1e-2, 1e-6, 1e-3, None, 1e-4]) == [1e-2, 1e-3, 1e-3, None, 1e-4]
    kept = envelope([(1, 1e-2), (2, 5e-2), (10, 1e-4), (11, 1e-4), (5, 1e-3)])
    assert kept == [(1, 1e-2), (5, 1e-3), (10, 1e-4)]
    for error, seconds in ((1e-3, 5), (math.sqrt(1e-3 * 1e-4), math.sqrt(50)), (0.5, 1)):
        assert seconds_at(error, kept) == pytest.approx(seconds)
    assert seconds_at(9e-5, kept) is seconds_at(1e-3, []) is None


def test_ratios_of_synthetic_codes():
    """A code that always takes ten times as long is said to; one that stops at 1e-3 never gets beyond."""
    ours = [(10.0**k, 10.0 ** -(k + 2)) for k in range(4)]
    text = "\n".join(ratio_table({"archord": ours, "slow": [(10 * s, e) for s, e in ours], "rough": ours[:2]}))
    (line,) = [line for line in text.splitlines() if line.startswith("| 0.0001 |")]
    assert line == "| 0.0001 | 100.00 | takes 10 times as long | never |"
    assert "rough 1.0e-03" in text
    assert ratio_table({"archord": ours}) == []


def test_errors_and_ratios_of_lines():
    """Errors are against the reference of the code's kinematics; CalculiX is compared with its own limit, too."""
    exact = read_reference("elastic").values["P"]
    ours = [line("archord", "s", h, 0.1 / h, exact * (1 + h**2)) for h in (0.1, 0.03, 0.01)]
    theirs = [line("CalculiX", "CPE6", h, 10 / h, exact * (0.999 + h**2)) for h in (0.1, 0.03, 0.01)]
    assert ours[0].errors["P"] == pytest.approx(0.01)
    limit = own_limit("CalculiX", theirs)
    assert limit is not None
    assert limit.value == pytest.approx(0.999 * exact, rel=1e-6)
    assert own_limit("archord", theirs) is None
    kept = envelopes(ours + theirs)
    assert set(kept) == {"archord", "CalculiX", "CalculiX, own limit"}
    assert seconds_at(1e-3, kept["CalculiX, own limit"]) == pytest.approx(
        100 * (seconds_at(1e-3, kept["archord"]) or 0), rel=1e-2
    )
    scattered = [*theirs, line("CalculiX", "CPE6", 0.02, 500.0, 0.99 * exact)]
    assert own_limit("CalculiX", scattered) is None
    other = line("peer", "p", 0.1, 1.0, exact, kinematics="reference")
    assert other.errors["P"] == pytest.approx(abs(exact / read_reference("elastic", "reference").values["P"] - 1))
    assert "takes 1" in markdown(ours + theirs)


def test_references_are_there():
    """Both cases, both kinematics, with errors below what they are to judge; a profile for each side."""
    for case in CASES.values():
        for kinematics in ("current", "reference"):
            reference = read_reference(case.name, kinematics)
            assert set(reference.values) == set(case.quantities) == set(reference.errors)
            assert reference.errors["P"] < 2e-5
            assert kinematics == "reference" or {p.shape for p in reference.profile.values()} == {ANGLES.shape}
    profile = read_reference("elastic").profile
    force = 2 * np.trapezoid(profile["pin"] * np.cos(ANGLES), ANGLES)
    assert force == pytest.approx(read_reference("elastic").values["P"], rel=0.01)


def test_a_reference_is_computed_stored_and_read(tmp_path, monkeypatch):
    """From finished runs only where the scene is the same; the force is that of its profile."""
    case = CASES["elastic"]
    coarse = tuple(Series(f"{ratio:g}", meshes(0.3, 0.2, 0.15, ratio=ratio)) for ratio in (3, 4))
    monkeypatch.setattr(work_precision_reference, "families", lambda case: coarse)
    monkeypatch.setattr(work_precision_reference, "FILE", tmp_path / "reference.json")
    said: list[str] = []
    work_precision_reference.compute(case, "current", tmp_path, said.append)
    assert len(said) == 6
    found = read_reference("elastic")
    assert "| elastic | current | P | 0.012" in reference_table([case], ["current"]).markdown()
    assert found.values["P"] == pytest.approx(0.01278, rel=0.02)
    assert 0 < found.errors["P"] < 0.02
    force = 2 * np.trapezoid(found.profile["pin"] * np.cos(ANGLES), ANGLES)
    assert force == pytest.approx(found.values["P"], rel=0.03)
    monkeypatch.delattr(Case, "solve")
    work_precision_reference.compute(case, "current", tmp_path)
    with pytest.raises(AttributeError, match="solve"):
        work_precision_reference.compute(case, "reference", tmp_path)


def test_every_series_makes_scenes():
    """Of one joint, from coarse to fine; those of the reference are refined near and far."""
    for case in CASES.values():
        for series in (*SERIES, *DECKS):
            scenes = [case.scene(mesh) for mesh in series.meshes]
            assert all(len(s.targets) == case.steps and s.targets[-1] == pytest.approx(0.01) for s in scenes)
            cells = [s.joint.expected_cells for s in scenes]
            assert cells == sorted(cells)
        for series in families(case):
            joints = [case.scene(mesh).joint for mesh in series.meshes]
            assert len(joints) >= 3
            assert np.ptp([j.growth / j.h for j in joints]) < 1e-3


def test_failures_are_in_the_tables_with_their_sentence():
    """Beside what was solved, from which CSV and Markdown take their numbers."""
    lines = [line("archord", "s", 0.1, 2.0, 0.0128), judge(Timing(task(size=0.3), [], "it broke"))]
    found = [(r["status"], r["message"], r["seconds median"]) for r in map(row, lines)]
    assert found == [("done", "", "2"), ("failed", "it broke", "")]
    assert "| 0.3 R | failed: it broke |" in markdown(lines)


def test_the_result_of_a_peer(tmp_path):
    """Quantities that it knows, its kinematics, its own sentence where it failed."""
    file = tmp_path / "result.json"
    good = {"P": 0.0127, "p0": None, "eps": 1.17, "dofs": 5, "iterations": 7, "kinematics": "reference"}
    file.write_text(json.dumps(good | {"failed": None}))
    values = codes.peer_values(file)
    assert (values.quantities, values.kinematics) == ({"P": 0.0127, "eps": 1.17}, "reference")
    diverged = json.dumps(good | {"failed": "Newton's method diverged"})
    for text, said in ((diverged, "Newton's method diverged"), ("{", "is not what"), ("{}", "is not what")):
        file.write_text(text)
        with pytest.raises(Failure, match=said):
            codes.peer_values(file)
    file.unlink()
    with pytest.raises(Failure, match=r"wrote no result\.json"):
        codes.peer_values(file)


def test_peers_are_run_if_there_are_any(tmp_path, monkeypatch):
    """Each with its own time limit or, if it is less, that of the benchmark; nothing where none is installed."""

    class Peer:
        label, version, time_limit = "other", "1.2", 20.0
        series = {"elastic": ((0.2, 2), (0.1, 4))}  # noqa: RUF012

        def command(self, case, size, order, steps, output):
            result = {"P": size * order, "dofs": steps, "kinematics": "reference"}
            result |= dict.fromkeys(("p0", "eps", "iterations", "failed"))
            text = f"open({str(output)!r}, 'w').write({json.dumps(json.dumps(result))})"
            return [sys.executable, "-S", "-c", text]

    monkeypatch.setattr(codes, "installed", lambda: [Peer()])
    monkeypatch.setattr(codes, "SERIES", ())
    monkeypatch.setenv("PATH", "")
    elastic, plastic = CASES["elastic"], CASES["plastic"]
    tasks = list(codes.tasks(elastic, tmp_path, limit=10.0))
    assert [(t.code, t.version, t.series, t.label, t.limit) for t in tasks] == [
        ("other", "1.2", "order 2", "0.2 R", 10.0),
        ("other", "1.2", "order 4", "0.1 R", 10.0),
    ]
    assert list(codes.tasks(plastic, tmp_path)) == []
    assert len(list(codes.tasks(elastic, tmp_path, quick=True))) == 1
    assert [t.runs[0].result.quantities["P"] for t in time_all(tasks, 1)] == [0.4, 0.4]
    assert list(codes.tasks(elastic, tmp_path, peers=False)) == []
    monkeypatch.setattr(codes, "installed", list)
    assert list(codes.tasks(elastic, tmp_path)) == []


def test_a_quick_run_through_the_command(tmp_path, capsys):
    """Coarsest meshes: CSV with every error, table, diagram, exit code 0."""
    options = ["--quick", "--case", "elastic", "--no-peers", "--repeats", "1", "-q", "-o", str(tmp_path / "b")]
    assert run(["benchmark", "work-precision", *options]) == 0
    assert capsys.readouterr().out == ""
    with (tmp_path / "b" / "work_precision.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [r["status"] for r in rows] == ["done", "done"]
    for entries in rows:
        assert 0 < float(entries["error of P"]) < 1e-2
        assert 0 < float(entries["error of profile"]) < 0.1
        assert int(entries["iterations"]) > 2
        assert float(entries["seconds median"]) > 0.2
        assert entries["error of dissipation"] == ""
    assert (tmp_path / "b" / "work_precision_elastic.png").read_bytes().startswith(b"\x89PNG")
    assert "**elastic, 2 steps to 2 dR**" in (tmp_path / "b" / "work_precision.md").read_text(encoding="utf-8")


def test_wrong_options(tmp_path, refused):
    for options, said in (
        (["--case", "soft"], "--case soft: must be elastic, plastic or both."),
        (["--only", "nothing", "--no-peers"], "--only nothing: no code or series has such a name; there are archord"),
    ):
        assert said in refused(["benchmark", "work-precision", "-o", str(tmp_path), *options])


def test_patterns_choose_codes_series_and_meshes(tmp_path):
    tasks = [task(tmp_path / c / str(h), code=c, size=h) for c in ("archord", "CalculiX") for h in (0.1, 0.2)]
    assert codes.chosen(tasks, []) == tasks
    assert codes.chosen(tasks, ["calculix"]) == tasks[2:]
    assert codes.chosen(tasks, ["archord*0.2 R"]) == tasks[1:2]
    assert codes.chosen(tasks, ["CalculiX, s, 0.1 R", "archord"]) == tasks[:3]


def test_warm_solves_are_counted_without_the_first():
    """As many seconds as repeats for each curve; those of the benchmark have 8 and 20 steps."""
    assert [len(scene.targets) for scene in (case.scene for case in warm_curves())] == [8, 20]
    found = warm_seconds(2, [Case("coarse", CASES["elastic"].scene(SERIES[0].meshes[0]))])
    assert len(found["coarse"]) == 2
    assert min(found["coarse"]) > 0.01
    assert "| coarse |" in markdown([judge(Timing(task()))], found)

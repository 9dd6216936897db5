"""The work-precision benchmark: reference values, errors, fronts, the codes' results, and its
command."""

import csv
import json
import math
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from archord.benchmarks.cost import work_precision
from archord.benchmarks.cost import work_precision_codes as codes
from archord.benchmarks.cost.references import (
    Limit,
    Reference,
    extrapolated,
    mean_profile,
)
from archord.benchmarks.cost.work_precision import (
    Line,
    quantities,
    row,
    write,
)
from archord.benchmarks.cost.work_precision_codes import (
    ANGLES,
    CASES,
    DATA,
    Point,
    points,
    profile,
    profile_error,
)
from archord.benchmarks.timing import Process, Run, Timing, time_all
from archord.benchmarks.work_precision_picture import cases, front, short_table
from archord.cli import run
from tests.benchmarks.once import timed_once


def line(code, size, seconds, P, failure="", case="elastic", **found):
    """A point that was run once and found this P, or failed."""
    process = Process("a", (), Path())
    point = Point(case, code, "1.0", "s", size, 2, lambda folder: process)
    return Line(
        point,
        Timing(process, [Run(seconds, seconds, 10**8, {"P": P, "dofs": 100} | found)], failure),
    )


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
    """In whatever order its points are."""
    angle = np.linspace(0, np.pi / 2, 60).reshape(20, 3)[:, ::-1].ravel()
    np.testing.assert_allclose(profile(angle, 2 - angle), 2 - ANGLES, atol=1e-12)


def of_codes(**codes):
    """A table of points (seconds, error) by code."""
    rows = [
        {"code": code, "series": "s", "mesh": "0.1 R", "seconds": seconds, "error of P": error}
        for code, points in codes.items()
        for seconds, error in points
    ]
    known = {"dofs": 100, "MB": 10, "failure": None, "error of the reference": 1e-5}
    return pd.DataFrame(rows).assign(**known)


def read(tmp_path, table):
    table.to_csv(tmp_path / "work_precision_elastic.csv", index=False)
    return cases(tmp_path)["elastic"]


def test_a_front_keeps_what_nothing_beats(tmp_path):
    """A lucky coarse mesh counts as good as the worst of the meshes that follow."""
    lucky = read(tmp_path, of_codes(a=[(1, 1e-2), (2, 1e-6), (3, 1e-3), (4, 1e-4)]))
    assert lucky["kept"].tolist() == [1e-2, 1e-3, 1e-3, 1e-4]
    kept = front(lucky)[["seconds", "kept"]].to_numpy().tolist()
    assert kept == [[1, 1e-2], [2, 1e-3], [4, 1e-4]]


def test_the_short_table_tells_the_cheapest_point_and_what_failed(tmp_path):
    ours = [(10.0**k, 10.0 ** -(k + 2)) for k in range(4)]
    table = of_codes(ours=ours, rough=[(10, 0.05), (math.nan, math.nan)])
    table["failure"] = [None] * 5 + ["too slow"]
    ours, rough = short_table(read(tmp_path, table)).splitlines()[2:]
    assert ours.startswith("| ours | 1 s, 100 dofs, 10 MB | 10 s, 100 dofs, 10 MB |")
    assert rough == "| rough | never | never | never | never | 5.0e-02 | s, 0.1 R: too slow |"


def test_errors_are_against_the_reference_of_the_codes_kinematics(tmp_path):
    """Failures are in the tables with their sentence, and count for nothing."""
    exact, fixed = (CASES["elastic"][kinematics]["P"][0] for kinematics in ("current", "reference"))
    ours = [line("archord", h, 0.1 / h, exact * (1 + h**2)) for h in (0.1, 0.03, 0.01)]
    assert ours[0].errors == {"P": pytest.approx(0.01)}
    other = line(
        "peer",
        0.1,
        10.0,
        exact,
        kinematics="reference",
        profile=np.array(CASES["elastic"]["profile"]["reference"]),
    )
    assert other.errors == {"P": pytest.approx(abs(exact / fixed - 1)), "profile": 0}
    broken = line("peer", 0.01, 10.0, exact, failure="it broke")
    assert (row(broken)["failure"], row(broken)["seconds"], row(ours[1])["seconds"]) == (
        "it broke",
        "",
        "3.333",
    )
    lines = [*ours, other, broken]
    text, files = write(lines, tmp_path)
    assert "archord 1.0, peer 1.0" in text
    assert "it broke" in text
    names = ["work_precision_elastic.csv", "work_precision.md", "work_precision.png"]
    assert [file.name for file in files] == names


def test_a_lug_has_a_force_alone():
    """Against a reference in its own unit; the name of its column says so."""
    assert quantities("yielding_lug") == ["P"]
    exact = CASES["yielding_lug"]["current"]["P"][0]
    found = row(line("archord", 0.1, 1.0, 1.01 * exact, case="yielding_lug"))
    assert float(found["P [N/mm]"]) == pytest.approx(1.01 * exact)
    assert found["error of P"] == "1.0e-02"


@pytest.mark.parametrize("case", ["elastic", "plastic"])
def test_references_are_there(case):
    """For both kinematics, with errors below what they are to judge; the force of the profile is
    P."""
    for kinematics in ("current", "reference"):
        reference = CASES[case][kinematics]
        assert {*reference, "profile"} == set(quantities(case))
        assert reference["P"][1] < 2e-5
        assert CASES[case]["profile_error"][kinematics] < 5e-3
        pressure = np.array(CASES[case]["profile"][kinematics])
        assert pressure.shape == ANGLES.shape
        force = 2 * np.trapezoid(pressure * np.cos(ANGLES), ANGLES)
        assert force == pytest.approx(reference["P"][0], rel=0.01)


@pytest.mark.parametrize("order", [1.5, 2.0, 3.2])
def test_an_extrapolation_finds_limit_and_order(order):
    """Of values that converge with one order; a mesh that is off makes the limit unsure."""
    sizes = np.array([0.02, 0.014, 0.01, 0.007])
    values = 3.0 + 0.4 * (sizes / 0.02) ** order
    limit = extrapolated(sizes, values)
    assert limit.value == pytest.approx(3.0, abs=1e-6)
    assert limit.order == pytest.approx(order, abs=1e-4)
    assert limit.error < 1e-6
    values[1] += 0.01
    assert extrapolated(sizes, values).error > 1e-3


def test_a_reference_is_as_unsure_as_what_speaks_against_it():
    """Families that differ, an extrapolation that moves, or a choice that serves as well."""
    apart = [Limit(1.0, 2.0, 0.0), Limit(1.01, 2.0, 0.0)]
    assert Reference(tuple(apart)).error == pytest.approx(0.01 / 1.005)
    assert Reference((Limit(2.0, 2.0, 0.1), Limit(2.0, 2.0, 0.0))).error == pytest.approx(0.05)
    assert Reference((Limit(2.0, 2.0, 0.0),), other=2.5).error == pytest.approx(0.25)


def test_a_mean_profile_is_as_unsure_as_its_families():
    """Scatter of single meshes is averaged; what all meshes of a family share is not."""
    pressure = np.sqrt(np.maximum(0, 1 - (ANGLES / 1.2) ** 2))
    scatter = 0.01 * np.cos(400 * ANGLES)
    profile, error = mean_profile([[pressure + scatter, pressure - scatter], [1.01 * pressure]])
    assert profile_error(profile, 1.005 * pressure) < 1e-12
    assert error == pytest.approx(0.01, rel=0.01)


def test_every_series_makes_scenes(tmp_path, monkeypatch):
    """Of one joint, from coarse to fine; CalculiX gets decks where it is installed."""
    monkeypatch.setattr(codes, "installed", list)
    monkeypatch.setattr(codes, "_calculix_version", lambda: {"CalculiX": "2.20"})
    found = points()
    series = [
        (case, given)
        for case in CASES
        for given in DATA["series"]
        if case in given.get("cases", CASES)
    ]
    assert len(found) == sum(len(given["element_size"]) for _, given in series)
    for case, given in series:
        same = [
            p for p in found if (p.case, p.code, p.series) == (case, given["code"], given["name"])
        ]
        scenes = [point.prepare.args[0] for point in same]
        assert all(
            len(scene.targets) == point.steps for scene, point in zip(scenes, same, strict=True)
        )
        if "scene" in CASES[case]:
            continue
        assert all(scene.targets[-1] == pytest.approx(0.01) for scene in scenes)
        cells = [scene.joint.expected_cells for scene in scenes]
        assert cells == sorted(cells)
    (deck,) = points(["elastic: CalculiX, CPE6, 0.06 R"])
    process = deck.process(tmp_path, 20.0)
    assert (process.command, process.limit) == (("ccx", "deck"), 20.0)
    assert (process.folder / "deck.inp").is_file()


def test_patterns_choose_points(monkeypatch, refused):
    monkeypatch.setattr(codes, "installed", list)
    assert {point.code for point in points(["ARCHORD"])} == {"archord"}
    assert {point.case for point in points(["elastic"])} == {"elastic"}
    assert [
        point.size
        for point in points(["*plastic: archord, growth 0.25, 0.1?*", "elastic*, 0.01 R"])
    ] == [
        0.01,
        0.16,
        0.12,
    ]
    said = "--only nothing: no point has such a name; there are elastic: archord, edge"
    assert said in refused(["benchmark", "work-precision", "--only", "nothing"])


def test_peers_are_run_if_there_are_any(tmp_path, monkeypatch):
    """Each with its own time limit or, if it is less, that of the benchmark, and its own sentence
    where it fails."""

    class Peer:
        label = "other"
        version = "1.2"
        time_limit = 20.0
        series = {"elastic": ((0.2, 2), (0.1, 4))}  # noqa: RUF012

        def command(self, case, size, order, steps, output):
            found = {
                "P": size * order,
                "kinematics": "reference",
                "failed": "diverged" if order == 4 else None,
            }
            found |= dict.fromkeys(("p0", "eps", "iterations"))
            text = f"open({str(output)!r}, 'w').write({json.dumps(json.dumps(found))})"
            return [sys.executable, "-S", "-c", text]

    monkeypatch.setattr(codes, "installed", lambda: [Peer()])
    found = points(["other"])
    assert [point.name for point in found] == [
        "elastic: other, order 2, 0.2 R",
        "elastic: other, order 4, 0.1 R",
    ]
    assert [found[0].process(tmp_path, limit).limit for limit in (10.0, 30.0)] == [10.0, 20.0]
    solved, failed = time_all([point.process(tmp_path, 10.0) for point in found], 1)
    assert solved.runs[0].result == {"P": 0.4, "kinematics": "reference"}
    assert failed.failure == "diverged"


def test_a_quick_run_through_the_command(tmp_path, capsys, monkeypatch):
    """The coarsest mesh: CSV with every error, table, diagram, exit code 0."""
    monkeypatch.setattr(work_precision, "time_all", timed_once)
    options = [
        "--only",
        "plastic: archord, growth 0.25, 0.16 R",
        "--repeats",
        "1",
        "-q",
        "-o",
        str(tmp_path / "b"),
    ]
    assert run(["benchmark", "work-precision", *options]) == 0
    assert capsys.readouterr().out == ""
    with (tmp_path / "b" / "work_precision_plastic.csv").open(newline="", encoding="utf-8") as file:
        (entries,) = csv.DictReader(file)
    assert entries["failure"] == ""
    assert all(0 < float(entries[f"error of {name}"]) < 0.1 for name in quantities("plastic"))
    assert int(entries["iterations"]) > 2
    assert float(entries["seconds"]) > 0.2

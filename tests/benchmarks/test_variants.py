"""Scenes and sweeps with one thing switched pay only for what they use, and are compared run by
run."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from archord.benchmarks.case import varied, write_table
from archord.benchmarks.cost import variants as module
from archord.benchmarks.cost.variants import WATCHED, WITHOUT, Variant, ratio, run, variants
from archord.benchmarks.timing import Process, Run, Timing
from tests.benchmarks.once import timed_once

CHOSEN = (
    ("elastic", "rigid pin"),
    ("elastic", "no fields"),
    ("plastic", "whole"),
    ("plastic", "picture"),
)


@pytest.fixture(autouse=True)
def _timed_once(monkeypatch):
    monkeypatch.setattr(module, "time_all", timed_once)


def coarse(variant):
    """On a coarser mesh and in fewer steps than the benchmark's, which load the same."""
    if variant.scene is None:
        return variant
    return replace(
        variant, scene=varied(variant.scene, joint={"element_size": 0.12}, load={"steps": 2})
    )


def test_what_is_used_is_loaded_and_nothing_else(tmp_path):
    """That something is loaded where it is used makes its absence elsewhere say something."""
    chosen = [coarse(v) for v in variants("joint") if (v.case, v.name) in CHOSEN]
    rows, faults = run(chosen, tmp_path / "runs", 1, print)
    assert not faults
    rigid, bare, plastic, drawn = rows
    used = {
        "archord.materials.j2",
        "archord.output.fields",
        "kernel radial_return",
        "kernel closest_point",
        "dolfinx",
    }
    assert set(plastic["loads"].split(", ")) == used
    assert "kernel closest_point" in bare["loads"]
    assert "kernel closest_point" not in rigid["loads"]
    assert "matplotlib" in drawn["loads"]
    assert float(bare["written [kB]"]) < 0.5 * float(plastic["written [kB]"])
    assert all(float(row["peak memory [MB]"]) > 50 and float(row["seconds"]) > 0 for row in rows)
    assert chosen[2].faults(("dolfinx", "scipy")) == [
        "plastic, whole: loads scipy, which it does not need"
    ]
    text, files = write_table(tmp_path, "variants", rows)
    assert text.count("\n") == 6
    assert {file.name for file in files} == {"variants.csv", "variants.md"}


@pytest.mark.parametrize("group", ["joint", "sweep", "yielding", "strategies"])
def test_every_variant_can_be_run(group, tmp_path):
    """It has a scene or a sweep, of which there is a file; the first of a set is what the others
    are compared with."""
    found = variants(group)
    assert {name for variant in found for name in variant.unused} <= set(WATCHED)
    for variant in found:
        process = variant.process(tmp_path)
        assert ("mpirun" in process.command) == (variant.ranks > 1)
        assert (
            variant.picture_of
            or variant.sweep
            or variant.folder(tmp_path).with_suffix(".toml").is_file()
        )
        assert not variant.sweep or any(
            Path(word).is_file() for word in process.command if word.endswith(".toml")
        )
    firsts = {variant.case: variant for variant in reversed(found)}.values()
    assert not any(variant.without for variant in firsts)
    if group == "strategies":
        assert {variant.without for variant in found} == set(WITHOUT)


def test_what_is_left_out_is_left_out():
    """The statements that leave a strategy out name what there is."""
    changes = "\n".join(WITHOUT.values())
    subprocess.run([sys.executable, "-c", changes], check=True, env=os.environ)


def test_a_sweep_is_solved_on_each_number_of_ranks(tmp_path, monkeypatch):
    """Its cases again in every run, by both ranks together; a command that fails is no
    measurement."""
    (tmp_path / "few.sweep.toml").write_text(
        'base = "elastic_pin.toml"\n[grid]\npin.E = [1.0, 1.82]\njoint.relative_element_size = '
        "[0.3]\n"
    )
    scenes = Path(module.__file__).resolve().parents[2] / "scenes"
    (tmp_path / "elastic_pin.toml").write_text((scenes / "elastic_pin.toml").read_text())
    monkeypatch.setattr(module, "_SCENES", tmp_path)
    chosen = [replace(variant, sweep="few.sweep.toml") for variant in variants("sweep")]
    rows, _ = run(chosen, tmp_path / "runs", 1, print)
    assert rows[0]["times as long"] == "1.00"
    assert float(rows[1]["CPU [s]"]) < 2 * float(rows[0]["CPU [s]"])
    assert all(float(row["written [kB]"]) > 10 for row in rows)
    rows, faults = run(
        [Variant("a", "b", sweep="none.sweep.toml"), replace(chosen[1], case="a")],
        tmp_path / "runs",
        1,
        print,
    )
    assert rows == []
    assert [fault.partition(":")[0] for fault in faults] == ["a, b", "a, 1 rank"]
    assert "none.sweep.toml" in faults[0]
    assert write_table(tmp_path, "variants", rows) == ("", [])


def test_ratios_are_those_of_the_pair_in_the_middle():
    process = Process("a", (), Path())
    one = Timing(process, [Run(s, 8 * s, 0, None) for s in (2.0, 4.0, 20.0)])
    other = Timing(process, [Run(s, 2 * s, 0, None) for s in (1.0, 3.0, 2.0)])
    assert (ratio(one, other, "seconds"), ratio(one, other, "cpu")) == (2.0, 8.0)

"""``archord fit SWEEP`` as a user runs it."""

import math
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from archord.cli import run
from archord.postprocess.laws.calibration import calibrate
from archord.postprocess.run import Run
from archord.studies.cases import read_sweep

SWEEP = """
list = [
    { pin.nu = 0.3 },
    { pin.nu = 0.1 },
    { pin.nu = 0.1, block.yield_stress = 0.002, block.hardening = 0.1 },
    { pin.nu = 0.1, joint.relative_element_size = 0.2 },
]
[base]
joint = { radius = 1.0, relative_clearance = 0.005, relative_element_size = 0.12 }
pin = { E = 2.0, nu = 0.3 }
block = { E = 1.0, nu = 0.3 }
load = { displacement = 2.0, steps = 4 }
"""

SIZE = "relative_element_size = 0.2"


@pytest.fixture(scope="module")
def solved(tmp_path_factory) -> Path:
    """A small sweep: two elastic joints, one of them on two meshes, and one that hardens."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "some.sweep.toml").write_text(SWEEP)
    assert run(["sweep", str(folder / "some.sweep.toml"), "-o", str(folder / "out"), "-q"]) == 0
    return folder / "out"


def read_rows(file: Path) -> tuple[pd.DataFrame, dict[str, str]]:
    """A fit.csv and its notes."""
    notes = [line[2:].split(": ", 1) for line in file.read_text().splitlines() if line[0] == "#"]
    return pd.read_csv(file, comment="#"), dict(notes)


def test_a_small_sweep_gets_its_table(solved, capsys):
    """k of every case is that of archord fit RUN; the coarse mesh and the hardening joint are
    named."""
    assert run(["fit", str(solved)]) == 0
    printed = capsys.readouterr().out
    cases = read_sweep(solved / "sweep.toml").distinct
    stored, notes = read_rows(solved / "fit.csv")
    assert list(stored.run) == [cases[0].run, cases[1].run]
    for case, row in zip(cases[:2], stored.itertuples(), strict=True):
        k = calibrate([Run(solved / "cases" / case.run).curve]).joint.k
        assert row.k == pytest.approx(k.value, rel=1e-6)
        assert stored["k s.e."][row.Index] == pytest.approx(k.standard_error, rel=1e-6)
        assert f" {row.k:.4f} " in printed
        assert math.isnan(row.c)
    assert stored.k[0] != pytest.approx(stored.k[1], rel=1e-3)
    assert math.isnan(stored["k mesh"][0])
    assert 0 < stored["k mesh"][1] < 0.01
    assert (stored.yielding == "none").all()
    assert np.isinf(stored["sigY/E*"]).all()
    assert f"left out: {cases[3].run}: {cases[1].run} is the same joint on a finer mesh" in printed
    assert re.search(rf"left out: {cases[2].run}: .*block.hardening = 0.1 does not fit", printed)
    assert notes["distinct cases"] == "4"
    assert (notes.get("rms", "above 5% in 0 of 2") in printed) == (stored.rms > 0.05).any()


def test_a_joint_that_is_there_twice_is_left_out_once(tmp_path, capsys):
    """As with two tolerances: the first case stays, with its coarser mesh."""
    cases = """list = [
        { analysis.tolerance = 1e-8 },
        { analysis.tolerance = 1e-9 },
        { joint.relative_element_size = 0.3 },
    ]
    [base]"""
    words = SWEEP.partition("[base]")[2].replace("relative_element_size = 0.12", SIZE)
    (tmp_path / "twice.sweep.toml").write_text(cases + words)
    out = str(tmp_path / "out")
    assert run(["sweep", str(tmp_path / "twice.sweep.toml"), "-o", out, "-q"]) == 0
    assert run(["fit", out]) == 0
    printed = capsys.readouterr().out
    first, again, coarse = (case.run for case in read_sweep(tmp_path / "out/sweep.toml").distinct)
    assert list(read_rows(tmp_path / "out" / "fit.csv")[0].run) == [first]
    assert f"left out: {again}: {first} is the same joint on the same mesh" in printed
    assert f"left out: {coarse}: {first} is the same joint on a finer mesh" in printed


def test_small_blocks_are_named_and_whole_pins_left_out(solved, tmp_path, capsys):
    """k of a case is that of its own block; table and print say that there are such, of wide blocks
    they do not."""
    assert run(["fit", str(solved)]) == 0
    assert "small blocks" not in read_rows(solved / "fit.csv")[1]
    listed = (
        "list = [{ joint.block_size = 5.0 }, { joint.block_size = 100.0 }, { pin.whole = true "
        "}]\n[base]"
    )
    (tmp_path / "blocks.sweep.toml").write_text(listed + SWEEP.partition("[base]")[2])
    assert (
        run(["sweep", str(tmp_path / "blocks.sweep.toml"), "-o", str(tmp_path / "out"), "-q"]) == 0
    )
    assert run(["fit", str(tmp_path / "out")]) == 0
    said = "small blocks: P up to about 5.6% smaller than in a wide block, and k with it"
    printed = capsys.readouterr().out
    assert said in printed
    assert re.search(
        r"left out: .*: pin.whole = true does not fit: k and c of a sweep are for half a pin",
        printed,
    )
    small, wide = read_rows(tmp_path / "out" / "fit.csv")[0].k
    assert small < 0.96 * wide


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["{out}", "{out}"], "a sweep is fitted alone"),
        (
            ["{out}", "--picture", "x.png"],
            "a sweep is fitted alone; --json, --export and --picture are for runs.",
        ),
        (["{out}", "--range", "3", "4"], "holds no case that can be fitted"),
        (["nothing.csv"], "nothing.csv: is not a run folder"),
    ],
)
def test_bad_requests_are_one_sentence(solved, refused, words, said):
    assert said in refused(["fit", *(word.format(out=solved) for word in words)])

"""``archord fit SWEEP`` as a user runs it."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from archord.cli import run
from archord.postprocess.laws.calibrated import TABLE, CalibratedModel
from archord.postprocess.laws.calibration import calibrate
from archord.postprocess.laws.study_cases import as_csv, read_cases
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

ROWS = TABLE.with_name("calibrated_rows.csv")


@pytest.fixture(scope="module")
def solved(tmp_path_factory) -> Path:
    """A small sweep: two elastic joints, one of them on two meshes, and one that hardens."""
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "some.sweep.toml").write_text(SWEEP)
    assert run(["sweep", str(folder / "some.sweep.toml"), "-o", str(folder / "out"), "-q"]) == 0
    return folder / "out"


def test_a_small_sweep_gets_its_table(solved, capsys):
    """k of every case is that of archord fit RUN; the coarse mesh and the hardening joint are named."""
    assert run(["fit", str(solved)]) == 0
    printed = capsys.readouterr().out
    cases = read_sweep(solved / "sweep.toml").distinct
    stored, notes = read_cases(solved / "fit.csv")
    assert list(stored.run) == [cases[0].run, cases[1].run]
    for case, row in zip(cases[:2], stored.itertuples(), strict=True):
        k = calibrate([Run(solved / "cases" / case.run).curve]).joint.k
        assert row.k == pytest.approx(k.value, rel=1e-6)
        assert row.k_error == pytest.approx(k.standard_error, rel=1e-6)
        assert f" {row.k:.4f} " in printed
        assert math.isnan(row.c)
    assert stored.k[0] != pytest.approx(stored.k[1], rel=1e-3)
    assert math.isnan(stored.k_mesh[0])
    assert 0 < stored.k_mesh[1] < 0.01
    assert f"left out: {cases[3].run}: {cases[1].run} is the same joint on a finer mesh" in printed
    assert re.search(rf"left out: {cases[2].run}: .*block.hardening = 0.1 does not fit", printed)
    assert "elastic cases are too few for a model" in printed
    assert notes["distinct cases"] == "4"
    (judged,) = re.findall(r"archord's law . strain . none \(elastic\) . 2 . (.*?)% ", printed)
    assert float(judged) < 1.0


def test_small_blocks_are_named_and_whole_pins_left_out(solved, tmp_path, capsys):
    """k of a case is that of its own block; table and print say that there are such, of wide blocks they do not."""
    assert "small blocks" not in read_cases(solved / "fit.csv")[1]
    listed = "list = [{ joint.block_size = 5.0 }, { joint.block_size = 100.0 }, { pin.whole = true }]\n[base]"
    (tmp_path / "blocks.sweep.toml").write_text(listed + SWEEP.partition("[base]")[2])
    assert run(["sweep", str(tmp_path / "blocks.sweep.toml"), "-o", str(tmp_path / "out"), "-q"]) == 0
    assert run(["fit", str(tmp_path / "out")]) == 0
    said = "small blocks: P up to about 5.6% smaller than in a wide block, and k, which a model does not know"
    printed = capsys.readouterr().out
    assert said in printed
    assert re.search(
        r"left out: .*: pin.whole = true does not fit: k and c of a sweep are those of half a pin", printed
    )
    small, wide = read_cases(tmp_path / "out" / "fit.csv")[0].k
    assert small < 0.96 * wide


def test_files_of_others_and_inputs_stay(solved, tmp_path, capsys):
    """The law is not written over what it is fitted to, and over another file only with --force; fit.csv is the
    command's own."""
    rows, law = tmp_path / "rows.csv", tmp_path / "law.json"
    rows.write_text(ROWS.read_text())
    assert run(["fit", str(rows), "--law", str(rows), "--force"]) == 2
    assert f"{rows}: cannot be written: it is an input of the command." in capsys.readouterr().err
    assert rows.read_text() == ROWS.read_text()
    law.write_text("mine\n", encoding="utf-8")
    assert run(["fit", str(rows), "--law", str(law)]) == 2
    assert law.read_text() == "mine\n"
    assert run(["fit", str(rows), "--law", str(law), "--force"]) == 0
    assert run(["fit", str(solved)]) == 0


def test_stored_rows_give_the_law_that_is_shipped(tmp_path, capsys):
    """By the documented command; errors are printed, the file holds what is printed; rows give back their file."""
    law = tmp_path / "law.json"
    assert run(["fit", str(ROWS), "--law", str(law)]) == 0
    printed = capsys.readouterr().out
    model, shipped = (CalibratedModel.from_json(file.read_text()).data for file in (law, TABLE))
    assert model["form"] == shipped["form"]
    np.testing.assert_allclose(model["elastic"], shipped["elastic"], rtol=1e-4)
    assert model["provenance"] == shipped["provenance"]
    row = next(line for line in printed.splitlines() if line.startswith("| held out | both | all |"))
    assert f"{model['errors']['held out']['both all']['P']['rms']:.1%}" in row
    assert as_csv(*read_cases(ROWS)) == ROWS.read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["{out}", "{out}"], "a sweep is fitted alone"),
        (["{out}", "--law", "x.json"], "x.json: no law to write: 2 elastic cases are too few"),
        (["{out}", "--picture", "x.png"], "a sweep is fitted alone; --json, --python and --picture are for runs."),
        (["{run}", "--law", "x.json"], "--law is for a sweep, and this is none."),
        (["nothing.csv"], "nothing.csv: cannot be read"),
        (["{rows}", "--law", "no/where.json"], "no is not a folder"),
    ],
)
def test_bad_requests_are_one_sentence(solved, refused, words, said):
    places = {"out": solved, "run": solved / "cases" / read_sweep(solved / "sweep.toml").distinct[0].run, "rows": ROWS}
    assert said in refused(["fit", *(word.format(**places) for word in words)])

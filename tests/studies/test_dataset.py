"""The dataset: its joints are the same in any first part of it, and its tables tell what was
solved."""

import csv
import hashlib

import numpy as np
import pytest

from archord.postprocess.laws.general.law_fit import NodeRun
from archord.studies import dataset
from archord.studies.dataset import scenes, write_tables


@pytest.fixture(autouse=True)
def few(monkeypatch):
    monkeypatch.setattr(dataset, "JOINTS", 40)


def test_any_first_part_is_the_same():
    some = scenes(5)
    assert scenes(12)[: len(some)] == some
    assert scenes(5) == some
    every = scenes(40)
    assert {row.get("analysis.plane") for row in every} == {None, "stress"}
    assert any("pin.yield_stress" not in row and "block.yield_stress" not in row for row in every)


def test_tables_have_error_bars_and_checksums(tmp_path, monkeypatch):
    """Forces of twice as many steps extrapolate; the error has mesh and steps."""
    x = np.array([1.0, 2.0, 3.0])
    coarse = np.column_stack([[*x, 2.5], [1.0, 2.0, 3.0, 2.0], np.ones(4), np.ones(4)])
    fine = np.column_stack([x, [1.1, 2.2, 3.0], np.ones(3), np.ones(3)])
    solved = {(1.0, 0.5, 0.4, 0.4, 0.005, 0.3, 0.3): [NodeRun(coarse, 1), NodeRun(fine, 2)]}
    monkeypatch.setattr(
        dataset, "solved_in", lambda folder, names: solved if names == {"a"} else {}
    )
    (tmp_path / "cases.csv").write_text("case,run\n1,a\n")
    files = write_tables(tmp_path, tmp_path)
    with files[1].open() as file:
        rows = list(csv.DictReader(file))
    assert [row["way"] for row in rows] == ["loading"] * 3 + ["back from 3"]
    assert [float(row["P/(E* dR)"]) for row in rows] == pytest.approx([1.2, 2.4, 3.0, 2.0])
    error = float(rows[0]["error of P/(E* dR)"])
    assert error == pytest.approx(1.2 * np.hypot(6e-4, 1 - 1.1 / 1.2), rel=1e-4)
    assert rows[3]["p0 R/(E* dR)"] == ""
    for line in files[2].read_text().splitlines():
        digest, name = line.split()
        assert hashlib.sha256((tmp_path / name).read_bytes()).hexdigest() == digest
    monkeypatch.setattr(dataset, "solved_in", lambda folder, names: {})
    with pytest.raises(ValueError, match="no joint is solved"):
        write_tables(tmp_path, tmp_path)


def test_a_folder_that_cannot_be_is_refused(tmp_path, refused):
    (tmp_path / "file").touch()
    said = refused(["dataset", "--joints", "1", "-o", str(tmp_path / "file")])
    assert "cannot hold a dataset: File exists" in said

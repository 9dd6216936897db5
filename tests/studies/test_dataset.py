"""The dataset: its joints are the same in any first part of it, and its tables tell what was
solved."""

import csv
import hashlib
from collections import defaultdict
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from archord.postprocess.laws.general.elastic_model import Elastic, elastic_model
from archord.postprocess.laws.general.general_law import law_of_numbers
from archord.postprocess.laws.general.law_fit import NodeRun, first_loading
from archord.postprocess.laws.general.yield_model import Numbers, first_yield
from archord.studies import dataset
from archord.studies.dataset import NUMBERS, scenes, write_tables

FOLDER = Path(__file__).parents[2] / "dataset"


@pytest.fixture(autouse=True)
def few(monkeypatch):
    monkeypatch.setattr(dataset, "JOINTS", 40)


def test_any_first_part_is_the_same():
    some = scenes(5)
    assert scenes(12)[: len(some)] == some
    assert scenes(5) == some
    every = scenes(40)
    assert {row.get("analysis.plane") for row in every} == {None, "stress"}
    yielding = [row for row in every if "pin.yield_stress" in row or "block.yield_stress" in row]
    assert len(yielding) < len(every)
    finer = [row for row in yielding if row.get("load.steps") == 2]
    assert 2 * len(finer) == len(yielding)  # else the error of steps is unknown


def test_tables_have_error_bars_and_checksums(tmp_path, monkeypatch):
    """Forces of twice as many steps extrapolate; the error has mesh and steps."""
    x = np.array([1.0, 2.0, 3.0])
    coarse = np.column_stack([[*x, 2.5], [1.0, 2.0, 3.0, 2.0], np.ones(4), np.ones(4)])
    fine = np.column_stack([x, [1.1, 2.2, 3.0], np.ones(3), np.ones(3)])
    runs = [NodeRun(coarse, 1, np.zeros(4, bool)), NodeRun(fine, 2, np.zeros(3, bool))]
    solved = {Numbers(1.0, 0.5, 0.4, 0.4, 0.005, 0.3, 0.3): runs}
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


@pytest.mark.parametrize("parts", [(2, 2), (2, 8), (1, 4)])
def test_the_error_of_steps_has_the_error_where_steps_were_cut(parts):
    """Steps that were cut into so ``parts`` between two nodes, of errors in proportion to their
    length. The difference of both runs told an error of 0 for one of 1 %."""
    error = np.array([0.0, 0.02, 0.02, 0.02, 0.02, 0.02])
    cut = np.array([0, 0, 1, 1, 0, 0], bool)
    runs = []
    for steps, in_cut in zip((1, 2), parts, strict=True):
        in_all = np.where(cut, max(steps, in_cut), steps)
        y = 1 + error / in_all
        nodes = np.column_stack([np.arange(1.0, 7.0), y, y, y])
        runs.append(NodeRun(nodes, steps, cut & (in_all > steps)))
    nodes = first_loading(runs)
    told = dataset._step_error(runs, nodes)
    off = np.abs(nodes[:, 1] - 1)
    assert off[cut].max() > 0.004
    assert (told >= 0.99 * off).all()
    np.testing.assert_allclose(told[~cut], error[~cut] / 2, rtol=1e-12)


def test_a_run_tells_between_which_nodes_its_steps_were_cut():
    load = SimpleNamespace(stage_steps=[2, 2, 1])
    scene = SimpleNamespace(load=load)
    columns = {"cutbacks": [0, 0, 0, 3, 0]}
    ones = np.ones(5)
    curve = SimpleNamespace(scene=scene, unit=1.0, R=1.0, x=ones, P=ones, p0=ones, eps=ones)
    run = NodeRun.of(SimpleNamespace(curve=curve, columns=columns))
    assert run.cut.tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("strain", "block", "largest"), [(0, 0.3, 5.5e-3), (1, 0.3, 6e-4), (0, np.inf, 6e-4)]
)
def test_the_error_of_the_mesh_is_larger_where_a_block_yields_in_plane_stress(
    strain, block, largest
):
    """`mesh_excess`, which the law is corrected by, is of elements of 2 %R."""
    x = np.array([0.05, 1.0, 3.0])
    error = dataset._mesh_error(Numbers(strain, 0.5, 0.4, 0.4, 0.005, np.inf, block), x)
    assert error[0] == 6e-4
    assert error[-1] == pytest.approx(largest, rel=0.1)


def test_the_law_keeps_its_expected_error_beside_the_dataset():
    """Nine in ten errors of P of each kind of joints, whose own errors count, too: also of pins
    that yield in plane stress, whose steps matter."""
    with (FOLDER / "joints.csv").open() as file:
        joints = {
            row["joint"]: Numbers(*(float(row[name]) for name in NUMBERS))
            for row in csv.DictReader(file)
        }
    with (FOLDER / "curves.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["way"] == "loading"]
    inside = defaultdict(list)
    for joint, of_joint in groupby(rows, itemgetter("joint")):
        numbers = joints[joint]
        names = ("delta/dR", "P/(E* dR)", "error of P/(E* dR)")
        x, P, error = np.array([[float(row[name]) for name in names] for row in of_joint]).T
        state = law_of_numbers(numbers).at(x, 0 * x)
        strain, *_, pin, block = numbers
        later = x >= 0.8 * first_yield(
            elastic_model(), bool(strain), Elastic(*numbers[1:5]), min(pin, block)
        )
        keeps = np.abs(state.load - P) <= np.hypot(state.error, error)
        inside[strain, pin < block, min(pin, block) < 0.6] += keeps[later].tolist()
    shares = {kind: np.mean(kept) for kind, kept in inside.items()}
    assert len(shares) == 8
    assert min(shares.values()) > 0.85, shares


def test_a_folder_that_cannot_be_is_refused(tmp_path, refused):
    (tmp_path / "file").touch()
    said = refused(["dataset", "--joints", "1", "-o", str(tmp_path / "file")])
    assert "cannot hold a dataset: File exists" in said

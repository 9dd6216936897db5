"""The benchmark of asked, estimated and true errors."""

from archord.benchmarks.case import write_table
from archord.benchmarks.cost.accuracy import CASES, open_joint, run


def test_a_case_is_solved_and_judged(tmp_path):
    """One coarse accuracy of the paper's joint: the true error lies between nothing and the
    estimate."""
    (row,), faults = run(tmp_path / "runs", [open_joint("quick", 2)], print, [0.01])
    assert 0 < float(row["true"]) < float(row["estimated"]) <= 0.01
    assert faults == []
    text, files = write_table(tmp_path, "accuracy", [row])
    assert text.count("\n") == 3
    assert all(file.read_text().count("quick") == 1 for file in files)


def test_every_case_leaves_its_mesh_open():
    assert all(
        case.scene.analysis.accuracy and case.scene.joint.element_size is None for case in CASES
    )
    assert {case.scene.plastic for case in CASES} == {True, False}

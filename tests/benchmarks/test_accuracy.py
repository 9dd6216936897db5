"""The benchmark of asked, estimated and true errors."""

from dataclasses import replace

from archord.benchmarks.cost.accuracy import CASES, open_joint, run, write


def test_a_case_is_solved_and_judged(tmp_path):
    """One coarse accuracy of the paper's joint: the true error lies between nothing and the estimate."""
    (line,) = run(tmp_path / "runs", [open_joint("quick", 2)], asked=[0.01])
    assert 0 < line.true_error < line.accuracy.estimated <= 0.01
    assert line.fault() is None
    text, files = write([line], tmp_path)
    assert text.count("\n") == 3
    for file in files:
        assert file.read_text().count("quick") == 1
    assert replace(line, true_error=0.02).fault() == "quick: the error is 2.0e-02, 0.01 was asked"


def test_every_case_leaves_its_mesh_open():
    assert all(case.scene.analysis.accuracy and case.scene.joint.element_size is None for case in CASES)
    assert {case.scene.plastic for case in CASES} == {True, False}

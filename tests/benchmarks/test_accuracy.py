"""The benchmark of asked, estimated and true errors."""

from archord.benchmarks.cost.accuracy import CASES, Case, markdown, run, write_report


def test_a_case_is_solved_and_judged(tmp_path):
    """One coarse accuracy of the paper's joint: the true error lies between nothing and the estimate."""
    (line,) = run(tmp_path / "runs", (Case("quick", 2, (0.01,)),))
    assert 0 < line.true_error < line.accuracy.estimated <= 0.01
    assert line.fault() is None
    assert markdown([line]).count("\n") == 3
    for file in write_report([line], tmp_path):
        assert file.read_text().count("quick") == 1
    worse = type(line)(line.case, line.accuracy, 0.02)
    assert worse.fault() == "quick: the error is 2.0e-02, 0.01 was asked"


def test_every_case_is_a_scene():
    """At every accuracy that is asked, with a mesh left open."""
    scenes = [case.scene(asked) for case in CASES for asked in case.asked]
    assert all(scene.analysis.accuracy for scene in scenes)
    assert {scene.plastic for scene in scenes} == {True, False}

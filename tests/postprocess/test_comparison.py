"""Runs against each other."""

import numpy as np
import pytest

from archord.benchmarks.case import E, paper_joint
from archord.cli import run as command
from archord.postprocess.comparison import compare_runs, differing_keys, short_names
from archord.postprocess.curve import RunCurve
from archord.postprocess.run import Run
from archord.scene.errors import InputError
from tests.output.run_files import solved


@pytest.fixture(scope="module")
def more(tmp_path_factory):
    """The joint of "coarse" in millimetres and MPa, with other steps, and pressed and let go."""
    solid = {"E": E * 1e5, "nu": 0.3}
    units = {"length": "mm", "stress": "MPa"}
    joint = {"radius": 20.0, "clearance": 0.1, "element_size": 3.0}
    scenes = {
        "scaled": paper_joint(0.15, 6, units=units, joint=joint, pin=solid, block=solid),
        "stepped": paper_joint(0.15, 4),
        "released": paper_joint(0.15, 4, load={"displacement": [2.0, 1.0], "steps": [4, 2]}),
    }
    return solved(scenes, tmp_path_factory.mktemp("more"))


def test_a_run_does_not_differ_from_itself(runs, capsys):
    """Not in a digit, a key or a version; and the command says so."""
    run = Run(runs["plastic"])
    comparison = compare_runs([run, run])
    assert comparison.step_by_step
    assert not comparison.dimensionless
    assert [part.quantity for part in comparison.absolute] == ["P", "p0", "eps"]
    for part in comparison.absolute:
        assert (part.relative == 0).all()
        assert not part.interpolated.any()
        np.testing.assert_array_equal(part.values[1], run.history[part.quantity])
    assert differing_keys([run.scene, run.scene]) == {}
    assert command(["compare", str(run.folder), str(run.folder), "--no-pictures"]) == 0
    printed = capsys.readouterr().out
    assert printed.count("largest difference") == 3
    assert "scenes: the same in every key" in printed
    assert set(word for word in printed.split() if word.endswith("%")) == {"%"}
    assert {printed.split()[k - 1] for k, word in enumerate(printed.split()) if word == "%"} == {"0"}


def test_the_same_joint_in_other_units_is_the_same_in_dimensionless_form(runs, more):
    """R, dR and E* differ by factors: dimensionless curves do not, and absolute ones are not compared across units."""
    comparison = compare_runs([Run(runs["coarse"]), Run(more["scaled"])])
    assert len(comparison.dimensionless) == 3
    for part in comparison.dimensionless:
        assert part.largest[1] < 1e-8, part.quantity
    keys = differing_keys([run.scene for run in comparison.runs])
    assert keys["joint.radius"] == ["1.0", "20.0"]
    assert "block.nu" not in keys
    absolute = comparison.absolute  # the paper's joint names its units mm and MPa, too
    assert all(part.largest[1] > 0.1 for part in absolute if part.quantity != "eps")


def test_other_steps_are_interpolated(runs, more):
    """Exactly at common displacements, and to a percent and between the neighbours elsewhere."""
    comparison = compare_runs([Run(runs["coarse"]), Run(more["stepped"])])
    assert not comparison.step_by_step
    steps = Run(more["stepped"]).curve
    for part in comparison.absolute:
        assert part.load[0] >= steps.delta[0]
        at_step = np.isclose(part.load[:, None], steps.delta, rtol=1e-9).any(axis=1)
        np.testing.assert_array_equal(part.interpolated[1], ~at_step)
        assert np.abs(part.relative[1, at_step]).max() < 1e-8
        assert np.abs(part.relative[1]).max() < (0.02 if part.quantity == "eps" else 0.01)
        values = getattr(steps, part.quantity)
        assert part.values[1].min() >= values.min()
        assert part.values[1].max() <= values.max()


def test_unloading_counts_only_where_the_ways_are_the_same(runs, more):
    """Against itself step by step, against another run up to the first unloading."""
    released = Run(more["released"])
    assert (compare_runs([released, released]).absolute[0].relative == 0).all()
    assert len(compare_runs([released, released]).absolute[0].load) == 6
    for pair in ([Run(more["stepped"]), released], [released, Run(more["stepped"])]):
        force = compare_runs(pair).absolute[0]
        assert len(force.load) == 4
        assert force.largest[1] < 1e-8


def test_the_first_loading_ends_where_the_pin_goes_back(runs):
    """Also if it later goes further than before; runs that share no range of it are not compared."""
    delta = np.array([1.0, 2.0, 3.0, 2.0, 1.0, 4.0])
    curve = RunCurve("x", paper_joint(), *5 * [delta])
    assert list(curve.first_loading().P) == [1, 2, 3]
    near, far = Run(runs["coarse"]), Run(runs["coarse"])
    far.curve = curve
    with pytest.raises(InputError, match="shares no range of displacements"):
        compare_runs([near, far])


def test_nothing_has_no_relative_difference(runs):
    """Round-off over round-off says nothing: no difference where both are nothing, none known where one is."""
    part = compare_runs([Run(runs["coarse"])] * 2).absolute[0]
    values = np.array([[1e-14, 0.0, 1.0, 2.0], [-1e-14, 0.5, 1.1, 2.0]])
    changed = type(part)("P", "N", "delta", np.arange(4.0), values, np.zeros((2, 4), dtype=bool))
    np.testing.assert_allclose(changed.relative[1], [0, np.nan, 0.1, 0], atol=1e-12)
    assert changed.largest[1] == pytest.approx(0.1)


def test_names_are_short_and_different(tmp_path):
    """What all paths begin with is left out."""
    names = short_names([tmp_path / "a" / "run", tmp_path / "b" / "run", tmp_path / "b" / "run"])
    assert names == ["a/run", "b/run (1)", "b/run (2)"]
    assert short_names([tmp_path / "a", tmp_path / "c"]) == ["a", "c"]


def test_compare_draws_and_tells_the_difference(runs, more, tmp_path, capsys):
    """Absolute and dimensionless tables, the keys, and a picture."""
    target = tmp_path / "compared.png"
    assert command(["compare", str(runs["coarse"]), str(more["scaled"]), "-o", str(target)]) == 0
    printed = capsys.readouterr().out
    assert "P/(E* dR)" in printed
    assert "joint.radius" in printed
    assert printed.endswith(f"{target}\n")
    assert target.read_bytes()[1:4] == b"PNG"

"""Runs against each other."""

from dataclasses import replace

import numpy as np
import pytest

import archord
from archord.benchmarks.case import E, paper_joint
from archord.cli import run as command
from archord.postprocess.comparison import compare_runs, differing_keys
from archord.postprocess.curve import RunCurve, first_loading
from archord.postprocess.run import Run
from archord.postprocess.tables import comparison_text
from archord.report.errors import InputError
from archord.scene.file import parse_any
from tests.output.run_files import solved


@pytest.fixture(scope="module")
def more(tmp_path_factory):
    """The joint of "coarse" 20 times as large and 1e5 times as stiff, with other steps, and pressed
    and let go."""
    solid = {"E": E * 1e5, "nu": 0.3}
    joint = {"radius": 20.0, "clearance": 0.1, "element_size": 3.0}
    scenes = {
        "scaled": paper_joint(0.15, 6, joint=joint, pin=solid, block=solid),
        "stepped": paper_joint(0.15, 4),
        "released": paper_joint(0.15, 4, load={"displacement": [2.0, 1.0], "steps": [4, 2]}),
    }
    return solved(scenes, tmp_path_factory.mktemp("more"))


def test_a_run_does_not_differ_from_itself(runs, capsys):
    """Not in a digit, a key or a version; and the command says so."""
    run = Run(runs["plastic"])
    comparison = compare_runs([run, run])
    assert comparison.step_by_step
    assert comparison.labels["P"] == "P [N/mm]"
    assert not comparison.interpolated.any()
    for name, values in comparison.values.items():
        assert (comparison.relative(name) == 0).all()
        np.testing.assert_array_equal(values[1], run.history[name])
    assert differing_keys([run.scene, run.scene]) == {}
    assert command(["compare", str(run.folder), str(run.folder), "--no-pictures"]) == 0
    words = capsys.readouterr().out.split()
    assert {words[k - 1] for k, word in enumerate(words) if word == "%"} == {"0"}
    assert words.count("largest") == 3


def test_the_same_joint_larger_and_stiffer_is_the_same_in_dimensionless_form(
    runs, more, tmp_path, capsys
):
    """R, dR and E* differ by factors: dimensionless curves do not. The command tells both, and
    draws them."""
    comparison = compare_runs([Run(runs["coarse"]), Run(more["scaled"])])
    assert comparison.labels["P"] == "P/(E* dR)"
    for name in comparison.values:
        assert np.abs(comparison.relative(name)).max() < 1e-8, name
    target = tmp_path / "compared.png"
    assert command(["compare", str(runs["coarse"]), str(more["scaled"]), "-o", str(target)]) == 0
    printed = capsys.readouterr().out
    assert "P/(E* dR): coarse" in printed
    assert ["joint.radius", "1.0", "20.0"] in map(str.split, printed.splitlines())
    assert "block.nu" not in printed
    assert printed.endswith(f"{target}\n")
    assert target.read_bytes()[1:4] == b"PNG"


def test_other_steps_are_interpolated(runs, more):
    """Exactly at common displacements, and to a percent and between the neighbours elsewhere."""
    comparison = compare_runs([Run(runs["coarse"]), Run(more["stepped"])])
    steps = Run(more["stepped"]).curve
    assert not comparison.step_by_step
    at_step = np.isclose(comparison.load[:, None], steps.delta, rtol=1e-9).any(axis=1)
    np.testing.assert_array_equal(comparison.interpolated[1], ~at_step)
    for name, values in comparison.values.items():
        relative = np.abs(comparison.relative(name)[1])
        own = getattr(steps, name)
        assert relative[at_step].max() < 1e-8
        assert relative.max() < (0.02 if name == "eps" else 0.01)
        assert own.min() <= values[1].min() <= values[1].max() <= own.max()


def test_unloading_counts_only_where_the_ways_are_the_same(runs, more):
    """Against itself step by step; against another run up to where the pin first goes back, also if
    it later goes further than before; runs that share no range of that are not compared."""
    released = Run(more["released"])
    stepped = Run(more["stepped"])
    assert len(compare_runs([released, released]).load) == 6
    for pair in ([stepped, released], [released, stepped]):
        comparison = compare_runs(pair)
        assert len(comparison.load) == 4
        assert np.abs(comparison.relative("P")).max() < 1e-8
    delta = np.array([1.0, 2.0, 3.0, 2.0, 1.0, 4.0])
    assert list(delta[first_loading(delta)]) == [1, 2, 3]
    stepped.curve = RunCurve("x", paper_joint(), *5 * [delta])
    with pytest.raises(InputError, match="shares no range of loads"):
        compare_runs([released, stepped])
    there = np.array([1.0, 2.0, 1.0])
    lower = np.array([1.0, 2.0, 0.3])
    released.curve = RunCurve("x", paper_joint(), there, *4 * [lower])
    for values in compare_runs([released, released]).values.values():
        np.testing.assert_allclose(values / values[:, :1], [lower, lower], rtol=1e-15)


def test_nothing_has_no_relative_difference(runs):
    """Round-off over round-off says nothing: no difference where both are nothing, none known where
    one is."""
    values = np.array([[1e-14, 0.0, 1.0, 2.0], [-1e-14, 0.5, 1.1, 2.0]])
    changed = replace(compare_runs([Run(runs["coarse"])] * 2), values={"P": values})
    np.testing.assert_allclose(changed.relative("P")[1], [0, np.nan, 0.1, 0], atol=1e-12)
    turned = replace(changed, values={"P": -values})
    np.testing.assert_array_equal(turned.relative("P"), changed.relative("P"))


def test_runs_under_a_force_are_compared_by_the_displacement(tmp_path):
    """Not by the force, which the load prescribes: three times the force moves a body three times
    as stiff as far."""
    runs = []
    for name, modulus in (("soft", 70000.0), ("stiff", 210000.0)):
        lug = {"radius": 10.0, "clearance": 0.1, "width": 40.0, "element_size": 3.0}
        steel = {"E": modulus, "nu": 0.3}
        load = {"force": modulus / 140, "steps": 2}
        scene = parse_any({"lug": lug, "pin": steel, "plate": steel, "load": load})
        runs.append(archord.solve(scene, tmp_path / name))
    found = compare_runs(runs)
    assert "pull force" not in found.values
    np.testing.assert_allclose(found.relative("pull displacement")[1], 0.0, atol=1e-6)
    np.testing.assert_allclose(found.relative("pin in lug largest pressure")[1], 2.0, rtol=1e-6)
    told = comparison_text(found)
    assert "compared at equal load factors, at which 'pull' differs from run to run" in told
    assert "went through the same loads" not in told
    assert "went through the same loads" in comparison_text(compare_runs(runs[:1] * 2))


def test_a_press_fit_is_compared_from_its_end_on(tmp_path):
    """A bushing that is pressed in and one that is not, under the same displacements: the stage of
    the fit is none of the loads'."""
    runs = []
    for name, bore in (("loose", 14.0), ("pressed", 13.98)):
        steel = {"E": 210000.0, "nu": 0.3}
        scene = parse_any(
            {
                "bushing": {"radius": 10.0, "element_size": 3.0, "growth": 0.5},
                "pin": steel,
                "sleeve": [{"bore": 10.05, "outer": 14.0} | steel],
                "housing": {"bore": bore, "outer": 30.0} | steel,
                "load": {"displacement": 0.2, "steps": 2},
            }
        )
        runs.append(archord.solve(scene, tmp_path / name))
    found = compare_runs(runs)
    assert [run.steps for run in runs] == [2, 3]
    assert found.labels["load"] == "load factor, after press fits"
    assert found.step_by_step
    np.testing.assert_allclose(found.load, [0.5, 1.0])
    for values, run in zip(found.values["pull force"], runs, strict=True):
        np.testing.assert_array_equal(values, run.columns["pull force"][-2:])
    assert compare_runs(runs[1:] * 2).labels["load"] == "load factor"


def test_joints_under_the_same_forces_are_compared_by_the_displacement(tmp_path):
    """At the forces, step by step, unloading included: twice as stiff a joint goes as deep under
    twice the force. With one that a displacement loads it is P over delta as ever."""
    load = {"displacement": None, "relative_force": [0.004, 0.002], "steps": 2}
    stiff = {"E": 2 * E, "nu": 0.3}
    scenes = {"soft": paper_joint(0.2, load=load), "pressed": paper_joint(0.2, 8)}
    scenes["same"] = paper_joint(0.2, load=load, pin=stiff, block=stiff)
    soft, pressed, same = (Run(folder) for folder in solved(scenes, tmp_path).values())
    found = compare_runs([soft, same])
    assert found.step_by_step
    assert list(found.labels) == ["load", "delta", "p0", "eps"]
    assert found.labels["load"] == "P/(E* dR)"
    assert np.abs(found.relative("delta")).max() < 1e-6
    assert list(compare_runs([soft, pressed]).values) == ["P", "p0", "eps"]
    assert (
        command(["compare", str(soft.folder), str(same.folder), "-o", str(tmp_path / "x.png")]) == 0
    )

"""A joint of a given thickness is the joint per unit thickness, its forces that many times as
large."""

import pytest

import archord
from archord.benchmarks.case import paper_joint
from archord.cli import run as command
from archord.postprocess.decks.deck import deck, system_of
from archord.postprocess.decks.mesh import deck_mesh
from archord.postprocess.pictures.joint import force_panel
from archord.postprocess.tables import run_text
from archord.presets.views import view_of
from archord.report.figure import new_figure
from tests.output.run_files import solved
from tests.postprocess.test_probe import solved as lug

THICK = 8.0


def test_forces_of_a_thick_joint_are_said_in_their_own_unit(tmp_path):
    """N where they were N/mm; what is dimensionless, the curve and the second axis of the picture
    stay."""
    scenes = {str(t): paper_joint(0.2, 2, 0.002, analysis={"thickness": t}) for t in (None, THICK)}
    thin, thick = (archord.load(folder) for folder in solved(scenes, tmp_path).values())
    assert (thin.units["P"], thick.units["P"]) == ("N/mm", "N")
    assert abs(thick.columns["P"][-1] / thin.columns["P"][-1] / THICK - 1) < 1e-9
    assert thin.columns["peeq_integral"][-1] > 0
    for name in (name for name in thin.columns if "/" in name):
        assert thick.columns[name] == pytest.approx(thin.columns[name], rel=1e-7), name
    for run in (thin, thick):
        text = run_text(run)
        P = run.columns["P"][-1]
        assert f"P [{run.units['P']}]" in text
        assert f"P = {P:.6g} {run.units['P']} at step 2" in text
        assert run.history.attrs["units"]["peeq_integral"] == ("mm2" if run is thin else "mm3")
        axes = new_figure(4, 4).subplots()
        force_panel(axes, run)
        axes.figure.draw_without_rendering()
        assert axes.get_ylabel() == f"P [{run.units['P']}]"
        second = next(axis for axis in axes.child_axes if axis.get_ylabel())
        assert (
            abs(second.get_ylim()[1] / axes.get_ylim()[1] * P / run.columns["P/(E* R)"][-1] - 1)
            < 1e-9
        )
    last = {name: values[-1] for name, values in thick.columns.items()}
    compared = view_of(thick.scene).quantities(last)
    assert abs(compared["P/(E* R)"] / thick.columns["P/(E* R)"][-1] - 1) < 1e-9
    assert command(["compare", str(thin.folder), str(thick.folder), "--no-pictures"]) == 0


def test_a_deck_under_force_pulls_a_slice_of_half_the_joint():
    """The force on the whole, over its thickness and 2, times that of the slice."""
    for t in (None, THICK):
        for plane in ("strain", "stress"):
            load = {"displacement": None, "force": 0.004 * (t or 1.0), "steps": 2}
            scene = paper_joint(0.2, load=load, analysis={"thickness": t, "plane": plane})
            system = system_of(scene)
            text = deck(system, deck_mesh(system), scene.targets)
            slice_of = float(text.splitlines()[1].partition("thickness ")[2].partition(",")[0])
            forces = [
                float(block.splitlines()[1].split(",")[2]) for block in text.split("*CLOAD")[1:]
            ]
            assert abs(forces[-1] / (0.004 / 2 * slice_of) - 1) < 1e-9
            assert (slice_of == 1) == (plane == "strain")


def test_general_runs_of_other_units_of_force_are_not_compared(tmp_path, refused):
    """N beside N/mm."""
    runs = [lug(tmp_path / str(t), 3.0, 0.1, {"thickness": t}) for t in (None, THICK)]
    assert (
        abs(runs[1].columns["pull force"][0] / runs[0].columns["pull force"][0] / THICK - 1) < 1e-9
    )
    assert "pull force [N]" in run_text(runs[1])
    assert "has other units" in refused(["compare", *(str(run.folder) for run in runs)])
    assert abs(runs[1].probe("hole").force / runs[0].probe("hole").force - 1) < 1e-9

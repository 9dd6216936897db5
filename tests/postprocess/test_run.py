"""A run from Python is what its files hold; gaps are drawn as many times as wide as displacements
are."""

import csv
import shutil
from dataclasses import replace
from functools import partial

import numpy as np
import pandas as pd
import pytest

import archord
from archord.benchmarks.case import paper_joint
from archord.postprocess.arrays.fields import BODIES
from archord.postprocess.chord import read_chord_pressure
from archord.postprocess.export import export_csv
from archord.postprocess.pictures.joint import magnification, magnified
from tests.output.run_files import rewrite_report


def test_the_history_is_history_csv(runs):
    """Every column and number, whole numbers whole, units from the headings."""
    run = archord.load(runs["plastic"])
    with (runs["plastic"] / "history.csv").open(newline="") as file:
        headings, *rows = csv.reader(file)
    names = [heading.split(" [")[0] for heading in headings]
    units = run.history.attrs["units"]
    assert list(run.history) == names
    np.testing.assert_array_equal(run.history.to_numpy(), np.array(rows, dtype=float))
    assert run.history["iterations"].dtype.kind == "i"
    assert [f"{name} [{units[name]}]" if name in units else name for name in names] == headings
    assert (run.status, run.steps) == ("done", len(rows))
    assert run.summary["totals"]["newton_iterations"] == run.history["iterations"].sum()


@pytest.mark.parametrize("name", ["elastic", "plastic"])
def test_the_fields_are_those_of_the_scene(runs, name):
    """The axis stays, the pin's top goes down by delta, the block's top is held; PEEQ only where a
    body can yield."""
    run = archord.load(runs[name])
    fields = run.fields(3)
    (x, y) = fields.coordinates.T
    (ux, uy) = fields.displacement.T
    pin = fields.body_of_node == BODIES["pin"]
    assert fields.delta == pytest.approx(run.history["delta"][2], rel=1e-11)
    assert np.abs(ux[np.abs(x) < 1e-12]).max() < 1e-14
    np.testing.assert_allclose(
        uy[pin & (np.abs(y + run.scene.joint.dR) < 1e-12)], -fields.delta, rtol=1e-12
    )
    assert np.abs(fields.displacement[~pin & (np.abs(y) < 1e-12)]).max() == 0
    assert (fields.peeq is not None) == run.scene.plastic
    assert set(fields.cell) >= {"von_mises", "mean_stress", "contact_pressure"}


def test_the_contact_lies_on_the_deformed_outline(runs):
    """Undeformed points of the table, displaced, are on the boundary of the deformed mesh, as
    curved as that."""
    run = archord.load(runs["elastic"])
    fields = run.fields()
    R = run.scene.joint.radius
    t = np.linspace(0, 1, 41)
    shape = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=1)
    outline = (shape @ fields.deformed[fields.outline()]).reshape(-1, 2)
    outline = outline[np.hypot(*outline.T) < 2]
    for side, depth in (("pin", run.scene.joint.dR), ("hole", 0.0)):
        table = run.pressure(side=side)
        deformed = table[["x", "y"]].to_numpy() + table[["ux", "uy"]].to_numpy()
        assert (
            np.linalg.norm(deformed[:, None] - outline, axis=2).min(axis=1).max() < 0.1 / 40
        )  # half a sample of it
        np.testing.assert_allclose(
            np.hypot(table["x"], table["y"] + depth), run.contact()[side].radius, rtol=1e-12
        )
    normal = np.stack([np.sin(table["angle"]), -np.cos(table["angle"])], axis=1)
    touching = (table["raw_pressure"] > 0).to_numpy()
    assert (deformed * normal).sum(axis=1)[touching].min() > R  # the hole is pushed outward


def test_what_a_run_does_not_have(runs):
    """A sentence."""
    run = archord.load(runs["elastic"])
    asked = [(run.fields, 0), (run.pressure, 7), (partial(read_chord_pressure, run.folder), 7)]
    asked += [(run.pressure, 1, "block"), (partial(read_chord_pressure, run.folder), 1, "block")]
    for ask, *arguments in asked:
        said = (
            "side 'block'; its sides are pin, hole"
            if arguments[1:]
            else f"step {arguments[0]}; its accepted steps are"
        )
        with pytest.raises(archord.InputError, match=f"has no {said}"):
            ask(*arguments)


def test_a_step_that_the_fields_do_not_hold_yet(runs, tmp_path):
    """history.csv of another moment than fields.h5: no numbers that were never written."""
    shutil.copytree(runs["coarse"], tmp_path / "run")
    shutil.copy(runs["plastic"] / "history.csv", tmp_path / "run")
    rewrite_report(tmp_path / "run", files={}, status="running", steps=[])
    run = archord.load(tmp_path / "run")
    assert run.steps == 8
    with pytest.raises(
        archord.InputError, match=r"fields\.h5: cannot be read as the fields of a run at step 8\."
    ):
        run.fields()
    with pytest.raises(
        archord.InputError, match=r"contact\.h5: cannot be read as the contact of a run at step 8\."
    ):
        run.pressure()


@pytest.mark.parametrize("factor", [1.0, 5.0, 20.0])
def test_the_clearance_grows_by_the_factor(runs, factor):
    """Before loading the pin keeps its circle, touches at the bottom, and the hole's radius is R +
    factor dR. Factor 1 is the deformed mesh itself."""
    run = archord.load(runs["elastic"])
    fields = run.fields()
    (R, dR) = (run.scene.joint.radius, run.scene.joint.dR)
    x = magnified(run.scene, fields, factor, displaced=False)
    if factor == 1:
        np.testing.assert_allclose(x, fields.coordinates, atol=1e-14)
        np.testing.assert_allclose(magnified(run.scene, fields, 1.0), fields.deformed, atol=1e-14)
    down = np.array([0.0, -dR])
    pin = fields.body_of_node == BODIES["pin"]
    hole = ~pin & (np.abs(np.hypot(*fields.coordinates.T) - R - dR) < 1e-9)
    arc = pin & (np.abs(np.hypot(*(fields.coordinates - down).T) - R) < 1e-9)
    np.testing.assert_allclose(np.hypot(*x[hole].T), R + factor * dR, rtol=1e-12)
    np.testing.assert_allclose(np.hypot(*(x[arc] - factor * down).T), R, rtol=1e-12)
    assert x[arc, 1].min() == pytest.approx(x[hole, 1].min(), rel=1e-12)
    np.testing.assert_allclose(
        np.hypot(*magnified(run.scene, fields, 0.0)[arc | hole].T), R, rtol=1e-12
    )


@pytest.mark.parametrize("clearance", [1e-5, 1e-3, 0.05, 0.4])
def test_the_factor_shows_the_clearance_and_no_more(runs, clearance):
    """1 or more, never so large that clearance or displacement exceed a fifth of the radius as
    drawn."""
    scene = paper_joint(
        0.2,
        1,
        joint={"clearance": clearance},
        load={"displacement": 0.2 if clearance > 0.1 else 2.0},
    )
    fields = archord.load(runs["elastic"]).fields()
    times = clearance / 0.005
    scaled = replace(fields, displacement=times * fields.displacement, delta=times * fields.delta)
    factor = magnification(scene, scaled)
    assert factor >= 1
    if factor > 1:
        assert factor * clearance <= 0.1 * (1 + 1e-9)
        assert factor * np.abs(scaled.displacement).max() <= 0.2
        assert factor * clearance > 0.02


def test_a_table_of_points_has_the_shear_of_friction(tmp_path):
    """Which adds up to the force and is no larger than friction allows; in contact.csv,
    too."""
    problem = archord.Problem(
        archord.rectangles({"low": (0, 0, 3, 1), "high": (1, 1, 1, 1)}, size=0.5),
        [archord.Body(name, archord.Elastic(1e3, 0.3)) for name in ("low", "high")],
        [
            archord.Interaction(
                "rub", ("high bottom", "low top"), friction=0.2, integrated="high bottom"
            )
        ],
        supports=[archord.Support("low bottom")],
        loads=[
            archord.Load("press", on="high top", direction="y", displacement=[-0.01, -0.01]),
            archord.Load("slide", on="high top", direction="x", displacement=[0.0, 0.02]),
        ],
        steps=[1, 2],
    )
    run = archord.solve(problem, tmp_path / "run")
    table = run.pressure(side="high bottom")
    assert table.attrs["units"]["shear"] == run.scene.units.stress
    force = (table["shear"] * table["weight"]).sum()
    assert abs(force) == pytest.approx(abs(run.columns["rub force x"][-1]), rel=0.01)  # it tilts
    assert (table["shear"].abs() <= 0.2 * table["raw_pressure"] * (1 + 1e-9)).all()
    slides = table["sticks"] == 0
    assert table["slip"][slides & (table["raw_pressure"] > 0)].abs().min() > 0
    export_csv(run, tmp_path / "csv")
    assert {"slip [mm]", "shear [MPa]", "sticks"} <= {
        *pd.read_csv(tmp_path / "csv" / "contact.csv")
    }

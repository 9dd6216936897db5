"""A run from Python is what its files hold."""

import csv
import shutil

import numpy as np
import pytest

import archord
from archord.postprocess.chord import read_chord_pressure
from archord.postprocess.fields import BODIES


def test_the_history_is_history_csv(runs):
    """Every column and number, whole numbers whole, units from the headings."""
    run = archord.load(runs["plastic"])
    with (runs["plastic"] / "history.csv").open(newline="") as file:
        headings, *rows = csv.reader(file)
    names = [heading.split(" [")[0] for heading in headings]
    assert list(run.history) == names
    np.testing.assert_array_equal(run.history.to_numpy(), np.array(rows, dtype=float))
    assert run.history["iterations"].dtype.kind == "i"
    units = run.history.attrs["units"]
    assert [f"{name} [{units[name]}]" if name in units else name for name in names] == headings
    assert run.status == "done"
    assert run.steps == len(rows)
    assert run.summary["totals"]["newton_iterations"] == run.history["iterations"].sum()


@pytest.mark.parametrize("name", ["elastic", "plastic"])
def test_the_fields_are_those_of_the_scene(runs, name):
    """The axis stays, the pin's top goes down by delta, the block's top is held; PEEQ only where a body can yield."""
    run = archord.load(runs[name])
    fields, R = run.fields(3), run.scene.joint.radius
    x, u = fields.coordinates, fields.displacement
    assert fields.delta == pytest.approx(run.history["delta"][2], rel=1e-11)
    assert np.abs(u[np.abs(x[:, 0]) < 1e-12 * R, 0]).max() < 1e-14 * R
    pin = fields.body_of_node == BODIES["pin"]
    top = pin & (np.abs(x[:, 1] + run.scene.joint.dR) < 1e-12 * R)
    np.testing.assert_allclose(u[top, 1], -fields.delta, rtol=1e-12)
    assert np.abs(u[~pin & (np.abs(x[:, 1]) < 1e-12 * R)]).max() == 0
    assert (fields.peeq is not None) == run.scene.plastic
    assert set(fields.cell_fields()) >= {"von_mises", "mean_stress", "contact_pressure"}


def test_the_contact_lies_on_the_deformed_outline(runs):
    """Undeformed points of the table, displaced, are on the boundary of the deformed mesh, as curved as that."""
    run = archord.load(runs["elastic"])
    fields = run.fields()
    t = np.linspace(0, 1, 41)
    shape = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)], axis=1)
    outline = (shape @ fields.deformed[fields.outline()]).reshape(-1, 2)
    outline = outline[np.hypot(*outline.T) < 2]
    for side in ("pin", "hole"):
        table = run.pressure(side=side)
        points = table[["x", "y"]].to_numpy() + table[["ux", "uy"]].to_numpy()
        distance = np.linalg.norm(points[:, None] - outline, axis=2).min(axis=1)
        assert distance.max() < 0.1 / 40  # half a sample of the outline
        centre = [0.0, -run.scene.joint.dR if side == "pin" else 0.0]
        radius = np.hypot(*(table[["x", "y"]].to_numpy() - centre).T)
        np.testing.assert_allclose(radius, run.contact()[side].radius, rtol=1e-12)
    normal = np.stack([np.sin(table["angle"]), -np.cos(table["angle"])], axis=1)
    touching = (table["raw_pressure"] > 0).to_numpy()
    hole = table[["x", "y"]].to_numpy() + table[["ux", "uy"]].to_numpy()
    assert (hole[touching] * normal[touching]).sum(axis=1).min() > run.scene.joint.radius  # pushed outward


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda run: run.fields(0), r"has no step 0; its accepted steps are 1 to 6\."),
        (lambda run: run.pressure(7), r"has no step 7; its accepted steps are 1 to 6\."),
        (lambda run: run.pressure(1, "block"), r"has no side 'block'; its sides are pin, hole\."),
        (lambda run: read_chord_pressure(run.folder, 7), r"has no step 7; its accepted steps are 1 to 6\."),
        (lambda run: read_chord_pressure(run.folder, 1, "block"), r"has no side 'block'; its sides are pin, hole\."),
    ],
)
def test_what_a_run_does_not_have(runs, ask, said):
    """A sentence."""
    with pytest.raises(archord.InputError, match=said):
        ask(archord.load(runs["elastic"]))


def test_a_step_that_the_fields_do_not_hold_yet(runs, tmp_path):
    """history.csv of another moment than fields.h5: no numbers that were never written."""
    shutil.copytree(runs["coarse"], tmp_path / "run")
    shutil.copy(runs["plastic"] / "history.csv", tmp_path / "run")
    run = archord.load(tmp_path / "run")
    assert run.steps == 8
    with pytest.raises(archord.InputError, match=r"fields\.h5: cannot be read as the fields of a run at step 8\."):
        run.fields()
    with pytest.raises(archord.InputError, match=r"contact\.h5: cannot be read as the contact of a run\."):
        run.pressure()

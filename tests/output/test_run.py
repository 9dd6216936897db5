"""What a run leaves on disk."""

import json
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
from mpi4py import MPI

from archord import cli
from archord.output.folder import APART, CHECKPOINT, FILES, PICTURE, claim_folder
from archord.output.history import read_history
from archord.output.restart import plan_restart
from archord.output.run import solve_scene
from archord.output.run_json import peak_memory
from archord.postprocess.run import Run
from archord.report.errors import InputError
from archord.scene.file import load_scene, resolved
from tests.output.run_files import accepted_steps, same_run, solved
from tests.solver.solving import scene


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    outcome = solve_scene(scene(0.08, 4, yield_stress=0.002), folder, MPI.COMM_SELF)
    return outcome


def test_all_files_are_there_and_say_done(run):
    """The run folder of a finished run; counts of the steps add up to the totals."""
    assert sorted(p.name for p in run.folder.iterdir()) == sorted((*FILES, CHECKPOINT, APART))
    report = json.loads((run.folder / "run.json").read_text())
    steps = report["steps"]
    totals = report["totals"]
    assert report["status"] == "done"
    assert totals["accepted_steps"] == 4
    assert totals["newton_iterations"] == sum(m.iterations for m in run.steps)
    assert (
        sum(s["factorisations"] for s in steps)
        == totals["factorisations"]
        <= totals["newton_iterations"]
    )
    assert (
        sum(s["evaluations"] for s in steps)
        == totals["residual_evaluations"]
        > totals["newton_iterations"]
    )
    assert 8 < report["peak_memory"][0] / report["mesh"]["dofs"] < 8e6  # bytes
    assert len(report["peak_memory"]) == report["ranks"] == 1
    assert report["error_estimates"]["force_balance"] < 1e-8
    assert (
        report["error_estimates"]["newton_residual"]
        == max(s["residuals"][-1][-1] for s in steps)
        < 1e-10
    )
    assert {"archord", "dolfinx", "petsc", "mpi", "numpy", "python"} <= report["versions"].keys()
    assert (
        sum(s for name, s in report["seconds"].items() if name != "total")
        <= report["seconds"]["total"] * 1.001
    )


def test_a_run_without_fields_is_the_same_but_for_them(tmp_path):
    """The same curves, byte for byte but for the clock; nothing to draw, in one sentence."""
    solved({"with": scene(0.2, 2), "without": scene(0.2, 2, output={"fields": False})}, tmp_path)
    curves = [read_history(tmp_path / name / "history.csv") for name in ("with", "without")]
    for curve in curves:
        curve.pop("seconds")
    assert curves[0] == curves[1]
    there, here = ({p.name for p in (tmp_path / name).iterdir()} for name in ("with", "without"))
    assert there - here == {"fields.xdmf", "fields.h5", "fields"}
    assert not here - there
    with pytest.raises(
        InputError, match=r"without: has no fields: it was solved with output\.fields = false\."
    ):
        Run(tmp_path / "without").fields()


def test_history_holds_units_and_dimensionless_forms(run):
    """One row a step; P [N/mm] next to P/(E* R), equal as E* R = 1 here."""
    heading = (run.folder / "history.csv").read_text().splitlines()[0].split(",")
    assert heading[:8] == [
        "step",
        "delta [mm]",
        "delta/dR",
        "P [N/mm]",
        "P/(E* R)",
        "p0 [MPa]",
        "p0/E*",
        "eps [rad]",
    ]
    history = read_history(run.folder / "history.csv")
    assert history["delta/dR"] == pytest.approx([0.5, 1.0, 1.5, 2.0], rel=1e-11)
    assert history["P"] == pytest.approx(history["P/(E* R)"], rel=1e-11)
    assert history["P"] == pytest.approx([m["P"] for m in run.steps], rel=1e-11)
    assert history["cutbacks"] == [0, 0, 0, 0]


def test_fields_open_with_their_steps_in_order(run):
    """Second-order triangles, nodal displacement and cell fields at the four loads; symmetry axis
    at rest in x."""
    with meshio.xdmf.TimeSeriesReader(run.folder / "fields.xdmf") as reader:
        points, cells = reader.read_points_cells()
        assert [c.type for c in cells] == ["triangle6"]
        data = [reader.read_data(k) for k in range(reader.num_steps)]
    loads = [d[0] for d in data]
    assert loads == pytest.approx([m["delta"] for m in run.steps], rel=1e-12)
    u = data[-1][1]["displacement"]
    axis = points[:, 0] == 0
    assert axis.sum() > 5
    assert np.abs(u[axis, 0]).max() == 0
    last = {name: values[0] for name, values in data[-1][2].items()}
    assert set(last) == {
        "von_mises",
        "peeq",
        "mean_stress",
        "contact_state",
        "contact_pressure",
        "body",
    }
    assert last["von_mises"].max() <= 0.002 * (1 + 1e-9)
    assert 0 < last["peeq"].max() <= run.steps[-1]["peeq_max"]
    assert set(np.unique(last["body"])) == {1, 2}
    first = {name: values[0] for name, values in data[0][2].items()}
    assert 0 < (first["contact_state"] > 0).sum() < (last["contact_state"] > 0).sum()
    corner = cells[0].data[:, :3]
    middle = cells[0].data[:, 3:]
    chord = (points[corner] + points[np.roll(corner, -1, axis=1)]) / 2
    sides = np.linalg.norm(points[corner] - points[np.roll(corner, -1, axis=1)], axis=-1)
    assert (np.linalg.norm(points[middle] - chord, axis=-1) < 0.1 * sides).all()


def test_means_of_cells_integrate_to_the_whole(run):
    """PEEQ of the cells times their areas is the integral over the integration points, of both
    halves of the joint."""
    found = Run(run.folder)
    fields = found.fields()
    # the determinant of a curved triangle is quadratic: the middles of its edges integrate it
    slopes = np.array(
        [
            [[-1.0, 1.0, 0.0, 0.0, 0.0, 0.0], [-1.0, 0.0, -1.0, -2.0, 2.0, 2.0]],
            [[1.0, 1.0, 0.0, -2.0, 2.0, -2.0], [1.0, 0.0, 1.0, -2.0, 2.0, -2.0]],
            [[-1.0, -1.0, 0.0, 2.0, 2.0, -2.0], [-1.0, 0.0, 1.0, 0.0, 0.0, 0.0]],
        ]
    )
    x = fields.coordinates[fields.cells]
    area = np.linalg.det(np.einsum("qka,nai->nqki", slopes, x)).mean(axis=1) / 2
    integral = found.columns["peeq_integral"][-1]
    assert fields.peeq.max() > 1e-4
    assert 2 * np.abs(area) @ fields.peeq == pytest.approx(integral, rel=1e-10)
    # the pressure of a cell is a mean over its edge, near the largest one on the contact axis
    assert fields.contact_pressure.max() == pytest.approx(found.columns["p0"][-1], rel=0.1)
    assert fields.contact_state.max() == 1


def test_contact_file_integrates_to_the_force(run):
    """The projected pressure of each side carries the raw pressure's force; gaps are closed where
    it acts."""
    with h5py.File(run.folder / "contact.h5") as file:
        assert file["accepted"][()] == 4
        assert file["load"][()] == pytest.approx([m["delta"] for m in run.steps])
        for k in range(1, 5):
            for side in ("pin", "hole"):
                s = file[f"{side}/s"][()]
                w = file[f"{side}/weight"][()]
                p, raw, gap = (
                    file[f"{side}/{name}/{k:04d}"][()]
                    for name in ("pressure", "raw_pressure", "gap")
                )
                assert (np.diff(s.ravel()) > 0).all()
                assert (w * p).sum() == pytest.approx((w * raw).sum(), rel=1e-12)
                assert file[f"{side}/coordinates/{k:04d}"].shape == (*s.shape, 2)
                assert np.abs(gap[raw > 0]).max() < 0.05 * 0.005
                assert gap[-1, -1] > 0
            at = file["hole/coordinates/0001"][()]
            angle = np.arctan2(at[..., 0], -at[..., 1])
            assert angle == pytest.approx(file["hole/angle"][()], abs=0.003)


def test_the_resolved_scene_gives_the_same_numbers(run, tmp_path):
    """Solving runs/x/scene.toml again reproduces every row but the seconds."""
    solve_scene(load_scene(run.folder / "scene.toml"), tmp_path, MPI.COMM_SELF)
    a, b = (read_history(f / "history.csv") for f in (run.folder, tmp_path))
    del a["seconds"], b["seconds"]
    assert a == b


def test_a_stopped_run_keeps_its_accepted_steps_and_says_why(tmp_path):
    """Four of ten steps, then no convergence: all four readable; run.json has the residuals and
    active-set changes of every attempt at the fifth."""
    problem = scene(
        0.08, 10, yield_stress=0.002, analysis={"max_iterations": 5}, stepping={"minimum": 1.0}
    )
    assert solve_scene(problem, tmp_path, MPI.COMM_SELF).status == "stopped"
    assert accepted_steps(tmp_path) == 4
    report = json.loads((tmp_path / "run.json").read_text())
    assert report["status"] == "stopped"
    assert "no equilibrium at delta = 0.005" in report["message"]
    failed = report["failed_step"]
    assert failed["cutbacks"] == len([a for a in failed["attempts"] if not a["converged"]]) == 1
    last = failed["attempts"][-1]
    assert len(last["active_set_changes"]) == len(last["residuals"]) > 3
    assert sum(sum(a["active_set_changes"]) for a in failed["attempts"]) > 0


@pytest.mark.mpi
def test_ranks_write_the_same_files(tmp_path_factory, comm):
    """All numbers of all files of all ranks together equal those of one rank, in the same order."""
    folder = comm.bcast(tmp_path_factory.mktemp("ranks") if comm.rank == 0 else None)
    problem = scene(0.1, 2, yield_stress=0.002)
    if comm.rank == 0:
        solved({"one": problem}, folder)
        (folder / "all").mkdir()
    comm.barrier()
    solve_scene(problem, folder / "all", comm)
    if comm.rank == 0:
        same_run(folder / "one", folder / "all", 1e-9, 1e-7)


def test_an_elastic_run_carries_no_plastic_fields(tmp_path):
    """No PEEQ on disk, no PEEQ field, zero dissipation; a rigid pin has no pin side."""
    solve_scene(scene(0.1, 1, pin={"rigid": True}), tmp_path, MPI.COMM_SELF)
    with h5py.File(tmp_path / "fields.h5") as file:
        assert "peeq" not in file
        assert set(np.unique(file["mesh/body"][()])) == {2}
    with h5py.File(tmp_path / "contact.h5") as file:
        assert set(file) == {"accepted", "load", "hole"}
    assert read_history(tmp_path / "history.csv")["plastic_dissipation"] == [0]


def test_results_are_not_overwritten_by_accident(tmp_path):
    """An occupied folder needs force; a file is no folder."""
    claim_folder(tmp_path / "new", False)
    (tmp_path / "new" / "history.csv").write_text("kept")
    with pytest.raises(InputError, match=r"is not empty; .* --force"):
        claim_folder(tmp_path / "new", False)
    ends = {
        "running": "did not end, unless",
        "interrupted": "was interrupted",
        "stopped": "could not go on",
    }
    for status, said in ends.items():
        (tmp_path / "new" / "run.json").write_text(json.dumps({"status": status}))
        with pytest.raises(
            InputError, match=f"new: holds a run that {said}.*; continue it with --restart, or over"
        ):
            claim_folder(tmp_path / "new", False)
    claim_folder(tmp_path / "new", True)
    assert (tmp_path / "new" / "history.csv").read_text() == "kept"
    with pytest.raises(InputError, match="cannot be used for results: File exists"):
        claim_folder(tmp_path / "new" / "history.csv", True)


@pytest.mark.parametrize(("size", "load"), [(0.08, 1e-8), (0.2, 1e-7)])
def test_a_contact_smaller_than_the_mesh_can_see_stops_the_run(tmp_path, size, load):
    """Pressed by less than the first contact point's gap: no force but round-off, no success, and a
    sentence."""
    outcome = solve_scene(
        scene(size, steps=1, load={"displacement": load}), tmp_path, MPI.COMM_SELF
    )
    assert outcome.status == "stopped"
    assert "no contact point was ever pressed" in outcome.message
    assert "the contact is smaller than the mesh can see" in outcome.message


def test_a_contact_that_reaches_the_end_of_the_arc_is_named(tmp_path):
    """At 100 dR the whole arc touches; at 2 dR it does not."""
    for load, said in ((2.0, False), (100.0, True)):
        thin = scene(0.2, 2, joint={"clearance": 0.001}, load={"displacement": load})
        outcome = solve_scene(thin, tmp_path, MPI.COMM_SELF)
        assert (
            any(
                "contact reaches the end of the modelled quarter arc" in w for w in outcome.warnings
            )
            == said
        )


@pytest.mark.parametrize(
    "load", [{"displacement": -0.5}, {"displacement": None, "relative_force": 0.0}]
)
def test_bodies_that_never_touch_are_named(tmp_path, load, capfd):
    """Drawn apart, or not pressed at all: a warning in run.json and on the screen, and none of what
    is left of P, round-off."""
    scene_file = tmp_path / "apart.toml"
    folder = tmp_path / "run"
    scene_file.write_text(resolved(scene(0.3, 1, load=load)), encoding="utf-8")
    assert cli.run(["solve", str(scene_file), "-o", str(folder)]) == 0
    report = json.loads((folder / "run.json").read_text())
    assert (
        max(report["error_estimates"][name] for name in ("force_balance", "newton_residual")) < 1e-8
    )
    (warning,) = report["warnings"]
    assert warning.startswith("the bodies never touched: ")
    assert f"archord: warning: {warning}." in capfd.readouterr().err


def test_bodies_that_touch_after_all_are_not_said_to_be_apart(tmp_path):
    """A run that is extended loses the warning."""
    for load, start, apart in (([-0.5], None, True), ([-0.5, 1.0], plan_restart, False)):
        pulled = scene(0.3, 1, load={"displacement": load})
        outcome = solve_scene(
            pulled, tmp_path, MPI.COMM_SELF, start=start and start(tmp_path, pulled).start
        )
        assert any("never touched" in w for w in outcome.warnings) == apart


def test_arcs_too_rough_for_the_clearance_are_named(tmp_path):
    """Where the run says nothing, P of a rigid pin is within 3 % of that on elements half as
    long."""
    force = []
    said = []
    for size in (0.16, 0.08, 0.04, 0.02):
        thin = scene(
            size, 1, joint={"clearance": 1e-6}, pin={"rigid": True}, block={"E": 0.91, "nu": 0.3}
        )
        outcome = solve_scene(thin, tmp_path, MPI.COMM_SELF)
        force.append(outcome.steps[-1]["P"])
        said.append(any("too long for the clearance" in w for w in outcome.warnings))
    error = abs(np.array(force[:-1]) / force[-1] - 1)
    assert said == [True, True, False, False]
    assert error[0] > 0.1
    assert error[2] < 0.01


def test_memory_is_known_where_there_is_no_proc(monkeypatch):
    """What the process asks of the kernel is about what its file there says."""
    told = peak_memory()
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: "")
    assert peak_memory() == pytest.approx(told, rel=0.2)


def test_a_new_run_removes_the_picture_of_the_old_one(tmp_path):
    for name in (PICTURE, "notes.txt"):
        (tmp_path / name).touch()
    solve_scene(scene(0.3, 1), tmp_path, MPI.COMM_SELF)
    assert [name for name in (PICTURE, "notes.txt") if (tmp_path / name).exists()] == ["notes.txt"]


def test_keys_of_older_scenes_mean_the_same():
    """stress and points, which fields has taken the place of; together with it they are unknown."""

    def level(**output):
        return scene(0.25, 1, output=output).output.fields

    assert [level(), level(fields=True), level(fields=False), level(stress=True)] == [
        "cells",
        "cells",
        False,
        "nodes",
    ]
    assert [level(points=True), level(stress=False, points=False, fields=True)] == [
        "points",
        "cells",
    ]
    with pytest.raises(InputError, match=r"output\.stress = true is not a known key; .*fields"):
        level(fields="cells", stress=True)
    with pytest.raises(
        InputError,
        match=r"output\.fields = \"all\" must be false, 'cells', 'nodes' or 'points'",
    ):
        level(fields="all")


@pytest.mark.mpi
def test_the_fields_do_not_depend_on_the_ranks(comm, tmp_path_factory):
    """Mesh and values of a run on all ranks and on one."""
    folders = [
        comm.bcast(tmp_path_factory.mktemp("run") if comm.rank == 0 else None) for _ in range(2)
    ]
    for folder, c in zip(folders, (comm, MPI.COMM_SELF), strict=True):
        if c == comm or comm.rank == 0:
            solve_scene(scene(0.25, 1, output={"fields": "points"}), folder, c)
    if comm.rank == 0:
        whole, alone = (h5py.File(folder / "fields.h5") for folder in folders)
        for name in ("mesh/coordinates", "mesh/cells", "mesh/body", "points/coordinates"):
            np.testing.assert_allclose(whole[name], alone[name], atol=1e-14)
        for name in ("displacement", "contact_pressure", "cells/stress", "stress_xx"):
            values = alone[f"{name}/0001"][()]
            atol = 1e-9 * np.abs(values).max()
            np.testing.assert_allclose(whole[f"{name}/0001"], values, atol=atol)

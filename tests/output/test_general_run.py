"""A general scene solved into a run folder: a lug, loaded, let go, continued."""

import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.output.restart import plan_restart
from archord.output.run import solve_scene
from archord.postprocess.run import Run
from archord.report.errors import InputError
from archord.scene.file import parse_any
from archord.studies.accuracy import solve_to_accuracy

STEEL = {"E": 210000.0, "nu": 0.3}


def scene(steps: int = 3, thickness: float | None = None, **changes):
    shape = {
        "kind": "lug",
        "radius": 9.9,
        "clearance": 0.1,
        "width": 40.0,
        "edge_distance": 20.0,
        "length": 60.0,
    }
    data = {
        "mesh": {"shape": shape | {"element_size": 1.5, "growth": 0.6}},
        "body": [
            {"name": "pin"} | STEEL,
            {"name": "lug", "yield_stress": 355.0, "hardening": 2000.0} | STEEL,
        ],
        "interaction": [{"name": "contact", "surfaces": ["pin", "hole"]}],
        "support": [
            {"name": "clamp", "on": "clamp", "fixed": ["x", "y"]},
            {"name": "symmetry", "on": "axis", "fixed": ["y"]},
        ],
        "load": [{"name": "press", "on": "flat", "direction": "x", "displacement": [0.15, 0.1]}],
        "path": {"steps": [steps, 1]},
        "analysis": {"symmetry": 2} | ({"thickness": thickness} if thickness else {}),
    }
    return parse_any(data | changes, "lug.toml")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lug")
    outcome = solve_scene(scene(), folder, MPI.COMM_SELF)
    off = (
        "the work of the loads, a sum of trapezoids over accepted steps, and the energies stored "
        "and dissipated"
    )
    assert outcome.status == "done"
    assert outcome.warnings == [
        f"{off} differ by 1.7 % of the largest work: more steps bring them together"
    ]
    return Run(folder)


def test_forces_balance_and_work_is_kept(run):
    h = run.columns
    assert np.allclose(h["press force"], h["contact force x"], rtol=1e-8)
    assert np.allclose(h["press force"], np.negative(h["clamp x"]), rtol=1e-8)
    assert max(h["force_balance"]) < 1e-8
    assert h["press displacement"] == pytest.approx([0.05, 0.1, 0.15, 0.1])
    assert h["press force"][3] < h["press force"][1] < h["press force"][2]
    assert h["lug peeq_max"][2] > 1e-3
    assert h["plastic_dissipation"][2] == pytest.approx(h["plastic_dissipation"][3])
    assert run.summary["error_estimates"]["energy_balance"] < 0.05


def test_contact_is_told_with_its_place(run):
    h = run.columns
    assert h["contact arcs"] == [1, 1, 1, 1]
    assert np.hypot(h["contact at x"], h["contact at y"]) == pytest.approx(10, abs=0.11)
    assert 0 < h["contact contact length"][0] < h["contact contact length"][2] < np.pi * 10
    moved = np.array(h["press displacement"])
    assert (np.abs(h["contact largest slip"]) < moved).all()
    sides = run.contact(3).values()
    largest = max(np.abs(side.slip[side.raw_pressure > 0]).max() for side in sides)
    assert largest == pytest.approx(h["contact largest slip"][2])
    assert run.history.attrs["units"]["contact largest pressure"] == "MPa"


def test_thickness_makes_forces_of_the_whole(run, tmp_path):
    solve_scene(scene(thickness=12.0), tmp_path, MPI.COMM_SELF)
    thick = Run(tmp_path)
    for name in ("press force", "clamp moment", "work", "elastic_energy", "plastic_dissipation"):
        assert thick.columns[name] == pytest.approx(np.multiply(12, run.columns[name]), rel=1e-8)
    assert thick.columns["contact largest pressure"] == pytest.approx(
        run.columns["contact largest pressure"]
    )
    assert thick.history.attrs["units"]["press force"] == "N"


@pytest.mark.mpi
def test_ranks_agree(comm, tmp_path_factory):
    one, several = (
        Path(comm.bcast(str(tmp_path_factory.mktemp(name)))) for name in ("one", "several")
    )
    if comm.rank == 0:
        solve_scene(scene(), one, MPI.COMM_SELF)
    solve_scene(scene(), several, comm)
    comm.barrier()
    a = Run(one).columns
    b = Run(several).columns
    for name in a:
        if name not in ("seconds", "force_balance", "iterations"):
            assert b[name] == pytest.approx(
                a[name], rel=1e-9, abs=1e-9 * max(map(abs, a[name])) + 1e-12
            ), name


def pressed(*stages: float, steps: list[int]):
    load = {"name": "press", "on": "flat", "direction": "x", "displacement": list(stages)}
    return scene(load=[load], path={"steps": steps})


def test_a_run_goes_on_with_further_stages(tmp_path):
    """From the end of the first stage, as if there had been no end; not with another first
    stage."""
    for name in ("whole", "parts"):
        (tmp_path / name).mkdir()
    solve_scene(pressed(0.1, 0.15, 0.1, steps=[2, 1, 1]), tmp_path / "whole", MPI.COMM_SELF)
    parts = tmp_path / "parts"
    solve_scene(pressed(0.1, steps=[2]), parts, MPI.COMM_SELF)
    with pytest.raises(
        InputError,
        match=r'steps are not the first ones of the scene\'s path; load "press" .* and its steps',
    ):
        plan_restart(parts, pressed(0.12, 0.15, steps=[2, 1]))
    plan = plan_restart(parts, pressed(0.1, 0.15, 0.1, steps=[2, 1, 1]), extend=True)
    assert solve_scene(plan.scene, parts, MPI.COMM_SELF, start=plan.start).status == "done"
    whole, again = (Run(tmp_path / name).columns for name in ("whole", "parts"))
    for name in ("press force", "lug peeq_max", "work"):
        assert again[name] == pytest.approx(whole[name], rel=1e-9), name


def test_an_accuracy_is_reached_by_finer_meshes(tmp_path):
    """Of the force, against a mesh of three times as many dofs."""
    coarse = scene()
    fine = pressed(0.1, steps=[1])
    asked = coarse.model_copy(
        update={"analysis": coarse.analysis.model_copy(update={"accuracy": 3e-3})}
    )
    asked = asked.model_copy(update={"load": fine.load, "path": fine.path})
    outcome = solve_to_accuracy(asked, tmp_path, MPI.COMM_SELF)
    assert outcome.accuracy.estimated < 3e-3
    assert len(outcome.accuracy.levels) >= 2
    sizes = [level.element_size for level in outcome.accuracy.levels]
    assert sizes == sorted(sizes, reverse=True)
    assert outcome.steps[-1].values["press force"] == pytest.approx(3829.4, rel=0.03)


def test_an_accuracy_under_a_pressure_is_that_of_the_displacement(tmp_path):
    """What the pressure works on, the area that it displaces: the pressure itself is given."""
    oil = [{"name": "oil", "on": "hole", "pressure": 10.0}]
    shape = scene().mesh.shape.model_dump() | {"pin": "none", "element_size": 3.0}
    body = [{"name": "lug"} | STEEL]
    asked = scene(mesh={"shape": shape}, body=body, interaction=[], load=oil, path={"steps": 1})
    asked = asked.model_copy(
        update={"analysis": asked.analysis.model_copy(update={"accuracy": 1e-2})}
    )
    found = solve_to_accuracy(asked, tmp_path, MPI.COMM_SELF)
    assert 0 < found.accuracy.estimated < 1e-2
    assert found.accuracy.levels[-1].last == found.steps[-1].values["oil displacement"]


def test_another_load_is_refused(run):
    other = scene(
        load=[{"name": "pull", "on": "flat", "direction": "x", "displacement": 0.1}],
        path={"steps": 3},
    )
    with pytest.raises(
        InputError, match=r'was loaded by load "press" .*; load "pull" .* cannot continue it'
    ):
        plan_restart(run.folder, other, extend=True)


def test_another_core_is_refused(tmp_path):
    """The force would act elsewhere from there on."""

    def pushed(radius: float, *forces: float):
        core = {"centre": [0.0, 0.0], "radius": radius}
        push = {"name": "push", "on": "pin", "direction": "x", "force": list(forces), "core": core}
        return scene(load=[push], path={"steps": 1})

    solve_scene(pushed(2.0, 500.0), tmp_path, MPI.COMM_SELF)
    with pytest.raises(InputError, match=r'was solved with load = .*"radius": 2.0.*; only '):
        plan_restart(tmp_path, pushed(4.0, 500.0, 1000.0), extend=True)
    assert plan_restart(tmp_path, pushed(2.0, 500.0, 1000.0), extend=True).start


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"support": [{"name": "clamp", "on": "clam", "fixed": ["x"]}]},
            "support \"clamp\".on: there is no .* 'clam' .did you mean 'clamp'",
        ),
        (
            {"interaction": [{"name": "contact", "surfaces": ["pin", "bore"]}]},
            "interaction \"contact\".surfaces: there is no facet set 'bore'",
        ),
    ],
)
def test_a_set_that_is_not_there_is_named(changes, said, tmp_path):
    with pytest.raises(InputError, match=said):
        solve_scene(scene(**changes), tmp_path, MPI.COMM_SELF)


def test_what_never_touches_is_told(tmp_path):
    load = [{"name": "press", "on": "flat", "direction": "x", "displacement": -0.1}]
    outcome = solve_scene(scene(load=load, path={"steps": 1}), tmp_path, MPI.COMM_SELF)
    assert outcome.status == "done"
    assert "no surfaces ever touched" in outcome.warnings[-1]
    assert json.loads((tmp_path / "run.json").read_text())["warnings"] == outcome.warnings


def test_the_energies_of_soft_contact_count_from_the_first_step_on(tmp_path):
    """Surfaces that touch softly are pressed against each other before a load does any work."""
    mesh = archord.rectangles({"lower": (0, 0, 1, 1), "upper": (0, 1, 1, 1)}, size=0.5)
    soft = archord.Exponential(pressure=2.0, clearance=0.01)

    def imbalance(steps: int) -> float:
        problem = archord.Problem(
            mesh,
            bodies=[archord.Body(name, archord.Elastic(1e3, 0.0)) for name in ("lower", "upper")],
            interactions=[archord.Interaction("joint", ("lower top", "upper bottom"), law=soft)],
            supports=[archord.Support("lower bottom"), archord.Support("guide", "upper top", "x")],
            loads=[archord.Load("press", "upper top", "y", displacement=-0.02)],
            steps=steps,
        )
        run = archord.solve(problem, tmp_path, force=True)
        assert not any("work of the loads" in warning for warning in run.warnings)
        report = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))
        return report["error_estimates"]["energy_balance"]

    assert 10 * imbalance(20) < imbalance(4) < 0.005

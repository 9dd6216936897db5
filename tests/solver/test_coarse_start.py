"""A coarse start is a guess: it changes the way to the solution and nothing else."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from archord.benchmarks.case import paper_joint
from archord.geometry.curve import ProjectionError
from archord.output.run import solve_scene
from archord.presets import joint as preset
from archord.presets import mesh_family
from archord.scene.file import parse_any
from archord.scene.sections.analysis import Stepping
from archord.solver.path import coarse_start
from tests.solver.solving import SEVERAL, joint_system

SOFT = {"rigid": True}
SCENES = {
    "elastic": paper_joint(0.06, 2),
    "plastic": paper_joint(0.1, 4, yield_stress=0.002),
    "released": paper_joint(0.1, 1, 0.002, load={"displacement": [1.5, 1.0, -0.2, 1.2]}),
    "by force": paper_joint(0.08, 1, load={"displacement": None, "relative_force": 0.005}),
    "rigid pin": paper_joint(0.04, 2, pin=SOFT),
    "cubic": paper_joint(0.16, 2, analysis={"degree": 3}),
}


def start_from(dofs, monkeypatch):
    for fewest in ("_FEWEST_DOFS", "_FEWEST_STRESS"):
        monkeypatch.setattr(coarse_start, fewest, dofs)
    monkeypatch.setattr(preset, "_COARSEST", 0.3)


@pytest.fixture
def always(monkeypatch):
    start_from(1000, monkeypatch)


def run(scene, folder, comm=MPI.COMM_SELF):
    folder = comm.bcast(folder)
    if comm.rank == 0:
        folder.mkdir()
    comm.barrier()
    outcome = solve_scene(scene, folder, comm)
    assert outcome.status == "done", outcome.message
    return outcome.steps, json.loads((folder / "run.json").read_text())


@pytest.mark.parametrize("name", SCENES)
def test_the_solution_is_that_without_it(name, tmp_path, monkeypatch):
    """Forces, peak pressures and dissipation agree to the tolerance of Newton's method, in fewer
    fine iterations."""
    scene = SCENES[name]
    start_from(10**9, monkeypatch)
    plain, without = run(scene, tmp_path / "plain")
    start_from(1000, monkeypatch)
    guessed, report = run(scene, tmp_path / "guessed")
    assert sum(s["coarse_iterations"] for s in report["steps"]) > 0
    assert not any(s["coarse_iterations"] for s in without["steps"])
    for a, b in zip(plain, guessed, strict=True):
        for quantity in ("P", "p0", "plastic_dissipation", "elastic_energy"):
            largest = max(abs(m[quantity]) for m in plain)
            assert b[quantity] == pytest.approx(a[quantity], abs=1e-8 * largest + 1e-300)
    assert sum(m.iterations for m in guessed) < sum(m.iterations for m in plain)


@pytest.mark.parametrize(("name", "force"), [("joint", "P"), ("bushing", "pull force")])
def test_joints_in_space_have_one(name, force, tmp_path, monkeypatch):
    """Of tetrahedra, and of a shape with sleeves: the same forces in fewer iterations."""
    given = tomllib.loads(Path(f"scenes/{name}_in_space.toml").read_text(encoding="utf-8"))
    given["load"] |= {"steps": 2}
    if name == "joint":
        given["block"].pop("yield_stress")
        given["joint"] |= {"relative_element_size": 0.11}
    scene = parse_any(given)
    forces, iterations = [], []
    for fewest in (10**9, 0):
        monkeypatch.setattr(coarse_start, "_FEWEST_IN_SPACE", fewest)
        monkeypatch.setattr(mesh_family, "_COARSEST_GUESS", 1.0)
        steps, report = run(scene, tmp_path / str(fewest))
        assert (sum(s["coarse_iterations"] for s in report["steps"]) > 0) == (fewest == 0)
        forces.append([m[force] for m in steps])
        iterations.append(sum(m.iterations for m in steps))
    assert forces[1] == pytest.approx(forces[0], rel=1e-7)
    assert iterations[1] < iterations[0]


def test_iterations_hardly_grow_with_the_mesh(tmp_path):
    """Elastic, one step to 2 dR: as many on 31 thousand dofs as on 9 thousand, give or take one."""
    counts = []
    for k, size in enumerate((0.0275, 0.0135)):
        scene = paper_joint(size, 1, joint={"growth": 6 * size})
        steps, report = run(scene, tmp_path / str(k))
        assert report["mesh"]["dofs"] > 8000
        counts.append(steps[0].iterations)
    assert counts[1] <= counts[0] + 1 <= 6


def test_a_coarse_joint_that_fails_is_left_behind(tmp_path, monkeypatch, always):
    """The fine joint goes on by itself."""
    scene = paper_joint(0.1, 4, yield_stress=0.002)
    plain, _ = run(scene, tmp_path / "plain")
    make = preset._coarser
    few = {"max_iterations": 2}

    def coarser(given):
        made = make(given)
        return made.model_copy(update={"analysis": made.analysis.model_copy(update=few)})

    monkeypatch.setattr(preset, "_coarser", coarser)
    assert [m["P"] for m in run(scene, tmp_path / "left")[0]] == pytest.approx(
        [m["P"] for m in plain], rel=1e-8
    )


@pytest.mark.parametrize("fault", [ProjectionError("no closest point"), ValueError("no mesh")])
def test_a_mesh_too_coarse_for_the_contact_is_gone_without(fault, monkeypatch, always):
    """The fine joint is solved as if there were none."""
    joint = joint_system(SCENES["elastic"], MPI.COMM_SELF)
    asked = []

    def too_coarse(problem):
        asked.append(problem.mesh.mesh.topology.index_map(2).size_global)
        raise fault

    monkeypatch.setattr(coarse_start, "System", too_coarse)
    assert coarse_start.coarse_start(joint) is None
    assert len(asked) == 1
    assert asked[0] < joint.n_cells / 2


def test_cut_steps_take_the_coarse_joint_back_too(tmp_path, monkeypatch, always):
    """Where few iterations are allowed steps are cut, and both joints go the same way."""
    scene = paper_joint(0.1, 3, yield_stress=0.002, analysis={"max_iterations": 5})
    scene = scene.model_copy(update={"stepping": Stepping(minimum=0.01)})
    steps, _ = run(scene, tmp_path / "cut")
    assert sum(m.cutbacks for m in steps) > 0
    assert all(np.isfinite(m["P"]) for m in steps)


@pytest.mark.mpi
@pytest.mark.parametrize("name", ["elastic", "plastic", "rigid pin"] if SEVERAL else ["elastic"])
def test_ranks_find_the_same_guess(name, tmp_path, always):
    """On any number of ranks as on one: iterations, and P to the tolerance."""
    comm = MPI.COMM_WORLD
    together, _ = run(SCENES[name], tmp_path / "together", comm)
    alone = comm.bcast(run(SCENES[name], tmp_path / "alone") if comm.rank == 0 else None)
    assert [m["P"] for m in together] == pytest.approx([m["P"] for m in alone[0]], rel=1e-8)
    assert [m.iterations for m in together] == [m.iterations for m in alone[0]]

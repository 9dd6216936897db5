"""Runs that go on: the same numbers as if never halted, longer runs, and what cannot be
continued."""

import json
import os
import shutil
import tomllib

import pytest
from mpi4py import MPI

from archord.benchmarks.persson import persson_joint
from archord.output import checkpoint
from archord.output.folder import CHECKPOINT, claim_folder, occupied
from archord.output.history import read_history
from archord.output.restart import plan_restart
from archord.output.run import solve_scene
from archord.postprocess.run import Run
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_scene, resolved
from archord.solver.contact.quadrature import points_by
from tests.output.run_files import accepted_steps, contents, same_run
from tests.solver.solving import SEVERAL
from tests.solver.solving import small_scene as scene

PLASTIC = {"yield_stress": 0.002}
UP_DOWN_UP = {"displacement": [1.5, 0.9, 1.8], "steps": [3, 3, 3]}


def loaded(load: dict, **options):
    """A joint whose section load is ``load``."""
    return parse_scene(tomllib.loads(resolved(scene(**options))) | {"load": load})


CASES = {
    "elastic": (scene(0.2, 4), 2),
    "plastic": (scene(0.2, 4, **PLASTIC), 3),
    "plane stress, hardening": (
        scene(0.2, 3, **PLASTIC, pin={"hardening": 0.1}, analysis={"plane": "stress"}),
        1,
    ),
    "rigid pin": (scene(0.2, 4, **PLASTIC, pin={"rigid": True}), 2),
    "rigid pin, friction": (
        scene(0.2, 4, **PLASTIC, pin={"rigid": True}, analysis={"friction": 0.3}),
        2,
    ),
    "one side": (scene(0.2, 3, **PLASTIC, analysis={"integration": "block"}), 2),
    "back stresses": (
        scene(
            0.2, **PLASTIC, block={"back_stresses": [[0.5, 100.0], [0.01, 0.0]]}, load=UP_DOWN_UP
        ),
        4,
    ),
    "unloading": (scene(0.2, **PLASTIC, load=UP_DOWN_UP), 4),
    "friction, unloading": (scene(0.2, **PLASTIC, load=UP_DOWN_UP, analysis={"friction": 0.3}), 4),
    "turning": (scene(0.2, **PLASTIC, load=UP_DOWN_UP), 3),
    "force": (
        loaded({"relative_force": [0.004, 0.002], "steps": 3}, element_size=0.2, **PLASTIC),
        4,
    ),
    "ring": (persson_joint(0.5, 0.2, 4, block={"yield_stress": 0.002}), 2),
    "ring with an interference": (persson_joint(-2.0, 0.2, 3), 1),
    "substeps": (scene(0.2, 2, **PLASTIC, stepping={"initial": 0.2, "growth": 1.5}), 1),
    "no fields": (scene(0.2, 3, output={"fields": False}), 1),
    "cutbacks": (scene(0.2, 2, **PLASTIC, analysis={"max_iterations": 6}), 1),
}


class Crashed(Exception):
    """Stands for the end of a process that writes nothing more."""


def crash_after(step: int):
    def stop(measures) -> None:
        if measures.step == step:
            raise Crashed

    return stop


def run(problem, folder, comm=MPI.COMM_SELF, *, crash: int = 0, copies=None):
    """Solve up to a crash; ``copies`` are folders by step: what a kill after that step would
    leave."""

    def copy(measures) -> None:
        if comm.rank == 0 and measures.step in (copies or {}):
            shutil.copytree(folder, copies[measures.step])

    folder.mkdir(exist_ok=True)
    if crash:
        with pytest.raises(Crashed):
            solve_scene(problem, folder, comm, on_step=crash_after(crash))
    else:
        assert solve_scene(problem, folder, comm, on_step=copy).status == "done"


def go_on(problem, folder, comm=MPI.COMM_SELF, *, extend: bool = False, crash: int = 0):
    """Continue the run in ``folder``, planned on rank 0, perhaps up to a crash."""
    plan = plan_restart(folder, problem, extend=extend) if comm.rank == 0 else None
    problem, start = (plan.scene, plan.start) if plan else (problem, None)
    if crash:
        with pytest.raises(Crashed):
            solve_scene(problem, folder, comm, start=start, on_step=crash_after(crash))
        return None
    outcome = solve_scene(problem, folder, comm, start=start)
    assert outcome.status == "done"
    return outcome


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """``whole(problem)`` is the folder of a run that nobody disturbed, solved once; beside it lie
    its states after the steps, "1" and so on."""
    folders = {}

    def solved(problem):
        key = resolved(problem)
        if key not in folders:
            parent = tmp_path_factory.mktemp("whole")
            run(problem, parent / "whole", copies={k: parent / f"{k}" for k in range(1, 9)})
            folders[key] = parent / "whole"
        return folders[key]

    return solved


@pytest.fixture
def halted_after(whole, tmp_path):
    """``halted_after(problem, step)`` is the folder of a run to go on with."""

    def copied(problem, step):
        return shutil.copytree(whole(problem).with_name(f"{step}"), tmp_path / "halted")

    return copied


@pytest.mark.parametrize("name", CASES)
def test_a_restarted_run_equals_the_uninterrupted_one(whole, halted_after, name):
    """Every number of every file, to 1e-12, on one rank."""
    problem, step = CASES[name]
    halted = halted_after(problem, step)
    assert accepted_steps(halted) == step < len(problem.targets)
    outcome = go_on(problem, halted)
    assert [m.step for m in outcome.steps] == list(range(1, len(problem.targets) + 1))
    same_run(whole(problem), halted, 1e-12)
    if name == "cutbacks":
        assert sum(m.cutbacks for m in outcome.steps[step:]) > 0


@pytest.mark.parametrize("name", ["plastic", "rigid pin, friction", "friction, unloading"])
def test_a_step_that_only_the_checkpoint_has_is_evaluated_once_more(whole, halted_after, name):
    """Where a kill left the other files a step behind they get the same numbers."""
    problem, step = CASES[name]
    halted = halted_after(problem, step)
    before = whole(problem).with_name(f"{step - 1}")
    for file in ("fields.h5", "contact.h5", "history.csv", "run.json", "fields.xdmf"):
        shutil.copy(before / file, halted / file)
    go_on(problem, halted)
    same_run(whole(problem), halted, 1e-12)


def test_a_run_of_version_0_2_goes_on_with_its_contact_points(tmp_path):
    """Through two halts. That version did not write by which rule its points lie."""
    problem = scene(0.2, 4, **PLASTIC, analysis={"friction": 0.3})
    with points_by("halved"):
        run(problem, tmp_path / "whole", copies={1: tmp_path / "halted"})
    file = tmp_path / "halted" / CHECKPOINT
    old = checkpoint.read(file)
    del old.scalars["contact_points"]
    checkpoint.write(file, old)
    go_on(problem, tmp_path / "halted", crash=3)
    go_on(problem, tmp_path / "halted")
    same_run(tmp_path / "whole", tmp_path / "halted", 1e-12)
    run(problem, tmp_path / "new")
    P, new = (read_history(tmp_path / name / "history.csv")["P"] for name in ("halted", "new"))
    assert pytest.approx(new, rel=0.01) == P
    assert pytest.approx(new, rel=1e-9) != P


def test_a_restarted_run_remembers_the_continuation_in_gamma(tmp_path):
    """The rest takes the same iterations, and agrees to what such a gamma leaves of the digits."""
    problem = scene(0.2, 3, **PLASTIC, analysis={"gamma_factor": 1e3})
    run(problem, tmp_path / "whole", copies={2: tmp_path / "halted"})
    go_on(problem, tmp_path / "halted")
    whole, halted = (read_history(tmp_path / name / "history.csv") for name in ("whole", "halted"))
    assert whole["iterations"] == halted["iterations"]
    assert whole["iterations"][-1] > 25  # more than one solve's: it was raised
    assert halted["P"] == pytest.approx(whole["P"], rel=1e-9)


def test_a_checkpoint_of_version_0_1_goes_on(whole, halted_after):
    """It calls active-set changes flips."""
    problem, step = CASES["plastic"]
    halted = halted_after(problem, step)
    old = checkpoint.read(halted / CHECKPOINT)
    for attempt in old.scalars["step"]["attempts"]:
        attempt["flips"] = attempt.pop("active_set_changes")
    checkpoint.write(halted / CHECKPOINT, old)
    go_on(problem, halted)
    same_run(whole(problem), halted, 1e-12)


def test_a_halted_run_of_version_0_2_at_large_strain_goes_on(tmp_path):
    """Its state has no work of the change of volume, on which nothing but the dissipation
    depends."""
    problem = scene(0.2, 3, **PLASTIC, analysis={"strain": "large"})
    run(problem, tmp_path / "whole", copies={2: tmp_path / "halted"})
    old = checkpoint.read(tmp_path / "halted" / CHECKPOINT)
    new = [name for name in old.arrays if name.endswith("/volume_work")]
    assert new
    for name in new:
        del old.arrays[name]
    checkpoint.write(tmp_path / "halted" / CHECKPOINT, old)
    go_on(problem, tmp_path / "halted")
    whole, halted = (read_history(tmp_path / name / "history.csv") for name in ("whole", "halted"))
    assert halted["P"] == pytest.approx(whole["P"], rel=1e-12)
    name = next(name for name in whole if name.startswith("plastic_dissipation"))
    assert halted[name] != whole[name]
    assert halted[name] == pytest.approx(whole[name], rel=2e-3)


def test_a_run_may_be_halted_after_every_step(whole, tmp_path):
    """Restarted as often as it has steps; run.json notes each."""
    problem = CASES["plastic"][0]
    run(problem, tmp_path / "halted", crash=1)
    for step in (2, 3, 4):
        go_on(problem, tmp_path / "halted", crash=step)
    go_on(problem, tmp_path / "halted")
    same_run(whole(problem), tmp_path / "halted", 1e-12)
    report = json.loads((tmp_path / "halted" / "run.json").read_text())
    assert [r["after_step"] for r in report["restarts"]] == [1, 2, 3, 4]
    assert report["totals"]["newton_iterations"] == sum(
        step["iterations"] for step in report["steps"]
    )


def test_a_step_that_is_no_equilibrium_here_is_refused(whole, halted_after):
    """As a halted run of a version that solved it otherwise has them; nothing is written."""
    problem, step = CASES["plastic"]
    halted = halted_after(problem, step)
    known = checkpoint.read(halted / CHECKPOINT)
    known.arrays["fields/displacement"] *= 1.001
    checkpoint.write(halted / CHECKPOINT, known)
    before = contents(halted)
    with pytest.raises(InputError, match=f"after step {step} by a version that solves it"):
        go_on(problem, halted)
    assert contents(halted) == before


CHANGES = [("all", "all", 1e-12), ("one", "all", 1e-8), ("all", "one", 1e-8)]


@pytest.mark.mpi
@pytest.mark.parametrize(("before", "after", "tolerance"), CHANGES if SEVERAL else CHANGES[:1])
@pytest.mark.parametrize(
    "name", ["plastic", "rigid pin", "force", "back stresses"] if SEVERAL else ["force"]
)
def test_ranks_may_change(tmp_path_factory, comm, name, before, after, tolerance):
    """Halted on all ranks or one, continued on one or all.

    The order in which MUMPS sums up what other ranks send is left to chance: values at points
    differ by 1e-12 between any two runs.
    """
    problem, step = CASES[name]
    folder = comm.bcast(tmp_path_factory.mktemp("ranks") if comm.rank == 0 else None)
    on = {"all": comm, "one": MPI.COMM_SELF}
    for ranks, work in (
        (before, lambda: run(problem, folder / "whole", on[before])),
        (before, lambda: run(problem, folder / "halted", on[before], crash=step)),
        (after, lambda: go_on(problem, folder / "halted", on[after])),
    ):
        if ranks == "all" or comm.rank == 0:
            work()
        comm.barrier()
    if comm.rank == 0:
        same_run(folder / "whole", folder / "halted", tolerance, 30 * tolerance)


SHORT = scene(0.2, **PLASTIC, load={"displacement": 1.5, "steps": 3})
LONGER = scene(0.2, **PLASTIC, load={"displacement": 3.0, "steps": 6})


@pytest.mark.parametrize("long", [LONGER, CASES["unloading"][0]], ids=["on", "back"])
@pytest.mark.parametrize("steps", [3, 2], ids=["finished", "halted"])
def test_an_extended_run_equals_the_long_one(whole, halted_after, tmp_path, long, steps):
    """Further loading or unloading added to a run, which may be killed there and then is restarted
    like any other."""
    if steps < 3:
        folder = halted_after(SHORT, steps)
    else:
        folder = shutil.copytree(whole(SHORT), tmp_path / "halted")
    go_on(long, folder, extend=True, crash=5)
    assert (folder / "scene.toml").read_text() == resolved(long)
    go_on(None, folder)
    same_run(whole(long), folder, 1e-12)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A finished run to delta = 2 dR in four steps."""
    folder = tmp_path_factory.mktemp("finished")
    run(scene(0.25, 4), folder)
    return folder


@pytest.mark.parametrize(
    ("load", "said"),
    [
        ({"displacement": 2.0, "steps": 4}, "ends at 0.01 already"),
        ({"displacement": 1.0, "steps": 2}, "4 steps are not the first ones of the scene's path"),
        ({"displacement": 4.0, "steps": 4}, "4 steps are not the first ones of the scene's path"),
        (
            {"displacement": [1.0, 0.5, 4.0], "steps": 2},
            "4 steps are not the first ones of the scene's path",
        ),
        ({"relative_force": 0.1}, "was loaded by a displacement; a force cannot continue it"),
    ],
)
def test_a_path_that_does_not_go_on_is_refused(finished, load, said):
    """The same, a shorter one, other steps, another path, another kind of load."""
    with pytest.raises(InputError, match=said):
        plan_restart(finished, loaded(load, element_size=0.25), extend=True)


def test_a_finished_run_is_left_alone(finished):
    """Nothing to restart."""
    before = contents(finished)
    plan = plan_restart(finished)
    assert plan.finished
    assert "finished" in plan.said
    assert contents(finished) == before


def test_tables_of_a_finished_run_are_written_again(finished, tmp_path):
    """A history that lacks steps is no history of the run; --restart makes it and fields.xdmf from
    the other files."""
    copy = shutil.copytree(finished, tmp_path / "run")
    history = (copy / "history.csv").read_bytes()
    (copy / "history.csv").write_bytes(b"\n".join(history.split(b"\n")[:3]) + b"\n")
    (copy / "fields.xdmf").write_text("")
    with pytest.raises(
        InputError, match=r"history\.csv: has 2 of the 4 steps of run\.json: it was cut short; "
    ):
        Run(copy)
    assert plan_restart(copy).said.endswith(
        "is finished: writing history.csv and fields.xdmf again"
    )
    go_on(None, copy)
    same_run(finished, copy, 1e-12)
    assert (copy / "fields.xdmf").read_text() == (finished / "fields.xdmf").read_text()
    assert plan_restart(copy).finished


@pytest.fixture(scope="module")
def crashed(tmp_path_factory):
    """An elastic run of three steps that crashed after the second."""
    folder = tmp_path_factory.mktemp("crashed") / "run"
    run(scene(0.25, 3), folder, crash=2)
    return folder


@pytest.fixture
def halted(crashed, tmp_path):
    """A copy of it to go on with, or to be damaged."""
    return shutil.copytree(crashed, tmp_path / "run")


def test_only_step_control_may_change(halted):
    """Another key is named with both values; [stepping] and max_iterations are free, and the run
    goes on with them. A run without its checkpoint is not overwritten by another scene either."""
    folder = halted
    lost = shutil.copytree(halted, halted.with_name("lost"))
    (lost / "checkpoint.h5").unlink()
    own = tomllib.loads(resolved(scene(0.25, 3)))
    for section, key, value in (
        ("block", "nu", 0.29),
        ("analysis", "plane", "stress"),
        ("load", "core_radius", 0.2),
    ):
        other = parse_scene(own | {section: own[section] | {key: value}})
        for there in (folder, lost):
            with pytest.raises(
                InputError, match=rf"was solved with {section}\.{key} = .*, the scene says"
            ) as error:
                plan_restart(there, other)
            assert len(str(error.value).splitlines()) == 1
    analysis = own["analysis"] | {"max_iterations": 12}
    other = parse_scene(
        own | {"stepping": own["stepping"] | {"initial": 0.5}, "analysis": analysis}
    )
    go_on(other, folder)
    assert load_scene(folder / "scene.toml").analysis.max_iterations == 12


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda run: (run / "fields" / "0001.h5").unlink(), r"fields\.h5: is missing or damaged"),
        (lambda run: (run / "contact.h5").unlink(), r"contact\.h5: is missing or damaged"),
        (lambda run: (run / "run.json").unlink(), r"run\.json: is missing"),
        (
            lambda run: (run / "run.json").write_text("{"),
            r"run\.json: is missing, was changed, or lacks some",
        ),
        (lambda run: os.truncate(run / "checkpoint.h5", 5000), r"checkpoint\.h5: is damaged"),
    ],
)
def test_a_run_with_files_missing_is_refused(halted, damage, said):
    """One sentence with the file's name; the checkpoint stays."""
    folder = halted
    damage(folder)
    checkpoint = (folder / "checkpoint.h5").read_bytes()
    with pytest.raises(InputError, match=said) as error:
        go_on(scene(0.25, 3), folder)
    assert len(str(error.value).splitlines()) == 1
    assert (folder / "checkpoint.h5").read_bytes() == checkpoint


def test_a_step_that_only_the_checkpoint_has_is_written(tmp_path):
    """Earlier versions, killed there, left all other files a step behind: they get the step from
    the restored state. Tables that were lost are written again."""
    problem = CASES["plastic"][0]
    run(problem, tmp_path / "whole", copies={2: tmp_path / "before", 3: tmp_path / "halted"})
    shutil.copy(tmp_path / "halted" / "checkpoint.h5", tmp_path / "before")
    assert checkpoint.read(tmp_path / "before" / "checkpoint.h5").step == 3
    assert len(json.loads((tmp_path / "before" / "run.json").read_text())["steps"]) == 2
    for name in ("history.csv", "fields.xdmf"):
        (tmp_path / "before" / name).unlink()
    go_on(problem, tmp_path / "before")
    same_run(tmp_path / "whole", tmp_path / "before", 1e-12)
    xdmf = [(tmp_path / name / "fields.xdmf").read_text() for name in ("whole", "before")]
    assert xdmf[0] == xdmf[1]


def test_what_never_began_starts_from_the_beginning(tmp_path):
    """No folder, or one without an accepted step: said, and solved; it cannot be extended."""
    problem = scene(0.25, 2)
    plan = plan_restart(tmp_path / "none", problem)
    assert plan.start is None
    assert "holds no accepted step: starting from the beginning" in plan.said
    (tmp_path / "scene.toml").write_text(resolved(problem))
    with pytest.raises(InputError, match="cannot be continued"):
        plan_restart(tmp_path, problem, extend=True)
    go_on(None, tmp_path)


def test_two_processes_do_not_write_to_one_folder(tmp_path):
    """The second one is refused, also with --force; the lock ends with its holder."""
    problem = scene(0.25, 1)
    claim_folder(tmp_path, True)
    with occupied(tmp_path), pytest.raises(InputError, match="another archord is solving into it"):
        solve_scene(problem, tmp_path, MPI.COMM_SELF)
    assert solve_scene(problem, tmp_path, MPI.COMM_SELF).status == "done"


def test_a_run_without_checkpoint_begins_again_and_says_so(tmp_path):
    """It is complete but for what the scene left out; commands name the key."""
    lean = scene(0.2, 2, output={"fields": False, "contact": False, "checkpoint": False})
    run(lean, tmp_path, crash=1)
    plan = plan_restart(tmp_path, lean)
    assert (plan.start, plan.finished) == (None, False)
    assert plan.said.endswith("as output.checkpoint = false: starting from the beginning")
    run(lean, tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"scene.toml", "history.csv", "run.json"}
    assert plan_restart(tmp_path, lean).finished
    with pytest.raises(InputError, match=r"output\.checkpoint = false, so that the run cannot"):
        plan_restart(tmp_path, extend=True)
    with pytest.raises(InputError, match=r"it was solved with output\.contact = false\.\Z"):
        Run(tmp_path).contact()

"""Cases on any number of ranks: each is solved once, all ranks take part, and the numbers are those of one rank."""

import json
import os
import signal
from pathlib import Path

import pytest

from archord.benchmarks.case import Case
from archord.output.history import read_history
from archord.output.ranks import agreed
from archord.studies.case_run import solve_case
from archord.studies.cases import read_sweep
from archord.studies.farm import Farm, suited
from archord.studies.sweep import Job, Share, open_jobs
from archord.studies.tables import of_case, report_of, result_of
from tests.studies.parts import SOFT, break_mesh, written

CLOCK = {"seconds", "force_balance"}


def jobs_of(comm, folder: Path, text: str = SOFT) -> tuple[Path, list[Job]]:
    """Jobs in a folder that all ranks share; the longer ones are the later ones."""
    folder = comm.bcast(folder)

    def made() -> list[Job]:
        cases = read_sweep(written(folder, text)).cases
        return [Job(case.scene, folder / case.run, float(case.number)) for case in cases]

    return folder, agreed(comm, made)


@pytest.mark.mpi
def test_each_job_is_solved_once_by_somebody(comm, tmp_path):
    """Results come to rank 0 alone, longest first; each history is that of a solve by itself on one rank."""
    folder, jobs = jobs_of(comm, tmp_path)
    results, running = [], []
    assert Farm(comm).run(jobs, results.append, running.append) == 0
    if comm.rank:
        assert results == running == []
        return
    assert sorted(result.run for result in results) == sorted(job.folder.name for job in jobs)
    assert {result.status for result in results} == {"done"}
    assert results[-1].run != jobs[-1].folder.name  # the longest does not end last
    for job in jobs:
        assert report_of(job.folder)["ranks"] == 1
    a, b = alone_and_in(jobs[0], folder)
    assert a == b


def alone_and_in(job: Job, folder: Path) -> list[dict]:
    """What does not depend on the clock of two histories: of a solve on one rank, and of the job."""
    Case("alone", job.scene).solve(folder)
    both = (read_history(place / "history.csv") for place in (folder / "alone", job.folder))
    return [{name: column for name, column in history.items() if name not in CLOCK} for history in both]


@pytest.mark.mpi
def test_a_group_solves_what_one_rank_does(comm, tmp_path):
    """All ranks on each case: the same numbers to round-off."""
    folder, jobs = jobs_of(comm, tmp_path, "[grid]\npin.E = [0.5, 1.82]\n")
    results = []
    assert Farm(comm, comm.size).run(jobs, results.append) == 0
    if comm.rank == 0:
        assert [result.status for result in results] == ["done", "done"]
        for job in jobs:
            assert report_of(job.folder)["ranks"] == comm.size
        a, b = alone_and_in(jobs[1], folder)
        for name, column in a.items():
            assert column == pytest.approx(b[name], rel=1e-9), name


@pytest.mark.mpi
def test_a_signal_ends_the_batch_on_all_ranks(comm, tmp_path):
    """Whoever gets it: no case begins after it, and what is there is continued by the next call."""
    _, jobs = jobs_of(comm, tmp_path, "[grid]\npin.E = [0.5, 0.6, 0.7, 0.8, 1.0, 1.82]\n")
    results = []

    def ended(result) -> None:
        if not results:
            os.kill(os.getpid(), signal.SIGTERM)
        results.append(result)

    before = signal.getsignal(signal.SIGTERM)
    assert Farm(comm).run(jobs, ended) == signal.SIGTERM
    assert signal.getsignal(signal.SIGTERM) == before
    if comm.rank == 0:
        assert "interrupted" in {result.status for result in results} or len(results) < len(jobs)
        assert any(result_of(job.folder).status != "done" for job in jobs)
    rest = agreed(comm, lambda: [job for job in jobs if result_of(job.folder).status != "done"])
    assert Farm(comm).run(rest, lambda result: None) == 0
    if comm.rank == 0:
        assert {result_of(job.folder).status for job in jobs} == {"done"}


@pytest.mark.mpi
def test_failures_do_not_stop_a_farm(comm, tmp_path, monkeypatch):
    """Whichever rank has them."""
    break_mesh(monkeypatch, "broken", below=0.75)
    _, jobs = jobs_of(comm, tmp_path, "[grid]\npin.E = [0.5, 0.6, 0.7, 0.8, 1.0, 1.82]\n")
    results = []
    assert Farm(comm).run(jobs, results.append) == 0
    if comm.rank == 0:
        by_run = {result.run: result for result in results}
        assert [by_run[job.folder.name].status for job in jobs] == 3 * ["failed"] + 3 * ["done"]
        assert [result_of(job.folder).message for job in jobs] == 3 * ["ValueError: broken"] + 3 * [""]


def test_a_case_with_an_accuracy_gets_its_meshes_again_after_a_kill_between_two(comm, tmp_path):
    """Each of its meshes is a finished run: only one with an estimate is the case's."""
    varied = '[grid]\nanalysis.accuracy = [0.05]\njoint.relative_element_size = ["none"]\njoint.growth = ["none"]\n'
    sweep = read_sweep(written(tmp_path, varied))
    case = sweep.cases[0]
    folder = of_case(case, tmp_path)
    folder.parent.mkdir()
    assert solve_case(case.scene, folder, comm).status == "done"
    report = report_of(folder)
    assert report["accuracy"]["estimated"] <= 0.05
    assert not open_jobs(sweep, tmp_path, Share(), retry=False)[1]
    del report["accuracy"]
    (folder / "run.json").write_text(json.dumps(report))
    assert [job.folder for job in open_jobs(sweep, tmp_path, Share(), retry=False)[1]] == [folder]


def test_rank_0_takes_cases_whose_mesh_it_has(tmp_path):
    """Its own meshes first, then one that nobody has, and the longest where others are much shorter."""
    base = read_sweep(written(tmp_path, SOFT)).cases[0].scene

    def job(number: int, size: float, cost: float) -> Job:
        joint = base.joint.model_copy(update={"relative_element_size": size})
        return Job(base.model_copy(update={"joint": joint}), tmp_path / f"{number}", cost)

    jobs = [job(1, 0.2, 9.0), job(2, 0.2, 8.0), job(3, 0.3, 5.0), job(4, 0.3, 5.0), job(5, 0.4, 2.0)]
    mesh = [job.mesh for job in jobs]
    assert mesh[0] == mesh[1] != mesh[2] == mesh[3] != mesh[4]
    assert suited(jobs, set(), {mesh[0]}) == 2, "the other rank has the first mesh"
    assert suited(jobs[1:], {mesh[2]}, {mesh[0]}) == 1
    assert suited(jobs, {mesh[4]}, {mesh[0], mesh[2]}) == 0, "the last case is too short"
    assert suited(jobs[4:], {mesh[0]}, {mesh[4]}) == 0

"""Cases on any number of ranks: each is solved once, all ranks take part, and the numbers are those
of one rank."""

import os
import signal
from pathlib import Path

import pytest

from archord.output.files.seal import report_text
from archord.output.folder import report_of
from archord.output.ranks import agreed
from archord.studies.cases import Case, read_sweep
from archord.studies.farm import solve_case, solve_cases
from archord.studies.sweep import CASES, of_case, open_cases, result_of
from tests.studies.parts import SOFT, break_mesh, written

SIX = "[grid]\npin.E = [0.5, 0.6, 0.7, 0.8, 1.0, 1.82]\n"


def cases_of(comm, folder: Path, text: str) -> tuple[Path, list[Case]]:
    """Cases, and a folder that all ranks share."""
    folder = comm.bcast(folder)

    def made() -> list[Case]:
        (folder / CASES).mkdir()
        return read_sweep(written(folder, text)).cases

    return folder, agreed(comm, made)


@pytest.mark.mpi
def test_each_case_is_solved_once_by_somebody(comm, tmp_path):
    """On one rank; results come to rank 0 alone."""
    folder, cases = cases_of(comm, tmp_path, SOFT)
    results = []
    assert solve_cases(comm, cases, folder, results.append) == 0
    assert bool(results) == (comm.rank == 0)
    if comm.rank == 0:
        assert sorted(result.run for result in results) == sorted(case.run for case in cases)
        assert {result.status for result in results} == {"done"}
        assert {report_of(of_case(case, folder))["ranks"] for case in cases} == {1}


@pytest.mark.mpi
def test_a_signal_ends_the_batch_on_all_ranks(comm, tmp_path):
    """Whoever gets it: no case begins after it, and what is there is continued by the next call."""
    folder, cases = cases_of(comm, tmp_path, SIX)
    results = []

    def ended(result) -> None:
        if not results:
            os.kill(os.getpid(), signal.SIGTERM)
        results.append(result)

    before = signal.getsignal(signal.SIGTERM)
    assert solve_cases(comm, cases, folder, ended) == signal.SIGTERM
    assert signal.getsignal(signal.SIGTERM) == before
    rest = agreed(
        comm, lambda: [case for case in cases if result_of(case, folder).status != "done"]
    )
    assert rest
    assert solve_cases(comm, rest, folder, lambda result: None) == 0
    if comm.rank == 0:
        assert {result_of(case, folder).status for case in cases} == {"done"}


@pytest.mark.mpi
def test_failures_do_not_stop_a_farm(comm, tmp_path, monkeypatch):
    """Whichever rank has them."""
    break_mesh(monkeypatch, "broken", below=0.75)
    folder, cases = cases_of(comm, tmp_path, SIX)
    results = []
    assert solve_cases(comm, cases, folder, results.append) == 0
    if comm.rank == 0:
        by_run = {result.run: result for result in results}
        assert [by_run[case.run].status for case in cases] == 3 * ["failed"] + 3 * ["done"]
        assert [result_of(case, folder).message for case in cases] == 3 * [
            "ValueError: broken"
        ] + 3 * [""]


def test_a_case_with_an_accuracy_gets_its_meshes_again_after_a_kill_between_two(comm, tmp_path):
    """Each of its meshes is a finished run: only one with an estimate is the case's."""
    varied = (
        '[grid]\nanalysis.accuracy = [0.05]\njoint.relative_element_size = ["none"]\njoint.growth '
        '= ["none"]\n'
    )
    folder, cases = cases_of(comm, tmp_path, varied)
    assert solve_case(cases[0], folder).status == "done"
    run = of_case(cases[0], folder)
    report = report_of(run)
    assert report["accuracy"]["estimated"] <= 0.05
    assert open_cases(cases, folder)[1] == []
    del report["accuracy"]
    (run / "run.json").write_text(report_text(report))
    assert open_cases(cases, folder)[1:] == (cases, [])

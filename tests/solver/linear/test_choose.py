"""Which strategies are used, and what run.json says of the others."""

import json
from dataclasses import replace

import pytest
from mpi4py import MPI

from archord.benchmarks.case import paper_joint
from archord.output.run import solve_scene
from archord.solver.linear import choose as module
from archord.solver.linear.choose import choose
from archord.solver.linear.strategy import Facts
from tests.solver.solving import MUMPS_FROM_C

ELASTIC = Facts(MPI.COMM_SELF, 5000, 2, False, False, False, False, 0.5, lambda: True)


@pytest.mark.parametrize(
    ("change", "strategy"),
    [
        ({}, "condensed"),
        ({"dofs": 10_000}, "look_ahead + direct"),
        ({"dofs": 50_000}, "lagged + look_ahead + direct"),
        ({"yields": True}, "lagged + look_ahead + direct"),
        ({"yields": True, "dofs": 1_000}, "look_ahead + direct"),
        ({"yields": True, "friction": True}, "lagged + look_ahead + direct"),
        ({"finite": True}, "look_ahead + direct"),
        ({"finite": True, "dofs": 50_000}, "lagged + look_ahead + direct"),
        ({"by_force": True}, "bordered + look_ahead + direct"),
        ({"by_force": True, "dofs": 50_000}, "bordered + lagged + look_ahead + direct"),
        ({"gamma_factor": None}, "direct"),
        ({"gamma_factor": 10.0}, "look_ahead + direct"),
        ({"held": lambda: False}, "look_ahead + direct"),
        ({"dimension": 3, "dofs": 4_000}, "look_ahead + direct"),
        ({"dimension": 3}, "multigrid + look_ahead"),
        ({"dimension": 3, "dofs": 50_000}, "multigrid + look_ahead"),
        ({"dimension": 3, "yields": True}, "multigrid + look_ahead"),
        ({"dimension": 3, "by_force": True}, "bordered + multigrid + look_ahead"),
    ],
)
def test_what_is_used(change, strategy):
    words = choose(replace(ELASTIC, **change)).words()
    assert words["strategy"] == strategy
    assert set(words["not_used"]) == set(module.RULES) - set(strategy.split(" + "))


def test_what_is_left_out_on_request_is_not_used(monkeypatch):
    monkeypatch.setattr(module, "LEFT_OUT", {"condensed"})
    assert choose(ELASTIC).words()["not_used"]["condensed"] == "left out on request"


@pytest.mark.mpi
@pytest.mark.skipif(not MUMPS_FROM_C, reason="MUMPS has no headers")
def test_several_ranks_eliminate_their_own_unknowns_and_one_rank_says_why_not(comm):
    choice = choose(replace(ELASTIC, comm=comm, yields=True))
    assert choice.uses("substructured") == (comm.size > 1)
    assert comm.size > 1 or choice.words()["not_used"]["substructured"] == "one rank"


@pytest.mark.mpi
@pytest.mark.skipif(not MUMPS_FROM_C, reason="MUMPS has no headers")
def test_a_rank_without_a_library_is_a_reason_for_all(comm, monkeypatch):
    if comm.size == 1:
        pytest.skip("one rank has another reason")

    def metis():
        if comm.rank > 0:
            raise OSError("METIS is not installed")

    monkeypatch.setattr(module.substructured, "metis", metis)
    words = choose(replace(ELASTIC, comm=comm, yields=True)).words()
    assert words["not_used"]["substructured"].endswith("METIS is not installed")


def test_a_run_tells_its_strategy_with_reasons(tmp_path):
    solve_scene(paper_joint(0.2, 1), tmp_path, MPI.COMM_SELF)
    told = json.loads((tmp_path / "run.json").read_text())["linear_solver"]
    assert told["strategy"] == "condensed"
    assert told["not_used"]["lagged"] == "the system is condensed"

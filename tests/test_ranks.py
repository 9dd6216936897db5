"""Commands under a launcher: one report, one file, one exit code, and no MPI where there is nothing
to share."""

import os
from pathlib import Path

import pytest

from archord import cli
from archord.commands import ranks
from tests.test_cli import archord

SCENE = str(Path(__file__).parents[1] / "scenes" / "elastic_pin.toml")
COARSE = ["--set", "joint.relative_element_size=0.3"]


@pytest.mark.parametrize(
    ("arguments", "written"),
    [
        (["law", "johnson", "--scene", SCENE], None),
        (["fit", "{coarse}", "--json", "FILE"], "fit.json"),
        (["export-deck", SCENE, *COARSE, "-o", "FILE"], "deck.inp"),
    ],
)
def test_two_ranks_say_and_write_what_one_does(runs, tmp_path, arguments, written):
    """stdout, stderr and file to the last byte."""
    found = []
    for n in (0, 2):
        file = tmp_path / f"{n}" / (written or "none")
        file.parent.mkdir(exist_ok=True)
        result = archord(
            *(a.replace("FILE", str(file)).format(**runs) for a in arguments), cwd=tmp_path, ranks=n
        )
        said = result.stdout.replace("\r\n", "\n").replace(str(file), "FILE")
        found.append((said, result.stderr, file.read_bytes() if written else None))
    assert found[0] == found[1]


@pytest.mark.parametrize(
    ("variables", "rank", "others"),
    [
        ({}, 0, False),
        ({"OMPI_COMM_WORLD_RANK": "2", "OMPI_COMM_WORLD_SIZE": "3", "PMIX_RANK": "2"}, 2, True),
        ({"OMPI_COMM_WORLD_RANK": "0", "OMPI_COMM_WORLD_SIZE": "1", "PMIX_RANK": "0"}, 0, False),
        ({"PMI_RANK": "1", "PMI_SIZE": "2"}, 1, True),
        ({"PMIX_RANK": "1"}, 1, True),
        ({"SLURM_PROCID": "3", "SLURM_STEP_NUM_TASKS": "4"}, 3, True),
        (
            {"SLURM_PROCID": "0", "SLURM_NTASKS": "4"},
            0,
            False,
        ),  # the script of a batch job, which is one process
    ],
)
def test_launchers_are_known_by_their_variables(monkeypatch, variables, rank, others):
    monkeypatch.setattr(os, "environ", variables)
    assert (ranks.launcher_rank(), ranks.launched_with_others()) == (rank, others)


def test_ranks_take_turns_in_the_stability_benchmark(tmp_path):
    """All ranks work on it, and on no other benchmark; one table comes of it."""
    commands = [
        cli._command(words)
        for words in (["benchmark", "stability"], ["benchmark", "scaling", "-q"], [])
    ]
    assert [command in ranks.COLLECTIVE for command in commands] == [True, False, False]
    result = archord(
        "benchmark", "stability", "--only", "zero*", "-o", str(tmp_path), cwd=tmp_path, ranks=2
    )
    assert result.stdout.count("2 scenes in") == 1
    assert result.stderr.count("done, 4 steps") == 2


@pytest.mark.parametrize("rank", ["0", "1"])
def test_a_command_of_one_rank_forgets_the_launcher(monkeypatch, rank):
    """Rank 0 works as if started by hand, the other not at all."""
    launched = {"OMPI_COMM_WORLD_RANK": rank, "OMPI_COMM_WORLD_SIZE": "2", "PMIX_RANK": rank}
    monkeypatch.setattr(os, "environ", launched)
    seen = []
    code = ranks.run_on_ranks("fit", lambda: seen.append(ranks.launched_with_others()) or 5)
    assert code == (5 if rank == "0" else 0)
    assert seen == ([False] if rank == "0" else [])

"""Processes that are timed from outside, and sweeps that are."""

import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from archord.benchmarks.cost.pairs import WITHOUT, command, saved, strategy_cases, sweep_table, timed
from archord.benchmarks.timing import INTERRUPTED, Failure, Process, Run, Timing, last_core, run_once, time_all
from tests.studies.parts import written


def named(folder, *command, **options):
    return Process(command or ("true",), folder, **options)


def test_a_process_is_timed_from_outside(tmp_path):
    """Its sleep, its memory but not its parent's, one core, one thread."""
    code = (
        "import os, json, time; a = bytearray(60_000_000); time.sleep(0.2); "
        "json.dump([len(os.sched_getaffinity(0)), os.environ['OMP_NUM_THREADS']], open('said.json', 'w'))"
    )
    run = run_once(named(tmp_path, sys.executable, "-S", "-c", code, core=last_core(), read=lambda: "result"))
    assert 0.2 < run.seconds < 5
    assert 0 < run.cpu < run.seconds
    assert 60e6 < run.memory < 110e6
    assert run.result == "result"
    assert json.loads((tmp_path / "said.json").read_text()) == [1, "1"]


def test_failures_are_recorded_with_their_sentence(tmp_path):
    """A crash, a process that takes too long, a command that is not there, a result that cannot be read: none is tried
    again."""

    def unread():
        raise Failure("no result")

    said = []
    processes = [
        named(tmp_path / "a", kind="fine"),
        named(tmp_path / "b", sys.executable, "-S", "-c", "import sys; sys.exit('it broke')"),
        named(tmp_path / "c", "sleep", "60", limit=0.2),
        named(tmp_path / "d", "no-such-program"),
        named(tmp_path / "e", read=unread),
    ]
    found = time_all(processes, 2, lambda process, repeat, sentence: said.append((process.folder.name, repeat)))
    assert [timing.done for timing in found] == [True] + 4 * [False]
    assert [timing.failure for timing in found[1:3]] == ["it broke", "more than the 0.2 s allowed"]
    assert "no-such-program" in found[3].failure
    assert found[4].failure == "no result"
    assert said == [("a", 0), ("a", 1), *((name, 1) for name in "bcde"), ("a", 2)]
    assert len(found[0].runs) == 2


def test_repeats_are_interleaved(tmp_path):
    """Round robin, after one untimed run of each kind; what was written before is cleared."""
    said, seen = [], []
    processes = [
        named(tmp_path / n, "touch", "old", kind=n[0], clear=("old",), read=partial(seen.append, n))
        for n in ("a1", "a2", "b1")
    ]
    processes[1] = named(tmp_path / "a2", "mkdir", "-p", "old2", kind="a")
    time_all(processes, 2, lambda process, repeat, sentence: said.append(f"{process.folder.name}:{repeat}"))
    assert " ".join(said) == "a1:0 b1:0 a1:1 a2:1 b1:1 a1:2 a2:2 b1:2"
    assert seen == ["a1", "b1"] * 3


def test_what_was_timed_before_an_interruption_is_kept(tmp_path):
    """Ctrl-C in the second repetition leaves results; before anything was timed it is raised."""
    processes = [named(tmp_path / n, kind="all") for n in ("a", "b", "c")]

    def interrupted(when):
        def said(process, repeat, sentence):
            if (process.folder.name, repeat) == when:
                raise KeyboardInterrupt

        return said

    found = time_all(processes, 3, interrupted(("b", 1)))
    assert [len(timing.runs) for timing in found] == [1, 1, 0]
    assert found[2].failure == INTERRUPTED
    assert [len(timing.runs) for timing in time_all(processes, 3, interrupted(("a", 2)))] == [2, 1, 1]
    with pytest.raises(KeyboardInterrupt):
        time_all(processes, 3, interrupted(("a", 0)))


def test_a_pair_is_two_sweeps_that_were_solved(tmp_path):
    """Both ranks work: no less processor time than alone for the same cases."""
    said = []
    sweep = ("sweep", written(tmp_path, "[grid]\npin.E = [1.0, 1.82]\n"))
    alone, together = timed(command(1, sweep), command(2, sweep), 1, said.append)
    assert len(alone) == len(together) == 1
    assert 0.5 < alone[0].cpu < 2 * together[0].cpu
    cores = os.cpu_count() or 1
    assert all(run.seconds * cores >= run.cpu for run in (*alone, *together))
    assert len(said) == 3


def test_a_command_that_fails_is_no_measurement(tmp_path):
    (tmp_path / "bad.sweep.toml").write_text("nonsense = 1\n")
    bad = command(1, ("sweep", str(tmp_path / "bad.sweep.toml")))
    with pytest.raises(RuntimeError, match="nonsense"):
        timed(bad, bad, 1)


def test_a_change_comes_before_the_command(tmp_path):
    """Statements of strategies that are left out run, and what they change is there."""
    marked = command(1, ("--version",), f"open({str(tmp_path / 'mark')!r}, 'w').close()")
    subprocess.run(marked[: marked.index("-q")], check=True, capture_output=True)
    assert (tmp_path / "mark").exists()
    for change in WITHOUT.values():
        subprocess.run([sys.executable, "-c", change], check=True, env=os.environ)


def test_what_a_strategy_takes_off_is_that_of_the_pair_in_the_middle(tmp_path):
    """And every case has a scene or a sweep to solve, and names strategies that are known."""
    kept = [Run(s, 2 * s, 0, None) for s in (1.0, 3.0, 2.0)]
    left = [Run(s, 8 * s, 0, None) for s in (2.0, 4.0, 20.0)]
    assert (saved(kept, left, "seconds"), saved(kept, left, "cpu")) == (0.5, 0.875)
    cases = list(strategy_cases(tmp_path))
    assert {strategy for _, _, strategy, _ in cases} == set(WITHOUT)
    assert all(Path(arguments[-1]).is_file() for *_, arguments in cases)


def test_the_table_ends_with_the_medians():
    """Of an even number, the mean of the two in the middle, of which the faster is shown."""
    alone = [Run(s, cpu, 0, None) for s, cpu in ((20.0, 19.0), (30.0, 20.0), (22.0, 18.0))]
    together = [Run(s, cpu, 0, None) for s, cpu in ((10.0, 21.0), (20.0, 22.0), (11.5, 20.0))]
    middle = Timing(named(Path()), [*alone, Run(90.0, 0.0, 0, None)])
    assert (middle.median, middle.middle.seconds) == (26.0, 22.0)
    found = sweep_table(alone, together, 2)
    assert found.headings[2] == "2 ranks [s]"
    assert found.rows[-1] == ["median", "22.0", "11.5", "1.91", "19.0", "21.0"]

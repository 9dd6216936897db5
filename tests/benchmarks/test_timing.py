"""Processes that are timed from outside."""

import sys
from functools import partial
from pathlib import Path

import pytest

from archord.benchmarks.timing import Failure, Process, Run, Timing, run_once, time_all


def named(folder, *command, **options):
    return Process(folder.name, command or ("true",), folder, **options)


def test_a_process_is_timed_from_outside(tmp_path):
    """Its sleep, its memory but not its parent's, one thread."""
    code = (
        "import os, time; a = bytearray(60_000_000); time.sleep(0.2); "
        "print(os.environ['OMP_NUM_THREADS'])"
    )
    run = run_once(named(tmp_path, sys.executable, "-S", "-c", code, read=lambda: "result"))
    assert 0.2 < run.seconds < 5
    assert 0 < run.cpu < run.seconds
    assert 60e6 < run.memory < 110e6
    assert run.result == "result"
    assert (tmp_path / "stdout.txt").read_text() == "1\n"


def test_failures_are_recorded_with_their_sentence(tmp_path):
    """A crash, a process that takes too long, a command that is not there, a result that cannot be
    read: none is tried again."""

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
    found = time_all(processes, 2, said.append)
    assert [bool(timing.failure) for timing in found] == [False] + 4 * [True]
    assert [timing.failure for timing in found[1:3]] == ["it broke", "more than the 0.2 s allowed"]
    assert "no-such-program" in found[3].failure
    assert found[4].failure == "no result"
    assert [sentence[0] for sentence in said] == ["a", "a", *"bcde", "a"]
    assert [sentence.endswith(("not counted", "run 1", "run 2")) for sentence in said] == [
        True
    ] * 2 + [False] * 4 + [True]
    assert len(found[0].runs) == 2


def test_repeats_are_interleaved(tmp_path):
    """Round robin, after one untimed run of each kind; what was written before is cleared."""
    said = []
    seen = []
    processes = [
        named(tmp_path / n, "touch", "old", kind=n[0], clear=("old",), read=partial(seen.append, n))
        for n in ("a1", "a2", "b1")
    ]
    processes[1] = named(tmp_path / "a2", "mkdir", "-p", "old2", kind="a")
    time_all(processes, 2, lambda sentence: said.append(sentence[:3] + sentence[-1]))
    assert " ".join(said) == "a1:d b1:d a1:1 a2:1 b1:1 a1:2 a2:2 b1:2"
    assert seen == ["a1", "b1"] * 3


def test_what_was_timed_before_an_interruption_is_kept(tmp_path):
    """Ctrl-C in the second repetition leaves results; before anything was timed it is raised."""
    processes = [named(tmp_path / n, kind="all") for n in ("a", "b", "c")]

    def interrupted(when):
        def said(sentence):
            if (sentence[0], sentence[-1]) == when:
                raise KeyboardInterrupt

        return said

    found = time_all(processes, 3, interrupted(("b", "1")))
    assert [len(timing.runs) for timing in found] == [1, 1, 0]
    assert found[2].failure == "interrupted before its first run"
    assert [len(timing.runs) for timing in time_all(processes, 3, interrupted(("a", "2")))] == [
        2,
        1,
        1,
    ]
    with pytest.raises(KeyboardInterrupt):
        time_all(processes, 3, interrupted(("a", "d")))


def test_the_median_lies_in_the_middle():
    """Of an even number of runs it is the mean of two, of which the faster is shown."""
    timing = Timing(named(Path()), [Run(s, 0.0, 0, None) for s in (20.0, 90.0, 22.0, 30.0)])
    assert (timing.median, timing.middle.seconds) == (26.0, 22.0)

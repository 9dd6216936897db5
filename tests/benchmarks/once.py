"""Timing in tests: runs that are not counted are left out, as what they compile may be timed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from archord.benchmarks.timing import Process, Said, Timing, time_all


def timed_once(processes: Sequence[Process], repeats: int, said: Said) -> list[Timing]:
    """`time_all` without the first run of each kind."""
    return time_all([replace(process, kind=None) for process in processes], repeats, said)

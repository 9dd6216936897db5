"""What a solve says while it runs: iterations, silences, steps that take long."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from archord.commands import progress
from archord.commands.progress import Progress
from archord.scene.file import parse_any

RESULT = SimpleNamespace(residuals=[1.0, 2.5e-3], active_set_changes=[0, 7], krylov_iterations=0)
LINE = "step 1, attempt 1, load 0.5, iteration 1, residual 2.5e-03, 7 points changed"


@pytest.fixture
def clock(monkeypatch):
    """Seconds of a clock that the test sets; its output is no terminal."""
    now = SimpleNamespace(seconds=0.0)
    monkeypatch.setattr(progress, "perf_counter", lambda: now.seconds)
    monkeypatch.setattr(progress, "on_terminal", lambda: False)
    return now


def reporting(**options) -> Progress:
    press = {"name": "press", "on": "flat", "direction": "x", "displacement": 0.1}
    body = {"name": "lug", "E": 1.0, "nu": 0.3}
    return Progress(
        parse_any({"mesh": {"file": "x.msh"}, "body": [body], "load": [press]}), False, **options
    )


def test_verbose_tells_every_iteration(clock, capsys):
    report = reporting(verbose=True)
    for _ in range(2):
        report.iterate(0.5, RESULT)
    assert capsys.readouterr().out.count(LINE) == 2


def test_krylov_iterations_are_told_where_there_are_any(clock, capsys):
    """Of a solve by GMRES."""
    result = SimpleNamespace(**vars(RESULT) | {"krylov_iterations": 12})
    reporting(verbose=True).iterate(0.5, result)
    assert f"{LINE}, 12 GMRES iterations, " in capsys.readouterr().out


def test_a_long_silence_is_broken_once(clock, capsys):
    """A line every twenty seconds says where the solve is; a quick solve says none."""
    report = reporting()
    for clock.seconds in (1.0, 19.0, 21.0, 22.0, 40.0):
        report.iterate(0.5, RESULT)
    assert capsys.readouterr().out.count(LINE) == 1


@pytest.mark.parametrize(("seconds", "warned"), [(4.0, False), (5.0, False), (21.0, True)])
def test_a_step_much_longer_than_those_before_it_is_warned_of(
    clock, capsys, monkeypatch, seconds, warned
):
    """Twenty times their median, and five seconds."""
    report = reporting()
    monkeypatch.setattr(report, "columns", [])
    for step, taken in enumerate([1.0, 1.0, 1.0, seconds]):
        report.step(SimpleNamespace(step=step + 1, seconds=taken, iterations=30, cutbacks=2))
    said = capsys.readouterr().err
    assert ("step 4 took 21 s, 21 times the median of the steps before it" in said) == warned
    assert bool(said) == warned

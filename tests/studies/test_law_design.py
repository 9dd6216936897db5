"""The joints that the general law is fitted to: the recipe makes the sweep that was solved."""

from __future__ import annotations

import hashlib
import tomllib

import numpy as np
import pytest

from archord.cli import run
from archord.studies import law_design

SOLVED = "36a6e11167c5b6254fc68f35dbffa2ff08e7383eecaf45d4762d4ec2af901e92"  # SHA-256


def test_the_recipe_makes_the_sweep_that_was_solved(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """To the byte, by the command of docs/development/law_fit.md."""
    monkeypatch.setattr("sys.argv", ["law_design"])
    law_design.main()
    text = capsys.readouterr().out
    assert hashlib.sha256(text.encode()).hexdigest() == SOLVED
    assert len(tomllib.loads(text)["list"]) == 4241


def test_fresh_joints_are_a_sweep(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path
) -> None:
    """As many as asked for, each loaded to 3 dR; those that yield are unloaded; and the sweep
    command takes them."""
    monkeypatch.setattr("sys.argv", ["law_design", "--fresh", "12", "--seed", "3"])
    law_design.main()
    file = tmp_path / "fresh.sweep.toml"
    file.write_text(capsys.readouterr().out)
    rows = tomllib.loads(file.read_text())["list"]
    joints = {(row["joint"]["clearance"], row["block"]["nu"]) for row in rows}
    assert len(joints) == 12
    assert all(max(row["load"]["displacement"]) <= 3.0 for row in rows)
    for row in rows:
        x = np.array(row["load"]["displacement"])
        yields = "yield_stress" in row["block"] or "yield_stress" in row.get("pin", {})
        assert (np.diff(x) < 0).any() == (yields and "steps" not in row["load"])
    assert run(["sweep", str(file), "--dry-run"]) == 0
    assert f"{len(rows)} cases" in capsys.readouterr().out

"""The joints that the law's factors for friction and large strain are fitted to."""

from __future__ import annotations

import tomllib

import pytest

from archord.studies import factor_design


def rows(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *kinds: str) -> list:
    """The rows that the recipe prints for these ``kinds``."""
    monkeypatch.setattr("sys.argv", ["factor_design", *kinds])
    factor_design.main()
    return tomllib.loads(capsys.readouterr().out)["list"]


def test_both_kinds_share_the_joints_without(monkeypatch, capsys) -> None:
    """One sweep has the rows of both kinds, and those without friction and large strain once."""
    friction, large = (rows(monkeypatch, capsys, kind) for kind in factor_design.KINDS)
    both = rows(monkeypatch, capsys)
    without = friction[::2]
    assert large[::2] == without
    assert both == [
        row for each in zip(without, friction[1::2], large[1::2], strict=True) for row in each
    ]
    assert len(without) == sum(factor_design.JOINTS.values()) == 400
    for bare, slides, stretches in zip(both[::3], both[1::3], both[2::3], strict=True):
        own = slides["analysis"].pop("friction")
        assert 0.03 <= own <= 0.3
        assert stretches["analysis"].pop("strain") == "large"
        assert slides == stretches == bare | {"analysis": bare.get("analysis", {})}

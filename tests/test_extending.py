"""The recipes of docs/extending.md: what they show as Python runs, and what they name is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("code", re.findall(r"```python\n(.*?)```", PAGE, re.S))
def test_the_python_of_the_recipes_runs(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "extending.md", "exec"), {"__name__": "recipe"})
    assert "pull force" in capsys.readouterr().out


def test_the_files_that_the_recipes_name_are_there():
    files = set(re.findall(r"`((?:\w+/)+\w+\.\w+)`", PAGE))
    assert files
    assert not {file for file in files if not (ROOT / file).exists()}

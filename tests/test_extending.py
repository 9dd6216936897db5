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


def test_a_word_of_the_field_leads_to_its_file():
    """The table of docs/architecture.md: each file has the name that it gives."""
    plan = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = plan.partition("## Where the words are")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+) \| `([^`]+)` \| `([^`]+)` \|$", table, re.MULTILINE)
    assert len(rows) > 12
    for word, file, name in rows:
        assert name in (ROOT / file).read_text(encoding="utf-8"), word

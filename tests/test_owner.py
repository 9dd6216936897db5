"""What only the owner can supply is marked, and listed in one file."""

import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OWNER = ROOT / "paper" / "OWNER.md"
TEXTS = {".py", ".md", ".toml", ".yml", ".yaml", ".cff", ".bib"}
MADE = {".git", ".cache", "runs", "build", "archord", "scratch"}  # or links to rooms


def texts():
    for folder, folders, files in os.walk(ROOT):
        is_top = Path(folder) == ROOT
        folders[:] = [name for name in folders if not is_top or name not in MADE]
        yield from (Path(folder, name) for name in files if Path(name).suffix in TEXTS)


@pytest.mark.parametrize("mark", ["PLACEHOLDER", "archord.example"])
def test_every_placeholder_is_in_the_list(mark):
    said = OWNER.read_text(encoding="utf-8")
    for path in texts():
        if path in (OWNER, Path(__file__)):
            continue
        if mark in path.read_text(encoding="utf-8"):
            assert f"`{path.relative_to(ROOT)}`" in said


def test_the_bibliography_has_every_work_that_the_paper_cites():
    paper = (ROOT / "paper" / "paper.md").read_text(encoding="utf-8")
    works = (ROOT / "paper" / "paper.bib").read_text(encoding="utf-8")
    cited = re.findall(r"@([a-z]+\d{4}[a-z]*)", paper)
    keys = re.findall(r"^@\w+\{(\w+),", works, re.M)
    assert set(cited) == set(keys)

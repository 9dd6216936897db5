"""The names of docs/api.md have docstrings with sections, and their examples run."""

import doctest
import importlib
import inspect
import os
import re
from pathlib import Path

import pytest

import archord

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
NAMES = re.findall(r"^\.\. auto(?:function|class|exception):: (\S+)$", PAGE, re.MULTILINE)


def found(name):
    """The object of a dotted name."""
    module, _, last = name.rpartition(".")
    return getattr(importlib.import_module(module), last)


@pytest.mark.parametrize("name", NAMES)
def test_the_examples_of_a_public_name_run(name, tmp_path, monkeypatch):
    """In a folder with the scenes of the repository."""
    monkeypatch.chdir(tmp_path)
    os.symlink(ROOT / "scenes", tmp_path / "scenes")
    text = inspect.getdoc(found(name)) or ""
    test = doctest.DocTestParser().get_doctest(text, {}, name, None, 0)
    assert test.examples, f"{name} has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    assert runner.run(test).failed == 0


@pytest.mark.parametrize("name", NAMES)
def test_the_docstring_of_a_public_name_has_sections(name):
    """One line says what it is; then come parameters, and what it returns and raises."""
    given = found(name)
    text = inspect.getdoc(given) or ""
    first, _, rest = text.partition("\n")
    assert len(first) <= 100
    assert rest.startswith("\n")
    assert re.search(r"^Examples\n-{8}$", text, re.MULTILINE)
    if inspect.isfunction(given):
        for section in ("Parameters", "Returns", "Raises"):
            assert re.search(rf"^{section}\n-+$", text, re.MULTILINE), section


def test_every_public_name_is_on_the_page():
    missing = {f"archord.{name}" for name in archord.__all__} - set(NAMES)
    assert not missing

"""The names that a law can have in each language."""

from __future__ import annotations

import builtins
import keyword
import re
import sys
from pathlib import Path

from archord.postprocess.laws.exports.translate import FUNCTIONS
from archord.report.files import toml_beside

_WORDS = {name: {*words.split()} for name, words in toml_beside(__file__, "words.toml").items()} | {
    "python": {*keyword.kwlist, *sys.stdlib_module_names, *dir(builtins)}
}
_SPOKEN = {
    "python": "Python",
    "c": "C or C++",
    "modelica": "Modelica",
    "octave": "Matlab and Octave",
    "javascript": "JavaScript",
}
_LONGEST = 63  # characters of a name in Matlab, and those that C99 tells apart


def check_name(target: Path, language: str) -> None:
    """Raise ValueError if the stem of ``target`` cannot name a law in the ``language``."""
    name = target.stem
    fault = None
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        fault = "a name begins with a letter a to z, and has letters, digits and _"
    elif len(name) > _LONGEST:
        fault = f"it has {len(name)} characters, and a name has at most {_LONGEST}"
    elif name in FUNCTIONS:
        fault = "the file has a function of this name"
    elif name in _WORDS[language]:
        fault = f"it is a name that {_SPOKEN[language]} has already"
    if fault:
        raise ValueError(
            f"{target.name}: {name} cannot name a law: {fault}; choose another name for the file"
        )

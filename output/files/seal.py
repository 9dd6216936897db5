"""What run.json knows of the files of a run that has ended: their size and SHA-256, which tell of a
later change.

A run that goes on, or was killed, has no seals: its steps count as far as run.json has them. So
have runs of versions 0.1 and 0.2: their table of steps is compared with the steps of
run.json. The last line of run.json is the SHA-256 of the lines before it.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from archord.output.files.disk import naming
from archord.report.by_name import ByName, Words
from archord.report.errors import InputError
from archord.report.readable import json_of, require_file

SEALED = ("scene.toml", "history.csv", "mesh.npz", "contact.h5", "fields.h5")
TABLES = ("scene.toml", "history.csv")  # what a restart writes again from the other files
Seals = Mapping[str, Mapping[str, Any]]
_OWN = ',\n"sha256": "'
_END = '"\n}\n'
_CURES = {
    "scene.toml": "undo the change, or solve it into another folder",
    "history.csv": "archord solve {run} --restart writes it again",
}
_SOLVE_AGAIN = "archord solve {run}/scene.toml -o ANOTHER_FOLDER solves the run again"


class ChangedError(ValueError):
    """A run.json is not what the run wrote."""


def seals_of(folder: Path) -> dict[str, ByName]:
    """Bytes and SHA-256 by name of those files in ``folder`` that results are read from. Raises
    `OSError`."""
    apart = sorted(folder.glob("fields/[0-9]*.h5"))
    files = [path for path in [*(folder / name for name in SEALED), *apart] if path.is_file()]
    return {str(path.relative_to(folder)): _seal(path) for path in files}


def fault_of(folder: Path, name: str, seals: Seals, *, by_size: bool = False) -> str:
    """What happened to the file ``name`` since the run in ``folder`` ended, in words; nothing where
    it is what the run left, or no seal tells. ``by_size`` looks at the number of bytes alone."""
    if name not in seals:
        return ""
    seal = seals[name]
    path = folder / name
    try:
        size = path.stat().st_size
        if size != seal["bytes"]:
            known = f"has {size} bytes, not the {seal['bytes']} of run.json"
            return f"{known}: it was changed or cut short after the run"
        if not by_size and _seal(path) != seal:
            return "was changed after the run: its sha256 is not the one in run.json"
    except OSError as error:
        return f"cannot be read ({error.strerror})"
    except (KeyError, TypeError):
        return "has a seal in run.json that cannot be read"
    return ""


def require_intact(folder: Path, names: Iterable[str]) -> None:
    """Raise `InputError`, with what to do, if one of the files ``names`` is not what the run in
    ``folder`` left."""
    seals = _seals_in(folder)
    for name in names:
        if fault := fault_of(folder, name, seals):
            cure = _CURES.get(name, _SOLVE_AGAIN).format(run=folder)
            raise InputError(folder / name, f"{fault}; {cure}.")


def faults_of(folder: Path, seals: Seals) -> Words:
    """`fault_of` by name of all sealed files that have one; large files are known by their size."""
    found = {name: fault_of(folder, name, seals, by_size=name not in TABLES) for name in seals}
    return {name: fault for name, fault in found.items() if fault}


def report_text(content: Mapping[str, Any]) -> str:
    """``content`` as run.json has it: a line for each key, and one that seals them."""
    lines = [
        f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in content.items()
    ]
    text = "{\n" + ",\n".join(lines)
    return f"{text}{_OWN}{hashlib.sha256(text.encode()).hexdigest()}{_END}"


def read_report(path: Path) -> Any:
    """What the run.json ``path`` holds, without its own seal. Raises `OSError`, `ValueError` if it
    is no JSON, and `ChangedError` if it was changed after it was written."""
    text = require_file(path).read_bytes().decode()
    report = json_of(text)
    if not isinstance(report, dict) or "sha256" not in report:
        return report
    del report["sha256"]
    head = text.rpartition(_OWN)[0]
    if text != f"{head}{_OWN}{hashlib.sha256(head.encode()).hexdigest()}{_END}":
        raise ChangedError("it was changed after the run wrote it")
    return report


def _seals_in(folder: Path) -> Seals:
    """The seals in the run.json of ``folder`` as it is now; none if there is no such file."""
    try:
        known = (folder / "run.json").stat()
        return _read_seals(folder / "run.json", known.st_mtime_ns, known.st_size)
    except (OSError, ValueError):
        return {}


@lru_cache(maxsize=64)
def _read_seals(path: Path, changed: int, size: int) -> Seals:
    report = read_report(path)
    files = report.get("files", {}) if isinstance(report, dict) else {}
    return files if isinstance(files, dict) else {}


def sha256_of(path: Path) -> str:
    """The SHA-256 of the file ``path``, which is read again only if it was changed. Raises
    `OSError`."""
    known = path.stat()
    return _digest(path, known.st_mtime_ns, known.st_size, known.st_ino)


def _seal(path: Path) -> ByName:
    with naming(path):
        return {"bytes": path.stat().st_size, "sha256": sha256_of(path)}


@lru_cache(maxsize=4096)
def _digest(path: Path, changed: int, size: int, inode: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

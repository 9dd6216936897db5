"""The cases of a sweep: checked scenes, each with a name made from its content."""

from __future__ import annotations

import copy
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import archord
from archord.scene.errors import InputError
from archord.scene.file import parse_scene, put, read_targets, resolved
from archord.scene.scene import Scene
from archord.studies.design import ABSENT, combinations, factors, same_quantity, varied_keys
from archord.studies.sweep_file import Overrides, SweepFile, load_sweep

_MOST_SENTENCES = 20
_VALUE = re.compile(r"""^(\S+) = (?:"(?:[^"\\]|\\.)*"|\[.*?\]|\{.*?\}|\S+)""")
_MARK = "\0"  # the source of a scene, which is told apart later


@dataclass(frozen=True)
class Case:
    """Case ``number`` (from 1) of a sweep; ``run`` is the name of its run folder, the same for identical scenes."""

    number: int
    overrides: Overrides
    scene: Scene
    run: str

    def value(self, key: str) -> Any:
        """What the case's scene says for the dotted ``key``; None if nothing."""
        if key == "load.path":  # the scene holds the targets that were in the file
            return self.overrides.get(key)
        section, _, name = key.partition(".")
        return getattr(getattr(self.scene, section), name)


@dataclass(frozen=True)
class Sweep:
    """All cases of the sweep ``file``, read from ``path``, and the dotted keys that they vary."""

    path: Path
    file: SweepFile
    keys: list[str]
    cases: list[Case]

    @property
    def distinct(self) -> list[Case]:
        """The first case of every run."""
        return list({case.run: case for case in reversed(self.cases)}.values())[::-1]


def read_sweep(path: str | Path, overrides: Sequence[str] = ()) -> Sweep:
    """Read the sweep file ``path``, with ``overrides`` of its base, and check the scene of every case.

    Raises `InputError` with one sentence per fault.
    """
    path = Path(path)
    file = load_sweep(path, overrides)
    try:
        found = factors(file)
        rows = combinations(found)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    keys = varied_keys(found)
    for override in overrides:
        name = override.partition("=")[0].strip()
        varied = next((key for key in keys if key in same_quantity(name)), None)
        if varied:
            by = path if varied == name else f"{path} as {varied}"
            raise InputError(f"--set {override}: is varied by {by} already.")
    cases: list[Case] = []
    faults: dict[str, list[int]] = {}
    for number, row in enumerate(rows, 1):
        try:
            scene = _scene(file.base, row, path)
        except InputError as error:
            for sentence in str(error).splitlines():
                faults.setdefault(sentence, []).append(number)
        else:
            cases.append(Case(number, row, scene, run_name(scene)))
    if faults:
        given = [*keys, *(override.partition("=")[0].strip() for override in overrides)]
        raise InputError("\n".join(_told(faults, path, len(rows), file.base_file, given)))
    return Sweep(path, file, keys, cases)


def run_name(scene: Scene) -> str:
    """Twelve hexadecimal digits that stand for the resolved scene and the version of archord."""
    return hashlib.sha256(f"archord {archord.__version__}\n{resolved(scene)}".encode()).hexdigest()[:12]


def _scene(base: dict[str, Any], overrides: Overrides, path: Path) -> Scene:
    """The base with ``overrides``, checked; a sentence of a `InputError` begins with its key."""
    data = copy.deepcopy(base)
    # a rigid pin first: it drops the keys of the base's pin, not those of other overrides
    for key in sorted(overrides, key=lambda key: key != "pin.rigid"):
        section, _, name = key.partition(".")
        value = overrides[key]
        put(data, section, name, None if isinstance(value, str) and value == ABSENT else value, key)
    read_targets(data, path)
    try:
        return parse_scene(data, _MARK)
    except InputError as error:
        raise InputError(str(error).replace(f"{_MARK}: ", "")) from None


def _told(faults: dict[str, list[int]], path: Path, total: int, base: Path | None, given: list[str]) -> list[str]:
    """Each fault once, with the cases that have it, whatever their values; those of keys that are not ``given`` by the
    sweep are the ``base`` file's."""
    alike: dict[str, tuple[str, list[int]]] = {}
    for sentence, numbers in faults.items():
        alike.setdefault(_VALUE.sub(r"\1", sentence, 1), (sentence, []))[1].extend(numbers)
    sentences = []
    for sentence, numbers in list(alike.values())[:_MOST_SENTENCES]:
        key = sentence.split()[0].rstrip(":")
        every = len(set(numbers)) == total
        # a CSV file's sentence begins with its path
        own = "/" not in key and not any(f"{name}.".startswith(f"{key}.") for name in given)
        if every and own and base is not None:
            which = f"every case, by its base {base}"
        else:
            more = f" and {len(numbers) - 1} more" if len(numbers) > 1 else ""
            which = "every case" if every else f"case {min(numbers)}{more}"
        sentences.append(f"{path}: {which}: {sentence}")
    if len(alike) > _MOST_SENTENCES:
        sentences.append(f"{path}: has {len(alike) - _MOST_SENTENCES} more faults like these.")
    return sentences

"""The cases of a sweep: overrides, multiplied, and for each a checked scene with a name made from its content."""

from __future__ import annotations

import copy
import hashlib
import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.report.version import VERSION
from archord.scene.errors import InputError
from archord.scene.faults import shortened
from archord.scene.file import ALTERNATIVES, parse_scene, put, read_targets, resolved
from archord.scene.keys import toml_value
from archord.scene.scene import Scene
from archord.studies.sweep_file import LatinHypercube, Overrides, SweepFile, flattened, load_sweep

ABSENT = "none"  # the value that drops a key, so that its default holds
MOST_CASES = 100_000
_MOST_SENTENCES = 20
_DIGITS = 9  # of samples: short numbers that do not depend on the last bit of a machine's logarithm
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
    keys = list(dict.fromkeys(key for factor in found for key in factor.keys))
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


@dataclass(frozen=True)
class Factor:
    """One factor of the product: ``choices`` of overrides, and the section of the sweep file they come ``from``."""

    source: str
    choices: list[Overrides]

    @property
    def keys(self) -> list[str]:
        """All dotted keys that it varies."""
        return list(dict.fromkeys(key for choice in self.choices for key in choice))


def factors(sweep: SweepFile) -> list[Factor]:
    """What is multiplied, the slowest first: list, zip, each key of the grid, Latin hypercube.

    Raises `InputError` if two of them vary the same key, or a key cannot be one of a scene.
    """
    found = []
    if sweep.list_:
        found.append(Factor("[[list]]", [dict(choice) for choice in sweep.list_]))
    if sweep.zip:
        rows = zip(*sweep.zip.values(), strict=True)
        found.append(Factor("[zip]", [flattened(dict(zip(sweep.zip, row, strict=True))) for row in rows]))
    for key, values in sweep.grid.items():
        found.append(Factor("[grid]", [flattened({key: value}) for value in values]))
    if sweep.latin_hypercube is not None:
        found.append(Factor("[latin_hypercube]", samples(sweep.latin_hypercube)))
    _check_keys(found)
    return found


def samples(hypercube: LatinHypercube) -> list[Overrides]:
    """The samples of a Latin hypercube: of the ``number`` equal parts of each range every one holds one sample.

    The same seed gives the same samples.
    """
    from scipy.stats import qmc

    ranges = list(hypercube.ranges.values())
    generator = np.random.default_rng(hypercube.seed)
    points = qmc.LatinHypercube(d=len(ranges), seed=generator).random(hypercube.number)
    log = np.array([r.scale == "log" for r in ranges])
    ends = np.array([[r.low, r.high] for r in ranges])
    ends[log] = np.log(ends[log])
    values = ends[:, 0] + points * (ends[:, 1] - ends[:, 0])
    values[:, log] = np.exp(values[:, log])
    return [
        {key: float(f"{value:.{_DIGITS}g}") for key, value in zip(hypercube.ranges, row, strict=True)} for row in values
    ]


def combinations(found: list[Factor]) -> list[Overrides]:
    """The overrides of every case, the last factor varying fastest; those of the base, none, if nothing varies.

    Raises `InputError` if there are too many.
    """
    number = math.prod(len(factor.choices) for factor in found)
    if number > MOST_CASES:
        product = " x ".join(f"{len(factor.choices)}" for factor in found)
        raise InputError(f"has {number} cases ({product}); {MOST_CASES} are allowed.")
    rows = itertools.product(*(factor.choices for factor in found))
    return [dict(itertools.chain.from_iterable(choice.items() for choice in row)) for row in rows]


def _check_keys(found: list[Factor]) -> None:
    source: dict[str, tuple[str, str]] = {}
    for factor in found:
        for key in factor.keys:
            section, _, name = key.partition(".")
            if not name or "." in name:
                value = shortened(toml_value(next(choice[key] for choice in factor.choices if key in choice)), 60)
                raise InputError(f"{factor.source} {key} = {value}: must read section.key, like joint.clearance.")
            if section == "units":
                raise InputError(f"{factor.source} {key}: cannot vary; all cases of a table have the same units.")
        taken = {other: key for key in factor.keys for other in same_quantity(key)}
        for other, key in taken.items():
            if other in source:
                by, given = source[other]
                raise InputError(f"{factor.source} {key}: is varied by {by} {given} already.")
        source |= {other: (factor.source, key) for other, key in taken.items()}


def same_quantity(key: str) -> list[str]:
    """The key and its alternatives, of which a scene holds one."""
    section, _, name = key.partition(".")
    group = next((names for names in ALTERNATIVES.get(section, []) if name in names), (name,))
    return [f"{section}.{other}" for other in group]


def run_name(scene: Scene) -> str:
    """Twelve hexadecimal digits that stand for the resolved scene and the version of archord."""
    return hashlib.sha256(f"archord {VERSION}\n{resolved(scene)}".encode()).hexdigest()[:12]


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

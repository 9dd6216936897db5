"""The cases of a sweep: overrides, multiplied, and for each a checked scene with a name made from its content."""

from __future__ import annotations

import copy
import hashlib
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.report.version import VERSION
from archord.scene.errors import InputError
from archord.scene.file import ALTERNATIVES, parse_scene, put, read_targets, resolved, set_later
from archord.scene.scene import Scene
from archord.studies.sweep_file import ABSENT, LatinHypercube, Overrides, SweepFile, flattened, load_sweep

MOST_CASES = 100_000
_MOST_SENTENCES = 20
_DIGITS = 9  # of samples: short numbers that do not depend on the last bit of a machine's logarithm
Factor = tuple[str, list[Overrides]]  # of the product: its source in the sweep file, and its choices


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
    """Read the sweep file ``path``, with ``overrides`` of its base, and check the scene of every case. Raises
    `InputError` with one sentence per fault."""
    path = Path(path)
    file = load_sweep(path, overrides)
    varied = factors(file)
    given = {override.partition("=")[0].strip(): None for override in overrides}
    try:
        keys = _checked_keys([*varied, ("--set", [given])])
        rows = combinations(varied)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    cases: list[Case] = []
    faults: dict[str, list[int]] = {}
    for number, row in enumerate(rows, 1):
        try:
            scene = _scene(file.base, row, path)
        except InputError as error:
            for sentence in str(error).splitlines():
                faults.setdefault(sentence.removeprefix(f"{path}: "), []).append(number)
        else:
            cases.append(Case(number, row, scene, run_name(scene)))
    if faults:
        told = []
        for sentence, numbers in faults.items():
            more = f" and {len(numbers) - 1} more" if len(numbers) > 1 else ""
            which = "every case" if len(numbers) == len(rows) else f"case {numbers[0]}{more}"
            told.append(f"{path}: {which}: {sentence}")
        if len(told) > _MOST_SENTENCES:
            told[_MOST_SENTENCES:] = [f"{path}: has {len(told) - _MOST_SENTENCES} more faults."]
        raise InputError("\n".join(told))
    return Sweep(path, file, [key for key in keys if key not in given], cases)


def factors(sweep: SweepFile) -> list[Factor]:
    """What is multiplied, the slowest first: list, zip, each key of the grid, Latin hypercube."""
    found: list[Factor] = [("[[list]]", sweep.list_)] if sweep.list_ else []
    if sweep.zip:
        rows = zip(*sweep.zip.values(), strict=True)
        found.append(("[zip]", [flattened(dict(zip(sweep.zip, row, strict=True))) for row in rows]))
    found += [("[grid]", [flattened({key: value}) for value in values]) for key, values in sweep.grid.items()]
    if sweep.latin_hypercube is not None:
        found.append(("[latin_hypercube]", samples(sweep.latin_hypercube)))
    return found


def samples(hypercube: LatinHypercube) -> list[Overrides]:
    """The samples of a Latin hypercube, by its seed: each of the ``number`` equal parts of a range holds one."""
    from scipy.stats import qmc

    ranges, generator = hypercube.ranges, np.random.default_rng(hypercube.seed)
    columns = qmc.LatinHypercube(d=len(ranges), seed=generator).random(hypercube.number).T
    for k, r in enumerate(ranges.values()):
        low, high = np.log([r.low, r.high]) if r.scale == "log" else (r.low, r.high)
        values = low + columns[k] * (high - low)
        columns[k] = np.exp(values) if r.scale == "log" else values
    return [{key: float(f"{v:.{_DIGITS}g}") for key, v in zip(ranges, row, strict=True)} for row in columns.T]


def combinations(found: list[Factor]) -> list[Overrides]:
    """The overrides of every case, the last factor varying fastest. Raises `InputError` if there are too many."""
    number = math.prod(len(choices) for _, choices in found)
    if number > MOST_CASES:
        raise InputError(f"has {number} cases; {MOST_CASES} are allowed.")
    rows = itertools.product(*(choices for _, choices in found))
    return [dict(itertools.chain.from_iterable(choice.items() for choice in row)) for row in rows]


def _checked_keys(found: list[Factor]) -> list[str]:
    """All dotted keys that vary. Raises `InputError` for one that no scene has or that cannot vary, and for a quantity
    that two factors give."""
    keys: list[str] = []
    given: dict[tuple[str, str], str] = {}
    for source, choices in found:
        own: dict[tuple[str, str], str] = {}
        for key in dict.fromkeys(key for choice in choices for key in choice):
            section, _, name = key.partition(".")
            if not name or "." in name:
                raise InputError(f"{source} {key}: must read section.key, like joint.clearance.")
            if section == "units" and source != "--set":
                raise InputError(f"{source} {key}: cannot vary; all cases of a table have the same units.")
            # of alternative keys a scene holds one
            first = next((names[0] for names in ALTERNATIVES.get(section, []) if name in names), name)
            if (section, first) in given:
                raise InputError(f"{source} {key}: is varied by {given[section, first]} already.")
            own[section, first] = f"{source} {key}"
            keys.append(key)
        given |= own
    return keys


def run_name(scene: Scene) -> str:
    """Twelve hexadecimal digits that stand for the resolved scene and the version of archord."""
    return hashlib.sha256(f"archord {VERSION}\n{resolved(scene)}".encode()).hexdigest()[:12]


def _scene(base: dict[str, Any], overrides: Overrides, path: Path) -> Scene:
    """The base with ``overrides``, checked. Raises `InputError`."""
    data = copy.deepcopy(base)
    for key in sorted(overrides, key=set_later):
        section, _, name = key.partition(".")
        value = overrides[key]
        put(data, section, name, None if isinstance(value, str) and value == ABSENT else value, key)
    read_targets(data, path)
    return parse_scene(data, str(path))

"""From what a sweep varies to its cases: lists of overrides, multiplied."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from archord.scene.errors import InputError
from archord.scene.file import ALTERNATIVES
from archord.scene.keys import toml_value
from archord.studies.sweep_file import LatinHypercube, Overrides, SweepFile, flattened

ABSENT = "none"  # the value that drops a key, so that its default holds
MOST_CASES = 100_000
_DIGITS = 9  # of samples: short numbers that do not depend on the last bit of a machine's logarithm


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
        found.append(Factor("[zip]", [_choice(dict(zip(sweep.zip, row, strict=True))) for row in rows]))
    for key, values in sweep.grid.items():
        found.append(Factor("[grid]", [_choice({key: value}) for value in values]))
    if sweep.latin_hypercube is not None:
        found.append(Factor("[latin_hypercube]", samples(sweep.latin_hypercube)))
    _check_keys(found)
    return found


def _choice(overrides: Overrides) -> Overrides:
    """``overrides`` with values that are tables taken apart."""
    return flattened(overrides)


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


def number_of_cases(found: list[Factor]) -> int:
    """How many cases the product of the factors has; 1, the base itself, if nothing varies."""
    return math.prod(len(factor.choices) for factor in found)


def combinations(found: list[Factor]) -> list[Overrides]:
    """The overrides of every case, the last factor varying fastest. Raises `InputError` if there are too many."""
    number = number_of_cases(found)
    if number > MOST_CASES:
        product = " x ".join(f"{len(factor.choices)}" for factor in found)
        raise InputError(f"has {number} cases ({product}); {MOST_CASES} are allowed.")
    rows = itertools.product(*(factor.choices for factor in found))
    return [dict(itertools.chain.from_iterable(choice.items() for choice in row)) for row in rows]


def varied_keys(found: list[Factor]) -> list[str]:
    """All dotted keys that any case overrides, in order of appearance."""
    return list(dict.fromkeys(key for factor in found for key in factor.keys))


def _check_keys(found: list[Factor]) -> None:
    source: dict[str, tuple[str, str]] = {}
    for factor in found:
        for key in factor.keys:
            section, _, name = key.partition(".")
            if not name or "." in name:
                value = next(choice[key] for choice in factor.choices if key in choice)
                raise InputError(
                    f"{factor.source} {key} = {_short(value)}: must read section.key, like joint.clearance."
                )
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


def _short(value: Any) -> str:
    text = toml_value(value)
    return text if len(text) <= 60 else f"{text[:50]} ..."

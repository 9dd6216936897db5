"""A measured force-displacement curve: a CSV file of two columns in, checked numbers out."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.postprocess.laws.general.joint import Array
from archord.report.errors import InputError, shown
from archord.scene.file import read_text

FEWEST = 8  # points
_SEPARATORS = (";", "\t", ",")


@dataclass(frozen=True)
class MeasuredCurve:
    """A curve in the order in which it was measured, positive in compression.

    - ``displacement`` ``(n,)``: readings of the displacement
    - ``load`` ``(n,)``: readings of the force
    - ``said``: what was changed of the file's numbers
    - ``turned``: whether the displacements have the other sign in the file
    """

    displacement: Array
    load: Array
    said: tuple[str, ...] = ()
    turned: bool = False

    @property
    def deepest(self) -> Array:
        """The largest displacement up to each point ``(n,)``."""
        return np.maximum.accumulate(self.displacement)

    @property
    def largest(self) -> float:
        """The largest force."""
        return float(self.load.max())


def read_curve(
    path: Path,
    delta: str | None = None,
    load: str | None = None,
    units: tuple[str, str] | None = None,
) -> MeasuredCurve:
    """The curve in the file ``path``: its first two columns, or those of these headings.

    Columns are separated by semicolons, tabs, commas or blanks; but for commas, numbers may have a
    decimal comma. Lines that begin with # are comments. Rows without one of the numbers are left
    out. It is said where a heading has another unit in brackets than ``units``, of displacement and
    force. Raises `InputError`.
    """
    lines = [line for line in read_text(path).splitlines() if line.strip() and line[0] != "#"]
    separator = next((sign for sign in _SEPARATORS if lines and sign in lines[0]), None)
    cells = [[cell.strip().strip('"') for cell in line.split(separator)] for line in lines]
    if separator != ",":
        cells = [[cell.replace(",", ".") for cell in row] for row in cells]
    begin = next((k for k, row in enumerate(cells) if _is_number(row[0])), len(cells))
    heads = cells[0] if begin else []
    columns = [_column(path, heads, name, k) for k, name in enumerate((delta, load))]
    if columns[0] == columns[1]:
        fault = f"column {columns[0] + 1} is taken for displacement and force"
        raise InputError(f"{path}: {fault}; name both, by --delta and --load.")
    numbers = np.array([_numbers(path, row, columns) for row in cells[begin:]]).reshape(-1, 2)
    whole = np.isfinite(numbers).all(axis=1)
    if whole.sum() < FEWEST:
        fault = f"has {whole.sum()} rows with two numbers, and a fit needs {FEWEST} and more"
        raise InputError(f"{path}: {fault}.")
    said = []
    if units and heads:
        said += _other_units(path, [heads[column] for column in columns], units)
    if not whole.all():
        said.append(f"{path}: {(~whole).sum()} of {len(whole)} rows lack a number; left out")
    return _compressed(path, numbers[whole, 0], numbers[whole, 1], said)


def _is_number(cell: str) -> bool:
    """Whether ``cell`` is a number, nan or empty."""
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _column(path: Path, heads: list[str], name: str | None, default: int) -> int:
    """The index of the column headed ``name``, with or without a unit in brackets."""
    if name is None:
        return default
    plain = [re.split(r"[\[(]", head)[0].strip() for head in heads]
    for known in (heads, plain):
        if name in known:
            return known.index(name)
    there = f"its headings are {', '.join(heads)}" if heads else "it has no headings"
    raise InputError(f"{path}: has no column {name!r}; {there}.")


def _other_units(path: Path, heads: list[str], units: tuple[str, str]) -> list[str]:
    """What there is to say of ``heads`` whose unit in brackets is none of the ``units``."""
    said = []
    for head, unit in zip(heads, units, strict=True):
        found = re.search(r"[\[(]([^\])]*)[\])]", head)
        if found and found[1].strip() != unit:
            other = f"{path}: {head!r} has another unit than the scene, {unit}"
            said.append(f"{other}; its numbers are taken as they are")
    return said


def _numbers(path: Path, row: list[str], columns: list[int]) -> list[float]:
    """The two numbers of a ``row``; nan for a cell that is empty or not there."""
    found = []
    for column in columns:
        cell = row[column] if column < len(row) else ""
        if not _is_number(cell):
            raise InputError(f"{path}: must have numbers below its headings, not {shown(cell)}.")
        found.append(float(cell or math.nan))
    return found


def _compressed(path: Path, displacement: Array, load: Array, said: list[str]) -> MeasuredCurve:
    """The curve with signs that are positive in compression."""
    if np.ptp(load) == 0 or np.ptp(displacement) == 0:
        raise InputError(f"{path}: its forces or its displacements are all the same.")
    if -load.min() > load.max():
        load = -load
        said.append(f"{path}: its forces are negative, and are taken as compression")
    turned = bool(np.corrcoef(displacement, load)[0, 1] < 0)
    if turned:
        displacement = -displacement
        said.append(f"{path}: its displacements fall while forces rise, and are turned round")
    return MeasuredCurve(displacement, load, tuple(said), turned)

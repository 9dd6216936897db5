"""A measured force-displacement curve: a CSV file of two columns in, checked numbers out."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.materials.material import Array
from archord.report.by_name import Names
from archord.report.errors import InputError, shown
from archord.scene.file import read_text

FEWEST = 8  # points
_SEPARATORS = (";", "\t", ",")
_COMMA = re.compile(r"[-+]?\d+(,\d+)+(\.\d*)?(e[-+]?\d+)?", re.IGNORECASE)
# a unit behind a name: in brackets, or known, as in "F / kN" and "F in kN"
_UNIT = re.compile(r"[\[(]([^\])]*)|(?:/|\sin\s)\s*([kM]?N(?:/m?m)?|[cmuµ]?m|kgf?|lbf?|inch)$")


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
    said: Names = ()
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
    decimal comma. Lines that begin with # are comments, and so is a first line ``sep=;`` for Excel.
    Rows without one of the numbers are left out, and a row that repeats the one before is counted
    once. It is said where a heading has another unit in brackets than ``units``, of displacement
    and force, or the line of units below the headings. Raises `InputError`, also for rows with more
    cells than there are columns, and for commas beside points in numbers.
    """
    lines = [line for line in read_text(path).splitlines() if line.strip() and line[0] != "#"]
    if lines and lines[0].startswith("sep="):  # for Excel
        del lines[0]
    separator = next((sign for sign in _SEPARATORS if lines and sign in lines[0]), None)
    cells = [_cells(line, separator) for line in lines]
    if separator != ",":
        cells = [[cell.replace(",", ".") for cell in row] for row in cells]
    begin = next((k for k, row in enumerate(cells) if not _is_heading(row)), len(cells))
    heads = cells[0] if begin else []
    columns = [_column(path, heads, name, k) for k, name in enumerate((delta, load))]
    if columns[0] == columns[1]:
        fault = f"column {columns[0] + 1} is taken for displacement and force"
        raise InputError(path, f"{fault}; name both, by --delta and --load.")
    if any(column < len(heads) and not heads[column] for column in columns):
        fault = "has a column without a heading, as of a table's index, among the first two"
        raise InputError(path, f"{fault}; name both, by --delta and --load.")
    _require_one_reading(path, separator, lines, cells, begin, columns)
    numbers = np.array([_numbers(path, row, columns) for row in cells[begin:]]).reshape(-1, 2)
    whole = np.isfinite(numbers).all(axis=1)
    if whole.sum() < FEWEST:
        fault = f"has {whole.sum()} rows with two numbers, and a fit needs {FEWEST} and more"
        raise InputError(path, f"{fault}.")
    said = []
    if len(heads) > 2 and delta is None and load is None:
        first, second = (heads[column] for column in columns)
        taken = f"{first!r} is taken for the displacement and {second!r} for the force"
        said.append(f"{path}: of {len(heads)} columns {taken}; --delta and --load name others")
    for k, row in enumerate(cells[:begin]):
        named = [row[column] if column < len(row) else "" for column in columns]
        if units:
            said += _other_units(path, named, units, are_units=k > 0)
    if not whole.all():
        said.append(f"{path}: {(~whole).sum()} of {len(whole)} rows lack a number; left out")
    return _compressed(path, numbers[whole, 0], numbers[whole, 1], said)


def _cells(line: str, separator: str | None) -> list[str]:
    """The cells of a ``line``, in which quotes hold separators; alone, as a quote without a second
    one would take in the next lines."""
    row = next(csv.reader([line], delimiter=separator)) if separator else line.split()
    return [cell.strip().strip('"') for cell in row]


def _is_number(cell: str) -> bool:
    """Whether ``cell`` is a number, nan or empty."""
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _is_heading(row: list[str]) -> bool:
    """Whether a ``row`` has no numbers; the first column may be an index, whose heading is
    empty."""
    is_index = not row[0] and not all(map(_is_number, row))
    return is_index or not _is_number(row[0])


def _column(path: Path, heads: list[str], name: str | None, default: int) -> int:
    """The index of the column headed ``name``, with or without a unit in brackets."""
    if name is None:
        return default
    plain = [re.split(r"[\[(]|\s/\s|\sin\s", head)[0].strip() for head in heads]
    for known in (heads, plain):
        if known.count(name) > 1:
            raise InputError(path, f"has {known.count(name)} columns headed {name!r}.")
        if name in known:
            return known.index(name)
    there = f"its headings are {', '.join(heads)}" if heads else "it has no headings"
    raise InputError(path, f"has no column {name!r}; {there}.")


def _require_one_reading(
    path: Path,
    separator: str | None,
    lines: list[str],
    cells: list[list[str]],
    begin: int,
    columns: list[int],
) -> None:
    """Raise `InputError` where a comma or a point can be a decimal one and one of thousands."""
    quoted = [cell for row in cells for cell in row if separator == "," and _COMMA.fullmatch(cell)]
    if quoted:
        fault = f'has commas between columns and in the number "{quoted[0]}"'
        raise InputError(path, f"{fault}, for decimals or between thousands; write it without one.")
    rows = cells[begin:]
    width = len(cells[max(begin - 1, 0)]) if cells else 0
    longer = [k for k, row in enumerate(rows) if any(row[width:])]
    if longer:
        k = longer[0]
        fault = f"has {len(rows[k])} cells in the line {shown(lines[begin + k])}"
        cure = "a decimal comma needs columns that are separated by semicolons or tabs"
        raise InputError(path, f"{fault}, and no more than {width} before; {cure}.")
    if separator == ",":
        if begin == 0 and width > 2:
            fault = f"has no headings and {width} columns between commas"
            raise InputError(path, f"{fault}, which may be decimal ones; give it headings.")
        return
    given = [line.split(separator) for line in lines[begin:]]
    numbers = [row[column] for row in given for column in columns if column < len(row)]
    if any("," in number for number in numbers) and any("." in number for number in numbers):
        fault = "has numbers with a comma and numbers with a point"
        raise InputError(path, f"{fault}; write them without signs between thousands.")


def _other_units(
    path: Path, heads: list[str], units: tuple[str, str], *, are_units: bool
) -> list[str]:
    """What there is to say of ``heads`` whose unit in brackets is none of the ``units``, or which
    ``are_units`` themselves, with or without brackets."""
    said = []
    for head, unit in zip(heads, units, strict=True):
        found = None if are_units else _UNIT.search(head)
        named = (found[found.lastindex or 0] if found else head * are_units).strip(" []()")
        if named and named != unit:
            other = f"{path}: {head!r} has another unit than the scene, {unit}"
            said.append(f"{other}; its numbers are taken as they are")
    return said


def _numbers(path: Path, row: list[str], columns: list[int]) -> list[float]:
    """The two numbers of a ``row``; nan for a cell that is empty or not there."""
    found = []
    for column in columns:
        cell = row[column] if column < len(row) else ""
        if not _is_number(cell):
            raise InputError(path, f"must have numbers below its headings, not {shown(cell)}.")
        found.append(float(cell or math.nan))
    return found


def _compressed(path: Path, displacement: Array, load: Array, said: list[str]) -> MeasuredCurve:
    """The curve with signs that are positive in compression."""
    if np.ptp(load) == 0 or np.ptp(displacement) == 0:
        raise InputError(path, "its forces or its displacements are all the same.")
    moves = (np.diff(displacement) != 0) | (np.diff(load) != 0)
    is_new = np.append(True, moves)
    if is_new.sum() < FEWEST:
        fault = f"has {is_new.sum()} rows that differ from the row before"
        raise InputError(path, f"{fault}, and a fit needs {FEWEST} and more.")
    if not is_new.all():
        repeated = (~is_new).sum()
        said.append(f"{path}: {repeated} of {len(load)} rows repeat the row before; counted once")
    displacement = displacement[is_new]
    load = load[is_new]
    if -load.min() > load.max():
        load = -load
        said.append(f"{path}: its forces are negative, and are taken as compression")
    turned = bool(np.corrcoef(displacement, load)[0, 1] < 0)
    if turned:
        displacement = -displacement
        said.append(f"{path}: its displacements fall while forces rise, and are turned round")
    return MeasuredCurve(displacement, load, tuple(said), turned)

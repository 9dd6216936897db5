"""What the simulations of ``python3 -m archord.benchmarks.finding`` gave, one row a joint: finding.csv and its reader.

All are in units of R = E* = 1 with one Poisson's ratio for both bodies, elements of 4 %R on the arcs, and steps of 0.1
dR up to 2 dR. k and c are those of the plastic-Winkler law fitted to P from 0.1 to 2 dR.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array

LOADS = np.linspace(0.1, 2.0, 20)  # delta/dR of the columns P(...)
TABLE = Path(__file__).parent / "finding.csv"
_NUMBERS = ("nu", "ratio", "s", "clearance", "k", "k_error", "c", "c_error", "r2", "p0_over_sigY", "plateau")
_WORDS = ("joint", "plane", "yielding", "kinematics")


@dataclass(frozen=True)
class FindingRow:
    """One joint: ``ratio`` = E of pin over E of block (inf: rigid pin), ``s`` = sigY R/(E* dR) (inf: elastic).

    ``yielding`` is "both", "block", "pin" or "none", ``c`` nan where too few steps have yielded, ``plateau`` the mean
    of the median pressure over sigY, ``P`` the force over E* dR at `LOADS` ``(20,)``.
    """

    joint: str
    plane: str
    yielding: str
    kinematics: str
    nu: float
    ratio: float
    s: float
    clearance: float
    k: float
    k_error: float
    c: float
    c_error: float
    r2: float
    p0_over_sigY: float
    plateau: float
    P: Array


def read_rows(file: Path = TABLE) -> list[FindingRow]:
    """The rows of ``file``, by default those that come with archord."""
    with file.open(encoding="utf-8", newline="") as stream:
        return [_row(entries) for entries in csv.DictReader(stream)]


def _row(entries: dict[str, str]) -> FindingRow:
    values: dict[str, Any] = {name: entries[name] for name in _WORDS}
    values |= {name: float(entries[name]) for name in _NUMBERS}
    return FindingRow(**values, P=np.array([float(entries[name]) for name in _columns()]))


def write_rows(rows: Iterable[FindingRow], file: Path) -> None:
    """Write ``rows`` as `read_rows` reads them, seven digits each."""
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([*_WORDS, *_NUMBERS, *_columns()])
        for row in rows:
            numbers = [*(getattr(row, name) for name in _NUMBERS), *row.P]
            writer.writerow([*(getattr(row, name) for name in _WORDS), *(f"{value:.7g}" for value in numbers)])


def _columns() -> list[str]:
    return [f"P({load:.1f})" for load in LOADS]

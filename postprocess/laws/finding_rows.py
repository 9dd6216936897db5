"""What ``python3 -m archord.benchmarks.paper.finding`` found, one row a joint: finding.csv and its reader.

All are in units of R = E* = 1 with one Poisson's ratio for both bodies, elements of 4 %R on the arcs, and steps of 0.1
dR up to 2 dR. k and c are those of the plastic-Winkler law fitted to P from 0.1 to 2 dR.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.laws.chord_laws import plastic_force
from archord.postprocess.laws.law_joint import LawJoint

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

    def joint_with(self, k: float, c: float) -> LawJoint:
        """The joint in units of R = E* = 1, with these coefficients of the plastic-Winkler law."""
        alpha = 1.0 if math.isinf(self.ratio) else (self.ratio - 1) / (self.ratio + 1)
        stress = None if math.isinf(self.s) else self.s * self.clearance
        return LawJoint(1.0, self.clearance, 1.0, stress, k=k, c=c if math.isfinite(c) else 1.0, dundurs_alpha=alpha,
                        plane=self.plane, nu=self.nu,
                        yielding="both" if self.yielding == "none" else self.yielding)  # fmt: skip

    def force_error(self, k: float, c: float) -> Array:
        """``P of the law/P - 1`` at `LOADS` ``(20,)``; elastic where c is not finite."""
        joint = self.joint_with(k, c)
        law = plastic_force(joint if math.isfinite(c) else replace(joint, yield_stress=None), LOADS * self.clearance)
        return law / self.clearance / self.P - 1


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

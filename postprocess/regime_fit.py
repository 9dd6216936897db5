"""The coefficients of the regime law from the rows of the finding."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.chord_laws import plastic_force
from archord.postprocess.finding_rows import LOADS, FindingRow
from archord.postprocess.law_joint import LawJoint
from archord.postprocess.regime_law import RegimeFit, basis

KINDS = (("strain", "none"), ("strain", "both"), ("strain", "block"),
         ("stress", "none"), ("stress", "both"), ("stress", "block"))  # fmt: skip
_LATE = LOADS > 0.45
_FITTED = 0.005  # dR/R of the rows that are fitted; the others serve to judge


def fit_regimes(rows: list[FindingRow]) -> tuple[RegimeFit, ...]:
    """Least squares of ln k and ln c for each plane and kind of yielding, five digits each, with their errors."""
    return tuple(_fit([row for row in rows if _kind(row) == kind], *kind) for kind in KINDS)


def _kind(row: FindingRow) -> tuple[str, str]:
    return (row.plane, row.yielding) if row.kinematics == "current" else ("", "")


def alpha(row: FindingRow) -> float:
    """Dundurs' alpha of a row."""
    return 1.0 if math.isinf(row.ratio) else (row.ratio - 1) / (row.ratio + 1)


def row_joint(row: FindingRow, k: float, c: float) -> LawJoint:
    """A row's joint in units of R = E* = 1, with these coefficients."""
    stress = None if math.isinf(row.s) else row.s * row.clearance
    return LawJoint(1.0, row.clearance, 1.0, stress, k=k, c=c if math.isfinite(c) else 1.0)


def _fit(rows: list[FindingRow], plane: str, yielding: str) -> RegimeFit:
    # rows that yield too late for a c say nothing of the plastic k either
    used = [row for row in rows if yielding == "none" or math.isfinite(row.c)]
    thin = [row for row in used if row.clearance == _FITTED]
    terms = np.array([basis(plane, yielding, row.s, row.nu, alpha(row)) for row in thin])
    ln_k = _solve(terms, [row.k for row in thin])
    ln_c = _solve(terms, [row.c for row in thin]) if yielding != "none" else ()
    bounds = [(_rounded(min(v)), _rounded(max(v))) for v in zip(*((r.s, r.nu, alpha(r)) for r in thin), strict=True)]
    found = RegimeFit(plane, yielding, len(thin), ln_k, ln_c, bounds[0], bounds[1], bounds[2], 0.0, 0.0, 0.0, 0.0, 0.0)
    values = [found.coefficients(row.s, row.nu, alpha(row)) for row in used]
    force = np.array([force_error(row, *kc) for row, kc in zip(used, values, strict=True)])
    k, c = (np.array([getattr(row, name) for row in used]) for name in "kc")
    by_law = np.array(values).T
    errors = {
        "k_error": np.abs(by_law[0] / k - 1).max(),
        "c_error": np.abs(by_law[1] / c - 1).max() if yielding != "none" else 0.0,
        "P_error": np.abs(force[:, _LATE]).max(),
        "P_rms": np.sqrt((force[:, _LATE] ** 2).mean()),
        "P_early": np.abs(force[:, ~_LATE]).max(),
    }
    return replace(found, **{name: round(float(value), 4) for name, value in errors.items()})


def force_error(row: FindingRow, k: float, c: float) -> Array:
    """Relative difference of the law with ``k`` and ``c`` from a row's simulated force at `LOADS` ``(20,)``."""
    law = plastic_force(row_joint(row, k, c), LOADS * row.clearance) / row.clearance
    return law / row.P - 1


def _solve(terms: Array, values: list[float]) -> tuple[float, ...]:
    found, _, rank, _ = np.linalg.lstsq(terms, np.log(values), rcond=None)
    if rank < terms.shape[1]:
        raise ValueError(f"{len(terms)} joints cannot tell {terms.shape[1]} coefficients")
    return tuple(_rounded(float(value)) for value in found)


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")

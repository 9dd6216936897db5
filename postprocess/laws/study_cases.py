"""The cases of the study behind the calibrated law: a table of fitted joints, in memory, as a CSV file, and printed.

Everything in it is dimensionless, so cases of different units and sizes stand side by side.
"""

from __future__ import annotations

import hashlib
import io
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from archord.postprocess.convergence import Refined
from archord.postprocess.laws.calibrated import SOFT, SOFT_WORDS, UNFIT, equivalent_nu
from archord.postprocess.laws.calibration import fit_curve
from archord.postprocess.laws.joint import LawJoint
from archord.report.table import Table
from archord.scene.errors import InputError

Cases: TypeAlias = pd.DataFrame  # with the columns of `COLUMNS` and of `table_of`

HELD_OUT = 0.15
COLUMNS = {  # of a case, with the heading in its file
    "run": "run",
    "plane": "plane",
    "yielding": "yielding",  # "none", "both", "block", "pin" or "unlike"
    "ratio": "E1/E2",  # E of the pin over E of the block; infinite: a rigid pin
    "pin_nu": "nu1",  # nan: a rigid pin
    "nu": "nu2",
    "clearance": "dR/R",
    "strength": "sigY/E*",  # of the weaker body; infinite: elastic
    "mesh": "h/R",  # element size on the arcs
    "k": "k",
    "k_error": "k s.e.",
    "k_mesh": "k mesh",  # error of the mesh; nan: there was but one
    "c": "c",  # nan: too few steps have yielded
    "c_error": "c s.e.",
    "c_mesh": "c mesh",
    "rms": "rms",  # of law/run - 1 with the joint's own k and c
    "largest": "largest",
    "load": "delta/dR",  # of the steps fitted, an array
    "P": "P/(E* dR)",
}
_CURVES = ("load", "P")
_TYPES = {name: str if name in ("run", "plane", "yielding") else float for name in COLUMNS if name not in _CURVES}
_CLEAR = 0.65  # of the largest load: where the plateau must have begun for c to count
_SHORT = 0.99  # of the largest load of the sweep, that a case must have reached


def fit_case(refined: Refined, load_range: tuple[float, float], name: str) -> dict[str, Any]:
    """Fit k and c to P(delta) of a joint, over ``load_range`` in clearances: a case ``name``. Raises `InputError`
    where the range or the steps do not allow a fit."""
    run = refined.run
    if run.scene.pin.whole:
        raise InputError(f"{run.name}: pin.whole = true does not fit: k and c of a sweep are those of half a pin.")
    force, pin, block = fit_curve([refined], load_range), run.scene.pin, run.scene.block
    _, rms, largest, _ = force.quality
    case = {
        "run": name,
        "plane": run.plane,
        "yielding": "none" if run.sigY is None else LawJoint.from_scene(run.scene).yielding,
        "ratio": math.inf if pin.E is None else pin.E / block.E,
        "pin_nu": pin.nu,
        "nu": block.nu,
        "clearance": run.dR / run.R,
        "strength": math.inf if run.sigY is None else run.sigY / run.E_star,
        "mesh": run.scene.joint.h / run.R,
        "rms": rms,
        "largest": largest,
        "load": force.residuals[0].load,
        "P": force.residuals[0].data,
    }
    for of, found in force.estimates.items():
        case |= {of: found.value, f"{of}_error": found.standard_error, f"{of}_mesh": found.discretisation_error}
    return case


def table_of(cases: Iterable[dict[str, Any]]) -> Cases:
    """The table of ``cases``, with what follows from their numbers: ``kind``, Dundurs' ``alpha``, ``m`` and ``n`` of
    pin and block, ``s = sigY R/(E* dR)``, a ``digest``, the same for a joint wherever it stands and random otherwise,
    and ``clear_c``: c where the plateau fills the last third of the range or more, else nan, as one that begins later
    hardly shows in P, and the fit then takes c to mend the shape of the curve."""
    found = pd.DataFrame(cases, columns=list(COLUMNS)).astype(_TYPES)
    found["kind"] = found.plane + " " + found.yielding
    strain, pin_nu = found.plane == "strain", found.pin_nu.fillna(found.nu)
    found["m"], found["n"] = equivalent_nu(strain, pin_nu), equivalent_nu(strain, found.nu)
    moduli = found.ratio * np.where(strain, (1 - found.nu**2) / (1 - pin_nu**2), 1.0)
    found["alpha"] = ((moduli - 1) / (moduli + 1)).fillna(1.0)
    found["s"] = found.strength / found.clearance
    longest = found.load.map(lambda load: load[-1])
    found["clear_c"] = found.c.where(found.c * found.s / found.k <= _CLEAR * longest)
    numbers = found[["ratio", "pin_nu", "nu", "clearance", "strength"]].to_numpy()
    said = [" ".join([kind, *(f"{value:.5g}" for value in row)]) for kind, row in zip(found.kind, numbers, strict=True)]
    found["digest"] = [hashlib.sha256(name.encode()).hexdigest() for name in said]
    return found


def as_csv(cases: Cases, notes: dict[str, str]) -> str:
    """The text of a file of ``cases``, with seven digits, below ``notes`` on where they are from."""
    shown = cases[list(COLUMNS)].rename(columns=COLUMNS)
    for name in _CURVES:
        shown[COLUMNS[name]] = [" ".join(f"{value:.7g}" for value in curve) for curve in cases[name]]
    said = "".join(f"# {name}: {value}\n" for name, value in notes.items())
    return said + shown.to_csv(index=False, float_format="%.7g", lineterminator="\n")


def _from_csv(text: str) -> tuple[Cases, dict[str, str]]:
    """What `as_csv` made a ``text`` of. Raises ValueError or KeyError if it made none."""
    types = {COLUMNS[name]: kind for name, kind in _TYPES.items()}
    curves = {COLUMNS[name]: lambda numbers: np.array(numbers.split(), float) for name in _CURVES}
    rows = pd.read_csv(io.StringIO(text), comment="#", dtype=types, converters=curves, float_precision="round_trip")
    notes = dict(line[1:].strip().split(": ", 1) for line in text.split("\n") if line[:1] == "#")
    return table_of(rows.rename(columns={heading: name for name, heading in COLUMNS.items()})[list(COLUMNS)]), notes


def stored(cases: list[dict[str, Any]], notes: dict[str, str]) -> tuple[Cases, dict[str, str]]:
    """The table of ``cases`` with the digits of its file, so that it is the same whether it is read or not."""
    return _from_csv(as_csv(table_of(cases), notes))


def read_cases(file: Path) -> tuple[Cases, dict[str, str]]:
    """The cases in ``file``, and what it says about where they are from. Raises `InputError` if it cannot be read, or
    holds no case."""
    try:
        cases, notes = _from_csv(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}.") from None
    except (ValueError, KeyError):
        raise InputError(f"{file}: cannot be read as the fitted cases of a sweep, fit.csv.") from None
    if not len(cases):
        raise InputError(f"{file}: holds no case.")
    return cases, notes


def usable(cases: Cases) -> tuple[Cases, list[tuple[str, str]]]:
    """The cases that a model can be fitted to, and the runs of the others with the reason."""
    longest, out = max(load[-1] for load in cases.load), {}
    for case in cases.itertuples():
        softness, end = (1 - case.alpha) / 2 * case.m, case.load[-1]
        if case.yielding in UNFIT:
            out[case.Index] = UNFIT[case.yielding]
        elif softness > SOFT + 1e-3:
            out[case.Index] = f"{SOFT_WORDS} = {softness:.3g} is more than {SOFT:g}: a soft pin, hardly compressible"
        elif end < _SHORT * longest:
            out[case.Index] = f"ends at {end:.3g} dR, others at {longest:.3g}"
    return cases.drop(index=list(out)), [(cases.run[index], reason) for index, reason in out.items()]


def split(cases: Cases) -> tuple[Cases, Cases]:
    """Cases to fit and to choose a form with, and `HELD_OUT` of each kind to judge the result by at the end: always
    the same ones, by the numbers of the joint themselves."""
    groups = cases.sort_values("digest").groupby("kind")
    held = [index for _, same in groups for index in same.index[: round(HELD_OUT * len(same))]]
    chosen = cases.index.isin(held)
    return cases[~chosen], cases[chosen]


def joint_of_case(case: Any, k: float, c: float) -> LawJoint:
    """The joint of a ``case`` in units of R = E* = 1 with these coefficients; elastic where c is nan or infinite."""
    plastic = math.isfinite(c) and math.isfinite(case.strength)
    strength, yields = case.strength if plastic else None, case.yielding
    return LawJoint(1.0, case.clearance, 1.0, None if yields == "block" else strength,
                    None if yields == "pin" else strength, k=k, c=c if plastic else 1.0,
                    pin_share=(1 - case.alpha) / 2, plane=case.plane, nu=case.nu,
                    pin_nu=None if math.isnan(case.pin_nu) else case.pin_nu)  # fmt: skip


def case_table(cases: Cases) -> Table:
    """One row per case: what decides it, k and c with their errors, and rms and largest of ``law/run - 1``."""
    shown = dict.fromkeys(("ratio", "pin_nu", "nu", "clearance", "strength"), ".4g")
    for name in "kc":
        shown |= {name: ".4f", f"{name}_error": ".1e"}
        shown |= {f"{name}_mesh": ".1e"} if cases.k_mesh.notna().any() else {}
    shown |= {"rms": ".1%", "largest": "+.1%"}
    columns = [[format(value, form) if math.isfinite(value) else "-" for value in cases[name]]
               for name, form in shown.items()]  # fmt: skip
    headings = ("plane", "yields", *(COLUMNS[name] for name in shown))
    return Table("run", *headings, rows=zip(cases.run, cases.plane, cases.yielding, *columns, strict=True))

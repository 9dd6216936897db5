"""The study behind the calibrated law: fitted joints, a model of their k and c, and how good it is on unseen ones.

The joints are cases, rows of a table that a CSV file keeps. Everything in it is dimensionless, so cases of different
units and sizes stand side by side. `study` makes a `CalibratedModel` of many, with its errors.
"""

from __future__ import annotations

import hashlib
import io
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from archord.postprocess.laws.calibrated import (
    SOFT,
    SOFT_WORDS,
    UNFIT,
    CalibratedModel,
    Kind,
    Points,
    dundurs_alpha,
    joint_calibrated,
    shipped_model,
)
from archord.postprocess.laws.chord_laws import plastic_force
from archord.postprocess.laws.joint import Array, LawJoint
from archord.scene.errors import InputError

Cases: TypeAlias = pd.DataFrame  # with the columns of `COLUMNS` and of `table_of`
Form = dict[str, Any]
Errors = dict[str, dict[str, Any]]  # by plane and yielding ("strain block", "both all"): `summary` of errors

KINDS: tuple[Kind, ...] = tuple((plane, yielding) for plane in ("strain", "stress")
                                for yielding in ("none", "both", "block"))  # fmt: skip
FORM: Form = shipped_model().data["form"]  # which products of what decides a joint count, see `CalibratedModel`
LATE = 0.45  # delta/dR from which errors of P count; the contact is Hertz's before
FOLDS = 10
HELD_OUT = 0.15
CSV_BEGINS = "# archord: "  # by which a file of `as_csv` is known
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
    "plateau": "plateau",  # median pressure over sigY; nan: none was measured
    "rms": "rms",  # of law/run - 1 with the joint's own k and c
    "largest": "largest",
    "load": "delta/dR",  # of the steps fitted, an array
    "P": "P/(E* dR)",
}
_CURVES = ("load", "P")
_TYPES = {name: str if name in ("run", "plane", "yielding") else float for name in COLUMNS if name not in _CURVES}
_PLENTY = 2  # cases per coefficient without which nothing is fitted
_CLEAR = 0.65  # of the largest load: where the plateau must have begun for c to count
_SHORT = 0.99  # of the largest load of the sweep, that a case must have reached


def table_of(cases: Iterable[dict[str, Any]]) -> Cases:
    """The table of ``cases``, with what follows from their numbers: Dundurs' ``alpha``, ``s = sigY R/(E* dR)``, a
    ``digest``, the same for a joint wherever it stands and random otherwise, and ``clear_c``.

    The last is c where the plateau fills the last third of the range or more, else nan: one that begins later hardly
    shows in P, and the fit then takes c to mend the shape of the curve.
    """
    found = pd.DataFrame(cases, columns=list(COLUMNS)).astype(_TYPES)
    found["alpha"] = [dundurs_alpha(case.plane, case.ratio, case.pin_nu, case.nu) for case in found.itertuples()]
    found["s"] = found.strength / found.clearance
    longest = found.load.map(lambda load: load[-1])
    found["clear_c"] = found.c.where(found.c * found.s / found.k <= _CLEAR * longest)
    numbers = found[["ratio", "pin_nu", "nu", "clearance", "strength"]].to_numpy()
    said = [" ".join(f"{value:.5g}" for value in row) for row in numbers]
    names = found.plane + " " + found.yielding + " " + pd.Series(said, found.index, dtype=str)
    found["digest"] = [hashlib.sha256(name.encode()).hexdigest() for name in names]
    return found


def as_csv(cases: Cases, notes: dict[str, str]) -> str:
    """The text of a file of ``cases``, with seven digits, below ``notes`` on where they are from."""
    shown = cases[list(COLUMNS)].rename(columns=COLUMNS)
    for name in _CURVES:
        shown[COLUMNS[name]] = [" ".join(f"{value:.7g}" for value in curve) for curve in cases[name]]
    said = "".join(f"# {name}: {value}\n" for name, value in notes.items())
    return said + shown.to_csv(index=False, float_format="%.7g", lineterminator="\n")


def from_csv(text: str) -> tuple[Cases, dict[str, str]]:
    """What `as_csv` made a ``text`` of. Raises ValueError or KeyError if it made none."""
    types = {COLUMNS[name]: kind for name, kind in _TYPES.items()}
    curves = {COLUMNS[name]: lambda numbers: np.array(numbers.split(), float) for name in _CURVES}
    rows = pd.read_csv(io.StringIO(text), comment="#", dtype=types, converters=curves, float_precision="round_trip")
    notes = dict(line[1:].strip().split(": ", 1) for line in text.split("\n") if line[:1] == "#")
    return table_of(rows.rename(columns={heading: name for name, heading in COLUMNS.items()})[list(COLUMNS)]), notes


def read_cases(file: str | Path) -> tuple[Cases, dict[str, str]]:
    """The cases in ``file``, and what it says about where they are from. Raises `InputError` if it cannot be read."""
    try:
        return from_csv(Path(file).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}.") from None
    except (ValueError, KeyError):
        raise InputError(f"{file}: cannot be read as the fitted cases of a sweep, fit.csv.") from None


class TooFewError(ValueError):
    """Cases that do not suffice for a model; the message says which."""


def usable(cases: Cases) -> tuple[Cases, list[tuple[str, str]]]:
    """The cases that a model can be fitted to, and the runs of the others with the reason."""
    longest = max((load[-1] for load in cases.load), default=0.0)
    softness, out = (1 - cases.alpha) / 2 * Points.of(cases).m, {}
    for index, case in cases.iterrows():
        if case.yielding in UNFIT:
            out[index] = UNFIT[case.yielding]
        elif softness[index] > SOFT + 1e-3:
            out[index] = f"{SOFT_WORDS} = {softness[index]:.3g} is more than {SOFT:g}: a soft pin, hardly compressible"
        elif case.load[-1] < _SHORT * longest:
            out[index] = f"ends at {case.load[-1]:.3g} dR, others at {longest:.3g}"
    return cases.drop(index=list(out)), [(cases.run[index], reason) for index, reason in out.items()]


def of_kind(cases: Cases, kind: Kind) -> Cases:
    """The ``cases`` of a plane and kind of yielding."""
    return cases[(cases.plane == kind[0]) & (cases.yielding == kind[1])]


def known(model: CalibratedModel, cases: Cases) -> Cases:
    """The cases of kinds that the model was fitted to."""
    kinds = {(part["plane"], part["yielding"]) for part in model.data["plastic"]}
    return cases[[row.yielding == "none" or (row.plane, row.yielding) in kinds for row in cases.itertuples()]]


def split(cases: Cases) -> tuple[Cases, Cases]:
    """Cases to fit and to choose a form with, and `HELD_OUT` of each kind to judge the result by at the end.

    Chosen by the numbers of the joint themselves: always the same ones, however the cases are ordered.
    """
    groups = cases.sort_values("digest").groupby(["plane", "yielding"])
    held = [index for _, same in groups for index in same.index[: round(HELD_OUT * len(same))]]
    chosen = cases.index.isin(held)
    return cases[~chosen], cases[chosen]


def fit_model(cases: Cases, form: Form = FORM, plenty: int = _PLENTY) -> CalibratedModel:
    """Least squares of ln k of the elastic cases, then of ln k and ln c of each kind that yields.

    Coefficients have six digits. A kind with less than ``plenty`` cases per coefficient is left out. Raises
    `TooFewError` where the elastic ones are too few.
    """
    elastic = cases[cases.yielding == "none"]
    _suffice(elastic, plenty * len(form["elastic"]), "elastic cases")
    terms, k = Points.of(elastic).terms(form["elastic"]), elastic.k.to_numpy()
    start = np.linalg.lstsq(terms, 1 / k, rcond=None)[0]
    values = _solve(lambda v: -np.log(np.maximum(terms @ v, 1e-9)) - np.log(k), start)
    model = CalibratedModel({"form": form, "elastic": values, "plastic": [], "bounds": []})
    for kind in sorted(KINDS, key=lambda kind: kind[1] != "none"):
        same = of_kind(cases, kind)
        try:
            if kind[1] != "none":
                model.data["plastic"].append(_plastic(same, kind, model, plenty))
        except TooFewError:
            continue
        if len(same):
            model.data["bounds"].append(_bounds(same, kind))
    rest = {"load_range": _span(np.concatenate(list(cases.load))), "errors": {}, "provenance": {}}
    return CalibratedModel(model.data | rest)


def _plastic(cases: Cases, kind: Kind, model: CalibratedModel, plenty: int) -> dict[str, Any]:
    late, threshold = model.data["form"]["late"], model.data["form"][kind[0]]
    yielded, what = cases[cases.clear_c.notna()], f"cases in plane {kind[0]} of which {kind[1]} yields"
    _suffice(cases, plenty * (len(late) + 1), what)
    _suffice(yielded, plenty * len(threshold), what)
    points = Points.of(cases)
    k, terms = model.elastic_k(points), points.terms(late)
    ratio, onset = np.log(cases.k.to_numpy() / k), points.s / k
    starts = [np.array([b, *np.linalg.lstsq(np.exp(-b * onset)[:, None] * terms, ratio, rcond=None)[0]])
              for b in (2.0, 4.0)]  # fmt: skip
    rate, *rest = _solve(lambda v: np.exp(-v[0] * onset) * (terms @ v[1:]) - ratio, *starts)
    powers, c = Points.of(yielded).terms(threshold), np.log(yielded.c.to_numpy())
    found = _solve(lambda v: powers @ v - c, np.linalg.lstsq(powers, c, rcond=None)[0])
    return {"plane": kind[0], "yielding": kind[1], "rate": rate, "late": rest, "threshold": found,
            "cases": len(cases), "cases_of_c": len(yielded)}  # fmt: skip


def _solve(residuals: Callable[[Array], Array], *starts: Array) -> list[float]:
    found = [least_squares(residuals, start, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12) for start in starts]
    return [_digits(value) for value in min(found, key=lambda solution: solution.cost).x]


def _suffice(cases: Cases, needed: int, what: str) -> None:
    if len(cases) < needed:
        raise TooFewError(f"{len(cases)} {what} are too few for a model: it takes {needed}")


def _bounds(cases: Cases, kind: Kind) -> dict[str, Any]:
    names = ("nu", "pin_nu", "ratio", "alpha", "clearance", "strength", "s")
    spans = {"modulus_ratio" if name == "ratio" else name: _span(cases[name]) for name in names}
    return {"plane": kind[0], "yielding": kind[1]} | spans


def _span(values: Iterable[float]) -> list[float | None]:
    """The smallest and largest, None for infinity, of those that are numbers; 0, 0 of none."""
    numbers = [value for value in values if not math.isnan(value)] or [0.0]
    return [_digits(end) if math.isfinite(end) else None for end in (min(numbers), max(numbers))]


def _digits(value: float) -> float:
    return float(f"{value:.6g}")


def joint_of_case(case: Any, k: float, c: float) -> LawJoint:
    """The joint of a ``case`` in units of R = E* = 1 with these coefficients; elastic where c is nan or infinite."""
    plastic = math.isfinite(c) and math.isfinite(case.strength)
    return LawJoint(1.0, case.clearance, 1.0, case.strength if plastic else None, k=k, c=c if plastic else 1.0,
                    dundurs_alpha=case.alpha, plane=case.plane, nu=case.nu,
                    pin_nu=None if math.isnan(case.pin_nu) else case.pin_nu,
                    yielding="both" if case.yielding == "none" else case.yielding)  # fmt: skip


def predictions(model: CalibratedModel, cases: Cases) -> tuple[Array, Array]:
    """k and c of ``model`` for ``cases`` ``(n,)``, of whose kinds they must be."""
    found = pd.DataFrame(index=cases.index, columns=["k", "c"], dtype=float)
    for kind, same in cases.groupby(["plane", "yielding"]):
        found.loc[same.index] = np.column_stack(model.coefficients(kind, Points.of(same)))
    return found.k.to_numpy(), found.c.to_numpy()


def errors(cases: Cases, k: Array, c: Array) -> pd.DataFrame:
    """What the law with ``k`` and ``c`` ``(n,)`` misses ``cases`` by, relative; elastic where c is not finite.

    A row for each error ``off`` with the ``run``, ``plane`` and ``yielding`` of its case, and ``what`` it is one of:
    "k", "c" (nan where there is none), and at each ``load`` delta/dR "P", from `LATE` on, or "P early", before.
    """
    rows = cases[["run", "plane", "yielding"]]
    scaled = (case.load * case.clearance for case in cases.itertuples())
    forces = [
        plastic_force(joint_of_case(case, *map(float, kc)), delta) / case.clearance / case.P - 1
        for case, delta, *kc in zip(cases.itertuples(), scaled, k, c, strict=True)
    ]
    steps = rows.loc[cases.index.repeat([len(part) for part in forces])]
    load = np.concatenate(list(cases.load))
    own = [rows.assign(what="k", off=k / cases.k - 1), rows.assign(what="c", off=c / cases.clear_c - 1)]
    late = np.where(load > LATE, "P", "P early")
    return pd.concat([*own, steps.assign(what=late, off=np.concatenate(forces), load=load)], ignore_index=True)


def summary(found: pd.DataFrame) -> dict[str, Any]:
    """Of `errors`: number of cases; rms and largest size of each error, the case that has it, and for P where."""
    said: dict[str, Any] = {"cases": int((found.what == "k").sum())}
    for what in ("k", "c", "P", "P early"):
        part = found[(found.what == what) & found.off.notna()]
        if len(part):
            worst = part.loc[part.off.abs().idxmax()]
            rms = round(math.sqrt((part.off**2).mean()), 5)
            said[what] = {"rms": rms, "largest": round(float(worst.off), 5), "case": worst.run}
            if not math.isnan(worst.load):
                said[what]["delta/dR"] = _digits(worst.load)
    return said


def cross_validate(cases: Cases, form: Form = FORM) -> pd.DataFrame:
    """`errors` of every case, predicted by a model fitted to the other folds only (Stone 1974); each kind is in all
    folds, and must have been fitted. Raises `TooFewError`."""
    cases = cases.sort_values(["plane", "yielding", "digest"])
    fold = np.arange(len(cases)) % FOLDS
    k, c = np.empty(len(cases)), np.empty(len(cases))
    for f in range(min(FOLDS, len(cases))):
        out = fold == f
        k[out], c[out] = predictions(fit_model(cases[~out], form, plenty=1), cases[out])
    return errors(cases, k, c)


def study(cases: Cases, form: Form = FORM, provenance: dict[str, Any] | None = None) -> CalibratedModel:
    """The model of ``cases`` with its errors on those of them that it has not seen, and ``provenance``.

    `HELD_OUT` of the cases are kept out of everything ("held out"), the others predicted by each other
    ("cross-validated"). Raises `TooFewError`.
    """
    used, held = split(cases)
    model = fit_model(used, form)
    used, held = known(model, used), known(model, held)
    said = {"cross-validated": by_kind(cross_validate(used, form), used)}
    if len(held):
        said["held out"] = by_kind(errors(held, *predictions(model, held)), held)
    notes = {**(provenance or {}), "fitted": len(used), "held out": len(held)}
    return CalibratedModel(model.data | {"errors": said, "provenance": notes})


def by_kind(found: pd.DataFrame, cases: Cases) -> Errors:
    """Summaries of the errors ``found`` of ``cases`` by kind, and of all; "P own" is that with each joint's own k and
    c: what the shape of the law misses."""
    own = errors(cases, cases.k.to_numpy(), cases.c.to_numpy())
    kinds = {" ".join(kind): (of_kind(found, kind), of_kind(own, kind)) for kind in KINDS}
    kinds = {name: parts for name, parts in kinds.items() if len(parts[0])} | {"both all": (found, own)}
    return {name: summary(part) | {"P own": summary(same).get("P", {})} for name, (part, same) in kinds.items()}


def shipped_errors(cases: Cases) -> Errors:
    """`by_kind` of the law that comes with archord, of those of ``cases`` that are inside its range."""
    found = [joint_calibrated(joint_of_case(case, 1.0, 1.0)) for case in cases.itertuples()]
    inside = np.array([not law.outside for law in found], bool)
    k, c = (np.array([getattr(law, name) for law in found])[inside] for name in "kc")
    return by_kind(errors(cases[inside], k, c), cases[inside]) if inside.any() else {}

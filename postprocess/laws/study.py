"""The study behind the calibrated law: fitted joints, a model of their k and c, and how good it is on unseen ones.

A `FittedCase` is a joint with its own k and c and its curve, a row of a CSV file; everything in it is dimensionless, so
rows of different units and sizes stand side by side. `study` makes a `CalibratedModel` of many.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from archord.output.user_file import writing
from archord.postprocess.convergence import Refined
from archord.postprocess.laws.calibrated import (
    SOFT,
    SOFT_WORDS,
    UNFIT,
    CalibratedModel,
    Kind,
    Points,
    dundurs_alpha,
    equivalent,
    joint_calibrated,
)
from archord.postprocess.laws.chord_laws import plastic_force
from archord.postprocess.laws.curve_fit import fit_curve, fit_plateau
from archord.postprocess.laws.joint import Array, LawJoint
from archord.scene.errors import InputError

PLANES = ("strain", "stress")
KINDS: tuple[Kind, ...] = tuple((plane, yielding) for plane in PLANES for yielding in ("none", "both", "block"))
LATE = 0.45  # delta/dR from which errors of P count; the contact is Hertz's before
FOLDS = 10
HELD_OUT = 0.15
_PLENTY = 2  # cases per coefficient without which nothing is fitted
_TOLD = 0.65  # of the largest load: where the plateau must have begun for c to count
_SHORT = 0.99  # of the largest load of the sweep, that a case must have reached
Form = dict[str, Any]  # name, and the terms of each polynomial, see `CalibratedModel`
Row = tuple[str, str, str, dict[str, Any]]  # what, plane, which bodies yield, summary of errors


def form(name: str, elastic: str, late: str, strain: str, stress: str) -> Form:
    """The terms of 1/k_e, of A for late yielding, and of ln c in plane ``strain`` and plane ``stress``."""
    terms = {"elastic": elastic, "late": late, "strain": strain, "stress": stress}
    return {"name": name} | {part: names.split() for part, names in terms.items()}


FORM = form("calibrated", "p q pm qn qnn qqnn pqmn ppmmm", "1 p x pm qn", "1 x p xp pp pn ppm", "1 pm n d")
SIMPLER = (  # to compare with
    form("constants", "1", "", "1", "1"),
    form("k by alpha, c by s", "p q", "", "1 x", "1 x"),
    form("and k by nu and s", "p q pm qn", "1", "1 x", "1 x"),
    form("and c by alpha and nu", "p q pm qn", "1", "1 x p pm qn", "1 pm n"),
)


@dataclass(frozen=True)
class FittedCase:
    """One joint: the numbers that decide it, k and c with their standard errors, and its curve.

    ``ratio`` is E of the pin over E of the block (infinite: a rigid pin), ``pin_nu`` nan for a rigid pin, ``clearance``
    dR/R, ``strength`` sigY/E* of the weaker body (infinite: elastic), ``yielding`` "none", "both", "block", "pin" or
    "unlike". ``c`` is nan where too few steps have yielded, ``k_mesh`` and ``c_mesh`` the errors of the mesh, nan where
    there was but one, ``plateau`` the median pressure over sigY (nan: none was measured). ``rms`` and ``largest`` are
    those of ``law/run - 1`` with the joint's own k and c. ``load`` is delta/dR, ``P`` the force over E* dR, ``(n,)``
    each; ``mesh`` the element size on the arcs over R.
    """

    run: str
    plane: str
    yielding: str
    ratio: float
    pin_nu: float
    nu: float
    clearance: float
    strength: float
    mesh: float
    k: float
    k_error: float
    k_mesh: float
    c: float
    c_error: float
    c_mesh: float
    plateau: float
    rms: float
    largest: float
    load: Array
    P: Array

    @property
    def s(self) -> float:
        """Relative yield stress ``sigY R/(E* dR)``; infinite for an elastic joint."""
        return self.strength / self.clearance

    @property
    def told_c(self) -> float:
        """c where the plateau fills the last third of the range or more, else nan.

        A plateau that begins later does hardly show in P: the fit then takes c to mend the shape of the curve.
        """
        return self.c if self.c * self.s / self.k <= _TOLD * self.load[-1] else math.nan

    @property
    def alpha(self) -> float:
        """Dundurs' alpha, positive for the stiffer pin; 1 for a rigid one."""
        return dundurs_alpha(self.plane, self.ratio, self.pin_nu, self.nu)

    @property
    def kind(self) -> Kind:
        """Plane, and which bodies yield."""
        return self.plane, self.yielding

    @property
    def digest(self) -> str:
        """A number made from those of the joint: the same wherever it stands, and random otherwise."""
        numbers = (self.ratio, self.pin_nu, self.nu, self.clearance, self.strength)
        said = f"{self.plane} {self.yielding} {' '.join(f'{value:.5g}' for value in numbers)}"
        return hashlib.sha256(said.encode()).hexdigest()

    def joint(self, k: float, c: float) -> LawJoint:
        """The joint in units of R = E* = 1 with these coefficients; elastic where c is nan or infinite."""
        plastic = math.isfinite(c) and math.isfinite(self.strength)
        return LawJoint(1.0, self.clearance, 1.0, self.strength if plastic else None, k=k, c=c if plastic else 1.0,
                        dundurs_alpha=self.alpha, plane=self.plane, nu=self.nu,
                        pin_nu=None if math.isnan(self.pin_nu) else self.pin_nu,
                        yielding="both" if self.yielding == "none" else self.yielding)  # fmt: skip


def fit_case(
    refined: Refined, load_range: tuple[float, float] = (0.0, np.inf), confidence: float = 0.95, name: str = ""
) -> FittedCase:
    """Fit k and c to P(delta) of a joint, over ``load_range`` in clearances, called ``name`` [the run folder's].

    Raises `InputError` where the range or the steps do not allow a fit.
    """
    run = refined.run
    force = fit_curve("P", [refined], load_range, confidence)
    plateau = fit_plateau(force, [refined], load_range, confidence)
    pin, block, k, c = run.scene.pin, run.scene.block, force.k, force.c
    assert k is not None

    def known(value: float | None) -> float:
        return math.nan if value is None else value

    return FittedCase(
        run=name or run.name,
        plane=run.plane,
        yielding="none" if run.sigY is None else LawJoint.from_scene(run.scene).yielding,
        ratio=math.inf if pin.E is None else pin.E / block.E,
        pin_nu=known(pin.nu),
        nu=block.nu,
        clearance=run.dR / run.R,
        strength=math.inf if run.sigY is None else run.sigY / run.E_star,
        mesh=run.scene.joint.h / run.R,
        k=k.value,
        k_error=k.standard_error,
        k_mesh=known(k.discretisation_error),
        c=c.value if c else math.nan,
        c_error=c.standard_error if c else math.nan,
        c_mesh=known(c.discretisation_error) if c else math.nan,
        plateau=plateau.c.value if plateau and plateau.c else math.nan,
        rms=force.rms,
        largest=force.largest,
        load=force.residuals[0].load,
        P=force.residuals[0].data,
    )


CSV_BEGINS = "# archord: "  # by which a file of `write_cases` is known
_HEADINGS = {field.name: field.name for field in fields(FittedCase)} | {
    "ratio": "E1/E2",
    "pin_nu": "nu1",
    "nu": "nu2",
    "clearance": "dR/R",
    "strength": "sigY/E*",
    "mesh": "h/R",
    "k_error": "k s.e.",
    "c_error": "c s.e.",
    "k_mesh": "k mesh",
    "c_mesh": "c mesh",
    "load": "delta/dR",
    "P": "P/(E* dR)",
}


def read_cases(file: str | Path) -> tuple[list[FittedCase], dict[str, str]]:
    """The rows of ``file``, written by `write_cases`, and what it says about where they are from.

    Raises `InputError` if it cannot be read.
    """
    file = Path(file)
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        notes = dict(line[1:].strip().split(": ", 1) for line in lines if line.startswith("#"))
        return [_case(row) for row in csv.DictReader(line for line in lines if not line.startswith("#"))], notes
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}.") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{file}: cannot be read as the fitted cases of a sweep, fit.csv.") from None


def _case(row: dict[str, str]) -> FittedCase:
    values: dict[str, Any] = {name: row[heading] for name, heading in _HEADINGS.items()}
    for name, text in values.items():
        if name in ("load", "P"):
            values[name] = np.array([float(value) for value in text.split()])
        elif name not in ("run", "plane", "yielding"):
            values[name] = float(text or "nan")
    return FittedCase(**values)


def write_cases(cases: Iterable[FittedCase], notes: dict[str, str], file: str | Path) -> None:
    """Write ``cases`` with seven digits, below ``notes`` on where they are from. Raises `InputError`."""
    file = Path(file)
    with writing(file), file.open("w", encoding="utf-8", newline="") as stream:
        stream.writelines(f"# {name}: {value}\n" for name, value in notes.items())
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(_HEADINGS.values())
        writer.writerows([_entry(getattr(case, name)) for name in _HEADINGS] for case in cases)


def _entry(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return " ".join(f"{entry:.7g}" for entry in value)
    return value if isinstance(value, str) else "" if math.isnan(value) else f"{value:.7g}"


def rounded(cases: Iterable[FittedCase]) -> list[FittedCase]:
    """``cases`` as `write_cases` and `read_cases` would give them back."""
    return [_case({heading: _entry(getattr(case, name)) for name, heading in _HEADINGS.items()}) for case in cases]


class TooFewError(ValueError):
    """Cases that do not suffice for a model; the message says which."""


def fit_model(cases: list[FittedCase], form: Form = FORM, plenty: int = _PLENTY) -> CalibratedModel:
    """Least squares of ln k of the elastic cases, then of ln k and ln c of each kind that yields.

    Coefficients have six digits. A kind with less than ``plenty`` cases per coefficient is left out. Raises
    `TooFewError` where the elastic ones are too few.
    """
    elastic = [case for case in cases if case.yielding == "none"]
    _suffice(elastic, plenty * len(form["elastic"]), "elastic cases")
    terms, k = Points.of(elastic).terms(form["elastic"]), np.array([case.k for case in elastic])
    start = np.linalg.lstsq(terms, 1 / k, rcond=None)[0]
    values = _solve(lambda v: -np.log(np.maximum(terms @ v, 1e-9)) - np.log(k), start)
    model = CalibratedModel({"form": form, "elastic": values, "plastic": [], "bounds": []})
    for kind in sorted(KINDS, key=lambda kind: kind[1] != "none"):
        same = [case for case in cases if case.kind == kind]
        try:
            if kind[1] != "none":
                model.data["plastic"].append(_plastic(same, kind, model, plenty))
        except TooFewError:
            continue
        if same:
            model.data["bounds"].append(_bounds(same))
    loads = np.concatenate([case.load for case in cases])
    return CalibratedModel(model.data | {"load_range": _span(loads), "errors": {}, "provenance": {}})


def _plastic(cases: list[FittedCase], kind: Kind, model: CalibratedModel, plenty: int) -> dict[str, Any]:
    late, threshold = model.data["form"]["late"], model.data["form"][kind[0]]
    yielded = [case for case in cases if math.isfinite(case.told_c)]
    what = f"cases in plane {kind[0]} of which {kind[1]} yields"
    _suffice(cases, plenty * (len(late) + bool(late)), what)
    _suffice(yielded, plenty * len(threshold), what)
    rate, rest = 0.0, []
    if late:
        points = Points.of(cases)
        k, terms = model.elastic_k(points), points.terms(late)
        ratio, onset = np.log(np.array([case.k for case in cases]) / k), points.s / k
        starts = [np.array([b, *np.linalg.lstsq(np.exp(-b * onset)[:, None] * terms, ratio, rcond=None)[0]])
                  for b in (2.0, 4.0)]  # fmt: skip
        rate, *rest = _solve(lambda v: np.exp(-v[0] * onset) * (terms @ v[1:]) - ratio, *starts)
    terms, c = Points.of(yielded).terms(threshold), np.log([case.c for case in yielded])
    found = _solve(lambda v: terms @ v - c, np.linalg.lstsq(terms, c, rcond=None)[0])
    return {"plane": kind[0], "yielding": kind[1], "rate": rate, "late": rest, "threshold": found,
            "cases": len(cases), "cases_of_c": len(yielded)}  # fmt: skip


def _solve(residuals: Callable[[Array], Array], *starts: Array) -> list[float]:
    found = [least_squares(residuals, start, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12) for start in starts]
    return [_digits(value) for value in min(found, key=lambda solution: solution.cost).x]


def _suffice(cases: list[FittedCase], needed: int, what: str) -> None:
    if len(cases) < needed:
        raise TooFewError(f"{len(cases)} {what} are too few for a model: it takes {needed}")


def _bounds(cases: list[FittedCase]) -> dict[str, Any]:
    names = {"nu": "nu", "pin_nu": "pin_nu", "modulus_ratio": "ratio", "alpha": "alpha", "clearance": "clearance",
             "strength": "strength", "s": "s"}  # fmt: skip
    plane, yielding = cases[0].kind
    spans = {name: _span([getattr(case, field) for case in cases]) for name, field in names.items()}
    return {"plane": plane, "yielding": yielding} | spans


def _span(values: Iterable[float]) -> list[float | None]:
    """The smallest and largest, None for infinity, of those that are numbers; 0, 0 of none."""
    known = [value for value in values if not math.isnan(value)] or [0.0]
    return [_digits(end) if math.isfinite(end) else None for end in (min(known), max(known))]


def _digits(value: float) -> float:
    return float(f"{value:.6g}")


@dataclass(frozen=True)
class Errors:
    """What a law misses ``cases`` by, relative: ``k`` and ``c`` ``(n,)`` (c nan where it has none), and ``P`` at the
    steps of each case."""

    cases: list[FittedCase]
    k: Array
    c: Array
    P: list[Array]

    def summary(self, kind: Kind | None = None) -> dict[str, Any]:
        """Of a kind, or of all: number of cases; rms and largest size of each error, the case that has it, and for P,
        from `LATE` on ("P") and before ("P early"), where."""
        rows = [i for i, case in enumerate(self.cases) if kind in (None, case.kind)]
        said: dict[str, Any] = {"cases": len(rows)}
        for name, off in (("k", self.k), ("c", self.c)):
            said[name] = _judged([(off[i], {"case": self.cases[i].run}) for i in rows if math.isfinite(off[i])])
        for name, late in (("P", True), ("P early", False)):
            steps = ((i, off, load) for i in rows for off, load in zip(self.P[i], self.cases[i].load, strict=True))
            said[name] = _judged([(off, {"case": self.cases[i].run, "delta/dR": _digits(load)})
                                  for i, off, load in steps if (load > LATE) == late])  # fmt: skip
        return {name: found for name, found in said.items() if found is not None}


def _judged(entries: list[tuple[float, dict[str, Any]]]) -> dict[str, Any] | None:
    if not entries:
        return None
    largest, where = max(entries, key=lambda entry: abs(entry[0]))
    rms = math.sqrt(np.mean(np.square([off for off, _ in entries])))
    return {"rms": round(rms, 5), "largest": round(float(largest), 5), **where}


def errors(cases: list[FittedCase], k: Array, c: Array) -> Errors:
    """Of the law with ``k`` and ``c`` ``(n,)`` from those of ``cases`` and from their curves; elastic where c is not
    finite."""
    own_k, own_c = (np.array([getattr(case, name) for case in cases]) for name in ("k", "told_c"))
    off = [
        plastic_force(case.joint(*kc), case.load * case.clearance) / case.clearance / case.P - 1
        for case, *kc in zip(cases, k.tolist(), c.tolist(), strict=True)
    ]
    return Errors(cases, k / own_k - 1, c / own_c - 1, off)


def own_errors(cases: list[FittedCase]) -> Errors:
    """With each joint's own k and c: what the shape of the law misses."""
    return errors(cases, *(np.array([getattr(case, name) for case in cases]) for name in "kc"))


def predictions(model: CalibratedModel, cases: list[FittedCase]) -> tuple[Array, Array]:
    """k and c of ``model`` for ``cases`` ``(n,)``, of whose kinds they must be."""
    k, c = np.empty(len(cases)), np.empty(len(cases))
    for kind in {case.kind for case in cases}:
        rows = [i for i, case in enumerate(cases) if case.kind == kind]
        k[rows], c[rows] = model.coefficients(kind, Points.of([cases[i] for i in rows]))
    return k, c


def known(model: CalibratedModel, cases: list[FittedCase]) -> list[FittedCase]:
    """The cases of kinds that the model was fitted to."""
    kinds = {(part["plane"], part["yielding"]) for part in model.data["plastic"]}
    return [case for case in cases if case.yielding == "none" or case.kind in kinds]


def split(cases: list[FittedCase], share: float = HELD_OUT) -> tuple[list[FittedCase], list[FittedCase]]:
    """Cases to fit and to choose a form with, and a ``share`` of each kind to judge the result by at the end.

    Chosen by the numbers of the joint themselves: always the same ones, however the cases are ordered.
    """
    held = set()
    for kind in {case.kind for case in cases}:
        same = sorted((case for case in cases if case.kind == kind), key=lambda case: case.digest)
        held |= {id(case) for case in same[: round(share * len(same))]}
    return [case for case in cases if id(case) not in held], [case for case in cases if id(case) in held]


def cross_validate(cases: list[FittedCase], form: Form = FORM, folds: int = FOLDS) -> Errors:
    """Every case predicted by a model fitted to the other folds only (Stone 1974); each kind is in all folds.

    Raises `TooFewError`.
    """
    cases = known(fit_model(cases, form), cases)
    order = sorted(range(len(cases)), key=lambda i: (cases[i].kind, cases[i].digest))
    fold = np.empty(len(cases), dtype=int)
    fold[order] = np.arange(len(cases)) % folds
    k, c = np.empty(len(cases)), np.empty(len(cases))
    for f in set(fold.tolist()):
        out = np.flatnonzero(fold == f)
        model = fit_model([case for i, case in enumerate(cases) if fold[i] != f], form, plenty=1)
        k[out], c[out] = predictions(model, [cases[i] for i in out])
    return errors(cases, k, c)


@dataclass(frozen=True)
class Study:
    """A ``model`` fitted to the cases ``used``, those ``held`` out, and the errors as rows of tables: by kind, each
    case predicted by the others or held out of all, and of ``simpler`` forms, each case predicted by the others."""

    model: CalibratedModel
    used: list[FittedCase]
    held: list[FittedCase]
    rows: list[Row]
    simpler: list[Row]


def usable(cases: list[FittedCase]) -> tuple[list[FittedCase], list[tuple[FittedCase, str]]]:
    """The cases that a model can be fitted to, and the others with the reason."""
    longest = max((case.load[-1] for case in cases), default=0.0)
    used, out = [], []
    for case in cases:
        # nan, of a rigid pin, is not larger
        softness = (1 - case.alpha) / 2 * float(equivalent(case.pin_nu, case.plane))
        reason = UNFIT.get(case.yielding, "")
        if not reason and softness > SOFT + 1e-3:
            reason = f"{SOFT_WORDS} = {softness:.3g} is more than {SOFT:g}: a soft pin, hardly compressible"
        elif not reason and case.load[-1] < _SHORT * longest:
            reason = f"ends at {case.load[-1]:.3g} dR, others at {longest:.3g}"
        if reason:
            out.append((case, reason))
        else:
            used.append(case)
    return used, out


def study(
    cases: list[FittedCase], share: float = HELD_OUT, form: Form = FORM, provenance: dict[str, Any] | None = None
) -> Study:
    """Hold a ``share`` of ``cases`` out, fit the model to the others, cross-validate it on them, and judge it by those
    held out; the model tells its errors and ``provenance``. Raises `TooFewError`."""
    used, held = split(cases, share)
    model = fit_model(used, form)
    used, held = known(model, used), known(model, held)
    validated = cross_validate(used, form)
    rows = _rows("cross-validated", validated)
    if held:
        rows += _rows("held out", errors(held, *predictions(model, held)))
    said: dict[str, dict[str, Any]] = {}
    for what, plane, yielding, found in rows:
        said.setdefault(what, {})[f"{plane} {yielding}"] = found
    c = np.array([1.0 if math.isfinite(case.s) else math.inf for case in used])
    compared = {"k = 0.85, c = 1": errors(used, np.full(len(used), 0.85), c)}
    compared |= {simpler["name"]: cross_validate(used, simpler) for simpler in SIMPLER}
    compared |= {form["name"]: validated, "own k and c": own_errors(used)}
    notes = {**(provenance or {}), "fitted": len(used), "held out": len(held)}
    return Study(
        CalibratedModel(model.data | {"errors": said, "provenance": notes}), used, held, rows,
        [(name, "both", "all", found.summary()) for name, found in compared.items()],
    )  # fmt: skip


def shipped_rows(cases: list[FittedCase]) -> list[Row]:
    """Errors of the law that comes with archord on ``cases``, by kind, of those that are inside its range."""
    found = [(case, joint_calibrated(case.joint(1.0, 1.0))) for case in cases]
    inside = [(case, law) for case, law in found if not law.outside]
    if not inside:
        return []
    k, c = (np.array([getattr(law, name) for _, law in inside]) for name in "kc")
    return _rows("archord's law", errors([case for case, _ in inside], k, c))


def _rows(what: str, found: Errors) -> list[Row]:
    """Summaries by kind, and of all, with what the shape of the law misses beside it."""
    own, rows = own_errors(found.cases), list[Row]()
    for kind in (*KINDS, None):
        summary = found.summary(kind)
        if summary["cases"]:
            said = {"P own": own.summary(kind).get("P", {})}
            rows.append((what, *(kind or ("both", "all")), summary | said))
    return rows

"""The study behind the calibrated law: a model of k and c of many fitted joints, and how good it is on unseen ones."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from archord.postprocess.laws.calibrated import CalibratedModel, calibrated, shipped_model, terms
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.joint import Array
from archord.postprocess.laws.study_cases import Cases, joint_of_case, split
from archord.report.table import Table

Form = dict[str, list[str]]
Errors = dict[str, dict[str, Any]]  # by kind ("strain block", "both all"): number of cases, rms and largest errors

KINDS = ("strain none", "strain both", "strain block", "stress none", "stress both", "stress block")
FORM: Form = shipped_model().data["form"]  # which products of what decides a joint count, see `CalibratedModel`
LATE = 0.45  # delta/dR from which errors of P count; the contact is Hertz's before
FOLDS = 10


class TooFewError(ValueError):
    """Cases that do not suffice for a model; the message says which."""


def fit_model(cases: Cases, form: Form = FORM, plenty: int = 2) -> CalibratedModel:
    """Least squares of ln k of the elastic cases, then of ln k and ln c of each kind that yields, in six digits; no
    kind of less than ``plenty`` cases per coefficient. Raises `TooFewError` where the elastic ones are too few."""
    elastic = cases[cases.yielding == "none"]
    needed = plenty * len(form["elastic"])
    if len(elastic) < needed:
        raise TooFewError(f"{len(elastic)} elastic cases are too few for a model: it takes {needed}")
    shares, k = terms(elastic, form["elastic"]), elastic.k.to_numpy()
    start = np.linalg.lstsq(shares, 1 / k, rcond=None)[0]
    values = _solve(lambda v: -np.log(np.maximum(shares @ v, 1e-9)) - np.log(k), start)
    model = CalibratedModel({"form": form, "elastic": values, "plastic": {}, "bounds": {}})
    for kind in KINDS:
        same = cases[cases.kind == kind]
        if not kind.endswith("none") and (found := _plastic(same, kind, model, plenty)):
            model.data["plastic"][kind] = found
        if len(same) and (kind.endswith("none") or kind in model.data["plastic"]):
            model.data["bounds"][kind] = _bounds(cases, kind)
    rest = {"load_range": _span(np.concatenate(list(cases.load))), "errors": {}, "provenance": {}}
    return CalibratedModel(model.data | rest)


def _plastic(cases: Cases, kind: str, model: CalibratedModel, plenty: int) -> dict[str, Any] | None:
    late, threshold = (model.data["form"][part] for part in ("late", kind.split()[0]))
    yielded = cases[cases.clear_c.notna()]
    if len(cases) < plenty * (len(late) + 1) or len(yielded) < plenty * len(threshold):
        return None
    k, shape = model.elastic_k(cases), terms(cases, late)
    ratio, onset = np.log(cases.k.to_numpy() / k), cases.s.to_numpy() / k
    starts = [np.array([b, *np.linalg.lstsq(np.exp(-b * onset)[:, None] * shape, ratio, rcond=None)[0]])
              for b in (2.0, 4.0)]  # fmt: skip
    rate, *rest = _solve(lambda v: np.exp(-v[0] * onset) * (shape @ v[1:]) - ratio, *starts)
    found = np.linalg.lstsq(terms(yielded, threshold), np.log(yielded.c.to_numpy()), rcond=None)[0]
    return {"rate": rate, "late": rest, "threshold": [_digits(value) for value in found],
            "cases": len(cases), "cases_of_c": len(yielded)}  # fmt: skip


def _solve(residuals: Callable[[Array], Array], *starts: Array) -> list[float]:
    found = [least_squares(residuals, start, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12) for start in starts]
    return [_digits(value) for value in min(found, key=lambda solution: solution.cost).x]


def _bounds(cases: Cases, kind: str) -> dict[str, Any]:
    """The range of a kind. One design covers all kinds: Poisson's ratios, clearance and the softest pin are those of
    all cases, the smallest s that of the plane; the stiffest pin is the kind's own."""
    found = {name: _span(cases[name].dropna()) for name in ("nu", "pin_nu", "clearance")}
    same = cases[(cases.plane == kind.split()[0]) & np.isfinite(cases.s)]
    stiffest = cases.alpha[cases.kind == kind].max()
    return found | {"alpha": _span([cases.alpha.min(), stiffest]), "s": [*_span(same.s)[:1], None]}


def _span(values: Any) -> list[float]:
    """The smallest and largest; 0, 0 of none."""
    return [_digits(end(values, default=0.0)) for end in (min, max)]


def _digits(value: float) -> float:
    return float(f"{value:.6g}")


def predictions(model: CalibratedModel, cases: Cases) -> tuple[Array, Array]:
    """k and c of ``model`` for ``cases`` ``(n,)``, of whose kinds they must be."""
    found = np.empty((2, len(cases)))
    for kind, same in cases.groupby("kind"):
        found[:, cases.kind == kind] = model.coefficients(kind, same)
    return found[0], found[1]


def cross_validate(cases: Cases, form: Form = FORM) -> tuple[Array, Array]:
    """k and c of every case, predicted by a model fitted to the other folds only (Stone 1974); each kind is in all
    folds, and must have been fitted. Raises `TooFewError`."""
    order = np.argsort((cases.kind + cases.digest).to_numpy())
    fold = np.empty(len(cases), int)
    fold[order] = np.arange(len(cases)) % FOLDS
    found = np.empty((2, len(cases)))
    for f in range(min(FOLDS, len(cases))):
        found[:, fold == f] = predictions(fit_model(cases[fold != f], form, plenty=1), cases[fold == f])
    return found[0], found[1]


def errors(cases: Cases, k: Array, c: Array) -> pd.DataFrame:
    """What the law with ``k`` and ``c`` ``(n,)`` misses ``cases`` by, relative; elastic where c is not finite. A row
    for each error ``off``: the ``kind`` of its case, and ``what`` it is of: "k", "c" (nan where there is none), and at
    each step "P" from `LATE` on, or "P early", before."""
    kinds = cases[["kind"]]
    parts = [kinds.assign(what="k", off=k / cases.k - 1), kinds.assign(what="c", off=c / cases.clear_c - 1)]
    for case, *own in zip(cases.itertuples(), map(float, k), map(float, c), strict=True):
        P = plastic_winkler(joint_of_case(case, *own), case.load * case.clearance).load / case.clearance
        late = np.where(case.load > LATE, "P", "P early")
        parts.append(pd.DataFrame({"kind": case.kind, "what": late, "off": P / case.P - 1}))
    return pd.concat(parts, ignore_index=True)


def summary(found: pd.DataFrame) -> dict[str, Any]:
    """Of `errors`: number of cases; rms and largest of each error."""
    said: dict[str, Any] = {"cases": int((found.what == "k").sum())}
    for what, off in found.dropna().groupby("what").off:
        said[what] = {"rms": round(math.sqrt((off**2).mean()), 5), "largest": round(off.iloc[off.abs().argmax()], 5)}
    return said


def by_kind(cases: Cases, k: Array, c: Array) -> Errors:
    """Summaries of `errors` by kind, and of all; "P own" is that of P with each joint's own k and c: what the shape of
    the law misses."""
    own = errors(cases, cases.k.to_numpy(), cases.c.to_numpy())
    found = pd.concat([errors(cases, k, c), own[own.what == "P"].assign(what="P own")])
    kinds = {kind: found[found.kind == kind] for kind in KINDS} | {"both all": found}
    return {kind: summary(part) for kind, part in kinds.items() if len(part)}


def study(cases: Cases, form: Form = FORM, provenance: dict[str, Any] | None = None) -> CalibratedModel:
    """The model of ``cases`` with ``provenance`` and its errors on cases that it has not seen: `HELD_OUT` of them, kept
    out of everything, and the others, predicted by each other. Raises `TooFewError`."""
    used, held = split(cases)
    model = fit_model(used, form)
    used, held = (part[part.kind.isin(model.data["bounds"])] for part in (used, held))
    said = {"cross-validated": by_kind(used, *cross_validate(used, form))}
    if len(held):
        said["held out"] = by_kind(held, *predictions(model, held))
    notes = {**(provenance or {}), "fitted": len(used), "held out": len(held)}
    return CalibratedModel(model.data | {"errors": said, "provenance": notes})


def shipped_errors(cases: Cases) -> Errors:
    """`by_kind` of the law that comes with archord, of those of ``cases`` that are inside its range."""
    found = [calibrated(joint_of_case(case, 1.0, 1.0)) for case in cases.itertuples()]
    inside = np.array([not law.outside for law in found], bool)
    k, c = np.array([(law.k, law.c) for law in found if not law.outside]).reshape(-1, 2).T
    return by_kind(cases[inside], k, c) if inside.any() else {}


def error_table(found: dict[str, Errors]) -> Table:
    """A row for each kind of joint in ``found``, by what they are the errors of."""
    shown = [*((name, what) for name in "kcP" for what in ("rms", "largest")), ("P own", "rms"), ("P early", "rms")]
    headings = [f"{name.replace('P own', 'own k, c: P')} {what}" for name, what in shown]
    table = Table("law", "plane", "yields", "cases", *headings)
    words, forms = {"none": "none (elastic)", "block": "block alone"}, {"rms": ".1%", "largest": "+.1%"}
    for law, kinds in found.items():
        for kind, numbers in kinds.items():
            plane, yielding = kind.split()
            cells = [format(numbers[name][what], forms[what]) if name in numbers else "-" for name, what in shown]
            table.add(law, plane, words.get(yielding, yielding), numbers["cases"], *cells)
    return table

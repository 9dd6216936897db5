"""The calibrated model from fitted cases, by least squares, and how good it is on cases that it has not seen."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from archord.geometry.basis import Array
from archord.postprocess.laws.calibrated_model import KINDS, Bounds, CalibratedModel, Form, Kind, Plastic, Points
from archord.postprocess.laws.chord_laws import plastic_force
from archord.postprocess.laws.fitted_cases import FittedCase

FORM = Form(
    "calibrated",
    elastic=("p", "q", "pm", "qn", "qnn", "qqnn", "pqmn", "ppmmm"),
    late=("1", "p", "x", "pm", "qn"),
    strain=("1", "x", "p", "xp", "pp", "pn", "ppm"),
    stress=("1", "pm", "n", "d"),
)
SIMPLER = (  # to compare with
    Form("constants", ("1",), (), ("1",), ("1",)),
    Form("k by alpha, c by s", ("p", "q"), (), ("1", "x"), ("1", "x")),
    Form("and k by nu and s", ("p", "q", "pm", "qn"), ("1",), ("1", "x"), ("1", "x")),
    Form("and c by alpha and nu", ("p", "q", "pm", "qn"), ("1",), ("1", "x", "p", "pm", "qn"), ("1", "pm", "n")),
)
LATE = 0.45  # delta/dR from which errors of P count; the contact is Hertz's before
FOLDS = 10
HELD_OUT = 0.15
_PLENTY = 2  # cases per coefficient without which nothing is fitted
_DIGITS = 6


class TooFewError(ValueError):
    """Cases that do not suffice for a model; the message says which."""


def split(cases: list[FittedCase], share: float = HELD_OUT) -> tuple[list[FittedCase], list[FittedCase]]:
    """Cases to fit and to choose a form with, and a ``share`` of each kind to judge the result by at the end.

    Chosen by the numbers of the joint themselves: always the same ones, however the cases are ordered.
    """
    held = []
    for kind in {case.kind for case in cases}:
        same = sorted((case for case in cases if case.kind == kind), key=lambda case: case.digest)
        held += same[: round(share * len(same))]
    chosen = {id(case) for case in held}
    return [case for case in cases if id(case) not in chosen], [case for case in cases if id(case) in chosen]


def fit_model(cases: list[FittedCase], form: Form = FORM, plenty: int = _PLENTY) -> CalibratedModel:
    """Least squares of ln k of the elastic cases, then of ln k and ln c of each kind that yields.

    Coefficients have six digits. A kind with less than ``plenty`` cases per coefficient is left out. Raises
    `TooFewError` where the elastic ones are too few.
    """
    elastic = [case for case in cases if case.yielding == "none"]
    _suffice(elastic, plenty * len(form.elastic), "elastic cases")
    terms = Points.of(elastic).terms(form.elastic)
    k = np.array([case.k for case in elastic])
    start = np.linalg.lstsq(terms, 1 / k, rcond=None)[0]
    values = _solve(lambda v: -np.log(np.maximum(terms @ v, 1e-9)) - np.log(k), start)
    loads = np.concatenate([case.load for case in cases])
    model = CalibratedModel(form, values, (), (), (_digits(loads.min()), _digits(loads.max())))
    parts, bounds = [], [_bounds(e) for e in _by_plane(elastic)]
    for kind in KINDS:
        same = [case for case in cases if case.kind == kind]
        try:
            parts.append(_plastic(same, kind, model, plenty))
        except TooFewError:
            continue
        bounds.append(_bounds(same))
    return CalibratedModel(form, values, tuple(parts), tuple(bounds), model.load_range)


def _by_plane(cases: list[FittedCase]) -> list[list[FittedCase]]:
    return [same for plane in ("strain", "stress") if (same := [case for case in cases if case.plane == plane])]


def _plastic(cases: list[FittedCase], kind: Kind, model: CalibratedModel, plenty: int) -> Plastic:
    form, what = model.form, f"cases in plane {kind[0]} of which {kind[1]} yields"
    yielded = [case for case in cases if math.isfinite(case.told_c)]
    _suffice(cases, plenty * (len(form.late) + bool(form.late)), what)
    _suffice(yielded, plenty * len(form.threshold(kind[0])), what)
    rate, late = 0.0, tuple[float, ...]()
    if form.late:
        points = Points.of(cases)
        k = model.elastic_k(points)
        ratio, onset = np.log(np.array([case.k for case in cases]) / k), points.s / k
        terms = points.terms(form.late)
        starts = [np.array([b, *np.linalg.lstsq(np.exp(-b * onset)[:, None] * terms, ratio, rcond=None)[0]])
                  for b in (2.0, 4.0)]  # fmt: skip
        rate, *rest = _solve(lambda v: np.exp(-v[0] * onset) * (terms @ v[1:]) - ratio, *starts)
        late = tuple(rest)
    terms = Points.of(yielded).terms(form.threshold(kind[0]))
    c = np.log([case.c for case in yielded])
    threshold = _solve(lambda v: terms @ v - c, np.linalg.lstsq(terms, c, rcond=None)[0])
    return Plastic(*kind, rate, late, threshold, len(cases), len(yielded))


def _solve(residuals: Callable[[Array], Array], *starts: Array) -> tuple[float, ...]:
    found = [least_squares(residuals, start, x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12) for start in starts]
    return tuple(_digits(value) for value in min(found, key=lambda solution: solution.cost).x)


def _suffice(cases: list[FittedCase], needed: int, what: str) -> None:
    if len(cases) < needed:
        raise TooFewError(f"{len(cases)} {what} are too few for a model: it takes {needed}")


def _bounds(cases: list[FittedCase]) -> Bounds:
    def span(values: list[float]) -> tuple[float, float]:
        return (_digits(min(values)), _digits(max(values))) if values else (0.0, 0.0)

    pins = [case.pin_nu for case in cases if not math.isnan(case.pin_nu)]
    names = ("ratio", "alpha", "clearance", "strength", "s")
    rest = [span([getattr(case, name) for case in cases]) for name in names]
    return Bounds(*cases[0].kind, span([case.nu for case in cases]), span(pins), *rest)


def _digits(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


@dataclass(frozen=True)
class Errors:
    """What a model misses cases by, relative: ``k`` and ``c`` ``(n,)`` (c nan where it has none), and of P, at its
    steps from `LATE` on and before, ``P`` and ``early``, one array for each case."""

    cases: tuple[FittedCase, ...]
    k: Array
    c: Array
    P: tuple[Array, ...]
    early: tuple[Array, ...]

    def of(self, kind: Kind) -> Errors:
        """Those of one plane and kind of yielding."""
        rows = [i for i, case in enumerate(self.cases) if case.kind == kind]
        return Errors(tuple(self.cases[i] for i in rows), self.k[rows], self.c[rows],
                      tuple(self.P[i] for i in rows), tuple(self.early[i] for i in rows))  # fmt: skip

    def summary(self) -> dict[str, Any]:
        """Number of cases; rms and largest size of each error, the case that has it, and for P where."""
        said: dict[str, Any] = {"cases": len(self.cases)}
        for name in ("k", "c"):
            values = getattr(self, name)
            if np.isfinite(values).any():
                worst = int(np.nanargmax(np.abs(values)))
                said[name] = {"rms": _round(np.sqrt(np.nanmean(values**2))), "largest": _round(values[worst]),
                              "case": self.cases[worst].run}  # fmt: skip
        for name, parts in (("P", self.P), ("P early", self.early)):
            every = np.concatenate([*parts, np.zeros(0)])
            if len(every):
                i = max((j for j, part in enumerate(parts) if len(part)), key=lambda j: np.abs(parts[j]).max())
                step = int(np.abs(parts[i]).argmax())
                late = self.cases[i].load > LATE
                load = self.cases[i].load[late if name == "P" else ~late][step]
                said[name] = {"rms": _round(np.sqrt(np.mean(every**2))), "largest": _round(parts[i][step]),
                              "case": self.cases[i].run, "delta/dR": _digits(load)}  # fmt: skip
        return said


def _round(value: float) -> float:
    return round(float(value), 5)


def errors(cases: list[FittedCase], k: Array, c: Array) -> Errors:
    """Of the law with ``k`` and ``c`` ``(n,)`` from those of ``cases`` and from their curves; elastic where c is not
    finite."""
    own_k, own_c = (np.array([getattr(case, name) for case in cases]) for name in ("k", "told_c"))
    off = [
        plastic_force(case.joint(*kc), case.load * case.clearance) / case.clearance / case.P - 1
        for case, *kc in zip(cases, k.tolist(), c.tolist(), strict=True)
    ]
    late = [case.load > LATE for case in cases]
    return Errors(
        tuple(cases),
        k / own_k - 1,
        c / own_c - 1,
        tuple(part[rows] for part, rows in zip(off, late, strict=True)),
        tuple(part[~rows] for part, rows in zip(off, late, strict=True)),
    )


def own_errors(cases: list[FittedCase]) -> Errors:
    """With each joint's own k and c: what the shape of the law misses."""
    return errors(cases, *(np.array([getattr(case, name) for case in cases]) for name in "kc"))


def model_errors(model: CalibratedModel, cases: list[FittedCase]) -> Errors:
    """With k and c of ``model``, of whose kinds the cases must be."""
    k, c = predictions(model, cases)
    return errors(cases, k, c)


def predictions(model: CalibratedModel, cases: list[FittedCase]) -> tuple[Array, Array]:
    """k and c of ``model`` for ``cases`` ``(n,)``."""
    k, c = np.empty(len(cases)), np.empty(len(cases))
    for kind in {case.kind for case in cases}:
        rows = [i for i, case in enumerate(cases) if case.kind == kind]
        k[rows], c[rows] = model.coefficients(kind, Points.of([cases[i] for i in rows]))
    return k, c


def known(model: CalibratedModel, cases: list[FittedCase]) -> list[FittedCase]:
    """The cases of kinds that the model was fitted to."""
    kinds = {*((part.plane, part.yielding) for part in model.plastic), ("strain", "none"), ("stress", "none")}
    return [case for case in cases if case.kind in kinds]


def cross_validate(cases: list[FittedCase], form: Form = FORM, folds: int = FOLDS) -> Errors:
    """Every case foretold by a model fitted to the other folds only (Stone 1974); each kind is in all folds.

    Raises `TooFewError`.
    """
    cases = known(fit_model(cases, form), cases)
    order = sorted(range(len(cases)), key=lambda i: (cases[i].kind, cases[i].digest))
    fold = np.empty(len(cases), dtype=int)
    fold[order] = np.arange(len(cases)) % folds
    k, c = np.empty(len(cases)), np.empty(len(cases))
    for f in range(folds):
        out = np.flatnonzero(fold == f)
        if len(out):
            model = fit_model([case for i, case in enumerate(cases) if fold[i] != f], form, plenty=1)
            k[out], c[out] = predictions(model, [cases[i] for i in out])
    return errors(cases, k, c)

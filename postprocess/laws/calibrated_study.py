"""From the fitted cases of a sweep to a model that knows how good it is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archord.postprocess.laws.calibrated_fit import (
    FORM,
    HELD_OUT,
    SIMPLER,
    Errors,
    cross_validate,
    errors,
    fit_model,
    known,
    model_errors,
    own_errors,
    split,
)
from archord.postprocess.laws.calibrated_law import joint_calibrated
from archord.postprocess.laws.calibrated_model import SOFT, SOFT_WORDS, CalibratedModel, Form, pin_softness
from archord.postprocess.laws.fitted_cases import FittedCase

ALL_KINDS = tuple((plane, yielding) for plane in ("strain", "stress") for yielding in ("none", "both", "block"))
_SHORT = 0.99  # of the largest load of the sweep, that a case must have reached
Row = tuple[str, str, str, dict[str, Any]]  # what, plane, which bodies yield, summary of errors


@dataclass(frozen=True)
class Study:
    """A ``model`` fitted to the cases ``used``, those ``held`` out, and the errors as rows of tables: by kind, each
    case foretold by the others or held out of all, and of ``simpler`` forms, each case foretold by the others."""

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
        reason = ""
        if case.kind not in ALL_KINDS:
            reason = "only the pin yields" if case.yielding == "pin" else "the bodies have unlike yield stresses"
        elif (softness := pin_softness(case)) > SOFT + 1e-3:
            reason = f"{SOFT_WORDS} = {softness:.3g} is more than {SOFT:g}: a soft pin, hardly compressible"
        elif case.load[-1] < _SHORT * longest:
            reason = f"ends at {case.load[-1]:.3g} dR, others at {longest:.3g}"
        if reason:
            out.append((case, reason))
        else:
            used.append(case)
    return used, out


def study(cases: list[FittedCase], share: float = HELD_OUT, form: Form = FORM) -> Study:
    """Hold a ``share`` of ``cases`` out, fit the model to the others, cross-validate it on them, and judge it by those
    held out. Raises `TooFewError`."""
    used, held = split(cases, share)
    model = fit_model(used, form)
    used, held = known(model, used), known(model, held)
    validated = cross_validate(used, form)
    parts = {"cross-validated": validated}
    if held:
        parts["held out"] = model_errors(model, held)
    rows: list[Row] = []
    for what, found in parts.items():
        rows += _rows(what, found)
    said = {
        what: {f"{plane} {yielding}": found for name, plane, yielding, found in rows if name == what} for what in parts
    }
    simpler: list[Row] = [(f.name, "both", "all", cross_validate(used, f).summary()) for f in SIMPLER]
    simpler.insert(0, ("k = 0.85, c = 1", "both", "all", _paper(used).summary()))
    simpler.append((form.name, "both", "all", validated.summary()))
    simpler.append(("own k and c", "both", "all", own_errors(used).summary()))
    return Study(replace(model, errors=said), used, held, rows, simpler)


def shipped_rows(cases: list[FittedCase]) -> list[Row]:
    """Errors of the law that comes with archord on ``cases``, by kind, of those that are inside its range."""
    found = [joint_calibrated(case.joint(1.0, 1.0)) for case in cases]
    inside = [(case, law) for case, law in zip(cases, found, strict=True) if not law.outside]
    if not inside:
        return []
    chosen = [case for case, _ in inside]
    k, c = (np.array([getattr(law, name) for _, law in inside]) for name in "kc")
    return _rows("archord's law", errors(chosen, k, c))


def _rows(what: str, found: Errors) -> list[Row]:
    """Summaries by kind, and of all, with what the shape of the law misses beside it."""
    rows: list[Row] = []
    for kind in (*ALL_KINDS, None):
        part = found if kind is None else found.of(kind)
        if part.cases:
            own = own_errors(list(part.cases)).summary().get("P", {})
            rows.append((what, *(kind or ("both", "all")), part.summary() | {"P own": own}))
    return rows


def _paper(cases: list[FittedCase]) -> Errors:
    c = [1.0 if math.isfinite(case.s) else math.inf for case in cases]
    return errors(cases, np.full(len(cases), 0.85), np.array(c))

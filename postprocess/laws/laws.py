"""The closed-form laws by name: ``LAWS["johnson"].force(joint, delta)``. Their formulas, ranges, sources and remarks in
words are laws.toml's."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from archord.postprocess.laws import calibrated
from archord.postprocess.laws import chord_laws as chord
from archord.postprocess.laws import elastic_laws as elastic
from archord.postprocess.laws.joint import Array, LawJoint
from archord.postprocess.laws.law import Law, LawState

_Function = Callable[[LawJoint, Array], Array]
_THIN = 0.1  # dR/R up to which R1 = R2 = R is an approximation
_ALIKE = 0.01  # Dundurs' beta that counts as zero
_DEEPEST = 2.0  # displacement over clearance up to which Hu et al. compare their law with finite elements


def _deepest(joint: LawJoint) -> float:
    return _DEEPEST * joint.clearance


def _thick(joint: LawJoint) -> str:
    ratio = joint.clearance / joint.radius
    return f"dR/R = {ratio:.3g} is no small clearance" if ratio > _THIN else ""


def _unlike(joint: LawJoint) -> str:
    if abs(joint.dundurs_beta) > _ALIKE:
        return f"Dundurs' beta = {joint.dundurs_beta:.3g} is not zero"
    return _thick(joint)


def _chord(force: _Function, stiffness: _Function, peak: _Function, **more: Any) -> dict[str, Any]:
    """A law with the contact angle of rigid circles that overlap."""

    def state(joint: LawJoint, delta: Array) -> LawState:
        values = (function(joint, delta) for function in (force, stiffness, peak, chord.chord_angle))
        return LawState(delta, *values)

    return {"state": state, "limit": _deepest, "unfit": _thick, **more}


def _liu(joint: LawJoint, delta: Array) -> LawState:
    alike = replace(joint, k=chord.LIU_K)
    P, slope = chord.paper_force(alike, delta), chord.paper_stiffness(alike, delta)
    return LawState(delta, P, slope, joint.E_star * delta / (2 * joint.radius), chord.chord_angle(joint, delta))


def _calibrated(joint: LawJoint, delta: Array) -> LawState:
    fitted = calibrated.with_coefficients(joint)
    P, slope, p0 = (f(fitted, delta) for f in (chord.plastic_force, chord.plastic_stiffness, chord.plastic_peak))
    return LawState(delta, P, slope, p0, chord.chord_angle(joint, delta))


def _logarithmic(make: Callable[[LawJoint], elastic.Logarithm], hertz: bool = True, **more: Any) -> dict[str, Any]:
    """Half-spaces up to the law's load limit, with the pressure and contact angle of ``hertz``, or without."""

    def state(joint: LawJoint, delta: Array) -> LawState:
        law = make(joint)
        P = law.force(delta)
        pressed = (elastic.hertz_pressure(joint, P), elastic.hertz_angle(joint, P)) if hertz else ()
        return LawState(delta, P, law.stiffness(delta), *pressed)

    return {
        "state": state,
        "limit": lambda joint: make(joint).delta_limit,
        "end": lambda joint: make(joint).delta_limit,
        "inverse": lambda joint, P: make(joint).displacement(P),
        **({"pressure_limit": elastic.hertz_load_limit} if hertz else {"gives": ("displacement",)}),
        **more,
    }


def _slender(joint: LawJoint) -> float:
    law = elastic.dubowsky_freudenstein(joint)
    return float(law.displacement(np.asarray(min(elastic.slender_load(joint), law.load_limit))))


def _of_load(peak: _Function, angle: _Function, **more: Any) -> dict[str, Any]:
    """A law that gives pressure and contact angle of a load."""

    def state(joint: LawJoint, P: Array) -> LawState:
        return LawState(np.array(np.nan), P, peak_pressure=peak(joint, P), angle=angle(joint, P))

    return {"state": state, "gives": ("pressure", "contact angle"), **more}


_FUNCTIONS: dict[str, dict[str, Any]] = {
    "calibrated": {
        "state": _calibrated,
        "limit": _deepest,
        "unfit": lambda joint: calibrated.joint_calibrated(joint).outside,
        "needs": ("plane", "nu"),
    },
    "paper": _chord(chord.paper_force, chord.paper_stiffness, chord.winkler_pressure),
    "paper-plastic": _chord(chord.plastic_force, chord.plastic_stiffness, chord.plastic_peak, needs=("yield_stress",)),
    "winkler": _chord(chord.winkler_force, chord.winkler_stiffness, chord.winkler_pressure),
    "liu": {"state": _liu, "limit": _deepest, "unfit": _thick},
    "johnson": _logarithmic(elastic.johnson),
    "radzimovsky": _logarithmic(elastic.radzimovsky),
    "radzimovsky-width": _logarithmic(lambda joint: elastic.radzimovsky(joint, elastic.ROARK_WIDTH)),
    "radzimovsky-2.41": _logarithmic(lambda joint: elastic.radzimovsky(joint, elastic.IMPLIED_WIDTH)),
    "esdu-78035": _logarithmic(elastic.esdu, hertz=False),
    "dubowsky-freudenstein": _logarithmic(
        elastic.dubowsky_freudenstein, hertz=False, limit=_slender, needs=("length",)
    ),
    "lankarani-nikravesh": {
        "state": elastic.lankarani_nikravesh,
        "limit": elastic.lankarani_nikravesh_limit,
        "inverse": elastic.lankarani_nikravesh_displacement,
        "needs": ("length",),
        "gives": ("displacement", "pressure"),
    },
    "hertz": _of_load(elastic.hertz_pressure, elastic.hertz_angle, limit=elastic.hertz_load_limit),
    "persson": _of_load(elastic.persson_peak, elastic.persson_angle, limit=lambda joint: math.inf, unfit=_unlike),
}
_WORDS = tomllib.loads((Path(__file__).parent / "laws.toml").read_text(encoding="utf-8"))

LAWS: dict[str, Law] = {name: Law(name, **_WORDS[name], **functions) for name, functions in _FUNCTIONS.items()}


def find_law(name: str) -> Law:
    """The law called ``name``; raises ValueError that names the nearest one and all."""
    if name in LAWS:
        return LAWS[name]
    near = difflib.get_close_matches(name, LAWS, 1)
    hint = f"did you mean {near[0]}? " if near else ""
    raise ValueError(f"{name}: is not a known law; {hint}Laws are {', '.join(LAWS)}.")

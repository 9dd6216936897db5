"""The closed-form laws by name: ``LAWS["johnson"].force(joint, delta)``. Their formulas, ranges,
sources and remarks in words are laws.toml's."""

from __future__ import annotations

import difflib
import math

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws import chord_laws as chord
from archord.postprocess.laws import elastic_laws as elastic
from archord.postprocess.laws.general import general_law as general
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.law import Law, LawState
from archord.report.by_name import ByName
from archord.report.files import toml_beside

_THIN = 0.1  # dR/R up to which R1 = R2 = R is an approximation
_ALIKE = 0.01  # Dundurs' beta that counts as zero
_DEEPEST = (
    2.0  # displacement over clearance up to which Hu et al. compare their law with finite elements
)


def _archord(joint: LawJoint, delta: Array) -> LawState:
    found = general.law_of_joint(joint, extrapolate=True).at(delta)
    return LawState(
        delta, found.load, found.stiffness, found.peak_pressure, found.angle, found.error
    )


def _thick(joint: LawJoint) -> str:
    ratio = joint.clearance / joint.radius
    return f"dR/R = {ratio:.3g} is no small clearance" if ratio > _THIN else ""


def _unlike(joint: LawJoint) -> str:
    if abs(joint.dundurs_beta) > _ALIKE:
        return f"Dundurs' beta = {joint.dundurs_beta:.3g} is not zero"
    return _thick(joint)


def _half_spaces(A: float, q: float, hertz: bool = True) -> ByName:
    """`elastic.logarithm` up to its load limit, with the pressure and contact angle of ``hertz`` in
    his range."""

    def state(joint: LawJoint, delta: Array) -> LawState:
        found = elastic.logarithm(joint, delta, A, q)
        if not hertz:
            return found
        small = np.where(elastic.hertz_load_limit(joint) >= found.load, found.load, np.nan)
        return LawState(*found[:3], *elastic.hertz(joint, small)[3:])

    gives = {} if hertz else {"gives": ("displacement",)}
    return {"state": state, "limit": lambda joint: elastic.turning_point(joint, A, q), **gives}


_CHORD: ByName = {"limit": lambda joint: _DEEPEST * joint.clearance, "unfit": _thick}
_WINKLER: ByName = {"coefficients": ("k",), **_CHORD}
_PLASTIC: ByName = {
    "coefficients": ("k", "c"),
    "needs": ("yield_stress",),
    "plastic": True,
    **_CHORD,
}
_OF_LOAD = {"gives": ("pressure", "contact angle")}
_FUNCTIONS: dict[str, ByName] = {
    "archord": {
        "state": _archord,
        "limit": lambda joint: general.NODES[-1] * joint.clearance,
        "unfit": general.outside,
        "needs": ("plane", "nu"),
        "plastic": True,
        "solved": True,
    },
    "paper": {"state": chord.parabola, **_WINKLER},
    "paper-plastic": {"state": chord.plastic_winkler, **_PLASTIC},
    "winkler": {"state": chord.winkler, **_WINKLER},
    "liu": {"state": chord.liu, **_CHORD},
    "johnson": _half_spaces(
        4 * math.pi, -1.0
    ),  # the bracket is ln(4 R1/a) + ln(4 R2/a) - 1 with Hertz's half-width a
    # 2/3 + ln(4 R1/d) + ln(4 R2/d) with d = width (R* P/E*)^(1/2), so A = 16/width^2: R1 and R2
    # cancel
    "radzimovsky": _half_spaces(16 / 1.6**2, 2 / 3),
    "radzimovsky-width": _half_spaces(
        16 / (2 * 1.6**2), 2 / 3
    ),  # Roark's K_D = D1 D2/(D1 - D2) is 2 R*
    "radzimovsky-2.41": _half_spaces(
        2.41 * math.exp(1 / 3), 2 / 3
    ),  # by the limit of 2.41 E* dR (below eq. 9)
    "esdu-78035": _half_spaces(4 * math.pi, 1.0, hertz=False),
    "dubowsky-freudenstein": {
        "state": elastic.dubowsky_freudenstein,
        "limit": elastic.dubowsky_freudenstein_limit,
        "needs": ("length",),
        "gives": ("displacement",),
    },
    "lankarani-nikravesh": {
        "state": elastic.lankarani_nikravesh,
        # where the radius of Hertz's contact circle, sqrt(R* delta), is R1/2
        "limit": lambda joint: (joint.radius / 2) ** 2 / joint.relative_radius,
        "needs": ("length",),
        "gives": ("displacement", "pressure"),
    },
    "hertz": {"state": elastic.hertz, "limit": elastic.hertz_load_limit, **_OF_LOAD},
    "persson": {
        "state": elastic.persson,
        "limit": lambda joint: math.inf,
        "unfit": _unlike,
        **_OF_LOAD,
    },
}
_WORDS = toml_beside(__file__, "laws.toml")

LAWS: dict[str, Law] = {
    name: Law(name, **_WORDS[name], **functions) for name, functions in _FUNCTIONS.items()
}


def default_law(joint: LawJoint) -> Law:
    """The law of ``joint`` where none is named."""
    if joint.plane is not None and joint.nu is not None:
        return LAWS["archord"]
    return LAWS["paper" if joint.yield_stress is None else "paper-plastic"]


def find_law(name: str) -> Law:
    """The law called ``name``; raises ValueError that names the nearest one and all."""
    if name in LAWS:
        return LAWS[name]
    hint = "".join(f"did you mean {near}? " for near in difflib.get_close_matches(name, LAWS, 1))
    raise ValueError(f"{name}: is not a known law; {hint}Laws are {', '.join(LAWS)}.")

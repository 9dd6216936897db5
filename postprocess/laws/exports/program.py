"""What the law of one joint has to say in any language: its numbers in the joint's units, the
functions that use them, and how it is used, in words.

There are two kinds of laws: tables (`JointCurve`), of the general law or of a run, and the formula
that is fitted to runs (`FittedLaw`).
"""

from __future__ import annotations

import json
import textwrap
from dataclasses import dataclass
from typing import Any

import numpy as np

from archord.materials.kinematics import Arrays
from archord.postprocess.laws.exports import dents, element
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.law import ROUND_OFF
from archord.report.by_name import ByName

# int, float, str or list[float] by the names of algorithm.py, and the units
Tables = dict[str, Any]

_STATE = """The force P and dP/d(delta) follow from the displacement delta and from one number that
the joint remembers: deepest, the largest delta of all accepted steps, 0 at first. Trial steps leave
it as it is. Beyond RANGE, the end of the tables, the force goes on straight, which is a guess;
stiffness, expected error, pressure, angle and residual clearance are nan there, and all are nan of
nan."""
_ELASTIC = """The joint does not yield: it comes back along its first loading, and deepest changes
nothing."""
_FORMULA = """The force P and dP/d(delta) follow from the displacement delta by a formula of first
loading: deepest, the largest delta of all accepted steps, changes nothing, as the law knows no way
back. Beyond RANGE, up to which the law was fitted, the formula goes on, which is a guess; the
stiffness is nan there, and both are nan of nan."""
_ELEMENT = """The force element gives force and torque on the pin, with their derivatives, from the
eccentricity e of the pin in the hole, its rate v and the relative angular velocity. It remembers
the deepest displacement of each of its sectors; trial steps leave this memory as it is."""
_FALLS = """ So that no path gains energy, its force on first loading is below the force of the law
by up to {fall:.1%} of the largest one."""
_FELT = 0.01  # of this, from which on it is told; the law of solved joints has 0.005 at most
# what an element adds to the functions of algorithm.py
_ELEMENT_FUNCTIONS = ["forces", "sector_deeper", "hunt_crossley", "lankarani_nikravesh"]
ELEMENT_NUMBERS: Tables = {
    key: getattr(element, key) for key in ("SECTORS", "SECTOR", "SMOOTHED", "FADED")
}
_UNKNOWN_END = 1e300  # of the range of a law that does not tell it


@dataclass(frozen=True)
class Program:
    """What a law has to say in any language."""

    about: ByName  # what it is the law of, from the title on
    rule: str  # how it is used, in words
    functions: list[str]  # of algorithm.py, which users call
    flags: dict[str, bool]  # of algorithm.py
    numbers: Tables
    length_unit: str
    force_unit: str
    pin_length: float  # length of the pin that carries the force

    @classmethod
    def of(cls, law: JointCurve | FittedLaw) -> Program:
        """The program of ``law``."""
        return _of_formula(law) if isinstance(law, FittedLaw) else _of_tables(law)

    @property
    def units(self) -> str:
        """The units of the law, and the length of the pin that its forces are of."""
        of = "per unit length of the pin"
        length = f"a pin of length PIN_LENGTH = {self.pin_length:g}"
        rule = "multiply them by the pin's length"
        if self.pin_length != 1:
            of = f"total, of a pin of length {self.pin_length:g} ({self.length_unit})"
            rule = "do not multiply them by the length"
        elif self._is_total:
            of = "total"
            length = "the whole pin, for which PIN_LENGTH = 1 stands"
            rule = "do not multiply them by the length"
        return (
            f"UNITS: displacements in {self.length_unit}; force P in {self.force_unit}, {of}: P, "
            f"stiffness and expected error are for {length}; {rule}."
        )

    @property
    def _is_total(self) -> bool:
        """Whether the unit of force is named, and not of a force per length."""
        per_length = tuple(f"{sign}{self.length_unit}" for sign in ("/", " "))
        is_named = not self.force_unit.startswith(("unit of", "-"))
        return is_named and not self.force_unit.endswith(per_length)

    @property
    def header(self) -> str:
        """What the file is, where it comes from and how it is used, fit for a comment of any
        language."""
        title, *about = self.about.items()
        lines = [title[1], ""]
        for key, value in about:
            said = f"{key}: {value if isinstance(value, str) else json.dumps(value)}"
            lines.append(textwrap.fill(said, 110, subsequent_indent="    "))
        for paragraph in (self.units, self.rule):
            lines += ["", textwrap.fill(" ".join(paragraph.split()), 110)]
        text = "\n".join(lines)
        for mark, instead in (("\\", "/"), ('"""', "'''"), ("*/", "* /"), ("/*", "/ *")):
            text = text.replace(mark, instead)
        return text


def _of_tables(curve: JointCurve) -> Program:
    """The program of tables, in the units of the joint."""
    length = float(curve.length)
    force = float(curve.force)
    pressure = float(curve.pressure)
    root = np.sqrt(force)
    arrays = {
        "NODES": length * curve.x,
        "LOAD": force * curve.y,
        "LOAD_SLOPE": force / length * curve.dy,
        "BACK": force * curve.back,
        "BACK_SLOPE": force / length * curve.dback,
        "RATIO": curve.ratio,
        "RATIO_SLOPE": curve.dratio / length,
        "TOE": length * curve.toe,
        "TOUCH": curve.touch,
        "PEAK": pressure / root * curve.peak,
        "PEAK_SLOPE": pressure / root / length * curve.dpeak,
        "ANGLE": curve.angle / root,
        "ANGLE_SLOPE": curve.dangle / root / length,
        "ERROR": curve.error,
        "BACK_ERROR": curve.back_error,
    }
    last = len(curve.x) - 1
    numbers = {
        "LAST": last,
        "HALVINGS": last.bit_length(),
        "RANGE": float(length * curve.x[-1]),
        "REACH": float(length * curve.reach),
        "LENGTH": length,
        "FORCE": force,
        "WIDEST": float(curve.widest),
    }
    functions = ["force", "deeper", "residual"]
    if np.isfinite([curve.error, curve.back_error]).all():
        functions.append("expected_error")
    rule = _STATE if curve.yields else f"{_STATE} {_ELASTIC}"
    if curve.radius is not None:
        functions += [*_ELEMENT_FUNCTIONS, "stored_energy"]
        rule = f"{rule} {_ELEMENT}"
        fall = dents.fall(curve) if curve.yields else 0.0
        if fall > _FELT:
            rule += _FALLS.format(fall=fall)
        numbers |= ELEMENT_NUMBERS | {"RADIUS": float(curve.radius)}
        arrays |= _element_tables(curve)
    if np.isfinite(curve.peak).all():
        functions.append("peak_pressure")
    if np.isfinite(curve.angle).all():
        functions.append("contact_angle")
    return Program(
        about={"title": "law of a pin joint"} | curve.about,
        rule=rule,
        functions=functions,
        flags={
            "WITH_TOUCH": curve.touch.size > 0,
            "WITH_WAY_BACK": curve.yields,
            "WITH_TOE": bool(curve.toe.any()),
            "WITH_CHORD": False,
        },
        numbers=numbers | {key: values.tolist() for key, values in arrays.items()},
        length_unit=curve.length_unit,
        force_unit=curve.force_unit,
        pin_length=float(curve.pin_length),
    )


def _element_tables(curve: JointCurve) -> Arrays:
    """The tables of the force element, in the units of the joint."""
    shift, slope = dents.shift(curve)
    energy = curve.length * curve.force
    return {
        "SHIFT": curve.length * shift,
        "SHIFT_SLOPE": slope,
        "STORED": energy * dents.stored(curve),
    }


def _of_formula(law: FittedLaw) -> Program:
    """The program of the formula that was fitted to runs."""
    plastic = law.c is not None and law.sigY is not None
    end = law.fitted_range[1] * law.dR or _UNKNOWN_END
    return Program(
        about=law.about,
        rule=f"{_FORMULA} {_ELEMENT}",
        functions=["force", "deeper", *_ELEMENT_FUNCTIONS],
        flags={"WITH_CHORD": True, "WITH_PLATEAU": plastic, "WITH_WAY_BACK": False},
        numbers=ELEMENT_NUMBERS
        | {
            "RANGE": end,
            "REACH": end * (1 + ROUND_OFF),
            "LENGTH": law.dR,
            "RADIUS": law.R,
            "FOUNDATION": law.k * law.E_star / law.R,
            "PLATEAU": (law.c or 0.0) * (law.sigY or 0.0),
        },
        length_unit=law.length_unit,
        force_unit=law.force_unit,
        pin_length=1.0,
    )

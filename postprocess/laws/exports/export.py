"""A joint's law as one file for another program: its numbers in the joint's units, and the
functions that use them.

There are two kinds of laws: tables (`JointCurve`), of the general law or of a run, and the formula
that is fitted to runs (`FittedLaw`). The functions of ``algorithm.py`` stand there in every
language, less what the law has no need of: the way back of a joint that does not yield, the
logarithmic law of first touch, pressure and angle where they are unknown.
"""

from __future__ import annotations

import builtins
import json
import keyword
import re
import sys
import textwrap
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from pprint import pformat
from string import Template
from typing import Any

import numpy as np

from archord.postprocess.laws.exports import dents, element
from archord.postprocess.laws.exports.translate import (
    FUNCTIONS,
    in_c,
    in_javascript,
    in_modelica,
    in_octave,
    in_python,
    select,
)
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.law import ROUND_OFF

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
# what an element adds to the functions of algorithm.py
_ELEMENT_FUNCTIONS = ["forces", "sector_deeper", "hunt_crossley", "lankarani_nikravesh"]
_INNER = {"deeper", "forces", "sector_deeper"}  # which users do not call


@dataclass(frozen=True)
class Contact:
    """Damping and friction that an exported force element has unless it is told others.

    Parameters
    ----------
    damping : float
        c of the factor ``1 + c d(delta)/dt`` of the force.
    mu_static, mu_dynamic : float
        The coefficients of friction, of which the static one is not smaller.
    stick_speed : float
        The slip speed up to which friction rises.

    Raises
    ------
    ValueError
        For values that no contact has.

    Examples
    --------
    >>> from archord.postprocess.laws.exports.export import Contact
    >>> Contact(mu_static=0.2, mu_dynamic=0.15, stick_speed=1.0).damping
    0.0
    """

    damping: float = 0.0
    mu_static: float = 0.0
    mu_dynamic: float = 0.0
    stick_speed: float = 1.0

    def __post_init__(self) -> None:
        """Check the values."""
        if not 0 <= self.damping < np.inf:
            raise ValueError(f"damping = {self.damping:g} must be a number that is not negative.")
        if not 0 <= self.mu_dynamic <= self.mu_static < np.inf:
            raise ValueError(
                f"friction of {self.mu_static:g} (static) and {self.mu_dynamic:g} (dynamic): the "
                "dynamic one must not be negative, and the static one not smaller."
            )
        if not 0 < self.stick_speed < np.inf:
            raise ValueError(f"stick_speed = {self.stick_speed:g} must be a positive number.")


@dataclass(frozen=True)
class Program:
    """What a law has to say in any language."""

    about: dict[str, Any]  # what it is the law of, from the title on
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
        rule = "multiply them by the pin's length"
        if self.pin_length != 1:
            of = f"total, of a pin of length {self.pin_length:g} ({self.length_unit})"
            rule = "do not multiply them by the length"
        return (
            f"UNITS: displacements in {self.length_unit}; force P in {self.force_unit}, {of}: P, "
            "stiffness and expected error are for a pin of length PIN_LENGTH = "
            f"{self.pin_length:g}; {rule}."
        )

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


@dataclass(frozen=True)
class _Form:
    """How a language writes an integer, a number, a table with the ends of its lines, words, text,
    and functions."""

    template: str
    whole: str
    number: str
    table: str
    line_end: str
    words: str
    text: Callable[[dict[str, Any] | str], str]
    function: Callable[..., str]


def _quoted(about: dict[str, Any] | str) -> str:
    return json.dumps(about if isinstance(about, str) else json.dumps(about), ensure_ascii=False)


def _quoted_once(about: dict[str, Any] | str) -> str:
    text = about if isinstance(about, str) else json.dumps(about)
    return "'" + text.replace("'", "''") + "'"


def _literal(about: dict[str, Any] | str) -> str:
    return pformat(about, width=110, sort_dicts=False)


_FORMS = {
    ".py": _Form(
        "python",
        "{key} = {value}",
        "{key} = {value}",
        "{key}: Table = (\n    {value},\n)",
        ",\n    ",
        "{key} = {value}",
        _literal,
        in_python,
    ),
    ".h": _Form(
        "c",
        "enum {{ {name}_{key} = {value} }};",
        "static const double {name}_{key} = {value};",
        "static const double {name}_{key}[] = {{\n    {value}\n}};",
        ",\n    ",
        "static const char {name}_{key}[] = {value};",
        _quoted,
        in_c,
    ),
    ".mo": _Form(
        "modelica",
        "  constant Integer {key} = {value};",
        "  constant Real {key} = {value};",
        "  constant Real {key}[{n}] = {{\n    {value}}};",
        ",\n    ",
        "  constant String {key} = {value};",
        _quoted,
        in_modelica,
    ),
    ".mjs": _Form(
        "javascript",
        "export const {key} = {value};",
        "export const {key} = {value};",
        "export const {key} = [\n    {value},\n];",
        ",\n    ",
        "export const {key} = {value};",
        json.dumps,
        in_javascript,
    ),
    ".m": _Form(
        "octave",
        "    T.{key} = {value};",
        "    T.{key} = {value};",
        "    T.{key} = [ ...\n        {value}];",
        ", ...\n        ",
        "    T.{key} = {value};",
        _quoted_once,
        in_octave,
    ),
}
_TEMPLATES = tomllib.loads(Path(__file__).with_name("templates.toml").read_text(encoding="utf-8"))
_WORDS = {
    name: {*words.split()}
    for name, words in tomllib.loads(
        Path(__file__).with_name("words.toml").read_text(encoding="utf-8")
    ).items()
} | {"python": {*keyword.kwlist, *sys.stdlib_module_names, *dir(builtins)}}
_SPOKEN = {
    "python": "Python",
    "c": "C or C++",
    "modelica": "Modelica",
    "octave": "Matlab and Octave",
    "javascript": "JavaScript",
}
_ELEMENT_NUMBERS: Tables = {
    key: getattr(element, key) for key in ("SECTORS", "SECTOR", "SMOOTHED", "FADED")
}
_UNKNOWN_END = 1e300  # of the range of a law that does not tell it
_LONGEST = 63  # characters of a name in Matlab, and those that C99 tells apart


def export_law(law: JointCurve | FittedLaw, target: Path, contact: Contact | None = None) -> str:
    """The text of a file with the law of one joint, for another program.

    Parameters
    ----------
    law : JointCurve or FittedLaw
        The law.
    target : Path
        The file, which is not written. Its suffix names the language: .py, .h (C99), .mo
        (Modelica), .m (Matlab, Octave), .mjs (a module of JavaScript) or .json. Its stem becomes
        the name of the law, but in JSON.
    contact : Contact
        Damping and friction of the force element; None is neither.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        For another suffix, a stem that is no name, and tables that have gaps or a way back that
        does not rise.

    Examples
    --------
    >>> from pathlib import Path
    >>> from archord.postprocess.laws.exports.export import export_law
    >>> from archord.postprocess.laws.general.general_law import general_law
    >>> from archord.postprocess.laws.general.joint import LawJoint
    >>> joint = LawJoint(radius=10.0, clearance=0.05, E_star=115e3, plane="strain", nu=0.3)
    >>> text = export_law(general_law(joint), Path("pin_law.h"))
    >>> "static const double pin_law_NODES[]" in text
    True
    """
    if target.suffix not in (*_FORMS, ".json"):
        raise ValueError(
            f"{target.name}: a law is exported to files that end in {', '.join(_FORMS)} or .json"
        )
    program = Program.of(law)
    if target.suffix == ".json":
        if isinstance(law, FittedLaw):
            return law.model_dump_json(indent=1) + "\n"
        return replace(law, about=law.about | {"forces": program.units}).to_json()
    name = target.stem
    form = _FORMS[target.suffix]
    check_name(target, form.template)
    functions, used = select(program.functions, program.flags)
    used |= {"RANGE", "REACH"}
    if "forces" in program.functions:
        used.add("SECTORS")
    numbers = {key: values for key, values in program.numbers.items() if key in used}
    _check(numbers)
    for key in ("length_unit", "force_unit", "pin_length"):
        numbers[key.upper()] = getattr(program, key)
    title = program.about["title"]
    parts = _element_parts(form.template, name, program, contact or Contact())
    return Template(_TEMPLATES[form.template].lstrip()).substitute(
        name=name,
        title=title.replace("\\", "/").replace('"', "'"),
        header=program.header,
        about=form.text(program.about),
        tables="\n".join(_table(form, name, key, values) for key, values in numbers.items()),
        functions="\n\n".join(form.function(node, name) for node in functions),
        handles="\n".join(
            f"    the_law.{function} = @{function};"
            for function in program.functions
            if function not in _INNER
        )
        + parts["handles"],
        element=parts["element"],
    )


def _element_parts(language: str, name: str, program: Program, contact: Contact) -> dict[str, str]:
    """What surrounds the force element: functions, and Octave's handles; empty without one."""
    if "forces" not in program.functions:
        return {"element": "", "handles": ""}
    given = {"name": name} | {key: repr(float(value)) for key, value in vars(contact).items()}
    wanted = {"element": f"{language}_element", "handles": f"{language}_handles"}
    texts = {key: _TEMPLATES.get(template, "") for key, template in wanted.items()}
    return {key: Template(text.rstrip()).substitute(given) for key, text in texts.items()}


def check_name(target: Path, language: str) -> None:
    """Raise ValueError if the stem of ``target`` cannot name a law in the ``language``."""
    name = target.stem
    fault = None
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        fault = "a name begins with a letter a to z, and has letters, digits and _"
    elif len(name) > _LONGEST:
        fault = f"it has {len(name)} characters, and a name has at most {_LONGEST}"
    elif name in FUNCTIONS:
        fault = "the file has a function of this name"
    elif name in _WORDS[language]:
        fault = f"it is a name that {_SPOKEN[language]} has already"
    if fault:
        raise ValueError(
            f"{target.name}: {name} cannot name a law: {fault}; choose another name for the file"
        )


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
    functions = ["force", "deeper", "residual", "expected_error"]
    rule = _STATE if curve.yields else f"{_STATE} {_ELASTIC}"
    if curve.radius is not None:
        functions += [*_ELEMENT_FUNCTIONS, "stored_energy"]
        rule = f"{rule} {_ELEMENT}"
        numbers |= _ELEMENT_NUMBERS | {"RADIUS": curve.radius}
        shift, shift_slope = dents.shift(curve)
        arrays |= {
            "SHIFT": length * shift,
            "SHIFT_SLOPE": shift_slope,
            "STORED": length * force * dents.stored(curve),
        }
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
        pin_length=curve.pin_length,
    )


def _of_formula(law: FittedLaw) -> Program:
    """The program of the formula that was fitted to runs."""
    plastic = law.c is not None and law.sigY is not None
    end = law.fitted_range[1] * law.dR or _UNKNOWN_END
    return Program(
        about=law.about,
        rule=f"{_FORMULA} {_ELEMENT}",
        functions=["force", "deeper", *_ELEMENT_FUNCTIONS],
        flags={"WITH_CHORD": True, "WITH_PLATEAU": plastic, "WITH_WAY_BACK": False},
        numbers=_ELEMENT_NUMBERS
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


def _check(tables: Tables) -> None:
    bad = [key for key, values in tables.items() if not np.isfinite(values).all()]
    if bad:
        raise ValueError(f"a law with gaps in its tables cannot be exported: {', '.join(bad)}")
    if "BACK" in tables and not (
        (np.diff(tables["BACK"]) > 0).all() and tables["BACK_SLOPE"][-1] > 0
    ):
        raise ValueError("a law whose way back does not rise throughout cannot be exported")


def _table(form: _Form, name: str, key: str, values: Any) -> str:
    if isinstance(values, list):
        rows = [", ".join(map(repr, values[i : i + 5])) for i in range(0, len(values), 5)]
        return form.table.format(name=name, key=key, n=len(values), value=form.line_end.join(rows))
    if isinstance(values, str):
        return form.words.format(name=name, key=key, value=form.text(values))
    kind = form.whole if isinstance(values, int) else form.number
    return kind.format(name=name, key=key, value=repr(values))


def skeleton(law: JointCurve, suffix: str) -> str:
    """What `export_law` writes into a file with this ``suffix``, with ``@name@``, ``@title@``,
    ``@header@``, ``@about@`` and ``@TABLE@``, of each table, where it tells of the joint: for
    programs that fill them in for other joints of this kind and these units."""
    program = Program.of(law)
    form = _FORMS[suffix]
    name = "name_of_the_law"
    text = export_law(law, Path(name + suffix))
    numbers = program.numbers | {"PIN_LENGTH": program.pin_length}
    for key, values in numbers.items():
        if not isinstance(values, int) and key not in _ELEMENT_NUMBERS:
            text = text.replace(_table(form, name, key, values), f"@{key}@", 1)
    text = text.replace(program.header, "@header@")
    text = text.replace(form.text(program.about), "@about@")
    return text.replace(program.about["title"], "@title@").replace(name, "@name@")


def forms() -> dict[str, dict[str, str]]:
    """How each language writes a number, a table and the ends of its lines, by suffix."""
    names = ("number", "table", "line_end")
    return {
        suffix: {name: getattr(form, name) for name in names} for suffix, form in _FORMS.items()
    }

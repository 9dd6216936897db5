"""A joint's law as one file for another program: tables in the joint's units, and the functions
that read them.

The functions are those of ``algorithm.py`` in every language, less what the law has no need of: the
way back of a joint that does not yield, the logarithmic law of first touch, pressure and angle
where they are unknown.
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

from archord.postprocess.laws.exports.translate import (
    FUNCTIONS,
    in_c,
    in_modelica,
    in_octave,
    in_python,
    select,
)
from archord.postprocess.laws.general.joint_curve import JointCurve

Tables = dict[
    str, Any
]  # int, float, str or list[float] by the names of algorithm.py, and of `_UNITS`

_UNITS = ("length_unit", "force_unit", "pin_length")
_STATE = """The force P and dP/d(delta) follow from the displacement delta and from one number that the joint remembers:
deepest, the largest delta of all accepted steps, 0 at first. Trial steps leave it as it is. Beyond RANGE, the end of
the tables, the force goes on straight, which is a guess; stiffness, expected error, pressure, angle and residual
clearance are nan there, and all are nan of nan."""
_ELASTIC = (
    "The joint does not yield: it comes back along its first loading, and deepest changes nothing."
)


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
        "static const int {name}_{key} = {value};",
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
}
_LONGEST = 63  # characters of a name in Matlab, and those that C99 tells apart


def export_curve(curve: JointCurve, target: Path) -> str:
    """The text of the file ``target`` with the law of one joint, in the language that its suffix
    names: .py, .h (C99), .mo (Modelica), .m (Matlab, Octave), .json. Its stem becomes the name of
    the law, but in JSON.

    Raises ValueError on another suffix, a stem that is no name, and tables that have gaps or a way
    back that does not rise.
    """
    if target.suffix not in (*_FORMS, ".json"):
        raise ValueError(
            f"{target.name}: a law is exported to files that end in {', '.join(_FORMS)} or .json"
        )
    if target.suffix == ".json":
        return replace(curve, about=curve.about | {"forces": _units(curve)}).to_json()
    name, form = target.stem, _FORMS[target.suffix]
    _check_name(target, form.template)
    tables = _tables(curve)
    wanted = ["force", "deeper", "residual", "expected_error"]
    wanted += [
        f
        for f, key in (("peak_pressure", "PEAK"), ("contact_angle", "ANGLE"))
        if np.isfinite(tables[key]).all()
    ]
    flags = {
        "WITH_TOUCH": curve.touch.size > 0,
        "WITH_WAY_BACK": curve.yields,
        "WITH_TOE": bool(curve.toe.any()),
    }
    functions, used = select(wanted, flags)
    tables = {key: values for key, values in tables.items() if key in {*used, "RANGE", "REACH"}}
    _check(tables)
    tables |= {name.upper(): getattr(curve, name) for name in _UNITS}
    title = str(curve.about.get("title", "law of a pin joint"))
    return Template(_TEMPLATES[form.template].lstrip()).substitute(
        name=name,
        title=title.replace("\\", "/").replace('"', "'"),
        header=_header(title, curve),
        about=form.text(curve.about),
        tables="\n".join(_table(form, name, key, values) for key, values in tables.items()),
        functions="\n\n".join(form.function(node, name) for node in functions),
        handles="\n".join(
            f"    the_law.{function} = @{function};" for function in wanted if function != "deeper"
        ),
    )


def _check_name(target: Path, language: str) -> None:
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


def _tables(curve: JointCurve) -> Tables:
    """All numbers of the law, in the units of the joint."""
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
    numbers = {
        "LAST": len(curve.x) - 1,
        "RANGE": float(length * curve.x[-1]),
        "REACH": float(length * curve.reach),
        "LENGTH": length,
        "FORCE": force,
        "WIDEST": float(curve.widest),
    }
    return numbers | {key: values.tolist() for key, values in arrays.items()}


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


def _units(curve: JointCurve) -> str:
    """The units of the law, and the length of the pin that its forces are of."""
    if curve.pin_length == 1:
        of, rule = "per unit length of the pin", "multiply them by the pin's length"
    else:
        of = f"total, of a pin of length {curve.pin_length:g} ({curve.length_unit})"
        rule = "do not multiply them by the length"
    said = f"UNITS: displacements in {curve.length_unit}; force P in {curve.force_unit}, {of}: P, stiffness and expected"
    return f"{said} error are for a pin of length PIN_LENGTH = {curve.pin_length:g}; {rule}."


def _header(title: str, curve: JointCurve) -> str:
    """What the file is, where it comes from and how it is used, fit for a comment of any
    language."""
    about = {key: value for key, value in curve.about.items() if key != "title"}
    lines = [
        f"{key}: {value if isinstance(value, str) else json.dumps(value)}"
        for key, value in about.items()
    ]
    lines = [textwrap.fill(line, 110, subsequent_indent="    ") for line in lines]
    rule = " ".join((_STATE if curve.yields else f"{_STATE} {_ELASTIC}").split())
    text = "\n".join(
        [title, "", *lines, "", textwrap.fill(_units(curve), 110), "", textwrap.fill(rule, 110)]
    )
    for mark, instead in (("\\", "/"), ('"""', "'''"), ("*/", "* /"), ("/*", "/ *")):
        text = text.replace(mark, instead)
    return text

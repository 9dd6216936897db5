"""A joint's law as one file for another program: its `Program` in one language.

The functions of ``algorithm.py`` stand there in every language, less what the law has no need of:
the way back of a joint that does not yield, the logarithmic law of first touch, pressure and angle
where they are unknown.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from string import Template

import numpy as np

from archord.postprocess.laws.exports.contact import Contact
from archord.postprocess.laws.exports.file_forms import FILE_FORMS
from archord.postprocess.laws.exports.names import check_name
from archord.postprocess.laws.exports.program import Program, Tables
from archord.postprocess.laws.exports.translate import select
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.report.by_name import Words
from archord.report.files import toml_beside

_OF_MEMORY = {"stored_energy"}
_INNER = {"deeper", "forces", "sector_deeper"}  # which users do not call
_TEMPLATES = toml_beside(__file__, "templates.toml")


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
    if target.suffix not in (*FILE_FORMS, ".json"):
        known = ", ".join(FILE_FORMS)
        raise ValueError(f"{target.name}: a law is exported to files that end in {known} or .json")
    program = Program.of(law)
    if target.suffix == ".json":
        if isinstance(law, FittedLaw):
            return law.model_dump_json(indent=1) + "\n"
        return replace(law, about=law.about | {"forces": program.units}).to_json()
    name = target.stem
    form = FILE_FORMS[target.suffix]
    check_name(target, form.template)
    functions, used = select(program.functions, program.flags)
    title = program.about["title"]
    constants = [form.constant(name, *each) for each in _constants(program, used).items()]
    called = [function for function in program.functions if function not in _INNER]
    handles = [f"    the_law.{function} = {_handle(function)};" for function in called]
    parts = _element_parts(form.template, name, program, contact or Contact())
    return Template(_TEMPLATES[form.template].lstrip()).substitute(
        name=name,
        title=title.replace("\\", "/").replace('"', "'"),
        header=program.header,
        about=form.text(program.about),
        tables="\n".join(constants),
        functions="\n\n".join(form.function(node, name) for node in functions),
        handles="\n".join(handles) + parts["handles"],
        element=parts["element"],
    )


def _handle(function: str) -> str:
    """Octave's handle of a ``function``, which takes numbers but for the one of a memory: products
    of arrays are of matrices there."""
    if function in _OF_MEMORY:
        return f"@{function}"
    return f"@(varargin) of_scalars(@{function}, varargin)"


def _constants(program: Program, used: set[str]) -> Tables:
    """The numbers of ``program`` that its functions and the text around them have ``used``."""
    around = {"RANGE", "REACH"}
    if "forces" in program.functions:
        around.add("SECTORS")
    numbers = {key: value for key, value in program.numbers.items() if key in used | around}
    _check(numbers)
    for key in ("length_unit", "force_unit", "pin_length"):
        numbers[key.upper()] = getattr(program, key)
    return numbers


def _element_parts(language: str, name: str, program: Program, contact: Contact) -> Words:
    """What surrounds the force element: functions, and Octave's handles; empty without one."""
    if "forces" not in program.functions:
        return {"element": "", "handles": ""}
    given = {"name": name} | {key: repr(float(value)) for key, value in vars(contact).items()}
    wanted = {"element": f"{language}_element", "handles": f"{language}_handles"}
    texts = {key: _TEMPLATES.get(template, "") for key, template in wanted.items()}
    return {key: Template(text.rstrip()).substitute(given) for key, text in texts.items()}


def _check(numbers: Tables) -> None:
    """Raise ValueError for tables with gaps, and for a way back that does not rise."""
    bad = [key for key, values in numbers.items() if not np.isfinite(values).all()]
    if bad:
        raise ValueError(f"a law with gaps in its tables cannot be exported: {', '.join(bad)}")
    if "BACK" not in numbers:
        return
    rises = (np.diff(numbers["BACK"]) > 0).all() and numbers["BACK_SLOPE"][-1] > 0
    if not rises:
        raise ValueError("a law whose way back does not rise throughout cannot be exported")

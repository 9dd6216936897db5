"""The file of a law with places for what is a single joint's, which the page fills in."""

from __future__ import annotations

from pathlib import Path

from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.exports.file_forms import FILE_FORMS
from archord.postprocess.laws.exports.program import ELEMENT_NUMBERS, Program
from archord.postprocess.laws.general.joint_curve import JointCurve


def skeleton(law: JointCurve, suffix: str) -> str:
    """What `export_law` writes into a file with this ``suffix``, with ``@name@``, ``@title@``,
    ``@header@``, ``@about@`` and ``@TABLE@``, of each table, where it tells of the joint: for
    programs that fill them in for other joints of this kind and these units."""
    program = Program.of(law)
    form = FILE_FORMS[suffix]
    name = "name_of_the_law"
    text = export_law(law, Path(name + suffix))
    numbers = program.numbers | {"PIN_LENGTH": program.pin_length}
    for key, values in numbers.items():
        if not isinstance(values, int) and key not in ELEMENT_NUMBERS:
            text = text.replace(form.constant(name, key, values), f"@{key}@", 1)
    text = text.replace(program.header, "@header@")
    text = text.replace(form.text(program.about), "@about@")
    return text.replace(program.about["title"], "@title@").replace(name, "@name@")

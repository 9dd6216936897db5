"""``archord laws`` and ``law``: laws of the joint, listed, tabulated, drawn and exported."""

from __future__ import annotations

import dataclasses
import math
import shutil
import textwrap
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from archord.commands.law_files import exports_of, sentences, write
from archord.commands.law_joint import joint_of, of_scene
from archord.commands.options import argument, file, flag, overrides, warn
from archord.report.by_name import ByName, Names, Words
from archord.report.errors import InputError

if TYPE_CHECKING:
    from archord.postprocess.laws.exports.contact import Contact
    from archord.postprocess.laws.general.joint import LawJoint
    from archord.postprocess.laws.law import Law, LawState

_CONTACT = ("damping", "mu_static", "mu_dynamic", "stick_speed")  # options of a force element
_LINE = 400  # points of a line of the picture
# Options of `archord law` by those beside which they say nothing.
_IDLE = {
    "exports": ("by_load", "deepest", "plot", "to", "points", "extrapolate"),
    "plot": ("points",),
    "deepest": ("by_load",),
}


@click.command()
def laws() -> int:
    """List the closed-form laws: name, title, range and source."""
    from archord.postprocess.laws.laws import LAWS

    width = max(40, min(110, shutil.get_terminal_size((110, 24)).columns))
    for entry in LAWS.values():
        print(textwrap.fill(f"{entry.name}: {entry.title}", width, subsequent_indent="    "))
        for text in (f"range: {entry.range}", f"source: {entry.source}"):
            print(textwrap.fill(text, width, initial_indent="    ", subsequent_indent="        "))
    return 0


@click.command()
@argument(
    "names",
    "NAME...",
    "laws, as archord laws lists them [archord; without plane and nu paper or paper-plastic]",
    nargs=-1,
    type=str,
)
@file("--scene", "take the joint from this scene file", None)
@overrides()
@click.option(
    "--radius", type=float, help="radius of the pin; this and the next change the joint of a scene"
)
@click.option("--clearance", type=float, help="radius of the hole less radius of the pin")
@click.option("--E-star", "E_star", type=float, help="contact modulus E*; not beside a scene")
@click.option("--yield-stress", type=float, help="yield stress")
@click.option(
    "--length",
    type=float,
    help="length of the joint, for the laws that need one; a scene's thickness",
)
@click.option("--k", type=float, help="Winkler's coefficient [0.85]")
@click.option("--c", type=float, help="plateau of the pressure over the yield stress [1]")
@click.option("--plane", help="plane of the joint: strain or stress")
@click.option("--nu", type=float, help="Poisson's ratio of both bodies")
@flag("--by-load", "rows in equal loads, as for laws that give no displacement")
@click.option("--to", type=float, default=2.0, help="last row: delta in clearances, or P in E* dR")
@click.option("--points", type=int, default=20, help="rows, in equal steps from zero")
@flag("--extrapolate", "evaluate formulas outside the range of the law")
@click.option(
    "--deepest",
    type=float,
    default=0.0,
    help="archord: the way back from this displacement, in clearances",
)
@file("--plot", "draw the laws into this file instead of a table", None)
@click.option(
    "--export",
    "exports",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="archord: write the joint's law as .py, .h (C99), .mo (Modelica), .m (Matlab, Octave), "
    ".mjs (JavaScript), .fmu (FMI 2.0) or .json",
)
@click.option("--damping", type=float, help="force element: c of 1 + c d(delta)/dt [0]")
@click.option("--mu-static", type=float, help="force element: friction at the stick speed [0]")
@click.option("--mu-dynamic", type=float, help="force element: friction beyond [--mu-static]")
@click.option("--stick-speed", type=float, help="force element: slip speed that sticks [1]")
@flag("--force", "overwrite exports")
@sentences()
def law(
    names: Names,
    scene: Path | None,
    overrides: Names,
    by_load: bool,
    to: float,
    points: int,
    extrapolate: bool,
    deepest: float,
    plot: Path | None,
    exports: tuple[Path, ...],
    force: bool,
    **given: Any,
) -> int:
    """Print a table of laws of the joint, draw them against each other, or export archord's."""
    from archord.output.user_file import check_target
    from archord.postprocess.laws.law_report import draw_laws, law_table
    from archord.postprocess.laws.laws import default_law, find_law
    from archord.scene.file import files_read

    _refuse_contradictions()
    contact = {name: given.pop(name) for name in _CONTACT}
    chosen = [find_law(name) for name in dict.fromkeys(names)]
    if not 0 < to < math.inf:
        raise InputError(f"--to {to:g}: must be a positive number.")
    if not 1 <= points <= 100000:
        raise InputError(f"--points {points}: must be between 1 and 100000.")
    needed = {name: law.name for law in chosen for name in law.needs}
    if (exports or deepest) and not chosen:
        needed = dict.fromkeys(("plane", "nu"), "archord")
    joint, units, thickness = joint_of(scene, overrides, given, needed)
    inputs = files_read(scene, overrides) if scene else []
    chosen = chosen or [default_law(joint)]
    _refuse_unused(chosen, given, in_a_scene=scene is not None)
    if exports or deepest:
        _require_archord("--export" if exports else "--deepest", chosen)
        _require_within(chosen[0], joint, deepest)
    if exports:
        with of_scene(scene):
            return _export(joint, units, thickness, exports, _contact(contact), inputs, force)
    if plot:
        check_target(plot, inputs, force=True)
    by_load = by_load or not all(entry.gives_displacement for entry in chosen)
    rows = _LINE if plot else points
    with of_scene(scene):
        states, said = _sampled(chosen, joint, by_load, to, rows, extrapolate, deepest)
    if plot:
        print(draw_laws(states, joint, plot, by_load, to))
    else:
        tables = [law_table(entry, joint, state, units, thickness) for entry, state in states]
        print(*tables, sep="\n\n")
    warn(*said)
    return 0


def _sampled(
    chosen: list[Law], joint: LawJoint, by_load: bool, *options: Any
) -> tuple[list[tuple[Law, LawState]], list[str]]:
    """The states of each of the ``chosen`` laws that has numbers here, sampled with the ``options``
    of `sample`; and what there is to warn of. Raises `InputError` if no law has numbers."""
    from archord.postprocess.laws.law import LawRangeWarning
    from archord.postprocess.laws.law_report import sample, says_nothing, too_elastic

    states = []
    said = []
    silent = []
    for entry in chosen:
        with warnings.catch_warnings(
            record=True, action="always", category=LawRangeWarning
        ) as caught:
            state = sample(entry, joint, by_load, *options)
        told = [str(warning.message) for warning in caught]
        if says_nothing(state, by_load):
            reasons = [f"{entry.name}: has no number here", *told]
            silent.append(reasons[-1])
        else:
            states.append((entry, state))
            said += [*told, *too_elastic(entry, joint, state)]
    if not states:
        raise InputError(f"{'; '.join(silent)}.")
    return states, [*said, *silent]


def _contact(options: dict[str, float | None]) -> Contact:
    """The contact of the ``options`` that are given."""
    from archord.postprocess.laws.exports.contact import Contact

    given = {name: value for name, value in options.items() if value is not None}
    if "mu_static" in given:
        given.setdefault("mu_dynamic", given["mu_static"])
    return Contact(**given)


def _export(
    joint: LawJoint,
    units: Words,
    thickness: float,
    exports: tuple[Path, ...],
    contact: Contact,
    inputs: list[Path],
    force: bool,
) -> int:
    from archord.postprocess.laws.general.general_law import law_of_joint
    from archord.postprocess.laws.laws import LAWS

    said = LAWS["archord"].doubts(joint)
    law = law_of_joint(joint)
    about = law.about | {
        "units": {name: units[name] for name in ("length", "force", "stress") if name in units}
    }
    if units:
        law = dataclasses.replace(law, length_unit=units["length"], force_unit=units["force"])
    law = dataclasses.replace(law, force=law.force * thickness, pin_length=thickness, about=about)
    print(*write(exports_of(law, exports, contact), inputs, force), sep="\n")
    has_element = any(export.suffix != ".json" for export in exports)
    if joint.friction and has_element and not contact.mu_static:
        said.append(
            f"the friction of {joint.friction:g} is in the force P; the force element has no "
            "friction of its own without --mu-static"
        )
    warn(*said)
    return 0


def _require_archord(option: str, chosen: list[Law]) -> None:
    """Raise `InputError` for an ``option`` beside another law."""
    if [entry.name for entry in chosen] != ["archord"]:
        raise InputError(option, "is for the law archord alone, which needs plane and nu.")


def _require_within(law: Law, joint: LawJoint, deepest: float) -> None:
    """Raise `InputError` for a way back from ``deepest``, in clearances, beyond the range of
    ``law``."""
    if not 0 <= deepest <= law.limit(joint) / joint.clearance:
        raise InputError(
            f"--deepest {deepest:g}: must be from 0 to 3 clearances, the range of the law."
        )


def _refuse_contradictions() -> None:
    """Raise `InputError` for options beside one that leaves them without effect."""
    context = click.get_current_context()
    typed = {
        parameter.name: parameter.opts[0]
        for parameter in context.command.params
        if parameter.name
        and context.get_parameter_source(parameter.name) is ParameterSource.COMMANDLINE
    }
    for option, idle in _IDLE.items():
        clash = [typed[name] for name in idle if name in typed]
        if option in typed and clash:
            raise InputError(typed[option], f"does not go with {' or '.join(clash)}.")
    exports = context.params["exports"]
    if "force" in typed and not exports:
        raise InputError("--force: overwrites exports, and there is no --export.")
    if any(export.suffix != ".json" for export in exports):
        return
    missing = "a .json file has none" if exports else "there is no --export"
    for name in _CONTACT:
        if name in typed:
            raise InputError(typed[name], f"is of an export's element, and {missing}.")


def _refuse_unused(chosen: list[Law], given: ByName, *, in_a_scene: bool) -> None:
    """Raise `InputError` for a coefficient that no law among the ``chosen`` has, and for a length
    that none needs, unless it is the thickness ``in_a_scene``."""
    from archord.postprocess.laws.laws import LAWS

    length = given["length"]
    if length is not None and not in_a_scene and not any("length" in law.needs for law in chosen):
        laws = ", ".join(law.name for law in LAWS.values() if "length" in law.needs)
        raise InputError(
            f"--length {length:g}: is for {laws} alone, or beside --scene; forces of "
            f"{chosen[0].name} are per unit length."
        )
    for name in ("k", "c"):
        if given[name] is not None and not any(name in law.coefficients for law in chosen):
            laws = ", ".join(law.name for law in LAWS.values() if name in law.coefficients)
            raise InputError(
                f"--{name} {given[name]:g}: is for {laws} alone; {chosen[0].name} has no such "
                "coefficient."
            )

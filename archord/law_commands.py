"""``archord laws``, ``law`` and ``fit``: laws of the joint, listed, tabulated, drawn, and
calibrated on runs."""

from __future__ import annotations

import dataclasses
import math
import shutil
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from archord.options import argument, file, flag, overrides
from archord.report.errors import InputError

if TYPE_CHECKING:
    from archord.postprocess.laws.fitted_law import FittedLaw
    from archord.postprocess.laws.general.joint import LawJoint
    from archord.postprocess.laws.general.joint_curve import JointCurve
    from archord.postprocess.laws.law import Law
    from archord.scene.presets.joint import Scene

_Text = tuple[Path, Callable[[], str]]  # a file, and what makes its text
_LINE = 400  # points of a line of the picture
# Options of `archord law` by those beside which they say nothing.
_IDLE = {
    "exports": ("by_load", "deepest", "plot", "to", "points", "extrapolate"),
    "plot": ("points",),
    "deepest": ("by_load",),
}
# What options change in a scene.
_KEYS = {
    "radius": "joint.radius",
    "clearance": "joint.clearance",
    "length": "analysis.thickness",
    "plane": "analysis.plane",
}
_OF_BODIES = ("nu", "yield_stress")


@contextmanager
def _sentences() -> Iterator[None]:
    """Around formulas, whose ValueErrors are bad input here."""
    try:
        yield
    except ValueError as error:
        raise InputError(str(error)) from error


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
    help="archord: write the joint's law as .py, .h (C99), .mo (Modelica), .m (Matlab, Octave) or "
    ".json",
)
@flag("--force", "overwrite exports")
@_sentences()
def law(
    names: tuple[str, ...],
    scene: Path | None,
    overrides: tuple[str, ...],
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
    from archord.postprocess.laws.law import LawRangeWarning
    from archord.postprocess.laws.law_report import (
        draw_laws,
        law_table,
        sample,
        says_nothing,
        too_elastic,
    )
    from archord.postprocess.laws.laws import default_law, find_law
    from archord.scene.file import files_read

    _refuse_contradictions()
    chosen = [find_law(name) for name in dict.fromkeys(names)]
    if not 0 < to < math.inf:
        raise InputError(f"--to {to:g}: must be a positive number.")
    if not 1 <= points <= 100000:
        raise InputError(f"--points {points}: must be between 1 and 100000.")
    needed = {name: law.name for law in chosen for name in law.needs}
    if (exports or deepest) and not chosen:
        needed = dict.fromkeys(("plane", "nu"), "archord")
    joint, units, thickness = _joint(scene, overrides, given, needed)
    chosen = chosen or [default_law(joint)]
    _refuse_unused(chosen, given)
    if exports or deepest:
        option = "--export" if exports else "--deepest"
        if [entry.name for entry in chosen] != ["archord"]:
            raise InputError(f"{option}: is for the law archord alone, which needs plane and nu.")
        if not 0 <= deepest <= chosen[0].limit(joint) / joint.clearance:
            raise InputError(
                f"--deepest {deepest:g}: must be from 0 to 3 clearances, the range of the law."
            )
        if exports:
            return _export(
                joint,
                units,
                thickness,
                exports,
                files_read(scene, overrides) if scene else [],
                force,
            )
    by_load = by_load or not all(entry.gives_displacement for entry in chosen)
    if plot:
        check_target(plot, files_read(scene, overrides) if scene else [], force=True)
    states = []
    said = []
    silent = []
    for entry in chosen:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", LawRangeWarning)
            state = sample(
                entry, joint, by_load, to, _LINE if plot else points, extrapolate, deepest
            )
        told = [str(warning.message) for warning in caught]
        if says_nothing(state, by_load):
            silent.append([f"{entry.name}: has no number here", *told][-1])
        else:
            states.append((entry, state))
            said += [*told, *too_elastic(entry, joint, state)]
    if not states:
        raise InputError(f"{'; '.join(silent)}.")
    if plot:
        print(draw_laws(states, joint, plot, by_load, to))
    else:
        print(
            *(law_table(entry, joint, state, units, thickness) for entry, state in states),
            sep="\n\n",
        )
    _warn(*said, *silent)
    return 0


def _export(
    joint: LawJoint,
    units: dict[str, str],
    thickness: float,
    exports: tuple[Path, ...],
    inputs: list[Path],
    force: bool,
) -> int:
    from archord.postprocess.laws.general.general_law import general_law
    from archord.postprocess.laws.law import LawRangeWarning
    from archord.postprocess.laws.laws import LAWS

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LawRangeWarning)
        LAWS["archord"].check(joint)
    law = general_law(joint)
    about = law.about | {
        "units": {name: units[name] for name in ("length", "force", "stress") if name in units}
    }
    if units:
        law = dataclasses.replace(law, length_unit=units["length"], force_unit=units["force"])
    law = dataclasses.replace(law, force=law.force * thickness, pin_length=thickness, about=about)
    print(*_write(_exports(law, exports), inputs, force), sep="\n")
    _warn(*(str(warning.message) for warning in caught))
    return 0


def _warn(*messages: str) -> None:
    for message in dict.fromkeys(messages):
        print(f"archord: warning: {message}.", file=sys.stderr)


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


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
            raise InputError(f"{typed[option]}: does not go with {' or '.join(clash)}.")
    if "force" in typed and "exports" not in typed:
        raise InputError("--force: overwrites exports, and there is no --export.")


def _refuse_unused(chosen: list[Law], given: dict[str, Any]) -> None:
    """Raise `InputError` for a coefficient that no law among the ``chosen`` has."""
    from archord.postprocess.laws.laws import LAWS

    for name in ("k", "c"):
        if given[name] is not None and not any(name in law.coefficients for law in chosen):
            laws = ", ".join(law.name for law in LAWS.values() if name in law.coefficients)
            raise InputError(
                f"--{name} {given[name]:g}: is for {laws} alone; {chosen[0].name} has no such "
                "coefficient."
            )


def _joint(
    scene: Path | None, overrides: tuple[str, ...], given: dict[str, Any], needed: dict[str, str]
) -> tuple[LawJoint, dict[str, str], float]:
    """The joint of the scene, which the options given change as ``--set`` would, or of the options
    alone; the names of the units; and the thickness. ``needed`` has the law by each parameter that
    one needs."""
    from archord.postprocess.laws.general.joint import LawJoint

    values = {name: value for name, value in given.items() if value is not None}
    if scene is not None:
        return _joint_of_scene(scene, overrides, values, needed)
    if overrides:
        raise InputError("--set: changes a scene; give one with --scene.")
    missing = [name for name in ("radius", "clearance", "E_star", *needed) if name not in values]
    if missing:
        raise InputError(_ask_for(missing, needed))
    for name, other in (("plane", "nu"), ("nu", "plane")):
        if name in values and other not in values:
            raise InputError(
                f"{_option(name)}: says nothing without {_option(other)}; give both or none."
            )
    strength = values.pop("yield_stress", None)
    return LawJoint(**values, pin_yield=strength, block_yield=strength), {}, 1.0


def _ask_for(missing: list[str], needed: dict[str, str]) -> str:
    """The sentence that asks for all that is ``missing`` of a joint; ``needed`` has the law by
    parameter."""
    names = ", ".join(map(_option, missing))
    by_law: dict[str, list[str]] = {}
    for name in missing:
        if name in needed:
            by_law.setdefault(needed[name], []).append(name)
    if sum(map(len, by_law.values())) == len(missing):
        said = [f"{law}: this law needs {' and '.join(own)}." for law, own in by_law.items()]
        return f"{' '.join(said)} Give {names}, or the --scene of a joint."
    why = [f"{law} needs {' and '.join(map(_option, own))}" for law, own in by_law.items()]
    said = [f"{names}: missing", *why, "give all, or the --scene of a joint"]
    return f"{'; '.join(said)}."


def _joint_of_scene(
    path: Path, overrides: tuple[str, ...], values: dict[str, Any], needed: dict[str, str]
) -> tuple[LawJoint, dict[str, str], float]:
    """As `_joint`, of the scene ``path``."""
    from archord.postprocess.laws.general.joint import LawJoint

    if "E_star" in values:
        said = (
            "does not go with --scene, which has E* of E and nu of its bodies; change these by "
            "--set"
        )
        raise InputError(f"--E-star {values['E_star']:g}: {said}.")
    before = _law_scene(path, overrides)
    changes = {
        f"{key}={value}": name for name, value in values.items() for key in _keys(before, name)
    }
    typed = {change: f"{_option(name)} {values[name]}" for change, name in changes.items()}
    set_keys = {override.partition("=")[0].strip(): override for override in overrides}
    for change, option in typed.items():
        same = set_keys.get(change.partition("=")[0])
        if same:
            raise InputError(f"{option}: does not go with --set {same}; give one of them.")
    try:
        found = _law_scene(path, (*overrides, *changes))
    except InputError as error:
        said = str(error)
        for change, option in typed.items():
            said = said.replace(f"--set {change}:", f"{option}:")
        raise InputError(said) from None
    thick = found.analysis.thickness
    units = found.units.model_dump() | {"force": found.units.force_of(thick)}
    units["stiffness"] = units["stress"] if thick is None else f"{units['force']}/{units['length']}"
    coefficients = {name: values[name] for name in ("k", "c") if name in values}
    joint = dataclasses.replace(LawJoint.from_scene(found), **coefficients)
    if "length" in needed and joint.length is None:
        raise InputError(f"{needed['length']}: this law needs length. Give --length.")
    return joint, units, found.thickness


def _law_scene(path: Path, overrides: tuple[str, ...]) -> Scene:
    from archord.scene.file import load_scene
    from archord.scene.presets.joint import Scene

    found = load_scene(path, overrides)
    if not isinstance(found, Scene):
        raise InputError(f"{path}: must be the scene of a [joint]; this is a general one.")
    return found


def _keys(scene: Scene, name: str) -> list[str]:
    """The keys of a scene that the option ``name`` changes: a yield stress in the bodies that
    yield, or in both."""
    if name not in _OF_BODIES:
        return [_KEYS[name]] if name in _KEYS else []
    bodies = list(scene.solids)
    if name == "yield_stress":
        bodies = [body for body in bodies if scene.solids[body].yield_stress is not None] or bodies
    return [f"{body}.{name}" for body in bodies]


@click.command()
@argument(
    "folders", "RUN...|SWEEP", "run folders, or the folder of a sweep", nargs=-1, required=True
)
@click.option(
    "--range",
    "load_range",
    type=(float, float),
    help="steps to fit: delta from ... to ..., in clearances [all]",
)
@file("--json", "write law and fits", parameter="json_file")
@file("--picture", "draw data, law and residuals")
@click.option(
    "--export",
    "--python",
    "exports",
    type=Path,
    multiple=True,
    help="write the fitted law: .py .h .mo .m .json",
)
@click.option(
    "--table",
    "tables",
    type=Path,
    multiple=True,
    help="write P(delta) of one run, and back: .json .py .h .mo .m",
)
@click.option(
    "--of", help="--table: the load of a general scene that P and delta are of, if it has several"
)
@flag("--force", "overwrite files other than pictures and SWEEP/fit.csv")
@_sentences()
def fit(
    folders: tuple[Path, ...],
    load_range: tuple[float, float] | None,
    json_file: Path | None,
    picture: Path | None,
    exports: tuple[Path, ...],
    tables: tuple[Path, ...],
    of: str | None,
    force: bool,
) -> int:
    """Fit the plastic-Winkler law to P(delta) of runs: k, and c where the joint yields.

    Of a sweep, k and c of every case, printed and in SWEEP/fit.csv. With --table no fit, but
    P(delta) of the run itself and its way back, of any scene.
    """
    from archord.output.folder import FILES, is_sweep
    from archord.output.user_file import check_target
    from archord.postprocess.laws import fit_report
    from archord.postprocess.laws.calibration import calibrate
    from archord.postprocess.run import Run

    if tables or of:
        if not tables or len(folders) > 1 or any((load_range, json_file, picture, exports)):
            raise InputError(
                "--table: takes one run, and but for --of and --force no other option."
            )
        return _write_table(folders[0], tables, of, force)
    deltas = load_range or (0.0, math.inf)
    first = folders[0]
    if any(map(is_sweep, folders)):
        if len(folders) > 1 or json_file or exports or picture:
            raise InputError(
                f"{first}: a sweep is fitted alone; --json, --export and --picture are for runs."
            )
        return _fit_sweep(first, deltas)
    calibration = calibrate([Run(folder).curve.loading() for folder in folders], deltas)
    inputs = [folder / name for folder in folders for name in FILES]
    files = []
    if picture:
        check_target(picture, inputs, force=True)
        files.append(fit_report.draw_fit(calibration, picture))
    texts = [(json_file, lambda: fit_report.as_json(calibration))] if json_file else []
    files += _write(texts + _exports(calibration.law(), exports), inputs, force)
    print(
        fit_report.summary_table(calibration), "", *fit_report.notes(calibration), *files, sep="\n"
    )
    _warn(*fit_report.doubts(calibration))
    return 0


def _write_table(folder: Path, targets: tuple[Path, ...], of: str | None, force: bool) -> int:
    from archord.output.folder import FILES
    from archord.postprocess.laws.run_table import run_table
    from archord.postprocess.run import Run

    curve = run_table(Run(folder), of)
    files = _write(_exports(curve, targets), [folder / name for name in FILES], force)
    print(*(f"{name}: {value}" for name, value in curve.about.items()), *files, sep="\n")
    return 0


def _fit_sweep(sweep: Path, deltas: tuple[float, float]) -> int:
    from archord.studies.sweep_fit import fit_sweep

    found = fit_sweep(sweep, deltas)
    table = sweep / "fit.csv"
    print(found, *_write([(table, found.as_csv)], [sweep / "sweep.toml"], force=True), sep="\n")
    return 0


def _exports(law: JointCurve | FittedLaw, targets: Iterable[Path]) -> list[_Text]:
    """The files ``targets`` with a law, for `_write`."""
    from archord.postprocess.laws.exports.export import export_law

    return [(target, partial(export_law, law, target)) for target in targets]


def _write(texts: list[_Text], inputs: list[Path], force: bool) -> list[Path]:
    """Write the files that are named, and return them. Raises `InputError` before for one of the
    ``inputs`` among them, for two of one name, and, without ``force``, for files that are there."""
    from archord.output.user_file import check_target, writing

    targets = [target for target, _ in texts]
    for target in targets:
        check_target(target, inputs, force=force)
    if len({target.resolve() for target in targets}) < len(targets):
        raise InputError(f"{targets[0]}: is named for two files; choose different ones.")
    for target, text in [(target, text()) for target, text in texts]:
        with writing(target) as new:
            new.write_text(text, encoding="utf-8", newline="")
    return targets

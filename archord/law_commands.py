"""``archord laws``, ``law`` and ``fit``: laws of the joint, listed, tabulated, drawn, and calibrated on runs."""

from __future__ import annotations

import dataclasses
import math
import shutil
import sys
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from archord.options import argument, file, flag, overrides
from archord.scene.errors import InputError

if TYPE_CHECKING:
    from archord.postprocess.laws.general.joint import LawJoint

_LINE = 400  # points of a line of the picture


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
@click.option("--radius", type=float, help="radius of the pin")
@click.option("--clearance", type=float, help="radius of the hole less that of the pin")
@click.option("--E-star", "E_star", type=float, help="contact modulus E*")
@click.option("--yield-stress", type=float, help="yield stress")
@click.option("--length", type=float, help="length of the joint, for the laws that need one")
@click.option("--k", type=float, help="Winkler's coefficient [0.85]")
@click.option("--c", type=float, help="plateau of the pressure over the yield stress [1]")
@click.option("--plane", help="plane of the joint: strain or stress")
@click.option("--nu", type=float, help="Poisson's ratio of both bodies")
@flag("--by-load", "rows in equal loads, as for laws that give no displacement")
@click.option("--to", type=float, default=2.0, help="last row: delta in clearances, or P in E* dR")
@click.option("--points", type=int, default=20, help="rows, in equal steps from zero")
@flag("--extrapolate", "evaluate formulas outside the range of the law")
@click.option("--deepest", type=float, default=0.0, help="archord: the way back from this displacement, in clearances")
@file("--plot", "draw the laws into this file instead of a table", None)
@click.option(
    "--export",
    "exports",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="archord: write the joint's law as .py, .h (C99), .mo (Modelica), .m (Matlab, Octave) or .json",
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
    from archord.postprocess.laws.law_report import draw_laws, law_table, sample, says_nothing, too_elastic
    from archord.postprocess.laws.laws import default_law, find_law
    from archord.scene.file import files_read

    chosen = [find_law(name) for name in dict.fromkeys(names)]
    if not 0 < to < math.inf:
        raise InputError(f"--to {to:g}: must be a positive number.")
    if not 1 <= points <= 100000:
        raise InputError(f"--points {points}: must be between 1 and 100000.")
    joint, units, thickness = _joint(scene, overrides, given)
    chosen = chosen or [default_law(joint)]
    if exports or deepest:
        option = "--export" if exports else "--deepest"
        if [entry.name for entry in chosen] != ["archord"]:
            raise InputError(f"{option}: is for the law archord alone, which needs plane and nu.")
        if by_load or (exports and (deepest or plot)):
            raise InputError(f"{option}: does not go with {'--by-load' if by_load else '--deepest or --plot'}.")
        if not 0 <= deepest <= chosen[0].limit(joint) / joint.clearance:
            raise InputError(f"--deepest {deepest:g}: must be from 0 to 3 clearances, the range of the law.")
        if exports:
            return _export(joint, units, thickness, exports, files_read(scene, overrides) if scene else [], force)
    by_load = by_load or not all(entry.gives_displacement for entry in chosen)
    if plot:
        check_target(plot, files_read(scene, overrides) if scene else [], force=True)
    states, said, silent = [], [], []
    for entry in chosen:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", LawRangeWarning)
            state = sample(entry, joint, by_load, to, _LINE if plot else points, extrapolate, deepest)
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
        print(*(law_table(entry, joint, state, units, thickness) for entry, state in states), sep="\n\n")
    _warn(*said, *silent)
    return 0


def _export(
    joint: LawJoint, units: dict[str, str], thickness: float, exports: tuple[Path, ...], inputs: list[Path], force: bool
) -> int:
    from archord.postprocess.laws.exports.export import export_curve
    from archord.postprocess.laws.general.general_law import general_law
    from archord.postprocess.laws.law import LawRangeWarning
    from archord.postprocess.laws.laws import LAWS

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LawRangeWarning)
        LAWS["archord"].check(joint)
    law = general_law(joint)
    about = law.about | {"units": {name: units[name] for name in ("length", "force", "stress") if name in units}}
    law = dataclasses.replace(law, force=law.force * thickness, about=about)
    print(*_write([(file, export_curve(law, file)) for file in exports], inputs, force), sep="\n")
    _warn(*(str(warning.message) for warning in caught))
    return 0


def _warn(*messages: str) -> None:
    for message in dict.fromkeys(messages):
        print(f"archord: warning: {message}.", file=sys.stderr)


def _joint(
    scene: Path | None, overrides: tuple[str, ...], given: dict[str, Any]
) -> tuple[LawJoint, dict[str, str], float]:
    """The joint of the scene, or of the options, which come before it; the names of the units; and the thickness."""
    from archord.postprocess.laws.general.joint import LawJoint

    values = {name: value for name, value in given.items() if value is not None}
    if "nu" in values:
        values["pin_nu"] = None  # one for both
    strength = values.pop("yield_stress", None)
    if scene is not None:
        from archord.scene.file import load_scene
        from archord.scene.scene import Scene

        loaded = load_scene(scene, overrides)
        if not isinstance(loaded, Scene):
            raise InputError(f"{scene}: must be the scene of a [joint]; this is a general one.")
        units, thick = loaded.units.model_dump(), loaded.analysis.thickness
        units["force"] = loaded.units.force_of(thick)
        units["stiffness"] = units["stress"] if thick is None else f"{units['force']}/{units['length']}"
        joint = dataclasses.replace(LawJoint.from_scene(loaded), **values)
        return _yielding(joint, strength), units, loaded.thickness
    if overrides:
        raise InputError("--set: changes a scene; give one with --scene.")
    missing = [f"--{name.replace('_', '-')}" for name in ("radius", "clearance", "E_star") if name not in values]
    if missing:
        raise InputError(f"{', '.join(missing)}: missing; give radius, clearance and E* of the joint, or a --scene.")
    return _yielding(LawJoint(**values), strength), {}, 1.0


def _yielding(joint: LawJoint, strength: float | None) -> LawJoint:
    """``joint`` with the yield ``strength``, if one is given, in those of its bodies that yield, or in both."""
    if strength is None:
        return joint
    pin = strength if joint.yielding != "block" and joint.pin_share else None
    return dataclasses.replace(joint, pin_yield=pin, block_yield=None if joint.yielding == "pin" else strength)


@click.command()
@argument("folders", "RUN...|SWEEP", "run folders, or the folder of a sweep", nargs=-1, required=True)
@click.option(
    "--range", "load_range", type=(float, float), help="steps to fit: delta from ... to ..., in clearances [all]"
)
@file("--json", "write law and fits", parameter="json_file")
@file("--picture", "draw data, law and residuals")
@file("--python", "write force and stiffness over delta as a module that needs only math")
@click.option(
    "--table", "tables", type=Path, multiple=True, help="write P(delta) of one run, and back: .json .py .h .mo .m"
)
@click.option("--of", help="--table: the load of a general scene that P and delta are of, if it has several")
@flag("--force", "overwrite files other than pictures and SWEEP/fit.csv")
@_sentences()
def fit(
    folders: tuple[Path, ...],
    load_range: tuple[float, float] | None,
    json_file: Path | None,
    picture: Path | None,
    python: Path | None,
    tables: tuple[Path, ...],
    of: str | None,
    force: bool,
) -> int:
    """Fit the plastic-Winkler law to P(delta) of runs: k, and c where the joint yields.

    Of a sweep, k and c of every case, printed and in SWEEP/fit.csv. With --table no fit, but P(delta) of the run itself
    and its way back, of any scene.
    """
    from archord.output.folder import FILES, is_sweep
    from archord.output.user_file import check_target
    from archord.postprocess.laws import fit_report
    from archord.postprocess.laws.calibration import calibrate
    from archord.postprocess.run import Run

    if tables or of:
        if not tables or len(folders) > 1 or any((load_range, json_file, picture, python)):
            raise InputError("--table: takes one run, and but for --of and --force no other option.")
        return _write_table(folders[0], tables, of, force)
    deltas, first = load_range or (0.0, math.inf), folders[0]
    if any(map(is_sweep, folders)):
        if len(folders) > 1 or json_file or python or picture:
            raise InputError(f"{first}: a sweep is fitted alone; --json, --python and --picture are for runs.")
        return _fit_sweep(first, deltas)
    calibration = calibrate([Run(folder).curve.loading() for folder in folders], deltas)
    inputs, files = [folder / name for folder in folders for name in FILES], []
    if picture:
        check_target(picture, inputs, force=True)
        files.append(fit_report.draw_fit(calibration, picture))
    files += _write(
        [(json_file, fit_report.as_json(calibration)), (python, calibration.law().to_python())], inputs, force
    )
    print(fit_report.summary_table(calibration), "", *fit_report.notes(calibration), *files, sep="\n")
    _warn(*fit_report.doubts(calibration))
    return 0


def _write_table(folder: Path, targets: tuple[Path, ...], of: str | None, force: bool) -> int:
    from archord.output.folder import FILES
    from archord.postprocess.laws.exports.export import export_curve
    from archord.postprocess.laws.run_table import run_table
    from archord.postprocess.run import Run

    curve = run_table(Run(folder), of)
    texts: list[tuple[Path | None, str]] = [(target, export_curve(curve, target)) for target in targets]
    files = _write(texts, [folder / name for name in FILES], force)
    print(*(f"{name}: {value}" for name, value in curve.about.items()), *files, sep="\n")
    return 0


def _fit_sweep(sweep: Path, deltas: tuple[float, float]) -> int:
    from archord.studies.sweep_fit import fit_sweep

    found = fit_sweep(sweep, deltas)
    print(found, *_write([(sweep / "fit.csv", found.as_csv())], [sweep / "sweep.toml"], force=True), sep="\n")
    return 0


def _write(texts: list[tuple[Path | None, str]], inputs: list[Path], force: bool) -> list[Path]:
    """Write the files that are named, and return them. Raises `InputError` before for one of the ``inputs`` among them,
    for two of one name, and, without ``force``, for files that are there."""
    from archord.output.user_file import check_target, writing

    named = [(target, text) for target, text in texts if target]
    for target, _ in named:
        check_target(target, inputs, force=force)
    if len({target.resolve() for target, _ in named}) < len(named):
        raise InputError(f"{named[0][0]}: is named for two files; choose different ones.")
    for target, text in named:
        with writing(target):
            target.write_text(text, encoding="utf-8", newline="")
    return [target for target, _ in named]

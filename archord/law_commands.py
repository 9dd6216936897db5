"""``archord laws``, ``law`` and ``fit``: laws of the joint, listed, tabulated, drawn, and calibrated on runs."""

from __future__ import annotations

import dataclasses
import math
import sys
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from archord.options import argument, file, flag, overrides
from archord.report.table import Table
from archord.scene.errors import InputError

if TYPE_CHECKING:
    from archord.postprocess.laws.joint import LawJoint
    from archord.postprocess.laws.law import Law, Outside

DEFAULT = "calibrated"  # the law that is meant where none is named


@contextmanager
def _sentences() -> Iterator[None]:
    """Around formulas, whose ValueErrors are bad input here."""
    try:
        yield
    except ValueError as error:
        raise InputError(str(error)) from error


@click.command()
@flag("--markdown", "print all that is known of each, as Markdown")
def laws(markdown: bool) -> int:
    """List the closed-form laws: name, title, range and source."""
    from archord.postprocess.laws.law_report import laws_as_markdown
    from archord.postprocess.laws.laws import LAWS

    if markdown:
        print(laws_as_markdown(), end="")
        return 0
    for entry in LAWS.values():
        print(f"{entry.name}: {entry.title}")
        for text in (f"range: {entry.range}", f"source: {entry.source}"):
            print(textwrap.fill(text, 110, initial_indent="    ", subsequent_indent="        "))
    return 0


@click.command()
@argument("names", "NAME...", f"laws, as archord laws lists them [{DEFAULT}]", nargs=-1, type=str)
@file("--scene", "take the joint from this scene file", None)
@overrides()
@click.option("--radius", type=float, help="radius of the pin")
@click.option("--clearance", type=float, help="radius of the hole less that of the pin")
@click.option("--E-star", "E_star", type=float, help="contact modulus E*")
@click.option("--yield-stress", type=float, help="yield stress")
@click.option("--length", type=float, help="length of the joint, for the laws that need one")
@click.option("--k", type=float, default=0.85, help="Winkler's coefficient")
@click.option("--c", type=float, help="plateau of the pressure over the yield stress [1]")
@click.option("--plane", help="strain or stress, for the calibrated law")
@click.option("--nu", type=float, help="Poisson's ratio of both bodies, for the calibrated law")
@click.option("--pin-nu", type=float, help="Poisson's ratio of the pin, if another than --nu")
@click.option("--yielding", help="which bodies yield, for the calibrated law: both, block or pin [both]")
@click.option(
    "--dundurs-alpha", type=float, help="(E1' - E2')/(E1' + E2'), positive for the stiffer pin [0, or the scene's]"
)
@flag("--by-load", "rows in equal loads, as for laws that give no displacement")
@click.option("--to", type=float, default=2.0, help="last row: delta in clearances, or P in E* dR")
@click.option("--points", type=int, default=20, help="rows, in equal steps from zero")
@flag("--extrapolate", "evaluate formulas outside the range of the law")
@flag("--strict", "outside the range of a law is an error")
@file("--plot", "draw the laws into this file instead of a table", None)
@_sentences()
def law(
    names: tuple[str, ...],
    scene: Path | None,
    overrides: tuple[str, ...],
    k: float,
    by_load: bool,
    to: float,
    points: int,
    extrapolate: bool,
    strict: bool,
    plot: Path | None,
    **given: Any,
) -> int:
    """Print a table of closed-form laws, or draw them against each other."""
    from archord.postprocess.laws.laws import find_law

    chosen = [find_law(name) for name in dict.fromkeys(names or [DEFAULT])]
    if not (math.isfinite(to) and to > 0):
        raise InputError(f"--to {to:g}: must be a positive number.")
    if not 1 <= points <= 100000:
        raise InputError(f"--points {points}: must be between 1 and 100000.")
    if strict and extrapolate:
        raise InputError("--strict: must not be given together with --extrapolate.")
    joint, units = _joint(scene, overrides, given, k)
    rows = "load" if by_load or not all(entry.gives_displacement for entry in chosen) else "displacement"
    outside: Outside = "raise" if strict else "extrapolate" if extrapolate else "nan"
    if plot is not None:
        from archord.output.user_file import check_target
        from archord.postprocess.laws.law_report import draw_laws

        check_target(plot, [scene] if scene else [], force=True)
        print(_warned(draw_laws, chosen, joint, plot, rows, to, outside))
        return 0
    _warned(_print_table, chosen, joint, rows, to, points, outside, units)
    return 0


def _joint(
    scene: Path | None, overrides: tuple[str, ...], given: dict[str, Any], k: float
) -> tuple[LawJoint, dict[str, str]]:
    """The joint of the scene, or of the options, which come before it; and the names of the units."""
    from archord.postprocess.laws.joint import LawJoint

    values: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    if "nu" in values:
        values.setdefault("pin_nu", None)  # one for both
    if scene is not None:
        from archord.scene.file import load_scene

        loaded = load_scene(scene, overrides)
        units = {"length": loaded.units.length, "stress": loaded.units.stress, "force": loaded.units.force}
        return dataclasses.replace(LawJoint.from_scene(loaded, k=k), **values), units
    if overrides:
        raise InputError("--set: changes a scene; give one with --scene.")
    missing = [f"--{name.replace('_', '-')}" for name in ("radius", "clearance", "E_star") if name not in values]
    if missing:
        raise InputError(f"{', '.join(missing)}: missing; give radius, clearance and E* of the joint, or a --scene.")
    return LawJoint(**values, k=k), {}


def _warned(function: Any, *arguments: Any) -> Any:
    """Call ``function`` and print each warning about a range once, as one sentence on stderr."""
    from archord.postprocess.laws.joint import LawRangeWarning

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", LawRangeWarning)
        result = function(*arguments)
    for message in dict.fromkeys(str(w.message) for w in caught):
        print(f"archord: warning: {message}.", file=sys.stderr)
    return result


def _print_table(
    chosen: list[Law], joint: LawJoint, rows: str, to: float, points: int, outside: Outside, units: dict[str, str]
) -> None:
    from archord.postprocess.laws.law_report import law_columns

    for i, entry in enumerate(chosen):
        columns = law_columns(entry, joint, rows, to, points, outside, units)
        values = zip(*columns.values(), strict=True)
        print(f"{'' if i == 0 else chr(10)}{entry.name}: {entry.title}")
        print(Table(*columns, rows=[[f"{value:.6g}" for value in row] for row in values]))


@click.command()
@argument("folders", "RUN...|SWEEP", "run folders, or the folder of a sweep, or its fit.csv", nargs=-1, required=True)
@click.option(
    "--range", "load_range", type=(float, float), help="steps to fit: delta from ... to ..., in clearances [all]"
)
@click.option("--confidence", type=float, default=0.95, help="level of the confidence intervals")
@click.option("--hold-k", type=float, metavar="VALUE", help="hold k, e.g. at that of an elastic run, fit c")
@flag("--residuals", "print the residual of every step")
@file("--json", "write law, fits, residuals", parameter="json_file")
@file("--picture", "draw data, fits, residuals")
@file("--python", "write force and stiffness over delta as a module that needs only math")
@file("--csv", "sweep: write k, c, curves here [SWEEP/fit.csv]", parameter="csv_file")
@file("--law", "sweep: write the model of k and c as JSON", parameter="law_file")
@flag("--force", "overwrite files that are there and are no picture or earlier output")
def fit(
    folders: tuple[Path, ...],
    load_range: tuple[float, float] | None,
    confidence: float,
    hold_k: float | None,
    residuals: bool,
    json_file: Path | None,
    picture: Path | None,
    python: Path | None,
    csv_file: Path | None,
    law_file: Path | None,
    force: bool,
) -> int:
    """Fit the plastic-Winkler law to runs: k from P(delta) and from p0(delta), c where the joint yields.

    Of a sweep, k and c of every case, and a model of both over all that decides a joint.
    """
    from archord.studies import sweep_fit

    deltas = load_range or (0.0, math.inf)
    if any(sweep_fit.is_sweep(folder) for folder in folders):
        if len(folders) > 1:
            raise InputError(f"{folders[0]}: a sweep is fitted alone, but {len(folders)} folders are given.")
        if hold_k is not None or residuals or python:
            raise InputError(f"{folders[0]}: --hold-k, --residuals and --python are for runs, this is a sweep.")
        files = _files(csv=csv_file, law=law_file, json=json_file, picture=picture)
        if csv_file is None and folders[0].is_dir():
            csv_file = folders[0] / sweep_fit.TABLE
            files.append(csv_file)
        targets = csv_file, law_file, json_file, picture
        sweep_fit.check_files(folders[0], *targets, force)
        found = sweep_fit.fit_sweep(folders[0], deltas, confidence)
        with _sentences():
            found.write(*targets)
        print(found.text(), *files, sep="\n")
        return 0
    if csv_file or law_file:
        raise InputError(f"{folders[0]}: --csv and --law are for a sweep, and this is none.")
    from archord.output.folder import FILES
    from archord.output.user_file import check_target, writing
    from archord.postprocess.laws import fit_report
    from archord.postprocess.laws.calibration import calibrate
    from archord.postprocess.laws.fitted_law import PYTHON_BEGINS
    from archord.postprocess.run import Run

    runs = [Run(folder).curve.loading() for folder in folders]
    calibration = calibrate(runs, deltas, confidence, hold_k)
    law = calibration.law()
    # checked and written before anything is printed: a file that cannot be written is one sentence alone
    files = _files(json=json_file, python=python, picture=picture)
    inputs = [folder / name for folder in folders for name in FILES]
    begins = {json_file: fit_report.JSON_BEGINS, python: PYTHON_BEGINS}
    for target in files:
        check_target(target, inputs, force=force or target == picture, begins=begins.get(target))
    if picture:
        with _sentences():
            fit_report.draw_fit(calibration, picture)
    if json_file:
        with writing(json_file):
            json_file.write_text(fit_report.as_json(calibration), encoding="utf-8")
    if python:
        with writing(python):
            python.write_text(law.to_python(), encoding="utf-8")
    tables = [fit_report.summary_table(calibration)]
    tables += [fit_report.residual_table(curve) for curve in calibration.joint.curves if residuals]
    for one in tables:
        print(one, end="\n\n")
    threshold = "" if law.c is None else f", c = {law.c:.5f}"
    low, high = law.fitted_range
    held = "" if hold_k is None else " (held)"
    said = f"law: k = {law.k:.5f}{held}{threshold}, from P(delta), delta = {low:g} to {high:g} dR"
    print(*fit_report.notes(calibration), said, *files, sep="\n")
    return 0


def _files(**given: Path | None) -> list[Path]:
    """The files that were asked for by the options of these names. Raises `InputError` if two are the same."""
    files = [file for file in given.values() if file]
    if len({file.resolve() for file in files}) < len(files):
        raise InputError(f"{', '.join(f'--{name}' for name in given)}: must be different files.")
    return files

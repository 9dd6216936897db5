"""``archord fit``: laws calibrated on runs, and tables of their own P(delta)."""

from __future__ import annotations

import math
from pathlib import Path

import click

from archord.commands.law_files import exports_of, sentences, write
from archord.commands.options import argument, file, flag, warn
from archord.report.errors import InputError


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
    help="write the fitted law: .py .h .mo .m .mjs .fmu .json",
)
@click.option(
    "--table",
    "tables",
    type=Path,
    multiple=True,
    help="write P(delta) of one run, and back: .json .py .h .mo .m .mjs .fmu",
)
@click.option(
    "--of", help="--table: the load of a general scene that P and delta are of, if it has several"
)
@flag("--force", "overwrite files other than pictures and SWEEP/fit.csv")
@sentences()
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
                first, "a sweep is fitted alone; --json, --export and --picture are for runs."
            )
        return _fit_sweep(first, deltas)
    calibration = calibrate([Run(folder).curve.loading() for folder in folders], deltas)
    inputs = [folder / name for folder in folders for name in FILES]
    files = []
    if picture:
        check_target(picture, inputs, force=True)
        files.append(fit_report.draw_fit(calibration, picture))
    texts = [(json_file, lambda: fit_report.as_json(calibration))] if json_file else []
    files += write(texts + exports_of(calibration.law(), exports), inputs, force)
    print(
        fit_report.summary_table(calibration), "", *fit_report.notes(calibration), *files, sep="\n"
    )
    warn(*fit_report.doubts(calibration))
    return 0


def _write_table(folder: Path, targets: tuple[Path, ...], of: str | None, force: bool) -> int:
    from archord.output.folder import FILES
    from archord.postprocess.laws.run_table import run_table
    from archord.postprocess.run import Run

    curve = run_table(Run(folder), of)
    files = write(exports_of(curve, targets), [folder / name for name in FILES], force)
    print(*(f"{name}: {value}" for name, value in curve.about.items()), *files, sep="\n")
    return 0


def _fit_sweep(sweep: Path, deltas: tuple[float, float]) -> int:
    from archord.studies.sweep_fit import fit_sweep

    found = fit_sweep(sweep, deltas)
    table = sweep / "fit.csv"
    print(found, *write([(table, found.as_csv)], [sweep / "sweep.toml"], force=True), sep="\n")
    return 0

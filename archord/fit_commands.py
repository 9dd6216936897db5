"""``archord fit``: the law of a joint, calibrated on runs, or on all cases of a sweep."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from archord.law_commands import sentences
from archord.plain_typer import typer


def fit(
    folders: Annotated[
        list[Path], typer.Argument(metavar="RUN...|SWEEP", help="run folders, or the folder of a sweep, or its fit.csv")
    ],
    load_range: Annotated[
        tuple[float, float] | None,
        typer.Option("--range", help="steps to fit: delta from ... to ..., in clearances [all]"),
    ] = None,
    confidence: Annotated[float, typer.Option("--confidence", help="level of the confidence intervals")] = 0.95,
    hold_k: Annotated[
        float | None, typer.Option("--hold-k", metavar="VALUE", help="hold k, e.g. at that of an elastic run, fit c")
    ] = None,
    residuals: Annotated[bool, typer.Option("--residuals", help="print the residual of every step")] = False,
    json_file: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="write law, fits, residuals")] = None,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE", help="draw data, fits, residuals")
    ] = None,
    python: Annotated[
        Path | None,
        typer.Option(
            "--python", metavar="FILE", help="write force and stiffness over delta as a module that needs only math"
        ),
    ] = None,
    csv_file: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="sweep: write k, c, curves here [SWEEP/fit.csv]")
    ] = None,
    law_file: Annotated[
        Path | None, typer.Option("--law", metavar="FILE", help="sweep: write the model of k and c as JSON")
    ] = None,
    held_out: Annotated[
        float | None, typer.Option("--held-out", metavar="SHARE", help="sweep: cases kept to judge the model by [0.15]")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", help="overwrite files that are there and are no picture or earlier output")
    ] = False,
) -> int:
    """Fit the plastic-Winkler law to runs: k from P(delta) and from p0(delta), c where the joint yields.

    Of a sweep, k and c of every case, and a model of both over all that decides a joint.
    """
    import math

    from archord.output.folder import FILES
    from archord.output.user_file import check_target, writing
    from archord.postprocess.curve import read_run
    from archord.postprocess.laws import fit_report
    from archord.postprocess.laws.calibration import PYTHON_BEGINS, calibrate
    from archord.scene.errors import InputError
    from archord.studies import sweep_fit

    if any(sweep_fit.is_sweep(folder) for folder in folders):
        if len(folders) > 1:
            raise InputError(f"{folders[0]}: a sweep is fitted alone, but {len(folders)} folders are given.")
        if hold_k is not None or residuals or python:
            raise InputError(f"{folders[0]}: --hold-k, --residuals and --python are for runs, this is a sweep.")
        files = [file for file in (csv_file, law_file, json_file, picture) if file]
        if len({file.resolve() for file in files}) < len(files):
            raise InputError("--csv, --law, --json, --picture: must be different files.")
        if csv_file is None and folders[0].is_dir():
            csv_file = folders[0] / sweep_fit.TABLE
            files.append(csv_file)
        targets = csv_file, law_file, json_file, picture
        sweep_fit.check_files(folders[0], *targets, force)
        share = 0.15 if held_out is None else held_out
        found = sweep_fit.fit_sweep(folders[0], load_range or (0.0, math.inf), confidence, share)
        with sentences():
            found.write(*targets)
        print(found.text(), *files, sep="\n")
        return 0
    if csv_file or law_file or held_out is not None:
        raise InputError(f"{folders[0]}: --csv, --law and --held-out are for a sweep, and this is none.")
    runs = [read_run(folder).loading() for folder in folders]
    calibration = calibrate(runs, load_range or (0.0, math.inf), confidence, hold_k)
    law = calibration.law()
    # checked and written before anything is printed: a file that cannot be written is one sentence alone
    files = [file for file in (json_file, python, picture) if file]
    for file in files:
        begins = {json_file: fit_report.JSON_BEGINS, python: PYTHON_BEGINS}.get(file)
        inputs = [folder / name for folder in folders for name in FILES]
        check_target(file, inputs, force=force or file == picture, begins=begins)
    if len({file.resolve() for file in files}) < len(files):
        raise InputError("--json, --python, --picture: must be different files.")
    if picture:
        with sentences():
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
    for note in fit_report.notes(calibration):
        print(note)
    threshold = "" if law.c is None else f", c = {law.c:.5f}"
    low, high = law.fitted_range
    held = "" if hold_k is None else " (held)"
    print(f"law: k = {law.k:.5f}{held}{threshold}, from P(delta), delta = {low:g} to {high:g} dR")
    for file in files:
        print(file)
    return 0

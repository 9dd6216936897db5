"""``archord show``, ``compare`` and ``export``: what runs and sweeps hold, in tables, pictures and other formats."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from archord.plain_typer import typer

_MOST_FITS = 200  # runs of a sweep; an elastic fit takes some milliseconds

if TYPE_CHECKING:
    from archord.postprocess.run import Run
    from archord.postprocess.sweep import Sweep


def register(app: typer.Typer) -> None:
    """Add the commands of this file to ``app``."""
    app.command()(show)
    app.command()(compare)
    app.command()(export)


def show(
    folder: Annotated[Path, typer.Argument(metavar="RUN|SWEEP", help="folder of a run or of a sweep")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="folder for the pictures [the run's]")
    ] = None,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="draw pictures, too")] = True,
) -> int:
    """Print a run's joint, state, history, peaks, cost and warnings, or a sweep's cases; and draw them.

    The pictures of a run are force.png, pressure.png, field.png and iterations.png.
    """
    from archord.output.folder import is_sweep
    from archord.postprocess.sweep import Sweep

    if is_sweep(folder):
        return _show_sweep(Sweep(folder), output or folder, pictures)
    from archord.postprocess.run import Run

    return _show_run(Run(folder), output or folder, pictures)


def _show_run(run: Run, target: Path, pictures: bool) -> int:
    from archord.postprocess.tables import run_text

    lines = ["no picture: no step was accepted."]
    if pictures and run.steps:
        from archord.postprocess.pictures import draw_run

        files, left_out = draw_run(run, target)
        lines = [*left_out, *map(str, files)]
    print(run_text(run))
    if pictures:
        print("", *lines, sep="\n")
    return 0


def _show_sweep(sweep: Sweep, target: Path, pictures: bool) -> int:
    from archord.postprocess.laws.calibration import winkler_coefficients
    from archord.postprocess.tables import sweep_text

    lines = ["no picture: no case has an accepted step."]
    if pictures and sweep.runs:
        from archord.postprocess.pictures import draw_sweep

        file, left_out = draw_sweep(sweep, target / "sweep.png")
        lines = [*([left_out] if left_out else []), str(file)]
    runs = sweep.runs.values() if len(sweep.runs) <= _MOST_FITS else ()
    print(sweep_text(sweep, winkler_coefficients(run.curve for run in runs)))
    if pictures:
        print("", *lines, sep="\n")
    return 0


def compare(
    folders: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="run folders; the first is the measure")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="picture to draw")] = Path(
        "comparison.png"
    ),
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="draw the picture, too")] = True,
) -> int:
    """Compare runs with the first: P, p0 and eps at common displacements, scenes, cost; and draw them.

    Where R, dR or E* differ, they are compared in dimensionless form, too.
    """
    from archord.postprocess.comparison import compare_runs
    from archord.postprocess.run import Run
    from archord.postprocess.tables import comparison_text

    comparison = compare_runs([Run(folder) for folder in folders])
    if pictures:
        from archord.postprocess.pictures import draw_comparison

        draw_comparison(comparison.runs, comparison.names, output, absolute=bool(comparison.absolute),
                        dimensionless=bool(comparison.dimensionless))  # fmt: skip
    print(comparison_text(comparison))
    if pictures:
        print(f"\n{output}")
    return 0


def export(
    folder: Annotated[Path, typer.Argument(metavar="RUN", help="run folder")],
    vtk: Annotated[
        Path | None, typer.Option("--vtk", metavar="DIR", help="write .vtu files for each step and run.pvd into DIR")
    ] = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="DIR", help="write history, contact, nodes and cells into DIR")
    ] = None,
    step: Annotated[
        int | None,
        typer.Option("--step", metavar="N", help="of the .vtu files this step alone [all]; of nodes and cells [last]"),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite files that are there")] = False,
) -> int:
    """Write a run for other programs: VTK files for ParaView and pyvista, CSV tables for anything else."""
    from archord.postprocess.run import Run
    from archord.scene.errors import InputError

    if vtk is None and csv is None:
        raise InputError("export: give --vtk DIR, --csv DIR or both.")
    run = Run(folder)
    files: list[Path] = []
    left_out: list[str] = []
    if vtk is not None:
        from archord.postprocess.export import export_vtk

        files += export_vtk(run, vtk, step, force=force)
    if csv is not None:
        from archord.postprocess.export import export_csv

        tables, left_out = export_csv(run, csv, step, force=force)
        files += tables
    for line in (*left_out, *_shortened(files)):
        print(line)
    return 0


def _shortened(files: list[Path]) -> list[str]:
    """The first files and how many there are, if they are many."""
    few = [str(file) for file in files if file.suffix != ".vtu"]
    vtu = [file for file in files if file.suffix == ".vtu"]
    return few + ([f"{len(vtu)} .vtu files beside it, {vtu[0].name} to {vtu[-1].name}"] if vtu else [])

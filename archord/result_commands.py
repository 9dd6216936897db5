"""Commands that read what solves left: ``show``, ``compare``, ``export``, ``picture``; and ``export-deck``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from archord.options import SCENE, argument, file, flag, output, overrides, pictures
from archord.scene.errors import InputError

_MOST_FITS = 200  # runs of a sweep; an elastic fit takes some milliseconds
_MOST_FITS = 200  # runs of a sweep; an elastic fit takes some milliseconds

if TYPE_CHECKING:
    from archord.postprocess.deck import Elements
    from archord.postprocess.run import Run
    from archord.postprocess.sweep import Sweep


@click.command()
@argument("folder", "RUN|SWEEP", "folder of a run or of a sweep")
@output("folder for the pictures [the run's]", metavar="DIR")
@pictures("pictures")
def show(folder: Path, output: Path | None, pictures: bool) -> int:
    """Print a run's joint, state, history, peaks, cost and warnings, or a sweep's cases; and draw them.

    The pictures of a run are force.png, pressure.png, field.png and iterations.png.
    """
    from archord.output.folder import is_sweep

    if is_sweep(folder):
        from archord.postprocess.sweep import Sweep

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


@click.command()
@argument("folders", "RUN RUN...", "run folders; the first is the measure", nargs=-1, required=True)
@output("picture to draw", "comparison.png", "FILE")
@pictures("the picture")
def compare(folders: tuple[Path, ...], output: Path, pictures: bool) -> int:
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


@click.command()
@argument("folder", "RUN", "run folder")
@file("--vtk", "write .vtu files for each step and run.pvd into DIR", "DIR")
@file("--csv", "write history, contact, nodes and cells into DIR", "DIR")
@click.option(
    "--step", type=int, metavar="N", help="of the .vtu files this step alone [all]; of nodes and cells [last]"
)
@flag("--force", "overwrite files that are there")
def export(folder: Path, vtk: Path | None, csv: Path | None, step: int | None, force: bool) -> int:
    """Write a run for other programs: VTK files for ParaView and pyvista, CSV tables for anything else."""
    from archord.postprocess.run import Run

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


@click.command()
@argument("folder", "RUN", "run folder")
@output("file to draw [RUN/picture.png]")
def picture(folder: Path, output: Path | None) -> int:
    """Draw a run: plastic zone, contact pressure, P(delta)."""
    from archord.postprocess.pictures import draw

    print(draw(folder, output))
    return 0


@click.command("export-deck")
@SCENE
@output("deck to write [<scene name>.inp]")
@click.option(
    "--elements",
    type=click.Choice(["quadratic", "linear"]),
    default="quadratic",
    help="six-node triangles, archord's own mesh, or each cut into four of three nodes",
)
@overrides()
@flag("--force", "overwrite a file that is there")
def export_deck(scene: Path, output: Path | None, elements: Elements, overrides: tuple[str, ...], force: bool) -> int:
    """Write a scene as an input deck for CalculiX or Abaqus."""
    from archord.output.user_file import check_target
    from archord.postprocess.deck import write_deck
    from archord.scene.file import files_read, load_scene

    checked = load_scene(scene, overrides)
    if checked.joint.model != "block":
        raise InputError(f'{scene}: joint.model = "{checked.joint.model}" cannot be exported; only "block" can.')
    path = output or Path(f"{scene.stem}.inp")
    check_target(path, files_read(scene, overrides), force=force)
    write_deck(checked, path, elements)
    print(path)
    return 0

"""Commands that read what solves left: `show`, `compare`, `export`, `picture`, `report`, `probe`;
and `export-deck`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from archord.commands.options import SCENE, argument, file, flag, output, overrides, pictures
from archord.commands.ranks import terminal_width
from archord.report.by_name import Names
from archord.report.errors import InputError


@click.command()
@argument("folder", "RUN|SWEEP", "folder of a run or of a sweep")
@output("picture to draw [picture.png in the folder]")
@pictures("the picture")
def show(folder: Path, output: Path | None, pictures: bool) -> int:
    """Print a run's joint, state, history, peaks, cost and warnings, or a sweep's cases; and draw
    them."""
    from archord.output.folder import is_sweep
    from archord.postprocess.pictures.pictures import draw_run, draw_runs
    from archord.postprocess.run import Run
    from archord.postprocess.sweep import Sweep
    from archord.postprocess.tables import run_text, sweep_text

    target = output or folder / "picture.png"
    if is_sweep(folder):
        sweep = Sweep(folder)
        text = sweep_text(sweep)
        drawn = None
        if pictures and sweep.runs:
            drawn = draw_runs(
                list(sweep.runs.values()), [sweep.label(case) for case in sweep.runs], target
            )
    else:
        run = Run(folder)
        text = run_text(run, terminal_width())
        drawn = draw_run(run, target) if pictures and run.steps else None
    print(text, *([f"\n{drawn}"] if drawn else []), sep="\n")
    return 0


@click.command()
@argument("folders", "RUN RUN...", "run folders; the first is the measure", nargs=-1, required=True)
@output("picture to draw", "comparison.png", "FILE")
@pictures("the picture")
def compare(folders: tuple[Path, ...], output: Path, pictures: bool) -> int:
    """Compare runs with the first: P, p0 and eps at common displacements (delta at common forces,
    where forces load all of them), scenes, cost; and draw them.

    Where units, R, dR or E* differ, they are compared in dimensionless form.
    """
    from archord.postprocess.comparison import compare_runs
    from archord.postprocess.run import Run
    from archord.postprocess.tables import comparison_text, names_of

    comparison = compare_runs([Run(folder) for folder in folders])
    text = comparison_text(comparison)
    if pictures:
        from archord.postprocess.pictures.pictures import draw_runs

        text += f"\n\n{draw_runs(comparison.runs, names_of(comparison.runs), output)}"
    print(text)
    return 0


@click.command()
@argument("folder", "RUN", "run folder")
@file("--vtk", "write bodies, contact and points as .vtkhdf files into DIR", "DIR")
@file("--csv", "write history and contact into DIR", "DIR")
@click.option("--step", type=int, metavar="N", help="write .vtkhdf files of this step alone [all]")
@flag("--force", "overwrite files that are there")
def export(folder: Path, vtk: Path | None, csv: Path | None, step: int | None, force: bool) -> int:
    """Write a run for other programs: VTK files for ParaView and pyvista, CSV tables for anything
    else."""
    from archord.postprocess.export import export_csv, export_vtk
    from archord.postprocess.run import Run

    if vtk is None and csv is None:
        raise InputError("export: give --vtk DIR, --csv DIR or both.")
    run = Run(folder)
    if vtk is not None:
        print(*export_vtk(run, vtk, step, force=force), sep="\n")
    if csv is not None:
        print(*export_csv(run, csv, force=force), sep="\n")
    return 0


@click.command()
@argument("folder", "RUN", "run folder")
@click.option(
    "--step",
    "steps",
    type=int,
    multiple=True,
    metavar="N",
    help="step to draw; repeated: of curves [last, or loaded]",
)
@click.option(
    "--field",
    default="",
    help="stress, peeq, displacement, pressure, mean_stress, stress_xx, p1, ... [peeq or stress]",
)
@click.option(
    "--edge",
    "edges",
    multiple=True,
    metavar="NAME",
    help="draw the field along this edge [hoop stress]",
)
@click.option(
    "--cut", default="", metavar="PLANE", help='in space: no cells beyond this plane, as "z=5"'
)
@output("file to draw [RUN/picture.png]")
def picture(
    folder: Path,
    steps: tuple[int, ...],
    field: str,
    edges: Names,
    cut: str,
    output: Path | None,
) -> int:
    """Draw a run: a field on the bodies, contact pressure or a field along edges, and the force of
    the loads."""
    from archord.postprocess.pictures.pictures import draw_run
    from archord.postprocess.run import Run

    target = output or folder / "picture.png"
    print(draw_run(Run(folder), target, steps=steps, field=field, edges=edges, cut=cut))
    return 0


@click.command()
@argument("folder", "RUN", "run folder")
@output("PDF file to write [RUN/report.pdf]")
@flag("--force", "overwrite a file that is there")
def report(folder: Path, output: Path | None, force: bool) -> int:
    """Write a run as a PDF report: scene, mesh, pictures, convergence, balances, steps, warnings,
    versions."""
    from archord.postprocess.pictures.report import write_report
    from archord.postprocess.run import Run

    print(write_report(Run(folder), output or folder / "report.pdf", force=force))
    return 0


@click.command()
@argument("folder", "RUN", "run folder")
@click.option(
    "--edge",
    metavar="NAME",
    default="",
    help='along this set of facets of the mesh; in space "A & B", where two of them meet',
)
@click.option("--line", type=float, nargs=4, metavar="X0 Y0 X1 Y1", help="along this line")
@click.option(
    "--along",
    type=float,
    nargs=6,
    metavar="X0 Y0 Z0 X1 Y1 Z1",
    help="along this line in space",
)
@click.option("--step", type=int, metavar="N", help="at this step [the last]")
@click.option(
    "--quantity",
    default="",
    help="hoop [of an edge], von_mises [of a line], pressure, stress_xx, p1, ux, ...",
)
@click.option(
    "--angle",
    "angles",
    type=float,
    multiple=True,
    help="tell the value at this angle of an arc [°]",
)
@click.option(
    "--over", type=float, metavar="LENGTH", help="over P / LENGTH, the mean stress in a section"
)
@click.option(
    "--of", default="", metavar="LOAD", help="--over: the load that P is of, if it has several"
)
@output("table (.csv) or picture to write")
def probe(
    folder: Path,
    angles: tuple[float, ...],
    over: float | None,
    of: str,
    output: Path | None,
    along: tuple[float, ...] | None,
    **asked: Any,
) -> int:
    """Print a quantity along an edge or a line of a run, its largest and smallest value and where;
    and draw it."""
    from archord.postprocess.run import Run
    from archord.postprocess.tables import probe_text

    if along and asked["line"]:
        raise click.UsageError("choose one of --line and --along")
    asked["line"] = along or asked["line"]
    found = Run(folder).probe(**asked)
    if of and over is None:
        raise InputError(f"--of {of}: is the load of --over, which is missing.")
    found = found.over(over, of) if over is not None else found
    print(probe_text(found, angles))
    if output is not None:
        from archord.postprocess.pictures.pictures import draw_probe

        print(f"\n{draw_probe(found, output)}")
    return 0


@click.command("export-deck")
@SCENE
@output("deck to write [<scene name>.inp]")
@overrides()
@flag("--force", "overwrite a file that is there")
def export_deck(scene: Path, output: Path | None, overrides: Names, force: bool) -> int:
    """Write a scene as an input deck for CalculiX or Abaqus."""
    from archord.output.user_file import check_target
    from archord.postprocess.decks.deck import write_deck
    from archord.scene.file import files_read, load_scene

    checked = load_scene(scene, overrides)
    path = output or Path(f"{scene.stem}.inp")
    check_target(path, files_read(scene, overrides), force=force)
    write_deck(checked, path, str(scene))
    print(path)
    return 0

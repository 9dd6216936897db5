"""One picture of a run: the field on the deformed joint, the pressure on the arc, and P(delta)."""

from __future__ import annotations

from pathlib import Path

from archord.output.folder import FILES
from archord.output.output_file import check_output
from archord.postprocess.panels import arc_panel, field_panel, force_panel
from archord.postprocess.run_pictures import new_figure, save
from archord.postprocess.run_result import Run
from archord.scene.errors import InputError


def draw(folder: str | Path, target: str | Path | None = None) -> Path:
    """Draw the run in ``folder`` as ``target`` (by default ``picture.png`` in it); returns the file.

    Raises `InputError` if the folder holds no accepted step of a run or no fields, or ``target`` cannot be written.
    """
    folder = Path(folder)
    run = Run(folder)
    run.number(None)
    missing = [name for name in FILES if not (folder / name).is_file()]
    if not run.scene.output.fields:
        raise InputError(f"{folder}: has no fields to draw: it was solved with output.fields = false.")
    if missing:
        raise InputError(f"{folder}: is not a complete run folder: {missing[0]} is missing.")
    target = Path(target) if target else folder / "picture.png"
    figure = new_figure(15, 4.4)
    formats = figure.canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in formats:
        raise InputError(f"{target}: must end in one of {', '.join('.' + name for name in sorted(formats))}.")
    check_output(target)
    field, arc, force = figure.subplots(1, 3, width_ratios=[1.0, 1.2, 1.1])
    field_panel(figure, field, run)
    arc_panel(arc, run)
    force_panel(force, run)
    return save(figure, target)

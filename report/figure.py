"""Figures: one style, one way to save them. matplotlib is loaded by the first one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS = 110  # per inch


def new_figure(width: float, height: float) -> Figure:
    """A figure so wide and high in inches that belongs to no window."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def save(figure: Figure, target: Path) -> Path:
    """Write ``figure`` as ``target``, in the format of its suffix; returns it. Raises `OSError`,
    and `ValueError` for a suffix that matplotlib does not know."""
    formats = figure.canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in formats:
        raise ValueError(
            f"{target}: must end in one of {', '.join(f'.{name}' for name in sorted(formats))}."
        )
    figure.savefig(target, dpi=DOTS)
    return target

"""A picture of a sweep: its runs over each other, coloured by what was varied."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from archord.postprocess.comparison import same_size, same_units
from archord.postprocess.comparison_picture import FEW, Shades, draw_comparison
from archord.postprocess.sweep_result import Sweep, short
from archord.scene.errors import InputError

_MOST = 200  # runs in a picture


def draw_sweep(sweep: Sweep, target: Path) -> tuple[Path, str]:
    """Draw the runs of ``sweep`` as ``target``, and below in dimensionless form if R, dR or E* are not the same in
    all; returns the file, and a sentence if runs are left out, or nothing.

    Raises `InputError` if no case has an accepted step, or the file cannot be written.
    """
    runs = sweep.runs
    if not runs:
        raise InputError(f"{sweep.folder}: no case has an accepted step to draw.")
    chosen = [list(runs)[k] for k in sorted({round(k) for k in np.linspace(0, len(runs) - 1, min(len(runs), _MOST))})]
    rows = {int(row["case"]): row for row in sweep.rows}
    moving = sweep.moving
    names = [", ".join(_value(h, rows[c][h]) for h in moving) or f"case {c}" for c in chosen]
    shades = None
    if len(chosen) > FEW:
        heading = next((h for h in moving if all(_is_number(rows[c][h]) for c in chosen)), None)
        values = [float(rows[c][heading]) if heading else float(c) for c in chosen]
        shades = Shades(short(heading) if heading else "case", values)
    scenes = [runs[c].scene for c in chosen]
    draw_comparison([runs[c] for c in chosen], names, target, absolute=same_units(scenes),
                    dimensionless=not same_size(scenes), shades=shades, dashed=False)  # fmt: skip
    return target, f"{len(chosen)} of {len(runs)} runs are drawn." if len(chosen) < len(runs) else ""


def _value(heading: str, text: str) -> str:
    """A varied key and its value: "clearance = 0.05 mm"."""
    name, _, unit = short(heading).partition(" [")
    return f"{name} = {text} {unit.removesuffix(']')}".rstrip() if text else f"no {name}"


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False

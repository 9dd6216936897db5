"""Results as pandas tables, with the units of their columns in ``attrs["units"]``."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pandas as pd

from archord.postprocess.arc import undeformed
from archord.postprocess.curve import Columns
from archord.postprocess.fields import BODIES, Fields
from archord.presets.arc import ArcProfile
from archord.scene.errors import InputError
from archord.scene.scene import Scene

_WHOLE = ("step", "iterations", "cutbacks")
_BODY = {number: name for name, number in BODIES.items()}


def with_units(frame: pd.DataFrame, units: dict[str, str]) -> pd.DataFrame:
    """``frame`` with the ``units`` of those of its columns that have one."""
    frame.attrs["units"] = {name: unit for name, unit in units.items() if unit and name in frame}
    return frame


def with_headings(frame: pd.DataFrame) -> pd.DataFrame:
    """A copy of ``frame`` whose columns are headed ``name [unit]``, as archord's CSV files are."""
    units = frame.attrs.get("units", {})
    return frame.rename(columns={name: f"{name} [{unit}]" for name, unit in units.items()})


def units_of_headings(path: Path) -> dict[str, str]:
    """Units by column of a CSV file whose columns are headed ``name [unit]``; empty where a column has none."""
    with path.open(newline="", encoding="utf-8") as file:
        parts = [heading.partition(" [") for heading in next(csv.reader(file))]
    return {name: unit.removesuffix("]") for name, _, unit in parts}


def history_frame(path: Path, columns: Columns) -> pd.DataFrame:
    """The ``columns`` of the history.csv ``path``, a row for each accepted step, with the units of its headings."""
    frame = pd.DataFrame(columns)
    whole = [name for name in _WHOLE if name in frame]
    return with_units(frame.astype(dict.fromkeys(whole, int)), units_of_headings(path))


def contact_frame(arcs: dict[str, ArcProfile], scene: Scene) -> pd.DataFrame:
    """The points of the arcs by side and, from the contact axis, by angle; x and y are undeformed coordinates.

    ``pressure`` is linear on each facet, ``raw_pressure`` as the solver integrates it, both positive in compression;
    ``weight`` is arc length; ``gap`` is positive when open.
    """
    length, stress = scene.units.length, scene.units.stress
    units = dict.fromkeys(("s", "weight", "gap", "x", "y", "ux", "uy"), length)
    units |= {"angle": "rad", "pressure": stress, "raw_pressure": stress}
    parts = []
    for side, arc in arcs.items():
        points = undeformed(arc, side, scene)
        facet = np.broadcast_to(np.arange(1, len(arc.angle) + 1)[:, None], arc.angle.shape)
        moved = arc.coordinates - points
        columns = {"facet": facet, "s": arc.s, "angle": arc.angle, "weight": arc.weight, "pressure": arc.pressure,
                   "raw_pressure": arc.raw_pressure, "gap": arc.gap, "x": points[..., 0], "y": points[..., 1],
                   "ux": moved[..., 0], "uy": moved[..., 1]}  # fmt: skip
        parts.append(pd.DataFrame({"side": side} | {name: values.ravel() for name, values in columns.items()}))
    return with_units(pd.concat(parts, ignore_index=True), units)


def node_frame(fields: Fields, scene: Scene) -> pd.DataFrame:
    """The nodes with their body, undeformed coordinates and displacement."""
    length = scene.units.length
    columns = {
        "body": [_BODY[number] for number in fields.body_of_node],
        **dict(zip(("x", "y"), fields.coordinates.T, strict=True)),
        **dict(zip(("ux", "uy"), fields.displacement.T, strict=True)),
    }
    frame = pd.DataFrame({"node": np.arange(1, len(fields.coordinates) + 1)} | columns)
    return with_units(frame, dict.fromkeys(("x", "y", "ux", "uy"), length))


def cell_frame(fields: Fields, scene: Scene) -> pd.DataFrame:
    """The triangles with their body, nodes (numbered from 1: three corners, three between), centre and mean fields."""
    stress = scene.units.stress
    centre = fields.coordinates[fields.cells[:, :3]].mean(axis=1)
    nodes = {f"node{k + 1}": fields.cells[:, k] + 1 for k in range(fields.cells.shape[1])}
    columns = {"cell": np.arange(1, len(fields.cells) + 1), "body": [_BODY[number] for number in fields.body]}
    frame = pd.DataFrame(columns | nodes | {"x": centre[:, 0], "y": centre[:, 1]} | fields.cell_fields())
    units = dict.fromkeys(("von_mises", "mean_stress", "contact_pressure"), stress)
    return with_units(frame, units | dict.fromkeys(("x", "y"), scene.units.length))


def sweep_frame(path: Path) -> pd.DataFrame:
    """A sweep.csv or cases.csv. Raises `InputError` if it is none."""
    text = dict.fromkeys(("run", "status", "message"), str)  # names of runs may look like numbers
    try:
        units = units_of_headings(path)
        frame = pd.read_csv(path, dtype=text, keep_default_na=False, na_values=[""])
        frame.columns = pd.Index(list(units))
    except (OSError, ValueError, StopIteration):
        raise InputError(f"{path}: cannot be read as a table of a sweep.") from None
    if "message" in frame:
        frame["message"] = frame["message"].fillna("")
    return with_units(frame, units)

"""Results as pandas tables, with the units of their columns in ``attrs["units"]``."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from archord.output.user_file import writing
from archord.postprocess.arrays.arc import undeformed
from archord.report.by_name import ByName
from archord.report.readable import require_file

_OF_POINTS = ("s", "angle", "weight", "pressure", "raw_pressure", "gap")
_OF_FRICTION = ("slip", "shear", "sticks")  # at points in a plane and around an axis
_VECTORS = ("normal", "slip", "traction", "shear")  # at points in space
_LENGTHS = (
    *("s", "weight", "gap", "slip"),
    *(f"{name}{axis}" for name in ("", "u", "slip_") for axis in "xyz"),
)
_STRESSES = (
    "pressure",
    "raw_pressure",
    "shear",
    *(f"{name}_{axis}" for name in ("traction", "shear") for axis in "xyz"),
)
_TEXT = dict.fromkeys(("run", "status", "message"), str)  # names of runs may look like numbers


def frame_of(columns: Mapping[str, Any], units: Mapping[str, str]) -> pd.DataFrame:
    """The ``columns`` as a table with the ``units`` of those that have one."""
    frame = pd.DataFrame(columns)
    frame.attrs["units"] = {name: unit for name, unit in units.items() if unit and name in frame}
    return frame


def with_headings(frame: pd.DataFrame) -> pd.DataFrame:
    """A copy of ``frame`` whose columns are headed ``name [unit]``, as archord's CSV files are."""
    units = frame.attrs["units"]
    headings = {name: f"{name} [{unit}]" for name, unit in units.items()}
    return frame.rename(columns=headings)


def write_frame(frame: pd.DataFrame, target: Path) -> Path:
    """Write ``frame`` as a CSV file; returns the ``target``. Raises `InputError`."""
    headed = with_headings(frame)
    with writing(target) as new:
        headed.to_csv(new, index=False, float_format="%.12g", lineterminator="\n")
    return target


def read_frame(path: Path) -> pd.DataFrame:
    """The table in a CSV file whose columns are headed ``name [unit]``, by names; columns of one
    name in several units keep their headings. A last row that does not end in a line break (a copy
    cut short) is ignored. Raises `OSError`, and `ValueError` if it is no table."""
    text = require_file(path).read_bytes().decode()
    whole = io.StringIO(text[: text.rfind("\n") + 1])
    table = pd.read_csv(
        whole, dtype=_TEXT, keep_default_na=False, na_values=[""], float_precision="round_trip"
    )
    if not isinstance(table.index, pd.RangeIndex):
        raise ValueError("rows are longer than the headings")
    if "message" in table:
        table["message"] = table["message"].fillna("")
    parts = {heading: heading.partition(" [") for heading in table}
    names = [name for name, _, _ in parts.values()]
    known = {heading: part for heading, part in parts.items() if names.count(part[0]) == 1}
    name_of = {heading: name for heading, (name, _, _) in known.items()}
    units = {name: unit.removesuffix("]") for name, _, unit in known.values()}
    return frame_of(table.rename(columns=name_of), units)


def contact_frame(arcs: ByName, scene: Any) -> pd.DataFrame:
    """The points of the arcs by side and, of joints, by angle from the contact axis; x and y are
    undeformed.

    ``pressure`` is linear on each facet, ``raw_pressure`` as the solver integrates it, both
    positive in compression; ``weight`` is arc length, around an axis and in space area; ``gap`` is
    positive when open. With friction there are slip and shear, positive along ``s``, and where the
    points stick. Slip, shear and the normal have components in space.
    """
    plane = scene.analysis.plane
    length = scene.units.length
    units = dict.fromkeys(_LENGTHS, length)
    if plane in ("axisymmetric", "space"):
        units["weight"] = f"{length}2"
    units["angle"] = "rad"
    units |= dict.fromkeys(_STRESSES, scene.units.stress)
    parts = []
    axes = "xyz" if plane == "space" else "xy"
    for side, arc in arcs.items():
        X = undeformed(arc, side, scene)
        u = arc.coordinates - X
        facet = np.arange(1, len(X) + 1)[:, None]
        columns = {"facet": np.broadcast_to(facet, X.shape[:2])}
        columns |= {name: getattr(arc, name) for name in _OF_POINTS if hasattr(arc, name)}
        vectors = {"": X, "u": u}
        if len(axes) == 3:
            given = {f"{name}_": getattr(arc, name) for name in _VECTORS}
            vectors |= {name: values for name, values in given.items() if values is not None}
        elif getattr(arc, "shear", None) is not None:
            columns |= {name: getattr(arc, name) for name in _OF_FRICTION if hasattr(arc, name)}
        for name, values in vectors.items():
            columns |= {f"{name}{axis}": values[..., k] for k, axis in enumerate(axes)}
        flat = {name: values.ravel() for name, values in columns.items()}
        parts.append(pd.DataFrame({"side": side} | flat))
    return frame_of(pd.concat(parts, ignore_index=True), units)

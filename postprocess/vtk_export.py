"""A run for VTK's readers (ParaView, pyvista): a .vtu file per step for the bodies, one for the contact, and a .pvd.

The bodies keep their curved second-order triangles (VTK_QUADRATIC_TRIANGLE) with the nodal displacement and the means
of the cells. The contact is a line through the integration points of each facet, undeformed like the mesh, with the
pressure, the gap and the displacement of the points, so that the same filters deform both.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from archord.output.output_file import writing
from archord.output.step_file import step_name
from archord.postprocess.arc_pressure import ArcContact, undeformed
from archord.postprocess.export_files import check_new
from archord.postprocess.run_fields import Fields
from archord.postprocess.run_result import Run
from archord.scene.scene import Scene

_SIDE = {"pin": 1, "hole": 2}
_DATA_OF_ARC = ("pressure", "raw_pressure", "gap", "angle", "s")


def export_vtk(run: Run, folder: Path, step: int | None = None, *, force: bool = False) -> list[Path]:
    """Write all steps of ``run``, or one ``step`` alone, into ``folder``, which is made if need be; returns the files,
    the .pvd first. Time is delta; the number of the step, where delta does not only grow.

    Raises `InputError` if the run wrote no fields or has no such step, a file of it is damaged, or one that would be
    written is there already and ``force`` is not given.
    """
    import meshio

    steps = [run.number(step)] if step is not None else list(range(1, run.number(None) + 1))
    parts = [(n, f"{part}_{step_name(n)}.vtu") for n in steps for part in ("bodies", "contact")]
    collection = folder / "run.pvd"
    run.fields(steps[-1])
    check_new([collection, *(folder / name for _, name in parts)], folder, force)
    delta = run.columns["delta"]
    grows = all(a < b for a, b in pairwise(delta))
    times = {n: delta[n - 1] if grows else float(n) for n in steps}
    for n in steps:
        for name, mesh in zip(("bodies", "contact"), _meshes(run, n), strict=True):
            path = folder / f"{name}_{step_name(n)}.vtu"
            with writing(path):
                meshio.Mesh(**mesh).write(path)
    entries = "".join(
        f'<DataSet timestep="{times[n]!r}" part="{part}" name={quoteattr(name[:-9])} file={quoteattr(name)}/>\n'
        for (n, name), part in zip(parts, [0, 1] * len(steps), strict=True)
    )
    text = f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n{entries}</Collection>\n'
    with writing(collection):
        collection.write_text(f"{text}</VTKFile>\n", encoding="utf-8")
    return [collection, *(folder / name for _, name in parts)]


def _meshes(run: Run, step: int) -> Iterator[dict]:
    """Bodies and contact at ``step``."""
    yield bodies(run.fields(step))
    yield contact(run.contact(step), run.scene)


def bodies(fields: Fields) -> dict:
    """Both bodies: points, second-order triangles and their data, as meshio takes them."""
    return {
        "points": np.pad(fields.coordinates, ((0, 0), (0, 1))),
        "cells": [("triangle6", fields.cells)],
        "point_data": {"displacement": np.pad(fields.displacement, ((0, 0), (0, 1)))},
        "cell_data": {"body": [fields.body], **{name: [value] for name, value in fields.cell_fields().items()}},
    }


def contact(arcs: dict[str, ArcContact], scene: Scene) -> dict:
    """The integration points of the arcs, joined by lines within each facet, and their data; ``side`` is 1 on the pin
    and 2 on the hole."""
    points = {side: undeformed(arc, side, scene) for side, arc in arcs.items()}
    lines, start = [], 0
    for arc in arcs.values():
        numbers = start + np.arange(arc.angle.size).reshape(arc.angle.shape)
        lines.append(np.stack([numbers[:, :-1], numbers[:, 1:]], axis=-1).reshape(-1, 2))
        start += arc.angle.size
    moved = {side: arc.coordinates - points[side] for side, arc in arcs.items()}
    data = {name: np.concatenate([getattr(arc, name).ravel() for arc in arcs.values()]) for name in _DATA_OF_ARC}
    sides = np.concatenate([np.full(arc.angle.size, _SIDE[side], dtype=np.int8) for side, arc in arcs.items()])
    return {
        "points": _flat(points),
        "cells": [("line", np.concatenate(lines))],
        "point_data": {"displacement": _flat(moved), "side": sides, **data},
    }


def _flat(by_side: dict[str, np.ndarray]) -> np.ndarray:
    """Points ``(n, 3)`` of all sides."""
    return np.pad(np.concatenate([values.reshape(-1, 2) for values in by_side.values()]), ((0, 0), (0, 1)))

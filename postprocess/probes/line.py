"""A quantity along a straight line through the bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from archord.materials.material import Array
from archord.postprocess.arrays.fields import Fields
from archord.postprocess.probes.located import located
from archord.postprocess.probes.probed import Along, Probed, nodal
from archord.report.errors import InputError

_SAMPLES = 201  # on a line


def along_line(run: Probed, line: Sequence[float], quantity: str, step: int) -> Along:
    """The points of the line that are in a body before it is loaded."""
    d = run.kinematics.dimension
    if len(line) != 2 * d:
        ends = ", ".join(f"{axis}{k}" for k in (0, 1) for axis in run.kinematics.axes)
        raise InputError(f"{run.folder}: a line here is {ends}, not {len(line)} numbers.")
    start = np.array(line[:d])
    end = np.array(line[d:])
    share = np.linspace(0, 1, _SAMPLES)
    x = start + share[:, None] * (end - start)
    fields = run.fields(step)
    of_cells = fields.cell.get(quantity)
    if quantity in fields.nodal_fields():
        of_cells = None
    if d == 3:
        found = _in_cells(run, fields, x, quantity, of_cells)
    elif of_cells is None:
        found = _between_nodes(fields, x, nodal(run, fields, quantity))
    else:
        found = _of_cells(fields, x, of_cells)
    inside = ~np.isnan(found)
    if not inside.any():
        raise InputError(f"{run.folder}: no body lies on the line.")
    return Along(x[inside], share[inside] * np.linalg.norm(end - start), found[inside])


def _in_cells(
    run: Probed, fields: Fields, x: Array, quantity: str, of_cells: Array | None
) -> Array:
    """The quantity at ``x`` ``(k, 3)``, from values ``of_cells`` or from the nodes, NaN outside the
    bodies."""
    cell, nodes, weights = located(fields, x)
    if of_cells is not None:
        values = of_cells[cell]
    else:
        values = np.einsum("ka,ka->k", weights, nodal(run, fields, quantity, nodes))
    return np.where(cell >= 0, values, np.nan)


def _between_nodes(fields: Fields, x: Array, values: Array) -> Array:
    """Nodal ``values`` at ``x`` ``(k, 2)``, NaN outside the bodies."""
    from matplotlib.tri import LinearTriInterpolator, Triangulation

    found: Array = np.full(len(x), np.nan)
    for body in fields.bodies.values():
        triangles = fields.triangles[fields.body == body].reshape(-1, 3)
        interpolator = LinearTriInterpolator(
            Triangulation(*fields.coordinates.T, triangles), values
        )
        here = np.ma.filled(interpolator(*x.T), np.nan)
        found = np.where(np.isnan(found), here, found)
    return found


def _of_cells(fields: Fields, x: Array, values: Array) -> Array:
    """The ``values`` of the cells in which ``x`` ``(k, 2)`` lie, NaN outside the bodies."""
    from matplotlib.tri import Triangulation

    found: Array = np.full(len(x), np.nan)
    for body in fields.bodies.values():
        cells = np.flatnonzero(fields.body == body)
        triangles = fields.triangles[cells]
        finder = Triangulation(*fields.coordinates.T, triangles.reshape(-1, 3)).get_trifinder()
        triangle = finder(*x.T)
        here = values[cells[triangle // triangles.shape[1]]]
        found = np.where(np.isnan(found) & (triangle >= 0), here, found)
    return found

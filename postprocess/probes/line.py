"""A quantity along a straight line through the bodies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from archord.geometry.vectors import crossed
from archord.materials.kinematics import Ints
from archord.materials.material import Array
from archord.output.cell_fields import row_of
from archord.postprocess.arrays.fields import Fields
from archord.postprocess.probes.located import located
from archord.postprocess.probes.probed import Along, Probed, nodal
from archord.report.errors import InputError

_ANGLE = "principal_angle"
_IN_PLANE = (0, 1, 3)  # the places of the components of a stress that turn it in its plane
_SAMPLES = 201  # on a line
_BESIDE = 1e-6  # of a triangle's height, by which a point beside it still lies on it


def along_line(run: Probed, line: Sequence[float], quantity: str, step: int) -> Along:
    """The points of the line that are in a body before it is loaded."""
    d = run.kinematics.dimension
    if len(line) != 2 * d:
        ends = ", ".join(f"{axis}{k}" for k in (0, 1) for axis in run.kinematics.axes)
        raise InputError(run.folder, f"a line here is {ends}, not {len(line)} numbers.")
    start = np.array(line[:d])
    end = np.array(line[d:])
    share = np.linspace(0, 1, _SAMPLES)
    x = start + share[:, None] * (end - start)
    fields = run.fields(step)
    if quantity == _ANGLE and fields.stress is not None:
        # an angle itself jumps by half a turn between nodes
        names = [run.kinematics.names[k] for k in _IN_PLANE]
        xx, yy, xy = (_values(run, fields, x, f"stress_{name}") for name in names)
        found = np.arctan2(2 * xy, xx - yy) / 2
    else:
        found = np.maximum(_values(run, fields, x, quantity), _least(quantity))
    inside = ~np.isnan(found)
    if not inside.any():
        raise InputError(run.folder, "no body lies on the line.")
    length = np.linalg.norm(end - start)
    return Along(x[inside], share[inside] * length, found[inside])


def _values(run: Probed, fields: Fields, x: Array, quantity: str) -> Array:
    """The quantity at ``x`` ``(k, d)``, NaN outside the bodies."""
    of_cells = fields.cell.get(quantity)
    if quantity in fields.nodal_fields():
        of_cells = None
    if x.shape[1] == 3:
        return _in_cells(run, fields, x, quantity, of_cells)
    values = nodal(run, fields, quantity) if of_cells is None else of_cells
    found: Array = np.full(len(x), np.nan)
    for body in fields.bodies.values():
        cells = np.flatnonzero(fields.body == body)
        nodes = fields.triangles[cells]
        triangle, weights = _in_triangles(fields.coordinates[nodes.reshape(-1, 3)], x)
        if of_cells is None:  # linear in the triangles that cells are drawn by
            here = (weights * values[nodes.reshape(-1, 3)[triangle]]).sum(axis=1)
        else:
            here = values[cells[triangle // nodes.shape[1]]]
        found = np.where(np.isnan(found) & (triangle >= 0), here, found)
    return found


def _least(quantity: str) -> float:
    """What a quantity is at least: parabolas between nodes swing below it."""
    if quantity == "von_mises":
        return 0.0
    row = row_of(quantity)
    return row.least if row else -np.inf


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


def _in_triangles(corners: Array, x: Array) -> tuple[Ints, Array]:
    """For each point ``x`` ``(k, 2)`` the triangle ``(k,)`` of these ``corners`` ``(m, 3, 2)`` that
    it lies in or on, -1 for none, and the weights ``(k, 3)`` of the corners.

    A point may be off a triangle by round-off: a line may begin at the edge of a hole, or run along
    a straight edge."""
    first, second, third = corners.swapaxes(0, 1)
    one = second - first
    other = third - first
    twice_area = crossed(one, other)
    triangle = np.full(len(x), -1)
    weights = np.zeros((len(x), 3))
    for k, point in enumerate(x):
        to = point - first
        by_second = crossed(to, other) / twice_area
        by_third = crossed(one, to) / twice_area
        of_corners = np.stack([1 - by_second - by_third, by_second, by_third], axis=1)
        least = of_corners.min(axis=1)
        best = int(least.argmax())
        if least[best] > -_BESIDE:
            triangle[k] = best
            weights[k] = of_corners[best]
    return triangle, weights

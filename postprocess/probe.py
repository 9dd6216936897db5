"""A quantity along a named edge or a line of a run: its largest and smallest value, and where, and
its factor over a section."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.arc import undeformed
from archord.postprocess.fields import Fields
from archord.scene.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from archord.postprocess.run import Run

_CONTACT = {
    "pressure": "pressure",
    "facet_pressure": "pressure",
    "gap": "gap",
    "contact_shear": "shear",
}
_UNITLESS = ("peeq", "plastic")  # beginnings of names
_GAP = 0.3  # degrees: the least gap in a circle
_SMOOTH = 0.9  # cosine of the angle between facets without a corner
_ROUND_OFF = 1e-6  # degrees
_NOTHING = 1e-9  # of the largest force of a run: round-off
_SAMPLES = 201  # on a line


@dataclass(frozen=True)
class Probe:
    """A ``quantity`` at ``n`` points of the edge or line ``place`` at a ``step``, in the scene's
    units; ``force`` is the largest of those that drive the run then, per unit thickness, that of
    the load ``by``."""

    place: str
    quantity: str
    unit: str
    step: int
    force: float
    by: str
    x: Array  # (n, 2) undeformed
    # (n,) along each piece of the edge, the body on its left; of arcs the radius times the angle
    s: Array
    values: Array  # (n,)
    length: str = ""  # the unit of x and s
    angle: Array | None = (
        None  # (n,) of arcs: degrees about their centre, counterclockwise from the x axis
    )

    @property
    def largest(self) -> int:
        """Number of the point with the largest value, the most tensile of a stress."""
        return int(np.argmax(self.values))

    @property
    def smallest(self) -> int:
        """Number of the point with the smallest value, the most compressive of a stress."""
        return int(np.argmin(self.values))

    def where(self, k: int) -> str:
        """The place of point ``k`` in words: its angle, or how far along the edge or line it is;
        and x and y."""
        along = f"s = {self.s[k]:.6g}" if self.angle is None else f"{self.angle[k]:.4g}°"
        return f"at {along}, x = {self.x[k, 0]:.6g}, y = {self.x[k, 1]:.6g}"

    def at(self, angle: float) -> float:
        """The value at an ``angle`` in degrees. Raises `InputError` if the edge has none there."""
        if self.angle is not None:
            off = (self.angle - angle + 180) % 360 - 180
            order = np.argsort(off)
            if np.abs(off).min() < 2 * np.median(np.diff(off[order])) + 1e-6:
                return float(np.interp(0.0, off[order], self.values[order]))
        raise InputError(f"{self.place}: has no point at {angle:g} degrees.")

    def over(self, length: float) -> Probe:
        """This over P / ``length``, the mean stress that the force makes in a section. Raises
        `InputError`."""
        if not (self.force and length > 0):
            section = f"a section of {length:g} under a force of {self.force:g}"
            raise InputError(f"{self.place}: has no factor over {section}.")
        return replace(
            self,
            quantity=f"{self.quantity}/(P/L)",
            unit="",
            values=self.values / (self.force / length),
        )

    def frame(self) -> pd.DataFrame:
        """As a table."""
        from archord.postprocess.frames import frame_of

        columns = {
            "s": self.s,
            "angle": self.angle,
            "x": self.x[:, 0],
            "y": self.x[:, 1],
            self.quantity: self.values,
        }
        known = {name: values for name, values in columns.items() if values is not None}
        return frame_of(known, {"angle": "°", self.quantity: self.unit})


def probe(run: Run, edge: str, quantity: str, step: int, line: Sequence[float]) -> Probe:
    """A ``quantity`` along an ``edge`` of the mesh or the straight ``line`` x0, y0, x1, y1. Raises
    `InputError`.

    At the nodes of an edge its "hoop" (the default), "normal" or "shear" stress, or a nodal field;
    at the integration points of a surface "pressure", "gap" or, with friction, "contact_shear", or
    "facet_pressure", the mean of each facet, which scatters less where bodies yield. On a line a
    nodal field (von Mises stress), linear between nodes.
    """
    if bool(edge) == bool(line):
        raise InputError("probe: give an edge or a line.")
    quantity = quantity or ("von_mises" if line else "hoop")
    along = _contact if quantity in _CONTACT else _stress
    points = _inside(run, line, quantity, step) if line else along(run, edge, quantity, step)
    unit = run.scene.units.length if quantity in ("ux", "uy", "gap") else run.scene.units.stress
    unit = (
        "rad" if quantity == "principal_angle" else "" if quantity.startswith(_UNITLESS) else unit
    )
    x, s, values, *angle = points
    of_arc = angle[0] if angle else None
    force, by = _driving(run, step)
    return Probe(
        edge or "line",
        quantity,
        unit,
        step,
        force,
        by,
        x,
        s,
        values,
        run.scene.units.length,
        of_arc,
    )


def _contact(run: Run, edge: str, quantity: str, step: int) -> tuple[Any, ...]:
    from archord.geometry.curve import (
        circle_through,
    )  # with bases, which most readers of runs do without

    arc = run.arc(step, edge)
    values = getattr(arc, _CONTACT[quantity])
    if values is None:
        raise InputError(f"{run.folder}: has no {quantity}, as its contacts have no friction.")
    points = undeformed(arc, edge, run.scene), arc.s, values
    circle, share = circle_through(points[0].reshape(-1, 2)), arc.weight / arc.width[:, None]
    means = [np.einsum("fq,fq...->f...", share, values) for values in points]
    x, s, values = means if quantity == "facet_pressure" else points
    x, s, values = x.reshape(-1, 2), s.ravel(), values.ravel()
    if circle is None:
        return x, s, values
    centre, radius = circle
    middle, half = _angle(means[0], centre), np.degrees(arc.width / (2 * radius))
    angle = _rising(_angle(x, centre), middle - half, middle + half)
    angle -= 360 * np.floor(angle.min() / 360)
    order = np.argsort(angle)
    return x[order], np.radians(angle[order]) * radius, values[order], angle[order]


def _stress(run: Run, edge: str, quantity: str, step: int) -> tuple[Any, ...]:
    fields = run.fields(step)
    edges = [name for name, facets in fields.edges.items() if len(facets)]
    if edge not in edges:
        raise InputError(
            f"{run.folder}: has no edge {edge!r}; its edges are {', '.join(edges) or 'none'}."
        )
    rows, s, radius = _along(fields, edge)
    tangent, joined = _tangents(fields.coordinates[rows], rows)
    stresses = {}
    if fields.stress is not None:
        xx, yy, _, xy = np.moveaxis(fields.stress[rows], -1, 0)
        c, d = np.moveaxis(tangent, -1, 0)
        hoop = xx * c**2 + yy * d**2 + 2 * xy * c * d
        stresses = {
            "hoop": hoop,
            "normal": xx + yy - hoop,
            "shear": (yy - xx) * c * d + xy * (c**2 - d**2),
        }
    shown = np.ones(rows.shape, dtype=bool)
    shown[:, 2] = ~joined
    values = _nodal(run, fields, quantity, rows, **stresses)
    angle = np.degrees(s / radius)[shown] if radius else None
    return fields.coordinates[rows][shown], s[shown], values[shown], angle


def _inside(run: Run, line: Sequence[float], quantity: str, step: int) -> tuple[Any, ...]:
    """The points of the line that are in a body before it is loaded."""
    from matplotlib.tri import LinearTriInterpolator, Triangulation

    start, end, share = np.array(line[:2]), np.array(line[2:]), np.linspace(0, 1, _SAMPLES)
    fields, x = run.fields(step), start + share[:, None] * (end - start)
    values = _nodal(run, fields, quantity)
    found: Array = np.full(_SAMPLES, np.nan)
    for body in fields.bodies.values():
        triangles = Triangulation(
            *fields.coordinates.T, fields.triangles[fields.body == body].reshape(-1, 3)
        )
        here = np.ma.filled(LinearTriInterpolator(triangles, values)(*x.T), np.nan)
        found = np.where(np.isnan(found), here, found)
    inside = ~np.isnan(found)
    if not inside.any():
        raise InputError(f"{run.folder}: no body lies on the line.")
    return x[inside], share[inside] * np.linalg.norm(end - start), found[inside]


def _nodal(run: Run, fields: Fields, quantity: str, nodes: Any = ..., **more: Array) -> Array:
    """The quantity at ``nodes``, any shape: a nodal field, or one ``more`` that is known there."""
    known = fields.nodal_fields() | {
        "ux": fields.displacement[:, 0],
        "uy": fields.displacement[:, 1],
    }
    known = {name: values[nodes] for name, values in known.items()} | more
    if quantity not in known:
        why = (
            ""
            if fields.stress is not None
            else ' (the run was solved with output.fields = "cells")'
        )
        raise InputError(f"{run.folder}: has no {quantity!r} there, but {', '.join(known)}{why}.")
    return known[quantity]


def _driving(run: Run, step: int) -> tuple[float, str]:
    """The largest force of the loads at ``step``, per unit thickness, 0 if that is round-off; and
    its load's name."""
    names = {"P": "P"}
    if not run.is_joint:
        pulls = [
            load.name
            for load in run.scene.load
            if load.pressure is None and load.direction != "rotation"
        ]
        names = {name: f"{name} force" for name in pulls}
    forces = {by: run.columns[name] for by, name in names.items()}
    by = max(forces, key=lambda name: abs(forces[name][step - 1]), default="")
    force = forces.get(by, [0.0] * run.steps)
    counts = abs(force[step - 1]) > _NOTHING * max(map(abs, force))
    return force[step - 1] / run.scene.thickness if counts else 0.0, by


def _angle(x: Array, centre: Array) -> Array:
    return np.degrees(np.arctan2(*(x - centre).T[::-1]))


def _rising(angle: Array, begin: Array, end: Array) -> Array:
    """Angles in degrees, risen so far that none is before the arcs of facets from ``begin`` to
    ``end`` ``(k,)``, which start behind the largest gap between the facets, and at 0 on a whole
    circle."""
    order = np.argsort(begin % 360)
    gap = (begin[order] - np.roll(end[order], 1) + _GAP) % 360 - _GAP
    start = begin[order[gap.argmax()]] if gap.max() > _GAP else 0.0
    start = (start + _ROUND_OFF) % 360 - _ROUND_OFF
    return start + (angle - start + _ROUND_OFF) % 360 - _ROUND_OFF


def _along(fields: Fields, edge: str) -> tuple[np.ndarray, Array, float]:
    """Nodes ``(k, 3)`` along the facets of an ``edge``, piece by piece, with the body on the left,
    but on arcs counterclockwise; ``s`` ``(k, 3)`` of a `Probe` there, and the radius of an arc
    (else 0)."""
    from archord.geometry.curve import Curve, circle_through, in_pieces

    rows = fields.facets()
    rows = rows[np.isin(rows[:, 1], fields.edges[edge][:, 1])]
    rows = rows[np.unique(rows[:, 1], return_index=True)[1]]
    x, radius = fields.coordinates, 0.0
    height = x[rows[:, 0]] @ [1.0, 1e-3]
    if (circle := circle_through(x[np.unique(rows)])) is not None:
        centre, radius = circle
        begin, end = (_angle(x[rows[:, k]], centre) for k in (0, 2))
        if ((end - begin + 180) % 360 - 180).sum() < 0:
            rows, begin, end = rows[:, ::-1], end, begin
        height = _rising(begin, begin, end)
    if len(np.unique(rows[:, 0])) < len(rows):
        raise InputError(
            f"edge {edge!r}: branches, or lies within a body, so that nothing can be said along it."
        )
    order = in_pieces(rows[:, 0], rows[:, 2], height)
    s = Curve(x, 2, rows[order]).arc_length(np.array([0.0, 0.5, 1.0]))
    if radius:
        s += radius * np.radians(height[order])[:, None] - s[:, :1]
    return rows[order], s, radius


def _tangents(x: Array, rows: np.ndarray) -> tuple[Array, np.ndarray]:
    """Unit tangents ``(k, 3, 2)`` at the nodes ``x`` ``(k, 3, 2)`` of facets, where two meet
    without a corner their mean; and which facets ``(k,)`` are so followed by the next."""
    tangent = np.einsum("qa,fai->fqi", [[-3, 4, -1], [-1, 0, 1], [1, -4, 3]], x)
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    here, after = np.nonzero(rows[:, 2:] == rows[:, 0])
    smooth = (tangent[here, 2] * tangent[after, 0]).sum(axis=1) > _SMOOTH
    here, after = here[smooth], after[smooth]
    mean = tangent[here, 2] + tangent[after, 0]
    tangent[here, 2] = tangent[after, 0] = mean / np.linalg.norm(mean, axis=1)[:, None]
    return tangent, np.isin(np.arange(len(rows)), here[after == here + 1])

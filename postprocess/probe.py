"""A quantity along a named edge or a line of a run: its largest value, and where, and its factor over a section."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.material import Array
from archord.postprocess.arc import undeformed
from archord.postprocess.fields import Fields
from archord.scene.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from archord.geometry.curve import Curve
    from archord.postprocess.run import Run

CONTACT = {"pressure": "pressure", "facet_pressure": "pressure", "gap": "gap"}
Points = tuple[Array, Array, Array, Array | None]  # of a `Probe`: x, s, values, angle
_CLOSED = 0.999  # of a circle's length
_SMOOTH = 0.9  # cosine of the angle between facets without a corner
_NOTHING = 1e-9  # of the largest force of a run: round-off
_SAMPLES = 201  # on a line


@dataclass(frozen=True)
class Probe:
    """A ``quantity`` at ``n`` points of the edge or line ``place`` at a ``step``, in the scene's units.

    ``force`` is the largest of those that drive the run then, per unit thickness, that of the load ``by``.
    """

    place: str
    quantity: str
    unit: str
    step: int
    force: float
    by: str
    x: Array  # (n, 2) undeformed
    s: Array  # (n,) along each piece of the edge, the body on its left; of arcs the radius times the angle
    values: Array  # (n,)
    angle: Array | None = None  # (n,) of arcs: degrees about their centre, counterclockwise from the x axis

    @property
    def largest(self) -> int:
        """Number of the point with the largest value."""
        return int(np.argmax(self.values))

    def at(self, angle: float) -> float:
        """The value at an ``angle`` in degrees. Raises `InputError` if the edge has none there."""
        if self.angle is not None:
            off = (self.angle - angle + 180) % 360 - 180
            order = np.argsort(off)
            if np.abs(off).min() < 2 * np.median(np.diff(off[order])) + 1e-6:
                return float(np.interp(0.0, off[order], self.values[order]))
        raise InputError(f"{self.place}: has no point at {angle:g} degrees.")

    def over(self, length: float) -> Probe:
        """This over P / ``length``, the mean stress that the force makes in a section. Raises `InputError`."""
        if not (self.force and length > 0):
            raise InputError(
                f"{self.place}: has no factor over a section of {length:g} under a force of {self.force:g}."
            )
        return replace(self, quantity=f"{self.quantity}/(P/L)", unit="", values=self.values / (self.force / length))

    def frame(self) -> pd.DataFrame:
        """As a table."""
        from archord.postprocess.frames import frame_of

        columns = {"s": self.s, "angle": self.angle, "x": self.x[:, 0], "y": self.x[:, 1], self.quantity: self.values}
        known = {name: values for name, values in columns.items() if values is not None}
        return frame_of(known, {"angle": "°", self.quantity: self.unit})


def probe_edge(run: Run, edge: str, quantity: str, step: int) -> Probe:
    """A ``quantity`` at the nodes along an ``edge`` of the mesh: its "hoop", "normal" or "shear" stress, or one of
    `at_nodes`; or "pressure" or "gap" at the integration points of a surface, or "facet_pressure", the mean of each
    facet, which scatters less where bodies yield. Raises `InputError`."""
    along = _contact if quantity in CONTACT else _stress
    x, s, values, angle = along(run, edge, quantity, step)
    return Probe(edge, quantity, _unit(run, quantity), step, *_driving(run, step), x, s, values, angle)


def _contact(run: Run, edge: str, quantity: str, step: int) -> Points:
    from archord.geometry.curve import circle_through  # with bases, which most readers of runs do without

    arc = run.arc(step, edge)
    x, s, values = undeformed(arc, edge, run.scene), arc.s, getattr(arc, CONTACT[quantity])
    circle = circle_through(x.reshape(-1, 2))
    if quantity == "facet_pressure":
        share = arc.weight / arc.width[:, None]
        x, s, values = (np.einsum("fq,fq...->f...", share, array) for array in (x, s, values))
    x, s, values = x.reshape(-1, 2), s.ravel(), values.ravel()
    if circle is None:
        return x, s, values, None
    centre, radius = circle
    angle = np.degrees(np.arctan2(*(x - centre).T[::-1])) % 360
    if arc.width.sum() < _CLOSED * 2 * np.pi * radius:  # from the free end on
        rising = np.sort(angle)
        angle[angle < rising[np.argmax(np.diff(rising, prepend=rising[-1] - 360))]] += 360
    order = np.argsort(angle)
    return x[order], np.radians(angle[order]) * radius, values[order], angle[order]


def _stress(run: Run, edge: str, quantity: str, step: int) -> Points:
    from archord.geometry.curve import Curve

    fields = run.fields(step)
    edges = [name for name, facets in fields.edges.items() if len(facets)]
    if edge not in edges:
        raise InputError(f"{run.folder}: has no edge {edge!r}; its edges are {', '.join(edges) or 'none'}.")
    rows, begins, radius = _oriented(fields, edge)
    nodes, index = np.unique(rows, return_inverse=True)
    curve = Curve(fields.coordinates[nodes], 2, index.reshape(rows.shape))
    s, angle = curve.arc_length(np.array([0.0, 0.5, 1.0])), None
    if radius:
        first = np.maximum.accumulate(np.where(s[:, 0] == 0, np.arange(len(rows)), 0))  # facet of each piece
        angle = begins[first, None] + np.degrees(s / radius)
        s = np.radians(angle) * radius
    tangent, joined = _tangents(curve)
    values = {name: whole[rows] for name, whole in at_nodes(fields).items()}
    if fields.stress is not None:
        xx, yy, _, xy = np.moveaxis(fields.stress[rows], -1, 0)
        c, d = np.moveaxis(tangent, -1, 0)
        hoop = xx * c**2 + yy * d**2 + 2 * xy * c * d
        values |= {"hoop": hoop, "normal": xx + yy - hoop, "shear": (yy - xx) * c * d + xy * (c**2 - d**2)}
    shown = np.ones(rows.shape, dtype=bool)
    shown[:, 2] = ~joined
    x, value = fields.coordinates[rows], _one(values, quantity, run)
    return x[shown], s[shown], value[shown], None if angle is None else angle[shown]


def probe_line(run: Run, line: Sequence[float], quantity: str, step: int) -> Probe:
    """One of `at_nodes` on the straight ``line`` from (x0, y0) to (x1, y1) where it is in a body before it is loaded,
    linear between nodes. Raises `InputError`."""
    from matplotlib.tri import LinearTriInterpolator, Triangulation

    start, end, share = np.array(line[:2]), np.array(line[2:]), np.linspace(0, 1, _SAMPLES)
    fields, x = run.fields(step), start + share[:, None] * (end - start)
    found: Array = np.full(_SAMPLES, np.nan)
    values = _one(at_nodes(fields), quantity, run)
    for body in fields.bodies.values():
        triangles = Triangulation(*fields.coordinates.T, fields.triangles[fields.body == body].reshape(-1, 3))
        here = np.ma.filled(LinearTriInterpolator(triangles, values)(*x.T), np.nan)
        found = np.where(np.isnan(found), here, found)
    inside = ~np.isnan(found)
    if not inside.any():
        raise InputError(f"{run.folder}: no body lies on the line.")
    points = x[inside], share[inside] * np.linalg.norm(end - start), found[inside]
    return Probe("line", quantity, _unit(run, quantity), step, *_driving(run, step), *points)


def at_nodes(fields: Fields) -> dict[str, Array]:
    """What there is to probe: values ``(n,)`` at the nodes by name; stresses only where `output.stress` wrote them."""
    return fields.nodal_fields() | {"ux": fields.displacement[:, 0], "uy": fields.displacement[:, 1]}


def _one(known: dict[str, Array], quantity: str, run: Run) -> Array:
    if quantity not in known:
        why = "" if run.scene.output.stress else " (the run was solved with output.stress = false)"
        raise InputError(f"{run.folder}: has no {quantity!r} there, but {', '.join(known)}{why}.")
    return known[quantity]


def _unit(run: Run, quantity: str) -> str:
    if quantity in ("ux", "uy", "gap"):
        return run.scene.units.length
    if quantity.startswith(("peeq", "plastic")):
        return ""
    return "rad" if quantity == "principal_angle" else run.scene.units.stress


def _driving(run: Run, step: int) -> tuple[float, str]:
    """The largest force of the loads at ``step``, per unit thickness, 0 if that is round-off; and its load's name."""
    names = {"P": "P"}
    if not run.is_joint:
        pulls = [load.name for load in run.scene.load if load.pressure is None and load.direction != "rotation"]
        names = {name: f"{name} force" for name in pulls}
    forces = {by: np.array(run.columns[name]) for by, name in names.items()}
    by = max(forces, key=lambda name: abs(forces[name][step - 1]), default="")
    force = forces.get(by, np.zeros(run.steps))
    counts = abs(force[step - 1]) > _NOTHING * np.abs(force).max()
    return float(force[step - 1]) / run.scene.thickness if counts else 0.0, by


def _oriented(fields: Fields, edge: str) -> tuple[np.ndarray, Array, float]:
    """Nodes ``(k, 3)`` along the facets of an ``edge``, piece by piece, with the body on the left, but on arcs
    counterclockwise; of an arc also the angle ``(k,)`` at which each facet begins, and the radius (else 0)."""
    from archord.geometry.curve import circle_through, in_pieces

    rows = fields.facets()
    rows = rows[np.isin(rows[:, 1], fields.edges[edge][:, 1])]
    rows = rows[np.unique(rows[:, 1], return_index=True)[1]]
    x, radius = fields.coordinates, 0.0
    height = x[rows[:, 0]] @ [1.0, 1e-3]
    if (circle := circle_through(x[np.unique(rows)])) is not None:
        centre, radius = circle
        ray, along = x[rows[:, 1]] - centre, x[rows[:, 2]] - x[rows[:, 0]]
        if (ray[:, 0] * along[:, 1] - ray[:, 1] * along[:, 0]).sum() < 0:
            rows = rows[:, ::-1]
        height = (np.degrees(np.arctan2(*(x[rows[:, 0]] - centre).T[::-1])) + 1e-6) % 360 - 1e-6
    if len(np.unique(rows[:, 0])) < len(rows):
        raise InputError(f"edge {edge!r}: branches, or lies within a body, so that nothing can be said along it.")
    order = in_pieces(rows[:, 0], rows[:, 2], height)
    return rows[order], height[order], radius


def _tangents(curve: Curve) -> tuple[Array, np.ndarray]:
    """Unit tangents ``(n, 3, 2)`` at both ends and the middle of each facet, those of two facets that meet without a
    corner their mean; and which facets ``(n,)`` are so followed by the next."""
    _, slopes = curve.shapes(np.array([0.0, 0.5, 1.0]))
    tangent = np.einsum("qa,fai->fqi", slopes, curve.X[curve.connectivity])
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    here = np.flatnonzero(curve.after >= 0)
    here = here[(tangent[here, 2] * tangent[curve.after[here], 0]).sum(axis=1) > _SMOOTH]
    mean = tangent[here, 2] + tangent[curve.after[here], 0]
    tangent[here, 2] = tangent[curve.after[here], 0] = mean / np.linalg.norm(mean, axis=1)[:, None]
    joined = np.zeros(len(tangent), dtype=bool)
    joined[here] = curve.after[here] == here + 1
    return tangent, joined

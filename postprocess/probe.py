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
_ROUND = 1e-3  # of the radius, by which nodes may miss the circle of an arc
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
    head = (edge, quantity, _unit(run, quantity), step, *_driving(run, step))
    if quantity in CONTACT:
        return Probe(*head, *_contact(run, edge, quantity, step))
    from archord.geometry.curve import Curve  # with bases, which most readers of runs do without

    fields = run.fields(step)
    edges = [name for name, facets in fields.edges.items() if len(facets)]
    if edge not in edges:
        raise InputError(f"{run.folder}: has no edge {edge!r}; its edges are {', '.join(edges) or 'none'}.")
    rows, begins, radius = _oriented(fields, edge)
    nodes, index = np.unique(rows, return_inverse=True)
    curve = Curve(fields.coordinates[nodes], 2, index.reshape(rows.shape))
    s = curve.arc_length(np.array([0.0, 0.5, 1.0]))
    first = np.maximum.accumulate(np.where(s[:, 0] == 0, np.arange(len(rows)), 0))  # facet of each piece
    angle = begins[first, None] + np.degrees(s / radius)
    s = s if radius == np.inf else np.radians(angle) * radius
    tangent, joined = _tangents(curve)
    values = {name: whole[rows] for name, whole in at_nodes(fields).items()}
    if fields.stress is not None:
        xx, yy, _, xy = np.moveaxis(fields.stress[rows], -1, 0)
        c, d = np.moveaxis(tangent, -1, 0)
        hoop = xx * c**2 + yy * d**2 + 2 * xy * c * d
        values |= {"hoop": hoop, "normal": xx + yy - hoop, "shear": (yy - xx) * c * d + xy * (c**2 - d**2)}
    shown = np.ones(rows.shape, dtype=bool)
    shown[:, 2] = ~joined
    at = (fields.coordinates[rows], s, _one(values, quantity, run), *([angle] if radius < np.inf else []))
    return Probe(*head, *(array[shown] for array in at))


def _contact(run: Run, edge: str, quantity: str, step: int) -> tuple[Array, Array, Array, Array | None]:
    """Places, arc lengths, values and angles of the points of a surface, or of the means of its facets."""
    arc = run.arc(step, edge)
    x, s, values, share = undeformed(arc, edge, run.scene), arc.s, getattr(arc, CONTACT[quantity]), arc.weight
    circle = _circle(x.reshape(-1, 2))
    if quantity == "facet_pressure":
        share = share / arc.width[:, None]
        x, s, values = (np.einsum("fq,fq...->f...", share, array) for array in (x, s, values))
    x, s, values = x.reshape(-1, 2), s.ravel(), values.ravel()
    if circle is None:
        return x, s, values, None
    angle = np.degrees(np.arctan2(*(x - circle[0]).T[::-1])) % 360
    if arc.width.sum() < 2 * np.pi * circle[1] * (1 - _ROUND):  # not all around: from its free end on
        rising = np.sort(angle)
        angle[angle < rising[np.argmax(np.diff(rising, prepend=rising[-1] - 360))]] += 360
    order = np.argsort(angle)
    return x[order], np.radians(angle[order]) * circle[1], values[order], angle[order]


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
    s = share * np.linalg.norm(end - start)
    return Probe(
        "line", quantity, _unit(run, quantity), step, *_driving(run, step), x[inside], s[inside], found[inside]
    )


def at_nodes(fields: Fields) -> dict[str, Array]:
    """What there is to probe: values ``(n,)`` at the nodes by name; stresses only where `output.stress` wrote them."""
    return fields.nodal_fields() | {"ux": fields.displacement[:, 0], "uy": fields.displacement[:, 1]}


def _one(known: dict[str, Array], quantity: str, run: Run) -> Array:
    if quantity not in known:
        why = "" if run.scene.output.stress else " (the run was solved with output.stress = false)"
        raise InputError(f"{run.folder}: has no {quantity!r} there, but {', '.join(known)}{why}.")
    return known[quantity]


def _unit(run: Run, quantity: str) -> str:
    units = {"ux": run.scene.units.length, "uy": run.scene.units.length, "gap": run.scene.units.length}
    none = quantity.startswith(("p", "plastic")) and quantity not in ("p1", "p2", "p3", "pressure")
    return units.get(quantity, "rad" if quantity == "principal_angle" else "" if none else run.scene.units.stress)


def _driving(run: Run, step: int) -> tuple[float, str]:
    """The largest force of the loads at ``step``, per unit thickness, and the name of its load."""
    names = {"P": "P"}
    if not run.is_joint:
        pulls = [load.name for load in run.scene.load if load.pressure is None and load.direction != "rotation"]
        names = {name: f"{name} force" for name in pulls}
    forces = {by: np.array(run.columns[name]) for by, name in names.items()}
    by = max(forces, key=lambda name: abs(forces[name][step - 1]), default="")
    if not by or abs(forces[by][step - 1]) < _NOTHING * np.abs(forces[by]).max():
        return 0.0, by
    return float(forces[by][step - 1]) / run.scene.thickness, by


def _oriented(fields: Fields, edge: str) -> tuple[np.ndarray, Array, float]:
    """Nodes ``(k, 3)`` along the facets of an ``edge``, piece by piece, with the body on the left, but on arcs
    counterclockwise; of an arc also the angle ``(k,)`` at which each facet begins, and the radius (else inf)."""
    rows = fields.facets()
    rows = rows[np.isin(rows[:, 1], fields.edges[edge][:, 1])]
    rows = rows[np.unique(rows[:, 1], return_index=True)[1]]
    x, radius = fields.coordinates, np.inf
    height = x[rows[:, 0]] @ [1.0, 1e-3]
    if (circle := _circle(x[np.unique(rows)])) is not None:
        centre, radius = circle
        ray, along = x[rows[:, 1]] - centre, x[rows[:, 2]] - x[rows[:, 0]]
        if (ray[:, 0] * along[:, 1] - ray[:, 1] * along[:, 0]).sum() < 0:
            rows = rows[:, ::-1]
        height = (np.degrees(np.arctan2(*(x[rows[:, 0]] - centre).T[::-1])) + 1e-6) % 360 - 1e-6
    if len(np.unique(rows[:, 0])) < len(rows):
        raise InputError(f"edge {edge!r}: branches, or lies within a body, so that nothing can be said along it.")
    from archord.geometry.curve import in_pieces

    order = in_pieces(rows[:, 0], rows[:, 2], height)
    return rows[order], height[order], radius


def _tangents(curve: Curve) -> tuple[Array, np.ndarray]:
    """Unit tangents ``(n, 3, 2)`` at both ends and the middle of each facet, those of two facets that meet without a
    corner their mean; and which facets ``(n,)`` are so followed by the next."""
    _, slopes = curve.shapes(np.array([0.0, 0.5, 1.0]))
    tangent = np.einsum("qa,fai->fqi", slopes, curve.X[curve.connectivity])
    tangent /= np.linalg.norm(tangent, axis=-1, keepdims=True)
    here = np.flatnonzero(curve.after >= 0)
    smooth = (tangent[here, 2] * tangent[curve.after[here], 0]).sum(axis=1) > _SMOOTH
    here = here[smooth]
    mean = tangent[here, 2] + tangent[curve.after[here], 0]
    tangent[here, 2] = tangent[curve.after[here], 0] = mean / np.linalg.norm(mean, axis=1)[:, None]
    joined = np.zeros(len(tangent), dtype=bool)
    joined[here] = curve.after[here] == here + 1
    return tangent, joined


def _circle(x: Array) -> tuple[Array, float] | None:
    """Centre and radius of the circle through points ``x`` ``(n, 2)``; None if they lie on none."""
    middle, size = x.mean(axis=0), np.ptp(x, axis=0).max()
    y = (x - middle) / size
    if np.linalg.svd(y, compute_uv=False)[-1] < _ROUND * np.sqrt(len(y)):  # straight
        return None
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2 * y, np.ones(len(y))]), (y**2).sum(axis=1), rcond=None)
    radius = np.sqrt(c + a**2 + b**2)
    if np.abs(np.hypot(*(y - [a, b]).T) - radius).max() > _ROUND * radius:
        return None
    return middle + size * np.array([a, b]), size * radius

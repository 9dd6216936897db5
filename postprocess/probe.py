"""A quantity along a named edge or a line of a run: its largest and smallest value, and where, and
its factor over a section."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from archord.geometry.vectors import unit
from archord.materials.kinematics import AXISYMMETRIC, Kinematics, kinematics
from archord.materials.material import Array
from archord.output.cell_fields import row_of
from archord.postprocess.arc import undeformed
from archord.postprocess.fields import Fields
from archord.postprocess.probe_in_space import located, meeting
from archord.presets.views import ProblemView
from archord.report.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_CONTACT = {
    "pressure": "pressure",
    "facet_pressure": "pressure",
    "gap": "gap",
    "contact_shear": "shear",
}
_OF_LENGTH = ("ux", "uy", "uz", "gap")
_OF_STRESS = (*_CONTACT, "hoop", "along", "normal", "shear", "p1", "p2", "p3")
_PER = {"axisymmetric": "on the whole ring", "space": "on the whole"}
_PER |= dict.fromkeys(("strain", "stress"), "per unit thickness")
_GAP = 0.3  # degrees: the least gap in a circle
_SMOOTH = 0.9  # cosine of the angle between facets without a corner
_ROUND_OFF = 1e-6  # degrees
_NOTHING = 1e-9  # of the largest force of a run: round-off
_SAMPLES = 201  # on a line


@dataclass(frozen=True)
class Probe:
    """A quantity at ``n`` points of an edge or a line at a step, in the scene's units.

    `archord.Run.probe` makes it.

    Attributes
    ----------
    place : str
        The name of the edge, or "line".
    quantity, unit : str
        The quantity and its unit.
    step : int
        The step, from 1.
    force : float
        The largest force that drives the run at the step, per unit thickness.
    by : str
        The load that exerts it.
    x : array (n, d)
        The undeformed points.
    s : array (n,)
        How far along its piece of the edge a point is, with the body on the left; on arcs the
        radius times the angle.
    values : array (n,)
        The values.
    length : str
        The unit of ``x`` and ``s``.
    angle : array (n,)
        On arcs the degrees about their centre, counterclockwise from the x axis; else None.
    axes : tuple of str
        The names of the coordinates.
    per : str
        What the force is of.

    Examples
    --------
    >>> import archord
    >>> joint = {"radius": 10.0, "clearance": 0.1, "relative_element_size": 0.2}
    >>> steel = {"E": 210e3, "nu": 0.3}
    >>> load = {"displacement": 0.5, "steps": 1}
    >>> scene = archord.Scene(joint=joint, pin=steel, block=steel, load=load)
    >>> run = archord.solve(scene, "runs/doctest", force=True)
    >>> probe = run.probe("hole", "pressure")
    >>> probe.unit
    'MPa'
    >>> print(f"{probe.values[probe.largest]:.0f}")
    529
    """

    place: str
    quantity: str
    unit: str
    step: int
    force: float
    by: str
    x: Array  # (n, d) undeformed
    # (n,) along each piece of the edge, the body on its left; of arcs the radius times the angle
    s: Array
    values: Array  # (n,)
    length: str = ""  # the unit of x and s
    # (n,) of arcs: degrees about their centre, counterclockwise from the x axis
    angle: Array | None = None
    axes: tuple[str, ...] = ("x", "y")
    per: str = "per unit thickness"  # what the force is of

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
        place = [f"{axis} = {x:.6g}" for axis, x in zip(self.axes, self.x[k], strict=True)]
        return f"at {along}, {', '.join(place)}"

    def at(self, angle: float) -> float:
        """The value at an ``angle`` in degrees. Raises `InputError` if the edge has none there."""
        if self.angle is not None:
            off = (self.angle - angle + 180) % 360 - 180
            order = np.argsort(off)
            spacing = np.median(np.diff(off[order]))
            if np.abs(off).min() < 2 * spacing + _ROUND_OFF:
                return float(np.interp(0.0, off[order], self.values[order]))
        raise InputError(f"{self.place}: has no point at {angle:g} degrees.")

    def over(self, length: float) -> Probe:
        """This over P / ``length``, the mean stress that the force makes in a section. Raises
        `InputError`, also for a body of revolution, whose force is of the whole ring."""
        if self.axes == AXISYMMETRIC.axes:
            raise InputError(
                f"{self.place}: has no factor over a length, as the force of a body of revolution "
                "is of the whole ring; divide by the mean stress of the section's area."
            )
        if not (self.force and length > 0):
            section = f"a section of {length:g} under a force of {self.force:g}"
            raise InputError(f"{self.place}: has no factor over {section}.")
        values = self.values / (self.force / length)
        return replace(self, quantity=f"{self.quantity}/(P/L)", unit="", values=values)

    def frame(self) -> pd.DataFrame:
        """As a table."""
        from archord.postprocess.frames import frame_of

        columns = {"s": self.s}
        if self.angle is not None:
            columns["angle"] = self.angle
        columns |= dict(zip(self.axes, self.x.T, strict=True))
        columns[self.quantity] = self.values
        return frame_of(columns, {"angle": "°", self.quantity: self.unit})


class Probed(Protocol):
    """What is asked of a run."""

    folder: Path
    scene: Any
    view: ProblemView
    columns: dict[str, list[float]]
    steps: int

    @property
    def kinematics(self) -> Kinematics:
        """See `Run.kinematics`."""

    def fields(self, step: int | None = None) -> Fields:
        """See `Run.fields`."""

    def arc(self, step: int | None = None, side: str | None = None) -> Any:
        """See `Run.arc`."""


class _Along(NamedTuple):
    """Values along an edge or a line: the arrays of a `Probe` with the same names."""

    x: Array
    s: Array
    values: Array
    angle: Array | None = None


def probe(run: Probed, edge: str, quantity: str, step: int, line: Sequence[float]) -> Probe:
    """A ``quantity`` along an ``edge`` of the mesh or the straight ``line`` x0, y0, x1, y1, in
    space x0, y0, z0, x1, y1, z1. Raises `InputError`.

    At the nodes of an edge its "hoop" (the default), "normal" or "shear" stress, or a nodal field:
    "hoop" is the stress along the edge; around an axis it is the stress round the axis, and the
    stress along the edge is "along";
    at the integration points of a surface "pressure", "gap" or, with friction, "contact_shear", or
    "facet_pressure", the mean of each facet, which scatters less where bodies yield. On a line a
    nodal field (von Mises stress), linear between nodes, or else a field of the cells. In space an
    edge is "A & B", where two surfaces meet; it has "hoop" and nodal fields, and nodal fields are
    quadratic between nodes.
    """
    if bool(edge) == bool(line):
        raise InputError("probe: give an edge or a line.")
    kind = kinematics(run.scene.analysis.plane)
    if line:
        quantity = quantity or "von_mises"
        found = _inside(run, line, quantity, step)
    elif quantity in _CONTACT:
        found = _contact(run, edge, quantity, step)
    else:
        quantity = quantity or "hoop"
        found = _stress(run, edge, quantity, step)
    force, by = _driving(run, step)
    return Probe(
        place=edge or "line",
        quantity=quantity,
        unit=_unit_of(quantity, run.scene.units),
        step=step,
        force=force,
        by=by,
        length=run.scene.units.length,
        axes=kind.axes,
        per=_PER[kind.name],
        **found._asdict(),
    )


def _unit_of(quantity: str, units: Any) -> str:
    if quantity == "principal_angle":
        return "rad"
    if quantity in _OF_LENGTH:
        return str(units.length)
    row = row_of(quantity)
    if quantity in _OF_STRESS or (row and row.unit == "{stress}"):
        return str(units.stress)
    return ""


def _contact(run: Probed, edge: str, quantity: str, step: int) -> _Along:
    """Values at the integration points of a surface, or means of its facets."""
    # with bases, which most readers of runs do without
    from archord.geometry.curve import circle_through

    if run.kinematics.dimension == 3:
        raise InputError(
            f"{run.folder}: the {quantity} of a surface in space is no curve; Run.unrolled and "
            "Run.contact have it, and archord export --csv."
        )
    arc = run.arc(step, edge)
    at_points = getattr(arc, _CONTACT[quantity])
    if at_points is None:
        raise InputError(f"{run.folder}: has no {quantity}, as its contacts have no friction.")
    x = undeformed(arc, edge, run.scene)
    circle = circle_through(x.reshape(-1, 2))
    share = arc.weight / arc.width[:, None]
    means = _Along(*(np.einsum("fq,fq...->f...", share, v) for v in (x, arc.s, at_points)))
    if quantity == "facet_pressure":
        found = means
    else:
        found = _Along(x.reshape(-1, 2), arc.s.ravel(), at_points.ravel())
    if circle is None:
        return found
    centre, radius = circle
    lengths = arc.weight / kinematics(run.scene.analysis.plane).measure(x)  # the weights of areas
    length = lengths.sum(axis=1)
    middle = _angle(np.einsum("fq,fqi->fi", lengths / length[:, None], x), centre)
    half = np.degrees(length / (2 * radius))
    angle = _rising(_angle(found.x, centre), middle - half, middle + half)
    angle -= 360 * np.floor(angle.min() / 360)
    order = np.argsort(angle)
    angle = angle[order]
    return _Along(found.x[order], np.radians(angle) * radius, found.values[order], angle)


def _stress(run: Probed, edge: str, quantity: str, step: int) -> _Along:
    """Values at the nodes of an edge, with the stress along it and across."""
    fields = run.fields(step)
    if run.kinematics.dimension == 3:
        return _at_meeting(run, fields, edge, quantity)
    edges = [name for name, facets in fields.edges.items() if len(facets)]
    if edge not in edges:
        known = ", ".join(edges) or "none"
        raise InputError(f"{run.folder}: has no edge {edge!r}; its edges are {known}.")
    nodes, s, radius = _along(fields, edge)
    tangent, joined = _tangents(fields.coordinates[nodes], nodes)
    stresses = {}
    if fields.stress is not None:
        xx, yy, across, xy = np.moveaxis(fields.stress[nodes], -1, 0)
        c, d = np.moveaxis(tangent, -1, 0)
        along = xx * c**2 + yy * d**2 + 2 * xy * c * d
        shear = (yy - xx) * c * d + xy * (c**2 - d**2)
        stresses = {"hoop": along, "normal": xx + yy - along, "shear": shear}
        if kinematics(run.scene.analysis.plane).has_hoop:
            stresses |= {"along": along, "hoop": across}
    shown = np.ones(nodes.shape, dtype=bool)
    shown[:, 2] = ~joined
    values = _nodal(run, fields, quantity, nodes, **stresses)
    angle = np.degrees(s[shown] / radius) if radius else None
    return _Along(fields.coordinates[nodes][shown], s[shown], values[shown], angle)


def _at_meeting(run: Probed, fields: Fields, edge: str, quantity: str) -> _Along:
    """Values at the nodes where two surfaces in space meet, with the stress along the edge."""
    from archord.geometry.curve import Curve

    nodes = meeting(fields, edge)
    s = Curve(fields.coordinates, 2, nodes).arc_length(np.array([0.0, 0.5, 1.0]))
    tangent, joined = _tangents(fields.coordinates[nodes], nodes)
    stresses = {}
    if fields.stress is not None:
        xx, yy, zz, xy, yz, zx = np.moveaxis(fields.stress[nodes], -1, 0)
        a, b, c = np.moveaxis(tangent, -1, 0)
        normal = xx * a**2 + yy * b**2 + zz * c**2
        stresses["hoop"] = normal + 2 * (xy * a * b + yz * b * c + zx * c * a)
    shown = np.ones(nodes.shape, dtype=bool)
    shown[:, 2] = ~joined
    values = _nodal(run, fields, quantity, nodes, **stresses)
    return _Along(fields.coordinates[nodes][shown], s[shown], values[shown])


def _inside(run: Probed, line: Sequence[float], quantity: str, step: int) -> _Along:
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
        found = _between_nodes(fields, x, _nodal(run, fields, quantity))
    else:
        found = _of_cells(fields, x, of_cells)
    inside = ~np.isnan(found)
    if not inside.any():
        raise InputError(f"{run.folder}: no body lies on the line.")
    return _Along(x[inside], share[inside] * np.linalg.norm(end - start), found[inside])


def _in_cells(
    run: Probed, fields: Fields, x: Array, quantity: str, of_cells: Array | None
) -> Array:
    """The quantity at ``x`` ``(k, 3)``, from values ``of_cells`` or from the nodes, NaN outside the
    bodies."""
    cell, nodes, weights = located(fields, x)
    if of_cells is not None:
        values = of_cells[cell]
    else:
        values = np.einsum("ka,ka->k", weights, _nodal(run, fields, quantity, nodes))
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


def _nodal(run: Probed, fields: Fields, quantity: str, nodes: Any = ..., **more: Array) -> Array:
    """The quantity at ``nodes``, any shape: a nodal field, or one ``more`` that is known there."""
    known = fields.nodal_fields()
    for axis in range(fields.displacement.shape[1]):
        known[f"u{'xyz'[axis]}"] = fields.displacement[:, axis]
    known = {name: values[nodes] for name, values in known.items()} | more
    if quantity in known:
        return known[quantity]
    why = ""
    if fields.stress is None:
        why = ' (the run was solved with output.fields = "cells")'
    raise InputError(f"{run.folder}: has no {quantity!r} there, but {', '.join(known)}{why}.")


def _driving(run: Probed, step: int) -> tuple[float, str]:
    """The largest force of the loads at ``step``, per unit thickness, 0 if that is round-off; and
    its load's name."""
    forces = {by: run.columns[column] for by, column in run.view.pulls.items()}
    if not forces:
        return 0.0, ""
    by = max(forces, key=lambda name: abs(forces[name][step - 1]))
    force = forces[by][step - 1]
    largest = max(map(abs, forces[by]))
    if abs(force) <= _NOTHING * largest:
        return 0.0, by
    return force / run.scene.thickness, by


def _angle(x: Array, centre: Array) -> Array:
    """Angles in degrees from the x axis, of points ``(n, 2)`` about the ``centre``."""
    along, up = (x - centre).T
    return np.degrees(np.arctan2(up, along))


def _rising(angle: Array, begin: Array, end: Array) -> Array:
    """Angles in degrees, risen so far that none is before the arcs of facets from ``begin`` to
    ``end`` ``(k,)``, which start behind the largest gap between the facets, and at 0 on a whole
    circle."""
    order = np.argsort(begin % 360)
    before = np.roll(end[order], 1)
    gap = (begin[order] - before + _GAP) % 360 - _GAP
    start = begin[order[gap.argmax()]] if gap.max() > _GAP else 0.0
    start = (start + _ROUND_OFF) % 360 - _ROUND_OFF
    return start + (angle - start + _ROUND_OFF) % 360 - _ROUND_OFF


def _along(fields: Fields, edge: str) -> tuple[np.ndarray, Array, float]:
    """Nodes ``(k, 3)`` along the facets of an ``edge``, piece by piece, with the body on the left,
    but on arcs counterclockwise; ``s`` ``(k, 3)`` of a `Probe` there, and the radius of an arc
    (else 0)."""
    from archord.geometry.curve import Curve, circle_through, in_pieces

    x = fields.coordinates
    nodes = fields.facets()
    nodes = nodes[np.isin(nodes[:, 1], fields.edges[edge][:, 1])]
    nodes = nodes[np.unique(nodes[:, 1], return_index=True)[1]]
    height = x[nodes[:, 0]] @ [1.0, 1e-3]
    radius = 0.0
    circle = circle_through(x[np.unique(nodes)])
    if circle is not None:
        centre, radius = circle
        begin = _angle(x[nodes[:, 0]], centre)
        end = _angle(x[nodes[:, 2]], centre)
        turned = (end - begin + 180) % 360 - 180
        if turned.sum() < 0:
            nodes = nodes[:, ::-1]
            begin, end = end, begin
        height = _rising(begin, begin, end)
    if len(np.unique(nodes[:, 0])) < len(nodes):
        raise InputError(
            f"edge {edge!r}: branches, or lies within a body, so that nothing can be said along it."
        )
    order = in_pieces(nodes[:, 0], nodes[:, 2], height)
    s = Curve(x, 2, nodes[order]).arc_length(np.array([0.0, 0.5, 1.0]))
    if radius:
        s += radius * np.radians(height[order])[:, None] - s[:, :1]
    return nodes[order], s, radius


def _tangents(x: Array, nodes: np.ndarray) -> tuple[Array, np.ndarray]:
    """Unit tangents ``(k, 3, 2)`` at the nodes ``x`` ``(k, 3, 2)`` of facets, where two meet
    without a corner their mean; and which facets ``(k,)`` are so followed by the next."""
    by_ends = [[-3, 4, -1], [-1, 0, 1], [1, -4, 3]]  # of the parabola, at its nodes
    tangent = unit(np.einsum("qa,fai->fqi", by_ends, x))
    here, after = np.nonzero(nodes[:, 2:] == nodes[:, 0])
    smooth = (tangent[here, 2] * tangent[after, 0]).sum(axis=1) > _SMOOTH
    here = here[smooth]
    after = after[smooth]
    mean = unit(tangent[here, 2] + tangent[after, 0])
    tangent[here, 2] = mean
    tangent[after, 0] = mean
    return tangent, np.isin(np.arange(len(nodes)), here[after == here + 1])

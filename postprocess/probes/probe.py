"""A quantity along an edge or a line of a run: its largest and smallest value, and where, and its
factor over a section."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.kinematics import PLANE_STRAIN, SPACE
from archord.materials.material import Array
from archord.report.by_name import Names
from archord.report.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_ROUND_OFF = 1e-6  # degrees
_SAME = 1e-6  # relative difference of forces that are the same


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
    pulls : dict
        The forces of all loads that are resultants, by the loads' names.

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
    axes: Names = ("x", "y")
    per: str = "per unit thickness"  # what the force is of
    pulls: Mapping[str, float] = field(default_factory=dict)  # by loads, as the force

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
                values = self.values[order]
                if self.unit == "rad":  # an angle of stress, which jumps by half a turn
                    values = np.unwrap(values, period=np.pi)
                    between = float(np.interp(0.0, off[order], values))
                    return (between + np.pi / 2) % np.pi - np.pi / 2
                return float(np.interp(0.0, off[order], values))
        raise InputError(self.place, f"has no point at {angle:g} degrees.")

    def over(self, length: float, of: str = "") -> Probe:
        """This over P / ``length``, the mean stress that the force P makes in a section: the force
        of the load ``of``, which may be left out where all forces are of one size. Raises
        `InputError`, also for a body of revolution, whose force is of the whole ring, and in space,
        where the force is not per unit thickness."""
        if self.axes != PLANE_STRAIN.axes:
            whole = "a body of revolution is of the whole ring"
            if self.axes == SPACE.axes:
                whole = "a body in space is not per unit thickness"
            raise InputError(
                self.place,
                f"has no factor over a length, as the force of {whole}; "
                "divide by the mean stress of the section's area.",
            )
        force, by = self._chosen(of)
        if not (force and 0 < length < np.inf):
            section = f"a section of {length:g} under a force of {force:g}"
            raise InputError(self.place, f"has no factor over {section}.")
        return replace(
            self,
            quantity=f"{self.quantity}/(P/L)",
            unit="",
            values=self.values / (force / length),
            force=force,
            by=by,
        )

    def _chosen(self, of: str) -> tuple[float, str]:
        """The force of the load ``of``, or the only one, and its load. Raises `InputError`."""
        if of and of not in self.pulls:
            known = ", ".join(self.pulls) or "none"
            raise InputError(f"--of {of}: must be a load with a force; this run has {known}.")
        if of:
            return self.pulls[of], of
        pulling = {name: force for name, force in self.pulls.items() if force}
        largest = abs(self.force)
        if any(largest - abs(force) > _SAME * largest for force in pulling.values()):
            told = ", ".join(f"{name} {force:.6g}" for name, force in pulling.items())
            raise InputError(
                self.place,
                f"has no factor over a length without a load to choose: the forces "
                f"are {told}; name one by --of.",
            )
        return self.force, self.by

    def frame(self) -> pd.DataFrame:
        """As a table."""
        from archord.postprocess.arrays.frames import frame_of

        columns = {"s": self.s}
        if self.angle is not None:
            columns["angle"] = self.angle
        columns |= dict(zip(self.axes, self.x.T, strict=True))
        columns[self.quantity] = self.values
        return frame_of(columns, {"angle": "°", self.quantity: self.unit})

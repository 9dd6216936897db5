"""What presets in space tell beside the measures of their parts: the pressure on the load axis at
the middle and at the rim of each hole, how far contact reaches, and how the pin of a clevis bends.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.measures.measure import Accepted, Measure
from archord.scene.problem import ProblemScene

_STRIP = 0.1  # width over R of the strips across the load axis, beside the middle and the rim
_PEAK_FRACTION = 0.4  # part of the contact angle over which the parabola of the peak is fitted
_LEAST = 0.1  # rad, of the same angle
_SHEAR_FACTOR = 0.9  # of a round beam (Cowper 1966)


@dataclass(frozen=True)
class Bearing:
    """A pin in a hole, in the words of the scene.

    - ``contact``: the name of the interaction
    - ``radius``: of the pin
    - ``centre``: of the hole ``(x, y)``
    - ``axis``: the direction ``(x, y)`` from the centre in which the pin presses
    - ``span``: the angle to which the hole is modelled on one side of the axis
    - ``middle``, ``rim``: heights z where pressures are told
    """

    contact: str
    radius: float
    centre: tuple[float, float]
    axis: tuple[float, float]
    span: float
    middle: float
    rim: float

    def angle(self, X: Array) -> Array:
        """The angle of points ``(n, q, 3)`` from the load axis, whichever way."""
        to = X[..., :2] - self.centre
        along = to @ np.array(self.axis)
        across = to @ np.array([-self.axis[1], self.axis[0]])
        return np.abs(np.arctan2(across, along))

    def strip(self, X: Array, height: float) -> np.ndarray:
        """Whether points are in the strip at a ``height``."""
        return np.abs(X[..., 2] - height) <= _STRIP * self.radius

    def semi_angle(self, state: Accepted) -> float:
        """The angle from the load axis to which the hole bears, at its middle."""
        hole = state.met[self.contact][-1]
        weight = np.where(self.strip(hole.X, self.middle), hole.weight, 0.0)
        bearing = weight[hole.raw_pressure > 0].sum()
        return float(self.span * bearing / weight.sum())

    def pressure(self, state: Accepted, height: float) -> float:
        """The pressure on the load axis in the strip at a ``height``, by an even parabola around
        it."""
        eps = state.once(f"{self.contact} eps", lambda: self.semi_angle(state))
        reach = max(_PEAK_FRACTION * eps, _LEAST)
        angles = []
        pressures = []
        weights = []
        for profile in state.met[self.contact]:
            angle = self.angle(profile.X)
            near = self.strip(profile.X, height) & (angle <= reach)
            angles.append(angle[near])
            pressures.append(profile.pressure[near])
            weights.append(profile.weight[near])
        square = np.concatenate(angles) ** 2
        w = np.sqrt(np.concatenate(weights))
        parabola = np.stack([w, w * square], axis=1)
        peak, _ = np.linalg.lstsq(parabola, w * np.concatenate(pressures), rcond=None)[0]
        return max(float(peak), 0.0)


def solid_measures(scene: ProblemScene) -> Iterator[Measure]:
    """The measures of the preset in space whose shape the ``scene`` has; none of other scenes."""
    shape: Any = scene.mesh.shape
    if shape is None or shape.space is None:
        return
    stress = scene.units.stress
    if shape.kind == "joint":
        yield from _joint_measures(scene, shape)
        return
    for bearing in _bearings(shape, [part.name for part in scene.interaction]):
        name = bearing.contact
        yield Measure(f"{name} mid pressure", stress, partial(_pressure, bearing, bearing.middle))
        yield Measure(f"{name} rim pressure", stress, partial(_pressure, bearing, bearing.rim))
        yield Measure(f"{name} eps", "rad", bearing.semi_angle)
    if shape.kind == "clevis":
        yield from _bending_measures(scene, shape)


def _pressure(bearing: Bearing, height: float, state: Accepted) -> float:
    return bearing.pressure(state, height)


def _joint_measures(scene: ProblemScene, shape: Any) -> Iterator[Measure]:
    """The measures of the paper's joint: the pin is pressed along -y."""
    units = scene.units
    contact = scene.interaction[0].name
    load = scene.load[0].name
    top = shape.space.thickness / 2
    bearing = Bearing(contact, shape.radius, (0.0, 0.0), (0.0, -1.0), math.pi / 2, 0.0, top)
    yield Measure("delta", units.length, lambda state: -state.driven[load][0])
    yield Measure("P", units.force_of(1.0), lambda state: -state.driven[load][1])
    yield Measure("p0", units.stress, partial(_pressure, bearing, 0.0))
    yield Measure("rim pressure", units.stress, partial(_pressure, bearing, top))
    yield Measure("eps", "rad", bearing.semi_angle)


def _bearings(shape: Any, contacts: list[str]) -> Iterator[Bearing]:
    """The bearings of a lug, a bushing or a clevis, whose pin is in the hole of ``contacts``."""
    R = shape.radius
    pinned = [name for name in contacts if name.startswith("pin in ")]
    if shape.kind != "clevis":
        top = shape.space.thickness / 2
        yield Bearing(pinned[0], R, (0.0, 0.0), (1.0, 0.0), math.pi, 0.0, top)
        return
    inside, bottom, top = _heights(shape)
    yield Bearing(pinned[0], R, (0.0, 0.0), (1.0, 0.0), math.pi, 0.0, inside)
    at = (2 * shape.clearance, 0.0)
    yield Bearing(pinned[1], R, at, (-1.0, 0.0), math.pi, (bottom + top) / 2, bottom)


def _heights(shape: Any) -> tuple[float, float, float]:
    """Where the inner plate of a clevis ends, and where the outer one begins and ends."""
    inside = shape.inner.thickness / 2
    bottom = inside + shape.space.gap
    return inside, bottom, bottom + shape.outer.thickness


def _bending_measures(scene: ProblemScene, shape: Any) -> Iterator[Measure]:
    """How the pin of a clevis bends, beside a beam.

    By hand the plates press evenly: the moment is P/2 (t_inner/4 + gap + t_outer/2) (Bruhn 1973,
    chapter D1). The beam rests on the middles of the outer plates; shear adds M/(k G A).
    """
    inside, bottom, top = _heights(shape)
    pin = next(body for body in scene.body if body.name == "pin")
    inner, outer = (
        bearing.contact for bearing in _bearings(shape, [p.name for p in scene.interaction])
    )
    R = shape.radius
    bore = shape.space.bore
    span = bottom + top  # between the middles of the outer plates
    loaded = 2 * inside
    arm = inside / 2 + shape.space.gap + (top - bottom) / 2
    inertia = math.pi * (R**4 - bore**4) / 4
    area = math.pi * (R**2 - bore**2)
    shear_modulus = pin.E / (2 * (1 + pin.nu))
    bent = (8 * span**3 - 4 * span * loaded**2 + loaded**3) / (384 * pin.E * inertia)
    sheared = arm / (2 * _SHEAR_FACTOR * shear_modulus * area)

    def force(state: Accepted) -> float:
        return abs(float(state.contact_force(inner)[0]))

    def moment(state: Accepted) -> float:
        """About y, at the mid-plane, of the contact forces on one half of the whole pin."""
        of_both_halves = sum(state.contact_moments(contact)[1] for contact in (inner, outer))
        return abs(float(of_both_halves)) / 2

    def deflection(state: Accepted) -> float:
        middle = _moved(state, inner, 0.0, R)
        return abs(middle - _moved(state, outer, (bottom + top) / 2, R))

    of_moment = scene.units.energy_of(1.0)
    length = scene.units.length
    yield Measure("pin bending moment", of_moment, moment)
    yield Measure("pin bending moment by hand", of_moment, lambda state: force(state) / 2 * arm)
    yield Measure("pin deflection", length, deflection)
    yield Measure("pin deflection by hand", length, lambda s: force(s) * (bent + sheared))


def _moved(state: Accepted, contact: str, height: float, radius: float) -> float:
    """How far the pin's surface has moved along x at a ``height``, on average."""
    pin = state.met[contact][0]
    weight = np.where(np.abs(pin.X[..., 2] - height) <= _STRIP * radius, pin.weight, 0.0)
    moved = pin.coordinates[..., 0] - pin.X[..., 0]
    return float((weight * moved).sum() / weight.sum())

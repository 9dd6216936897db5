"""What presets in space tell beside the measures of their parts: the pressure at the middle and at
the rim of each hole, how far contact reaches, and how the pin of a clevis bends."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from archord.materials.kinematics import Bools
from archord.materials.material import Array
from archord.measures.measure import Accepted, Measure
from archord.scene.problem import ProblemScene

_STRIP = 0.1  # width over R of the strips across the load axis, beside the middle and the rim
_PEAK_FRACTION = 0.4  # part of the contact angle over which the parabola of the peak is fitted
_LEAST = 0.1  # rad, of the same angle
_PIECE = 0.15  # rad: length of a piece of a strip
_SLIVER = 0.5  # part of the widest piece below which a piece does not count
_COSINES = 5  # that the motion around a pin is made of
_DIGITS = 9  # of angles that are not one


Strip = tuple[float, float]


@dataclass(frozen=True)
class Bearing:
    """A pin in a hole, in the words of the scene.

    - ``contact``: the name of the interaction
    - ``radius``: of the pin
    - ``centre``: of the hole ``(x, y)``
    - ``axis``: the direction ``(x, y)`` from the centre in which the pin presses
    - ``span``: the angle to which the hole is modelled on one side of the axis
    - ``middle``, ``rim``: strips of the hole, from one z to another, where pressures are told
    """

    contact: str
    radius: float
    centre: tuple[float, float]
    axis: tuple[float, float]
    span: float
    middle: Strip
    rim: Strip

    def angle(self, X: Array) -> Array:
        """The angle of points ``(n, q, 3)`` from the load axis, whichever way."""
        x, y = self.axis
        to = X[..., :2] - self.centre
        along = to @ np.array([x, y])
        across = to @ np.array([-y, x])
        return np.abs(np.arctan2(across, along))

    def semi_angle(self, state: Accepted) -> float:
        """The angle from the load axis to which the hole bears, at its middle."""
        hole = state.met[self.contact][-1]
        inside = _inside(_folded(hole.X), _twice(self.middle))
        angle = self.angle(hole.X)[inside]
        is_pressed = hole.raw_pressure[inside] > 0
        return self.span * mean_over(angle, is_pressed, hole.weight[inside], self.span)

    def moved(self, state: Accepted) -> float:
        """How far the pin's surface has moved along x at the middle of the hole, the mean around
        it.

        Its sides come nearer to each other, and points are not evenly around it: so cosines of the
        angle, and a parabola along the pin, are fitted to the motion of points.
        """
        pin = state.met[self.contact][0]
        X = _folded(pin.X)
        inside = _inside(X, _twice(self.middle))
        angle = self.angle(pin.X)[inside]
        low, high = self.middle
        beside = (2 * X[..., 2][inside] - low - high) / (high - low)
        around = [np.cos(k * angle) for k in range(_COSINES + 1)]
        along = [beside, beside**2, beside * np.cos(angle)]
        moved = (pin.coordinates[..., 0] - pin.X[..., 0])[inside]
        return _first_of_fit(around + along, moved, pin.weight[inside])

    def peak(self, state: Accepted, strip: Strip) -> float:
        """The pressure on the load axis in a ``strip``, by an even parabola around it."""
        eps = state.once(f"{self.contact} eps", lambda: self.semi_angle(state))
        angle, pressure, weight = self._points(state, strip)
        near = angle <= max(_PEAK_FRACTION * eps, _LEAST)
        parabola = [angle[near] ** 0, angle[near] ** 2]
        return max(_first_of_fit(parabola, pressure[near], weight[near]), 0.0)

    def largest(self, state: Accepted, strip: Strip) -> float:
        """The largest mean pressure of a piece of a ``strip``."""
        angle, pressure, weight = self._points(state, strip)
        piece = (angle / _PIECE).astype(int)
        widths = np.bincount(piece, weight)
        whole = widths > _SLIVER * widths.max()
        forces = np.bincount(piece, weight * pressure)
        means = forces[whole] / widths[whole]
        return max(float(means.max()), 0.0)

    def _points(self, state: Accepted, strip: Strip) -> tuple[Array, Array, Array]:
        """Angle, pressure and weight ``(k,)`` of the points of both sides in a ``strip``."""
        found = []
        for profile in state.met[self.contact]:
            inside = _inside(profile.X, strip)
            arrays = (self.angle(profile.X), profile.pressure, profile.weight)
            found.append([array[inside] for array in arrays])
        both_sides = zip(*found, strict=True)
        angle, pressure, weight = (np.concatenate(parts) for parts in both_sides)
        return angle, pressure, weight


def _first_of_fit(functions: list[Array], values: Array, weight: Array) -> float:
    """The coefficient of the first of ``functions`` ``(k,)`` whose sum fits ``values`` ``(k,)``
    best, each by its ``weight``."""
    w = np.sqrt(weight)
    weighted = w[:, None] * np.stack(functions, axis=1)
    coefficients, *_ = np.linalg.lstsq(weighted, w * values, rcond=None)
    return float(coefficients[0])


def mean_over(angle: Array, values: Array, weight: Array, span: float) -> float:
    """The mean of ``values`` ``(k,)`` over a ``span`` of angles from 0 on. Each counts up to
    halfway to the next ones of the angles ``(k,)``, as points of facets lie denser here than there.
    Values at one angle count by their ``weight``."""
    different, at = np.unique(np.round(angle, _DIGITS), return_inverse=True)
    of_angles = np.bincount(at, weight * values) / np.bincount(at, weight)
    between = (different[1:] + different[:-1]) / 2
    widths = np.diff(np.concatenate([[0.0], between, [span]]))
    return float(widths @ of_angles) / span


def solid_measures(scene: ProblemScene) -> Iterator[Measure]:
    """The measures of the preset in space whose shape the ``scene`` has; none of other scenes."""
    shape = scene.mesh.shape
    if shape is None or shape.space is None:
        return
    stress = scene.units.stress
    if shape.kind == "joint":
        yield from _joint_measures(scene, shape)
        return
    contacts = [part.name for part in scene.interaction]
    for bearing in _bearings(shape, contacts):
        name = bearing.contact
        strips = {"mid": bearing.middle, "rim": bearing.rim}
        for where, strip in strips.items():
            largest = partial(_largest_over, bearing.largest, _modelled(shape, strip))
            yield Measure(f"{name} {where} pressure", stress, largest)
        yield Measure(f"{name} eps", "rad", bearing.semi_angle)
    if shape.kind == "clevis":
        yield from _bending_measures(scene, shape)


def _inside(X: Array, strip: Strip) -> Bools:
    """Whether points ``(n, q, 3)`` are in a ``strip``."""
    low, high = strip
    z = X[..., 2]
    return (z >= low) & (z <= high)


def _above(x: Array) -> Bools:
    """Whether points ``(m, 3)`` are in the upper half of the whole."""
    return x[:, 2] > 0


def _folded(X: Array) -> Array:
    """The points ``X`` ``(n, q, 3)``, with those below the mid-plane at their images."""
    x, y, z = np.moveaxis(X, -1, 0)
    return np.stack([x, y, np.abs(z)], axis=-1)


def _twice(strip: Strip) -> Strip:
    """The ``strip`` with twice the width: wide enough for points at all angles."""
    low, high = strip
    beside = (high - low) / 2
    return low - beside, high + beside


def _largest_over(
    value: Callable[[Accepted, Strip], float], strips: Iterable[Strip], state: Accepted
) -> float:
    """The largest ``value`` of the ``strips``."""
    return max(value(state, strip) for strip in strips)


def _modelled(shape: Any, strip: Strip) -> set[Strip]:
    """The ``strip``; where the whole is modelled, its image below the mid-plane, too."""
    low, high = strip
    return {strip} if shape.space.half else {strip, (-high, -low)}


def _middle(shape: Any, height: float = 0.0) -> Strip:
    """The strip around a ``height``."""
    width = _STRIP * shape.radius
    return height - width, height + width


def _rim(shape: Any, face: float, into: int, pin: float = math.inf) -> Strip:
    """The strip beside the rim at a ``face``, toward ``into`` (1 or -1), behind its chamfer or
    fillet; beside the end of the ``pin`` where that ends before."""
    width = _STRIP * shape.radius
    outer = min(face + into * shape.space.blunt, pin)
    inner = outer + into * width
    return min(outer, inner), max(outer, inner)


def _end(shape: Any) -> float:
    """Where the pin of a joint, a lug or a bushing ends; a rigid one does not."""
    if shape.pin == "none":
        return math.inf
    return float(shape.space.arguments()["pin_length"]) / 2


def _joint_measures(scene: ProblemScene, shape: Any) -> Iterator[Measure]:
    """The measures of the paper's joint: the pin is pressed along -y."""
    units = scene.units
    contact = scene.interaction[0].name
    load = scene.load[0].name
    face = shape.space.thickness / 2
    strips = _middle(shape), _rim(shape, face, -1, _end(shape))
    bearing = Bearing(contact, shape.radius, (0.0, 0.0), (0.0, -1.0), math.pi / 2, *strips)
    yield Measure("delta", units.length, lambda state: -state.driven[load][0])
    yield Measure("P", units.force_of(1.0), lambda state: -state.driven[load][1])
    for name, strip in (("p0", bearing.middle), ("rim pressure", bearing.rim)):
        yield Measure(
            name, units.stress, partial(_largest_over, bearing.peak, _modelled(shape, strip))
        )
    yield Measure("eps", "rad", bearing.semi_angle)


def _bearings(shape: Any, contacts: list[str]) -> Iterator[Bearing]:
    """The bearings of a lug, a bushing or a clevis, whose pin is in the hole of ``contacts``."""
    R = shape.radius
    pinned = [name for name in contacts if name.startswith("pin in ")]
    has_plates = shape.kind == "clevis"
    plate = shape.inner if has_plates else shape.space
    end = math.inf if has_plates else _end(shape)
    strips = _middle(shape), _rim(shape, plate.thickness / 2, -1, end)
    yield Bearing(pinned[0], R, (0.0, 0.0), (1.0, 0.0), math.pi, *strips)
    if not has_plates:
        return
    _, bottom, top = _heights(shape)
    centre = (2 * shape.clearance, 0.0)
    strips = _middle(shape, (bottom + top) / 2), _rim(shape, bottom, 1)
    yield Bearing(pinned[1], R, centre, (-1.0, 0.0), math.pi, *strips)


def _heights(shape: Any) -> tuple[float, float, float]:
    """Where the inner plate of a clevis ends, and where the outer one begins and ends."""
    inside = shape.inner.thickness / 2
    bottom = inside + shape.space.gap
    return inside, bottom, bottom + shape.outer.thickness


def _bending_measures(scene: ProblemScene, shape: Any) -> Iterator[Measure]:
    """How the pin of a clevis bends, beside a beam.

    By hand the plates press evenly between their rims: where these are sharp the moment is P/2
    (t_inner/4 + gap + t_outer/2) (Bruhn 1973, chapter D1). The beam rests on the middles of the
    outer plates; shear adds M/(k G A).
    """
    inside, bottom, top = _heights(shape)
    pin = next(body for body in scene.body if body.name == "pin")
    inner, outer = _bearings(shape, [part.name for part in scene.interaction])
    arm = (bottom + top) / 2 - (inside - shape.space.blunt) / 2
    compliance = _beam_compliance(shape, pin, arm)

    def force(state: Accepted) -> float:
        return abs(float(state.contact_force(inner.contact)[0]))

    def moment(state: Accepted) -> float:
        """About y, at the mid-plane, of the contact forces on one half of the whole pin."""
        moments = state.system.contact_moments
        found = sum(moments(b.contact, (0.0, 0.0, 0.0), _above)[1] for b in (inner, outer))
        return abs(float(found)) / (2 if shape.space.half else 1)

    def deflection(state: Accepted) -> float:
        return abs(inner.moved(state) - outer.moved(state))

    of_moment = scene.units.energy_of(1.0)
    length = scene.units.length
    yield Measure("pin bending moment", of_moment, moment)
    yield Measure("pin bending moment by hand", of_moment, lambda state: force(state) / 2 * arm)
    yield Measure("pin deflection", length, deflection)
    yield Measure("pin deflection by hand", length, lambda state: force(state) * compliance)


def _beam_compliance(shape: Any, pin: Any, arm: float) -> float:
    """The deflection per force of a beam that rests on the middles of the outer plates and is
    loaded evenly by the inner one; ``arm`` is the moment over half the force."""
    inside, bottom, top = _heights(shape)
    R = shape.radius
    bore = shape.space.bore
    span = bottom + top  # between the supports
    loaded = 2 * (inside - shape.space.blunt)
    inertia = math.pi * (R**4 - bore**4) / 4
    area = math.pi * (R**2 - bore**2)
    shear_modulus = pin.E / (2 * (1 + pin.nu))
    stiffness = pin.E * inertia
    bent = (8 * span**3 - 4 * span * loaded**2 + loaded**3) / (384 * stiffness)
    sheared = arm / (2 * shear_factor(bore / R, pin.nu) * shear_modulus * area)
    return bent + sheared


def shear_factor(bore: float, nu: float) -> float:
    """The shear factor of a round beam whose ``bore`` is over its radius (Cowper 1966)."""
    square = bore**2
    wall = (1 + square) ** 2
    return 6 * (1 + nu) * wall / ((7 + 6 * nu) * wall + (20 + 12 * nu) * square)

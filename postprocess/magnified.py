"""The deformed joint drawn so that its clearance can be seen.

Displacements alone cannot be magnified: bodies that touch would overlap, as the gap between their circles would stay
what it is. So the clearance is magnified with them. Every point is thought of as displaced from its place in a joint
without clearance, in which both arcs are the circle of radius R around the origin: the pin centred there, the block
drawn in by dR along its radii. Magnified by m, a gap is m times as wide, and what touches touches, but for
``(m s)^2/(2 R)`` where one body has slid by s along the other; that is why m is kept moderate.
"""

from __future__ import annotations

import math

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.run_fields import BODIES, Fields
from archord.scene.scene import Scene

_VISIBLE = 0.1  # clearance over R, as drawn
_FARTHEST = 0.2  # displacement and clearance over R, as drawn
_NEAR = 3.0  # radii within which displacements count


def magnification(scene: Scene, fields: Fields) -> float:
    """Factor 1, 2, 3, 5, 10, ... that makes the clearance of ``scene`` visible and leaves the shape recognisable."""
    R, dR = scene.joint.radius, abs(scene.joint.dR)
    near = np.hypot(*fields.coordinates.T) < _NEAR * R
    farthest = dR + max(float(np.abs(fields.displacement[near]).max()), abs(fields.delta))
    wanted = min(_VISIBLE * R / dR, _FARTHEST * R / farthest)
    if wanted <= 1:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(wanted))
    return max(step * decade for step in (1, 2, 3, 5) if step * decade <= wanted * (1 + 1e-9))


def pin_centre(scene: Scene, delta: float = 0.0) -> float:
    """Height of the centre of a rigid pin pressed by ``delta``, or of an elastic one before it is pressed; that of the
    hole is 0."""
    return -delta - (scene.joint.dR if scene.joint.model == "block" else 0.0)


def nominal(scene: Scene, fields: Fields) -> Array:
    """Places ``(n, 2)`` of the nodes in the joint without clearance."""
    X, pin = fields.coordinates, fields.body_of_node == BODIES["pin"]
    places = X * (1 - scene.joint.dR / np.maximum(np.hypot(*X.T), scene.joint.radius / 2))[:, None]
    places[pin] = X[pin] - [0.0, pin_centre(scene)]
    return places


def magnified(scene: Scene, fields: Fields, factor: float, displaced: bool = True) -> Array:
    """Points ``(n, 2)`` at which the nodes are drawn: with ``factor`` times their displacement from `nominal`; or the
    joint before it is loaded, if not ``displaced``."""
    start = nominal(scene, fields)
    return start + factor * ((fields.deformed if displaced else fields.coordinates) - start)


def rigid_arc(scene: Scene, delta: float, factor: float) -> Array:
    """Points ``(91, 2)`` along the quarter arc of a rigid pin pressed by ``delta``, as drawn."""
    angle = np.linspace(0, math.pi / 2, 91)
    R = scene.joint.radius
    return np.stack([R * np.sin(angle), factor * pin_centre(scene, delta) - R * np.cos(angle)], axis=1)

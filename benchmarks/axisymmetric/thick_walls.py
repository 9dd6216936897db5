"""A thick sphere and a thick cylinder under inner pressure, elastic (Lame) and perfectly plastic.

The sphere that yields up to the radius c carries ``2 sigY (ln(c/a) + (1 - c^3/b^3)/3)`` and moves
outside by ``(1 - nu) sigY c^3/(E b^2)`` (Hill 1950, chapter V). The cylinder in plane strain
carries ``2/sqrt(3) sigY ln(b/a)``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from archord.benchmarks.axisymmetric.case import (
    NU,
    SIGY,
    Case,
    Compared,
    E,
    elastic,
    one_body,
    perfectly_plastic,
)
from archord.benchmarks.case import meshed
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.sketch import Sketch
from archord.postprocess.run import Run
from archord.solver.problem import Load, Problem, Support

INNER = 1.0  # radii of both
OUTER = 2.0
PRESSURE = 1e-3  # in elastic ones
PLASTIC_RADIUS = 1.4  # up to which the sphere yields
_HEIGHT = 0.4  # of the cylinder
_CLOSE = 1e-6


def sphere_sketch(size: float) -> Sketch:
    """The half above the equator: a quarter of a ring, with elements of this ``size``."""
    sketch = Sketch(["body"], ["bore", "outside", "equator", "axis"])
    arcs = {}
    for name, radius in (("bore", INNER), ("outside", OUTER)):
        circle = Circle(name, (0.0, 0.0), radius)
        arcs[name] = sketch.path("body", (radius, 0.0), (0.0, radius), on=circle)
    equator = sketch.path("body", (INNER, 0.0), (OUTER, 0.0))
    axis = sketch.path("body", (0.0, INNER), (0.0, OUTER))
    sketch.face("body", **arcs, equator=equator, axis=axis)
    sketch.sizes["body"] = f"{size!r}"
    return sketch


def sphere_mesh(size: float = 0.08) -> TaggedMesh:
    """The mesh of `sphere_sketch`."""
    return meshed(sphere_sketch(size))


def cylinder_mesh(size: float = 0.05) -> TaggedMesh:
    """A rectangle, with elements of this ``size``."""
    sketch = Sketch(["body"], ["bore", "outside", "ends"])
    corners = [(INNER, 0.0), (OUTER, 0.0), (OUTER, _HEIGHT), (INNER, _HEIGHT)]
    below, outside, above, bore = sketch.path("body", *corners, corners[0])
    sketch.face("body", bore=[bore], outside=[outside], ends=[below, above])
    sketch.sizes["body"] = f"{size!r}"
    return meshed(sketch)


def plastic_pressure() -> float:
    """The pressure under which the sphere yields up to `PLASTIC_RADIUS`."""
    c = PLASTIC_RADIUS
    elastic_part = (1 - c**3 / OUTER**3) / 3
    return 2 * SIGY * (math.log(c / INNER) + elastic_part)


def _sphere(material: Any, pressure: float, steps: int) -> Problem:
    held = [Support("equator", fixed="y"), Support("axis", fixed="x")]
    oil = Load("oil", on="bore", pressure=pressure)
    return one_body(sphere_mesh(), material, supports=held, loads=[oil], steps=steps)


def _cylinder(material: Any, load: Load, steps: int) -> Problem:
    held = [Support("ends", fixed="y")]
    return one_body(cylinder_mesh(), material, supports=held, loads=[load], steps=steps)


def _elastic_sphere() -> Problem:
    return _sphere(elastic(), PRESSURE, steps=1)


def _plastic_sphere() -> Problem:
    return _sphere(perfectly_plastic(), plastic_pressure(), steps=10)


def _elastic_cylinder() -> Problem:
    oil = Load("oil", on="bore", pressure=PRESSURE)
    return _cylinder(elastic(), oil, steps=1)


def _plastic_cylinder() -> Problem:
    push = Load("push", on="bore", direction="x", displacement=20 * SIGY)
    return _cylinder(perfectly_plastic(), push, steps=20)


def _radial(run: Run, radius: float) -> float:
    """Mean radial displacement of the nodes at a distance from the origin."""
    fields = run.fields()
    distance = np.linalg.norm(fields.coordinates, axis=1)
    at = np.abs(distance - radius) < _CLOSE
    direction = fields.coordinates[at] / distance[at, None]
    radial = (fields.displacement[at] * direction).sum(axis=1)
    return float(radial.mean())


def lame_sphere(run: Run) -> Iterator[Compared]:
    """The displacement inside under `PRESSURE`."""
    a3 = INNER**3
    b3 = OUTER**3
    hoop = PRESSURE * (a3 + b3 / 2) / (b3 - a3)
    exact = INNER / E * ((1 - NU) * hoop + NU * PRESSURE)
    yield Compared("u(a)", exact, "Lame", _radial(run, INNER))


def hill_sphere(run: Run) -> Iterator[Compared]:
    """The displacement outside under `plastic_pressure`."""
    exact = (1 - NU) * SIGY * PLASTIC_RADIUS**3 / (E * OUTER**2)
    yield Compared("u(b)", exact, "Hill", _radial(run, OUTER))


def _lame_cylinder(run: Run) -> Iterator[Compared]:
    a2 = INNER**2
    b2 = OUTER**2
    compliance = INNER * (1 + NU) / E
    exact = PRESSURE * compliance * ((1 - 2 * NU) * a2 + b2) / (b2 - a2)
    fields = run.fields()
    bore = fields.coordinates[:, 0] < INNER + _CLOSE
    ours = fields.displacement[bore, 0].mean()
    yield Compared("u(a)", exact, "Lame", float(ours))


def _hill_cylinder(run: Run) -> Iterator[Compared]:
    exact = 2 / math.sqrt(3) * SIGY * math.log(OUTER / INNER)
    force = run.columns["push force"][-1]
    area = 2 * math.pi * INNER * _HEIGHT
    yield Compared("limit pressure", exact, "Hill", force / area)


CASES = (
    Case("thick sphere, elastic", _elastic_sphere, lame_sphere),
    Case("thick sphere, plastic", _plastic_sphere, hill_sphere),
    Case("thick cylinder, elastic", _elastic_cylinder, _lame_cylinder),
    Case("thick cylinder, plastic", _plastic_cylinder, _hill_cylinder),
)

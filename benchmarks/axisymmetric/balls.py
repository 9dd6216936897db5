"""Balls pressed on a half-space, which is a ball of 300 contact radii whose outside is held.

- A rigid and an elastic ball: Hertz, whose P follows from the depth, a and p0 from the force.
- A rigid ball deep in a half-space that yields perfectly, at large strain: P of a rigid-plastic
  half-space is ``3 pi R sigY h/0.368``. The mean pressure is 3 sigY, and the depth ``0.368 a^2/R``
  (Richmond, Morrison and Devenpeck 1974, in Johnson 1985, Contact Mechanics, pages 171 and 200).
  Code_Aster's test SSNV506 has the same reference, and E/sigY = 4200.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from archord.benchmarks.axisymmetric.case import (
    NU,
    Case,
    Compared,
    E,
    elastic,
    one_body,
    perfectly_plastic,
)
from archord.benchmarks.case import meshed
from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.sketch import Sketch
from archord.postprocess.run import Run
from archord.solver.problem import Body, Interaction, Load, Problem, Support

MODULUS = E / (1 - NU**2)
BALL = 200.0  # radius of the ball, in contact radii: Hertz neglects what is of the order a/R
SMALL_BALL = 20.0  # radius of the ball that is pressed in deep
YIELD_STRESS = E / 4200
DEPTH = 0.02 * SMALL_BALL
FAR = 300.0  # radius of the half-space, in contact radii
_FINE = 1.5  # up to this radius the mesh of Hertz's cases does not grow


def half_space_mesh(near: str, fine: float) -> TaggedMesh:
    """A quarter of a disc below y = 0, with elements of the size ``near`` the ball up to the radius
    ``fine``, growing beyond."""
    sketch = Sketch(["body"], ["surface", "axis", "far"])
    _draw_half_space(sketch, fine, fine)
    sketch.sizes["body"] = f"{near} + 0.3 * Max(Sqrt(x*x + y*y) - {fine!r}, 0)"
    return meshed(sketch)


def balls_sketch(near: str, *on_axis: float) -> Sketch:
    """A half ball on a quarter of a disc, which touch in the origin, with elements of the size
    ``near`` the contact, and nodes ``on_axis`` this far from it."""
    names = ["ball surface", "ball top", "ball axis", "surface", "axis", "far"]
    sketch = Sketch(["ball", "body"], names)
    angle = _FINE / BALL
    edge = (BALL * math.sin(angle), BALL - BALL * math.cos(angle))
    on_ball = Circle("ball surface", (0.0, BALL), BALL)
    sides = {
        "ball surface": sketch.path("ball", (0.0, 0.0), edge, (BALL, BALL), on=on_ball),
        "ball top": sketch.path("ball", (BALL, BALL), (0.0, BALL)),
        "ball axis": sketch.path("ball", (0.0, BALL), *((0.0, y) for y in on_axis), (0.0, 0.0)),
    }
    sketch.face("ball", **sides)
    _draw_half_space(sketch, _FINE, *on_axis)
    size = f"{near} + 0.45 * Max(Sqrt(x*x + y*y) - {_FINE}, 0)"
    sketch.sizes |= {"ball": size, "body": size}
    return sketch


def balls_mesh() -> TaggedMesh:
    """The mesh of `balls_sketch`, with smaller elements at the edge of the contact."""
    finer_at_the_edge = "Min(0.03 + 0.15 * Sqrt((x - 1)^2 + y*y), 0.15)"
    return meshed(balls_sketch(finer_at_the_edge, _FINE))


def _draw_half_space(sketch: Sketch, fine: float, *on_axis: float) -> None:
    surface = sketch.path("body", (0.0, 0.0), (fine, 0.0), (FAR, 0.0))
    far = sketch.path("body", (FAR, 0.0), (0.0, -FAR), on=Circle("far", (0.0, 0.0), FAR))
    axis = sketch.path("body", (0.0, -FAR), *((0.0, -y) for y in on_axis), (0.0, 0.0))
    sketch.face("body", surface=surface, far=far, axis=axis)


def _pressed(mesh: TaggedMesh, material: Any, radius: float, depth: float, **how: Any) -> Problem:
    ball = RigidCircle(np.array([0.0, radius]), radius)
    return one_body(
        mesh,
        material,
        interactions=[Interaction("contact", (ball, "surface"))],
        supports=[Support("far", fixed="xy"), Support("axis", fixed="x")],
        loads=[Load("ball", on="contact", direction="y", displacement=-depth)],
        **how,
    )


def _rigid() -> Problem:
    finer_at_the_edge = "Min(0.02 + 0.1 * Sqrt((x - 1)^2 + y*y), 0.11)"
    mesh = half_space_mesh(finer_at_the_edge, _FINE)
    return _pressed(mesh, elastic(), BALL, 1 / BALL, steps=4)


def _elastic() -> Problem:
    supports = [
        Support("far", fixed="xy"),
        Support("axis", fixed="x"),
        Support("ball axis", fixed="x"),
    ]
    return Problem(
        balls_mesh(),
        [Body("ball", elastic()), Body("body", elastic())],
        [Interaction("contact", ("ball surface", "surface"))],
        supports,
        [Load("ball", on="ball top", direction="y", displacement=-1 / BALL)],
        steps=4,
        kinematics="axisymmetric",
    )


def _deep(size: float = 0.28, yield_stress: float = YIELD_STRESS, strain: str = "large") -> Problem:
    material = perfectly_plastic(yield_stress)
    mesh = half_space_mesh(repr(size), 6.0)
    return _pressed(mesh, material, SMALL_BALL, DEPTH, steps=10, strain=strain)


def hertz(run: Run, modulus: float, peak: float | None = None) -> Iterator[Compared]:
    """P from the depth, a and p0 from the force, by the contact ``modulus`` E*. The ``peak`` of the
    pressure is the history's if absent."""
    if peak is None:
        peak = run.columns["contact largest pressure"][-1]
    force = abs(run.columns["ball force"][-1])
    depth = abs(run.columns["ball displacement"][-1])
    radius = (3 * force * BALL / (4 * modulus)) ** (1 / 3)
    pressure = 3 * force / (2 * math.pi * radius**2)
    exact = 4 / 3 * modulus * math.sqrt(BALL) * depth**1.5
    area = run.columns["contact contact area"][-1]
    yield Compared("P", exact, "Hertz", force)
    yield Compared("a", radius, "Hertz", math.sqrt(area / math.pi))
    yield Compared("p0", pressure, "Hertz", peak)


def _johnson(run: Run, yield_stress: float = YIELD_STRESS) -> Iterator[Compared]:
    exact = 3 * math.pi * SMALL_BALL * yield_stress * DEPTH / 0.368
    yield Compared("P", exact, "Johnson", abs(run.columns["ball force"][-1]))


CASES = (
    Case("rigid ball on a half-space", _rigid, lambda run: hertz(run, MODULUS)),
    Case("elastic ball on a half-space", _elastic, lambda run: hertz(run, MODULUS / 2)),
    Case("rigid ball deep in a half-space", _deep, _johnson),
)
STIFF = E / 20_000
# what the difference of the deep ball depends on
DEEP = (
    CASES[-1],
    Case("elements half as large", lambda: _deep(size=0.14), _johnson),
    Case("E/sigY = 20 000", lambda: _deep(yield_stress=STIFF), lambda run: _johnson(run, STIFF)),
    Case("small strain", lambda: _deep(strain="small"), _johnson),
)

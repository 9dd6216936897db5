"""Two balls by Code_Aster (SSNV104), and patch tests by MOOSE."""

from __future__ import annotations

from functools import partial

from archord.benchmarks.axisymmetric.case import NU
from archord.benchmarks.case import meshed
from archord.benchmarks.outside.problem import (
    Outside,
    Published,
    Values,
    displacement_at,
    largest_pressure,
)
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Sketch
from archord.materials.elasticity import Elastic
from archord.postprocess.run import Run
from archord.solver.problem import Body, Interaction, Load, Problem, Support

RADIUS = 50.0  # mm
APPROACH = 4.0
_NEAR = 15.0  # the radius of the fine part of the balls
_PRESSURE = 109.89
_SIDE = 1.0  # of the square that two blocks of half its height make up


def balls_mesh(finer: int) -> TaggedMesh:
    """Two half balls that touch in the origin."""
    sketch = Sketch(["upper", "lower"], ["upper axis", "lower axis", "top", "base"])
    for body, flat, up in (("upper", "top", 1), ("lower", "base", -1)):
        name = f"{body} ball"
        sketch.lines[name] = []
        centre = (0.0, up * RADIUS)
        edge = (_NEAR, up * (RADIUS - (RADIUS**2 - _NEAR**2) ** 0.5))
        rim = (RADIUS, up * RADIUS)
        arc = sketch.path(body, (0.0, 0.0), edge, rim, on=Circle(name, centre, RADIUS))
        across = sketch.path(body, rim, centre)
        axis = sketch.path(body, centre, (0.0, 0.0))
        sketch.face(body, **{name: arc, flat: across, f"{body} axis": axis})
        sketch.sizes[body] = f"(1 + 0.2 * Max(Sqrt(x*x + y*y) - 12, 0)) / {finer}"
    return meshed(sketch)


def balls(finer: int) -> Problem:
    """The middle planes of two balls approach each other by 4 mm."""
    material = Elastic(20e3, NU)
    half = 0.5 * APPROACH
    return Problem(
        balls_mesh(finer),
        [Body("upper", material), Body("lower", material)],
        [Interaction("contact", ("upper ball", "lower ball"))],
        [Support("upper axis", fixed="x"), Support("lower axis", fixed="x")],
        [
            Load("top", direction="y", displacement=-half),
            Load("base", direction="y", displacement=half),
        ],
        steps=4,
        kinematics="axisymmetric",
    )


def _of_balls(run: Run) -> Values:
    return {"p0": largest_pressure(run, "upper ball")}


def blocks_mesh(finer: int) -> TaggedMesh:
    """Two blocks on each other, with meshes that do not match."""
    sketch = Sketch(["upper", "lower"], ["face", "ground", "left", "top", "base"])
    middle = 0.5 * _SIDE
    parts = {"upper": ("face", "top", _SIDE, 0.3), "lower": ("ground", "base", 0.0, 0.2)}
    for body, (contact, outer, far, size) in parts.items():
        corners = [(0.0, middle), (_SIDE, middle), (_SIDE, far), (0.0, far)]
        near, right, away, left = sketch.path(body, *corners, corners[0])
        sketch.face(body, **{contact: [near], "right": [right], outer: [away], "left": [left]})
        sketch.sizes[body] = f"{size} / {finer}"
    return meshed(sketch)


def blocks(friction: float, finer: int) -> Problem:
    """Two blocks under a pressure, in plane strain."""
    material = Elastic(1e6, NU)
    return Problem(
        blocks_mesh(finer),
        [Body("upper", material), Body("lower", material)],
        [Interaction("contact", ("face", "ground"), friction=friction)],
        [Support("base", fixed="y"), Support("left", fixed="x")],
        [Load("press", on="top", pressure=_PRESSURE)],
        steps=1,
    )


def _of_blocks(run: Run) -> Values:
    corner = (_SIDE, _SIDE)
    return {
        "ux at the corner": displacement_at(run, "upper", corner, 0),
        "uy at the corner": displacement_at(run, "upper", corner, 1),
        "p0": largest_pressure(run, "ground"),
    }


_BLOCKS = (
    Published("ux at the corner", 4.28571e-05, "MOOSE, linear elements"),
    Published("uy at the corner", -1.0010979e-04, "MOOSE, by penalty"),
    Published("p0", 109.89471, "MOOSE, large strain"),
)
PROBLEMS = (
    Outside(
        "two balls",
        "Code_Aster SSNV104",
        balls,
        _of_balls,
        (Published("p0", 2798.3, "Hertz"),),
        "The contact is 10 mm wide on balls of 50 mm, so Hertz's half-spaces are an "
        "approximation: archord's p0 no longer changes, and is the value of the balls "
        "themselves.",
    ),
    *(
        Outside(
            f"patch test, friction {friction:g}",
            "MOOSE, modules/contact, verification/patch_tests/plane_1",
            partial(blocks, friction),
            _of_blocks,
            _BLOCKS,
            "archord gives the closed form, 4.28571e-05, -1e-04 and 109.89, to all digits on "
            "meshes that do not match. MOOSE's elements match; its penalty leaves 0.1 % of "
            "penetration.",
            finer=(1, 2),
        )
        for friction in (0.0, 0.2)
    ),
)

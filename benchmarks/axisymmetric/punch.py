"""A punch with rounded edges on a foundation, without friction: mm, MPa.

The drawing is of NAFEMS R0094, "Advanced finite element contact benchmarks", benchmark 2.
"""

from __future__ import annotations

from archord.benchmarks.axisymmetric.case import NU, STEEL, Place, Study
from archord.benchmarks.case import meshed
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.sketch import Sketch
from archord.materials.elasticity import Elastic
from archord.solver.problem import Body, Interaction, Load, Problem, Support

ALUMINIUM = 70e3  # MPa


def punch_mesh(finer: int) -> TaggedMesh:
    """The punch stands on the foundation's top y = 0 by a circle of radius 40."""
    names = ["punch top", "punch side", "punch base", "punch axis", "fillet"]
    names += ["top", "side", "base", "axis"]
    sketch = Sketch(["punch", "foundation"], names)
    fillet = Circle("fillet", (40.0, 10.0), 10.0)
    flat = sketch.path("punch", (0.0, 0.0), (40.0, 0.0))
    sketch.lines["fillet"] = sketch.path("punch", (40.0, 0.0), (50.0, 10.0), on=fillet)
    sides = {
        "punch top": sketch.path("punch", (0.0, 100.0), (50.0, 100.0)),
        "punch side": sketch.path("punch", (50.0, 100.0), (50.0, 10.0)),
        "punch base": flat + sketch.lines["fillet"],
        "punch axis": sketch.path("punch", (0.0, 100.0), (0.0, 0.0)),
    }
    sketch.face("punch", **sides)
    sketch.face(
        "foundation",
        top=sketch.path("foundation", (0.0, 0.0), (60.0, 0.0), (100.0, 0.0)),
        side=sketch.path("foundation", (100.0, 0.0), (100.0, -200.0)),
        base=sketch.path("foundation", (100.0, -200.0), (0.0, -200.0)),
        axis=sketch.path("foundation", (0.0, -200.0), (0.0, 0.0)),
    )
    size = f"(0.4 + 0.2 * Sqrt((x - 40.5)^2 + y*y)) / {finer}"
    sketch.sizes |= {"punch": size, "foundation": size}
    return meshed(sketch)


def punch_problem(finer: int = 1) -> Problem:
    """The punch under a pressure, on a mesh so many times ``finer``."""
    supports = [
        Support("base", fixed="xy"),
        Support("axis", fixed="x"),
        Support("punch axis", fixed="x"),
    ]
    return Problem(
        punch_mesh(finer),
        [Body("punch", Elastic(STEEL, NU)), Body("foundation", Elastic(ALUMINIUM, NU))],
        [Interaction("contact", ("punch base", "top"))],
        supports,
        [Load("press", on="punch top", pressure=100.0)],
        steps=2,
        kinematics="axisymmetric",
    )


STUDY = Study(
    "punch with rounded edges",
    punch_problem,
    (
        Place("u_z of the punch's top", (0.0, 100.0), 1, -0.182034),
        Place("u_r of the foundation's top", (60.0, 0.0), 0, -0.0101255),
    ),
)

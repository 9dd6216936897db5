"""NAFEMS R0094, "Advanced finite element contact benchmarks" (Konter 2006), numbers 1, 2 and 4: mm,
MPa.

Code_Aster's tests SSNP154, SSNA122 and SSNP156 state the same problems, and publish the values of
Abaqus and Marc from NAFEMS beside their own.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from archord.benchmarks.axisymmetric.case import NU, STEEL
from archord.benchmarks.axisymmetric.punch import ALUMINIUM, punch_problem
from archord.benchmarks.case import meshed
from archord.benchmarks.outside.problem import (
    Outside,
    Published,
    Values,
    displacement_at,
    largest_pressure,
    stress_at,
)
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Sketch
from archord.materials.elasticity import Elastic
from archord.postprocess.run import Run
from archord.solver.problem import Body, Interaction, Load, Problem, Support

RADIUS = 50.0  # of the cylinder, and of the pin
WIDTH = 100.0  # of half of the block
HEIGHT = 200.0  # of the block
NEAR = 12.0  # half the width of the fine part of the surfaces
LENGTH = 200.0  # of the sheet, from its held end to the middle of the hole
OUTER = 100.0  # radius of the sheet's round end, and half its width
FRICTION = 0.1
_ORIGIN = (0.0, 0.0)
_AXIS = 1


def roller_mesh(finer: int) -> TaggedMesh:
    """Half a cylinder on half a block, which touch in the origin."""
    sketch = Sketch(["cylinder", "block"], ["cylinder axis", "roll", "top", "base", "axis"])
    edge = (NEAR, RADIUS - math.sqrt(RADIUS**2 - NEAR**2))
    above = (0.0, 2 * RADIUS)
    on_circle = Circle("roll", (0.0, RADIUS), RADIUS)
    round_side = sketch.path("cylinder", _ORIGIN, edge, (RADIUS, RADIUS), above, on=on_circle)
    axis = sketch.path("cylinder", above, _ORIGIN)
    sketch.face("cylinder", **{"roll": round_side, "cylinder axis": axis})
    corner = (WIDTH, -HEIGHT)
    below = (0.0, -HEIGHT)
    sketch.face(
        "block",
        top=sketch.path("block", _ORIGIN, (NEAR, 0.0), (WIDTH, 0.0)),
        side=sketch.path("block", (WIDTH, 0.0), corner),
        base=sketch.path("block", corner, below),
        axis=sketch.path("block", below, _ORIGIN),
    )
    size = f"(1 + 0.2 * Max(Sqrt(x*x + y*y) - 7, 0)) / {finer}"
    sketch.sizes |= {"cylinder": size, "block": size}
    mesh = meshed(sketch)
    return replace(mesh, point_sets={"summit": np.array([above])})


def roller(friction: float, finer: int) -> Problem:
    """A steel cylinder on an aluminium block under 35 kN a millimetre, in plane strain."""
    return Problem(
        roller_mesh(finer),
        [Body("cylinder", Elastic(STEEL, NU)), Body("block", Elastic(ALUMINIUM, NU))],
        [Interaction("contact", ("roll", "top"), friction=friction)],
        [Support("base"), Support("axis", fixed="x"), Support("cylinder axis", fixed="x")],
        [Load("press", on="summit", direction="y", force=-17500.0)],
        steps=2,
    )


def _of_roller(run: Run) -> Values:
    moved = displacement_at(run, "block", _ORIGIN, _AXIS)
    stress = stress_at(run, "block", _ORIGIN, _AXIS)
    half_width = float(run.history["contact contact length"].iloc[-1])
    return {
        "uy at B": moved,
        "sigma_yy at B": stress,
        "p0": largest_pressure(run, "top"),
        "a": half_width,
    }


def sheet_mesh(finer: int) -> TaggedMesh:
    """The upper half of a pin in the round end of a sheet, without clearance."""
    names = ["pin arc", "hole", "pin axis", "right", "left", "held"]
    sketch = Sketch(["pin", "sheet"], names)
    places = [(RADIUS, 0.0), (0.0, RADIUS), (-RADIUS, 0.0)]
    of_pin = sketch.path("pin", *places, on=Circle("pin arc", _ORIGIN, RADIUS))
    axis = sketch.path("pin", places[2], _ORIGIN, places[0])
    sketch.face("pin", **{"pin arc": of_pin, "pin axis": axis})
    end = (-LENGTH, 0.0)
    corner = (-LENGTH, OUTER)
    crown = (0.0, OUTER)
    tip = (OUTER, 0.0)
    sketch.face(
        "sheet",
        hole=sketch.path("sheet", *places, on=Circle("hole", _ORIGIN, RADIUS)),
        left=sketch.path("sheet", places[2], end),
        held=sketch.path("sheet", end, corner),
        edge=sketch.path("sheet", corner, crown),
        round_end=sketch.path("sheet", crown, tip, on=Circle("round end", _ORIGIN, OUTER)),
        right=sketch.path("sheet", tip, places[0]),
    )
    size = f"(4 + 0.3 * Abs(Sqrt(x*x + y*y) - {RADIUS})) / {finer}"
    sketch.sizes |= {"pin": size, "sheet": size}
    mesh = meshed(sketch)
    return replace(mesh, point_sets={"middle": np.array([_ORIGIN])})


def loaded_pin(finer: int) -> Problem:
    """A steel pin pulls an aluminium sheet with 20 kN a millimetre, in plane strain."""
    axes = [Support(name, fixed="y") for name in ("pin axis", "left", "right")]
    return Problem(
        sheet_mesh(finer),
        [Body("pin", Elastic(STEEL, NU)), Body("sheet", Elastic(ALUMINIUM, NU))],
        [Interaction("contact", ("pin arc", "hole"), friction=FRICTION)],
        [Support("held"), *axes],
        [Load("pull", on="middle", direction="x", force=10000.0)],
        steps=4,
        strain="large",
    )


def _of_pin(run: Run) -> Values:
    at = (RADIUS, 0.0)
    return {
        "ux at A": displacement_at(run, "sheet", at, 0),
        "sigma_xx at A, pin": stress_at(run, "pin", at, 0),
        "sigma_xx at A, sheet": stress_at(run, "sheet", at, 0),
    }


def _of_punch(run: Run) -> Values:
    return {
        "uz at M": displacement_at(run, "foundation", _ORIGIN, _AXIS),
        "sigma_zz at M": stress_at(run, "foundation", _ORIGIN, _AXIS),
    }


_ABAQUS = "Abaqus, Marc (NAFEMS), in Code_Aster's"
_FRICTIONLESS = (
    Published("p0", 3585.4, "Hertz"),
    Published("a", 6.21, "Hertz"),
    Published("uy at B", -1.3068, f"{_ABAQUS} SSNP154"),
    Published("sigma_yy at B", -3800.5, f"{_ABAQUS} SSNP154"),
)
_ROLLING = (
    Published("uy at B", -1.3026356, f"{_ABAQUS} SSNP154"),
    Published("uy at B", -1.2689767, "Code_Aster, linear elements, SSNP154 C"),
    Published("sigma_yy at B", -3542.688, f"{_ABAQUS} SSNP154"),
    Published("sigma_yy at B", -3727.838, "Code_Aster, linear elements, SSNP154 C"),
)
_PUNCH = (
    Published("uz at M", -0.130814987, f"{_ABAQUS} SSNA122 C, linear"),
    Published("uz at M", -0.132897448, f"{_ABAQUS} SSNA122 D, quadratic"),
    Published("sigma_zz at M", -91.081142, f"{_ABAQUS} SSNA122 C, linear"),
    Published("sigma_zz at M", -93.626124, f"{_ABAQUS} SSNA122 D, quadratic"),
)
_PIN = tuple(
    Published(quantity, value, f"{_ABAQUS} SSNP156, one of two meshes")
    for quantity, values in (
        ("ux at A", (0.71799, 0.73617)),
        ("sigma_xx at A, pin", (-136.7, -160.4)),
        ("sigma_xx at A, sheet", (-136.7, -160.4)),
    )
    for value in values
)
PROBLEMS = (
    Outside(
        "NAFEMS 1, cylinder on block",
        "NAFEMS R0094, number 1; Code_Aster SSNP154",
        partial(roller, 0.0),
        _of_roller,
        _FRICTIONLESS,
        "Forces spread as Hertz says, within 0.5 %, which is the size of (a/R)^2 and of the "
        "finite block. The displacement of NAFEMS' codes is 2.5 % larger; Code_Aster's own "
        "calculation (next problem) is archord's within 0.1 %. NAFEMS' stress is extrapolated "
        "from the elements of a coarse mesh, and is above Hertz's p0.",
    ),
    Outside(
        "NAFEMS 1, friction 0.1",
        "NAFEMS R0094, number 1; Code_Aster SSNP154",
        partial(roller, FRICTION),
        _of_roller,
        _ROLLING,
        "Code_Aster's own displacement is archord's within 0.1 %, NAFEMS' codes have 2.5 % "
        "more, with and without friction. The stresses of both are extrapolated from "
        "elements; archord's is between them, and no longer changes.",
    ),
    Outside(
        "NAFEMS 2, punch with rounded edges",
        "NAFEMS R0094, number 2; Code_Aster SSNA122",
        punch_problem,
        _of_punch,
        _PUNCH,
        "archord's values no longer change under refinement; CalculiX agrees on the same "
        "meshes (archord.benchmarks.axisymmetric --calculix). The published displacement "
        "comes closer with elements of second order. The published stresses are extrapolated "
        "from elements and do not converge to one value: the quadratic mesh is further away "
        "from archord than the linear one.",
    ),
    Outside(
        "NAFEMS 4, loaded pin, friction 0.1",
        "NAFEMS R0094, number 4; Code_Aster SSNP156",
        loaded_pin,
        _of_pin,
        _PIN,
        "The displacement converges to 0.741; the two published values are 3.1 and 0.6 % "
        "smaller, as those of stiffer, coarser meshes are. The stress at A has no converged "
        "value: the shear mu p changes its sign there, so that the pressure has a cusp, which "
        "every refinement cuts deeper. Both published stresses lie on it.",
        finer=(1, 2, 4, 8),
    ),
)

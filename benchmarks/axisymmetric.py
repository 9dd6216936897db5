"""Axisymmetric problems against closed forms and other codes, as a table:
``python3 -m archord.benchmarks.axisymmetric``.

Coordinates are x = r and y = z; the axis is x = 0. Every mesh has at most 3000 nodes.

- A thick sphere and a thick cylinder under inner pressure, elastic (Lame) and perfectly plastic.
  The sphere that yields up to the radius c carries ``2 sigY (ln(c/a) + (1 - c^3/b^3)/3)`` and moves
  outside by ``(1 - nu) sigY c^3/(E b^2)`` (Hill 1950, chapter V). The cylinder in plane strain
  carries ``2/sqrt(3) sigY ln(b/a)``.
- A rigid and an elastic ball on a half-space: Hertz, whose P follows from the depth, a and p0 from
  the force. The half-space is a ball of 300 contact radii, whose outside is held.
- A rigid ball pressed deep into a half-space that yields perfectly, against a mesh twice as fine
  and steps half as long.
- A ring of finite length on a longer solid shaft, against CalculiX 2.20 (CAX8, twice as fine).
- A punch with rounded edges on a foundation, by the drawing of NAFEMS R0094, "Advanced finite
  element contact benchmarks", benchmark 2, without friction, against CalculiX 2.20 (CAX6).
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Sketch, mesh_joint
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.output.folder import MESH
from archord.output.run import solve_scene
from archord.postprocess.run import Run
from archord.presets.words import words_of
from archord.report.table import Table
from archord.solver.problem import Body, Interaction, Load, Problem, Support

E = 1.0
NU = 0.3
MODULUS = E / (1 - NU**2)
SIGY = 1e-3
INNER = 1.0  # radii of the thick sphere and the thick cylinder
OUTER = 2.0
PRESSURE = 1e-3  # in elastic ones
PLASTIC_RADIUS = 1.4  # up to which the thick sphere yields
BALL = 200.0  # radius of the rigid ball, in contact radii: Hertz neglects what is of the order a/R
SMALL_BALL = 20.0  # and of the one that is pressed in deep
FAR = 300.0  # radius of the half-space, in contact radii
FINE_FORCE = 0.182372  # of the deep indentation: 8697 nodes, 40 steps


class Compared(NamedTuple):
    """A number of archord beside its ``reference``, and who gives that."""

    what: str
    reference: float
    by: str
    ours: float


@dataclass(frozen=True)
class Case:
    """A problem, and what its last step is compared with."""

    name: str
    problem: Callable[[], Problem]
    compare: Callable[[Run], Iterator[Compared]]


def _problem(mesh: TaggedMesh, material: Any, **parts: Any) -> Problem:
    body = Body("body", material)
    return Problem(mesh, [body], kinematics="axisymmetric", **parts)


def _elastic() -> Elastic:
    return Elastic(E, NU)


def _perfect() -> J2Material:
    return J2Material(E, NU, hardening=LinearHardening(SIGY))


# The thick sphere, whose half above the equator is meshed


def sphere_mesh(size: float = 0.08) -> TaggedMesh:
    """A quarter of a ring, with elements of this ``size``."""
    sketch = Sketch(["body"], ["bore", "outside", "equator", "axis"])
    arcs = {
        name: sketch.path("body", (r, 0.0), (0.0, r), on=Circle(name, (0.0, 0.0), r))
        for name, r in (("bore", INNER), ("outside", OUTER))
    }
    equator = sketch.path("body", (INNER, 0.0), (OUTER, 0.0))
    axis = sketch.path("body", (0.0, INNER), (0.0, OUTER))
    sketch.face("body", **arcs, equator=equator, axis=axis)
    sketch.sizes["body"] = f"{size!r}"
    return mesh_joint(MPI.COMM_SELF, sketch, radius=1.0)


def _sphere(material: Any, pressure: float, steps: int) -> Problem:
    return _problem(
        sphere_mesh(),
        material,
        supports=[Support("equator", fixed="y"), Support("axis", fixed="x")],
        loads=[Load("oil", on="bore", pressure=pressure)],
        steps=steps,
    )


def _radial(run: Run, radius: float) -> float:
    """Mean radial displacement of the nodes at a distance from the origin."""
    fields = run.fields()
    distance = np.linalg.norm(fields.coordinates, axis=1)
    at = np.abs(distance - radius) < 1e-6
    direction = fields.coordinates[at] / distance[at, None]
    return float((fields.displacement[at] * direction).sum(axis=1).mean())


def _elastic_sphere(run: Run) -> Iterator[Compared]:
    a3 = INNER**3
    b3 = OUTER**3
    hoop = PRESSURE * (a3 + b3 / 2) / (b3 - a3)
    exact = INNER / E * ((1 - NU) * hoop + NU * PRESSURE)
    yield Compared("u(a)", exact, "Lame", _radial(run, INNER))


def plastic_pressure() -> float:
    """The pressure under which the sphere yields up to `PLASTIC_RADIUS`."""
    c = PLASTIC_RADIUS
    return 2 * SIGY * (math.log(c / INNER) + (1 - c**3 / OUTER**3) / 3)


def _plastic_sphere(run: Run) -> Iterator[Compared]:
    exact = (1 - NU) * SIGY * PLASTIC_RADIUS**3 / (E * OUTER**2)
    yield Compared("u(b)", exact, "Hill", _radial(run, OUTER))


# The thick cylinder in plane strain

_HEIGHT = 0.4


def cylinder_mesh(size: float = 0.05) -> TaggedMesh:
    """A rectangle, with elements of this ``size``."""
    sketch = Sketch(["body"], ["bore", "outside", "ends"])
    corners = [(INNER, 0.0), (OUTER, 0.0), (OUTER, _HEIGHT), (INNER, _HEIGHT)]
    below, outside, above, bore = sketch.path("body", *corners, corners[0])
    sketch.face("body", bore=[bore], outside=[outside], ends=[below, above])
    sketch.sizes["body"] = f"{size!r}"
    return mesh_joint(MPI.COMM_SELF, sketch, radius=1.0)


def _cylinder(material: Any, load: Load, steps: int) -> Problem:
    held = [Support("ends", fixed="y")]
    return _problem(cylinder_mesh(), material, supports=held, loads=[load], steps=steps)


def _elastic_cylinder(run: Run) -> Iterator[Compared]:
    a2 = INNER**2
    b2 = OUTER**2
    exact = PRESSURE * INNER * (1 + NU) / E * ((1 - 2 * NU) * a2 + b2) / (b2 - a2)
    fields = run.fields()
    at = fields.coordinates[:, 0] < INNER + 1e-6
    yield Compared("u(a)", exact, "Lame", float(fields.displacement[at, 0].mean()))


def _plastic_cylinder(run: Run) -> Iterator[Compared]:
    exact = 2 / math.sqrt(3) * SIGY * math.log(OUTER / INNER)
    force = run.columns["push force"][-1]
    ours = force / (2 * math.pi * INNER * _HEIGHT)
    yield Compared("limit pressure", exact, "Hill", ours)


# A rigid ball on a half-space


def half_space_mesh(near: str, fine: float) -> TaggedMesh:
    """A quarter of a disc below y = 0, with elements of the size ``near`` the ball up to the radius
    ``fine``, growing beyond."""
    sketch = Sketch(["body"], ["surface", "axis", "far"])
    _draw_half_space(sketch, fine)
    sketch.sizes["body"] = f"{near} + 0.3 * Max(Sqrt(x*x + y*y) - {fine!r}, 0)"
    return mesh_joint(MPI.COMM_SELF, sketch, radius=1.0)


def _draw_half_space(sketch: Sketch, fine: float) -> None:
    surface = sketch.path("body", (0.0, 0.0), (fine, 0.0), (FAR, 0.0))
    far = sketch.path("body", (FAR, 0.0), (0.0, -FAR), on=Circle("far", (0.0, 0.0), FAR))
    axis = sketch.path("body", (0.0, -FAR), (0.0, -fine), (0.0, 0.0))
    sketch.face("body", surface=surface, far=far, axis=axis)


def _ball(mesh: TaggedMesh, material: Any, radius: float, depth: float, steps: int) -> Problem:
    ball = RigidCircle(np.array([0.0, radius]), radius)
    return _problem(
        mesh,
        material,
        interactions=[Interaction("contact", (ball, "surface"))],
        supports=[Support("far", fixed="xy"), Support("axis", fixed="x")],
        loads=[Load("ball", on="contact", direction="y", displacement=-depth)],
        steps=steps,
    )


# finer where the contact ends
_EDGE = "Min(0.02 + 0.1 * Sqrt((x - 1)^2 + y*y), 0.11)"


def balls_mesh() -> TaggedMesh:
    """A half ball on a quarter of a disc, which touch in the origin."""
    names = ["ball surface", "ball top", "ball axis", "surface", "axis", "far"]
    sketch = Sketch(["ball", "body"], names)
    fine = 1.5
    near = "Min(0.03 + 0.15 * Sqrt((x - 1)^2 + y*y), 0.15)"
    size = f"{near} + 0.45 * Max(Sqrt(x*x + y*y) - {fine}, 0)"
    angle = fine / BALL
    below = (BALL * math.sin(angle), BALL - BALL * math.cos(angle))
    on_ball = Circle("ball surface", (0.0, BALL), BALL)
    sketch.face(
        "ball",
        **{
            "ball surface": sketch.path("ball", (0.0, 0.0), below, (BALL, BALL), on=on_ball),
            "ball top": sketch.path("ball", (BALL, BALL), (0.0, BALL)),
            "ball axis": sketch.path("ball", (0.0, BALL), (0.0, fine), (0.0, 0.0)),
        },
    )
    _draw_half_space(sketch, fine)
    sketch.sizes |= {"ball": size, "body": size}
    return mesh_joint(MPI.COMM_SELF, sketch, radius=1.0)


def _balls() -> Problem:
    return Problem(
        balls_mesh(),
        [Body("ball", _elastic()), Body("body", _elastic())],
        [Interaction("contact", ("ball surface", "surface"))],
        [
            Support("far", fixed="xy"),
            Support("axis", fixed="x"),
            Support("ball axis", fixed="x"),
        ],
        [Load("ball", on="ball top", direction="y", displacement=-1 / BALL)],
        steps=4,
        kinematics="axisymmetric",
    )


def _hertz(run: Run, modulus: float) -> Iterator[Compared]:
    """P from the depth, a and p0 from the force, by the contact ``modulus`` E*."""
    force = abs(run.columns["ball force"][-1])
    depth = abs(run.columns["ball displacement"][-1])
    radius = (3 * force * BALL / (4 * modulus)) ** (1 / 3)
    pressure = 3 * force / (2 * math.pi * radius**2)
    exact = 4 / 3 * modulus * math.sqrt(BALL) * depth**1.5
    area = run.columns["contact contact area"][-1]
    yield Compared("P", exact, "Hertz", force)
    yield Compared("a", radius, "Hertz", math.sqrt(area / math.pi))
    yield Compared("p0", pressure, "Hertz", run.columns["contact largest pressure"][-1])


def _indentation(run: Run) -> Iterator[Compared]:
    force = abs(run.columns["ball force"][-1])
    yield Compared("P", FINE_FORCE, "finer mesh", force)


# A ring on a shaft, whose half above the middle is meshed: mm, MPa

STEEL = 210e3
SHAFT_LENGTH = 1.5
RING_LENGTH = 0.5
FIT = 0.001  # the interference in radius


def fit_mesh(n: int = 10) -> TaggedMesh:
    """Rectangles in quadrilaterals: ``n`` across each body and along the ring, finer toward the
    edge of the contact."""

    def draw(gmsh: Any) -> None:
        geo = gmsh.model.geo
        ratio = 1.25 ** (8 / n)
        shaft = _column(gmsh, (0.0, 1.0), (0.0, RING_LENGTH, SHAFT_LENGTH), n, (1 / ratio, 1.1))
        ring = _column(gmsh, (1.0, 2.0), (0.0, RING_LENGTH), n, (1 / ratio,))
        geo.synchronize()
        for name, sides in (("shaft", shaft), ("ring", ring)):
            gmsh.model.addPhysicalGroup(2, sides.pop("faces"), name=name)
            for side, lines in sides.items():
                gmsh.model.addPhysicalGroup(1, lines, name=f"{name} {side}")

    return gmsh_to_mesh(MPI.COMM_SELF, draw, quads=True)


def _column(
    gmsh: Any, x: tuple[float, float], y: tuple[float, ...], n: int, growth: tuple[float, ...]
) -> dict[str, list[int]]:
    """Rectangles on top of each other; their faces, and the lines of their sides."""
    geo = gmsh.model.geo
    across = growth[0] if x[0] == 0 else 1 / growth[0]  # finer toward the other body

    def line(start: int, end: int, ratio: float) -> int:
        made = geo.addLine(start, end)
        geo.mesh.setTransfiniteCurve(made, n + 1, "Progression", ratio)
        return made

    left = [geo.addPoint(x[0], height, 0.0) for height in y]
    right = [geo.addPoint(x[1], height, 0.0) for height in y]
    levels = [line(a, b, across) for a, b in zip(left, right, strict=True)]
    inside = [line(*ends, ratio) for ends, ratio in zip(pairwise(left), growth, strict=True)]
    outside = [line(*ends, ratio) for ends, ratio in zip(pairwise(right), growth, strict=True)]
    faces = []
    for k in range(len(growth)):
        loop = geo.addCurveLoop([levels[k], outside[k], -levels[k + 1], -inside[k]])
        faces.append(geo.addPlaneSurface([loop]))
        geo.mesh.setTransfiniteSurface(faces[-1])
        geo.mesh.setRecombine(2, faces[-1])
    return {"faces": faces, "middle": levels[:1], "inside": inside, "outside": outside}


def _fit() -> Problem:
    steel = Elastic(STEEL, NU)
    surfaces = ("shaft outside", "ring inside")
    supports = [
        Support("axis", on="shaft inside", fixed="x"),
        Support("shaft middle", fixed="y"),
        Support("ring middle", fixed="y"),
    ]
    return Problem(
        fit_mesh(),
        [Body("shaft", steel), Body("ring", steel)],
        [Interaction("fit", surfaces, interference=FIT)],
        supports,
        [Load("nothing", on="ring outside", pressure=0.0)],
        steps=1,
        kinematics="axisymmetric",
    )


def _displacement(run: Run, place: tuple[float, float]) -> Any:
    """Displacement ``(2,)`` of the node at a place."""
    fields = run.fields()
    nearest = np.linalg.norm(fields.coordinates - place, axis=1).argmin()
    return fields.displacement[nearest]


def _fitted(run: Run) -> Iterator[Compared]:
    for what, place, axis, reference in (
        ("u_r outside, middle", (2.0, 0.0), 0, 5.23789e-4),
        ("u_r outside, end", (2.0, RING_LENGTH), 0, 5.24625e-4),
        ("u_z of the shaft's end", (0.0, SHAFT_LENGTH), 1, 1.53357e-4),
    ):
        yield Compared(what, reference, "CalculiX", float(_displacement(run, place)[axis]))


# A punch with rounded edges on a foundation: mm, MPa


def punch_mesh() -> TaggedMesh:
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
    size = "0.4 + 0.2 * Sqrt((x - 40.5)^2 + y*y)"
    sketch.sizes |= {"punch": size, "foundation": size}
    return mesh_joint(MPI.COMM_SELF, sketch, radius=1.0)


def _punch() -> Problem:
    supports = [
        Support("base", fixed="xy"),
        Support("axis", fixed="x"),
        Support("punch axis", fixed="x"),
    ]
    aluminium = Elastic(70e3, NU)
    return Problem(
        punch_mesh(),
        [
            Body("punch", Elastic(STEEL, NU)),
            Body("foundation", aluminium),
        ],
        [Interaction("contact", ("punch base", "top"))],
        supports,
        [Load("press", on="punch top", pressure=100.0)],
        steps=2,
        kinematics="axisymmetric",
    )


def _punched(run: Run) -> Iterator[Compared]:
    for what, place, axis, reference in (
        ("u_z of the punch's top", (0.0, 100.0), 1, -0.182072),
        ("u_r of the foundation's top", (60.0, 0.0), 0, -0.0101585),
    ):
        yield Compared(what, reference, "CalculiX", float(_displacement(run, place)[axis]))


def _solved(problem: Problem, folder: Path) -> Run:
    """The run of a ``problem`` in an empty ``folder``."""
    solve_scene(words_of(problem, str(folder / MESH)), folder, problem=problem)
    return Run(folder)


CASES = (
    Case("thick sphere, elastic", lambda: _sphere(_elastic(), PRESSURE, 1), _elastic_sphere),
    Case(
        "thick sphere, plastic",
        lambda: _sphere(_perfect(), plastic_pressure(), 10),
        _plastic_sphere,
    ),
    Case(
        "thick cylinder, elastic",
        lambda: _cylinder(_elastic(), Load("oil", on="bore", pressure=PRESSURE), 1),
        _elastic_cylinder,
    ),
    Case(
        "thick cylinder, plastic",
        lambda: _cylinder(
            _perfect(),
            Load("push", on="bore", direction="x", displacement=20 * SIGY),
            20,
        ),
        _plastic_cylinder,
    ),
    Case(
        "rigid ball on a half-space",
        lambda: _ball(half_space_mesh(_EDGE, 1.5), _elastic(), BALL, 1 / BALL, 4),
        lambda run: _hertz(run, MODULUS),
    ),
    Case("elastic ball on a half-space", _balls, lambda run: _hertz(run, MODULUS / 2)),
    Case(
        "rigid ball deep in a half-space",
        lambda: _ball(half_space_mesh("0.28", 6.0), _perfect(), SMALL_BALL, 0.5, 20),
        _indentation,
    ),
    Case("ring pressed on a shaft", _fit, _fitted),
    Case("punch with rounded edges", _punch, _punched),
)


def rows(case: Case) -> Iterator[tuple[str, ...]]:
    """Solve a ``case``; its rows of the table."""
    start = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        run = _solved(case.problem(), Path(folder))
        seconds = perf_counter() - start
        nodes = len(run.fields().coordinates)
        found = list(case.compare(run))
    iterations = round(sum(run.columns["iterations"]))
    cost = (str(2 * nodes), str(nodes), str(iterations), f"{seconds:.1f}")
    for what, reference, by, ours in found:
        off = f"{ours / reference - 1:+.2%}"
        yield (case.name, what, f"{reference:.6g}", by, f"{ours:.6g}", off, *cost)


def main() -> None:
    """Solve all cases and print the table."""
    headings = ["case", "quantity", "reference", "by", "archord", "relative difference"]
    headings += ["dofs", "nodes", "iterations", "seconds"]
    table = Table(*headings)
    for case in CASES:
        for row in rows(case):
            table.add(*row)
    print(table.markdown())


if __name__ == "__main__":
    main()

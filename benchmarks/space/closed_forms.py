"""Bodies in space against closed forms, and against the same bodies in a plane or around an axis:
``python3 -m archord.benchmarks.space.closed_forms``.

Names of forms choose among them, numbers are sizes of elements instead of their own: ``python3 -m
archord.benchmarks.space.closed_forms balls 0.2``.

- Hill and Lame: a thick sphere under inner pressure, as in `archord.benchmarks.axisymmetric`.
- Hertz: a ball on a half-space, of the same material. P follows from the depth, the radius a of the
  contact and the pressure p0 in its middle from P.
- Cattaneo and Mindlin: the same ball, pushed aside by Q with friction mu. Within the radius ``c =
  a (1 - Q/(mu P))^(1/3)`` it sticks. It moves by ``3 mu P (2 - nu)/(8 G a) (1 - (c/a)^2)`` (Johnson
  1985, Contact Mechanics, section 7.2). Here nu = 0: otherwise points slip aside a little, too,
  which the closed form neglects.
"""

from __future__ import annotations

import math
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from archord.benchmarks.axisymmetric import balls, thick_walls
from archord.benchmarks.axisymmetric.case import (
    Compared,
    E,
    elastic,
    perfectly_plastic,
    solved,
)
from archord.benchmarks.case import meshed, named
from archord.benchmarks.space import planes
from archord.benchmarks.space.revolved import revolved
from archord.benchmarks.space.sockets import AXIS, layer, pressed, socket_sketch
from archord.materials.elasticity import Elastic
from archord.materials.material import Material
from archord.postprocess.run import Run
from archord.report.by_name import ByName
from archord.report.table import Table
from archord.solver.problem import Body, Interaction, Load, Problem, Support

FRICTION = 0.2
_PUSHED = 0.6  # by this part of the displacement at which the ball would slide
_THIN = 0.05  # thickness over R
_QUARTER = (Support("start", fixed="z"), Support("end", fixed="x"))
_HALF = (Support("start", fixed="z"), Support("end", fixed="z"))


@dataclass(frozen=True)
class Form:
    """What is compared on elements of a ``size``, and how near each number shall come."""

    compare: Callable[[float], Iterator[Compared]]
    size: float
    goals: tuple[float, ...]


@contextmanager
def _run_of(problem: Problem) -> Iterator[Run]:
    with tempfile.TemporaryDirectory() as folder:
        yield solved(problem, Path(folder))


def _thick_sphere(size: float, material: Material, pressure: float, steps: int) -> Problem:
    return Problem(
        revolved(thick_walls.sphere_sketch(size), 1),
        [Body("body", material)],
        supports=[*_QUARTER, Support("equator", fixed="y")],
        loads=[Load("oil", on="bore", pressure=pressure)],
        steps=steps,
        symmetry=8,
    )


def lame(size: float) -> Iterator[Compared]:
    """An eighth of an elastic sphere."""
    with _run_of(_thick_sphere(size, elastic(), thick_walls.PRESSURE, 1)) as run:
        yield from thick_walls.lame_sphere(run)


def hill(size: float) -> Iterator[Compared]:
    """An eighth of a sphere that yields without hardening."""
    pressure = thick_walls.plastic_pressure()
    with _run_of(_thick_sphere(size, perfectly_plastic(), pressure, 10)) as run:
        yield from thick_walls.hill_sphere(run)


def _balls(
    size: float,
    quarters: int,
    *pushed: Load,
    material: Material | None = None,
    friction: float = 0.0,
    **how: Any,
) -> Problem:
    material = material or elastic()
    down = -1 / balls.BALL
    press = Load("ball", on="ball top", direction="y", displacement=[down] * (1 + len(pushed)))
    return Problem(
        revolved(balls.balls_sketch(repr(size)), quarters),
        [Body("ball", material), Body("body", material)],
        [Interaction("contact", ("ball surface", "surface"), friction=friction)],
        [Support("far", fixed="xyz"), *(_QUARTER if quarters == 1 else _HALF)],
        [press, *pushed],
        symmetry=4 / quarters,
        **how,
    )


def hertz(size: float) -> Iterator[Compared]:
    """A quarter of the ball; its peak is recovered at the corners of facets."""
    with _run_of(_balls(size, 1, steps=2)) as run:
        peak = max(surface.corner_pressure.max() for surface in run.contact().values())
        yield from balls.hertz(run, balls.MODULUS / 2, peak=peak)


def mindlin(size: float) -> Iterator[Compared]:
    """Half the ball: the largest stick radius, and the displacement at Q."""
    share = 3 * FRICTION * 2 * 2 / (8 * E)
    force = 2 / 3 * E / balls.BALL  # by Hertz, at a = 1
    aside = _PUSHED * share * force
    push = Load("push", on="ball top", direction="x", displacement=[0.0, aside])
    how: ByName = {"material": Elastic(E, 0.0), "friction": FRICTION, "steps": [2, 4]}
    with _run_of(_balls(size, 2, push, **how)) as run:
        pressing = abs(run.columns["ball force"][-1])
        pushing = abs(run.columns["push force"][-1])
        radius = (3 * pressing * balls.BALL / (2 * E)) ** (1 / 3)
        stuck = (1 - pushing / (FRICTION * pressing)) ** (1 / 3)
        surface = run.contact()["surface"]
        touching = surface.weight * (surface.raw_pressure > 0)
        ratio = math.sqrt((touching * surface.sticks).sum() / touching.sum())
        yield Compared("c/a", stuck, "Cattaneo", ratio)
        expected = share * pressing / radius * (1 - stuck**2)
        yield Compared("displacement", expected, "Mindlin", aside)


def socket(size: float) -> Iterator[Compared]:
    """A quarter of a ball in a conforming socket beside the same around an axis."""
    axial = meshed(socket_sketch(size / 6))
    with _run_of(pressed(axial, AXIS, kinematics="axisymmetric")) as run:
        expected = run.columns["press force"][-1]
    with _run_of(pressed(revolved(socket_sketch(size), 1), _QUARTER, symmetry=4)) as run:
        yield Compared("P", expected, "axisymmetric", run.columns["press force"][-1])


def thin(size: float) -> Iterator[Compared]:
    """The paper's joint, elastic and thin, beside plane stress on the same sizes of elements."""
    joint = {"joint": planes.JOINT | {"relative_element_size": size}, "block": planes.STEEL}
    flat = planes.solved(joint | {"analysis": {"plane": "stress"}})
    thickness = _THIN * joint["joint"]["radius"]
    solid = planes.solved(joint | {"space": {"thickness": thickness, "rim_ratio": 1.0}})
    yield Compared("P", thickness * flat[-1]["P"], "plane stress", solid[-1]["P"])


FORMS = {
    "elastic sphere": Form(lame, 0.18, (1e-3,)),
    "plastic sphere": Form(hill, 0.18, (2e-3,)),
    "balls": Form(hertz, 0.12, (0.01, 0.01, 0.01)),
    "pushed ball": Form(mindlin, 0.2, (0.02, 0.02)),
    "socket": Form(socket, 1.5, (2e-3,)),
    "layer": Form(layer, 3.0, (1e-9, 1e-3)),
    "thin joint": Form(thin, 0.1, (2e-3,)),
}


def main(arguments: Sequence[str]) -> None:
    """Print the table of the forms and sizes that the ``arguments`` name."""
    chosen, sizes = named(arguments, FORMS)
    numbers = ("expected {:.6g}", "archord {:.6g}", "off {:+.1e}", "goal {:g}")
    table = Table("form", "size {:g}", "quantity", "by", *numbers, left=1)
    for name in chosen or FORMS:
        form = FORMS[name]
        for size in sizes or [form.size]:
            for found, goal in zip(form.compare(size), form.goals, strict=True):
                what, expected, by, ours = found
                table.add(name, size, what, by, expected, ours, ours / expected - 1, goal)
    print(table.markdown())


if __name__ == "__main__":
    main(sys.argv[1:])

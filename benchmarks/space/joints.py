"""Joints in space, and the values of other codes for them, in N of the whole joint, mm and MPa.

A pin of radius 10 is pressed down into a block of thickness 10, whose hole has the radius 10.05.
They touch at the beginning. The block is held at its top, in its planes of symmetry x = 0 and z =
0, and free otherwise; so is the pin, which is moved at its top. In the clevis the block is a lug
that is pulled up at its top, and the pin runs on into a fork that is held at its own.

The values are limits of CalculiX (C3D20R) and of two independent prototypes (tetrahedra of 10 and
hexahedra of 20 nodes), each on several meshes. They agree within the uncertainty beside each value.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from mpi4py import MPI

from archord.benchmarks.space.case import NU, PRESS, Case, E, Reference
from archord.benchmarks.space.drawing import CLEARANCE, Size, mesh_of_clevis, mesh_of_joint
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.materials.material import Material
from archord.solver.contact.interaction import Interaction
from archord.solver.path.system import System
from archord.solver.problem import Body, Load, Problem, Support

THICKNESS = 10.0
FORK_END = 30.0
DEEP = 0.1
_ASIDE = 1.5  # how far from the lowest line pressures are taken
_MIDDLE = 1.0  # and from z = 0
_BAND = 1.3  # and from a depth below the face, as a ratio
# size of elements at the edge over the size elsewhere
_AT_EDGE = 0.25
_AT_SINGULAR_EDGE = 0.1
_Y = 1
_ELASTIC = Elastic(E, NU)
_YIELDING = J2Material(E, NU, hardening=LinearHardening(300.0))


def joint(
    size: Size,
    *,
    block: Material = _ELASTIC,
    deepest: float = DEEP,
    pin_length: float = THICKNESS,
    friction: float = 0.0,
) -> Problem:
    """A pin of this length in a block, which it presses ``deepest``."""
    mesh = mesh_of_joint(MPI.COMM_WORLD, size, THICKNESS, pin_length)
    return Problem(
        mesh,
        bodies=[Body("block", block), Body("pin", _ELASTIC)],
        interactions=[Interaction("contact", ("pin", "hole"), friction=friction)],
        supports=[*_symmetry("block", "pin"), Support("block top", fixed="xy")],
        loads=[Load(PRESS, on="pin top", direction="y", displacement=-deepest)],
        symmetry=4,
    )


def clevis(size: Size) -> Problem:
    """A pin through a lug and a fork, which are pulled apart."""
    mesh = mesh_of_clevis(MPI.COMM_WORLD, size, THICKNESS, FORK_END)
    return Problem(
        mesh,
        bodies=[Body(name, _ELASTIC) for name in ("lug", "fork", "pin")],
        interactions=[
            Interaction("at lug", ("pin in lug", "lug hole")),
            Interaction("at fork", ("pin in fork", "fork hole")),
        ],
        supports=[
            *_symmetry("lug", "pin"),
            Support("fork side", fixed="x"),
            Support("fork top", fixed="xyz"),
            Support("lug", on="lug top", fixed="x"),
        ],
        loads=[Load(PRESS, on="lug top", direction="y", displacement=DEEP)],
        symmetry=4,
    )


def _symmetry(*bodies: str) -> list[Support]:
    """The planes x = 0 and z = 0 of these ``bodies``."""
    sides = [Support(f"{body} side", fixed="x") for body in bodies]
    return [*sides, *(Support(f"{body} middle", fixed="z") for body in bodies)]


def axis_displacement(z: float, system: System) -> float:
    """Displacement along y of the pin's axis at this ``z``."""
    nodes = system.V.tabulate_dof_coordinates()[: system.V.dofmap.index_map.size_local]
    x, y, heights = nodes.T
    from_axis = np.hypot(x, y + CLEARANCE)
    off = from_axis + np.abs(heights - z)
    found = system.equilibrium.displacement()[: len(nodes), _Y][off < 1e-6]
    return float(np.concatenate(system.comm.allgather(found)).mean())


def pressure_over_middle(depth: float, system: System) -> float:
    """Pressure at the lowest line of the hole, ``depth`` below its face, over the same in the
    middle."""
    pair = next(pair for pair in system.contact.pairs if pair.surface.name == "hole")
    point = pair.surface.point.reshape(-1, 3)
    here = point[:, 0], THICKNESS - point[:, 2], pair.traction[:, 0]
    of_ranks = system.comm.allgather(np.stack(here, axis=1))
    aside, below, pressure = np.concatenate(of_ranks).T
    is_low = aside < _ASIDE
    middle = pressure[is_low & (below > THICKNESS - _MIDDLE)].mean()
    ratio = below / depth
    near = is_low & (ratio > 1 / _BAND) & (ratio < _BAND)
    # straight where a power of the distance to the edge is singular
    _, at_depth = np.polyfit(np.log(ratio[near]), np.log(pressure[near]), 1)
    return float(np.exp(at_depth) / middle)


def _with_edge(size: float, ratio: float = _AT_EDGE) -> Size:
    return Size(size, at_edge=ratio * size, edge=THICKNESS)


def _over_middle(depth: float, value: float, uncertainty: float) -> Reference:
    name = f"p/p(0), {depth:g} below the face"
    return Reference(name, DEEP, value, uncertainty, partial(pressure_over_middle, depth))


CASES = {
    "elastic": Case(
        "elastic",
        lambda size: joint(Size(size)),
        [Reference("P", 0.05, 95_876.0, 30.0), Reference("P", 0.1, 221_445.0, 30.0)],
        deepest=DEEP,
        steps=2,
        size=1.2,
    ),
    "longer": Case(
        "elastic, longer pin",
        lambda size: joint(_with_edge(size, _AT_SINGULAR_EDGE), pin_length=1.5 * THICKNESS),
        [
            Reference("P", DEEP, 229_010.0, 60.0),
            _over_middle(1.0, 1.18, 0.01),
            _over_middle(0.5, 1.33, 0.01),
        ],
        deepest=DEEP,
        steps=2,
        size=1.2,
    ),
    "equal": Case(
        "elastic, edge of equal length",
        lambda size: joint(_with_edge(size)),
        [
            _over_middle(2.0, 0.936, 0.002),
            _over_middle(1.0, 0.890, 0.002),
            _over_middle(0.5, 0.853, 0.002),
        ],
        deepest=DEEP,
        steps=2,
        size=1.2,
    ),
    "A": Case(
        "A: block yields",
        lambda size: joint(Size(size), block=_YIELDING, deepest=0.16),
        [
            Reference("P", 0.04, 72_018.0, 40.0),
            Reference("P", 0.1, 127_259.0, 200.0),
            Reference("P", 0.16, 129_472.0, 250.0),
        ],
        deepest=0.16,
        steps=8,
        size=1.2,
    ),
    "C": Case(
        "C: friction 0.2",
        lambda size: joint(Size(size), friction=0.2),
        [Reference("P", DEEP, 236_600.0, 200.0)],
        deepest=DEEP,
        steps=4,
        size=1.2,
    ),
    "D": Case(
        "D: clevis",
        lambda size: clevis(Size(size)),
        [
            Reference("P", DEEP, 83_260.0, 150.0),
            Reference("axis at z = 0", DEEP, 0.06714, 5e-5, partial(axis_displacement, 0.0)),
            Reference("axis at z = 10", DEEP, 0.0510, 5e-5, partial(axis_displacement, THICKNESS)),
        ],
        deepest=DEEP,
        steps=2,
        size=1.2,
    ),
}

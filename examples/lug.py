"""A straight lug in plane strain, loaded by a pin with clearance: its force, and how far it yields.

    python3 examples/lug.py            # elastic
    python3 examples/lug.py yield      # the lug hardens by a table of true stress over PEEQ

Steel, mm and N per mm of thickness; half of both bodies is modelled. The reference forces are those of two codes, one
of them CalculiX 2.20 (elements of order two), each refined until the digits stood. With hardening they depend on the
steps: with 15 equal ones, as here, P at 0.2 mm is 0.16 % above the reference, with 60 it is 0.39 %.
"""

import sys
from itertools import pairwise

import numpy as np
from mpi4py import MPI

from archord import Elastic, J2Material, System, TabularHardening, gmsh_to_mesh
from archord.solver.problem import Body, Interaction, Problem, Support

E, NU, SIZE, GROWTH, STEP = 210000.0, 0.3, 0.5, 0.25, 0.02
HARDENING = TabularHardening(((0.0, 355.0), (0.02, 400.0), (0.1, 500.0), (0.3, 550.0)))
REFERENCE = {
    "elastic": {0.02: 590.7, 0.05: 1695.3, 0.1: 4001, 0.15: 6683, 0.2: 9539, 0.25: 12475, 0.3: 15451},
    "yield": {0.1: 3829.4, 0.2: 5413.5, 0.3: 5828},
}
CIRCLES = {"hole": (0.0, 10.0), "pin": (0.1, 9.9), "end": (0.0, 20.0)}  # x of the centre, radius


def lug(gmsh):
    """Hole and round end about the origin, clamped at x = -60; the pin's half x > 0.1 touches the hole at x = 10."""
    model, point = gmsh.model.geo, lambda x, y: gmsh.model.geo.addPoint(x, y, 0)
    origin, centre, *hole = (point(x, y) for x, y in ((0, 0), (0.1, 0), (10, 0), (0, 10), (-10, 0)))
    corners = [point(x, y) for x, y in ((-60, 0), (-60, 20), (0, 20), (20, 0))]
    arcs = [model.addCircleArc(a, origin, b) for a, b in pairwise(hole)]
    back, clamp, side = (model.addLine(a, b) for a, b in pairwise([hole[2], *corners[:3]]))
    end, front = model.addCircleArc(corners[2], origin, corners[3]), model.addLine(corners[3], hole[0])
    tip, top = point(10, 0), point(0.1, 9.9)
    arc, flat, axis = model.addCircleArc(tip, centre, top), model.addLine(top, centre), model.addLine(centre, tip)
    loops = {"lug": [*arcs, back, clamp, side, end, front], "pin": [arc, flat, axis]}
    faces = {name: model.addPlaneSurface([model.addCurveLoop(loop)]) for name, loop in loops.items()}
    model.synchronize()
    lines = {"hole": arcs, "pin": [arc], "end": [end], "clamp": [clamp], "flat": [flat], "axis": [back, front, axis]}
    for name, face in faces.items():
        gmsh.model.addPhysicalGroup(2, [face], name=name)
    for tag, (name, curves) in enumerate(lines.items(), 1):
        gmsh.model.addPhysicalGroup(1, curves, tag, name=name)
    size = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(size, "F", f"{SIZE} + {GROWTH} * Abs(Sqrt(x*x + y*y) - 10)")
    gmsh.model.mesh.field.setAsBackgroundMesh(size)


def rounded(x, tag):
    """The nodes ``x`` of the lines ``tag`` on their circle: straight edges would swamp the clearance."""
    if tag > len(CIRCLES):
        return x
    centre, radius = list(CIRCLES.values())[tag - 1]
    ray = x - [centre, 0.0]
    return [centre, 0.0] + radius * ray / np.linalg.norm(ray, axis=1)[:, None]


yields = "yield" in sys.argv
elastic, hard = Elastic(E, NU, "strain"), J2Material(E, NU, "strain", HARDENING)
bodies = [Body("pin", elastic), Body("lug", hard if yields else elastic)]
supports = [Support("axis", "axis", 1), Support("clamp", "clamp", 0), Support("clamp", "clamp", 1)]
supports.append(Support("flat", "flat", 0, rate=1.0))
mesh = gmsh_to_mesh(MPI.COMM_WORLD, lug, rounded)
system = System(Problem(mesh, bodies, [Interaction("contact", ("pin", "hole"))], supports, symmetry=2.0))
differences, reached = {}, 0.0
for d, expected in REFERENCE["yield" if yields else "elastic"].items():
    steps = round((d - reached) / STEP) if yields else 1
    system.solve(np.linspace(reached, d, steps + 1)[1:])
    reached = d
    P, peeq = system.reaction("flat")[0], system.peeq()[0]
    differences[d] = P / expected - 1
    if mesh.mesh.comm.rank == 0:
        print(
            f"d = {d:g} mm: P = {P:.1f} N/mm, reference {expected:g} ({differences[d]:+.2%}), largest PEEQ {peeq:.1e}"
        )

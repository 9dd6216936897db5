"""What the scripts ``*_joint.py`` share: the paper's quarter joint, its mesh by gmsh, the load
path, the command line.

Units: R = 1, E* = 1. Plane strain, small strains; perfect J2 plasticity. Elements have the size h
on the arcs and grow by 0.25 times the distance from there, below h = 0.04 by 6.25 h times. A step
without equilibrium is cut.

Each has a class ``Joint(size, growth, order, plastic)``: half of the joint below the pin's
diameter, discretised, with ``dofs``, the unloaded state ``zero`` (a state holds all displacements,
and can be added and multiplied by numbers) and

- ``elastic(delta)``: the state with the pin's top at ``-delta`` of bodies that do not yield; from
then on they do,
- ``solve(guess, delta)``: state and iterations from a state with its prescribed displacements, or
RuntimeError,
- ``commit()``: take over the plastic strain of the state that was solved last,
- ``results()``: P of the whole joint in that state and, where the code tells, p0.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

R = 1.0
DR = 0.005
WIDTH = 100.0
NU = 0.3
E = 2 * (1 - NU**2)
MU = E / (2 * (1 + NU))
LAME = E * NU / ((1 + NU) * (1 - 2 * NU))
SIGY = 0.002
PENALTY = 1e5  # pressure per depth: a usual pressure E* dR/R goes 1e-5 dR deep
ITERATIONS = 25
CUTS = 6
TOLERANCE = 1e-8  # residual over the reaction at which `newton` ends
FAR = 1e3  # and at which it gives up
PIN = (-DR, R)  # height of the centre, and radius
BLOCK = (0.0, R + DR)
_TRIANGLES = 9  # gmsh's numbers of element types: with six nodes
_QUADRILATERALS = 3  # with four


def mesh_bodies(size: float, growth: float, *bodies: tuple[float, float]):
    """Second-order triangles of `PIN`, `BLOCK` or both, nodes on the circles: nodes ``(n, 2)`` and
    elements ``(m, 6)``, corners before midpoints. Elements have ``size`` on the arcs and grow by
    ``growth`` times the distance from there.
    """
    import gmsh

    _draw(gmsh, size, growth, bodies)
    gmsh.option.setNumber("Mesh.ElementOrder", 2)
    gmsh.model.mesh.generate(2)
    return _meshed(gmsh, _TRIANGLES)


def mesh_quadrilaterals(size: float, growth: float, body: tuple[float, float]):
    """Quadrilaterals of `PIN` or `BLOCK`, sized as in `mesh_bodies`: nodes ``(n, 2)``, elements
    ``(m, 4)`` and the edges ``(e, 2)`` of elements on the arc."""
    import gmsh

    # gmsh cuts what it has made, triangles too, into quadrilaterals half as large
    _draw(gmsh, 2 * size, 2 * growth, (body,))
    for option, value in (("Algorithm", 8), ("RecombineAll", 1), ("SubdivisionAlgorithm", 1)):
        gmsh.option.setNumber(f"Mesh.{option}", value)
    gmsh.model.mesh.generate(2)
    nodes, cells = _meshed(gmsh, _QUADRILATERALS)
    (y, radius) = body
    on_arc = np.abs(np.hypot(nodes[:, 0], nodes[:, 1] - y) - radius) < 1e-9
    edges = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    return nodes, cells, edges[on_arc[edges].all(axis=1)]


def _draw(gmsh, size: float, growth: float, bodies) -> None:
    """Start gmsh with the outlines of the bodies and the sizes of their elements."""
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    geo = gmsh.model.geo
    for y, radius in bodies:
        centre, bottom, side = (geo.addPoint(*p, 0) for p in ((0, y), (0, y - radius), (radius, y)))
        outer = [] if (y, radius) == PIN else [(WIDTH, 0), (WIDTH, -WIDTH), (0, -WIDTH)]
        corners = [side, *([geo.addPoint(*p, 0) for p in outer] or [centre]), bottom]
        arc = geo.addCircleArc(bottom, centre, side)
        geo.addPlaneSurface([geo.addCurveLoop([arc, *map(geo.addLine, corners[:-1], corners[1:])])])
        geo.mesh.setTransfiniteCurve(arc, round(np.pi / 2 / size) + 1)
    geo.synchronize()
    field = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(
        field, "F", f"{size} + {growth} * Abs(Sqrt(x*x + y*y) - {R + DR})"
    )
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    for option in ("MeshSizeFromPoints", "MeshSizeExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def _meshed(gmsh, kind: int):
    """Nodes ``(n, 2)`` and elements ``(m, k)`` of gmsh's element type ``kind``; ends gmsh."""
    tags, x, _ = gmsh.model.mesh.getNodes()
    _, of_elements = gmsh.model.mesh.getElementsByType(kind)
    used, cells = np.unique(of_elements, return_inverse=True)
    n_nodes = gmsh.model.mesh.getElementProperties(kind)[3]
    position = np.zeros(int(tags.max()) + 1, dtype=int)
    position[tags] = np.arange(len(tags))
    gmsh.finalize()
    return x.reshape(-1, 3)[position[used], :2], cells.reshape(-1, n_nodes)


def axis_pressure(angle, pressure) -> float | None:
    """Pressure on the axis: an even parabola through those within 0.2 rad."""
    near = angle < 0.2
    return float(np.polyfit(angle[near] ** 2, pressure[near], 1)[1]) if near.sum() > 2 else None


def newton(error, improve) -> int:
    """Full steps ``improve()`` until ``error()``, the residual over the reaction, is small; returns
    their number."""
    for iteration in range(ITERATIONS):
        residual = error()
        if iteration and residual < TOLERANCE:
            return iteration
        if iteration and not residual < FAR:
            break
        improve()
    raise RuntimeError("no equilibrium")


def load(joint, steps: int, delta: float) -> int:
    """Press the pin down by ``delta`` in equal steps, cut where need be; returns the iterations."""
    state = joint.zero
    t = 0.0
    iterations = 0
    cut = 0
    rate = steps * (joint.elastic(delta / steps) - state)
    for step in range(1, steps + 1):
        while t < step / steps - 1e-12:
            dt = min(step / steps - t, 0.5**cut / steps)
            try:
                new, count = joint.solve(state + dt * rate, (t + dt) * delta)
            except RuntimeError:
                cut += 1
                iterations += ITERATIONS
                if cut > CUTS:
                    raise RuntimeError(f"no equilibrium beyond {t * delta / DR:.3f} dR") from None
                continue
            joint.commit()
            rate = (new - state) / dt
            state = new
            t += dt
            iterations += count
            cut = max(cut - 1, 0)
    return iterations


def main(joint, kinematics: str, version: str, orders: tuple[int, ...] = (2,)) -> None:
    """Solve what the command line says with the class ``joint``."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--case", choices=["elastic", "plastic"], default="elastic")
    parser.add_argument("--size", type=float, default=0.04, help="edge length on the arcs over R")
    parser.add_argument("--order", type=int, choices=orders, default=orders[0])
    parser.add_argument("--steps", type=int, default=2, help="equal steps to delta = 2 dR")
    parser.add_argument("--output", type=Path, default=Path("result.json"))
    parser.add_argument(
        "--probe", action="version", version=version, help="print the code's version"
    )
    options = parser.parse_args()
    made = joint(
        options.size, min(0.25, 6.25 * options.size), options.order, options.case == "plastic"
    )
    result = {"kinematics": kinematics, "dofs": made.dofs, "failed": None}
    try:
        result |= {"iterations": load(made, options.steps, 2 * DR)} | made.results()
    except RuntimeError as error:
        result["failed"] = str(error)
    options.output.write_text(json.dumps(result), encoding="utf-8")

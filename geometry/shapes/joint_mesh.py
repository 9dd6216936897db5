"""What the meshes of all kinds of joints share: sets, element sizes, exact circles. gmsh works in
units of the pin's radius whatever the units of the scene, so meshes do not depend on them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh

Place = tuple[float, float]
PinPart = Literal["half", "whole", "none"]
_CUT_ABOVE = (
    30_000,
    100_000,
)  # triangles from which a mesh is made by cutting larger ones, once and twice


class Sketch:
    """A joint as gmsh is to draw it: every body has each point, line and arc once.

    ``faces`` are the faces of every body, ``lines`` the lines of every set; sets have the numbers
    1, 2, ... in the order of their names, and may be empty. Shapes add the element ``sizes`` of
    bodies (expressions in x and y), how many equal edges a line has at least (``parts``), and the
    corners of faces that are cut into a ``grid``.
    """

    def __init__(self, bodies: Sequence[str], sets: Sequence[str]) -> None:
        self.points: dict[tuple[str, Place], int] = {}
        self.curves: list[list[int]] = []  # start, end, and the centre of an arc
        self.loops: list[list[int]] = []
        self._curve: dict[tuple[str, Place, Place], int] = {}
        self.faces: dict[str, list[int]] = {name: [] for name in bodies}
        self.lines: dict[str, list[int]] = {name: [] for name in sets}
        self.circles: dict[str, Circle] = {}
        self.sizes: dict[str, str] = {}
        self.parts: dict[int, float] = {}
        self.grid: dict[int, list[int]] = {}

    def point(self, body: str, place: Place) -> int:
        """The point of ``body`` at (x, y)."""
        return self.points.setdefault((body, place), len(self.points) + 1)

    def path(self, body: str, *places: Place, on: Circle | None = None) -> list[int]:
        """The lines of ``body`` from each place to the next, or arcs ``on`` the circle of a set."""
        if on:
            self.circles[on.facets] = on
        for a, b in pairwise(places):
            if (body, a, b) not in self._curve:
                self.curves.append(
                    [self.point(body, place) for place in (a, b, *([on.centre] if on else []))]
                )
                self._curve[body, a, b] = self._curve[body, b, a] = len(self.curves)
        return [self._curve[body, a, b] for a, b in pairwise(places)]

    def face(self, body: str, **paths: list[int]) -> int:
        """A face of ``body`` within ``paths`` that together are closed, in whatever direction each
        line goes; the lines go to the sets of these names, where there are such."""
        self.loops.append([line for path in paths.values() for line in path])
        self.faces[body].append(len(self.loops))
        for name in paths.keys() & self.lines:
            self.lines[name] += [line for line in paths[name] if line not in self.lines[name]]
        return len(self.loops)

    def pin(self, x: float, up: int, part: PinPart, before: str = "") -> None:
        """The quarters, above or below the axis, of a pin of radius 1 about (x, 0); the names of
        its body and its sets have ``before`` in front."""
        pin = f"{before}pin"
        for to in {"half": (1,), "whole": (1, -1), "none": ()}[part]:
            arc = self.path(pin, (x + to, 0), (x, up), on=Circle(pin, (x, 0.0), 1.0))
            flat = self.path(pin, (x, up), (x, 0))
            axis = self.path(pin, (x, 0), (x + to, 0))
            self.face(pin, **{pin: arc, f"{before}flat": flat, "axis": axis})


def mesh_joint(
    comm: MPI.Comm,
    sketch: Sketch,
    *,
    radius: float,
    degree: int = 2,
    refinements: int = 0,
    partitioner=None,
) -> TaggedMesh:
    """Mesh a ``sketch``, times ``radius``, with all nodes of arcs on their circles; the centre of
    each pin becomes a point set: the centre of "pin" the set "centre", the centre of "inner pin"
    the set "inner centre".

    The mesh is made with larger elements, which are then cut in four as often as ``refinements``
    says: much quicker. ``partitioner`` is a dolfinx cell partitioner (tests cut meshes in unusual
    ways). Collective; rank 0 meshes.
    """

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        mesh = gmsh.model.mesh
        coarser = 2.0**refinements
        for _, place in sketch.points:
            geo.addPoint(*place, 0)
        for start, stop, *centre in sketch.curves:
            (geo.addCircleArc if centre else geo.addLine)(start, *centre, stop)
        for loop in sketch.loops:
            geo.addPlaneSurface([geo.addCurveLoop(loop, reorient=True)])
        geo.synchronize()
        for line, parts in sketch.parts.items():
            mesh.setTransfiniteCurve(line, max(2, math.ceil(parts / coarser)) + 1)
        for face, corners in sketch.grid.items():
            mesh.setTransfiniteSurface(face, "AlternateLeft", corners)
        for dim, sets in ((2, sketch.faces), (1, sketch.lines)):
            for tag, (name, entities) in enumerate(sets.items(), 1):
                if entities:
                    gmsh.model.addPhysicalGroup(dim, entities, tag, name)
        fields = []
        for body in filter(sketch.faces.get, sketch.faces):
            whole = mesh.field.add("MathEval")
            mesh.field.setString(whole, "F", f"{coarser!r} * ({sketch.sizes[body]})")
            fields.append(mesh.field.add("Restrict"))
            mesh.field.setNumber(fields[-1], "InField", whole)
            mesh.field.setNumbers(fields[-1], "SurfacesList", sketch.faces[body])
        smallest = mesh.field.add("Min")
        mesh.field.setNumbers(smallest, "FieldsList", fields)
        mesh.field.setAsBackgroundMesh(smallest)

    how = {"order": degree, "refinements": refinements, "partitioner": partitioner}
    joint = gmsh_to_mesh(
        comm, build, list(sketch.circles.values()), **how, key=tuple(vars(sketch).items())
    )
    joint.mesh.geometry.x[:] *= radius
    pins = {
        name: circle.centre for name, circle in sketch.circles.items() if name.split()[-1] == "pin"
    }
    centres = {
        name.removesuffix("pin") + "centre": radius * np.array([at]) for name, at in pins.items()
    }
    return replace(joint, point_sets=centres) if centres else joint


def around(x: float) -> str:
    """The distance from (x, 0), for sizes."""
    return f"Sqrt((x - ({x!r}))^2 + y^2)"  # gmsh knows no "- -1"


def refinements(cells: float) -> int:
    """How often a mesh that is to have about so many ``cells`` is made by cutting triangles in
    four: gmsh's time grows faster than the number of triangles, the time of the cutting does
    not."""
    return sum(cells > limit for limit in _CUT_ABOVE)

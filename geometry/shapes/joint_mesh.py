"""What the meshes of all kinds of joints share: sets, element sizes, exact circles. gmsh works in units of the pin's
radius whatever the units of the scene, so meshes do not depend on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh

Place = tuple[float, float]
PinPart = Literal["half", "whole", "none"]
_CUT_ABOVE = 30_000, 100_000  # triangles from which a mesh is made by cutting larger ones, once and twice


class Drawing(NamedTuple):
    """A joint in gmsh: the ``faces`` and the element size (an expression in x and y) of every body, the ``lines`` of
    every set, how many equal edges a line has at least (``parts``), and the corners of faces that are cut into a
    ``grid``. Sets have the numbers 1, 2, ... in the order of their names here; they may be empty."""

    faces: Mapping[str, list[int]]
    sizes: Mapping[str, str]
    lines: Mapping[str, list[int]]
    parts: Mapping[int, float]
    grid: Mapping[int, list[int]] = MappingProxyType({})


def mesh_joint(
    comm: MPI.Comm,
    draw: Callable[..., Drawing],
    circles: Sequence[Circle],
    key: tuple,
    *,
    radius: float,
    degree: int = 2,
    refinements: int = 0,
    partitioner=None,
) -> TaggedMesh:
    """Mesh what ``draw(gmsh.model.geo)`` returns, times ``radius``.

    The nodes of sets of arcs are put on their ``circles``; the centre of the first, of the set "pin", becomes the point
    set "centre". ``key`` is all that enters the drawing. The mesh is made with larger elements, which are then cut in
    four as often as ``refinements`` says: much quicker. ``partitioner`` is a dolfinx cell partitioner (tests cut meshes
    in unusual ways). Collective over ``comm``; rank 0 meshes.
    """

    def build(gmsh) -> None:
        drawn, coarser, mesh = draw(gmsh.model.geo), 2.0**refinements, gmsh.model.mesh
        gmsh.model.geo.synchronize()
        for line, parts in drawn.parts.items():
            mesh.setTransfiniteCurve(line, max(2, math.ceil(parts / coarser)) + 1)
        for face, corners in drawn.grid.items():
            mesh.setTransfiniteSurface(face, "AlternateLeft", corners)
        for dim, sets in ((2, drawn.faces), (1, drawn.lines)):
            for tag, (name, entities) in enumerate(sets.items(), 1):
                if entities:
                    gmsh.model.addPhysicalGroup(dim, entities, tag, name)
        of_size: dict[str, list[int]] = {}
        for body in filter(drawn.faces.get, drawn.faces):
            of_size.setdefault(drawn.sizes[body], []).extend(drawn.faces[body])
        fields = []
        for expression, faces in of_size.items():
            fields.append(mesh.field.add("MathEval"))
            mesh.field.setString(fields[-1], "F", f"{coarser!r} * ({expression})")
            if len(of_size) > 1:
                whole, fields[-1] = fields[-1], mesh.field.add("Restrict")
                mesh.field.setNumber(fields[-1], "InField", whole)
                mesh.field.setNumbers(fields[-1], "SurfacesList", faces)
        smallest = mesh.field.add("Min")
        mesh.field.setNumbers(smallest, "FieldsList", fields)
        mesh.field.setAsBackgroundMesh(smallest)

    how = {"order": degree, "refinements": refinements, "partitioner": partitioner}
    joint = gmsh_to_mesh(comm, build, circles, **how, key=key)
    joint.mesh.geometry.x[:] *= radius
    centre = radius * np.array([circles[0].centre])
    return replace(joint, point_sets={"centre": centre} if joint.facet_sets.get("pin") else {})


class Sketch:
    """Bodies drawn with gmsh's ``geo``, each with every point, line and arc once, and its ``faces`` and ``lines``."""

    def __init__(self, geo, bodies: Sequence[str], sets: Sequence[str]) -> None:
        self._geo = geo
        self._points: dict[tuple[str, Place], int] = {}
        self._lines: dict[tuple[str, Place, Place], int] = {}
        self.faces: dict[str, list[int]] = {name: [] for name in bodies}
        self.lines: dict[str, list[int]] = {name: [] for name in sets}

    def point(self, body: str, place: Place) -> int:
        """The point of ``body`` at (x, y)."""
        if (body, place) not in self._points:
            self._points[body, place] = self._geo.addPoint(*place, 0)
        return self._points[body, place]

    def path(self, body: str, *places: Place, centre: Place | None = None) -> list[int]:
        """The lines of ``body`` from each place to the next, or arcs around a ``centre``."""
        for a, b in pairwise(places):
            if (body, a, b) not in self._lines:
                p, q = self.point(body, a), self.point(body, b)
                arc = centre and self._geo.addCircleArc(p, self.point(body, centre), q)
                self._lines[body, a, b] = self._lines[body, b, a] = arc or self._geo.addLine(p, q)
        return [self._lines[body, a, b] for a, b in pairwise(places)]

    def face(self, body: str, **paths: list[int]) -> int:
        """A face of ``body`` within ``paths`` that together are closed, in whatever direction each line goes; the lines
        go to the sets of these names, where there are such."""
        loop = [line for path in paths.values() for line in path]
        self.faces[body].append(self._geo.addPlaneSurface([self._geo.addCurveLoop(loop, reorient=True)]))
        for name in paths.keys() & self.lines:
            self.lines[name] += [line for line in paths[name] if line not in self.lines[name]]
        return self.faces[body][-1]

    def pin(self, x: float, up: int, part: PinPart) -> None:
        """The quarters, above or below the axis, of a pin of radius 1 about (x, 0)."""
        for to in {"half": (1,), "whole": (1, -1), "none": ()}[part]:
            arc = self.path("pin", (x + to, 0), (x, up), centre=(x, 0))
            flat, axis = self.path("pin", (x, up), (x, 0)), self.path("pin", (x, 0), (x + to, 0))
            self.face("pin", pin=arc, flat=flat, axis=axis)


def around(x: float) -> str:
    """The distance from (x, 0), for sizes."""
    return f"Sqrt((x - {x!r})^2 + y^2)"


def refinements(cells: float) -> int:
    """How often a mesh that is to have about so many ``cells`` is made by cutting triangles in four: gmsh's time grows
    faster than the number of triangles, that of the cutting does not."""
    return sum(cells > limit for limit in _CUT_ABOVE)

"""Sketches as solids: every face is revolved about the axis x = 0, and meshed by gmsh with curved
tetrahedra of second order; or its quadrilaterals are extruded to one layer of hexahedra."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import partial
from typing import Any

from mpi4py import MPI

from archord.geometry.meshes.fenicsx import (
    gmsh_to_mesh,
    set_mesh_options,
    size_field,
    size_within,
    use_smallest,
)
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.sketch import Sketch

PLANES = ("start", "end")  # the sets of the sketch's own plane z = 0, and of where it is turned to
_RADIUS = "Sqrt(x*x + z*z)"
_OPTIONS = {"ElementOrder": 2, "Algorithm3D": 1}


def revolved(sketch: Sketch, quarters: int) -> TaggedMesh:
    """The ``sketch`` revolved by one or two ``quarters`` of a turn, of z <= 0. Its sets of lines
    are sets of facets. Collective."""
    return gmsh_to_mesh(MPI.COMM_WORLD, partial(_draw_revolved, sketch, quarters * math.pi / 2))


def of_quadrilaterals(sketch: Sketch) -> TaggedMesh:
    """The ``sketch`` in its plane, whole on every rank."""
    circles = [*sketch.circles.values()]
    return gmsh_to_mesh(MPI.COMM_SELF, partial(_draw_flat, sketch), circles, quads=True)


def _draw_faces(sketch: Sketch, gmsh: Any) -> dict[str, list[int]]:
    """The faces of each body."""
    occ = gmsh.model.occ
    sketch.draw_lines(occ)
    drawn = {}
    for body, faces in sketch.faces.items():
        loops = [occ.addCurveLoop(sketch.around_face(face)) for face in faces]
        drawn[body] = [occ.addPlaneSurface([loop]) for loop in loops]
    return drawn


def _draw_flat(sketch: Sketch, gmsh: Any) -> None:
    drawn = _draw_faces(sketch, gmsh)
    gmsh.model.occ.synchronize()
    for name, lines in sketch.lines.items():
        gmsh.model.addPhysicalGroup(1, lines, name=name)
    _name_and_refine(sketch, 2, drawn, gmsh)


def _draw_revolved(sketch: Sketch, angle: float, gmsh: Any) -> None:
    occ = gmsh.model.occ
    sets: dict[str, set[int]] = {name: set() for name in (*PLANES, *sketch.lines)}
    solids: dict[str, list[int]] = {name: [] for name in sketch.faces}
    for body, faces in _draw_faces(sketch, gmsh).items():
        for flat in faces:
            end, solid, *_ = occ.revolve([(2, flat)], 0, 0, 0, 0, 1, 0, angle)
            solids[body].append(solid[1])
            sets["start"].add(flat)
            sets["end"].add(end[1])
    occ.synchronize()
    planes = sets["start"] | sets["end"]
    for name, lines in sketch.lines.items():
        for line in lines:
            # none of a line on the axis
            sets[name] |= {*gmsh.model.getAdjacencies(1, line)[0]} - planes
    for name, surfaces in sets.items():
        if surfaces:
            gmsh.model.addPhysicalGroup(2, sorted(surfaces), name=name)
    _name_and_refine(sketch, 3, solids, gmsh)
    set_mesh_options(gmsh, _OPTIONS)


def _name_and_refine(sketch: Sketch, dim: int, parts: Mapping[str, list[int]], gmsh: Any) -> None:
    """Name the ``parts`` of each body, and give them its size of elements in the ``sketch``."""
    within = []
    for body, own in parts.items():
        gmsh.model.addPhysicalGroup(dim, own, name=body)
        size = size_field(gmsh, re.sub(r"\bx\b", _RADIUS, sketch.sizes[body]))
        within.append(size_within(gmsh, size, own, dim))
    use_smallest(gmsh, within)

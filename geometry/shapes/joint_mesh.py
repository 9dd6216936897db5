"""What the meshes of all kinds of joints share: sets, element sizes, exact circles. gmsh works in units of the pin's
radius whatever the units of the scene, so meshes do not depend on them."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh


class _Set(IntEnum):
    @property
    def set_name(self) -> str:
        """Name in a problem: "pin" and "block", and of facets "pin" and "hole" (the arcs), "pin top", ..."""
        return self.name.removesuffix("_ARC").replace("_", " ").lower()


class Cells(_Set):
    """Cell tags: the two bodies."""

    PIN = 1
    BLOCK = 2


class Facets(_Set):
    """Facet tags of the edges that carry a condition; other edges are free."""

    PIN_ARC = 1
    HOLE_ARC = 2
    PIN_TOP = 3  # where the quarter joint is pressed
    BLOCK_HELD = 4
    SYMMETRY = 5


class Drawing(NamedTuple):
    """A joint in gmsh: its faces, their element sizes (expressions in x and y), its lines, and the size of the equal
    edges on sets of them that are quarter circles of about unit radius."""

    faces: dict[Cells, int]
    sizes: dict[Cells, str]
    lines: dict[Facets, list[int]]
    arcs: dict[Facets, float]


_CUT_ABOVE = 30_000, 100_000  # triangles from which a mesh is made by cutting larger ones, once and twice


def mesh_joint(
    comm: MPI.Comm,
    draw: Callable[..., Drawing],
    circles: dict[Facets, tuple[float, float]],
    key: tuple,
    *,
    radius: float,
    degree: int = 2,
    refinements: int = 0,
    partitioner=None,
) -> TaggedMesh:
    """Mesh what ``draw(gmsh.model.geo)`` returns, times ``radius``.

    ``circles`` are the heights of the centre and the radii of sets of arcs, on which all their nodes are put; ``key``
    is all that enters the drawing. The mesh is made with larger elements, which are then cut in four as often as
    ``refinements`` says: much quicker. ``partitioner`` is a dolfinx cell partitioner (tests cut meshes in unusual
    ways). Collective over ``comm``; rank 0 meshes.
    """

    def build(gmsh) -> None:
        drawn, coarser, mesh = draw(gmsh.model.geo), 2.0**refinements, gmsh.model.mesh
        gmsh.model.geo.synchronize()
        for facets, size in drawn.arcs.items():
            for line in drawn.lines[facets]:
                mesh.setTransfiniteCurve(line, max(2, math.ceil(math.pi / 2 / (coarser * size))) + 1)
        for body, face in drawn.faces.items():
            gmsh.model.addPhysicalGroup(2, [face], body, body.set_name)
        for facets, lines in drawn.lines.items():
            gmsh.model.addPhysicalGroup(1, lines, facets, facets.set_name)
        fields = []
        for expression in dict.fromkeys(drawn.sizes[body] for body in drawn.faces):
            fields.append(mesh.field.add("MathEval"))
            mesh.field.setString(fields[-1], "F", f"{coarser!r} * ({expression})")
        if len(fields) > 1:
            for i, face in enumerate(drawn.faces.values()):
                whole, fields[i] = fields[i], mesh.field.add("Restrict")
                mesh.field.setNumber(fields[i], "InField", whole)
                mesh.field.setNumbers(fields[i], "SurfacesList", [face])
            fields.append(mesh.field.add("Min"))
            mesh.field.setNumbers(fields[-1], "FieldsList", fields[:-1])
        mesh.field.setAsBackgroundMesh(fields[-1])

    def exact(x: Array, tag: int) -> Array:
        return on_circle(x, *circles[Facets(tag)]) if tag in circles else x

    how = {"order": degree, "refinements": refinements, "partitioner": partitioner}
    joint = gmsh_to_mesh(comm, build, exact, **how, key=key)
    joint.mesh.geometry.x[:] *= radius
    return joint


def refinements(cells: float) -> int:
    """How often a mesh that is to have about so many ``cells`` is made by cutting triangles in four.

    gmsh's time grows faster than the number of triangles, that of the cutting does not.
    """
    return sum(cells > limit for limit in _CUT_ABOVE)


def on_circle(x: Array, height: float, radius: float) -> Array:
    """Points ``x`` ``(n, 2)`` moved along their rays from ``(0, height)`` to exact ``radius``.

    The clearance is a small difference of large numbers, which the rounding of a mesh generator would spoil.
    """
    centre = np.array([0.0, height])
    ray = x - centre
    return ray * (radius / np.linalg.norm(ray, axis=1))[:, None] + centre

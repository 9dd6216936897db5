"""What the meshes of all kinds of joints share: tags, the size of their elements, exact circles."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from archord.geometry.basis import Array


class Cells(IntEnum):
    """Cell tags: the two bodies."""

    PIN = 1
    BLOCK = 2


class Facets(IntEnum):
    """Facet tags of the edges that carry a condition; other edges are free."""

    PIN_ARC = 1
    HOLE_ARC = 2
    PIN_TOP = 3  # where the quarter joint is pressed
    BLOCK_HELD = 4
    SYMMETRY = 5


_CUT_ABOVE = 30_000, 100_000  # triangles from which a mesh is made by cutting larger ones, once and twice


def tag_and_size(gmsh, faces: dict[Cells, int], curves: dict[Facets, list[int]], sizes: dict[Cells, str]) -> None:
    """Make the physical groups of ``faces`` and ``curves``, and ``sizes`` (expressions in x, y) the element sizes of
    the bodies."""
    gmsh.model.geo.synchronize()
    for tag, face in faces.items():
        gmsh.model.addPhysicalGroup(2, [face], tag, _set_name(tag))
    for edge, lines in curves.items():
        if lines:
            gmsh.model.addPhysicalGroup(1, lines, edge, _set_name(edge))
    field, parts = gmsh.model.mesh.field, []
    for size in dict.fromkeys(sizes[tag] for tag in faces):
        parts.append(field.add("MathEval"))
        field.setString(parts[-1], "F", size)
    if len(parts) > 1:
        for i, tag in enumerate(faces):
            whole, parts[i] = parts[i], field.add("Restrict")
            field.setNumber(parts[i], "InField", whole)
            field.setNumbers(parts[i], "SurfacesList", [faces[tag]])
        parts.append(field.add("Min"))
        field.setNumbers(parts[-1], "FieldsList", parts[:-1])
    field.setAsBackgroundMesh(parts[-1])


def _set_name(tag: Cells | Facets) -> str:
    """Name of a set in a problem: "pin" and "block", and of facets "pin" and "hole" (the arcs), "pin top", ..."""
    return tag.name.removesuffix("_ARC").replace("_", " ").lower()


def edges_on(angle: float, size: float) -> int:
    """Number of edges, at least two, of an arc of unit radius over ``angle`` [rad], none longer than ``size``."""
    return max(2, math.ceil(angle / size))


def refinements(cells: float) -> int:
    """How often a mesh that is to have about so many ``cells`` is made by cutting triangles in four.

    gmsh's time grows faster than the number of triangles, that of the cutting does not.
    """
    return sum(cells > limit for limit in _CUT_ABOVE)


def on_circle(x: Array, centre: tuple[float, float], radius: float) -> Array:
    """Points ``x`` ``(n, 2)`` moved along their rays to exact ``radius``.

    The clearance is a small difference of large numbers, which the rounding of a mesh generator would spoil.
    """
    ray = x - centre
    return ray * (radius / np.linalg.norm(ray, axis=1))[:, None] + centre

"""What the meshes of all kinds of joints share: tags, the size of their elements, exact circles."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from dolfinx.mesh import Mesh, MeshTags

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


@dataclass(frozen=True)
class JointMesh:
    """A mesh of the joint with its tags; all bodies live in one mesh."""

    mesh: Mesh
    cells: MeshTags
    facets: MeshTags


def tag_and_size(gmsh, faces: dict[Cells, int], curves: dict[Facets, list[int]], size: str) -> None:
    """Make the physical groups of ``faces`` and ``curves``, and ``size`` (an expression in x, y) the element size."""
    gmsh.model.geo.synchronize()
    for tag, face in faces.items():
        gmsh.model.addPhysicalGroup(2, [face], tag)
    for edge, lines in curves.items():
        if lines:
            gmsh.model.addPhysicalGroup(1, lines, edge)
    field = gmsh.model.mesh.field.add("MathEval")
    gmsh.model.mesh.field.setString(field, "F", size)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)


def on_circle(x: Array, centre: tuple[float, float], radius: float) -> Array:
    """Points ``x`` ``(n, 3)`` moved along their rays to exact ``radius``.

    The clearance is a small difference of large numbers, which the rounding of a mesh generator would spoil.
    """
    middle = np.array([*centre, 0.0])
    ray = x - middle
    return ray * (radius / np.linalg.norm(ray, axis=1))[:, None] + middle

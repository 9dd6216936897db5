"""Rectangles with named sides, for first problems and examples."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, TypeVar

from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh

_SIDES = ("bottom", "right", "top", "left")  # as gmsh numbers them
Box = tuple[float, float, float, float]
_Box = TypeVar("_Box", bound=tuple[float, ...])
_SHORTEST = 0.3  # that the longest side is drawn


def rectangles(
    boxes: Mapping[str, Box], size: float, comm: MPI.Comm = MPI.COMM_WORLD
) -> TaggedMesh:
    """Mesh rectangles, each a body of its own.

    Parameters
    ----------
    boxes : dict
        The left and the lower end, the width and the height of each rectangle, by its name.
    size : float
        The size of the elements.
    comm : MPI.Comm
        The communicator, by default all ranks.

    Returns
    -------
    TaggedMesh
        A mesh with the set of cells "block" and the sets of facets "block bottom", "block right",
        "block top" and "block left" of a rectangle "block".

    Raises
    ------
    RuntimeError
        For rectangles that gmsh cannot mesh.

    Examples
    --------
    >>> from archord import rectangles
    >>> mesh = rectangles({"block": (0.0, 0.0, 2.0, 1.0)}, size=0.5)
    >>> list(mesh.facet_sets)
    ['block bottom', 'block right', 'block top', 'block left']
    """
    drawn, drawn_size, unit = as_drawn(boxes, size)
    made = gmsh_to_mesh(comm, partial(_drawn, drawn, drawn_size))
    made.mesh.geometry.x[:] *= unit
    return made


def as_drawn(boxes: Mapping[str, _Box], size: float) -> tuple[dict[str, _Box], float, float]:
    """``boxes`` and ``size`` as gmsh is to draw them: alike for millimetres, metres and
    micrometres, as the last bits decide which triangles it makes; and the unit of the drawing, a
    power of 1000.

    Numbers whose longest side is between 0.3 and 300 stay as they are.
    """
    longest = max((side for box in boxes.values() for side in box[len(box) // 2 :]), default=1.0)
    if not (0 < longest < math.inf):
        return dict(boxes), size, 1.0
    power = math.floor(math.log(longest / _SHORTEST, 1000))
    if power == 0:
        return dict(boxes), size, 1.0

    def drawn(length: float) -> float:
        return float(f"{length * 1000.0**-power:.15g}")

    scaled: Any = {name: tuple(map(drawn, box)) for name, box in boxes.items()}
    return scaled, drawn(size), 1000.0**power


def _drawn(boxes: Mapping[str, Box], size: float, gmsh: Any) -> None:
    for name, (x, y, width, height) in boxes.items():
        face = gmsh.model.occ.addRectangle(x, y, 0, width, height)
        name_body(gmsh, name, (2, face), _SIDES)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)


def name_body(
    gmsh: Any, name: str, body: tuple[int, int], sides: Sequence[str]
) -> list[tuple[int, int]]:
    """Name a ``body``, a dimension and a tag of gmsh, and what bounds it by its ``sides``; returns
    the dimensions and tags of what bounds it."""
    dimension, tag = body
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(dimension, [tag], name=name)
    boundary = gmsh.model.getBoundary([body], oriented=False)
    for side, (_, part) in zip(sides, boundary, strict=True):
        gmsh.model.addPhysicalGroup(dimension - 1, [part], name=f"{name} {side}")
    return boundary

"""Rectangles with named sides, for first problems and examples."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh

_SIDES = ("bottom", "right", "top", "left")  # as gmsh numbers them
Box = tuple[float, float, float, float]


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
    return gmsh_to_mesh(comm, partial(_drawn, boxes, size))


def _drawn(boxes: Mapping[str, Box], size: float, gmsh: Any) -> None:
    for name, (x, y, width, height) in boxes.items():
        face = gmsh.model.occ.addRectangle(x, y, 0, width, height)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name=name)
        lines = gmsh.model.getBoundary([(2, face)], oriented=False)
        for side, (_, line) in zip(_SIDES, lines, strict=True):
            gmsh.model.addPhysicalGroup(1, [line], name=f"{name} {side}")
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)

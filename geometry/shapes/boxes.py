"""Boxes in space with named sides, for first problems and examples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any, Literal

from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.rectangles import as_drawn, name_body
from archord.report.errors import InputError

_SIDES = ("left", "right", "bottom", "top", "back", "front")  # as gmsh numbers them
Box = tuple[float, float, float, float, float, float]
Kind = Literal["tetrahedra", "hexahedra"]


def boxes(
    boxes: Mapping[str, Box],
    size: float,
    kind: Kind = "tetrahedra",
    comm: MPI.Comm = MPI.COMM_WORLD,
) -> TaggedMesh:
    """Mesh boxes in space, each a body of its own.

    Parameters
    ----------
    boxes : dict
        The smallest x, y and z of each box, and its lengths along x, y and z, by its name.
    size : float
        The size of the elements.
    kind : {"tetrahedra", "hexahedra"}
        The kind of the elements, of second order: 10 or 27 nodes.
    comm : MPI.Comm
        The communicator, by default all ranks.

    Returns
    -------
    TaggedMesh
        A mesh with the set of cells "block" and six sets of facets for a box "block": "block left"
        and "block right" at its smallest and its largest x, "block bottom" and "block top" at its
        smallest and its largest y, as in a plane, "block back" and "block front" at its smallest
        and its largest z.

    Raises
    ------
    InputError
        For another kind.
    RuntimeError
        For boxes that gmsh cannot mesh.

    Examples
    --------
    >>> from archord import boxes
    >>> mesh = boxes({"block": (0.0, 0.0, 0.0, 2.0, 1.0, 1.0)}, size=0.5)
    >>> list(mesh.facet_sets)[:3], list(mesh.facet_sets)[3:]
    (['block left', 'block right', 'block bottom'], ['block top', 'block back', 'block front'])
    """
    if kind not in ("tetrahedra", "hexahedra"):
        said = f'must be "tetrahedra" or "hexahedra", not {kind!r}'
        raise InputError(f"archord.boxes: kind {said}.")
    drawn, drawn_size, unit = as_drawn(boxes, size)
    made = gmsh_to_mesh(comm, partial(_drawn, drawn, drawn_size, kind == "hexahedra"))
    made.mesh.geometry.x[:] *= unit
    return made


def _drawn(boxes: Mapping[str, Box], size: float, hexahedra: bool, gmsh: Any) -> None:
    mesh = gmsh.model.mesh
    for name, place in boxes.items():
        box = gmsh.model.occ.addBox(*place)
        faces = name_body(gmsh, name, (3, box), _SIDES)
        if hexahedra:
            for _, line in gmsh.model.getBoundary(faces, combined=False, oriented=False):
                length = gmsh.model.occ.getMass(1, line)
                mesh.setTransfiniteCurve(line, math.ceil(length / size) + 1)
            for _, face in faces:
                mesh.setTransfiniteSurface(face)
                mesh.setRecombine(2, face)
            mesh.setTransfiniteVolume(box)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)

"""Pins in blocks with holes, drawn and meshed by gmsh with tetrahedra of 10 nodes.

The half x >= 0 of a joint is modelled, and the half z >= 0, but for blocks that begin further out.
A block is 20 wide and 30 deep, half the hole is its recess. All pins have their axis at x = 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from mpi4py import MPI

from archord.geometry.meshes.fenicsx import gmsh_to_mesh, set_mesh_options, size_field, slices
from archord.geometry.meshes.tagged_mesh import TaggedMesh

PIN_RADIUS = 10.0
HOLE_RADIUS = 10.05
CLEARANCE = HOLE_RADIUS - PIN_RADIUS
WIDTH = 20.0
DEPTH = 30.0
_NEAR = 1e-6
_OPTIONS = {
    "ElementOrder": 2,  # so that nodes lie on the cylinders
    "Algorithm3D": 1,
}
_Faces = Callable[[tuple[float, ...]], str]


@dataclass(frozen=True)
class Size:
    """The size of elements: ``near`` the contact, growing by ``growth`` per unit of distance, and
    at the lowest point of a hole's edge, ``edge`` away from z = 0, where it is ``at_edge``."""

    near: float
    growth: float = 0.2
    at_edge: float = math.inf
    edge: float = 0.0

    def field(self) -> str:
        """The size as gmsh reads it, as a function of x, y and z."""
        depth = f"Abs(Sqrt(x*x + y*y) - {HOLE_RADIUS!r})"
        size = f"{self.near!r} + {self.growth!r} * {depth}"
        if math.isinf(self.at_edge):
            return size
        from_edge = f"Sqrt(x*x + (y + {HOLE_RADIUS!r})^2 + (z - {self.edge!r})^2)"
        return f"Min({size}, {self.at_edge!r} + {self.growth!r} * {from_edge})"


def mesh_of_joint(comm: MPI.Comm, size: Size, thickness: float, pin_length: float) -> TaggedMesh:
    """The lower half of a pin that touches a block of this ``thickness``. Collective.

    Facet sets are "pin" and "hole", and of "block" and "pin" the tops, where they are held, the
    sides in x = 0 and the middles in z = 0: "pin top", "block side" and so on.
    """
    return gmsh_to_mesh(comm, partial(_draw_joint, size, thickness, pin_length), cut=slices)


def mesh_of_clevis(comm: MPI.Comm, size: Size, lug: float, fork: float) -> TaggedMesh:
    """A pin through a lug from z = 0 to ``lug`` and a fork from there to ``fork``, which is the lug
    turned upside down. Collective.

    Facet sets are "lug hole", "fork hole", "pin in lug", "pin in fork", and sides, middles and tops
    as of `mesh_of_joint`.
    """
    return gmsh_to_mesh(comm, partial(_draw_clevis, size, lug, fork), cut=slices)


def _draw_joint(size: Size, thickness: float, pin_length: float, gmsh: Any) -> None:
    block = _block(gmsh, 0.0, thickness)
    pin = _quarter(gmsh, -CLEARANCE, 0.0, pin_length, -1)
    gmsh.model.occ.synchronize()
    _name(gmsh, "block", [block], "hole", top=0.0)
    _name(gmsh, "pin", [pin], "pin", top=-CLEARANCE)
    _refine(gmsh, size)


def _draw_clevis(size: Size, lug: float, fork: float, gmsh: Any) -> None:
    occ = gmsh.model.occ
    of_lug = _block(gmsh, 0.0, lug)
    of_fork = _block(gmsh, -fork, -lug)
    occ.rotate([(3, of_fork)], 0.0, -CLEARANCE, 0.0, 1.0, 0.0, 0.0, math.pi)
    ends = [(0.0, lug), (lug, fork)]
    parts = [_quarter(gmsh, -CLEARANCE, *end, sign) for end in ends for sign in (-1, 1)]
    first, *others = [(3, part) for part in parts]
    pin = [volume for _, volume in occ.fragment([first], others)[0]]
    occ.synchronize()
    _name(gmsh, "lug", [of_lug], "lug hole", top=0.0)
    _name(gmsh, "fork", [of_fork], "fork hole", top=-2 * CLEARANCE)
    below_lug = partial(_part_of_pin, lug)
    _name(gmsh, "pin", pin, below_lug, top=math.inf)
    _refine(gmsh, size)


def _part_of_pin(lug: float, centre: tuple[float, ...]) -> str:
    """The facet set of a part of the pin's cylinder; "" where it touches nothing."""
    is_below = centre[1] < -CLEARANCE
    is_in_lug = centre[2] < lug
    if is_below != is_in_lug:
        return ""
    return "pin in lug" if is_in_lug else "pin in fork"


def _block(gmsh: Any, start: float, end: float) -> int:
    """A block under a hole from z = ``start`` to ``end``."""
    occ = gmsh.model.occ
    box = occ.addBox(0.0, -DEPTH, start, WIDTH, DEPTH, end - start)
    bore = occ.addCylinder(0.0, 0.0, start, 0.0, 0.0, end - start, HOLE_RADIUS)
    return occ.cut([(3, box)], [(3, bore)])[0][0][1]


def _quarter(gmsh: Any, axis: float, start: float, end: float, sign: int) -> int:
    """A quarter of a pin with its axis at y = ``axis``: the upper or the lower by the ``sign``."""
    occ = gmsh.model.occ
    length = end - start
    place = (0.0, axis, start, 0.0, 0.0, length)
    quarter = occ.addCylinder(*place, PIN_RADIUS, angle=math.pi / 2)
    if sign < 0:
        occ.rotate([(3, quarter)], 0.0, axis, 0.0, 0.0, 0.0, 1.0, -math.pi / 2)
    return quarter


def _name(gmsh: Any, body: str, volumes: list[int], arc: str | _Faces, top: float) -> None:
    """Name the ``volumes`` of a ``body``, the cylinders ``arc`` of its contact, and its planes: the
    ``top`` is at this y."""
    gmsh.model.addPhysicalGroup(3, volumes, name=body)
    found: dict[str, list[int]] = {}
    solids = [(3, volume) for volume in volumes]
    for _, face in gmsh.model.getBoundary(solids, oriented=False):
        centre = gmsh.model.occ.getCenterOfMass(2, face)
        name = ""
        if gmsh.model.getType(2, face) == "Cylinder":
            name = arc if isinstance(arc, str) else arc(centre)
        else:
            planes = {"side": centre[0], "top": centre[1] - top, "middle": centre[2]}
            name = next((f"{body} {p}" for p, off in planes.items() if abs(off) < _NEAR), "")
        if name:
            found.setdefault(name, []).append(face)
    for name, faces in found.items():
        gmsh.model.addPhysicalGroup(2, faces, name=name)


def _refine(gmsh: Any, size: Size) -> None:
    gmsh.model.mesh.field.setAsBackgroundMesh(size_field(gmsh, size.field()))
    set_mesh_options(gmsh, _OPTIONS)

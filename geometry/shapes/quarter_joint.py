"""The paper's quarter joint: a quarter pin of radius R in a quarter hole of radius R + dR, touching at the bottom.

The hole's centre is the origin and the symmetry axis is x = 0. The pin's centre is (0, -dR), so pin and hole touch at
(0, -R - dR). The block reaches to x = W and y = -H; its top edge y = 0 is held, the pin's flat top is the loaded edge.
"""

from __future__ import annotations

import math

from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Cells, Drawing, Facets, mesh_joint

_EDGE_GROWTH = 0.4  # of elements that shrink toward the contact's edge, per unit of distance from it


def quarter_joint(
    comm: MPI.Comm,
    radius: float,
    clearance: float,
    block_size: float,
    element_size: float,
    growth: float,
    *,
    size_ratio: float = 1.0,
    edge: tuple[float, float] | None = None,
    rigid_pin: bool = False,
    **options,
) -> TaggedMesh:
    """Mesh the quarter joint, with ``options`` as for `mesh_joint`. Lengths share one unit.

    ``element_size`` is the edge length on the hole's arc, ``size_ratio`` times that the one on the pin's; away from
    them it grows by ``growth`` per unit of distance. ``edge`` is an angle from the axis [rad] and the size to which
    the elements shrink there, where the contact is to end. A rigid pin is not meshed.
    """
    hole, width, size = 1.0 + clearance / radius, block_size / radius, element_size / radius
    on_arc = {Cells.PIN: size_ratio * size, Cells.BLOCK: size}
    equal = {Facets.PIN_ARC: size_ratio * size, Facets.HOLE_ARC: size}

    def draw(geo) -> Drawing:
        def face(*points: tuple[float, float]) -> tuple[int, int, list[int]]:
            """The face between an arc, by its centre and ends, and lines by corners or the centre; arc and lines."""
            centre, bottom, side, *corners = (geo.addPoint(x, y, 0) for x, y in points)
            corners = corners or [centre]
            arc = geo.addCircleArc(bottom, centre, side)
            lines = [geo.addLine(a, b) for a, b in zip([side, *corners], [*corners, bottom], strict=True)]
            return geo.addPlaneSurface([geo.addCurveLoop([arc, *lines])]), arc, lines

        faces: dict[Cells, int] = {}
        lines: dict[Facets, list[int]] = {Facets.SYMMETRY: []}
        if not rigid_pin:
            faces[Cells.PIN], arc, (top, line) = face((0, 1 - hole), (0, -hole), (1, 1 - hole))
            lines |= {Facets.PIN_ARC: [arc], Facets.PIN_TOP: [top], Facets.SYMMETRY: [line]}
        corners = (width, 0), (width, -width), (0, -width)
        faces[Cells.BLOCK], arc, (held, *_, line) = face((0, 0), (0, -hole), (hole, 0), *corners)
        lines |= {Facets.HOLE_ARC: [arc], Facets.BLOCK_HELD: [held], Facets.SYMMETRY: [*lines[Facets.SYMMETRY], line]}
        from_arc = f"{growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        sizes = {body: f"{size!r} + {from_arc}" for body, size in on_arc.items()}
        if edge is None:
            return Drawing(faces, sizes, lines, {arc: size for arc, size in equal.items() if arc in lines})
        x, y = hole * math.sin(edge[0]), hole * math.cos(edge[0])
        near_edge = f"{edge[1] / radius!r} + {_EDGE_GROWTH!r} * Sqrt((x - {x!r})^2 + (y + {y!r})^2)"
        return Drawing(faces, {body: f"Min({value}, {near_edge})" for body, value in sizes.items()}, lines, {})

    circles = {Facets.PIN_ARC: (1 - hole, 1.0), Facets.HOLE_ARC: (0.0, hole)}
    key = ("quarter joint", hole, width, size, growth, size_ratio, edge and (edge[0], edge[1] / radius), rigid_pin)
    return mesh_joint(comm, draw, circles, key, radius=radius, **options)

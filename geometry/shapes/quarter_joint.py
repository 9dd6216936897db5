"""The paper's quarter joint: a quarter pin of radius R in a quarter hole of radius R + dR, touching at the bottom.

The hole's centre is the origin and the symmetry axis is x = 0. The pin's centre is (0, -dR), so pin and hole touch at
(0, -R - dR). The block reaches to x = W and y = -H; its top edge y = 0 is held, the pin's flat top is the loaded edge.
"""

from __future__ import annotations

import math

from mpi4py import MPI

from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import Drawing, mesh_joint

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
    whole_pin: bool = False,
    **options,
) -> TaggedMesh:
    """Mesh the quarter joint, with ``options`` as for `mesh_joint`. Lengths share one unit.

    ``element_size`` is the edge length on the hole's arc, ``size_ratio`` times that the one on the pin's; away from
    them it grows by ``growth`` per unit of distance. ``edge`` is an angle from the axis [rad] and the size to which
    the elements shrink there, where the contact is to end. A rigid pin is not meshed; of a
    whole one the upper half, free, is meshed with the rest, which is then pressed along a line inside it.
    """
    hole, width, size = 1.0 + clearance / radius, block_size / radius, element_size / radius
    on_arc = {"pin": size_ratio * size, "hole": size}

    def draw(geo) -> Drawing:
        def face(*points: tuple[float, float]) -> tuple[int, int, list[int], list[int]]:
            """The face between an arc, by its centre and ends, and lines by corners or the centre; arc, lines and
            points."""
            centre, bottom, side, *corners = ends = [geo.addPoint(x, y, 0) for x, y in points]
            corners = corners or [centre]
            arc = geo.addCircleArc(bottom, centre, side)
            lines = [geo.addLine(a, b) for a, b in zip([side, *corners], [*corners, bottom], strict=True)]
            return geo.addPlaneSurface([geo.addCurveLoop([arc, *lines])]), arc, lines, ends

        faces: dict[str, list[int]] = {"pin": [], "block": []}
        lines: dict[str, list[int]] = {name: [] for name in ("pin", "hole", "pin top", "block held", "symmetry")}
        lines["pin back"] = []
        if not rigid_pin:
            lower, arc, (top, line), (centre, _, side) = face((0, 1 - hole), (0, -hole), (1, 1 - hole))
            faces["pin"], lines["pin"], lines["pin top"], lines["symmetry"] = [lower], [arc], [top], [line]
            if whole_pin:
                highest = geo.addPoint(0, 2 - hole, 0)
                back, line = geo.addCircleArc(side, centre, highest), geo.addLine(highest, centre)
                faces["pin"].append(geo.addPlaneSurface([geo.addCurveLoop([back, line, -top])]))
                lines["pin back"], lines["symmetry"] = [back], [*lines["symmetry"], line]
        corners = (width, 0), (width, -width), (0, -width)
        block, arc, (held, *_, line), _ = face((0, 0), (0, -hole), (hole, 0), *corners)
        faces["block"], lines["hole"], lines["block held"] = [block], [arc], [held]
        lines["symmetry"].append(line)
        from_arc = f"{growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        sizes = {body: f"{size!r} + {from_arc}" for body, size in zip(faces, on_arc.values(), strict=True)}
        if edge is None:
            return Drawing(faces, sizes, lines, {k: math.pi / 2 / on_arc[arc] for arc in on_arc for k in lines[arc]})
        x, y = hole * math.sin(edge[0]), hole * math.cos(edge[0])
        near_edge = f"{edge[1] / radius!r} + {_EDGE_GROWTH!r} * Sqrt((x - {x!r})^2 + (y + {y!r})^2)"
        return Drawing(faces, {body: f"Min({value}, {near_edge})" for body, value in sizes.items()}, lines, {})

    circles = {"pin": (0.0, 1 - hole, 1.0), "hole": (0.0, 0.0, hole), "pin back": (0.0, 1 - hole, 1.0)}
    near = edge and (edge[0], edge[1] / radius)
    key = ("quarter joint", hole, width, size, growth, size_ratio, near, rigid_pin, whole_pin)
    return mesh_joint(comm, draw, circles, key, radius=radius, **options)

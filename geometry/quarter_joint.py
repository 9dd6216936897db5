"""The paper's quarter joint: a quarter pin of radius R in a quarter hole of radius R + dR, touching at the bottom.

The hole's centre is the origin and the symmetry axis is x = 0. The pin's centre is (0, -dR), so pin and hole touch at
(0, -R - dR). The block reaches to x = W and y = -H; its top edge y = 0 is held, the pin's flat top is the loaded edge.
"""

from __future__ import annotations

import math

from mpi4py import MPI

from archord.geometry.joint_mesh import Cells, Facets, edges_on, mesh_joint
from archord.geometry.tagged_mesh import TaggedMesh

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
    refinements: int = 0,
    **options,
) -> TaggedMesh:
    """Mesh the quarter joint; ``refinements`` and other ``options`` as for `mesh_joint`. Lengths share one unit.

    ``element_size`` is the edge length on the hole's arc, ``size_ratio`` times that the one on the pin's; away from
    them it grows by ``growth`` per unit of distance. ``edge`` is an angle from the axis [rad] and the size to which
    the elements shrink there, where the contact is to end. A rigid pin is not meshed.
    """
    coarsening = 2.0**refinements
    hole, width, size = 1.0 + clearance / radius, block_size / radius, coarsening * element_size / radius

    def draw(geo) -> tuple[dict, dict, dict]:
        faces: dict[Cells, int] = {}
        curves: dict[Facets, list[int]] = {facet: [] for facet in Facets}

        def arc_with(line: int, size: float) -> int:
            if edge is None:
                geo.mesh.setTransfiniteCurve(line, edges_on(math.pi / 2, size) + 1)
            return line

        if not rigid_pin:
            centre, bottom, side = (geo.addPoint(x, y - (hole - 1), 0) for x, y in ((0, 0), (0, -1), (1, 0)))
            arc, top = arc_with(geo.addCircleArc(bottom, centre, side), size_ratio * size), geo.addLine(side, centre)
            axis = geo.addLine(centre, bottom)
            faces[Cells.PIN] = geo.addPlaneSurface([geo.addCurveLoop([arc, top, axis])])
            curves |= {Facets.PIN_ARC: [arc], Facets.PIN_TOP: [top], Facets.SYMMETRY: [axis]}
        points = (0, 0), (0, -hole), (hole, 0), (width, 0), (width, -width), (0, -width)
        centre, bottom, side, *corners = (geo.addPoint(x, y, 0) for x, y in points)
        arc = arc_with(geo.addCircleArc(bottom, centre, side), size)
        edges = [geo.addLine(a, b) for a, b in zip([side, *corners], [*corners, bottom], strict=True)]
        faces[Cells.BLOCK] = geo.addPlaneSurface([geo.addCurveLoop([arc, *edges])])
        curves[Facets.HOLE_ARC], curves[Facets.BLOCK_HELD] = [arc], [edges[0]]
        curves[Facets.SYMMETRY] += [edges[-1]]
        from_arc = f"{coarsening * growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        sizes = {Cells.PIN: f"{size_ratio * size!r} + {from_arc}", Cells.BLOCK: f"{size!r} + {from_arc}"}
        if edge is not None:
            x, y = hole * math.sin(edge[0]), hole * math.cos(edge[0])
            from_edge = f"{coarsening * _EDGE_GROWTH!r} * Sqrt((x - {x!r})^2 + (y + {y!r})^2)"
            fine = coarsening * edge[1] / radius
            sizes = {body: f"Min({value}, {fine!r} + {from_edge})" for body, value in sizes.items()}
        return faces, sizes, curves

    circles = {Facets.PIN_ARC: (1 - hole, 1.0), Facets.HOLE_ARC: (0.0, hole)}
    key = ("quarter joint", hole, width, size, growth, size_ratio, edge and (edge[0], edge[1] / radius), rigid_pin)
    return mesh_joint(comm, draw, circles, key, radius=radius, refinements=refinements, **options)

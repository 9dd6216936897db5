"""The paper's quarter joint: a quarter pin of radius R in a quarter hole of radius R + dR, touching at the bottom.

The hole's centre is the origin and the symmetry axis is x = 0. The pin's centre is (0, -dR), so pin and hole touch at
(0, -R - dR). The block reaches to x = W and y = -H; its top edge y = 0 is held, the pin's flat top is the loaded edge.
gmsh works in units of R whatever the units of the scene, so meshes do not depend on them.
"""

from __future__ import annotations

import math

import numpy as np
from mpi4py import MPI

from archord.geometry.fenicsx import gmsh_to_mesh
from archord.geometry.joint_mesh import Cells, Facets, edges_on, on_circle, tag_and_size
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
    degree: int = 2,
    edge: tuple[float, float] | None = None,
    rigid_pin: bool = False,
    refinements: int = 0,
    partitioner=None,
) -> TaggedMesh:
    """Mesh the quarter joint with second-order curved triangles.

    ``element_size`` is the edge length on the hole's arc, ``size_ratio`` times that the one on the pin's; away from
    them it grows by ``growth`` per unit of distance. ``edge`` is an angle from the axis [rad] and the size to which
    the elements shrink there, where the contact is to end. Lengths share one unit. A rigid pin is not meshed. The mesh
    is made with larger elements, which are then cut in four as often as ``refinements`` says: much quicker.
    ``partitioner`` is a dolfinx cell partitioner (tests use it to cut the mesh in unusual ways). Collective over
    ``comm``; rank 0 meshes.
    """
    coarsening = 2.0**refinements
    hole, width, size = 1.0 + clearance / radius, block_size / radius, coarsening * element_size / radius

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        far = (-hole, 0.0, hole)
        faces: dict[Cells, int] = {}
        curves: dict[Facets, list[int]] = {facet: [] for facet in Facets}
        if not rigid_pin:
            centre, bottom, side = (geo.addPoint(x, y - (hole - 1), 0) for x, y in ((0, 0), (0, -1), (1, 0)))
            arc, top = geo.addCircleArc(bottom, centre, side), geo.addLine(side, centre)
            axis = geo.addLine(centre, bottom)
            faces[Cells.PIN] = geo.addPlaneSurface([geo.addCurveLoop([arc, top, axis])])
            curves[Facets.PIN_ARC], curves[Facets.PIN_TOP] = [arc], [top]
            curves[Facets.SYMMETRY] += [axis]
            if edge is None:
                geo.mesh.setTransfiniteCurve(arc, edges_on(math.pi / 2, size_ratio * size) + 1)
        centre = geo.addPoint(0, 0, 0)
        bottom, side = geo.addPoint(0, far[0], 0), geo.addPoint(far[2], 0, 0)
        corners = [geo.addPoint(x, y, 0) for x, y in ((width, 0), (width, -width), (0, -width))]
        arc = geo.addCircleArc(bottom, centre, side)
        edges = [geo.addLine(a, b) for a, b in zip([side, *corners], [*corners, bottom], strict=True)]
        faces[Cells.BLOCK] = geo.addPlaneSurface([geo.addCurveLoop([arc, *edges])])
        curves[Facets.HOLE_ARC], curves[Facets.BLOCK_HELD] = [arc], [edges[0]]
        curves[Facets.SYMMETRY] += [edges[-1]]
        if edge is None:
            geo.mesh.setTransfiniteCurve(arc, edges_on(math.pi / 2, size) + 1)
        from_arc = f"{coarsening * growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        on_arc = {Cells.PIN: size_ratio * size, Cells.BLOCK: size}
        sizes = {body: f"{value!r} + {from_arc}" for body, value in on_arc.items()}
        if edge is not None:
            angle, fine = edge
            x, y = hole * math.sin(angle), hole * math.cos(angle)
            from_edge = (
                f"{coarsening * fine / radius!r} + {coarsening * _EDGE_GROWTH!r} * Sqrt((x - {x!r})^2 + (y + {y!r})^2)"
            )
            sizes = {body: f"Min({value}, {from_edge})" for body, value in sizes.items()}
        tag_and_size(gmsh, faces, curves, sizes)

    def exact(x: np.ndarray, tag: int) -> np.ndarray:
        if tag == Facets.PIN_ARC:
            return on_circle(x, (0.0, 1 - hole), 1.0)
        return on_circle(x, (0.0, 0.0), hole) if tag == Facets.HOLE_ARC else x

    key = ("quarter joint", hole, width, size, growth, size_ratio, edge and (edge[0], edge[1] / radius), rigid_pin)
    options = {"order": degree, "scale": radius, "refinements": refinements, "partitioner": partitioner}
    return gmsh_to_mesh(comm, build, exact, **options, key=key)

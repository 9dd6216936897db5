"""Half of a whole pin in a whole ring: the joint that Persson (1964) solved, with the material around the hole finite.

Pin (radius R) and hole (radius R + dR, smaller than R for an interference fit) have their common centre at the origin,
and the symmetry axis is x = 0. The ring's outer edge is held. gmsh works in units of R.
"""

from __future__ import annotations

import math

import numpy as np
from mpi4py import MPI

from archord.geometry.fenicsx import gmsh_to_mesh
from archord.geometry.joint_mesh import Cells, Facets, edges_on, on_circle, tag_and_size
from archord.geometry.tagged_mesh import TaggedMesh


def half_ring(
    comm: MPI.Comm,
    radius: float,
    clearance: float,
    outer_radius: float,
    element_size: float,
    growth: float,
    core_radius: float,
    *,
    size_ratio: float = 1.0,
    degree: int = 2,
    refinements: int = 0,
    partitioner=None,
) -> TaggedMesh:
    """Mesh the half joint with second-order curved triangles, ``element_size`` long on the hole's arc and
    ``size_ratio`` times that on the pin's.

    Away from the arcs they grow by ``growth`` per unit of distance, to a third of ``core_radius`` at the pin's centre.
    ``refinements`` as for `quarter_joint`. Lengths share one unit. Collective over ``comm``; rank 0 meshes.
    """
    coarsening = 2.0**refinements
    hole, outer, size, core = (1 + clearance / radius, *(v / radius for v in (outer_radius, element_size, core_radius)))
    size, growth = coarsening * size, coarsening * growth

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        centre = geo.addPoint(0, 0, 0)

        def half_circle(r: float) -> tuple[int, int, list[int]]:
            """Bottom and top points and the two arcs from bottom to top."""
            bottom, side, top = (geo.addPoint(*xy, 0) for xy in ((0, -r), (r, 0), (0, r)))
            return bottom, top, [geo.addCircleArc(bottom, centre, side), geo.addCircleArc(side, centre, top)]

        faces: dict[Cells, int] = {}
        curves: dict[Facets, list[int]] = {facet: [] for facet in Facets}
        bottom, top, pin_arcs = half_circle(1.0)
        axis = [geo.addLine(top, centre), geo.addLine(centre, bottom)]
        faces[Cells.PIN] = geo.addPlaneSurface([geo.addCurveLoop([*pin_arcs, *axis])])
        bottom, top, hole_arcs = half_circle(hole)
        low, high, edge = half_circle(outer)
        below, above = geo.addLine(low, bottom), geo.addLine(top, high)
        loop = [*hole_arcs, above, *(-arc for arc in reversed(edge)), below]
        faces[Cells.BLOCK] = geo.addPlaneSurface([geo.addCurveLoop(loop)])
        curves[Facets.PIN_ARC], curves[Facets.HOLE_ARC] = pin_arcs, hole_arcs
        curves[Facets.BLOCK_HELD], curves[Facets.SYMMETRY] = edge, [*axis, below, above]
        from_arcs = f"{growth!r} * Abs(Sqrt(x*x + y*y) - {hole!r})"
        from_core = f"{coarsening * core / 3!r} + {growth!r} * Sqrt(x*x + y*y)"
        sizes = {}
        for body, arcs, on_arc in ((Cells.PIN, pin_arcs, size_ratio * size), (Cells.BLOCK, hole_arcs, size)):
            for arc in arcs:
                geo.mesh.setTransfiniteCurve(arc, edges_on(math.pi / 2, on_arc) + 1)
            sizes[body] = f"Min({on_arc!r} + {from_arcs}, {from_core})"
        tag_and_size(gmsh, faces, curves, sizes)

    def exact(x: np.ndarray, tag: int) -> np.ndarray:
        radii = {Facets.PIN_ARC: 1.0, Facets.HOLE_ARC: hole, Facets.BLOCK_HELD: outer}
        return on_circle(x, (0.0, 0.0), radii[Facets(tag)]) if tag in radii else x

    key = ("half ring", hole, outer, size, growth, core, size_ratio)
    options = {"order": degree, "scale": radius, "refinements": refinements, "partitioner": partitioner}
    return gmsh_to_mesh(comm, build, exact, **options, key=key)

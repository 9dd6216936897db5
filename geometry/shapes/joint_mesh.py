"""Sketches of joints, meshed by gmsh in a plane or in space, with all nodes of arcs on their
circles."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import (
    gmsh_to_mesh,
    size_field,
    size_within,
    use_smallest,
)
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.sketch import Place, Sketch
from archord.geometry.shapes.solids import Rims, mesh_solids, slabs_of
from archord.materials.kinematics import Arrays

_CUT_ABOVE = (
    30_000,
    100_000,
)  # triangles from which a mesh is made by cutting larger ones, once and twice


def mesh_joint(
    comm: MPI.Comm,
    sketch: Sketch,
    *,
    radius: float,
    degree: int = 2,
    refinements: int = 0,
    partitioner=None,
    space: Mapping[str, float] | None = None,
) -> TaggedMesh:
    """Mesh a ``sketch``, times ``radius``, with all nodes of arcs on their circles; the centre of
    each pin becomes a point set: the centre of "pin" the set "centre", the centre of "inner pin"
    the set "inner centre".

    The mesh is made with larger elements, which are then cut in four as often as ``refinements``
    says: much quicker. ``partitioner`` is a dolfinx cell partitioner (tests cut meshes in unusual
    ways). In ``space``, the section of a scene, all faces are extruded along z.
    Collective; rank 0 meshes.
    """
    pins = {
        name: circle.centre for name, circle in sketch.circles.items() if name.split()[-1] == "pin"
    }
    if space is not None:
        rims = Rims.of(space, radius)
        slabs = slabs_of(sketch, space["thickness"] / radius, space["pin_length"] / radius)
        joint = mesh_solids(
            comm,
            sketch,
            slabs,
            rims,
            radius=radius,
            half=bool(space.get("half", True)),
            partitioner=partitioner,
        )
        points = {**joint.point_sets, **_centres(pins, radius, 3)}
        return replace(joint, point_sets=points)

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        mesh = gmsh.model.mesh
        coarser = 2.0**refinements
        sketch.draw_lines(geo)
        for loop in sketch.loops:
            geo.addPlaneSurface([geo.addCurveLoop(loop, reorient=True)])
        geo.synchronize()
        for line, parts in sketch.parts.items():
            mesh.setTransfiniteCurve(line, max(2, math.ceil(parts / coarser)) + 1)
        for face, corners in sketch.grid.items():
            mesh.setTransfiniteSurface(face, "AlternateLeft", corners)
        for dim, sets in ((2, sketch.faces), (1, sketch.lines)):
            for tag, (name, entities) in enumerate(sets.items(), 1):
                if entities:
                    gmsh.model.addPhysicalGroup(dim, entities, tag, name)
        fields = []
        for body in filter(sketch.faces.get, sketch.faces):
            whole = size_field(gmsh, f"{coarser!r} * ({sketch.sizes[body]})")
            fields.append(size_within(gmsh, whole, sketch.faces[body], 2))
        use_smallest(gmsh, fields)

    how = {"order": degree, "refinements": refinements, "partitioner": partitioner}
    joint = gmsh_to_mesh(
        comm, build, list(sketch.circles.values()), **how, key=tuple(vars(sketch).items())
    )
    joint.mesh.geometry.x[:] *= radius
    return replace(joint, point_sets=_centres(pins, radius, 2)) if pins else joint


def _centres(pins: Mapping[str, Place], radius: float, dimension: int) -> Arrays:
    """The point set of the centre of each pin, whose place is in radii, at z = 0 in space."""
    sets: Arrays = {}
    for name, place in pins.items():
        centre = np.zeros((1, dimension))
        centre[0, :2] = place
        sets[name.removesuffix("pin") + "centre"] = radius * centre
    return sets


def refinements(cells: float) -> int:
    """How often a mesh that is to have about so many ``cells`` is made by cutting triangles in
    four: gmsh's time grows faster than the number of triangles, the time of the cutting does
    not."""
    return sum(cells > limit for limit in _CUT_ABOVE)

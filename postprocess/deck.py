"""The joint as an input deck for CalculiX, and but for the output requests for Abaqus: ``archord export-deck``.

The deck is the half model of docs/theory.md on archord's own mesh, in unit thickness or, in plane stress, a thin slice:
plane elements, small strains, bodies PIN and BLOCK, frictionless contact between PIN_ARC and HOLE_ARC on the deformed
curves by a stiff linear penalty, one ``*STEP`` per output step. Its forces are half the joint's. A rigid pin is meshed
and moved as a whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import entities_to_geometry
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.shapes.joint_mesh import Cells, Facets
from archord.geometry.shapes.quarter_joint import quarter_joint
from archord.scene.scene import Scene

Ints = npt.NDArray[np.int64]
Elements = Literal["quadratic", "linear"]

PENETRATION = 1e-4  # in clearances, under a pressure E* dR/R
SLICE = 0.1  # thickness of a slice in plane stress, in element sizes
# dolfinx numbers the midpoint of an edge by the corner opposite to it, Abaqus by the corner it starts from.
_COUNTERCLOCKWISE = [0, 1, 2, 5, 3, 4]
_MIRRORED = [0, 2, 1, 4, 3, 5]
# Quarter k of a triangle has its corner k, and half of its edge k as edge k.
_QUARTERS = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]

_CONTACT = """*SURFACE INTERACTION, NAME=CONTACT
*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR
{}
*CONTACT PAIR, INTERACTION=CONTACT, TYPE=SURFACE TO SURFACE
PIN_ARC_SURFACE, HOLE_ARC_SURFACE
*BOUNDARY"""
_STEP = """*STEP, INC=1000
*STATIC
1., 1.
*BOUNDARY
{0}, 2, 2, {1}
*NODE PRINT, NSET={0}, TOTALS=ONLY
RF
*NODE PRINT, NSET=BLOCK_HELD, TOTALS=ONLY
RF"""


@dataclass(frozen=True)
class PlaneMesh:
    """Triangles of the half model, numbered from 0, in the node order of Abaqus.

    ``x`` ``(n, 2)`` nodes; ``elements`` ``(m, 3 or 6)`` their nodes, counterclockwise, corners before midpoints;
    ``bodies`` ``(m,)`` their `Cells`; ``edges`` per tag of `Facets` the element and its edge ``(n, 2)``, edge i
    going from corner i to the next.
    """

    x: Array
    elements: Ints
    bodies: Ints
    edges: dict[Facets, Ints]

    def edge_nodes(self, tag: Facets) -> Ints:
        """Nodes ``(n, 2 or 3)`` of the tagged edges: start, end, midpoint."""
        element, edge = self.edges[tag].T
        local = [edge, (edge + 1) % 3, edge + 3][: self.elements.shape[1] // 3 + 1]
        return np.stack([self.elements[element, i] for i in local], axis=1)


def deck_mesh(scene: Scene, elements: Elements) -> PlaneMesh:
    """The mesh that archord solves ``scene`` on, with a pin even if it is rigid, on this rank alone; each of its
    triangles of six nodes cut into four of three nodes for linear ``elements``.

    Raises `InputError` if the scene leaves the mesh open.
    """
    scene.require_mesh()
    g = scene.joint
    joint = quarter_joint(MPI.COMM_SELF, g.radius, g.dR, g.W, g.h, g.growth, size_ratio=g.size_ratio)
    x = joint.mesh.geometry.x[:, :2].copy()
    dofmap = np.asarray(joint.mesh.geometry.dofmap, dtype=np.int64)
    turn = np.linalg.det(x[dofmap[:, 1:3]] - x[dofmap[:, :1]])
    triangles = np.where((turn > 0)[:, None], dofmap[:, _COUNTERCLOCKWISE], dofmap[:, _MIRRORED])
    bodies = joint.cells.values.astype(np.int64)  # every cell has a tag
    joint.mesh.topology.create_connectivity(1, 2)
    cells_of, edges = joint.mesh.topology.connectivity(1, 2), {}
    for tag in Facets:
        facets = joint.facets.find(tag)
        cell = np.array([cells_of.links(facet)[0] for facet in facets])
        ends = entities_to_geometry(joint.mesh, 1, facets)[:, None, :2]
        opposite = (triangles[cell, :3, None] != ends).all(axis=2).argmax(axis=1)
        edges[tag] = np.stack([cell, (opposite + 1) % 3], axis=1)
    if elements == "quadratic":
        return PlaneMesh(x, triangles, bodies, edges)
    for tag, (cell, edge) in ((tag, found.T) for tag, found in edges.items()):
        edges[tag] = np.concatenate([np.c_[4 * cell + half, edge] for half in (edge, (edge + 1) % 3)])
    return PlaneMesh(x, triangles[:, _QUARTERS].reshape(-1, 3), np.repeat(bodies, 4), edges)


def contact_stiffness(scene: Scene) -> float:
    """Slope of pressure over penetration, in stress per length.

    The pressure of a conformal joint is about ``E* dR/R``; the slope lets it go 1e-4 dR deep, which is as if delta were
    smaller by that much: P is too small by 3e-4 (by 3e-3 at a tenth of the slope).
    """
    return scene.E_star / (PENETRATION * scene.joint.radius)


def thickness(scene: Scene) -> float:
    """Thickness of the deck's model, by which its forces are to be divided.

    One in plane strain. CalculiX makes bricks of plane elements, with faces free to move in plane stress; a thick one
    resists, by shear, a thickness strain that varies in the plane. Only thin against the elements it is plane stress.
    """
    return 1.0 if scene.analysis.plane == "strain" else SLICE * scene.joint.h


def loaded_nodes(scene: Scene) -> str:
    """Name of the node set that moves down by delta."""
    return "PIN_NODES" if scene.pin.rigid else "PIN_TOP"


def deck(scene: Scene, mesh: PlaneMesh, thick: float | None = None) -> str:
    """The input deck of ``scene`` on ``mesh``, which holds both bodies even if the pin is rigid; ``thick`` replaces
    `thickness`."""
    thick = thickness(scene) if thick is None else thick
    lines = [*_mesh_lines(scene, mesh, thick), *_model_lines(scene, thick), *_step_lines(scene)]
    return "\n".join(lines) + "\n"


def _mesh_lines(scene: Scene, mesh: PlaneMesh, thick: float) -> Iterator[str]:
    units = scene.units
    yield "*HEADING"
    yield f"archord: half a pin joint; {units.length}, {units.stress}; thickness {_number(thick)}"
    yield "*NODE, NSET=ALL_NODES"
    yield from (f"{i}, {_number(x)}, {_number(y)}" for i, (x, y) in enumerate(zip(*mesh.x.T, strict=True), 1))
    name = ("CPE" if scene.analysis.plane == "strain" else "CPS") + str(mesh.elements.shape[1])
    for body in Cells:
        yield f"*ELEMENT, TYPE={name}, ELSET={body.name}"
        for e in np.flatnonzero(mesh.bodies == body):
            yield ", ".join(map(str, [e + 1, *(mesh.elements[e] + 1)]))
    sets = {"PIN_NODES": mesh.elements[mesh.bodies == Cells.PIN]} | {tag.name: mesh.edge_nodes(tag) for tag in Facets}
    for name, nodes in sets.items():
        listed = np.unique(nodes) + 1
        yield f"*NSET, NSET={name}"
        yield from (", ".join(map(str, listed[i : i + 10])) for i in range(0, len(listed), 10))
    for tag in (Facets.PIN_ARC, Facets.HOLE_ARC):
        yield f"*SURFACE, NAME={tag.name}_SURFACE, TYPE=ELEMENT"
        yield from (f"{e + 1}, S{edge + 1}" for e, edge in mesh.edges[tag])


def _model_lines(scene: Scene, thick: float) -> Iterator[str]:
    for body, solid in ((Cells.PIN, scene.block if scene.pin.rigid else scene.pin), (Cells.BLOCK, scene.block)):
        yield from (f"*MATERIAL, NAME={body.name}", "*ELASTIC", f"{solid.E!r}, {solid.nu!r}")
        if solid.yield_stress is not None:
            yield "*PLASTIC"
            peeq = solid.law.knots()
            for stress, at in np.column_stack([solid.law.stress(peeq), peeq]):
                yield f"{_number(stress)}, {_number(at)}"
        yield from (f"*SOLID SECTION, ELSET={body.name}, MATERIAL={body.name}", _number(thick))
    held = ["PIN_NODES, 1, 1"] if scene.pin.rigid else []
    yield from (*_CONTACT.format(_number(contact_stiffness(scene))).splitlines(), *held)
    yield from ("SYMMETRY, 1, 1", "BLOCK_HELD, 1, 2")


def _step_lines(scene: Scene) -> Iterator[str]:
    loaded = loaded_nodes(scene)
    for k, target in enumerate(scene.targets, 1):
        yield from _STEP.format(loaded, _number(-target)).splitlines()
        if k == len(scene.targets):
            yield from ("*NODE FILE, OUTPUT=2D", "U", "*CONTACT FILE", "CSTR")
            for body in Cells if scene.plastic else ():
                yield from (f"*EL PRINT, ELSET={body.name}", "PEEQ")
        yield "*END STEP"


def _number(value: float) -> str:
    """As many digits as fit into the 20 characters that CalculiX reads."""
    text = repr(float(value))
    return text if len(text) <= 20 else f"{value:.13e}"

"""The joint as an input deck for CalculiX (and, but for two output requests, Abaqus): for a second opinion.

The deck is the half model of docs/theory.md in unit thickness: plane elements, bodies PIN and BLOCK, frictionless
contact between PIN_ARC and HOLE_ARC by a stiff linear penalty, one ``*STEP`` per output step. Its forces are half the
joint's. A rigid pin is meshed too and moved as a whole.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from archord.geometry.quarter_joint import Cells, Facets
from archord.solver.scene import Pin, Scene, Solid

Ints = npt.NDArray[np.int64]
Array = npt.NDArray[np.float64]

PENETRATION = 1e-4  # of a pressure E* dR/R, as a part of dR: P changes by about as much
_SHAPES = {3: "3", 6: "6", 4: "4", 8: "8R"}  # nodes of an element: end of its name


@dataclass(frozen=True)
class PlaneMesh:
    """A mesh of the half model, numbered from 0, in the node order of Abaqus.

    ``x`` ``(n, 2)`` nodes, ``elements`` ``(m, k)`` their nodes, counterclockwise, corners before midpoints (k = 3, 4, 6
    or 8), ``bodies`` ``(m,)`` their `Cells`; ``edges`` lists per tag of `Facets` the element and the local edge ``(n, 2)``
    (edge i goes from corner i to the next).
    """

    x: Array
    elements: Ints
    bodies: Ints
    edges: dict[Facets, Ints]

    @property
    def n_corners(self) -> int:
        """Corners of an element: 3 or 4."""
        return self.elements.shape[1] if self.elements.shape[1] < 5 else self.elements.shape[1] // 2

    def edge_nodes(self, tag: Facets) -> Ints:
        """Nodes ``(n, 2 or 3)`` of the tagged edges: first, last, midpoint."""
        element, edge = self.edges[tag].T
        n = self.n_corners
        ends = [edge, (edge + 1) % n] + ([edge + n] if self.elements.shape[1] > n else [])
        return np.stack([self.elements[element, i] for i in ends], axis=1)


def contact_stiffness(scene: Scene) -> float:
    """Slope of pressure over penetration: ``E* dR/R``, a usual pressure, goes 1e-4 dR deep."""
    return scene.E_star / (PENETRATION * scene.joint.radius)


def deck(scene: Scene, mesh: PlaneMesh, *, steps: int | None = None) -> str:
    """The input deck of ``scene`` on ``mesh``; ``steps`` replaces the scene's number of equal steps."""
    return "\n".join(_lines(scene, mesh, steps or scene.load.steps)) + "\n"


def _lines(scene: Scene, mesh: PlaneMesh, steps: int) -> Iterator[str]:
    pin_set = "PIN_NODES" if scene.pin.rigid else "PIN_TOP"
    units = scene.units
    yield "*HEADING"
    yield f"archord: pin in hole, half model; {units.length}, {units.stress}; forces per unit thickness are half the joint's"
    yield "*NODE, NSET=ALL_NODES"
    yield from (f"{i}, {_number(x)}, {_number(y)}" for i, (x, y) in enumerate(mesh.x, 1))
    name = ("CPE" if scene.analysis.plane == "strain" else "CPS") + _SHAPES[mesh.elements.shape[1]]
    for body in Cells:
        yield f"*ELEMENT, TYPE={name}, ELSET={body.name}"
        for e in np.flatnonzero(mesh.bodies == body):
            yield ", ".join(map(str, [e + 1, *(mesh.elements[e] + 1)]))
    yield from _node_set("PIN_NODES", mesh.elements[mesh.bodies == Cells.PIN])
    for tag in Facets:
        yield from _node_set(tag.name, mesh.edge_nodes(tag))
    for tag in (Facets.PIN_ARC, Facets.HOLE_ARC):
        yield f"*SURFACE, NAME={tag.name}_SURFACE, TYPE=ELEMENT"
        yield from (f"{e + 1}, S{edge + 1}" for e, edge in mesh.edges[tag])
    for body, solid in ((Cells.PIN, scene.pin), (Cells.BLOCK, scene.block)):
        yield from _material(body.name, scene.block if scene.pin.rigid else solid)
        yield from (f"*SOLID SECTION, ELSET={body.name}, MATERIAL={body.name}", "1.")
    yield from ("*SURFACE INTERACTION, NAME=CONTACT", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR")
    yield _number(contact_stiffness(scene))
    yield "*CONTACT PAIR, INTERACTION=CONTACT, TYPE=SURFACE TO SURFACE"
    yield "PIN_ARC_SURFACE, HOLE_ARC_SURFACE"
    yield "*BOUNDARY"
    yield from (["PIN_NODES, 1, 1"] if scene.pin.rigid else []) + ["SYMMETRY, 1, 1", "BLOCK_TOP, 1, 2"]
    for k in range(1, steps + 1):
        yield from ("*STEP, INC=1000", "*STATIC", "1., 1.", "*BOUNDARY")
        yield f"{pin_set}, 2, 2, {_number(-scene.delta * k / steps)}"
        for support in (pin_set, "BLOCK_TOP"):
            yield from (f"*NODE PRINT, NSET={support}, TOTALS=ONLY", "RF")
        if k == steps:
            yield from ("*CONTACT PRINT", "CSTR")
            for body in Cells if scene.plastic else ():
                yield from (f"*EL PRINT, ELSET={body.name}", "PEEQ")
        yield "*END STEP"


def _material(name: str, solid: Pin | Solid) -> Iterator[str]:
    yield from (f"*MATERIAL, NAME={name}", "*ELASTIC", f"{solid.E!r}, {solid.nu!r}")
    if solid.yield_stress is not None:
        yield from ("*PLASTIC", f"{_number(solid.yield_stress)}, 0.")
        if solid.hardening:
            yield f"{_number(solid.yield_stress + solid.hardening)}, 1."


def _node_set(name: str, nodes: Ints) -> Iterator[str]:
    yield f"*NSET, NSET={name}"
    listed = np.unique(nodes) + 1
    yield from (", ".join(map(str, listed[i : i + 10])) for i in range(0, len(listed), 10))


def _number(value: float) -> str:
    """As many digits as fit into the 20 characters that CalculiX reads."""
    text = repr(float(value))
    return text if len(text) <= 20 else f"{value:.13e}"


def reactions_half(values: Iterable[float]) -> list[float]:
    return [2 * v for v in values]

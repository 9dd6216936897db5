"""The joint as an input deck for CalculiX, and but for the output requests for Abaqus: for a second opinion.

The deck is the half model of docs/theory.md, in unit thickness or, in plane stress, a thin slice: plane elements, small
strains, bodies PIN and BLOCK, frictionless contact between PIN_ARC and HOLE_ARC on the deformed curves by a stiff
linear penalty, one ``*STEP`` per output step. Its forces are half the joint's. A rigid pin is meshed and moved as a
whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from archord.benchmarks.peers.deck_mesh import Elements, Ints, PlaneMesh, deck_mesh
from archord.geometry.joint_mesh import Cells, Facets
from archord.output.output_file import writing
from archord.scene.errors import InputError
from archord.scene.scene import Pin, Scene, Solid

PENETRATION = 1e-4  # in clearances, under a pressure E* dR/R
SLICE = 0.1  # thickness of a slice in plane stress, in element sizes
_SHAPES = {3: "3", 6: "6"}


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


def write_deck(scene: Scene, path: Path, elements: Elements, *, force: bool = False) -> None:
    """Mesh ``scene`` and write its deck to ``path``. Raises `InputError` if that is not possible, or overwrites a file
    without ``force``."""
    if path.exists() and not path.is_dir() and not force:
        raise InputError(f"{path}: is there already; choose another file with -o, or overwrite it with --force.")
    with writing(path):
        path.write_text(deck(scene, deck_mesh(scene, elements)), encoding="utf-8")


def _mesh_lines(scene: Scene, mesh: PlaneMesh, thick: float) -> Iterator[str]:
    units = scene.units
    yield "*HEADING"
    yield f"archord: half a pin joint; {units.length}, {units.stress}; thickness {_number(thick)}"
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


def _model_lines(scene: Scene, thick: float) -> Iterator[str]:
    for body, solid in ((Cells.PIN, scene.block if scene.pin.rigid else scene.pin), (Cells.BLOCK, scene.block)):
        yield from _material(body.name, solid)
        yield from (f"*SOLID SECTION, ELSET={body.name}, MATERIAL={body.name}", _number(thick))
    yield from ("*SURFACE INTERACTION, NAME=CONTACT", "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR")
    yield _number(contact_stiffness(scene))
    yield "*CONTACT PAIR, INTERACTION=CONTACT, TYPE=SURFACE TO SURFACE"
    yield "PIN_ARC_SURFACE, HOLE_ARC_SURFACE"
    yield "*BOUNDARY"
    if scene.pin.rigid:
        yield "PIN_NODES, 1, 1"
    yield from ("SYMMETRY, 1, 1", "BLOCK_HELD, 1, 2")


def _step_lines(scene: Scene) -> Iterator[str]:
    loaded, n = loaded_nodes(scene), len(scene.targets)
    for k, target in enumerate(scene.targets, start=1):
        yield from ("*STEP, INC=1000", "*STATIC", "1., 1.", "*BOUNDARY")
        yield f"{loaded}, 2, 2, {_number(-target)}"
        for support in (loaded, "BLOCK_HELD"):
            yield from (f"*NODE PRINT, NSET={support}, TOTALS=ONLY", "RF")
        if k == n:
            yield from ("*NODE FILE, OUTPUT=2D", "U", "*CONTACT FILE", "CSTR")
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

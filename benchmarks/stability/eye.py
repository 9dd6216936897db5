"""An eye with a bushing in one bore and a pin in each: bodies that nothing holds but contact and
friction."""

from __future__ import annotations

import math
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

from archord.geometry.meshes.fenicsx import own_gmsh, set_mesh_options

_AT = {"A": 25.0, "B": -28.0}  # x of the centre of each bore
_EYE = (60.0, 32.0)  # half axes of the ellipse
_CIRCLES = {
    "boreA": ("A", 12.0),
    "boreB": ("B", 10.0),
    "bush_outer": ("A", 12.03),
    "bush_inner": ("A", 9.05),
    "pin_edge": ("A", 9.0),
    "pinB_edge": ("B", 9.95),
}  # a bore and a radius by the name of the edge
_COARSEST = 8.0


@cache
def drawn_eye(edges: int) -> Path:
    """A .msh file with ``edges`` around each circle; lengths in mm.

    Bodies are "eye", "bush", "pin" (in the bushing) and "pinB" (in the other bore). The bushing is
    drawn 0.03 larger than its bore; the pins have clearances of 0.05.
    """
    file = Path(tempfile.mkdtemp()) / "eye.msh"
    with own_gmsh() as gmsh:
        _draw(gmsh, edges)
        gmsh.write(str(file))
    return file


def _draw(gmsh: Any, edges: int) -> None:
    occ = gmsh.model.occ

    def disc(edge: str) -> int:
        bore, radius = _CIRCLES[edge]
        return occ.addDisk(_AT[bore], 0.0, 0.0, radius, radius)

    def without(outer: int, *holes: int) -> int:
        cut, _ = occ.cut([(2, outer)], [(2, hole) for hole in holes])
        return cut[0][1]

    ellipse = occ.addDisk(0.0, 0.0, 0.0, *_EYE)
    bodies = {
        "eye": without(ellipse, disc("boreA"), disc("boreB")),
        "bush": without(disc("bush_outer"), disc("bush_inner")),
        "pin": disc("pin_edge"),
        "pinB": disc("pinB_edge"),
    }
    occ.synchronize()
    for name, surface in bodies.items():
        gmsh.model.addPhysicalGroup(2, [surface], name=name)
    for name, (bore, radius) in _CIRCLES.items():
        curves = [
            curve
            for _, curve in gmsh.model.getEntities(1)
            if _on_circle(gmsh, curve, _AT[bore], radius)
        ]
        gmsh.model.addPhysicalGroup(1, curves, name=name)
    options = {"MeshSizeFromCurvature": edges, "MeshSizeMax": _COARSEST, "ElementOrder": 2}
    set_mesh_options(gmsh, options)
    gmsh.model.mesh.generate(2)


def _on_circle(gmsh: Any, curve: int, centre: float, radius: float) -> bool:
    """Whether the ``curve`` lies on the circle around ``(centre, 0)``, seen from where it
    starts."""
    start = gmsh.model.getParametrizationBounds(1, curve)[0][0]
    x, y, _ = gmsh.model.getValue(1, curve, [start])
    return math.isclose(math.hypot(x - centre, y), radius, abs_tol=1e-6)

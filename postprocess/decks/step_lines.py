"""The lines of a step of a deck."""

from __future__ import annotations

import numpy as np

from archord.postprocess.decks.mesh import label
from archord.postprocess.decks.mesh_lines import DRIVES
from archord.postprocess.decks.model import DeckModel
from archord.postprocess.decks.rows import block, number, pair
from archord.report.by_name import Amounts

_LARGE = (
    "NLGEOM is elastic by St. Venant and Kirchhoff in CalculiX; archord has Hencky's elasticity"
)
_RESULTS = ["*NODE FILE{}", "U", "*EL FILE{}", "S", "*CONTACT FILE", "CSTR"]
_AS_DRAWN = ", OUTPUT=2D"  # not of the bricks that CalculiX makes of plane elements


def step_lines(model: DeckModel, target: float, *, first: bool, last: bool) -> list[str]:
    """The step to the ``target``: displacements, forces, and what is to be printed."""
    problem = model.problem
    values = {drive.name: drive.value(target) for drive in problem.all_drives}
    large = any(body.material.finite for body in problem.bodies)
    lines = [f"** {_LARGE}"] if large and first else []
    lines += [f"*STEP, INC=1000{', NLGEOM' if large else ''}", "*STATIC", "1., 1."]
    if first and problem.fit:
        for interaction in problem.interactions:
            lines.append("** Abaqus alone, without the stars: *CONTACT INTERFERENCE, SHRINK")
            lines.append(f"** {pair(interaction)}")
    moved = [row for m in model.held if m.rates for row in m.boundary(values)]
    pulled = []
    share = model.slice / problem.whole
    for drive, node in model.own.items():
        if drive in model.pulled:
            pulled.append(f"{node}, 1, {number(values[drive] * share)}")
        else:
            moved.append(f"{node}, 1, 1, {number(values[drive])}")
    lines += block("*BOUNDARY", moved)
    lines += block("*CLOAD", _nodal_forces(model, values) + pulled)
    for name in dict.fromkeys(label(m.node_set) for m in model.moved):
        lines += [f"*NODE PRINT, NSET={name}, TOTALS=ONLY", "RF"]
    if model.own:
        lines += [f"*NODE PRINT, NSET={DRIVES}", "U"]
    if last:
        as_drawn = "" if model.mesh.x.shape[1] == 3 else _AS_DRAWN
        lines += [line.format(as_drawn) for line in _RESULTS]
        if any(body.material.yields for body in problem.bodies):
            for body in problem.bodies:
                lines += [f"*EL PRINT, ELSET={label(body.name)}", "PEEQ"]
    return [*lines, "*END STEP"]


def _nodal_forces(model: DeckModel, values: Amounts) -> list[str]:
    """Rows of ``*CLOAD`` at these values of the drives, at all nodes that are ever loaded."""
    total = np.zeros_like(model.mesh.x)
    ever = np.zeros_like(total)
    for drive, forces in model.loads.items():
        total += values[drive] * forces
        ever += np.abs(forces)
    loaded = np.argwhere(ever)
    return [f"{n + 1}, {axis + 1}, {number(total[n, axis])}" for n, axis in loaded]

"""The function that asks a run for a quantity along an edge or a line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from archord.output.cell_fields import row_of
from archord.postprocess.probes.edge import along_edge
from archord.postprocess.probes.line import along_line
from archord.postprocess.probes.probe import Probe
from archord.postprocess.probes.probed import Probed
from archord.postprocess.probes.surface import CONTACT, along_surface
from archord.report.by_name import Amounts
from archord.report.errors import InputError

_OF_LENGTH = ("ux", "uy", "uz", "gap")
_OF_STRESS = (*CONTACT, "hoop", "along", "normal", "shear", "p1", "p2", "p3")
_PER = {"axisymmetric": "on the whole ring", "space": "on the whole"}
_PER |= dict.fromkeys(("strain", "stress"), "per unit thickness")
_NOTHING = 1e-9  # of the largest force of a run: round-off


def probe(run: Probed, edge: str, quantity: str, step: int, line: Sequence[float]) -> Probe:
    """A ``quantity`` along an ``edge`` of the mesh or the straight ``line`` x0, y0, x1, y1, in
    space x0, y0, z0, x1, y1, z1. Raises `InputError`.

    At the nodes of an edge its "hoop" (the default), "normal" or "shear" stress, or a nodal field:
    "hoop" is the stress along the edge; around an axis it is the stress round the axis, and the
    stress along the edge is "along";
    at the integration points of a surface "pressure", "gap" or, with friction, "contact_shear", or
    "facet_pressure", the mean of each facet, which scatters less where bodies yield. On a line a
    nodal field (von Mises stress), linear between nodes, or else a field of the cells; where bodies
    meet, it is of the first one. In space an edge is "A & B", where two surfaces meet; it has
    "hoop" and nodal fields, and nodal fields are quadratic between nodes.
    """
    if bool(edge) == bool(line):
        raise InputError("probe: give an edge or a line.")
    kind = run.kinematics
    if line:
        quantity = quantity or "von_mises"
        found = along_line(run, line, quantity, step)
    elif quantity in CONTACT:
        found = along_surface(run, edge, quantity, step)
    else:
        quantity = quantity or "hoop"
        found = along_edge(run, edge, quantity, step)
    pulls = _pulls(run, step)
    by = max(pulls, key=lambda name: abs(pulls[name]), default="")
    return Probe(
        place=edge or "line",
        quantity=quantity,
        unit=_unit_of(quantity, run.scene.units),
        step=step,
        force=pulls.get(by, 0.0),
        by=by,
        pulls=pulls,
        length=run.scene.units.length,
        axes=kind.axes,
        per=_PER[kind.name],
        **found._asdict(),
    )


def _unit_of(quantity: str, units: Any) -> str:
    if quantity == "principal_angle":
        return "rad"
    if quantity in _OF_LENGTH:
        return str(units.length)
    row = row_of(quantity)
    if quantity in _OF_STRESS or (row and row.unit == "{stress}"):
        return str(units.stress)
    return ""


def _pulls(run: Probed, step: int) -> Amounts:
    """The forces of the loads at ``step``, per unit thickness, 0 where they are round-off."""
    columns = {by: run.columns[column] for by, column in run.view.pulls.items()}
    found = {}
    for by, forces in columns.items():
        force = forces[step - 1]
        is_force = abs(force) > _NOTHING * max(map(abs, forces))
        found[by] = force / run.scene.thickness if is_force else 0.0
    return found

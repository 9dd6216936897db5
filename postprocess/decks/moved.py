"""What supports and rigid discs move or hold in a deck."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from archord.materials.kinematics import Ints
from archord.materials.material import Arrays
from archord.postprocess.decks.mesh import DeckMesh, label, surface_name
from archord.postprocess.decks.rows import number
from archord.report.by_name import Amounts
from archord.solver.path.system import System
from archord.solver.problem import Rigid


@dataclass(frozen=True)
class Moved:
    """The component ``axis`` of the ``nodes`` ``(k,)`` of ``node_set``: the sum over drives of
    ``rates`` ``(k,)`` times their values; ``whole`` if these are all nodes of the set."""

    node_set: str
    axis: int
    nodes: Ints
    rates: Arrays
    whole: bool

    def boundary(self, values: Amounts) -> list[str]:
        """Rows of ``*BOUNDARY`` at these values of the drives."""
        moved = np.zeros(len(self.nodes))
        for drive, rate in self.rates.items():
            moved += values[drive] * rate
        names = list(map(str, self.nodes + 1))
        if self.whole and np.ptp(moved) == 0:
            names = [label(self.node_set)]
        axis = self.axis + 1
        return [
            f"{name}, {axis}, {axis}, {number(value)}"
            for name, value in zip(names, moved, strict=False)
        ]


def moved_sets(system: System, mesh: DeckMesh) -> list[Moved]:
    """What supports and rigid discs move or hold."""
    found = {}
    drives = system.equilibrium.drives
    for support in system.problem.supports:
        name = support.facets
        axis = support.axis
        nodes = mesh.node_sets[name]
        own = drives.held_by(support.name)[mesh.dofs[nodes], axis]
        dofs = mesh.dofs[nodes[own]]
        rates = {
            drive: rate[dofs, axis]
            for drive, rate in zip(drives.names, drives.rate, strict=False)
            if rate[dofs, axis].any()
        }
        if own.any():
            found[name, axis] = Moved(name, axis, nodes[own], rates, bool(own.all()))
    for interaction in system.problem.interactions:
        disc = interaction.surfaces[0]
        if isinstance(disc, Rigid):
            name = surface_name(interaction, 0)
            nodes = mesh.node_sets[name]
            for axis in (0, 1):
                rates = {
                    drive: np.full(len(nodes), rate[axis])
                    for drive, rate in disc.moved_by().items()
                    if rate[axis]
                }
                found[name, axis] = Moved(name, axis, nodes, rates, True)
    return list(found.values())

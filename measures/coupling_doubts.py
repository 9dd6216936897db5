"""Rigid couplings of a plane that turn far at large strain: they turn linearly, and stretch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from archord.measures.measure import Accepted
from archord.report.by_name import Words
from archord.report.doubts import Doubt
from archord.scene.parts import CouplingSection

if TYPE_CHECKING:
    from archord.scene.problem import ProblemScene
    from archord.solver.path.system import System

_OFF = 0.01  # of the moment, or of the force times the lever
_TURNS = 1e-3  # angle below which nothing is stretched


def lever_doubts(scene: ProblemScene, state: Accepted) -> Iterator[str]:
    """A warning of each rigid coupling whose facets carry another moment about its point, where
    this is now, than its rotation does: the stretch of the facets takes the difference.
    Collective."""
    for part in scene.coupling:
        names: Words = {
            str(load.direction): load.name for load in scene.load if load.on == part.name
        }
        motions = [
            state.driven.get(names.get(freedom, f"{part.name} {freedom}"), (0.0, 0.0))
            for freedom in ("x", "y", "rotation")
        ]
        (x, _), (y, _), (angle, moment) = motions
        if part.kind != "rigid" or abs(angle) < _TURNS:
            continue
        place = np.add(part.point, (x, y))
        force = state.reaction(part.name)
        of_force = place[0] * force[1] - place[1] * force[0]
        carried = state.reaction_moments(part.name)[-1] - of_force
        size = max(abs(moment), float(np.linalg.norm(force)) * _lever(state.system, part))
        off = abs(carried - moment) / size if size else 0.0
        if off > _OFF:
            text = f"the rigid coupling {part.name!r} turns by {angle:.2g} rad at large strain"
            by = f"its facets stretch, and carry a moment that is off by {100 * off:.2g} %"
            cure = 'kind = "distributing" does not stretch them'
            yield Doubt(f"{text}: {by} of its force times its lever, or of its own; {cure}", off)


def _lever(system: System, part: CouplingSection) -> float:
    """The largest distance of the facets of a coupling from its point. Collective."""
    nodes = system.problem.mesh.dofs_in(system.V, part.facets)
    arms = system.V.tabulate_dof_coordinates()[nodes, : len(part.point)] - np.array(part.point)
    here = np.linalg.norm(arms, axis=1).max(initial=0.0)
    return system.comm.allreduce(float(here), op=MPI.MAX)

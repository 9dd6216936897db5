"""Parts that make up a whole several times, but are not held as mirrors would hold them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from archord.solver.path.mirrors import flat_held

if TYPE_CHECKING:
    from archord.solver.path.mirrors import Mirror
    from archord.solver.path.system import System


def mirror_doubts(system: System) -> Iterator[str]:
    """Warnings of a part with symmetry that lacks mirrors, and of bodies that could pass through
    one. Collective."""
    problem = system.problem
    if problem.symmetry == 1:
        return
    n_flat = len(flat_held(problem, system.V))
    if 2**n_flat < problem.symmetry:
        yield (
            f"the symmetry is {problem.symmetry:g}, but the straight sides at an end of the mesh "
            f"that are held across themselves alone, as in a mirror, are {n_flat}: results are "
            f"{problem.symmetry:g} times those of the part as it is held"
        )
    for mirror in system.mirrors:
        axis = problem.kinematics.axes[mirror.axis]
        at = mirror.at if abs(mirror.at) > mirror.near else 0.0
        for body in problem.bodies:
            if _n_free(system, mirror, system.nodes_of(body)) > problem.degree:
                yield (
                    f"sides of {body.name!r} lie in the mirror {axis} = {at:.6g} of the part, but "
                    f"are not held in {axis}: they may part from their images or pass through them"
                )


def _n_free(system: System, mirror: Mirror, nodes: np.ndarray) -> int:
    """How many of the ``nodes`` of a body lie in a ``mirror`` and may leave it."""
    problem = system.problem
    owned = nodes[nodes < system.V.dofmap.index_map.size_local]
    x = system.V.tabulate_dof_coordinates()[owned, mirror.axis]
    within = owned[np.abs(x - mirror.at) < mirror.near]
    held = [s.facets for s in problem.supports if s.axis == mirror.axis]
    held_nodes = [problem.mesh.dofs_in(system.V, name) for name in dict.fromkeys(held)]
    return system.comm.allreduce(len(np.setdiff1d(within, np.concatenate(held_nodes))))

"""Parts that make up a whole several times, but are not held as mirrors would hold them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.kinematics import Bools
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
        free = _free(system, mirror)
        for body in problem.bodies:
            n_free = system.comm.allreduce(int(free[system.nodes_of(body)].sum()))
            if n_free > problem.degree:
                yield (
                    f"sides of {body.name!r} lie in the mirror {axis} = {at:.6g} of the part, but "
                    f"are not held in {axis}: they may part from their images or pass through them"
                )


def _free(system: System, mirror: Mirror) -> Bools:
    """Which of this rank's nodes ``(n_nodes,)``, but for ghosts, lie in a ``mirror`` and may leave
    it. Collective."""
    problem = system.problem
    x = system.V.tabulate_dof_coordinates()[:, mirror.axis]
    free: Bools = np.abs(x - mirror.at) < mirror.near
    free[system.V.dofmap.index_map.size_local :] = False
    held = [s.facets for s in problem.supports if s.axis == mirror.axis]
    for name in dict.fromkeys(held):
        free[problem.mesh.dofs_in(system.V, name)] = False
    return free

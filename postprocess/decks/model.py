"""The problem of a deck, as all its parts need it: its thickness, what moves, and nodal forces."""

from __future__ import annotations

import numpy as np

from archord.postprocess.decks.mesh import DeckMesh
from archord.postprocess.decks.moved import moved_sets
from archord.solver.path.system import System
from archord.solver.problem import Problem, Rigid

SLICE = 0.1  # thickness of a slice in plane stress, in the shortest edge
WEDGES = 180  # wedges of CalculiX in a ring


def thickness(problem: Problem, mesh: DeckMesh) -> float:
    """Thickness of the deck's model, by which the forces are to be divided that CalculiX prints:
    one in plane strain, a wedge's part of the ring around an axis.

    In plane stress CalculiX's bricks must be thin against the elements: thick ones resist, by
    shear, a thickness strain that varies in the plane.
    """
    if problem.kinematics.has_hoop:
        return 1 / WEDGES
    if not problem.kinematics.is_thin:
        return 1.0
    ends = [mesh.x[nodes[:, :2]] for nodes in mesh.elements.values()]
    return SLICE * min(float(np.linalg.norm(np.diff(x, axis=1), axis=2).min()) for x in ends)


class DeckModel:
    """What the parts of a deck share.

    Attributes
    ----------
    thick : float
        What forces of the deck's springs and prints are multiplied by, see `thickness`.
    slice : float
        What nodal forces are multiplied by: the thickness, or 1 of a whole ring.
    moved : list of Moved
        All sets that are held or moved: ``hung`` on nodes of drives, or ``held``.
    loads : dict
        Nodal forces ``(n, d)`` by the names of their drives, per unit of the drive's value.
    own : dict
        The labels of nodes of their own, by the names of drives; forces pull the ``pulled`` ones.
    """

    def __init__(self, system: System, mesh: DeckMesh) -> None:
        self.system = system
        self.problem = problem = system.problem
        self.mesh = mesh
        self.thick = thickness(problem, mesh)
        has_hoop = problem.kinematics.has_hoop
        self.slice = 1.0 if has_hoop else self.thick
        if has_hoop and any(isinstance(i.surfaces[0], Rigid) for i in problem.interactions):
            raise ValueError("a rigid disc cannot be exported around an axis; a body can")
        if problem.turns:
            raise ValueError(
                f"the finite rotation of {problem.turns[0].name!r} cannot be exported; a rotation "
                "at small strain can"
            )
        drives = system.equilibrium.drives
        by_force = {drive.name for drive in problem.all_drives if drive.control == "force"}
        means = [mean.name for mean in problem.means if mean.drive not in by_force]
        if means:
            raise ValueError(
                f"the mean displacement of {means[0]!r} cannot be exported; a force on it can"
            )
        self.loads = {}
        for name, of_dofs in zip(drives.names, drives.applied, strict=False):
            forces = self.slice * mesh.forces(of_dofs)
            if forces.any():
                self.loads[name] = forces
        self.moved = moved_sets(system, mesh)
        self.hung = [m for m in self.moved if by_force & set(m.rates)]
        self.held = [m for m in self.moved if not by_force & set(m.rates)]
        own = dict.fromkeys(drive for m in self.hung for drive in m.rates)
        self.own = {drive: len(mesh.x) + k for k, drive in enumerate(own, 1)}
        self.pulled = by_force & set(own)

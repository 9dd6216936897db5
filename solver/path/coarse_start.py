"""Guesses from a coarser mesh (nested iteration), which follows the path of loads step by step.

Newton's method moves the edge of the contact, and of a plastic zone, by few elements an iteration.
The coarse problem finds both edges where iterations are cheap; the fine one corrects its increments
by less than a coarse element.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.geometry.meshes.interpolation import Interpolation
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.system import System

_FEWEST_DOFS = 8_000  # of a problem that is worth a coarse start
# of one that yields in plane stress, where flow localises and Newton's method is slow
_FEWEST_STRESS = 4_000
_FEWEST_IN_SPACE = 40_000  # where coarse meshes find less of the contact for their time
_TOLERANCE = 1e-4  # residual over reaction: what is found is a guess
_FEWEST_POINTS = 30  # in contact: of a contact of few coarse elements nothing can be learnt


def coarse_start(system: System) -> CoarseStart | None:
    """The coarse start of ``system``; None where that is coarse itself, or has no coarser problem.
    Collective."""
    problem = system.problem
    if problem.coarser is None or system.n_dofs < _fewest_dofs(system):
        return None
    with system.timer("coarse start"):
        try:
            rough = max(problem.tolerance, _TOLERANCE)
            coarse = System(replace(problem.coarser(), tolerance=rough))
        except (ProjectionError, ValueError):
            # on all ranks: too coarse for the contact to be found, or to be drawn
            return None
        return CoarseStart(system, coarse) if 2 * coarse.n_dofs < system.n_dofs else None


def _fewest_dofs(system: System) -> int:
    if system.problem.kinematics.dimension == 3:
        return _FEWEST_IN_SPACE
    localises = system.bulk.plastic and system.problem.kinematics.is_thin
    return _FEWEST_STRESS if localises else _FEWEST_DOFS


class CoarseStart:
    """Increments of the state of ``fine`` from increments of ``coarse``, the same problem on a
    coarser mesh, which follows its own ``path``. ``iterations`` are of the last attempt, on all
    coarser meshes. Collective."""

    def __init__(self, fine: System, coarse: System) -> None:
        self.fine = fine
        self.coarse = coarse
        coarse.equilibrium.evaluation.interrupt = fine.equilibrium.evaluation.interrupt
        self.path = coarse.load_path(coarse=coarse_start(coarse))
        self.iterations = 0
        self._order = MeshOrder(coarse)
        self._maps = self._interpolations()
        self._reached: float | None = None

    def _interpolations(self) -> list[tuple[np.ndarray, Interpolation]]:
        """For each body its nodes on this rank, and what interpolates the coarse values there."""
        order = self._order
        on_root = order.coordinates, order.nodes_of_cell, order.bodies()
        x, cells, of_cells = self.fine.comm.bcast(on_root)
        d = self.fine.problem.kinematics.dimension
        places = self.fine.V.tabulate_dof_coordinates()[:, :d]
        found = []
        for body in self.fine.problem.bodies:
            nodes = self.fine.nodes_of(body)
            own = cells[of_cells == self.coarse.problem.tag(body)]
            found.append((nodes, Interpolation(order.kind, x[:, :d], own, places[nodes])))
        return found

    def increment(self, load: float) -> Array | None:
        """What a step to ``load`` adds to the fine state, None if the coarse one fails."""
        with self.fine.timer("coarse start"):
            result = self.path.attempt(load)
            self.iterations = result.iterations + self.path.coarse_iterations
            self._reached = load if result.converged else None
            if not result.converged or self._touches_at_few_points():
                return None
            coarse = self.coarse.equilibrium
            step, levels = coarse.unknowns.split(coarse.state() - self.path.state)
            on_nodes = self.coarse.comm.bcast(self._order.collect(step))
            u = np.zeros_like(self.fine.equilibrium.displacement())
            for nodes, interpolate in self._maps:
                u[nodes] = interpolate(on_nodes)
            return np.append(u, levels)

    def _touches_at_few_points(self) -> bool:
        contact = self.coarse.contact
        return bool(contact.pairs) and contact.n_active() < _FEWEST_POINTS

    def follow(self) -> bool:
        """Follow the fine problem, which has accepted the last step; returns whether the coarse one
        could."""
        if self._reached is None:
            return False
        with self.fine.timer("coarse start"):
            self.path.accept(self._reached)
        return True

    def take_back(self) -> None:
        """Undo the last attempt."""
        self.path.take_back()

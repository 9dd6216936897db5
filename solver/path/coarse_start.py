"""Guesses from a coarser mesh (nested iteration), which follows the path of loads step by step.

Newton's method moves the edge of the contact, and of a plastic zone, by few elements an iteration.
The coarse problem finds both edges where iterations are cheap; the fine one corrects its increments
by less than a coarse element.
"""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.geometry.meshes.interpolation import Interpolation
from archord.solver.bulk import Bulk
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.system import System

_FEWEST_DOFS = 8_000  # of a problem that is worth a coarse start
_FEWEST_STRESS = (
    4_000  # of one that yields in plane stress, where flow localises and Newton's method is slow
)
_FEWEST_POINTS = 30  # in contact: of a contact of few coarse elements nothing can be learnt


def coarse_start(system: System) -> CoarseStart | None:
    """The coarse start of ``system``; None where that is coarse itself, or has no coarser problem.
    Collective."""
    if system.n_dofs < _fewest_dofs(system.bulk) or system.problem.coarser is None:
        return None
    with system.timer("coarse start"):
        try:
            coarse = System(system.problem.coarser())
        except ProjectionError:  # on all ranks: too coarse for the contact to be found
            return None
        return CoarseStart(system, coarse) if 2 * coarse.n_dofs < system.n_dofs else None


def _fewest_dofs(bulk: Bulk) -> int:
    planes = {getattr(material, "plane", None) for material in bulk.materials.values()}
    return _FEWEST_STRESS if bulk.plastic and "stress" in planes else _FEWEST_DOFS


class CoarseStart:
    """Increments of the state of ``fine`` from those of ``coarse``, the same problem on a coarser
    mesh. Collective."""

    def __init__(self, fine: System, coarse: System) -> None:
        self.fine, self.coarse = fine, coarse
        coarse.equilibrium.interrupt = fine.equilibrium.interrupt
        self.path = coarse.load_path(coarse=coarse_start(coarse))
        self.iterations = 0  # of the last attempt, on all coarser meshes
        order = self._order = MeshOrder(coarse)
        x, cells, of_cells = fine.comm.bcast(
            (order.coordinates, order.nodes_of_cell, order.bodies())
        )
        places = fine.V.tabulate_dof_coordinates()[:, :2]
        self._maps: list[
            tuple[np.ndarray, Interpolation]
        ] = []  # nodes of a body on this rank, and their values
        for body in fine.problem.bodies:
            nodes, on = fine.nodes_of(body), of_cells == coarse.problem.tag(body)
            self._maps.append(
                (nodes, Interpolation(order.kind, x[:, :2], cells[on], places[nodes]))
            )
        self._reached: float | None = None

    def increment(self, load: float) -> Array | None:
        """What a step to ``load`` adds to the fine state ``(2 n_local + d,)``, None if the coarse
        one fails."""
        with self.fine.timer("coarse start"):
            result, contact = self.path.attempt(load), self.coarse.contact
            self.iterations = result.iterations + self.path.coarse_iterations
            self._reached = load if result.converged else None
            if not result.converged or (contact.pairs and contact.n_active() < _FEWEST_POINTS):
                return None
            step = self.coarse.equilibrium.state() - self.path.state
            increment, levels = np.split(step, [2 * self.coarse.equilibrium.n_local])
            on_nodes = self.coarse.comm.bcast(self._order.collect(increment.reshape(-1, 2)))
            u = np.zeros((self.fine.equilibrium.n_local, 2))
            for nodes, interpolate in self._maps:
                u[nodes] = interpolate(on_nodes)
            return np.append(u, levels)

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

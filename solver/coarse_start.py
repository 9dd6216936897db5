"""Guesses from a coarser mesh (nested iteration), which follows the path of loads step by step.

Newton's method moves the edge of the contact, and of a plastic zone, by few elements an iteration, so that iterations
grow with the mesh. The coarse joint finds both edges where iterations are cheap; its increments, interpolated, leave
the fine joint to correct them by less than a coarse element.
"""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.geometry.interpolation import Interpolation
from archord.presets.joint import Joint
from archord.scene.scene import Scene
from archord.solver.load_path import Walk
from archord.solver.mesh_order import MeshOrder

RATIO = 3.0  # element size over that of the next finer mesh
_FEWEST_DOFS = 8_000  # of a joint that is worth a coarse start
_COARSEST = 0.2  # element size over R
_STEEPEST = 1.0  # growth of the element size
_TOLERANCE = 1e-6  # residual over reaction: what is found is a guess
_FEWEST_POINTS = 30  # in contact: of a contact of few coarse elements nothing can be learnt


def coarse_start(joint: Joint) -> CoarseStart | None:
    """The coarse start of ``joint``; None where that is coarse enough itself, or goes without. Collective."""
    if joint.n_dofs < _FEWEST_DOFS or not joint.scene.analysis.coarse_start:
        return None
    with joint.timer("coarse start"):
        try:
            coarse = Joint(_coarser(joint.scene), joint.comm)
        except ProjectionError:  # on all ranks: too coarse for the contact to be found
            return None
        return CoarseStart(joint, coarse) if 2 * coarse.n_dofs < joint.n_dofs else None


def _coarser(scene: Scene) -> Scene:
    """``scene`` on a mesh with elements `RATIO` times as large, all over."""
    g = scene.joint
    sizes = {
        "element_size": max(g.h, min(RATIO * g.h, _COARSEST * g.radius)),
        "relative_element_size": None,
        "growth": max(g.growth, min(RATIO * g.growth, _STEEPEST)),
    }
    analysis = {"tolerance": max(scene.analysis.tolerance, _TOLERANCE)}
    return scene.model_copy(
        update={"joint": g.model_copy(update=sizes), "analysis": scene.analysis.model_copy(update=analysis)}
    )


class CoarseStart:
    """Increments of the state of ``joint`` from those of ``coarse``, the same joint on a coarser mesh. Collective."""

    def __init__(self, joint: Joint, coarse: Joint) -> None:
        self.joint, self.coarse = joint, coarse
        coarse.equilibrium.interrupt = joint.equilibrium.interrupt
        self.walk: Walk = coarse.walk(coarse=coarse_start(coarse))
        self.iterations = 0  # of the last attempt, on all coarser meshes
        self._order = MeshOrder(coarse)
        self._maps = _interpolations(joint, self._order)
        self._reached: float | None = None

    def increment(self, load: float) -> Array | None:
        """What a step to ``load`` adds to the state of the fine joint, ``(2 n_local + 1,)``; None if the coarse mesh
        does not tell."""
        with self.joint.timer("coarse start"):
            result = self.walk.attempt(load)
            self.iterations = result.iterations + self.walk.coarse_iterations
            self._reached = load if result.converged else None
            if not result.converged or self.coarse.contact.n_active() < _FEWEST_POINTS:
                return None
            step = self.coarse.equilibrium.state() - self.walk.state
            on_nodes = self.coarse.comm.bcast(self._order.collect(step[:-1].reshape(-1, 2)))
            u = np.zeros((self.joint.equilibrium.n_local, 2))
            for nodes, interpolate in self._maps:
                u[nodes] = interpolate(on_nodes)
            return np.append(u, step[-1])

    def commit(self) -> bool:
        """Follow the fine joint, which has accepted the last step; returns whether the coarse one could."""
        if self._reached is None:
            return False
        with self.joint.timer("coarse start"):
            self.walk.accept(self._reached)
            self.walk.commit()
        return True

    def take_back(self) -> None:
        """Undo the last attempt."""
        self.walk.take_back()


def _interpolations(joint: Joint, order: MeshOrder) -> list[tuple[np.ndarray, Interpolation]]:
    """Per body the nodes of ``joint`` on this rank, and how they get the values that ``order`` collects."""
    x, cells, body = joint.comm.bcast((order.coordinates, order.nodes_of_cell, order.bodies()))
    places, degree = joint.V.tabulate_dof_coordinates()[:, :2], joint.scene.analysis.degree
    maps = []
    for tag in np.unique(body):
        nodes = np.unique(joint.V.dofmap.list[joint.model.cells.find(tag)])
        maps.append((nodes, Interpolation(x[:, :2], cells[body == tag], degree, places[nodes])))
    return maps

"""What is told of an equilibrium, or of a solve that found none."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.solver.equilibrium.evaluation import Evaluation


class Diagnostics:
    """Reactions and residuals of the last ``evaluation``."""

    def __init__(self, evaluation: Evaluation) -> None:
        self.evaluation = evaluation
        self.unknowns = evaluation.unknowns

    def reaction(self, name: str) -> Array:
        """Forces ``(n_owned, d)`` of the supports and means ``name`` on the nodes."""
        drives = self.unknowns.drives
        means = [mean.drive for mean in self.evaluation.problem.means if mean.name == name]
        at = [drives.names.index(drive) for drive in means]
        of_means = np.tensordot(self.unknowns.levels[at], drives.applied[at], 1)
        return drives.share_of(name) * self.evaluation.reaction + of_means

    def residual_on(self, nodes: np.ndarray) -> Array:
        """Sum ``(d,)`` of the residual over the owned ones of these ``nodes`` of all ranks."""
        owned = nodes[nodes < self.unknowns.n_owned]
        here = self.evaluation.free_forces()[owned].sum(axis=0)
        return self.unknowns.comm.allreduce(here)

    def worst_place(self) -> tuple[float, ...] | None:
        """Where the residual is largest, over all ranks."""
        sizes = np.linalg.norm(self.evaluation.free_forces(), axis=1)
        sizes = np.nan_to_num(sizes, nan=-1.0, posinf=-1.0)
        d = self.unknowns.dimension
        places = self.unknowns.V.tabulate_dof_coordinates()[:, :d]
        here: tuple[float, tuple[float, ...]] = -1.0, (0.0,) * d
        if len(sizes):
            at = int(sizes.argmax())
            here = sizes[at], tuple(places[at])
        largest, place = max(self.unknowns.comm.allgather(here))
        return place if largest >= 0 else None

    def plastic_increment(self) -> float:
        """How far PEEQ has grown in the step at most, over all ranks."""
        grown = 0.0
        for points in self.evaluation.plastic_points():
            increments = points.peeq - points.material.peeq(points.given())
            grown = max(grown, float(increments.max(initial=0.0)))
        return self.unknowns.comm.allreduce(grown, op=MPI.MAX)

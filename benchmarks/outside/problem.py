"""A problem that others have set, what they published of it, and a study of meshes."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.benchmarks.axisymmetric.case import solved
from archord.postprocess.run import Run
from archord.report.files import Row
from archord.solver.problem import Problem

Values = dict[str, float]


@dataclass(frozen=True)
class Published:
    """A ``value`` of the ``quantity``, and ``by`` whom it is."""

    quantity: str
    value: float
    by: str


@dataclass(frozen=True)
class Outside:
    """A problem that others have set.

    Attributes
    ----------
    name : str
        What tables call it.
    source : str
        Where it is defined.
    problem : callable
        The problem on a mesh that is so many times finer than the first one.
    read : callable
        The quantities of a run by name.
    published : sequence of Published
        What others have published.
    verdict : str
        What the comparison says, in words.
    finer : sequence of int
        The meshes of the study.
    """

    name: str
    source: str
    problem: Callable[[int], Problem]
    read: Callable[[Run], Values]
    published: Sequence[Published]
    verdict: str
    finer: Sequence[int] = (1, 2, 4)

    def study(self) -> list[Values]:
        """The quantities on every mesh, the coarsest first."""
        return [self._values(finer) for finer in self.finer]

    def _values(self, finer: int) -> Values:
        with tempfile.TemporaryDirectory() as folder:
            return self.read(solved(self.problem(finer), Path(folder)))

    def rows(self) -> list[Row]:
        """Solve the problem; a row for each published value."""
        *_, before, last = self.study()
        return [self._row(published, before, last) for published in self.published]

    def _row(self, published: Published, before: Values, last: Values) -> Row:
        ours = last[published.quantity]
        return {
            "problem": self.name,
            "quantity": published.quantity,
            "published": f"{published.value:.6g}",
            "by": published.by,
            "archord": f"{ours:.6g}",
            "last refinement": f"{ours / before[published.quantity] - 1:+.2%}",
            "difference": f"{ours / published.value - 1:+.2%}",
        }


def stage_ends(run: Run, column: str) -> list[float]:
    """The values of a ``column`` of the history at the end of each stage of the path."""
    history = run.history
    return history.loc[history["load_factor"] % 1 == 0, column].to_list()


def displacement_at(run: Run, body: str, place: tuple[float, float], axis: int) -> float:
    """The component of displacement at the node of the ``body`` that lies at the ``place``."""
    return float(run.fields().displacement[_node(run, body, place), axis])


def stress_at(run: Run, body: str, place: tuple[float, float], axis: int) -> float:
    """The recovered normal stress along an ``axis`` at the node of the ``body`` that lies at the
    ``place``."""
    return float(run.fields().nodal["stress"][_node(run, body, place), axis])


def _node(run: Run, body: str, place: tuple[float, float]) -> int:
    """The number of the node of the ``body`` that is nearest to the ``place``."""
    fields = run.fields()
    nodes = np.unique(fields.cells[fields.body == fields.bodies[body]])
    distance = np.linalg.norm(fields.coordinates[nodes] - place, axis=1)
    return int(nodes[distance.argmin()])


def largest_pressure(run: Run, side: str) -> float:
    """The largest contact pressure on a ``side``."""
    return float(run.pressure(side=side)["pressure"].max())

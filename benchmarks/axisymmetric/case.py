"""An axisymmetric problem with what it is compared with.

Coordinates are x = r and y = z; the axis is x = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.output.folder import MESH
from archord.output.run import solve_scene
from archord.postprocess.run import Run
from archord.presets.words import words_of
from archord.solver.problem import Body, Problem

E = 1.0
NU = 0.3
SIGY = 1e-3
STEEL = 210e3  # MPa


class Compared(NamedTuple):
    """A number of archord beside its ``reference``, and who gives that."""

    what: str
    reference: float
    by: str
    ours: float


@dataclass(frozen=True)
class Case:
    """A problem, and what its last step is compared with."""

    name: str
    problem: Callable[[], Problem]
    compare: Callable[[Run], Iterator[Compared]]


class Place(NamedTuple):
    """A component of displacement at a place ``at``; CalculiX gives the ``reference``."""

    what: str
    at: tuple[float, float]
    axis: int
    reference: float

    def read(self, coordinates: Array, displacement: Array) -> float:
        """The component at the nearest node, by the nodes' ``coordinates`` and ``displacement``,
        both ``(n, 2)``."""
        nearest = np.linalg.norm(coordinates - self.at, axis=1).argmin()
        return float(displacement[nearest, self.axis])


@dataclass(frozen=True)
class Study:
    """A problem that archord and CalculiX solve on the same meshes.

    Attributes
    ----------
    name : str
        What tables call it.
    problem : callable
        The problem on the mesh that is so many times finer.
    places : tuple of Place
        What is compared, with the values of CalculiX on its finest mesh.
    """

    name: str
    problem: Callable[[int], Problem]
    places: tuple[Place, ...]

    def case(self) -> Case:
        """The problem on its first mesh against the references."""
        return Case(self.name, lambda: self.problem(1), self._compare)

    def _compare(self, run: Run) -> Iterator[Compared]:
        fields = run.fields()
        for place in self.places:
            ours = place.read(fields.coordinates, fields.displacement)
            yield Compared(place.what, place.reference, "CalculiX", ours)


def elastic() -> Elastic:
    """The elastic material of closed forms."""
    return Elastic(E, NU)


def perfectly_plastic(yield_stress: float = SIGY) -> J2Material:
    """The material that yields without hardening."""
    return J2Material(E, NU, hardening=LinearHardening(yield_stress))


def one_body(mesh: TaggedMesh, material: Any, **parts: Any) -> Problem:
    """A problem of the body "body"."""
    return Problem(mesh, [Body("body", material)], kinematics="axisymmetric", **parts)


def solved(problem: Problem, folder: Path) -> Run:
    """The run of a ``problem`` in an empty ``folder``."""
    solve_scene(words_of(problem, str(folder / MESH)), folder, problem=problem)
    return Run(folder)

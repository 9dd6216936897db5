"""A ring of finite length on a longer solid shaft: mm, MPa. The half above the middle is meshed."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from mpi4py import MPI

from archord.benchmarks.axisymmetric.case import NU, STEEL, Place, Study
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.elasticity import Elastic
from archord.solver.problem import Body, Interaction, Load, Problem, Support

SHAFT_LENGTH = 1.5
RING_LENGTH = 0.5
FIT = 0.001  # the interference in radius


def fit_mesh(n: int) -> TaggedMesh:
    """Rectangles in quadrilaterals: ``n`` across each body and along the ring, finer toward the
    edge of the contact."""

    def draw(gmsh: Any) -> None:
        ratio = 1.25 ** (8 / n)
        shaft = _Column(gmsh, n, 1 / ratio)
        shaft.draw((0.0, 1.0), (0.0, RING_LENGTH, SHAFT_LENGTH), (1 / ratio, 1.1 ** (10 / n)))
        ring = _Column(gmsh, n, ratio)
        ring.draw((1.0, 2.0), (0.0, RING_LENGTH), (1 / ratio,))
        gmsh.model.geo.synchronize()
        shaft.name("shaft")
        ring.name("ring")

    return gmsh_to_mesh(MPI.COMM_SELF, draw, quads=True)


class _Column:
    """Rectangles on top of each other, with ``n`` elements along each side, which grow from left to
    right by the factor ``across``.

    Attributes
    ----------
    faces : list of int
        The rectangles, from below.
    sides : dict of list of int
        Their lines "middle" (the lowest), "inside" and "outside".
    """

    def __init__(self, gmsh: Any, n: int, across: float) -> None:
        self._model = gmsh.model
        self._n = n
        self._across = across
        self.faces: list[int] = []
        self.sides: dict[str, list[int]] = {}

    def draw(self, x: tuple[float, float], y: tuple[float, ...], growth: tuple[float, ...]) -> None:
        """Draw the rectangles between the radii ``x`` and the heights ``y``; their elements grow
        upward by the factors ``growth``."""
        geo = self._model.geo
        left = [geo.addPoint(x[0], height, 0.0) for height in y]
        right = [geo.addPoint(x[1], height, 0.0) for height in y]
        levels = [self._line(a, b, self._across) for a, b in zip(left, right, strict=True)]
        inside = [self._line(*ends, by) for ends, by in zip(pairwise(left), growth, strict=True)]
        outside = [self._line(*ends, by) for ends, by in zip(pairwise(right), growth, strict=True)]
        for below, end, above, start in zip(levels, outside, levels[1:], inside, strict=False):
            loop = geo.addCurveLoop([below, end, -above, -start])
            face = geo.addPlaneSurface([loop])
            geo.mesh.setTransfiniteSurface(face)
            geo.mesh.setRecombine(2, face)
            self.faces.append(face)
        self.sides = {"middle": levels[:1], "inside": inside, "outside": outside}

    def _line(self, start: int, end: int, growth: float) -> int:
        line = self._model.geo.addLine(start, end)
        self._model.geo.mesh.setTransfiniteCurve(line, self._n + 1, "Progression", growth)
        return line

    def name(self, body: str) -> None:
        """Name the faces and the sides after the ``body``."""
        self._model.addPhysicalGroup(2, self.faces, name=body)
        for side, lines in self.sides.items():
            self._model.addPhysicalGroup(1, lines, name=f"{body} {side}")


def fit_problem(finer: int = 1) -> Problem:
    """The ring pressed on the shaft, on a mesh so many times ``finer``."""
    steel = Elastic(STEEL, NU)
    surfaces = ("shaft outside", "ring inside")
    supports = [
        Support("axis", on="shaft inside", fixed="x"),
        Support("shaft middle", fixed="y"),
        Support("ring middle", fixed="y"),
    ]
    return Problem(
        fit_mesh(10 * finer),
        [Body("shaft", steel), Body("ring", steel)],
        [Interaction("fit", surfaces, interference=FIT)],
        supports,
        [Load("nothing", on="ring outside", pressure=0.0)],
        steps=1,
        kinematics="axisymmetric",
    )


STUDY = Study(
    "ring pressed on a shaft",
    fit_problem,
    (
        Place("u_r outside, middle", (2.0, 0.0), 0, 5.23779e-4),
        Place("u_r outside, end", (2.0, RING_LENGTH), 0, 5.24611e-4),
        Place("u_z of the shaft's end", (0.0, SHAFT_LENGTH), 1, 1.53354e-4),
    ),
)

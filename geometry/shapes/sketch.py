"""A joint in a plane as gmsh is to draw it: points, lines, arcs, faces, and the sets of lines.

Lengths are in radii of the pin, to the last bit the same in all units of the scene (`in_radii`): a
last bit may decide which triangles gmsh makes, which changed forces of a lug by 1e-6. Shapes in
space have no such bits (`solids.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np

from archord.geometry.meshes.refine import Circle
from archord.report.by_name import Words

Place = tuple[float, float]
_RADII = np.arange(1000, 500, -1) / 100  # tried for the pin
_MOST_PLACES = 12  # of decimals that lengths are then
_ROUND_OFF = 4e-15  # of lengths
PinPart = Literal["half", "whole", "none"]


class Bore(NamedTuple):
    """A hole that the pin lies in: its set, the element size on it and its growth away from it."""

    facets: str
    size: float
    growth: float


class Sketch:
    """A joint as gmsh is to draw it: every body has each point, line and arc once.

    ``faces`` are the faces of every body, ``lines`` the lines of every set; sets have the numbers
    1, 2, ... in the order of their names, and may be empty. Shapes add the element ``sizes`` of
    bodies (expressions in x and y), how many equal edges a line has at least (``parts``), the
    corners of faces that are cut into a ``grid``, and the ``bores``.
    """

    def __init__(self, bodies: Sequence[str], sets: Sequence[str]) -> None:
        self.points: dict[tuple[str, Place], int] = {}
        self.curves: list[list[int]] = []  # start, end, and the centre of an arc
        self.loops: list[list[int]] = []
        self._curve: dict[tuple[str, Place, Place], int] = {}
        self.faces: dict[str, list[int]] = {name: [] for name in bodies}
        self.lines: dict[str, list[int]] = {name: [] for name in sets}
        self.circles: dict[str, Circle] = {}
        self.sizes: Words = {}
        self.parts: dict[int, float] = {}
        self.grid: dict[int, list[int]] = {}
        self.bores: list[Bore] = []

    def point(self, body: str, place: Place) -> int:
        """The point of ``body`` at (x, y)."""
        return self.points.setdefault((body, place), len(self.points) + 1)

    def path(self, body: str, *places: Place, on: Circle | None = None) -> list[int]:
        """The lines of ``body`` from each place to the next, or arcs ``on`` the circle of a set."""
        if on:
            self.circles[on.facets] = on
        centre = [on.centre] if on else []
        numbers = []
        for a, b in pairwise(places):
            if (body, a, b) not in self._curve:
                points = [self.point(body, place) for place in (a, b, *centre)]
                self.curves.append(points)
                self._curve[body, a, b] = len(self.curves)
                self._curve[body, b, a] = len(self.curves)
            numbers.append(self._curve[body, a, b])
        return numbers

    def face(self, body: str, **paths: list[int]) -> int:
        """A face of ``body`` within ``paths`` that together are closed, in whatever direction each
        line goes; the lines go to the sets of these names, where there are such."""
        self.loops.append([line for path in paths.values() for line in path])
        face = len(self.loops)
        self.faces[body].append(face)
        for name in paths.keys() & self.lines:
            of_set = self.lines[name]
            of_set += [line for line in paths[name] if line not in of_set]
        return face

    def draw_lines(self, kernel: Any) -> None:
        """Draw all points and curves by gmsh's ``kernel``, with the numbers that they have here."""
        for _, place in self.points:
            kernel.addPoint(*place, 0)
        for start, stop, *centre in self.curves:
            (kernel.addCircleArc if centre else kernel.addLine)(start, *centre, stop)

    def around_face(self, face: int) -> list[int]:
        """The lines around a ``face`` as they follow each other."""
        left = {line: self.curves[line - 1][:2] for line in self.loops[face - 1]}
        line, (_, end) = left.popitem()
        ordered = [line]
        while left:
            line = next(other for other, ends in left.items() if end in ends)
            start, stop = left.pop(line)
            end = stop if end == start else start
            ordered.append(line)
        return ordered

    def pin(self, x: float, up: int, part: PinPart, before: str = "", bore: float = 0.0) -> None:
        """The quarters, above or below the axis, of a pin of radius 1 about (x, 0), which may have
        a ``bore`` of a radius; the names of its body and its sets have ``before`` in front."""
        pin = f"{before}pin"
        outside = Circle(pin, (x, 0.0), 1.0)
        inside = Circle(f"{pin} inside", (x, 0.0), bore)
        top = (x, up)
        top_of_bore = (x, up * bore)
        for to in {"half": (1,), "whole": (1, -1), "none": ()}[part]:
            side = (x + to, 0)
            side_of_bore = (x + to * bore, 0)
            arc = self.path(pin, side, top, on=outside)
            flat = self.path(pin, top, top_of_bore)
            axis = self.path(pin, side_of_bore, side)
            paths = {pin: arc, f"{before}flat": flat, "axis": axis}
            if bore:
                paths[inside.facets] = self.path(pin, top_of_bore, side_of_bore, on=inside)
            self.face(pin, **paths)


def in_radii(radius: float, *lengths: float) -> list[float]:
    """The ``lengths`` over the ``radius``, to the last bit the same in all units of length.

    Quotients depend on units by round-off. So they are taken of decimals as in a drawing: with the
    radius, of 10.00, 9.99, ..., with which it and they have the fewest decimal places.
    """
    in_drawing = np.outer(_RADII, np.array([radius, *lengths]) / radius)
    for places in range(_MOST_PLACES + 1):
        decimals = in_drawing.round(places)
        off = np.abs(in_drawing - decimals).max(axis=1)
        are_decimals = off <= _ROUND_OFF * in_drawing.max()
        if are_decimals.any():
            break
    r, *drawn = decimals[are_decimals.argmax()].tolist()
    return [length / r for length in drawn]


def around(x: float) -> str:
    """The distance from (x, 0), for sizes."""
    return f"Sqrt((x - ({x!r}))^2 + y^2)"  # gmsh knows no "- -1"

"""Meshes of Abaqus and CalculiX: nodes, plane elements, sets and surfaces of an .inp file; all else of it is skipped.

meshio's reader of such files knows neither surfaces nor plane elements of second order, and forgets all but the last
block of nodes. Lines (trusses) only name edges, as gmsh writes them.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from dolfinx.cpp.io import perm_gmsh

from archord.geometry.meshes.beside import beside
from archord.geometry.meshes.plane_mesh import PlaneMesh, in_basix_order, one_kind, outer_sides

Options = dict[str, str]
Rows = list[list[str]]

_KINDS = re.compile(r"(CP[ES][3468]|T[23]D[23])[A-Z]*")  # with the number of nodes
_UNREAD = {"PART", "INSTANCE", "SYSTEM", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"}  # they move or make nodes
_DEEPEST = 5  # files included in each other


def _lines(path: Path, mesh: Path, depth: int = 0) -> Iterator[str]:
    """The lines of a file, those of keywords whole, and those of the files that it includes, which lie in the folder of
    the ``mesh``."""
    if depth > _DEEPEST:
        raise ValueError(f"{path.name} includes itself")
    text = path.read_text(encoding="utf-8", errors="replace")
    for line in map(str.strip, re.sub(r",[ \t]*\n(?=[^*\n]*=)", ",", text).splitlines()):
        if line and not line.startswith("**"):
            if not line.upper().startswith("*INCLUDE"):
                yield line
            if file := re.match(r"\*.*,\s*INPUT\s*=([^,]*)", line, re.IGNORECASE):
                yield from _lines(beside(mesh, file[1].strip(' "')), mesh, depth + 1)


def _blocks(path: Path) -> list[tuple[str, Options, Rows]]:
    """Keywords with their options, and the rows of data below them."""
    blocks: list[tuple[str, Options, Rows]] = [("", {}, [])]
    for line in _lines(path, path):
        first, *others = (part.strip(' "') for part in line.strip(", ").split(","))
        if line.startswith("*"):
            options = {key.strip().upper(): value.strip(' "') for key, _, value in (o.partition("=") for o in others)}
            blocks.append((first[1:].upper(), options, []))
        else:
            blocks[-1][2].append([first, *others])
    return blocks


class _Model:
    """By their numbers, the places of nodes and the nodes of plane elements (``cells``) and of ``lines``; the numbers
    of sets by kind and name, as it is first written; surfaces as elements and a face."""

    def __init__(self, path: Path) -> None:
        self.nodes: dict[int, list[float]] = {}
        self.cells: dict[int, list[int]] = {}
        self.lines: dict[int, list[int]] = {}
        self.sets: dict[str, dict[str, list[int]]] = {"NSET": {}, "ELSET": {}}
        self.surfaces: dict[str, list[tuple[list[int], str]]] = defaultdict(list)
        self._names: dict[str, str] = {}
        take = {"NODE": self._node, "ELEMENT": self._element, "SURFACE": self._surface}
        for keyword, options, rows in _blocks(path):
            if keyword in _UNREAD or options.get("SYSTEM", "R").upper() != "R":
                raise ValueError(
                    f"*{keyword} is not read as it stands; write all nodes and elements out, in rectangular "
                    "coordinates and without parts and instances (noPartsInputFile=ON)"
                )
            if keyword in take:
                take[keyword](options, rows)
            elif keyword in self.sets:
                self._set(keyword, options, rows)

    def _node(self, options: Options, rows: Rows) -> None:
        numbers = [int(row[0]) for row in rows]
        for number, (_, *place) in zip(numbers, rows, strict=True):
            if number in self.nodes:
                raise ValueError(f"the node {number} is there twice")
            self.nodes[number] = [float(value) for value in (*place, "0", "0")[:3]]
        self._add("NSET", options.get("NSET"), numbers)

    def _element(self, options: Options, rows: Rows) -> None:
        kind, values = options.get("TYPE", "").upper(), [int(value) for row in rows for value in row if value]
        if not _KINDS.fullmatch(kind):
            raise ValueError(f"elements of type {kind} are not read, only CPS and CPE of 3, 4, 6 or 8 nodes")
        size = 1 + int(kind[3])
        if len(values) % size:
            raise ValueError(f"elements of type {kind} have {len(values)} numbers, no multiple of {size}")
        for start in range(0, len(values), size):
            number, *nodes = values[start : start + size]
            if number in self.cells or number in self.lines:
                raise ValueError(f"the element {number} is there twice")
            (self.lines if kind.startswith("T") else self.cells)[number] = nodes
        self._add("ELSET", options.get("ELSET"), values[::size])

    def _set(self, kind: str, options: Options, rows: Rows) -> None:
        if "GENERATE" in options:
            there = self.nodes.keys() if kind == "NSET" else self.cells.keys() | self.lines
            ranges = [(*map(int, row), 1)[:3] for row in rows]
            chosen = [n for a, b, step in ranges for n in there if a <= n <= b and (n - a) % step == 0]
        else:
            chosen = self._chosen(kind, chain(*rows))
        self._add(kind, options.get(kind), chosen)

    def _surface(self, options: Options, rows: Rows) -> None:
        name = options.get("NAME", "")
        if options.get("TYPE", "").upper() == "NODE":
            self._add("NSET", name, self._chosen("NSET", chain(*rows)))
        else:
            self.surfaces[name] += [(self._chosen("ELSET", [item]), "".join(face).upper()) for item, *face in rows]

    def _add(self, kind: str, name: str | None, numbers: list[int]) -> None:
        if name:
            self.sets[kind].setdefault(self._names.setdefault(name.upper(), name), []).extend(numbers)

    def _chosen(self, kind: str, items: Iterable[str]) -> list[int]:
        """The numbers among ``items``, and those in the sets named there."""
        chosen = []
        for item in filter(None, items):
            name = self._names.get(item.upper(), item)
            if not item.isdecimal() and name not in self.sets[kind]:
                raise ValueError(f"there is no *{kind} {name!r}")
            chosen += [int(item)] if item.isdecimal() else self.sets[kind][name]
        return chosen


def read_abaqus(path: Path) -> PlaneMesh:
    """The mesh of an .inp file: its element sets, and as facet sets its surfaces, its sets of lines and what its node
    sets have of the boundary; other nodes of these are point sets. Raises ValueError."""
    model = _Model(path)
    kind = one_kind(set(map(len, model.cells.values())))
    node, cell = ({number: k for k, number in enumerate(there)} for there in (model.nodes, model.cells))
    corners = _places(node, chain(*model.cells.values()), "node").reshape(-1, kind)
    cell_sets, facet_sets, point_sets = {}, defaultdict[str, list[np.ndarray]](list), {}
    for name, numbers in model.sets["ELSET"].items():
        ends = [model.lines[number][:: len(model.lines[number]) - 1] for number in numbers if number in model.lines]
        members = sorted(set(numbers) - model.lines.keys())
        if members or not ends:
            cell_sets[name] = _places(cell, members, f"element of the set {name!r}")
        if ends:
            facet_sets[name].append(_places(node, chain(*ends), "node").reshape(-1, 2))
    sides = 3 if kind in (3, 6) else 4
    faces = {f"S{k}": [k - 1, k % sides] for k in range(1, sides + 1)}
    for name, parts in model.surfaces.items():
        for elements, face in parts:
            if face not in faces:
                raise ValueError(f"the surface {name!r} has the face {face!r}, which is none of S1 to S{sides}")
            places = _places(cell, elements, f"element of the surface {name!r}")
            facet_sets[name].append(corners[places][:, faces[face]])
    x, cells = in_basix_order(np.array(list(model.nodes.values())), corners, perm_gmsh)
    boundary, _ = outer_sides(cells)
    for name, numbers in model.sets["NSET"].items():
        if name not in facet_sets:
            nodes = _places(node, sorted(set(numbers)), f"node of the set {name!r}")
            edges = boundary[np.isin(boundary, nodes).all(axis=1)]
            if len(edges):
                facet_sets[name].append(edges[:, :2])
            if len(rest := np.setdiff1d(nodes, edges)):
                point_sets[name] = rest
    return PlaneMesh.of_sets(
        x, cells, cell_sets, {name: np.concatenate(ends) for name, ends in facet_sets.items()}, point_sets
    )


def _places(known: dict[int, int], wanted: Iterable[int], what: str) -> np.ndarray:
    """Where the numbers ``wanted`` are ``known`` to be. Raises ValueError."""
    try:
        return np.array([known[number] for number in wanted], dtype=np.int64)
    except KeyError as lost:
        raise ValueError(f"there is no {what} with the number {lost}") from None

"""Meshes of Abaqus and CalculiX: nodes, plane elements, sets and surfaces of an .inp file; all else of it is skipped.

meshio's reader of such files knows neither surfaces nor plane elements of second order, and forgets all but the last
block of nodes. Lines (trusses) only name edges, as gmsh writes them.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from dolfinx.cpp.io import perm_gmsh

from archord.geometry.meshes.plane_mesh import PlaneMesh, in_basix_order, one_kind, outer_sides

_KINDS = re.compile(r"(CP[ES][3468]|T[23]D[23])[A-Z]*")  # with the number of nodes
_UNREAD = {"PART", "INSTANCE", "SYSTEM", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"}  # they move or make nodes
_DEEPEST = 5  # files included in each other


class _Block(NamedTuple):
    keyword: str
    options: dict[str, str]
    rows: list[list[str]]

    def values(self) -> list[str]:
        return [value.upper() for row in self.rows for value in row if value]


def _lines(path: Path, depth: int = 0) -> Iterator[str]:
    """The lines of a file, those of keywords whole, and those of the files that it includes."""
    if depth > _DEEPEST:
        raise ValueError(f"{path.name} includes itself")
    text = path.read_text(encoding="utf-8", errors="replace")
    for line in map(str.strip, re.sub(r",[ \t]*\n(?=[^*\n]*=)", ",", text).splitlines()):
        if line and not line.startswith("**"):
            if not line.upper().startswith("*INCLUDE"):
                yield line
            if file := re.match(r"\*.*,\s*INPUT\s*=([^,]*)", line, re.IGNORECASE):
                yield from _lines(path.parent / file[1].strip(' "'), depth + 1)


def _blocks(path: Path) -> list[_Block]:
    blocks = [_Block("", {}, [])]
    for line in _lines(path):
        first, *others = (part.strip(' "') for part in line.strip(", ").split(","))
        if line.startswith("*"):
            options = {key.strip().upper(): value.strip(' "') for key, _, value in (o.partition("=") for o in others)}
            blocks.append(_Block(first[1:].upper(), options, []))
        else:
            blocks[-1].rows.append([first, *others])
    return blocks


class _Model:
    """Nodes, plane elements by their number of nodes, lines by their ends, sets by kind and name in capitals, and
    surfaces as elements and a face."""

    def __init__(self, path: Path) -> None:
        self.nodes: np.ndarray = np.zeros(0, dtype=np.int64)
        self.x: np.ndarray = np.zeros((0, 3))
        self.elements: dict[int, np.ndarray] = {}
        self.lines: np.ndarray = np.zeros((0, 3), dtype=np.int64)
        self.sets: dict[str, dict[str, np.ndarray]] = {"NSET": {}, "ELSET": {}}
        self.surfaces: dict[str, list[tuple[np.ndarray, str]]] = defaultdict(list)
        self.spelling: dict[str, str] = {}
        take = {"NODE": self._node, "ELEMENT": self._element, "SURFACE": self._surface}
        take |= dict.fromkeys(self.sets, self._set)
        for block in _blocks(path):
            if block.keyword in _UNREAD or block.options.get("SYSTEM", "R").upper() != "R":
                raise ValueError(
                    f"*{block.keyword} is not read as it stands; write all nodes and elements out, in rectangular "
                    "coordinates and without parts and instances (noPartsInputFile=ON)"
                )
            if block.keyword in take:
                take[block.keyword](block)

    def _node(self, block: _Block) -> None:
        rows = np.array([[*row, "0", "0"][:4] for row in block.rows], dtype=float).reshape(-1, 4)
        self.nodes = np.append(self.nodes, rows[:, 0].astype(np.int64))
        self.x = np.concatenate([self.x, rows[:, 1:]])
        self._add("NSET", block.options.get("NSET"), rows[:, 0])

    def _element(self, block: _Block) -> None:
        kind, values = block.options.get("TYPE", "").upper(), block.values()
        if not _KINDS.fullmatch(kind):
            raise ValueError(f"elements of type {kind} are not read, only CPS and CPE of 3, 4, 6 or 8 nodes")
        n = int(kind[3])
        if len(values) % (1 + n):
            raise ValueError(f"elements of type {kind} have {len(values)} numbers, no multiple of {1 + n}")
        rows = np.array(values, dtype=np.int64).reshape(-1, 1 + n)
        if kind.startswith("T"):
            self.lines = np.concatenate([self.lines, rows[:, [0, 1, -1]]])
        else:
            self.elements[n] = np.concatenate([self.elements.get(n, rows[:0]), rows])
        self._add("ELSET", block.options.get("ELSET"), rows[:, 0])

    def _set(self, block: _Block) -> None:
        kind, options = block.keyword, block.options
        if "GENERATE" in options:
            elements = [rows[:, 0] for rows in (self.lines, *self.elements.values())]
            there = self.nodes if kind == "NSET" else np.concatenate(elements)
            ranges = [(*map(int, row), 1)[:3] for row in block.rows]
            chosen = [there[(there >= a) & (there <= b) & ((there - a) % step == 0)] for a, b, step in ranges]
        elif kind == "NSET" and "ELSET" in options:
            named = self._chosen("ELSET", [options["ELSET"].upper()])
            chosen = [np.unique(rows[np.isin(rows[:, 0], named), 1:]) for rows in self.elements.values()]
        else:
            chosen = [self._chosen(kind, block.values())]
        self._add(kind, options.get(kind), np.concatenate(chosen))

    def _surface(self, block: _Block) -> None:
        name = block.options.get("NAME", "")
        if block.options.get("TYPE", "").upper() == "NODE":
            self._add("NSET", name, self._chosen("NSET", block.values()))
        else:
            for item, *face in block.rows:
                self.surfaces[name].append((self._chosen("ELSET", [item.upper()]), "".join(face).upper()))

    def _add(self, kind: str, name: str | None, numbers: np.ndarray) -> None:
        if name:
            known, name = self.sets[kind], self.spelling.setdefault(name.upper(), name)
            known[name.upper()] = np.append(known.get(name.upper(), numbers[:0]), numbers).astype(np.int64)

    def _chosen(self, kind: str, items: list[str]) -> np.ndarray:
        """The numbers among ``items``, and those in the sets named there."""
        names = sorted({item for item in items if not item.isdecimal()})
        if lost := [name for name in names if name not in self.sets[kind]]:
            raise ValueError(f"there is no *{kind} {lost[0]!r}")
        numbers = np.array([item for item in items if item.isdecimal()], dtype=np.int64)
        return np.concatenate([numbers, *(self.sets[kind][name] for name in names)])


def read_abaqus(path: Path) -> PlaneMesh:
    """The mesh of an .inp file: its element sets, and as facet sets its surfaces, its sets of lines and what its node
    sets have of the boundary; other nodes of these are point sets. Raises ValueError."""
    model = _Model(path)
    rows, lines = model.elements[one_kind(set(model.elements))], model.lines
    for what, there in (("node", model.nodes), ("element", np.append(rows[:, 0], lines[:, 0]))):
        number, count = np.unique(there, return_counts=True)
        if (count > 1).any():
            raise ValueError(f"the {what} {number[count > 1][0]} is there twice")
    corners = _places(model.nodes, rows[:, 1:], "node")
    cell_sets, facet_sets, point_sets = {}, defaultdict[str, list[np.ndarray]](list), {}
    for key, numbers in model.sets["ELSET"].items():
        name, named = model.spelling[key], np.isin(lines[:, 0], numbers)
        members = np.setdiff1d(numbers, lines[:, 0])
        if len(members) or not named.any():
            cell_sets[name] = _places(rows[:, 0], members, f"element of the set {name!r}")
        if named.any():
            facet_sets[name].append(_places(model.nodes, lines[named, 1:], "node"))
    sides = 3 if corners.shape[1] in (3, 6) else 4
    faces = {f"S{k}": [k - 1, k % sides] for k in range(1, sides + 1)}
    for name, parts in model.surfaces.items():
        for elements, face in parts:
            if face not in faces:
                raise ValueError(f"the surface {name!r} has the face {face!r}, which is none of S1 to S{sides}")
            places = _places(rows[:, 0], elements, f"element of the surface {name!r}")
            facet_sets[name].append(corners[places][:, faces[face]])
    x, cells = in_basix_order(model.x, corners, perm_gmsh)
    boundary, _ = outer_sides(cells)
    for key, numbers in model.sets["NSET"].items():
        if (name := model.spelling[key]) not in facet_sets:
            nodes = _places(model.nodes, np.unique(numbers), f"node of the set {name!r}")
            edges = boundary[np.isin(boundary, nodes).all(axis=1)]
            if len(edges):
                facet_sets[name].append(edges[:, :2])
            if len(rest := np.setdiff1d(nodes, edges)):
                point_sets[name] = rest
    return PlaneMesh.of_sets(
        x, cells, cell_sets, {name: np.concatenate(ends) for name, ends in facet_sets.items()}, point_sets
    )


def _places(numbers: np.ndarray, wanted: np.ndarray, what: str) -> np.ndarray:
    """Where the ``wanted`` are among the ``numbers``. Raises ValueError."""
    known = np.isin(wanted, numbers)
    if not known.all():
        raise ValueError(f"there is no {what} with the number {wanted[~known][0]}")
    order = np.argsort(numbers, kind="stable")
    return order[np.searchsorted(numbers, wanted, sorter=order)]

"""Meshes of Abaqus and CalculiX: nodes, plane elements, sets and surfaces of an .inp file; all else of it is skipped.

meshio's reader of such files knows neither surfaces nor plane elements of second order, and forgets all but the last
block of nodes. Lines (trusses and beams) only name edges, as gmsh writes them.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from dolfinx.cpp.io import perm_gmsh

from archord.geometry.basis import Array
from archord.geometry.meshes.plane_mesh import PlaneMesh, distinct_edges, in_basix_order, one_kind, sides_of

_PLANE, _LINE = re.compile(r"CP[ES]([3468])[A-Z]*"), re.compile(r"(T[23]D[23]|R2D2|B[23][12])[A-Z]*")
_DEEPEST = 5  # files included in each other


class _Block(NamedTuple):
    keyword: str
    options: dict[str, str]
    lines: list[str]

    def values(self) -> list[str]:
        return [value for line in self.lines for part in line.split(",") if (value := part.strip().upper())]


def _lines(path: Path, depth: int = 0) -> Iterator[str]:
    """The lines of a file and of those that it includes."""
    if depth > _DEEPEST:
        raise ValueError(f"{path.name} includes itself")
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.strip().upper().startswith("*INCLUDE"):
            yield from _lines(path.parent / line.partition("=")[2].strip(' "'), depth + 1)
        elif line.strip() and not line.startswith("**"):
            yield line.strip()


def _blocks(path: Path) -> Iterator[_Block]:
    lines = list(_lines(path))
    starts = [k for k, line in enumerate(lines) if line.startswith("*")]
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        keyword, *pairs = lines[start][1:].split(",")
        options = {key.strip().upper(): value.strip(' "') for key, _, value in (pair.partition("=") for pair in pairs)}
        yield _Block(keyword.strip().upper(), options, lines[start + 1 : end])


class _Model:
    """Nodes, elements by their number of nodes (of lines: negative), sets by kind and name in capitals, and surfaces as
    elements and a label."""

    def __init__(self, path: Path) -> None:
        self.nodes: np.ndarray = np.zeros(0, dtype=np.int64)
        self.x: Array = np.zeros((0, 3))
        self.elements: dict[int, np.ndarray] = {}
        self.sets: dict[tuple[str, str], np.ndarray] = {}
        self.surfaces: dict[str, list[tuple[np.ndarray, str]]] = defaultdict(list)
        self.spelling: dict[str, str] = {}
        for block in _blocks(path):
            take = getattr(self, f"_{block.keyword.lower()}", None)
            if take:
                take(block)

    def _part(self, block: _Block) -> None:
        raise ValueError("parts and instances are not read; write the file without them (noPartsInputFile=ON)")

    def _node(self, block: _Block) -> None:
        rows = np.array([[*line.strip(", ").split(","), "0", "0"][:4] for line in block.lines], dtype=float)
        self.nodes = np.append(self.nodes, rows[:, 0].astype(np.int64))
        self.x = np.concatenate([self.x, rows[:, 1:]])
        self._add("NSET", block.options.get("NSET"), rows[:, 0])

    def _element(self, block: _Block) -> None:
        kind = block.options.get("TYPE", "").upper()
        if plane := _PLANE.fullmatch(kind):
            n = int(plane[1])
        elif line := _LINE.fullmatch(kind):
            n = -3 if line[1] in ("T2D3", "T3D3", "B22", "B32") else -2
        else:
            raise ValueError(f"elements of type {kind} are not read, only CPS and CPE of 3, 4, 6 or 8 nodes")
        values = block.values()
        if len(values) % (1 + abs(n)):
            raise ValueError(f"elements of type {kind} have {len(values)} numbers, no multiple of {1 + abs(n)}")
        rows = np.array(values, dtype=np.int64).reshape(-1, 1 + abs(n))
        self.elements[n] = np.concatenate([self.elements.get(n, rows[:0]), rows])
        self._add("ELSET", block.options.get("ELSET"), rows[:, 0])

    def _nset(self, block: _Block) -> None:
        kind, options = block.keyword, block.options
        if "GENERATE" in options:
            there = self.nodes if kind == "NSET" else np.concatenate([rows[:, 0] for rows in self.elements.values()])
            ranges = [(*map(int, line.strip(" ,").split(",")), 1)[:3] for line in block.lines]
            chosen = [there[(there >= a) & (there <= b) & ((there - a) % step == 0)] for a, b, step in ranges]
        elif kind == "NSET" and "ELSET" in options:
            elements = self._chosen("ELSET", [options["ELSET"].upper()])
            chosen = [np.unique(r[np.isin(r[:, 0], elements), 1:]) for r in self.elements.values()]
        else:
            chosen = [self._chosen(kind, block.values())]
        self._add(kind, options.get(kind), np.concatenate(chosen))

    _elset = _nset

    def _surface(self, block: _Block) -> None:
        name, by_node = block.options.get("NAME", ""), block.options.get("TYPE", "").upper() == "NODE"
        if by_node:
            self._add("NSET", name, self._chosen("NSET", block.values()))
        else:
            for item, _, label in (line.upper().partition(",") for line in block.lines):
                self.surfaces[name].append((self._chosen("ELSET", [item.strip()]), label.strip(" ,")))

    def _add(self, kind: str, name: str | None, numbers: np.ndarray) -> None:
        if name:
            key = kind, name.upper()
            self.spelling.setdefault(key[1], name)
            self.sets[key] = np.append(self.sets.get(key, np.zeros(0, dtype=np.int64)), numbers.astype(np.int64))

    def _chosen(self, kind: str, items: list[str]) -> np.ndarray:
        """The numbers among ``items``, and those in the sets named there."""
        names = {item for item in items if not item.isdecimal()}
        if lost := [name for name in names if (kind, name) not in self.sets]:
            raise ValueError(f"there is no *{kind} {lost[0]!r}")
        numbers = np.array([item for item in items if item.isdecimal()], dtype=np.int64)
        return np.concatenate([numbers, *(self.sets[kind, name] for name in sorted(names))])


def read_abaqus(path: Path) -> PlaneMesh:
    """The mesh of an .inp file: its element sets, and as facet sets its surfaces, its sets of lines and what its node
    sets have of the boundary; other nodes of these are point sets. Raises ValueError."""
    model = _Model(path)
    rows = model.elements.get(one_kind({n for n in model.elements if n > 0}), np.zeros((0, 1), dtype=np.int64))
    corners = _places(model.nodes, rows[:, 1:], "node")
    lines = np.concatenate(
        [np.zeros((0, 3), dtype=np.int64), *(r[:, [0, 1, -1]] for n, r in model.elements.items() if n < 0)]
    )
    cell_sets, facet_sets, point_sets = {}, defaultdict[str, list[np.ndarray]](list), {}
    for (kind, key), numbers in model.sets.items():
        name, named = model.spelling[key], np.isin(lines[:, 0], numbers)
        if kind == "ELSET":
            members = np.setdiff1d(numbers, lines[:, 0])
            if len(members) or not named.any():
                cell_sets[name] = _places(rows[:, 0], members, f"element of the set {name!r}")
            if named.any():
                facet_sets[name].append(_places(model.nodes, lines[named, 1:], "node"))
    sides = 3 if corners.shape[1] in (3, 6) else 4
    for name, parts in model.surfaces.items():
        for elements, label in parts:
            if label not in [f"S{k}" for k in range(1, sides + 1)]:
                raise ValueError(f"the surface {name!r} has the face {label!r}, which is none of S1 to S{sides}")
            ends = [int(label[1]) - 1, int(label[1]) % sides]
            facet_sets[name].append(corners[_places(rows[:, 0], elements, f"element of the surface {name!r}")][:, ends])
    x, cells = in_basix_order(model.x, corners, perm_gmsh)
    every = sides_of(cells)
    first, which = distinct_edges(every[:, :2])
    boundary = every[first[np.bincount(which) == 1]]
    for (kind, key), numbers in model.sets.items():
        if kind == "NSET" and model.spelling[key] not in facet_sets:
            nodes = _places(model.nodes, np.unique(numbers), f"node of the set {model.spelling[key]!r}")
            edges = boundary[np.isin(boundary, nodes).all(axis=1)]
            if len(edges):
                facet_sets[model.spelling[key]].append(edges[:, :2])
            if len(rest := np.setdiff1d(nodes, edges)):
                point_sets[model.spelling[key]] = rest
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

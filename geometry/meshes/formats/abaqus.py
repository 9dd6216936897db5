"""Meshes of Abaqus and CalculiX: nodes, plane elements, sets and surfaces of an .inp file; all else
of it is skipped.

meshio's reader of such files knows neither surfaces nor plane elements of second order, and forgets
all but the last block of nodes. Lines (trusses) only name edges, as gmsh writes them; springs,
masses and the like name nothing.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import numpy as np
from dolfinx.cpp.io import perm_gmsh

from archord.geometry.meshes.formats.abaqus_blocks import (
    Options,
    Rows,
    Scope,
    number_of,
    scoped_blocks,
)
from archord.geometry.meshes.plane_mesh import PlaneMesh, in_basix_order, one_kind, outer_sides

_KINDS = re.compile(r"(CP[ES][3468]|T[23]D[23])[A-Z]*")  # with the number of nodes
_WITHOUT_AREA = re.compile(r"(SPRING|DASHPOT|MASS|ROTARYI|CONN|GAP|DCOUP|R2D2|RB2D2).*")
_OTHERS = {
    "C3D": "solid elements",
    "SC": "shell elements",
    "S": "shell elements",
    "M3D": "membrane elements",
    "CAX": "axisymmetric elements",
    "CGAX": "axisymmetric elements",
    "B": "beam elements",
    "COH": "cohesive elements",
}
_UNREAD = {"SYSTEM", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"}  # they move or make nodes


class _Model:
    """What a file has, by keys (`Scope.key`).

    The places of ``nodes``; the nodes of plane elements (``cells``) and of ``lines``; the elements
    ``without_area``; the keys of ``sets`` by kind and name, as it is first written; ``surfaces`` as
    elements and a face. Sets for the file's ``internal`` use have no name for others.
    """

    def __init__(self, path: Path) -> None:
        self.nodes: dict[int, list[float]] = {}
        self.cells: dict[int, list[int]] = {}
        self.lines: dict[int, list[int]] = {}
        self.without_area: set[int] = set()
        self.sets: dict[str, dict[str, list[int]]] = {"NSET": {}, "ELSET": {}}
        self.surfaces: dict[str, list[tuple[list[int], str]]] = defaultdict(list)
        self.internal: set[str] = set()
        self._names: dict[str, str] = {}
        self._owners: dict[tuple[str, str], int] = {}
        take = {"NODE": self._node, "ELEMENT": self._element, "SURFACE": self._surface}
        for scope, (keyword, options, rows) in scoped_blocks(path):
            if keyword in _UNREAD or options.get("SYSTEM", "R").upper() != "R":
                raise ValueError(
                    f"*{keyword} is not read as it stands; write all nodes and elements out, in rectangular coordinates"
                )
            if keyword in take:
                take[keyword](scope, options, rows)
            elif keyword in self.sets:
                self._set(scope, keyword, options, rows)

    def _node(self, scope: Scope, options: Options, rows: Rows) -> None:
        keys = [scope.key(row[0]) for row in rows]
        for key, (_, *place) in zip(keys, rows, strict=True):
            if key in self.nodes:
                raise ValueError(f"the node {number_of(key)} is there twice")
            try:
                x = [float(value) for value in (*place, "0", "0", "0")[:3]]
            except ValueError:
                said = f"has the coordinates {', '.join(place)}, which are no numbers"
                raise ValueError(f"the node {number_of(key)} {said}") from None
            self.nodes[key] = scope.placed(x)
        self._add(scope, "NSET", options.get("NSET"), keys)

    def _element(self, scope: Scope, options: Options, rows: Rows) -> None:
        kind = options.get("TYPE", "").upper()
        if _WITHOUT_AREA.fullmatch(kind):
            self.without_area.update(scope.key(row[0]) for row in rows)
            return
        if not _KINDS.fullmatch(kind):
            what = next(
                (said for start, said in _OTHERS.items() if kind.startswith(start)), "elements"
            )
            raise ValueError(
                f"{what} of type {kind} are not read, only plane ones: CPS and CPE of 3, 4, 6 or 8 nodes"
            )
        values = [scope.key(value) for row in rows for value in row if value]
        size = 1 + int(kind[3])
        if len(values) % size:
            raise ValueError(
                f"elements of type {kind} have {len(values)} numbers, no multiple of {size}"
            )
        found = self.lines if kind.startswith("T") else self.cells
        for start in range(0, len(values), size):
            key, *nodes = values[start : start + size]
            if key in self.cells or key in self.lines:
                raise ValueError(f"the element {number_of(key)} is there twice")
            found[key] = nodes
        self._add(scope, "ELSET", options.get("ELSET"), values[::size])

    def _set(self, scope: Scope, kind: str, options: Options, rows: Rows) -> None:
        if "GENERATE" in options:
            there = self.nodes.keys() if kind == "NSET" else self.cells.keys() | self.lines
            chosen = []
            for first, last, *step in rows:
                a, b = scope.key(first), scope.key(last)
                every = max(int(*step), 1) if step else 1
                chosen += [n for n in there if a <= n <= b and (n - a) % every == 0]
        else:
            chosen = self._chosen(scope, kind, chain(*rows))
        owner = Scope() if "INSTANCE" in options else scope
        self._add(owner, kind, options.get(kind), chosen)
        if "INTERNAL" in options:
            self.internal.add(owner.qualified(options.get(kind, "")))

    def _surface(self, scope: Scope, options: Options, rows: Rows) -> None:
        name = options.get("NAME", "")
        if options.get("TYPE", "").upper() == "NODE":
            self._add(scope, "NSET", name, self._chosen(scope, "NSET", (row[0] for row in rows)))
            return
        found = [
            (self._chosen(scope, "ELSET", [item]), "".join(face).upper()) for item, *face in rows
        ]
        self.surfaces[scope.qualified(name)] += found

    def _add(self, scope: Scope, kind: str, name: str | None, keys: list[int]) -> None:
        if name:
            whole = scope.qualified(name)
            if self._owners.setdefault((kind, whole.upper()), scope.index) != scope.index:
                raise ValueError(
                    f"the *{kind} {whole!r} is there twice, once as a set of an instance"
                )
            self.sets[kind].setdefault(self._names.setdefault(whole.upper(), whole), []).extend(
                keys
            )

    def _chosen(self, scope: Scope, kind: str, items: Iterable[str]) -> list[int]:
        """The keys of the numbers among ``items``, and those in the sets named there, of the
        ``scope`` first."""
        chosen = []
        for item in filter(None, items):
            if item.isdecimal():
                chosen.append(scope.key(item))
                continue
            names = [self._names.get(name.upper(), name) for name in (scope.qualified(item), item)]
            known = next((name for name in names if name in self.sets[kind]), None)
            if known is None:
                raise ValueError(f"there is no *{kind} {item!r}")
            chosen += self.sets[kind][known]
        return chosen


def read_abaqus(path: Path) -> PlaneMesh:
    """The mesh of an .inp file: its element sets, and as facet sets its surfaces, its sets of lines
    and what its node sets have of the boundary; other nodes of these are point sets. Raises
    ValueError."""
    model = _Model(path)
    kind = one_kind(set(map(len, model.cells.values())))
    node, cell = (
        {number: k for k, number in enumerate(there)} for there in (model.nodes, model.cells)
    )
    corners = _places(node, chain(*model.cells.values()), "node").reshape(-1, kind)
    cell_sets, facet_sets, point_sets = {}, defaultdict[str, list[np.ndarray]](list), {}
    for name, numbers in model.sets["ELSET"].items():
        ends = [
            model.lines[number][:: len(model.lines[number]) - 1]
            for number in numbers
            if number in model.lines
        ]
        members = sorted(set(numbers) - model.lines.keys() - model.without_area)
        named = name not in model.internal and not (
            numbers and model.without_area.issuperset(numbers)
        )
        if named and (members or not ends):
            cell_sets[name] = _places(cell, members, f"element of the set {name!r}")
        if ends:
            facet_sets[name].append(_places(node, chain(*ends), "node").reshape(-1, 2))
    sides = 3 if kind in (3, 6) else 4
    faces = {f"S{k}": [k - 1, k % sides] for k in range(1, sides + 1)}
    for name, parts in model.surfaces.items():
        for elements, face in parts:
            if face not in faces:
                raise ValueError(
                    f"the surface {name!r} has the face {face!r}, which is none of S1 to S{sides}"
                )
            places = _places(cell, elements, f"element of the surface {name!r}")
            facet_sets[name].append(corners[places][:, faces[face]])
    x, cells = in_basix_order(np.array(list(model.nodes.values())), corners, perm_gmsh)
    boundary, _ = outer_sides(cells)
    for name, numbers in model.sets["NSET"].items():
        if name not in facet_sets and name not in model.internal:
            nodes = _places(node, sorted(set(numbers)), f"node of the set {name!r}")
            edges = boundary[np.isin(boundary, nodes).all(axis=1)]
            if len(edges):
                facet_sets[name].append(edges[:, :2])
            if len(rest := np.setdiff1d(nodes, edges)):
                point_sets[name] = rest
    return PlaneMesh.of_sets(
        x,
        cells,
        cell_sets,
        {name: np.concatenate(ends) for name, ends in facet_sets.items()},
        point_sets,
    )


def _places(known: dict[int, int], wanted: Iterable[int], what: str) -> np.ndarray:
    """Where the numbers ``wanted`` are ``known`` to be. Raises ValueError."""
    try:
        return np.array([known[number] for number in wanted], dtype=np.int64)
    except KeyError as lost:
        raise ValueError(f"there is no {what} with the number {number_of(lost.args[0])}") from None

"""Meshes of Abaqus and CalculiX: nodes, plane elements, sets and surfaces of an .inp file.

Elements are plane: of plane stress, plane strain and axisymmetric problems; which of these is
solved is for the scene to say. Trusses only name edges, as gmsh writes them. Springs, masses and
the like name nothing. All else is skipped. meshio's reader of such files knows neither surfaces
nor plane elements of second order, and forgets all but the last block of nodes.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from itertools import chain
from pathlib import Path

import basix
import numpy as np
from dolfinx.cpp.io import perm_gmsh

from archord.geometry.basis import QUADRILATERAL, TRIANGLE
from archord.geometry.meshes.cells import in_basix_order, n_sides, outer_sides
from archord.geometry.meshes.formats.abaqus_blocks import (
    Options,
    Rows,
    Scope,
    number_of,
    scoped_blocks,
)
from archord.geometry.meshes.mesh_arrays import MeshArrays, one_kind

# plane stress, plane strain, axisymmetric, trusses; the fourth character is the number of nodes
_KINDS = re.compile(r"(CP[ES][3468]|CAX[3468]|T[23]D[23])[A-Z]*")
_SHAPES = {"3": TRIANGLE, "6": TRIANGLE, "4": QUADRILATERAL, "8": QUADRILATERAL}
_WITHOUT_AREA = re.compile(r"(SPRING|DASHPOT|MASS|ROTARYI|CONN|GAP|DCOUP|R2D2|RB2D2).*")
_OTHERS = {
    "C3D": "solid elements",
    "SC": "shell elements",
    "S": "shell elements",
    "M3D": "membrane elements",
    "CAXA": "axisymmetric elements with asymmetric deformation",
    "CGAX": "axisymmetric elements with twist",
    "B": "beam elements",
    "COH": "cohesive elements",
}
_UNREAD = {"SYSTEM", "NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY"}  # they move or make nodes


class _Model:
    """What a file has, by keys (`Scope.key`).

    - ``nodes``: places
    - ``cells``, ``lines``: the nodes of plane elements, and of trusses
    - ``shapes``: triangles or quadrilaterals, as the plane elements are
    - ``without_area``: elements that are neither
    - ``sets``: the keys of sets by kind and by name, as it is first written
    - ``surfaces``: elements and the name of a face, by the surface's name
    - ``internal``: names of sets for the file's own use
    """

    def __init__(self, path: Path) -> None:
        self.nodes: dict[int, list[float]] = {}
        self.cells: dict[int, list[int]] = {}
        self.lines: dict[int, list[int]] = {}
        self.shapes: set[basix.CellType] = set()
        self.without_area: set[int] = set()
        self.sets: dict[str, dict[str, list[int]]] = {"NSET": {}, "ELSET": {}}
        self.surfaces: dict[str, list[tuple[list[int], str]]] = defaultdict(list)
        self.internal: set[str] = set()
        self._names: dict[str, str] = {}
        self._owners: dict[tuple[str, str], int] = {}
        readers = {"NODE": self._node, "ELEMENT": self._element, "SURFACE": self._surface}
        for scope, (keyword, options, rows) in scoped_blocks(path):
            if keyword in _UNREAD or options.get("SYSTEM", "R").upper() != "R":
                raise ValueError(
                    f"*{keyword} is not read as it stands; write all nodes and elements out, in "
                    "rectangular coordinates"
                )
            if keyword in readers:
                readers[keyword](scope, options, rows)
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
        name = options.get("TYPE", "").upper()
        if _WITHOUT_AREA.fullmatch(name):
            self.without_area.update(scope.key(row[0]) for row in rows)
            return
        if not _KINDS.fullmatch(name):
            starts = (said for start, said in _OTHERS.items() if name.startswith(start))
            what = next(starts, "elements")
            raise ValueError(
                f"{what} of type {name} are not read, only plane ones: CPS, CPE and CAX of 3, 4, "
                "6 or 8 nodes"
            )
        n_nodes = name[3]
        size = 1 + int(n_nodes)
        values = [scope.key(value) for row in rows for value in row if value]
        if len(values) % size:
            raise ValueError(
                f"elements of type {name} have {len(values)} numbers, no multiple of {size}"
            )
        found = self.lines
        if not name.startswith("T"):
            found = self.cells
            self.shapes.add(_SHAPES[n_nodes])
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
                a = scope.key(first)
                b = scope.key(last)
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
        for item, *face in rows:
            elements = self._chosen(scope, "ELSET", [item])
            self.surfaces[scope.qualified(name)].append((elements, "".join(face).upper()))

    def _add(self, scope: Scope, kind: str, name: str | None, keys: list[int]) -> None:
        if not name:
            return
        whole = scope.qualified(name)
        owner = self._owners.setdefault((kind, whole.upper()), scope.index)
        if owner != scope.index:
            raise ValueError(f"the *{kind} {whole!r} is there twice, once as a set of an instance")
        first_written = self._names.setdefault(whole.upper(), whole)
        self.sets[kind].setdefault(first_written, []).extend(keys)

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


def read_abaqus(path: Path) -> MeshArrays:
    """The mesh of an .inp file. Raises ValueError.

    Its element sets are cell sets. Facet sets are its surfaces, its sets of trusses and what its
    node sets have of the boundary. Other nodes of the node sets are point sets.
    """
    model = _Model(path)
    size = one_kind(set(map(len, model.cells.values())))
    [kind] = model.shapes
    node = {key: place for place, key in enumerate(model.nodes)}
    cell = {key: place for place, key in enumerate(model.cells)}
    nodes = _places(node, chain(*model.cells.values()), "node").reshape(-1, size)
    x, cells = in_basix_order(kind, np.array(list(model.nodes.values())), nodes, perm_gmsh)
    cell_sets = {}
    facet_sets = defaultdict[str, list[np.ndarray]](list)
    for name, keys in model.sets["ELSET"].items():
        trusses = [model.lines[key] for key in keys if key in model.lines]
        members = sorted(set(keys) - model.lines.keys() - model.without_area)
        of_springs = keys and model.without_area.issuperset(keys)
        named = name not in model.internal and not of_springs
        if named and (members or not trusses):
            cell_sets[name] = _places(cell, members, f"element of the set {name!r}")
        if trusses:
            ends = [(truss[0], truss[-1]) for truss in trusses]
            facet_sets[name].append(_places(node, chain(*ends), "node").reshape(-1, 2))
    count = n_sides(kind)
    faces = {f"S{k + 1}": [k, (k + 1) % count] for k in range(count)}
    for name, parts in model.surfaces.items():
        for elements, face in parts:
            if face not in faces:
                raise ValueError(
                    f"the surface {name!r} has the face {face!r}, which is none of S1 to S{count}"
                )
            places = _places(cell, elements, f"element of the surface {name!r}")
            facet_sets[name].append(nodes[places][:, faces[face]])
    boundary, _ = outer_sides(kind, cells)
    point_sets = {}
    for name, keys in model.sets["NSET"].items():
        if name in facet_sets or name in model.internal:
            continue
        of_set = _places(node, sorted(set(keys)), f"node of the set {name!r}")
        edges = boundary[np.isin(boundary, of_set).all(axis=1)]
        if len(edges):
            facet_sets[name].append(edges[:, :2])
        rest = np.setdiff1d(of_set, edges)
        if len(rest):
            point_sets[name] = rest
    facets = {name: np.concatenate(ends) for name, ends in facet_sets.items()}
    return MeshArrays.of_sets(kind, x, cells, cell_sets, facets, point_sets)


def _places(known: dict[int, int], wanted: Iterable[int], what: str) -> np.ndarray:
    """Where the numbers ``wanted`` are ``known`` to be. Raises ValueError."""
    try:
        return np.array([known[number] for number in wanted], dtype=np.int64)
    except KeyError as lost:
        raise ValueError(f"there is no {what} with the number {number_of(lost.args[0])}") from None

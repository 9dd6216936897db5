"""Meshes of Abaqus and CalculiX: nodes, elements, sets and surfaces of an .inp file.

The mesh is of solid elements, or, in a file without any, of plane ones: of plane stress, plane
strain and axisymmetric problems; which of these is solved is for the scene to say. Elements of
fewer dimensions only name sides or nodes, as gmsh writes them: trusses edges, plane elements faces
of solid ones. Springs, masses and the like name nothing. All else is skipped. meshio's reader of
such files knows neither surfaces nor plane elements of second order, and forgets all but the last
block of nodes.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from dolfinx.cpp.io import perm_vtk

from archord.geometry.basis import HEXAHEDRON, QUADRILATERAL, TETRAHEDRON, TRIANGLE
from archord.geometry.meshes.cells import in_basix_order, n_corners, outer_sides, side_kind
from archord.geometry.meshes.formats.abaqus_blocks import (
    Options,
    Rows,
    Scope,
    number_of,
    scoped_blocks,
)
from archord.geometry.meshes.mesh_arrays import MeshArrays, one_kind, require_known
from archord.materials.kinematics import Ints
from archord.report.by_name import Words

# trusses; plane stress, plane strain, axisymmetric; solids: each with the number of nodes
_KINDS = {
    1: re.compile(r"T[23]D([23])[A-Z]*"),
    2: re.compile(r"(?:CP[ES]|CAX)([3468])[A-Z]*"),
    3: re.compile(r"C3D(4|8|10|20)[A-Z]*"),
}
_PLANES = {"CPE": "strain", "CPS": "stress", "CAX": "axisymmetric"}
_PRISMS = re.compile(r"C3D(6|15)[A-Z]*")
_SHAPES = {
    2: {3: TRIANGLE, 6: TRIANGLE, 4: QUADRILATERAL, 8: QUADRILATERAL},
    3: {4: TETRAHEDRON, 10: TETRAHEDRON, 8: HEXAHEDRON, 20: HEXAHEDRON},
}
# corners of the sides S1, S2, ... of an element: in a plane from end to end with the element on the
# left, in space so that they turn about the normal into the element
SIDES = {
    TRIANGLE: [[0, 1], [1, 2], [2, 0]],
    QUADRILATERAL: [[0, 1], [1, 2], [2, 3], [3, 0]],
    TETRAHEDRON: [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
    HEXAHEDRON: [
        [0, 1, 2, 3],
        [4, 7, 6, 5],
        [0, 4, 5, 1],
        [1, 5, 6, 2],
        [2, 6, 7, 3],
        [3, 7, 4, 0],
    ],
}
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
    - ``elements``: the nodes of elements by their dimension: trusses, plane and solid ones
    - ``without_area``: elements that are none of these
    - ``planes``: the kinematics that plane elements are named for
    - ``sets``: the keys of sets by kind and by name, as it is first written
    - ``surfaces``: elements and the name of a face, by the surface's name
    - ``internal``: names of sets for the file's own use
    """

    def __init__(self, path: Path) -> None:
        self.nodes: dict[int, list[float]] = {}
        self.elements: dict[int, dict[int, list[int]]] = {1: {}, 2: {}, 3: {}}
        self.without_area: set[int] = set()
        self.planes: set[str] = set()
        self.sets: dict[str, dict[str, list[int]]] = {"NSET": {}, "ELSET": {}}
        self.surfaces: dict[str, list[tuple[list[int], str]]] = defaultdict(list)
        self.internal: set[str] = set()
        self._names: Words = {}
        self._owners: dict[tuple[str, str], int] = {}
        readers = {"NODE": self._node, "ELEMENT": self._element, "SURFACE": self._surface}
        blocks = list(scoped_blocks(path))
        # a set may stand above nodes and elements that it has
        blocks.sort(key=lambda scoped: scoped[1].keyword not in ("NODE", "ELEMENT"))
        for scope, (keyword, options, rows) in blocks:
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
        if _PRISMS.fullmatch(name):
            require_known(["prism"])
        matches = {dim: kind.fullmatch(name) for dim, kind in _KINDS.items()}
        found = [(dim, int(match[1])) for dim, match in matches.items() if match]
        if not found:
            starts = (said for start, said in _OTHERS.items() if name.startswith(start))
            what = next(starts, "elements")
            raise ValueError(
                f"{what} of type {name} are not read, only CPS, CPE and CAX of 3, 4, 6 or 8 nodes "
                "and C3D of 4, 8, 10 or 20 nodes"
            )
        [(dim, n_nodes)] = found
        if dim == 2:
            self.planes.add(_PLANES[name[:3]])
        size = 1 + n_nodes
        values = [scope.key(value) for row in rows for value in row]
        if len(values) % size:
            raise ValueError(
                f"elements of type {name} have {len(values)} numbers, no multiple of {size}"
            )
        for start in range(0, len(values), size):
            key, *nodes = values[start : start + size]
            if any(key in of_dim for of_dim in self.elements.values()):
                raise ValueError(f"the element {number_of(key)} is there twice")
            if dim == 1:  # whose middle node stands between its ends
                nodes = [nodes[0], nodes[-1], *nodes[1:-1]]
            self.elements[dim][key] = nodes
        self._add(scope, "ELSET", options.get("ELSET"), values[::size])

    def _set(self, scope: Scope, kind: str, options: Options, rows: Rows) -> None:
        if "GENERATE" in options:
            there = self.nodes if kind == "NSET" else list(chain(*self.elements.values()))
            chosen = []
            for first, last, *step in rows:
                a = scope.key(first)
                b = scope.key(last)
                if a > b:
                    raise ValueError(f"a *{kind} is to generate {first} to {last}, backward")
                every = max(int(*step), 1) if step else 1
                chosen += [n for n in there if a <= n <= b and (n - a) % every == 0]
        elif kind == "NSET" and "ELSET" in options:
            of_elements = self._chosen(scope, "ELSET", [options["ELSET"]])
            chosen = [node for key in of_elements for node in self._nodes_of(key)]
        else:
            chosen = self._chosen(scope, kind, chain(*rows))
        owner = Scope() if "INSTANCE" in options else scope
        self._add(owner, kind, options.get(kind), chosen)
        if "INTERNAL" in options:
            self.internal.add(owner.qualified(options.get(kind, "")))

    def _surface(self, scope: Scope, options: Options, rows: Rows) -> None:
        name = options.get("NAME", "")
        if options.get("TYPE", "").upper() == "NODE":
            nodes = self._chosen(scope, "NSET", (row[0] for row in rows))
            self._add(scope, "NSET", name, nodes)
            return
        surface = scope.qualified(name)
        for item, *words in rows:
            if not item:
                raise ValueError(f"the surface {name!r} has a row that names no elements")
            elements = self._chosen(scope, "ELSET", [item])
            face = "".join(words).upper()
            self.surfaces[surface].append((elements, face))

    def _nodes_of(self, element: int) -> list[int]:
        return next((of[element] for of in self.elements.values() if element in of), [])

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

    Its element sets are cell sets. Facet sets are its surfaces, its sets of elements of one
    dimension less and what its node sets have of the boundary. Other nodes of the node sets, and
    the nodes of sets of trusses in space, are point sets.
    """
    model = _Model(path)
    d = 3 if model.elements[3] else 2
    elements = model.elements[d]
    size = one_kind(set(map(len, elements.values())), d)
    kind = _SHAPES[d][size]
    node = {key: place for place, key in enumerate(model.nodes)}
    cell = {key: place for place, key in enumerate(elements)}
    places = np.array(list(model.nodes.values()))
    nodes = _places(node, chain(*elements.values()), "node").reshape(-1, size)
    x, cells = in_basix_order(kind, places, nodes, perm_vtk)
    cell_sets = {}
    facet_sets = defaultdict[str, list[np.ndarray]](list)
    point_sets = {}
    corners = n_corners(side_kind(kind))
    sides = model.elements[d - 1]
    for name, keys in model.sets["ELSET"].items():
        of_sides = [sides[key][:corners] for key in keys if key in sides]
        of_lines = [model.elements[1][key] for key in keys if d == 3 and key in model.elements[1]]
        others = chain(model.without_area, *(model.elements[dim] for dim in range(1, d)))
        members = sorted(set(keys).difference(others))
        of_springs = keys and model.without_area.issuperset(keys)
        named = name not in model.internal and not of_springs
        if named and (members or not (of_sides or of_lines)):
            cell_sets[name] = _places(cell, members, f"element of the set {name!r}")
        if of_sides:
            places = _places(node, chain(*of_sides), "node")
            facet_sets[name].append(places.reshape(-1, corners))
        if of_lines:
            point_sets[name] = np.unique(_places(node, chain(*of_lines), "node"))
    faces = {f"S{k}": side for k, side in enumerate(SIDES[kind], 1)}
    for name, parts in model.surfaces.items():
        for of_surface, face in parts:
            if face not in faces:
                raise ValueError(
                    f"the surface {name!r} has the face {face!r}, which is none of S1 to "
                    f"S{len(faces)}"
                )
            places = _places(cell, of_surface, f"element of the surface {name!r}")
            facet_sets[name].append(nodes[places][:, faces[face]])
    boundary, _ = outer_sides(kind, cells)
    made = boundary >= len(node)  # in the middle of faces, where the file has no node
    notes = []
    for name, keys in model.sets["NSET"].items():
        if name in model.internal:
            continue
        of_set = _places(node, sorted(set(keys)), f"node of the set {name!r}")
        if name in facet_sets:
            of_surface = np.concatenate(facet_sets[name])
            beside = np.setdiff1d(np.intersect1d(of_set, nodes[:, : n_corners(kind)]), of_surface)
            if len(beside) or not np.isin(of_surface, of_set).all():
                notes.append(
                    f"{name!r} is a surface and a node set of other nodes: the surface is taken"
                )
            continue
        within = boundary[(np.isin(boundary, of_set) | made).all(axis=1)]
        if len(within):
            facet_sets[name].append(within[:, :corners])
        rest = np.setdiff1d(of_set, within)
        if len(rest):
            point_sets[name] = rest
    facets = {name: np.concatenate(of_parts) for name, of_parts in facet_sets.items()}
    mesh = MeshArrays.of_sets(kind, x, cells, cell_sets, facets, point_sets)
    one_plane = d == 2 and len(model.planes) == 1
    plane = model.planes.pop() if one_plane else ""
    return replace(mesh, notes=tuple(notes), plane=plane)


def _places(known: dict[int, int], wanted: Iterable[int], what: str) -> Ints:
    """Where the numbers ``wanted`` are ``known`` to be. Raises ValueError."""
    try:
        return np.array([known[number] for number in wanted], dtype=np.int64)
    except KeyError as lost:
        raise ValueError(f"there is no {what} with the number {number_of(lost.args[0])}") from None

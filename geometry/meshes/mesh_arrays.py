"""A mesh of curved cells of one kind, in a plane or in space, as arrays before dolfinx distributes
it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import basix
import numpy as np
from dolfinx.cpp.io import perm_gmsh

from archord.geometry.basis import Array, dimension_of, order_of
from archord.geometry.meshes.cells import (
    corners_of,
    distinct,
    entities_of,
    in_basix_order,
    inner_weights,
    n_corners,
    sides_between,
    sides_of,
    with_middle_nodes,
)
from archord.geometry.meshes.tagged_mesh import tags_of
from archord.materials.kinematics import Bools, Ints
from archord.report.by_name import Names
from archord.report.errors import shown

_FAR = 1e30  # coordinates beyond overflow
_INCOMPLETE = 20  # gmsh's number of triangles of third order without a node inside
_CUT = "cut them into tetrahedra, or mesh with tetrahedra or hexahedra alone"
_ONE_KIND = {
    2: ("plane cells", "triangles", "quadrilaterals"),
    3: ("solid cells", "tetrahedra", "hexahedra"),
}
_THICK = 1e-6  # difference of z over the mesh's size

_NONE = np.zeros(0, dtype=np.int64)
Numbers = tuple[Mapping[str, int], Mapping[str, int]]


@dataclass(frozen=True)
class MeshArrays:
    """Nodes, cells of one kind, and their sides in named sets, in ``d`` = 2 or 3 dimensions.

    - ``x`` ``(n, d)``: the nodes
    - ``kind``: whether cells are triangles, quadrilaterals, tetrahedra or hexahedra
    - ``cells`` ``(m, a)``: their nodes, in basix' order
    - ``bodies`` ``(m,)``: a tag for each cell
    - ``facets`` ``(k, b)``: nodes of the edges, or of the faces in space, in sets, in basix' order
    - ``tags`` ``(k,)``: a tag for each of these
    - ``cell_sets``, ``facet_sets``: the tags of each set, several where sets overlap
    - ``point_sets``: the nodes of each set
    - ``notes``: what to warn of
    - ``plane``: the kinematics that a deck's elements are named for, "" where none are
    """

    x: Array
    kind: basix.CellType
    cells: Ints
    bodies: Ints
    facets: Ints
    tags: Ints
    cell_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)
    facet_sets: dict[str, tuple[int, ...]] = field(default_factory=dict)
    point_sets: dict[str, np.ndarray] = field(default_factory=dict)
    notes: Names = ()
    plane: str = ""

    @property
    def order(self) -> int:
        """Order of the cells."""
        return order_of(self.kind, self.cells.shape[1])

    @property
    def dimension(self) -> int:
        """Dimension of the cells."""
        return dimension_of(self.kind)

    @classmethod
    def from_gmsh(cls, gmsh) -> MeshArrays:
        """What gmsh's model has in physical groups: in space where volumes are in groups, in a
        plane else. Raises ValueError if that is not one kind of cells."""
        d = gmsh_dimension(gmsh)
        groups = _groups(gmsh, d)
        types = set().union(*(group.types for group in groups.values()))
        name, _, _, n_nodes, *_ = _properties(gmsh, types, d)
        facets = _groups(gmsh, d - 1)
        points: dict[str, _Group] = {}
        for dim in reversed(range(d - 1)):
            found = _groups(gmsh, dim)
            for twice in points.keys() & found:
                raise ValueError(f"physical groups of lines and of points are called {twice!r}")
            points |= found
        listed = [group.nodes.reshape(-1, n_nodes) for group in groups.values()]
        cells = np.concatenate(listed)
        # old files repeat cells
        _, first, which = np.unique(cells, axis=0, return_index=True, return_inverse=True)
        kept = np.sort(first)
        place_of = np.searchsorted(kept, first[which.ravel()])
        members = split(place_of, listed)
        node_tags, x, _ = gmsh.model.mesh.getNodes()
        order = np.argsort(node_tags)

        def place(found: np.ndarray) -> np.ndarray:
            return np.searchsorted(node_tags, found, sorter=order)

        word, *_ = name.split()
        kind = basix.CellType[word.lower()]
        places = x.reshape(-1, 3)[order]
        x, cells = in_basix_order(kind, places, place(cells[kept]), perm_gmsh)
        cell_sets = dict(zip(groups, members, strict=True))
        facet_sets = {name: place(corners_of(kind, own.nodes)) for name, own in facets.items()}
        point_sets = {name: np.unique(place(own.nodes)) for name, own in points.items()}
        numbers = _tags(groups), _tags(facets)
        mesh = cls.of_sets(kind, x, cells, cell_sets, facet_sets, point_sets, numbers)
        notes = (*_nameless(groups, d), *_nameless(facets, d - 1), *_left_out(gmsh, d))
        return replace(mesh, notes=notes)

    @classmethod
    def of_sets(
        cls,
        kind: basix.CellType,
        x: Array,
        cells: Ints,
        cell_sets: Mapping[str, Ints],
        facet_sets: Mapping[str, Ints],
        point_sets: Mapping[str, np.ndarray],
        numbers: Numbers | None = None,
    ) -> MeshArrays:
        """The mesh of ``cells``, in basix' order, with the nodes of ``x`` ``(n, 2 or 3)`` that they
        use.

        Sets are given by cells ``(k,)``, by the corners ``(k, c)`` of facets, and by nodes. Sets of
        cells and of facets have ``numbers``, or are counted from 1. Raises ValueError for plane
        cells that do not lie in a plane, and for facets that no cell has.
        """
        used, of_cells = np.unique(cells, return_inverse=True)
        new = np.full(len(x) + 1, -1)
        new[used] = np.arange(len(used))
        x = coordinates(x[used], dimension_of(kind))
        cells = of_cells.reshape(cells.shape)
        cell_sets = cell_sets or {"all": np.arange(len(cells))}
        cell_numbers, facet_numbers = numbers or (_counted(cell_sets), _counted(facet_sets))
        members, tags, named_cells = _one_tag_each(cell_sets, cell_numbers)
        bodies = np.zeros(len(cells), dtype=np.int32)
        bodies[members] = tags
        sides = sides_of(kind, cells)
        found = _sides_of_sets(kind, cells, new, facet_sets)
        what = "edges" if dimension_of(kind) == 2 else "faces"
        for name, members in found.items():
            if lost := (members >= len(sides)).sum():
                raise ValueError(
                    f"{lost} of the {what} of the facet set {name!r} are not {what} of cells"
                )
        members, tags, named_facets = _one_tag_each(found, facet_numbers)
        facets = sides[members]
        points = {name: new[nodes] for name, nodes in point_sets.items()}
        points = {name: nodes[nodes >= 0] for name, nodes in points.items()}
        return cls(x, kind, cells, bodies, facets, tags, named_cells, named_facets, points)

    def facets_of(self, name: str) -> Ints:
        """Nodes ``(k, b)`` of the facets of a set; none if there is no such set."""
        return self.facets[self.within(name)]

    def within(self, name: str) -> Bools:
        """Which of the `facets` are in a set; none if there is no such set."""
        return np.isin(self.tags, self.facet_sets.get(name, ()))

    def with_sets(self, sets: Mapping[str, Sequence[str]]) -> MeshArrays:
        """This mesh with more facet ``sets``, each made of others. Raises ValueError for others
        that are not there, and for no others."""
        facet_sets = dict(self.facet_sets)
        for name, others in sets.items():
            by = f"mesh.sets.{name} = {shown(others)}: "
            tags = [tags_of("facet", self.facet_sets, other, by) for other in others]
            facet_sets[name] = tuple(sorted(set().union(*tags)))
            tags_of("facet", facet_sets, name, by)
        return replace(self, facet_sets=facet_sets)

    def second_order(self) -> MeshArrays:
        """This mesh of straight cells with nodes on the middles of edges, of quadrilaterals and of
        hexahedra, behind the others."""
        ends = entities_of(self.kind, self.cells, 1)
        first, which = distinct(ends)
        middles = self.x[ends[first]].mean(axis=1)
        x = np.concatenate([self.x, middles])
        of_cells = (len(self.x) + which).reshape(len(self.cells), -1)
        cells = np.hstack([self.cells, of_cells])
        if n_corners(self.kind) == 2**self.dimension:
            x, cells = with_middle_nodes(self.kind, x, cells)
        return self.with_cells(x, cells)

    def with_cells(self, x: Array, cells: Ints) -> MeshArrays:
        """This mesh with the nodes ``x`` and ``cells`` of another order that lie where this one's
        lie."""
        corners = corners_of(self.kind, self.facets)
        numbers = sides_between(self.kind, self.cells, corners)
        facets = sides_of(self.kind, cells)[numbers]
        return replace(self, x=x, cells=cells, facets=facets)

    def centred(self, kept: Ints = _NONE) -> MeshArrays:
        """This mesh with the nodes inside faces and cells where the nodes around them want them,
        but for nodes that are ``kept``."""
        x = self.x.copy()
        for dim in range(2, self.dimension + 1):
            kind, *_ = basix.cell.subentity_types(self.kind)[dim]
            weights = inner_weights(kind, self.order)
            n_inner = len(weights)
            if n_inner:
                entities = entities_of(self.kind, self.cells, dim)
                around = x[entities[:, :-n_inner]]
                x[entities[:, -n_inner:]] = np.einsum("ib,cbk->cik", weights, around)
                x[kept] = self.x[kept]
        return replace(self, x=x)


def split(joined: np.ndarray, parts: Iterable[Sized]) -> list[np.ndarray]:
    """What is ``joined`` of ``parts`` of these lengths."""
    ends = np.cumsum([len(part) for part in parts])
    return np.split(joined, ends[:-1])


def _counted(names: Iterable[str]) -> dict[str, int]:
    return {name: number for number, name in enumerate(names, 1)}


def _sides_of_sets(
    kind: basix.CellType, cells: Ints, new: Ints, sets: Mapping[str, Ints]
) -> dict[str, Ints]:
    """Which of `sides_of` ``cells`` are in each of the ``sets``, whose corners ``(k, c)`` have
    ``new`` numbers; found at once, as all sides are sorted for it."""
    if not sets:
        return {}
    corners = new[np.concatenate(list(sets.values()))]
    members = split(sides_between(kind, cells, corners), sets.values())
    return dict(zip(sets, members, strict=True))


def _one_tag_each(
    sets: Mapping[str, Ints], numbers: Mapping[str, int]
) -> tuple[Ints, Ints, dict[str, tuple[int, ...]]]:
    """The members ``(k,)`` of all ``sets`` as they first come, a tag for each, and the tags of
    every set.

    A member of one set has the set's number. Members of the same several sets share a new one.
    """
    members = np.concatenate([_NONE, *sets.values()]).astype(np.int64)
    sizes = [len(found) for found in sets.values()]
    set_of = np.repeat(np.arange(len(sets)), sizes)
    distinct, first, which = np.unique(members, return_index=True, return_inverse=True)
    within = np.zeros((len(distinct), len(sets)), dtype=bool)
    within[which, set_of] = True
    given = np.array([numbers[name] for name in sets], dtype=np.int32)
    tag = given[set_of[first]]
    several = within.sum(axis=1) > 1
    together, combination = np.unique(within[several], axis=0, return_inverse=True)
    next_tag = given.max(initial=0) + 1
    new = next_tag + np.arange(len(together), dtype=np.int32)
    tag[several] = new[combination.ravel()]
    tags = {}
    for name, inside in zip(sets, within.T, strict=True):
        of_set = np.unique(tag[inside])
        tags[name] = tuple(of_set.tolist())
    order = np.argsort(first)
    return distinct[order], tag[order], tags


class _Group(NamedTuple):
    """A physical group of gmsh: its tag, gmsh's numbers for the types of its elements, and the
    numbers ``(k, a)`` of their nodes."""

    tag: int
    types: set[int]
    nodes: Ints


def _tags(groups: Mapping[str, _Group]) -> dict[str, int]:
    return {name: group.tag for name, group in groups.items()}


def _groups(gmsh, dim: int) -> dict[str, _Group]:
    """The physical groups of dimension ``dim`` by their names, by their tags where they have
    none."""
    groups = {}
    for _, tag in gmsh.model.getPhysicalGroups(dim):
        of_type = defaultdict(list)
        for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag):
            types, _, found = gmsh.model.mesh.getElements(dim, entity)
            for number, nodes in zip(types, found, strict=True):
                of_type[int(number)].append(nodes)
        if _INCOMPLETE in of_type:
            raise ValueError(
                "triangles of 9 nodes are not read; triangles of third order have 10, one of them "
                "inside"
            )
        nodes = np.zeros((0, dim + 1), dtype=np.uint64)
        if of_type:
            _, _, _, n_nodes, *_ = _properties(gmsh, set(of_type), dim)
            [parts] = of_type.values()
            nodes = np.concatenate(parts).reshape(-1, n_nodes)
        name = gmsh.model.getPhysicalName(dim, tag) or str(tag)
        if name in groups:
            raise ValueError(f"two physical groups of dimension {dim} are called {name!r}")
        groups[name] = _Group(tag, set(of_type), nodes)
    return groups


def _nameless(groups: Mapping[str, _Group], dim: int) -> Iterator[str]:
    """A warning of a group without a name among others of its dimension that have one."""
    without = [name for name, group in groups.items() if name == str(group.tag)]
    if without and len(without) < len(groups):
        yield (
            f"the physical group {without[0]} of dimension {dim} has no name, and others have: of "
            "groups with one name gmsh keeps it for the first"
        )


def _left_out(gmsh, dim: int) -> Iterator[str]:
    """A warning of cells of dimension ``dim`` in no physical group, which are no part of the
    mesh."""
    left = 0
    for _, entity in gmsh.model.getEntities(dim):
        if not len(gmsh.model.getPhysicalGroupsForEntity(dim, entity)):
            _, numbers, _ = gmsh.model.mesh.getElements(dim, entity)
            left += sum(map(len, numbers))
    if left:
        yield f"{left} cells are in no physical group and are left out of the mesh"


def _properties(gmsh, types: set[int], dim: int) -> tuple:
    """What gmsh says of the one of ``types`` of dimension ``dim``: its name, dimension, order,
    number of nodes and more. Raises ValueError if there is not one."""
    properties = [gmsh.model.mesh.getElementProperties(number) for number in sorted(types)]
    require_known(found[0].split()[0] for found in properties)
    nodes = [found[3] for found in properties]
    if len(nodes) > len(set(nodes)):
        raise ValueError("the mesh has tetrahedra and hexahedra: it must have one kind")
    one_kind(set(nodes), max(dim, 2))
    return properties[0]


def gmsh_dimension(gmsh) -> int:
    """Dimension of the problem in gmsh's model: 3 where volumes are in physical groups. Raises
    ValueError for volumes in no group, and no faces either."""
    if gmsh.model.getPhysicalGroups(3):
        return 3
    if not gmsh.model.getPhysicalGroups(2) and len(gmsh.model.mesh.getElementTypes(3)):
        raise ValueError(
            "the mesh has solid cells in no physical group: name the volumes by physical groups"
        )
    return 2


def coordinates(x: Array, dimension: int) -> Array:
    """The first ``dimension`` coordinates of ``x`` ``(n, 2 or 3)``. Raises ValueError where the
    third one differs in a plane, and for nan."""
    farthest = np.abs(x).max(initial=0)
    if not farthest < _FAR:  # nor of nan
        raise ValueError("some nodes have coordinates that are not finite or beyond 1e30")
    size = np.ptp(x, axis=0)
    if dimension == 2 and len(size) == 3 and size[2] > _THICK * size[:2].max():
        raise ValueError(
            f"the mesh is not plane: z differs by {size[2]:g}, and must be the same for all nodes"
        )
    return x[:, :dimension]


def one_kind(nodes: set[int], dimension: int) -> int:
    """The number of ``nodes`` of all cells. Raises ValueError if there is not one."""
    if len(nodes) == 1:
        return nodes.pop()
    cells, some, others = _ONE_KIND[dimension]
    held = f"no {cells} in named sets (only points, lines or elements without a set)"
    if nodes:
        held = f"cells of {' and '.join(map(str, sorted(nodes)))} nodes"
    raise ValueError(
        f"the mesh has {held}; it must have one kind: all {some} or all {others}, of one order"
    )


def require_known(words: Iterable[str]) -> None:
    """Raise ValueError if one of the ``words`` is for prisms or pyramids."""
    wedges = {"prism": "prisms", "wedge": "prisms", "pyramid": "pyramids"}
    found = sorted({wedges[word.lower()] for word in words if word.lower() in wedges})
    if found:
        raise ValueError(f"the mesh has {' and '.join(found)}, which are not read: {_CUT}")

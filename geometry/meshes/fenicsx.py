"""From a gmsh model to a dolfinx mesh, cut in sectors for the ranks."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from tempfile import TemporaryDirectory
from typing import Any

import basix
import basix.ufl
import numpy as np
from dolfinx.cpp.graph import AdjacencyList_int32
from dolfinx.graph import adjacencylist
from dolfinx.io import distribute_entity_data
from dolfinx.mesh import create_mesh, entities_to_geometry, meshtags, meshtags_from_entities
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.meshes.cells import corners_of, n_corners, sides_between, sides_of
from archord.geometry.meshes.mesh_arrays import MeshArrays, gmsh_dimension
from archord.geometry.meshes.mesh_cache import kept_mesh
from archord.geometry.meshes.refine import Circle, on_circles
from archord.geometry.meshes.tagged_mesh import SAME_PLACE, TaggedMesh
from archord.kernels.compat import cell_nodes
from archord.materials.kinematics import Ints

Cut = Callable[[Array, np.ndarray, int], np.ndarray]
_MOST_SECTORS = 4  # in space: beyond, boxes have fewer nodes on their sides
_MANY_CELLS = 10_000  # from which on two parts are slices

# gmsh's number of the recombination that leaves no triangles; it halves the edges of all lines
_ALL_QUADS = 3
# of gmsh's mesh: sizes come from the background field alone
_OPTIONS = {
    "MeshSizeFromPoints": 0,
    "MeshSizeFromCurvature": 0,
    "MeshSizeExtendFromBoundary": 0,
    "Algorithm": 6,
    "HighOrderOptimize": 0,
}
_ARRAYS = ("x", "cells", "bodies", "facets", "tags")
_NO_NODES = np.zeros(0, dtype=np.int64)
_NO_TAGS: frozenset[int] = frozenset()
_SLANTED = np.array([1.0, np.sqrt(2.0), np.pi])
_UNTAGGED = np.iinfo(np.int32).min  # the tag of a cell that has none


def gmsh_to_mesh(
    comm: MPI.Comm,
    build: Callable,
    circles: Sequence[Circle] = (),
    *,
    order: int = 2,
    refinements: int = 0,
    quads: bool = False,
    partitioner=None,
    key: tuple = (),
    cut: Cut | None = None,
    finish: Callable[[MeshArrays], MeshArrays] | None = None,
) -> TaggedMesh:
    """Mesh what a function draws in gmsh, and distribute it over the ranks.

    The sets have the names of gmsh's physical groups. An error on rank 0 is raised on every rank.
    Where physical volumes are drawn, the mesh is of space, else of a plane. What has a mesh already
    is taken by `Mesh`.

    Parameters
    ----------
    comm : MPI.Comm
        The communicator.
    build : callable
        ``build(gmsh)`` draws the model. It is called on rank 0.
    circles : sequence of Circle
        Circles (set of facets, centre, radius) on which all nodes of these sets are put. Other
        second-order edges are straight.
    order : int
        The order of the cells.
    refinements : int
        How many times the edges of the cells are cut in two, before they get nodes of higher order.
    quads : bool
        Quadrilaterals instead of triangles, in a plane.
    partitioner : callable
        Replaces the `usual_cut`, as in dolfinx.
    key : tuple
        All that enters the mesh. If it is given, the mesh is kept and found again by it.
    cut : callable
        Tells the rank of each cell in place of the `usual_cut`, and is called as `sectors` is.
    finish : callable
        Makes another mesh of the mesh on rank 0, before it is distributed. What it raises is raised
        on every rank.

    Returns
    -------
    TaggedMesh
        The mesh and its sets by name.

    Raises
    ------
    ModuleNotFoundError
        Where gmsh is not installed.
    RuntimeError
        For what gmsh cannot mesh, with its message.

    Examples
    --------
    >>> from mpi4py import MPI
    >>> from archord import gmsh_to_mesh
    >>> def draw(gmsh):
    ...     disc = gmsh.model.occ.addDisk(0.0, 0.0, 0.0, 1.0, 1.0)
    ...     gmsh.model.occ.synchronize()
    ...     gmsh.model.addPhysicalGroup(2, [disc], name="pin")
    ...     gmsh.model.addPhysicalGroup(1, [1], name="rim")
    >>> mesh = gmsh_to_mesh(MPI.COMM_WORLD, draw)
    >>> list(mesh.cell_sets), list(mesh.facet_sets)
    (['pin'], ['rim'])
    """
    made: MeshArrays | None = None
    failure: Exception | None = None
    if comm.rank == 0:
        make = partial(_made, build, circles, order, refinements, quads)
        try:
            made = kept_mesh((*key, order, refinements, quads), make) if key else make()
        except ModuleNotFoundError as error:  # raised on all ranks below, as what follows
            failure = error
        except Exception as error:
            failure = RuntimeError(f"gmsh could not mesh the problem: {error}")
    if made and finish:
        try:
            made = finish(made)
        except Exception as error:
            failure = error
    if failure := comm.bcast(failure):
        raise failure
    return distribute(comm, made, partitioner, cut)


def _made(
    build: Callable, circles: Sequence[Circle], order: int, refinements: int, quads: bool
) -> MeshArrays:
    options = _OPTIONS | {"RecombineAll": quads}
    if quads:
        options["RecombinationAlgorithm"] = _ALL_QUADS
    with own_gmsh() as gmsh:
        set_mesh_options(gmsh, options)
        build(gmsh)
        gmsh.model.mesh.generate(gmsh_dimension(gmsh))
        for _ in range(refinements):
            gmsh.model.mesh.refine()
        if order > 2:
            gmsh.model.mesh.setOrder(order)
        mesh = MeshArrays.from_gmsh(gmsh)
    if order == 2 and mesh.order == 1:  # in much less time than gmsh's setOrder
        mesh = mesh.second_order()
    mesh = on_circles(mesh, circles)
    return mesh.centred() if quads else mesh


def set_mesh_options(gmsh: Any, options: Mapping[str, float]) -> None:
    """Give gmsh these ``options`` of its mesh, by their names without "Mesh."."""
    for name, value in options.items():
        gmsh.option.setNumber(f"Mesh.{name}", value)


def size_field(gmsh: Any, size: str) -> int:
    """A field of gmsh, by its number: an element ``size`` as a formula of x, y and z."""
    field = gmsh.model.mesh.field
    number = field.add("MathEval")
    field.setString(number, "F", size)
    return number


def size_within(gmsh: Any, size: int, parts: Sequence[int], dimension: int) -> int:
    """A field with the sizes of another one within ``parts`` of the model alone."""
    field = gmsh.model.mesh.field
    number = field.add("Restrict")
    field.setNumber(number, "InField", size)
    field.setNumbers(number, "VolumesList" if dimension == 3 else "SurfacesList", parts)
    return number


def use_smallest(gmsh: Any, sizes: Sequence[int]) -> None:
    """Make the smallest of the fields the element size."""
    field = gmsh.model.mesh.field
    number = field.add("Min")
    field.setNumbers(number, "FieldsList", sizes)
    field.setAsBackgroundMesh(number)


@contextmanager
def own_gmsh() -> Iterator[Any]:
    """gmsh with its defaults and an empty model; a user's model and options come back at the
    end."""
    try:
        import gmsh
    except OSError as error:  # a library of the system is missing
        raise ModuleNotFoundError(f"gmsh cannot be loaded, {error}", name="gmsh") from None

    with TemporaryDirectory() as folder:
        in_use = gmsh.isInitialized()
        options = f"{folder}/gmsh.opt"
        if in_use:
            current = gmsh.model.getCurrent()
            gmsh.write(options)
            gmsh.option.restoreDefaults()
        else:
            gmsh.initialize(readConfigFiles=False, interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.model.add("archord")
            yield gmsh
        finally:
            with suppress(Exception):
                if in_use:
                    gmsh.model.remove()
                    gmsh.merge(options)
                    gmsh.model.setCurrent(current)
                else:
                    gmsh.finalize()  # or the next mesh would start from what is left of this one


def distribute(
    comm: MPI.Comm, made: MeshArrays | None, partitioner=None, cut: Cut | None = None
) -> TaggedMesh:
    """The mesh that rank 0 ``made`` and its sets, on all ranks, whose own one is None; cut by the
    `usual_cut`, if not as ``cut`` or ``partitioner`` say. Collective."""
    nothing = made and replace(made, **{name: getattr(made, name)[:0] for name in _ARRAYS})
    empty = comm.bcast(nothing)
    made = made or empty

    def in_parts(comm, n_parts: int, cell_types, cells) -> AdjacencyList_int32:
        vertices = cells[0].reshape(-1, n_corners(made.kind))
        chosen = cut or usual_cut(made.dimension, n_parts)
        return AdjacencyList_int32(chosen(made.x, vertices, n_parts).reshape(-1, 1))

    if partitioner is None and comm.size > 1:
        partitioner = in_parts
    equispaced = basix.LagrangeVariant.equispaced
    element = basix.ufl.element("P", made.kind, made.order, equispaced, shape=(made.dimension,))
    mesh = create_mesh(comm, cells=made.cells, x=made.x, e=element, partitioner=partitioner)
    dim = mesh.topology.dim
    number = np.asarray(mesh.topology.original_cell_index)
    bodies = comm.bcast(made.bodies)[number]
    cells = meshtags(mesh, dim, np.arange(len(number), dtype=np.int32), bodies)
    corners, tags = distribute_entity_data(mesh, dim - 1, made.facets, made.tags)
    mesh.topology.create_connectivity(dim - 1, dim)
    facets = meshtags_from_entities(mesh, dim - 1, adjacencylist(corners), tags)
    places = {name: made.x[nodes] for name, nodes in made.point_sets.items() if comm.rank == 0}
    points, point_tags = comm.bcast((places, _tags_at_points(made)))
    sets = made.cell_sets, made.facet_sets, points
    return TaggedMesh(mesh, cells, facets, *sets, made.notes, made.plane, point_tags)


def _tags_at_points(mesh: MeshArrays) -> dict[str, list[frozenset[int]]]:
    """The tags of the cells at each node of the point sets that may lie where another node is; none
    at others, as they are found by their places."""
    in_sets = np.concatenate([_NO_NODES, *mesh.point_sets.values()])
    if not len(in_sets):
        return {}
    beside = np.intersect1d(in_sets, _beside_others(mesh.x))
    tags = _tags_at(mesh, beside)
    return {
        name: [tags.get(int(node), _NO_TAGS) for node in nodes]
        for name, nodes in mesh.point_sets.items()
    }


def _beside_others(x: Array) -> Ints:
    """The nodes ``(k,)`` of all ``x`` ``(n, d)`` that may lie where another one is, and few more:
    those with the same place along a slanted line."""
    along = x @ _SLANTED[: x.shape[1]]
    order = np.argsort(along)
    near = SAME_PLACE * np.linalg.norm(_SLANTED) * np.abs(x).max(initial=0.0)
    first = np.flatnonzero(np.diff(along[order]) <= near)
    return order[np.union1d(first, first + 1)]


def _tags_at(mesh: MeshArrays, nodes: Ints) -> dict[int, frozenset[int]]:
    """The tags of the cells at each of the ``nodes``."""
    cell, place = np.nonzero(np.isin(mesh.cells, nodes))
    found = defaultdict[int, set[int]](set)
    for node, tag in zip(mesh.cells[cell, place], mesh.bodies[cell], strict=True):
        found[int(node)].add(int(tag))
    return {int(node): frozenset(found[int(node)]) for node in nodes}


def gathered(tagged: TaggedMesh) -> MeshArrays | None:
    """The inverse of `distribute`: the whole mesh on rank 0, None elsewhere. Collective."""
    from scipy.spatial import cKDTree  # a solve without a mesh from Python does not pay for it

    mesh = tagged.mesh
    topology = mesh.topology
    dim = topology.dim
    kind = mesh.basix_cell()
    node = np.asarray(mesh.geometry.input_global_indices)
    index_map = topology.index_map(dim)
    n = index_map.size_local
    body = np.full(n + index_map.num_ghosts, _UNTAGGED, dtype=np.int32)
    body[tagged.cells.indices] = tagged.cells.values
    owned = tagged.facets.indices < topology.index_map(dim - 1).size_local
    facets = tagged.facets.indices[owned]
    corners = sides_of(kind, cell_nodes(mesh)[:0])
    if len(facets):
        corners = entities_to_geometry(mesh, dim - 1, facets)
    corners = corners_of(kind, corners)
    try:
        number = np.asarray(topology.original_cell_index)[:n]
    except RuntimeError:  # of a submesh
        number = index_map.local_range[0] + np.arange(n)
    cells = node[cell_nodes(mesh)[:n]]
    tags = tagged.facets.values[owned]
    x = mesh.geometry.x[:, :dim]
    parts = mesh.comm.gather((number, cells, body[:n], node[corners], tags, node, x))
    if parts is None:
        return None
    number, cells, body, corners, tags, node, x = map(np.concatenate, zip(*parts, strict=True))
    nodes, first = np.unique(node, return_index=True)
    x = x[first]
    cells = np.searchsorted(nodes, cells)
    found = sides_between(kind, cells, np.searchsorted(nodes, corners))
    facets = sides_of(kind, cells)[found]
    order = np.argsort(number)
    made = MeshArrays(
        x,
        kind,
        cells[order],
        body[order],
        facets,
        tags,
        dict(tagged.cell_sets),
        dict(tagged.facet_sets),
        notes=tagged.notes,
        plane=tagged.plane,
    )
    tree = cKDTree(x)
    near = SAME_PLACE * np.abs(x).max(initial=0.0)
    points = {}
    for name, places in tagged.point_sets.items():
        distance, nearest = tree.query(places)
        points[name] = nearest
        tags = tagged.point_tags.get(name, ())
        if len(tags) == len(places):
            beside = tree.query_ball_point(places, distance + near)
            several = np.flatnonzero([len(nodes) > 1 for nodes in beside])
            at = _tags_at(made, np.concatenate([_NO_NODES, *beside[several]]))
            for k in several:
                points[name][k] = next((n for n in beside[k] if at[n] == tags[k]), nearest[k])
    return replace(made, point_sets=points)


def usual_cut(dimension: int, n_parts: int) -> Cut:
    """`sectors`; in space `boxes` for many parts, as sectors become thin, but not their sides
    smaller."""
    return boxes if dimension == 3 and n_parts > _MOST_SECTORS else sectors


def sectors(x: Array, cells: Ints, n_parts: int) -> Ints:
    """The rank ``(n,)`` of each of the ``cells`` ``(n, k)`` with vertices ``x`` ``(m, d)``: sectors
    around the origin, or the z axis, numbered from below, of as many cells each.

    Points in contact face each other along rays from there, so most pairs stay on one rank; and the
    cut is the same in every run, unlike the cut of a graph partitioner, whose input arrives in any
    order.
    """
    middle_x, middle_y = x[cells].mean(axis=1).T[:2]
    return _in_turn(np.arctan2(middle_y, middle_x), n_parts)


def slices(x: Array, cells: Ints, n_parts: int) -> Ints:
    """As the `usual_cut`, for bodies around pins along z: two parts of many cells are slices across
    z, which have equally much of what touches. Of two sectors one has more of the loaded side of a
    hole; they share less, which counts for few cells."""
    if n_parts != 2 or len(cells) < _MANY_CELLS:
        return usual_cut(3, n_parts)(x, cells, n_parts)
    return _in_turn(x[cells].mean(axis=1)[:, 2], n_parts)


def strips(x: Array, cells: Ints, n_parts: int) -> Ints:
    """As `sectors`, but in strips across the mesh's longest extent, for contact in any place."""
    longest = np.argmax(np.ptp(x, axis=0)) if len(x) else 0
    return _in_turn(x[cells].mean(axis=1)[:, longest], n_parts)


def boxes(x: Array, cells: Ints, n_parts: int) -> Ints:
    """As `sectors`, but in boxes: the cells are cut in two across their longest extent, and so on.
    Their sides shrink with their number, and what is in contact is mostly in one box."""
    middle = x[cells].mean(axis=1)
    part = np.zeros(len(cells), dtype=np.int32)
    uncut: list[tuple[Ints, int, int]] = [(np.arange(len(cells)), 0, n_parts)]
    while uncut:
        chosen, first, n = uncut.pop()
        part[chosen] = first
        if n == 1 or not len(chosen):
            continue
        longest = np.argmax(np.ptp(middle[chosen], axis=0))
        chosen = chosen[np.argsort(middle[chosen, longest], kind="stable")]
        half = n // 2
        at = len(chosen) * half // n
        uncut.append((chosen[:at], first, half))
        uncut.append((chosen[at:], first + half, n - half))
    return part


def _in_turn(place: Array, n_parts: int) -> Ints:
    """The part ``(n,)`` of each cell, cut along its ``place`` ``(n,)`` into parts of as many cells
    each."""
    n = len(place)
    part = np.empty(n, dtype=np.int32)
    part[np.argsort(place, kind="stable")] = np.arange(n) * n_parts // max(n, 1)
    return part

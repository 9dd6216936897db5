"""From a gmsh model to a dolfinx mesh, cut in sectors for the ranks."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
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

from archord.geometry.basis import Array, cell_kind
from archord.geometry.meshes.mesh_cache import kept_mesh
from archord.geometry.meshes.plane_mesh import PlaneMesh, sides_between, sides_of
from archord.geometry.meshes.refine import Circle, on_circles
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.kernels.compat import cell_nodes

Cut = Callable[[Array, np.ndarray, int], np.ndarray]

# gmsh's number of the recombination that leaves no triangles; it halves the edges of all lines
_ALL_QUADS = 3


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
) -> TaggedMesh:
    """Mesh what ``build(gmsh)`` describes, in triangles or ``quads`` of the given ``order``, and
    distribute it over ``comm``.

    The cells are cut in four ``refinements`` times before they get nodes of higher order. All nodes
    of ``circles`` are put on them; other second-order edges are straight. An error on rank 0 is
    raised on every rank. The sets have the names of gmsh's physical groups. ``partitioner``
    replaces `sectors`. A mesh whose ``key`` says all that enters it is kept (`kept_mesh`). What has
    a mesh already is taken by `read_mesh`.
    """
    made: PlaneMesh | None = None
    failure: Exception | None = None
    if comm.rank == 0:
        make = partial(_made, build, circles, order, refinements, quads)
        try:
            made = kept_mesh((*key, order, refinements, quads), make) if key else make()
        except ModuleNotFoundError as error:  # raised on all ranks below, as what follows
            failure = error
        except Exception as error:
            failure = RuntimeError(f"gmsh could not mesh the problem: {error}")
    if failure := comm.bcast(failure):
        raise failure
    return distribute(comm, made, partitioner)


def _made(
    build: Callable, circles: Sequence[Circle], order: int, refinements: int, quads: bool
) -> PlaneMesh:
    options = {
        f"MeshSize{name}": 0 for name in ("FromPoints", "FromCurvature", "ExtendFromBoundary")
    }
    options |= {"Algorithm": 6, "HighOrderOptimize": 0, "RecombineAll": quads}
    with own_gmsh() as gmsh:
        for name, value in (
            options | ({"RecombinationAlgorithm": _ALL_QUADS} if quads else {})
        ).items():
            gmsh.option.setNumber(f"Mesh.{name}", value)
        build(gmsh)
        gmsh.model.mesh.generate(2)
        for _ in range(refinements):
            gmsh.model.mesh.refine()
        if order > 2:
            gmsh.model.mesh.setOrder(order)
        mesh = PlaneMesh.from_gmsh(gmsh)
    if order == 2:  # in much less time than gmsh's setOrder
        mesh = mesh.second_order()
    mesh = on_circles(mesh, circles)
    return mesh.centred() if quads else mesh


@contextmanager
def own_gmsh() -> Iterator[Any]:
    """gmsh with its defaults and an empty model; a user's model and options come back at the
    end."""
    try:
        import gmsh
    except OSError as error:  # a library of the system is missing
        raise ModuleNotFoundError(f"gmsh cannot be loaded, {error}", name="gmsh") from None

    with TemporaryDirectory() as folder:
        in_use, options = gmsh.isInitialized(), f"{folder}/gmsh.opt"
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
    comm: MPI.Comm, made: PlaneMesh | None, partitioner=None, cut: Cut | None = None
) -> TaggedMesh:
    """The mesh that rank 0 ``made`` and its sets, on all ranks, whose own one is None; cut in
    `sectors`, if not as ``cut`` or ``partitioner`` say. Collective."""
    arrays = ("x", "cells", "bodies", "edges", "tags")
    empty = comm.bcast(made and replace(made, **{name: getattr(made, name)[:0] for name in arrays}))
    made, (cell, order) = made or empty, cell_kind(empty.cells.shape[1])

    def in_sectors(comm, n_parts: int, cell_types, cells) -> AdjacencyList_int32:
        vertices = cells[0].reshape(-1, len(basix.topology(cell)[0]))
        return AdjacencyList_int32((cut or sectors)(made.x, vertices, n_parts).reshape(-1, 1))

    partitioner = partitioner or (in_sectors if comm.size > 1 else None)
    equispaced = basix.LagrangeVariant.equispaced
    element = basix.ufl.element("P", cell, order, lagrange_variant=equispaced, shape=(2,))
    mesh = create_mesh(comm, cells=made.cells, x=made.x, e=element, partitioner=partitioner)
    number = np.asarray(mesh.topology.original_cell_index)
    cells = meshtags(
        mesh, 2, np.arange(len(number), dtype=np.int32), comm.bcast(made.bodies)[number]
    )
    edges, tags = distribute_entity_data(mesh, 1, made.edges, made.tags)
    mesh.topology.create_connectivity(1, 2)
    facets = meshtags_from_entities(mesh, 1, adjacencylist(edges), tags)
    points = comm.bcast(
        {name: made.x[nodes] for name, nodes in made.point_sets.items()} if comm.rank == 0 else None
    )
    return TaggedMesh(mesh, cells, facets, made.cell_sets, made.facet_sets, points, made.notes)


def gathered(tagged: TaggedMesh) -> PlaneMesh | None:
    """The inverse of `distribute`: the whole mesh on rank 0, None elsewhere. Collective."""
    from scipy.spatial import cKDTree  # a solve without a mesh from Python does not pay for it

    mesh, topology = tagged.mesh, tagged.mesh.topology
    node, n = np.asarray(mesh.geometry.input_global_indices), topology.index_map(2).size_local
    body = np.full(
        n + topology.index_map(2).num_ghosts, np.iinfo(np.int32).min, dtype=np.int32
    )  # without a tag
    body[tagged.cells.indices] = tagged.cells.values
    owned = tagged.facets.indices < topology.index_map(1).size_local
    facets, tags = tagged.facets.indices[owned], tagged.facets.values[owned]
    ends = (
        entities_to_geometry(mesh, 1, facets)[:, :2]
        if len(facets)
        else np.zeros((0, 2), dtype=np.int32)
    )
    try:
        number = np.asarray(topology.original_cell_index)[:n]
    except RuntimeError:  # of a submesh
        number = topology.index_map(2).local_range[0] + np.arange(n)
    cells = node[cell_nodes(mesh)[:n]]
    parts = mesh.comm.gather(
        (number, cells, body[:n], node[ends], tags, node, mesh.geometry.x[:, :2])
    )
    if parts is None:
        return None
    number, cells, body, ends, tags, node, x = map(np.concatenate, zip(*parts, strict=True))
    nodes, first = np.unique(node, return_index=True)
    cells, ends, order = (
        np.searchsorted(nodes, cells),
        np.searchsorted(nodes, ends),
        np.argsort(number),
    )
    edges = sides_of(cells)[sides_between(cells, ends)]
    points = {
        name: cKDTree(x[first]).query(places)[1] for name, places in tagged.point_sets.items()
    }
    sets = dict(tagged.cell_sets), dict(tagged.facet_sets)
    return PlaneMesh(x[first], cells[order], body[order], edges, tags, *sets, points, tagged.notes)


def sectors(x: Array, cells: np.ndarray, n_parts: int) -> np.ndarray:
    """The rank ``(n,)`` of each of the ``cells`` ``(n, k)`` with vertices ``x`` ``(m, 2)``: sectors
    around the origin, numbered from below, of as many cells each.

    Points in contact face each other along rays from there, so most pairs stay on one rank; and the
    cut is the same in every run, unlike that of a graph partitioner whose input arrives in any
    order.
    """
    return _in_turn(np.arctan2(*x[cells].mean(axis=1).T[::-1]), n_parts)


def strips(x: Array, cells: np.ndarray, n_parts: int) -> np.ndarray:
    """As `sectors`, but in strips across the mesh's longest extent: in contact wherever, points
    stay together."""
    return _in_turn(
        x[cells].mean(axis=1)[:, np.argmax(np.ptp(x, axis=0)) if len(x) else 0], n_parts
    )


def _in_turn(along: Array, n_parts: int) -> np.ndarray:
    part = np.empty(len(along), dtype=np.int32)
    part[np.argsort(along, kind="stable")] = np.arange(len(along)) * n_parts // max(len(along), 1)
    return part

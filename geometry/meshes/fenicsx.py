"""From a gmsh model to a dolfinx mesh: the one place that knows what dolfinx renamed between releases, and what it does
to the process."""

from __future__ import annotations

import signal
from collections.abc import Callable
from contextlib import suppress
from functools import partial

import basix
import basix.ufl
import numpy as np
from dolfinx.cpp.graph import AdjacencyList_int32
from dolfinx.io import distribute_entity_data
from dolfinx.mesh import create_mesh, meshtags, meshtags_from_entities
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.meshes.mesh_cache import kept_mesh
from archord.geometry.meshes.plane_mesh import PlaneMesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh

try:
    from dolfinx.la.petsc import create_vector  # dolfinx >= 0.10
except ImportError:
    from dolfinx.la import create_petsc_vector as create_vector

__all__ = ["create_vector", "gmsh_to_mesh"]


with suppress(TypeError, ValueError):  # a handler of another language, or not the main thread
    # Python's own again, which raises BrokenPipeError: dolfinx starts PETSc, whose handler ends the process with a page
    signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))


def gmsh_to_mesh(
    comm: MPI.Comm,
    build: Callable,
    adjust: Callable[[Array, int], Array] | None = None,
    *,
    order: int = 2,
    refinements: int = 0,
    partitioner=None,
    key: tuple = (),
) -> TaggedMesh:
    """Mesh what ``build(gmsh)`` describes, in triangles of the given ``order``, and distribute it over ``comm``.

    The triangles are cut in four ``refinements`` times before they get nodes of higher order.
    ``adjust(x, tag)`` moves the nodes ``x`` ``(n, 2)`` of the physical curve ``tag``; without it, second-order edges
    are straight. An error on rank 0 is raised on every rank. The sets have the names of gmsh's physical groups.
    ``partitioner`` replaces `sectors`. A mesh whose ``key`` says all that enters it is kept (`kept_mesh`).
    """
    made, failure = PlaneMesh.empty(order), None
    if comm.rank == 0:
        make = partial(_made, build, adjust, order, refinements)
        try:
            made = kept_mesh((*key, order, refinements), make) if key else make()
        except Exception as error:  # raised on all ranks below
            failure = f"gmsh could not mesh the problem: {error}"
    if failure := comm.bcast(failure):
        raise RuntimeError(failure)
    return _distribute(comm, made, order, partitioner)


def _made(build: Callable, adjust: Callable[[Array, int], Array] | None, order: int, refinements: int) -> PlaneMesh:
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        for option in ("FromPoints", "FromCurvature", "ExtendFromBoundary"):
            gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
        for name, value in (("General.Terminal", 0), ("Mesh.Algorithm", 6), ("Mesh.HighOrderOptimize", 0)):
            gmsh.option.setNumber(name, value)
        build(gmsh)
        gmsh.model.mesh.generate(2)
        for _ in range(refinements):
            gmsh.model.mesh.refine()
        if order > 2:
            gmsh.model.mesh.setOrder(order)
        mesh = PlaneMesh.from_gmsh(gmsh)
    finally:
        with suppress(Exception):
            gmsh.finalize()  # or the next mesh would start from what is left of this one
    if order == 2:  # in much less time than gmsh's setOrder
        mesh = mesh.second_order()
    if adjust is not None:
        for tag in np.unique(mesh.tags):
            nodes = np.unique(mesh.edges[mesh.tags == tag])
            mesh.x[nodes] = adjust(mesh.x[nodes], int(tag))
    return mesh


def _distribute(comm: MPI.Comm, made: PlaneMesh, order: int, partitioner) -> TaggedMesh:
    """The mesh that rank 0 ``made`` and its sets, on all ranks."""

    def in_sectors(comm, n_parts: int, cell_types, cells) -> AdjacencyList_int32:
        return AdjacencyList_int32(sectors(made.x, cells[0].reshape(-1, 3), n_parts).reshape(-1, 1))

    partitioner = partitioner or (in_sectors if comm.size > 1 else None)
    equispaced = basix.LagrangeVariant.equispaced
    element = basix.ufl.element("P", "triangle", order, lagrange_variant=equispaced, shape=(2,))
    mesh = create_mesh(comm, cells=made.cells, x=made.x, e=element, partitioner=partitioner)
    number = np.asarray(mesh.topology.original_cell_index)
    cells = meshtags(mesh, 2, np.arange(len(number), dtype=np.int32), comm.bcast(made.bodies)[number])
    edges, tags = distribute_entity_data(mesh, 1, made.edges, made.tags)
    mesh.topology.create_connectivity(1, 2)
    facets = meshtags_from_entities(mesh, 1, AdjacencyList_int32(edges), tags)
    return TaggedMesh(mesh, cells, facets, *comm.bcast((made.cell_sets, made.facet_sets)))


def sectors(x: Array, cells: np.ndarray, n_parts: int) -> np.ndarray:
    """The rank ``(n,)`` of each of the ``cells`` ``(n, k)`` with vertices ``x`` ``(m, 2)``: sectors around the origin,
    numbered from below, of as many cells each.

    Points in contact face each other along rays from there, so most pairs stay on one rank; and the cut is the same in
    every run, unlike that of a graph partitioner whose input arrives in any order.
    """
    middle = x[cells].mean(axis=1)
    order = np.argsort(np.arctan2(middle[:, 1], middle[:, 0]), kind="stable")
    part = np.empty(len(cells), dtype=np.int32)
    part[order] = np.arange(len(cells)) * n_parts // max(len(cells), 1)
    return part

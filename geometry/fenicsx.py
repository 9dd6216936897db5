"""From a gmsh model to a dolfinx mesh: the one place that knows what dolfinx renamed between releases, and what it does
to the process."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from contextlib import suppress

import basix
import basix.ufl
import numpy as np
from dolfinx.cpp.graph import AdjacencyList_int32
from dolfinx.io import distribute_entity_data
from dolfinx.mesh import create_mesh, meshtags, meshtags_from_entities
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.mesh_cache import kept_mesh
from archord.geometry.partition import sector_partitioner
from archord.geometry.plane_mesh import PlaneMesh
from archord.geometry.tagged_mesh import TaggedMesh

try:
    from dolfinx.la.petsc import create_vector  # dolfinx >= 0.10
except ImportError:
    from dolfinx.la import create_petsc_vector as create_vector

__all__ = ["create_vector", "gmsh_to_mesh"]


def _leave_broken_pipes_to_python() -> None:
    """Give SIGPIPE back to Python, which ignores it and raises `BrokenPipeError`: importing dolfinx starts PETSc, whose
    handler ends the process with a page of text where the reader of its output, like head, has seen enough."""
    before = signal.getsignal(signal.SIGPIPE)  # as Python knows it, which PETSc has not asked
    if before is not None and threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGPIPE, before)


_leave_broken_pipes_to_python()


def gmsh_to_mesh(
    comm: MPI.Comm,
    build: Callable,
    adjust: Callable[[Array, int], Array] | None = None,
    *,
    order: int = 2,
    scale: float = 1.0,
    refinements: int = 0,
    partitioner=None,
    key: tuple = (),
) -> TaggedMesh:
    """Mesh what ``build(gmsh)`` describes, in triangles of the given ``order``, and distribute it over ``comm``.

    The triangles are cut in four ``refinements`` times before they get nodes of higher order.
    ``adjust(x, tag)`` moves the nodes ``x`` ``(n, 2)`` of the physical curve ``tag``; without it, second-order edges
    are straight. The mesh is scaled by ``scale`` at the end. An error on rank 0 is raised on every rank. Its sets
    have the names of gmsh's physical groups. ``partitioner`` replaces `sector_partitioner`.
    ``key`` says all that enters ``build`` and ``adjust``; `kept_mesh` gives the same mesh again.
    """
    made, failure = PlaneMesh.empty(order), None
    if comm.rank == 0:
        drawn = build, adjust, order, refinements
        try:
            made = kept_mesh((*key, order, refinements), lambda: _made(*drawn)) if key else _made(*drawn)
        except Exception as error:  # raised on all ranks below
            failure = f"gmsh could not mesh the problem: {error}"
    failure = comm.bcast(failure)
    if failure:
        raise RuntimeError(failure)
    mesh = _distribute(comm, made, order, partitioner)
    mesh.mesh.geometry.x[:] *= scale
    return mesh


def _made(build: Callable, adjust: Callable[[Array, int], Array] | None, order: int, refinements: int) -> PlaneMesh:
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
            gmsh.option.setNumber(f"Mesh.{option}", 0)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        gmsh.option.setNumber("Mesh.HighOrderOptimize", 0)
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
        mesh.adjust(adjust)
    return mesh


def _distribute(comm: MPI.Comm, made: PlaneMesh, order: int, partitioner) -> TaggedMesh:
    """The mesh that rank 0 ``made`` and its sets, on all ranks."""
    if partitioner is None and comm.size > 1:
        partitioner = sector_partitioner(lambda: made.x)
    equispaced = basix.LagrangeVariant.equispaced
    element = basix.ufl.element("P", "triangle", order, lagrange_variant=equispaced, shape=(2,))
    mesh = create_mesh(comm, cells=made.cells, x=made.x, e=element, partitioner=partitioner)
    number = np.asarray(mesh.topology.original_cell_index)
    cells = meshtags(mesh, 2, np.arange(len(number), dtype=np.int32), comm.bcast(made.bodies)[number])
    edges, tags = distribute_entity_data(mesh, 1, made.edges, made.tags)
    mesh.topology.create_connectivity(1, 2)
    facets = meshtags_from_entities(mesh, 1, AdjacencyList_int32(edges), tags)
    return TaggedMesh(mesh, cells, facets, *comm.bcast((made.cell_sets, made.facet_sets)))

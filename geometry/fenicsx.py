"""From a gmsh model to a dolfinx mesh: the one place that knows what dolfinx renamed between releases, and what it does
to the process."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from contextlib import suppress

import numpy as np
from dolfinx.mesh import Mesh, MeshTags
from mpi4py import MPI

from archord.geometry.mesh_cache import MESHES, Answers
from archord.geometry.partition import sector_partitioner

try:
    from dolfinx.io.gmsh import extract_geometry, model_to_mesh  # dolfinx >= 0.10
except ImportError:
    from dolfinx.io.gmshio import extract_geometry, model_to_mesh
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
    adjust: Callable[[np.ndarray, int], np.ndarray] | None = None,
    *,
    order: int = 2,
    scale: float = 1.0,
    refinements: int = 0,
    partitioner=None,
    key: tuple = (),
) -> tuple[Mesh, MeshTags, MeshTags]:
    """Mesh what ``build(gmsh)`` describes, in triangles of the given ``order``, and distribute it over ``comm``.

    The triangles are cut in four ``refinements`` times before they are curved.
    ``adjust(x, tag)`` may move the nodes ``x`` ``(n, 3)`` of the physical curve ``tag``; the mesh is scaled by
    ``scale`` at the end. An error on rank 0 is raised on every rank. Returns mesh, cell tags and facet tags.
    ``partitioner`` replaces `sector_partitioner`.
    ``key`` says all that enters ``build`` and ``adjust``; a mesh that `MESHES` keeps by the same key is used again.
    """
    model, failure = None, None
    known = MESHES.find((*key, order, refinements)) if comm.rank == 0 and key else None
    if comm.rank == 0 and known is None:
        try:
            import gmsh

            gmsh.initialize(readConfigFiles=False, interruptible=False)
            for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
                gmsh.option.setNumber(f"Mesh.{option}", 0)
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.option.setNumber("Mesh.Algorithm", 6)
            gmsh.option.setNumber("Mesh.HighOrderOptimize", 0)
            build(gmsh)
            gmsh.model.mesh.generate(2)
            for _ in range(refinements):
                gmsh.model.mesh.refine()
            gmsh.model.mesh.setOrder(order)
            if adjust is not None:
                _adjust(gmsh, adjust)
            model = gmsh.model
        except Exception as error:  # raised on all ranks below
            failure = f"gmsh could not mesh the joint: {error}"
            with suppress(Exception):
                gmsh.finalize()  # or the next mesh would start from what is left of this one
    failure = comm.bcast(failure)
    if failure:
        raise RuntimeError(failure)
    asked = model if model is None or not (key and MESHES.capacity) else Answers(model)
    asked = known if known is not None else asked
    if partitioner is None and comm.size > 1:
        partitioner = sector_partitioner(lambda: extract_geometry(asked))
    result = model_to_mesh(asked, comm, 0, gdim=2, partitioner=partitioner)
    mesh, cells, facets = tuple(result)[:3]
    if model is not None:
        gmsh.finalize()
        if isinstance(asked, Answers):
            MESHES.keep((*key, order, refinements), asked)
    mesh.geometry.x[:] *= scale
    return mesh, cells, facets


def _adjust(gmsh, adjust: Callable[[np.ndarray, int], np.ndarray]) -> None:
    for dim, tag in gmsh.model.getPhysicalGroups(1):
        nodes, x = gmsh.model.mesh.getNodesForPhysicalGroup(dim, tag)
        x = x.reshape(-1, 3)
        moved = adjust(x, tag)
        for i in np.flatnonzero((moved != x).any(axis=1)):
            gmsh.model.mesh.setNode(nodes[i], moved[i], [])

"""Meshes from files, from gmsh and from dolfinx, with the names of their sets."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any, NoReturn

import numpy as np
from dolfinx.mesh import Mesh, MeshTags, meshtags
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import distribute, gathered, own_gmsh, strips
from archord.geometry.meshes.formats import step
from archord.geometry.meshes.formats.abaqus import read_abaqus
from archord.geometry.meshes.formats.step import Sizes
from archord.geometry.meshes.formats.xdmf import read_xdmf
from archord.geometry.meshes.mesh_arrays import (
    MeshArrays,
    coordinates,
    gmsh_dimension,
    require_known,
)
from archord.geometry.meshes.quality import faults
from archord.geometry.meshes.refine import Circle, refined
from archord.geometry.meshes.stored import store_mesh, stored_mesh
from archord.geometry.meshes.tagged_mesh import Sets, TaggedMesh
from archord.report.readable import require_file

_HEADERS = (b"$MeshFormat", b"$NOD", b"$Comments")
_NAMED = re.compile(rb"\$PhysicalNames\s+\d+\s+(.*?)\$EndPhysicalNames", re.DOTALL)
Source = str | Path | ModuleType | TaggedMesh


def read_mesh(
    source: Source,
    comm: MPI.Comm,
    *,
    scale: float = 1.0,
    order: int | None = None,
    circles: Sequence[Circle] = (),
    refine: int = 0,
    sizes: Sizes | None = None,
    sets: Mapping[str, Sequence[str]] | None = None,
) -> TaggedMesh:
    """The mesh of ``source`` times ``scale``, `refined` with ``circles`` in scaled lengths, on the
    ranks of ``comm``.

    A source is a .msh file of gmsh, an .inp file of Abaqus or CalculiX, an .xdmf file of dolfinx,
    an .npz file of archord, a STEP or BREP file of CAD, which is meshed with elements of these
    ``sizes``, the module gmsh with a model on rank 0, or a mesh as `tagged` returns it. New facet
    ``sets`` are made of others. Sets have the names of physical groups, of sets and surfaces, or
    the values of tags. Collective; raises ValueError on all ranks for what is no mesh of cells of
    one kind.
    """
    made: Any = gathered(source) if isinstance(source, TaggedMesh) else None
    failure = ""
    if comm.rank == 0:
        name = str(source) if isinstance(source, str | Path) else "the mesh"
        try:
            if not isinstance(source, TaggedMesh):
                made = _read(source, order or 2, sizes or Sizes())
            made = replace(made, x=made.x * scale).with_sets(sets or {})
            made = refined(made, refine, order, circles)
            failure = next(iter(faults(made)), "")
        except Exception as error:  # whatever a damaged file makes of it, raised on all ranks below
            failure = getattr(error, "strerror", None) or str(error) or type(error).__name__
            if not isinstance(error, ValueError | OSError):
                failure = f"cannot be read as a mesh: {failure}"
        failure = failure and f"{name}: {failure}"
    if failure := comm.bcast(failure):
        raise ValueError(failure)
    return distribute(comm, made, cut=strips)


def arrays_of(source: Source, comm: MPI.Comm, order: int | None, sizes: Sizes) -> MeshArrays | None:
    """The mesh of ``source``, of this ``order`` where a model is yet to be meshed: on rank 0, None
    elsewhere. Collective for a mesh of dolfinx; raises what a damaged file makes of it."""
    if isinstance(source, TaggedMesh):
        return gathered(source)
    return _read(source, order or 2, sizes) if comm.rank == 0 else None


def dimension_of_source(source: Any) -> int:
    """Dimension of the cells of a `Source`, or of (mesh, cells, facets); 2 for what cannot be
    read."""
    if isinstance(source, tuple):
        return source[0].topology.dim
    if isinstance(source, TaggedMesh):
        return source.dimension
    try:
        if isinstance(source, ModuleType):
            return gmsh_dimension(source)
        named = _NAMED.search(Path(source).read_bytes())
        if Path(source).suffix.lower() == ".msh" and named:
            return 3 if re.search(rb"^3 ", named[1], re.MULTILINE) else 2
        if Path(source).suffix.lower() in step.SUFFIXES:
            return 3
        return _read(source, 1, Sizes()).dimension
    except Exception:  # whatever a damaged file makes of it is raised where it is used
        return 2


def tagged(
    mesh: Mesh,
    cells: MeshTags | None = None,
    facets: MeshTags | None = None,
    cell_sets: Mapping[str, int] | None = None,
    facet_sets: Mapping[str, int] | None = None,
) -> TaggedMesh:
    """A dolfinx ``mesh`` with its tags, named by ``cell_sets`` and ``facet_sets`` or else by their
    numbers; without tags, all cells are "all". Collective; raises ValueError on all ranks for
    tags of another dimension, and for triangles and quadrilaterals that do not lie in a plane."""
    dim = mesh.topology.dim
    fitting = dim in (2, 3)
    fitting &= cells is None or cells.dim == dim
    fitting &= facets is None or facets.dim == dim - 1
    if not fitting:
        raise ValueError(
            "the mesh and the tags of its cells must be of dimension 2, the tags of facets of "
            "dimension 1; or of 3 and 2"
        )
    require_known([mesh.basix_cell().name])
    coordinates(np.concatenate(mesh.comm.allgather(mesh.geometry.x)), dim)
    mesh.topology.create_connectivity(dim - 1, dim)
    if cells is None:
        index_map = mesh.topology.index_map(dim)
        every = np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
        cells = meshtags(mesh, dim, every, np.ones(len(every), dtype=np.int32))
        cell_sets = {"all": 1}
    if facets is None:
        none = np.zeros(0, dtype=np.int32)
        facets = meshtags(mesh, dim - 1, none, none)
    return TaggedMesh(
        mesh,
        cells,
        facets,
        _named(mesh.comm, cells, cell_sets),
        _named(mesh.comm, facets, facet_sets),
    )


def _named(comm: MPI.Comm, tags: MeshTags, names: Mapping[str, int] | None) -> Sets:
    """Sets by the ``names`` of values of ``tags``, or by the values where there are no names.
    Collective."""
    here = set(tags.values.tolist())
    values = set().union(*comm.allgather(here))
    names = names or {str(value): value for value in sorted(values)}
    return {name: (tag,) if tag in values else () for name, tag in names.items()}


def _read(source: str | Path | ModuleType, order: int, sizes: Sizes) -> MeshArrays:
    if isinstance(source, ModuleType):
        d = gmsh_dimension(source)
        if not len(source.model.mesh.getElementTypes(d)):
            source.model.mesh.generate(d)
            source.model.mesh.setOrder(order)
        return MeshArrays.from_gmsh(source)
    path = Path(source)
    readers = {
        ".msh": _read_gmsh,
        ".inp": read_abaqus,
        ".xdmf": read_xdmf,
        ".npz": stored_mesh,
    }
    readers |= dict.fromkeys(step.SUFFIXES, partial(_mesh_solids, order=order, sizes=sizes))
    if path.suffix.lower() not in readers:
        raise ValueError(f"is none of the files of meshes that are read: {', '.join(readers)}")
    with require_file(path).open("rb"):
        pass  # or gmsh would say something else of a file that cannot be read
    if not path.stat().st_size:
        raise ValueError("is empty")
    return readers[path.suffix.lower()](path)


def _mesh_solids(path: Path, order: int, sizes: Sizes) -> MeshArrays:
    """The mesh of solids of CAD."""

    def build(gmsh) -> None:
        step.mesh_step(gmsh, path, order, sizes)

    return _apart(build)


def _read_gmsh(path: Path) -> MeshArrays:
    """The mesh of a file of gmsh."""
    with path.open("rb") as file:
        if not file.read(20).startswith(_HEADERS):  # gmsh would run it as a script
            raise ValueError("is no mesh of gmsh: it must begin with $MeshFormat")
    return _apart(lambda gmsh: gmsh.merge(str(path)))


def _apart(build: Callable[[Any], None]) -> MeshArrays:
    """The mesh that ``build(gmsh)`` makes in a process of its own, as gmsh ends the process on some
    damaged files."""
    with TemporaryDirectory() as folder:
        found = Path(folder) / "mesh.npz"
        said = Path(folder) / "error"
        # not by multiprocessing, whose daemons, as the workers of a pool, may have no children
        child = os.fork()
        if child == 0:
            _build(build, found, said)
        _, status = os.waitpid(child, 0)
        if said.exists():
            raise ValueError(said.read_text(encoding="utf-8"))
        if status != 0:
            raise ValueError("gmsh fails on this file, which must be damaged")
        return stored_mesh(found)


def _build(build: Callable[[Any], None], found: Path, said: Path) -> NoReturn:
    """Write the mesh that ``build(gmsh)`` makes to ``found``, or to ``said`` why there is none, and
    end the process."""
    status = 1
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for stream in (1, 2):  # where the C library tells of a damaged heap
            os.dup2(nowhere, stream)
        for number in (signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGABRT):
            signal.signal(number, signal.SIG_DFL)  # PETSc's handler would end all ranks
        with own_gmsh() as gmsh:
            build(gmsh)
            mesh = MeshArrays.from_gmsh(gmsh)
        with found.open("wb") as file:
            store_mesh(mesh, file)
        status = 0
    except Exception as error:  # of gmsh
        said.write_text(str(error) or "gmsh cannot read this file", encoding="utf-8")
    finally:
        os._exit(status)

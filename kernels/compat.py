"""What differs where archord runs: dolfinx 0.9 to 0.11 and PETSc 3.22 to 3.25, of Debian, conda or
PyPI. What uses dolfinx imports this first."""

from __future__ import annotations

import ctypes
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

if find_spec("dolfinx_solver"):
    import dolfinx_solver  # noqa: F401  (PyPI's dolfinx finds its MPI through it)

import dolfinx
import numpy as np
from dolfinx import fem
from dolfinx.common import IndexMap
from dolfinx.mesh import Geometry, Mesh
from mpi4py import MPI
from petsc4py import PETSc

from archord.report.by_name import Words

with suppress(TypeError, ValueError):  # a handler of another language, or not the main thread
    # Python's own again, which raises BrokenPipeError: dolfinx starts PETSc, whose handler ends the
    # process with a page
    signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))

# numbers of parameters in malloc.h
_TRIM_THRESHOLD = -1
_MMAP_THRESHOLD = -3
_MMAP_MAX = -4
_MOST_MAPPED = 2**16  # arrays that are mapped at once: glibc's own default
_LARGE = 32 * 2**20  # bytes: glibc takes no larger threshold


def _give_memory_back() -> None:
    """Let the memory of freed arrays go back to the system, the large ones' at once. SuperLU_DIST,
    which Debian's PETSc loads, has glibc keep it until the process ends."""
    with suppress(AttributeError, OSError):  # another C library
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_MMAP_MAX, _MOST_MAPPED)
        mallopt(_MMAP_THRESHOLD, _LARGE)
        mallopt(_TRIM_THRESHOLD, 2 * _LARGE)


_give_memory_back()

_REASONS = vars(PETSc.SNES.ConvergedReason)
RESIDUAL_NOT_FINITE = _REASONS.get(
    "DIVERGED_FNORM_NAN", _REASONS.get("DIVERGED_FUNCTION_NANORINF")
)  # until PETSc 3.24
_KINDS = hasattr(Geometry, "dofmaps")  # of cells; dolfinx from 0.11 on may have several in a mesh

_ENTITY_MAPS = hasattr(dolfinx.mesh, "EntityMap")  # as objects, from 0.10 on

# of Debian (gmsh needs it), of conda on Linux and macOS, and beside PyPI's dolfinx
_FOLDERS = ("", f"{sys.prefix}/lib/", f"{Path(dolfinx.__file__).parents[1]}/dolfinx_solver/lib/")
METIS = tuple(
    folder + name
    for folder in _FOLDERS
    for name in ("libmetis.so.5", "libmetis.so", "libmetis.dylib")
)


def cell_nodes(mesh: Mesh) -> np.ndarray:
    """The nodes ``(n, a)`` of the cells of a ``mesh``."""
    return mesh.geometry.dofmaps[0] if _KINDS else mesh.geometry.dofmap


def cell_degree(mesh: Mesh) -> int:
    """The polynomial degree of the cells of a ``mesh``."""
    return (mesh.geometry.cmaps[0] if _KINDS else mesh.geometry.cmap).degree


def ghosted_vector(index_map: IndexMap, components: int) -> PETSc.Vec:
    """A vector with so many ``components`` at every index. Collective."""
    sizes = components * index_map.size_local, components * index_map.size_global
    ghosts = index_map.ghosts.astype(PETSc.IntType)
    return PETSc.Vec().createGhost(ghosts, sizes, bsize=components, comm=index_map.comm)


def cell_form(
    V: fem.FunctionSpace,
    kernel: int,
    cells: np.ndarray,
    functions: Sequence[fem.Function],
    constants: Sequence[fem.Constant],
) -> fem.Form:
    """The bilinear form in ``V`` over ``cells`` of the C function at the address ``kernel``, of
    ``functions`` and ``constants``."""
    used = np.arange(len(functions), dtype=np.int8)
    form = fem.form_cpp_class(np.float64)(
        [V._cpp_object] * 2,
        {fem.IntegralType.cell: [(0, kernel, cells.astype(np.int32), used)]},
        [function._cpp_object for function in functions],
        [constant._cpp_object for constant in constants],
        False,
        [] if _ENTITY_MAPS else {},
        V.mesh._cpp_object,
    )
    return fem.Form(form)


def versions() -> Words:
    """The releases of dolfinx, PETSc and MPI."""
    mpi = MPI.Get_library_version().partition("\n")[0].partition(",")[0]
    return {
        "dolfinx": dolfinx.__version__,
        "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
        "mpi": " ".join(mpi.split()),
    }

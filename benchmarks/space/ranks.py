"""What ranks hold and exchange in a joint in space, as a table: ``mpirun -n 3 python3 -m
archord.benchmarks.space.ranks``; and the parts for more ranks than there are, as another table:
``python3 -m archord.benchmarks.space.ranks --parts``.

A name of a case chooses it, numbers are sizes of elements at the contact: ``mpirun -n 3 python3 -m
archord.benchmarks.space.ranks A 1.2 0.9``. One linear system is solved, in the first state of the
joint. Columns are of the rank that has most:

- own: displacements that the rank owns
- ghosts: displacements of other ranks to which its rows refer, contact included
- ranks met: ranks that own them, and so messages of an exchange
- contact: nodes of contact surfaces, which every rank holds
- places: blocks that contact may fill, of all ranks together
- matrix [MB]: of the displacements
- peak [MB]: memory of the process, with the making of the mesh on rank 0
- levels: below the displacements: their displacements on all ranks

Parts are of the mesh alone, cut in sectors and in boxes; contact adds to what is shared:

- own: displacements of the part, where shared ones are of the part with the lowest number
- shared: displacements of the part that are of other parts, too
- parts met: with which it shares displacements
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Iterator, Sequence

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from archord.benchmarks.case import named
from archord.benchmarks.space.joints import CASES
from archord.geometry.meshes.cells import n_corners
from archord.geometry.meshes.fenicsx import boxes, gathered, sectors
from archord.kernels.blocks import blocks_of
from archord.materials.kinematics import Ints
from archord.report.table import Table
from archord.solver.linear.multigrid import Multigrid
from archord.solver.path.system import System
from archord.solver.problem import Problem

_HEADINGS = (
    "ranks",
    "dofs",
    "own",
    "ghosts",
    "ranks met",
    "contact",
    "places",
    "matrix [MB]",
    "peak [MB]",
    "levels",
)
_OF_PARTS = "--parts"
_PARTS_HEADINGS = ("cut", "parts", "dofs", "own", "shared", "parts met")
_PARTS = 2, 3, 16, 256
_MB = 1e6
_KB = 1024  # unit of the peak


def row(system: System) -> list[str]:
    """The row of a ``system``. Collective."""
    linear = system.equilibrium.linear
    system.equilibrium.evaluate()
    linear.update()
    strategy = linear.strategy
    if not isinstance(strategy, Multigrid):
        raise TypeError("the joint is too small, or driven by a force: no multigrid solves it")
    solver = PETSc.KSP().create(system.comm)
    strategy.attach(solver)
    solver.setUp()

    A = strategy.matrix
    d = A.getBlockSize()
    ghosts = blocks_of(A)[2]
    ends = np.array(A.getOwnershipRanges()) // d
    owners = np.unique(np.searchsorted(ends, ghosts, side="right"))
    info = A.getInfo(PETSc.Mat.InfoType.LOCAL)
    bytes_held = (8 + 4 / d**2) * info["nz_allocated"]
    peak = _KB * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    here = np.array([A.getLocalSize()[0], d * len(ghosts), len(owners), bytes_held / _MB])
    here = np.append(here, peak / _MB)
    own, ghost, met, matrix, largest = np.max(system.comm.allgather(here), axis=0)
    on_surfaces = sum(len(surface.curve_dofs) for surface in system.contact.surfaces)
    places = system.comm.allreduce(len(system.contact.tangent.rows))
    counts = system.comm.size, system.n_dofs, own, ghost, met, on_surfaces, places
    levels = " ".join(str(size) for size in strategy.level_sizes())
    return [*(f"{count:.0f}" for count in (*counts, matrix, largest)), levels]


def rows_of_parts(problem: Problem) -> Iterator[tuple[str | int, ...]]:
    """The rows of the mesh of a ``problem`` on one rank, cut into parts."""
    made = gathered(problem.mesh)
    assert made is not None
    corners = made.cells[:, : n_corners(made.kind)]
    d = made.dimension
    for cut in (sectors, boxes):
        for n_parts in _PARTS:
            part = cut(made.x, corners, n_parts)
            counts = (d * count for count in _own_and_shared(made.cells, part, n_parts))
            own, shared, met = counts
            yield cut.__name__, n_parts, d * len(made.x), own, shared, met // d


def _own_and_shared(cells: Ints, part: Ints, n_parts: int) -> tuple[int, int, int]:
    """The largest numbers of own and of shared nodes of the parts of ``cells`` ``(n, k)``, and of
    other parts with which they are shared."""
    pairs = np.unique(cells * n_parts + part[:, None])
    node, holder = np.divmod(pairs, n_parts)
    _, first, count = np.unique(node, return_index=True, return_counts=True)
    own = np.bincount(holder[first], minlength=n_parts)
    is_shared = np.repeat(count > 1, count)
    shared = np.bincount(holder[is_shared], minlength=n_parts)
    of_parts = sp.coo_array((np.ones(len(pairs)), (node, holder))).tocsr()
    met = np.diff((of_parts.T @ of_parts).tocsr().indptr) - 1
    return int(own.max()), int(shared.max()), int(met.max())


def main(arguments: Sequence[str]) -> None:
    """Print the table of the case and the sizes that the ``arguments`` name."""
    of_parts = _OF_PARTS in arguments
    names, sizes = named([word for word in arguments if word != _OF_PARTS], CASES)
    table = Table(*(_PARTS_HEADINGS if of_parts else _HEADINGS))
    for size in sizes or [1.2, 0.9, 0.7]:
        problem = CASES[names[0] if names else "elastic"].problem(size)
        for cells in rows_of_parts(problem) if of_parts else [row(System(problem))]:
            table.add(*cells)
    if MPI.COMM_WORLD.rank == 0:
        print(table)


if __name__ == "__main__":
    main(sys.argv[1:])

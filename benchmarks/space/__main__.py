"""Joints in space against other codes, as a table: ``python3 -m archord.benchmarks.space``.

Names of cases choose among them, numbers are sizes of elements at the contact: ``python3 -m
archord.benchmarks.space elastic A 1.5 0.9``. Seconds are of the mesh and the solve, MB the most
memory of this process so far.

With ``--calculix`` CalculiX solves them on the same meshes, where the image target peers is there:
``ARCHORD_TARGET=peers docker/run python3 -m archord.benchmarks.space --calculix elastic 3``. Its
seconds are of its process alone, and what only archord's results tell is missing.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from mpi4py import MPI

from archord.benchmarks.space.calculix import solved_by_calculix
from archord.benchmarks.space.case import Solved, solved
from archord.benchmarks.space.joints import CASES
from archord.output.run_json import peak_memory
from archord.report.table import Table

_HEADINGS = ("case", "quantity", "at", "reference", "+-")
_OTHER = "--calculix"
_COST = ("error [%]", "dofs", "Newton", "GMRES", "s", "MB")


def rows(result: Solved) -> Iterator[tuple[str, ...]]:
    """The rows of a table for a ``result``."""
    newton = f"{result.newton / result.case.steps:.1f}"
    krylov = f"{result.krylov / max(result.newton, 1):.1f}"
    cost = (
        str(result.n_dofs),
        newton,
        krylov,
        f"{result.seconds:.1f}",
        f"{peak_memory() / 1e6:.0f}",
    )
    for reference, value in result.compared:
        yield (
            result.case.name,
            reference.quantity,
            f"{reference.displacement:g}",
            f"{reference.value:.6g}",
            f"{reference.uncertainty:g}",
            f"{value:.6g}",
            f"{100 * (value / reference.value - 1):+.3f}",
            *cost,
        )


def main(arguments: Sequence[str]) -> None:
    """Print the table of the cases and sizes that the ``arguments`` name, of all cases on their own
    sizes without."""
    chosen = [CASES[name] for name in arguments if name in CASES] or list(CASES.values())
    sizes = [float(size) for size in arguments if size not in (*CASES, _OTHER)] or [0.0]
    solve = solved_by_calculix if _OTHER in arguments else solved
    table = Table(*_HEADINGS, "CalculiX" if _OTHER in arguments else "archord", *_COST, left=2)
    for case in chosen:
        for size in sizes:
            for row in rows(solve(case, size)):
                table.add(*row)
    if MPI.COMM_WORLD.rank == 0:
        print(table)


if __name__ == "__main__":
    main(sys.argv[1:])

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
from itertools import product

from mpi4py import MPI

from archord.benchmarks.case import named
from archord.benchmarks.space.calculix import solved_by_calculix
from archord.benchmarks.space.case import Solved, solved
from archord.benchmarks.space.joints import CASES
from archord.output.run_json import peak_memory
from archord.report.table import Table

_HEADINGS = ("case", "quantity", "at", "reference", "+-")
_OTHER = "--calculix"
_CODES = {"archord": solved, "CalculiX": solved_by_calculix}
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
    for compared in result.compared:
        reference = compared.reference
        yield (
            result.case.name,
            reference.quantity,
            f"{reference.displacement:g}",
            f"{reference.value:.6g}",
            f"{reference.uncertainty:g}",
            f"{compared.value:.6g}",
            f"{100 * compared.error:+.3f}",
            *cost,
        )


def main(arguments: Sequence[str]) -> None:
    """Print the table of the cases and sizes that the ``arguments`` name, of all cases on their own
    sizes without."""
    chosen, sizes = named([word for word in arguments if word != _OTHER], CASES)
    code = "CalculiX" if _OTHER in arguments else "archord"
    table = Table(*_HEADINGS, code, *_COST, left=2)
    for name, size in product(chosen or CASES, sizes or [0.0]):
        for row in rows(_CODES[code](CASES[name], size)):
            table.add(*row)
    if MPI.COMM_WORLD.rank == 0:
        print(table)


if __name__ == "__main__":
    main(sys.argv[1:])

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

_HEADINGS = ("case", "quantity", "at {:g}", "reference {:.6g}", "+- {:g}")
_OTHER = "--calculix"
_CODES = {"archord": solved, "CalculiX": solved_by_calculix}
_COST = ("error [%] {:+.3f}", "dofs", "Newton {:.1f}", "GMRES {:.1f}", "s {:.1f}", "MB {:.0f}")


def rows(result: Solved) -> Iterator[tuple[object, ...]]:
    """The rows of a table for a ``result``."""
    newton = result.newton / result.case.steps
    krylov = result.krylov / max(result.newton, 1)
    cost = (result.n_dofs, newton, krylov, result.seconds, peak_memory() / 1e6)
    for compared in result.compared:
        *known, _ = compared.reference
        yield (result.case.name, *known, compared.value, 100 * compared.error, *cost)


def main(arguments: Sequence[str]) -> None:
    """Print the table of the cases and sizes that the ``arguments`` name, of all cases on their own
    sizes without."""
    chosen, sizes = named([word for word in arguments if word != _OTHER], CASES)
    code = "CalculiX" if _OTHER in arguments else "archord"
    table = Table(*_HEADINGS, f"{code} {{:.6g}}", *_COST, left=2)
    for name, size in product(chosen or CASES, sizes or [0.0]):
        for row in rows(_CODES[code](CASES[name], size)):
            table.add(*row)
    if MPI.COMM_WORLD.rank == 0:
        print(table)


if __name__ == "__main__":
    main(sys.argv[1:])

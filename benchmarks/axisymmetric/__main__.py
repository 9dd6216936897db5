"""Axisymmetric problems against closed forms and other codes, as a table: ``python3 -m
archord.benchmarks.axisymmetric``. Every mesh of this table has at most 3000 nodes.

With ``--calculix`` archord and CalculiX solve the ring and the punch on the same meshes of second
order (CAX8, CAX6), each twice as fine as the one before. The stored values of CalculiX are printed
so by CalculiX 2.20 of the image target peers: ``ARCHORD_TARGET=peers docker/run python3 -m
archord.benchmarks.axisymmetric --calculix``. With ``--deep`` the ball that is pressed deep into a
half-space is solved with finer elements, with less elasticity, and at small strain.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import perf_counter

from archord.benchmarks.axisymmetric import balls, punch, ring, thick_walls
from archord.benchmarks.axisymmetric.case import Case, Study, solved
from archord.benchmarks.peers.calculix import process
from archord.benchmarks.timing import run_once
from archord.output.folder import MESH
from archord.presets.words import words_of
from archord.report.table import Table

STUDIES = (ring.STUDY, punch.STUDY)
CASES = (*thick_walls.CASES, *balls.CASES, *(study.case() for study in STUDIES))
FINER = (1, 2, 4)


def rows(case: Case) -> Iterator[tuple[object, ...]]:
    """Solve a ``case``; its rows of the table."""
    start = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        run = solved(case.problem(), Path(folder))
        seconds = perf_counter() - start
        nodes = len(run.fields().coordinates)
        found = list(case.compare(run))
    iterations = round(sum(run.columns["iterations"]))
    cost = (2 * nodes, nodes, iterations, seconds)
    for what, reference, by, ours in found:
        yield (case.name, what, reference, by, ours, ours / reference - 1, *cost)


def study_rows(study: Study, finer: int) -> Iterator[tuple[object, ...]]:
    """Solve a ``study`` by archord and by CalculiX on one mesh; the rows of the table."""
    problem = study.problem(finer)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fields = solved(problem, folder).fields()
        calculix = process(words_of(problem, str(folder / MESH)), folder / "calculix", problem)
        theirs = run_once(calculix).result
    for place in study.places:
        ours = place.read(fields.coordinates, fields.displacement)
        other = place.read(theirs.mesh.x, theirs.displacement)
        yield (study.name, place.what, len(theirs.mesh.x), ours, other, ours / other - 1)


def main(arguments: Sequence[str]) -> None:
    """Solve all cases, or with ``--calculix`` the studies, or with ``--deep`` the deep ball, and
    print the table."""
    ours = "archord {:.6g}"
    off = "relative difference {:+.2%}"
    if "--calculix" in arguments:
        table = Table("case", "quantity", "nodes", ours, "CalculiX {:.6g}", off)
        found = (row for study in STUDIES for finer in FINER for row in study_rows(study, finer))
    else:
        headings = ["case", "quantity", "reference {:.6g}", "by", ours, off]
        table = Table(*headings, "dofs", "nodes", "iterations", "seconds {:.1f}")
        cases = balls.DEEP if "--deep" in arguments else CASES
        found = (row for case in cases for row in rows(case))
    for row in found:
        table.add(*row)
    print(table.markdown())


if __name__ == "__main__":
    main(sys.argv[1:])

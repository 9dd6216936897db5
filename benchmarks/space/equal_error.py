"""Error of the force over seconds, archord beside CalculiX on the same meshes in space:
``ARCHORD_TARGET=peers docker/run python3 -m archord.benchmarks.space.equal_error``.

Both solve what a mesh file and a scene or a deck hold: whole processes, one thread each, by turns.
Seconds are of the processor, because other work on the machine counts less there. The last row of a
case has the quickest mesh of each code whose error is within the goal's. Names of cases and sizes
of elements change what is solved: ``... elastic 3 2``. ``--into FOLDER`` draws the points, by their
wall time, into the picture of ``archord benchmark work-precision`` in this folder.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from archord.benchmarks.case import named
from archord.benchmarks.peers.calculix import process
from archord.benchmarks.space.case import PRESS, Case
from archord.benchmarks.space.joints import CASES
from archord.benchmarks.timing import Process, solving, time_all
from archord.benchmarks.work_precision_picture import STEM, cases, draw
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.stored import store_mesh
from archord.postprocess.run import Run
from archord.presets.words import words_of
from archord.report.files import write_rows
from archord.report.table import Table
from archord.scene.file import resolved

CODES = ("archord", "CalculiX")
LIMIT = 600.0  # seconds of a process, on the clock
SIZES = (3.0, 2.2, 1.6, 1.2)
_MESH = "joint.npz"


@dataclass(frozen=True)
class Goal:
    """The error at which seconds are compared, how many times fewer archord's shall be, and what
    the case is called in pictures."""

    error: float
    times: float
    panel: str


GOALS = {
    "elastic": Goal(5e-4, 10.0, "space_elastic"),
    "A": Goal(4e-3, 8.0, "space_plastic"),
}


@dataclass(frozen=True)
class Point:
    """Seconds of the processor and relative ``error`` of the last force on one mesh, none and
    infinite of a process that did not end, as its ``failure`` says; and its ``wall`` time and
    largest ``memory`` in bytes."""

    size: float
    n_dofs: int
    seconds: float = 0.0
    error: float = math.inf
    wall: float = math.nan
    memory: float = math.nan
    failure: str = ""


def processes(case: Case, size: float, folder: Path) -> tuple[int, list[Process]]:
    """The degrees of freedom on a mesh of this ``size``, and the process of each code, whose result
    is the last force of the whole joint."""
    problem = replace(case.problem(size), steps=case.steps)
    mesh: Any = gathered(problem.mesh)  # on the one rank
    folder.mkdir()
    with (folder / _MESH).open("wb") as file:
        store_mesh(mesh, file)
    scene = words_of(problem, _MESH, fields=False)
    (folder / "joint.toml").write_text(resolved(scene), encoding="utf-8")
    run = folder / "run"
    ours = Process(
        "archord",
        solving("joint.toml", run.name),
        folder,
        lambda: Run(run).columns[f"{PRESS} force"][-1],
        LIMIT,
        kind="archord",
    )
    deck = process(scene, folder / "calculix", problem)
    theirs = replace(deck, limit=LIMIT, read=lambda: deck.read().P)
    return mesh.x.size, [ours, theirs]


def points(case: Case, sizes: Sequence[float]) -> dict[str, list[Point]]:
    """The points of each code on meshes of these ``sizes``. Needs one rank."""
    found: dict[str, list[Point]] = {code: [] for code in CODES}
    exact = case.references[-1].value
    said = partial(print, file=sys.stderr)
    with tempfile.TemporaryDirectory() as name:
        for size in sizes:
            n_dofs, both = processes(case, size, Path(name) / f"{size:g}")
            for code, timing in zip(CODES, time_all(both, 1, said), strict=True):
                point = Point(size, n_dofs, failure=timing.failure)
                if not timing.failure:
                    run = timing.middle
                    error = abs(run.result) / exact - 1
                    point = Point(size, n_dofs, run.cpu, error, run.seconds, run.memory)
                found[code].append(point)
    return found


def quickest(error: float, points: Sequence[Point]) -> tuple[str, float]:
    """Seconds of the quickest point within an ``error``, behind "". Without such a point, the most
    that any took, behind ">": it takes more."""
    within = [point.seconds for point in points if abs(point.error) <= error]
    if within:
        return "", min(within)
    return ">", max(point.seconds for point in points)


def rows(name: str, found: Mapping[str, Sequence[Point]]) -> Iterator[tuple[object, ...]]:
    """The rows of a case: its meshes, and last the seconds within the error of its goal."""
    for ours, theirs in zip(*found.values(), strict=True):
        ended = ours.seconds and theirs.seconds
        times = theirs.seconds / ours.seconds if ended else ""
        yield (name, ours.size, ours.n_dofs, *_told(ours), *_told(theirs), times)
    goal = GOALS[name]
    (far, ours), (more, theirs) = (quickest(goal.error, of_code) for of_code in found.values())
    within = f"within {100 * goal.error:g}"
    times = "" if far else f"{more}{theirs / ours:.1f} (goal {goal.times:g})"
    yield (name, "", "", within, f"{far}{ours:.1f}", within, f"{more}{theirs:.1f}", times)


def _told(point: Point) -> tuple[object, object]:
    if math.isinf(point.error):
        return "stopped", ""
    return 100 * point.error, point.seconds


def add_panel(name: str, found: Mapping[str, Sequence[Point]], folder: Path) -> None:
    """Write the points of a case as a table of the work-precision benchmark in ``folder``, and draw
    the picture of all its tables."""
    exact = CASES[name].references[-1]
    lines = [
        {
            "code": code,
            "series": "C3D10",
            "mesh": f"{point.size:g}",
            "dofs": point.n_dofs,
            "seconds": "" if point.failure else f"{point.wall:.4g}",
            "MB": "" if point.failure else f"{point.memory / 1e6:.0f}",
            "error of P": "" if point.failure else f"{abs(point.error):.2e}",
            "error of the reference": f"{exact.uncertainty / exact.value:.2e}",
            "failure": point.failure,
        }
        for code, of_code in found.items()
        for point in of_code
    ]
    folder.mkdir(parents=True, exist_ok=True)
    write_rows(lines, folder / f"{STEM}{GOALS[name].panel}.csv")
    draw(cases(folder), folder / f"{STEM.rstrip('_')}.png")


def main() -> None:
    """Print the table of the cases and sizes that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="cases, and sizes of elements")
    parser.add_argument("--into", type=Path, help="folder of the work-precision benchmark")
    given = parser.parse_args()
    chosen, sizes = named(given.names, GOALS)
    numbers = ("error [%] {:+.3f}", "s {:.1f}")
    headings = [f"{code}: {number}" for code in CODES for number in numbers]
    table = Table("case", "size {:g}", "dofs", *headings, "times {:.1f}", left=1)
    for name in chosen or GOALS:
        found = points(CASES[name], sizes or SIZES)
        for row in rows(name, found):
            table.add(*row)
        if given.into:
            add_panel(name, found, given.into)
    print(table.markdown())


if __name__ == "__main__":
    main()

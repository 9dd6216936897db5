"""A guard against slow growth of cost: counts that no clock has a part in, kept in counts.json.

``python3 -m archord.benchmarks.cost.counts`` solves the cases and compares; with ``--write`` it keeps what it counted,
for a change that costs more and is worth it.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from importlib.resources import files
from pathlib import Path

from mpi4py import MPI

from archord.benchmarks.case import paper_joint
from archord.output.run import solve_scene

ALLOWED = 1.1  # of what is kept
SIZES = (0.12, 0.08)  # elements on the arcs, over R
CASES: dict[str, dict] = {"elastic": {"steps": 2}, "plastic": {"steps": 20, "yield_stress": 0.002}}
KEPT = "counts.json"
_TOTALS = {"iterations": "newton_iterations", "factorisations": "factorisations", "evaluations": "residual_evaluations"}

Counts = dict[str, int]


def names() -> list[str]:
    """The cases: ``elastic 0.12`` is the elastic joint of the paper with elements of 0.12 R on its arcs."""
    return [f"{kind} {size:g}" for kind in CASES for size in SIZES]


def count(name: str) -> Counts:
    """Solve the case ``name``; its dofs, Newton iterations, factorisations and evaluations of the residual."""
    kind, size = name.split()
    scene = paper_joint(float(size), **CASES[kind])
    with tempfile.TemporaryDirectory() as folder:
        outcome = solve_scene(scene, Path(folder), MPI.COMM_SELF)
        if outcome.status != "done":
            raise RuntimeError(f"{name}: {outcome.message}")
        report = json.loads((Path(folder) / "run.json").read_text())
    return {"dofs": report["mesh"]["dofs"]} | {ours: report["totals"][theirs] for ours, theirs in _TOTALS.items()}


def kept() -> dict[str, Counts]:
    """The counts in counts.json, by case."""
    return json.loads(files("archord.benchmarks.cost").joinpath(KEPT).read_text(encoding="utf-8"))


def grown(name: str, now: Counts, before: Counts) -> list[str]:
    """A sentence for every count of the case ``name`` that exceeds what was kept ``before`` by more than a tenth."""
    return [
        f"{name}: {what} grew from {before[what]} to {now[what]}"
        for what in before
        if now[what] > ALLOWED * before[what]
    ]


def main() -> int:
    """Count, print, and compare or ``--write``; the exit code is 1 if anything grew."""
    parser = argparse.ArgumentParser(prog="python3 -m archord.benchmarks.cost.counts", description=main.__doc__)
    parser.add_argument("--write", action="store_true", help="keep these counts in counts.json")
    write = parser.parse_args().write
    now = {name: count(name) for name in names()}
    for name, counts in now.items():
        print(f"{name}: " + ", ".join(f"{value} {what}" for what, value in counts.items()))
    if write:
        lines = ",\n".join(f" {json.dumps(name)}: {json.dumps(counts)}" for name, counts in now.items())
        Path(__file__).with_name(KEPT).write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
        return 0
    faults = [fault for name, before in kept().items() for fault in grown(name, now[name], before)]
    for fault in faults:
        print(f"archord: {fault}.", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

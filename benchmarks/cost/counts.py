"""A guard against slow growth of cost: counts that no clock has a part in, kept in counts.json.

``python3 -m archord.benchmarks.cost.counts`` solves the cases, prints their counts as the file
keeps them, for a change that costs more and is worth it, and compares.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

from archord.benchmarks.case import Case, paper_joint
from archord.report.files import read_json

ALLOWED = 1.1  # of what is kept
KEPT: dict[str, dict[str, int]] = read_json(Path(__file__).with_name("counts.json"))
# ``elastic 0.12`` is the elastic joint of the paper with elements of 0.12 R on its arcs.
CASES = [
    Case(f"{kind} {size:g}", paper_joint(size, steps, yield_stress))
    for kind, steps, yield_stress in (("elastic", 2, None), ("plastic", 20, 0.002))
    for size in (0.12, 0.08)
]


def count(case: Case) -> dict[str, int]:
    """Solve ``case``; its dofs, Newton iterations, factorisations and evaluations of the
    residual."""
    with tempfile.TemporaryDirectory() as folder:
        case.solve(Path(folder))
        report = read_json(case.folder(Path(folder)) / "run.json")
    totals = report["totals"]
    return {
        "dofs": report["mesh"]["dofs"],
        "iterations": totals["newton_iterations"],
        "factorisations": totals["factorisations"],
        "evaluations": totals["residual_evaluations"],
    }


def grown(name: str, now: dict[str, int], before: dict[str, int]) -> list[str]:
    """A sentence for every count of the case ``name`` that exceeds what was kept ``before`` by more
    than a tenth."""
    large = [what for what in before if now[what] > ALLOWED * before[what]]
    return [f"{name}: {what} grew from {before[what]} to {now[what]}" for what in large]


def main() -> int:
    """Count, print and compare; the exit code is 1 if anything grew."""
    now = {case.name: count(case) for case in CASES}
    lines = [f" {json.dumps(name)}: {json.dumps(counts)}" for name, counts in now.items()]
    print("{\n" + ",\n".join(lines) + "\n}")
    faults = [fault for name, before in KEPT.items() for fault in grown(name, now[name], before)]
    for fault in faults:
        print(f"archord: {fault}.", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

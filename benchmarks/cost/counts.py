"""A guard against slow growth of cost: counts that no clock has a part in, kept in counts.json.

``python3 -m archord.benchmarks.cost.counts`` solves the cases and compares; with ``--write`` it keeps what it counted,
for a change that costs more and is worth it.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from archord.benchmarks.case import Case, paper_joint

ALLOWED = 1.1  # of what is kept
KEPT = Path(__file__).with_name("counts.json")
_TOTALS = {"iterations": "newton_iterations", "factorisations": "factorisations", "evaluations": "residual_evaluations"}
# ``elastic 0.12`` is the elastic joint of the paper with elements of 0.12 R on its arcs.
CASES = [
    Case(f"{kind} {size:g}", paper_joint(size, steps, yield_stress))
    for kind, steps, yield_stress in (("elastic", 2, None), ("plastic", 20, 0.002))
    for size in (0.12, 0.08)
]

Counts = dict[str, int]


def count(case: Case) -> Counts:
    """Solve ``case``; its dofs, Newton iterations, factorisations and evaluations of the residual."""
    with tempfile.TemporaryDirectory() as folder:
        case.solve(Path(folder))
        report = json.loads((case.folder(Path(folder)) / "run.json").read_text(encoding="utf-8"))
    return {"dofs": report["mesh"]["dofs"]} | {ours: report["totals"][theirs] for ours, theirs in _TOTALS.items()}


def kept() -> dict[str, Counts]:
    """The counts in counts.json, by case."""
    return json.loads(KEPT.read_text(encoding="utf-8"))


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
    now = {case.name: count(case) for case in CASES}
    for name, counts in now.items():
        print(f"{name}: " + ", ".join(f"{value} {what}" for what, value in counts.items()))
    if write:
        lines = ",\n".join(f" {json.dumps(name)}: {json.dumps(counts)}" for name, counts in now.items())
        KEPT.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
        return 0
    faults = [fault for name, before in kept().items() for fault in grown(name, now[name], before)]
    for fault in faults:
        print(f"archord: {fault}.", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())

"""What archord is checked against, as a table: ``python3 -m archord.benchmarks.verification.verification``.

References, for the quarter joint of the paper in plane strain (like bodies, nu = 0.3, dR/R = 0.5 %, block 100 R, delta
= 2 dR), were computed with independent solvers, each refined until the digits stood: GetFEM 5.4 (Q2 elements of 0.5 %R)
with closest points on the deformed curves, NGSolve 6.2 (order 4) with fixed pairs, NGSolve for concentric circles.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

from archord.benchmarks.case import paper_joint
from archord.benchmarks.report_files import markdown_table
from archord.output.measures import Measures
from archord.output.run import Outcome, solve_scene


@dataclass(frozen=True)
class _Row:
    what: str
    reference: float
    source: str
    ours: float
    detail: str

    @property
    def cells(self) -> list[str]:
        difference = abs(self.ours / self.reference - 1)
        numbers = [f"{self.reference:.7g}", self.source, f"{self.ours:.7g}", f"{difference:.1e}"]
        return [self.what, *numbers, self.detail]


def _solve(element_size: float, steps: int, yield_stress: float | None = None, **sections: dict) -> tuple[Outcome, str]:
    """Solve the paper's joint; the outcome, and its cost in words."""
    scene = paper_joint(element_size, steps, yield_stress, **sections)
    dofs = 0

    def count(joint) -> None:
        nonlocal dofs
        dofs = joint.n_dofs

    start = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        outcome = solve_scene(scene, Path(folder), on_start=count)
    iterations = sum(m.iterations for m in outcome.steps) / steps
    return outcome, f"{dofs} dofs, {iterations:.1f} iterations a step, {perf_counter() - start:.1f} s"


def _imbalances(outcomes: list[Outcome]) -> tuple[float, float]:
    """Largest force imbalance over P, and largest energy imbalance over the work, of all runs' last steps."""
    last: list[Measures] = [o.steps[-1] for o in outcomes]
    force = max(m.force_balance for o in outcomes for m in o.steps)
    return force, max(abs(m.work - m.elastic_energy - m.plastic_dissipation) / m.work for m in last)


def main() -> None:
    """Solve the cases and print the table."""
    rows, outcomes = [], []
    for kinematics, force, source in (("current", 0.0127785, "GetFEM"), ("reference", 0.0127596, "NGSolve")):
        outcome, cost = _solve(0.04, 8, analysis={"kinematics": kinematics})
        outcomes.append(outcome)
        rows.append(_Row(f"elastic P/(E* R), `{kinematics}`", force, source, outcome.steps[-1].P, cost))
    last = outcomes[0].steps[-1]
    rows.append(_Row("elastic p0/E*", 0.00822326, "NGSolve, concentric", last.p0, "differs by O(dR/R)"))
    rows.append(_Row("elastic eps [rad]", 1.17235, "NGSolve, concentric", last.eps, "differs by O(dR/R)"))
    for size in (0.04, 0.02):
        outcome, cost = _solve(size, 20, 0.002)
        outcomes.append(outcome)
        cuts = sum(m.cutbacks for m in outcome.steps)
        what = f"plastic P/(E* R), sigY/E* = 0.2 %, {100 * size:g} %R"
        rows.append(_Row(what, 0.006692, "GetFEM, NGSolve", outcome.steps[-1].P, f"{cost}, {cuts} cutbacks"))
    small = {"clearance": 0.5, "element_size": 0.006, "growth": 0.5, "block_size": 6.0}
    outcome, cost = _solve(0.006, 1, joint=small, load={"displacement": 0.006})
    m, radius = outcome.steps[-1], 3.0
    rows.append(_Row("small contact: p0/E*", math.sqrt(m.P / math.pi / radius), "Hertz", m.p0, cost))
    rows.append(
        _Row("small contact: half-width/R", math.sqrt(4 * m.P * radius / math.pi), "Hertz", m.contact_area / 2, "")
    )
    headings = ("what", "reference", "by", "archord", "relative difference", "cost")
    print(*markdown_table(headings, [row.cells for row in rows]), sep="\n")
    force, energy = _imbalances(outcomes)
    print(f"\nForces at pin, contact and block differ by at most {force:.0e} of P in any step; work differs from")
    print(f"stored and dissipated energy by at most {energy:.1e} of the work.")


if __name__ == "__main__":
    main()

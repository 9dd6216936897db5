"""What archord is checked against, as a table: ``python3 -m archord.benchmarks.verification``.

References, for the quarter joint of the paper in plane strain (like bodies, nu = 0.3, dR/R = 0.5 %,
block 100 R, delta = 2 dR), were computed with independent solvers, each refined until the digits
stood: GetFEM 5.4 (Q2 elements of 0.5 %R) with closest points on the deformed curves, NGSolve 6.2
(order 4) with fixed pairs, NGSolve for concentric circles; at large strain CalculiX 2.20 on the
same mesh (benchmarks/peers/calculix.py).
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from time import perf_counter

from archord.benchmarks.case import Case, paper_joint
from archord.benchmarks.persson import UNLIKE, persson_joint, theory, unlike
from archord.measures.record import Record
from archord.report.table import Table
from archord.scene.presets.joint import Scene


def _solve(scene: Scene) -> tuple[list[Record], str]:
    """The steps of ``scene``, and their cost in words."""
    start = perf_counter()
    dofs = []
    with tempfile.TemporaryDirectory() as folder:
        steps = (
            Case("joint", scene)
            .solve(Path(folder), on_start=lambda joint: dofs.append(joint.n_dofs))
            .steps
        )
    iterations = sum(m.iterations for m in steps) / len(steps)
    return (
        steps,
        f"{dofs[0]} dofs, {iterations:.1f} iterations a step, {perf_counter() - start:.1f} s",
    )


def main() -> None:
    """Solve the cases and print the table."""
    numbers = ("reference {:.7g}", "by", "archord {:.7g}", "relative difference {:.1e}")
    table = Table("what", *numbers, "cost")
    runs = []  # whose balances are told: the Hertzian one has a single step

    def compare(what: str, reference: float, source: str, ours: float, cost: str) -> None:
        table.add(what, reference, source, ours, abs(ours / reference - 1), cost)

    for kinematics, force, source in (
        ("current", 0.0127785, "GetFEM"),
        ("reference", 0.0127596, "NGSolve"),
    ):
        steps, cost = _solve(paper_joint(0.04, 8, analysis={"kinematics": kinematics}))
        runs.append(steps)
        compare(f"elastic P/(E* R), `{kinematics}`", force, source, steps[-1]["P"], cost)
    last = runs[0][-1]
    compare("elastic p0/E*", 0.00822326, "NGSolve, concentric", last["p0"], "differs by O(dR/R)")
    compare("elastic eps [rad]", 1.17235, "NGSolve, concentric", last["eps"], "differs by O(dR/R)")
    steps, cost = _solve(paper_joint(0.04, 20, analysis={"friction": 0.1}))
    runs.append(steps)
    compare("elastic P/(E* R), friction of 0.1", 0.0132327, "GetFEM", steps[-1]["P"], cost)
    for size in (0.04, 0.02):
        steps, cost = _solve(paper_joint(size, 20, 0.002))
        runs.append(steps)
        what = f"plastic P/(E* R), sigY/E* = 0.2 %, {100 * size:g} %R"
        cost += f", {sum(m.cutbacks for m in steps)} cutbacks"
        compare(what, 0.006692, "GetFEM, NGSolve", steps[-1]["P"], cost)
    steps, cost = _solve(paper_joint(0.04, 20, 0.002, analysis={"strain": "large"}))
    runs.append(steps)
    compare(
        "plastic P/(E* R), 4 %R, large strain", 0.00670539, "CalculiX, 4 %R", steps[-1]["P"], cost
    )
    small = {"clearance": 0.5, "growth": 0.5, "block_size": 6.0}
    steps, cost = _solve(paper_joint(0.006, 1, joint=small, load={"displacement": 0.006}))
    m = steps[-1]
    P = m["P"]
    radius = 3.0
    compare("small contact: p0/E*", math.sqrt(P / math.pi / radius), "Hertz", m["p0"], cost)
    half_width = math.sqrt(4 * P * radius / math.pi)
    compare("small contact: half-width/R", half_width, "Hertz", m.contact_area / 2, "")
    bodies, alpha = unlike(*UNLIKE)
    for name, load, n, sections in (
        ("", 0.5, 1, {}),
        (", interference", -0.1, 4, {}),
        (", unlike", 0.5, 1, bodies),
    ):
        found, cost = _solve(persson_joint(load, 0.04, n, **sections))
        eps, peak = theory(load, alpha if sections else 0.0)
        compare(
            f"pin in a ring{name}: R p0/P", peak, "Persson", found[-1]["p0"] / found[-1]["P"], cost
        )
        compare(f"pin in a ring{name}: eps [rad]", eps, "Ciavarella, Decuzzi", found[-1]["eps"], "")
    print(table.markdown())
    force = max(m.force_balance for steps in runs for m in steps)
    energy = max(abs(m.missing) / m.work for m in (steps[-1] for steps in runs))
    print(
        f"Forces at pin, contact and block differ by at most {force:.0e} of P in any step; work "
        "differs from"
    )
    print(f"stored and dissipated energy by at most {energy:.1e} of the work.")


if __name__ == "__main__":
    main()

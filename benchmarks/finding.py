"""What moves the plastic law: ``python3 -m archord.benchmarks.finding``.

The paper's joint with dR/R = 0.5 %, sigY/E* = 0.2 %, where its eqs 11, 12 give 0.00434 E* R at 2 dR: what
plane, Poisson's ratio, ratio of the moduli, yielding body, clearance and kinematics make of it, and k and c of the
plastic-Winkler law that fits each (threshold c sigY; the paper has k = 0.85, c = 1).
"""

from __future__ import annotations

import argparse
import math
import tempfile
from pathlib import Path

import numpy as np
from mpi4py import MPI

from archord.benchmarks.finding_variants import CROSSED, ELASTIC, VARIANTS, Variant
from archord.benchmarks.paper_runs import PLANES, Plane
from archord.postprocess.calibration import calibrate
from archord.postprocess.chord_laws import plastic_force
from archord.postprocess.finding_rows import LOADS, FindingRow, write_rows
from archord.postprocess.law_joint import LawJoint
from archord.postprocess.run_curve import read_run
from archord.solver.run import solve_scene

HEADINGS = ("joint", "plane", "P(2 dR)/(E* R)", "over eq. 12", "p0/sigY", "k", "c", "R2 of P", "c of the plateau")


def solve(variant: Variant, plane: Plane, element_size: float) -> FindingRow | str:
    """Solve a variant and fit it; the complaint of a run that did not get to the end."""
    with tempfile.TemporaryDirectory() as folder:
        outcome = solve_scene(variant.scene(plane, element_size, len(LOADS)), Path(folder), MPI.COMM_SELF)
        if outcome.status != "done":
            return outcome.message
        fits = calibrate([run := read_run(folder)], (0.1, 2.0)).joint
    k, c, plateau = fits.P.k, fits.P.c, fits.plateau.c if fits.plateau else None
    assert k is not None
    return FindingRow(
        variant.name,
        plane,
        "both" if len(variant.yielding) == 2 else (*variant.yielding, "none")[0],
        variant.kinematics,
        variant.nu,
        math.inf if variant.ratio is None else variant.ratio,
        variant.s or math.inf,
        variant.clearance,
        k.value,
        k.error,
        c.value if c else math.nan,
        c.error if c else math.nan,
        fits.P.r2,
        float(run.p0[-1]) / variant.yield_stress if variant.yielding else 0.0,
        plateau.value if plateau else math.nan,
        np.asarray(run.P) / variant.clearance,
    )


def _entries(row: FindingRow) -> list[str]:
    """The entries below `HEADINGS`."""
    joint = LawJoint(1.0, row.clearance, 1.0, yield_stress=row.s * row.clearance)
    law, force = float(plastic_force(joint, np.array(2 * row.clearance))), row.P[-1] * row.clearance
    c = "-" if math.isnan(row.c) else f"{row.c:.3f} ± {row.c_error:.3f}"
    plateau = "-" if math.isnan(row.plateau) else f"{row.plateau:.3f}"
    numbers = [f"{force:.6f}", f"{force / law:.3f}", f"{row.p0_over_sigY:.3f}", f"{row.k:.3f} ± {row.k_error:.3f}", c]
    return [row.joint, row.plane, *numbers, f"{row.r2:.4f}", plateau]


def main() -> None:
    """Solve all variants in both planes, ranks side by side, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--element-size", type=float, default=0.04, help="on the arcs, over R [0.04]")
    parser.add_argument("--csv", type=Path, help="write all rows into this file as well (postprocess/finding.csv)")
    arguments = parser.parse_args()
    comm = MPI.COMM_WORLD
    jobs = [(variant, plane) for plane in PLANES for variant in (*VARIANTS, *ELASTIC, *CROSSED)]
    mine = {i: solve(*jobs[i], arguments.element_size) for i in range(comm.rank, len(jobs), comm.size)}
    gathered = comm.gather(mine)
    if gathered is None:
        return
    found = {i: result for part in gathered for i, result in part.items()}
    for i in sorted(found):
        if isinstance(found[i], str):
            print(f"{jobs[i][0].name}, plane {jobs[i][1]}: {found[i]}")
    rows = [row for _, row in sorted(found.items()) if isinstance(row, FindingRow)]
    if arguments.csv:
        write_rows(rows, arguments.csv)
    shown = {variant.name for variant in VARIANTS}
    print("| " + " | ".join(HEADINGS) + " |")
    print("|" + "---|" * len(HEADINGS))
    for row in rows:
        if row.joint in shown:
            print("| " + " | ".join(_entries(row)) + " |")


if __name__ == "__main__":
    main()

"""What moves the plastic law: ``python3 -m archord.benchmarks.paper.finding``.

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

from archord.benchmarks.paper.finding_variants import CROSSED, ELASTIC, VARIANTS, Variant
from archord.benchmarks.paper.runs import PLANES, Plane
from archord.benchmarks.report_files import markdown_table
from archord.output.run import solve_scene
from archord.postprocess.laws.calibrated_law import joint_calibrated
from archord.postprocess.laws.calibration import calibrate
from archord.postprocess.laws.chord_laws import plastic_force
from archord.postprocess.laws.finding_rows import LOADS, FindingRow, read_rows, write_rows
from archord.postprocess.run_curve import read_run

_LATE = LOADS > 0.45
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
    law = float(plastic_force(row.joint_with(0.85, 1.0), np.array(2 * row.clearance)))
    force, peak = row.P[-1] * row.clearance, "-" if math.isinf(row.s) else f"{row.p0_over_sigY:.3f}"
    c = "-" if math.isnan(row.c) else f"{row.c:.3f} ± {row.c_error:.3f}"
    plateau = "-" if math.isnan(row.plateau) else f"{row.plateau:.3f}"
    numbers = [f"{force:.6f}", f"{force / law:.3f}", peak, f"{row.k:.3f} ± {row.k_error:.3f}", c]
    return [row.joint, row.plane, *numbers, f"{row.r2:.4f}", plateau]


def judged(rows: list[FindingRow]) -> list[tuple[str, str, int, float, float, float]]:
    """How far the calibrated law, fitted to solutions other than these ``rows``, is from them where it holds.

    Plane, which bodies yield, number of rows, rms and largest size of its error of P over 0.5 to 2 dR, and the rms with
    each row's own k and c.
    """
    found = []
    for plane in PLANES:
        for kind in ("none", "both", "block"):
            off, own = [], []
            for row in rows:
                if (row.plane, row.yielding, row.kinematics) == (plane, kind, "current"):
                    law = joint_calibrated(row.joint_with(row.k, row.c))
                    if not law.outside:
                        off.append(row.force_error(law.k, law.c)[_LATE])
                        own.append(row.force_error(row.k, row.c)[_LATE])
            errors, floor = np.array(off), np.array(own)
            rms, least = (float(np.sqrt((part**2).mean())) for part in (errors, floor))
            found.append((plane, kind, len(off), rms, float(np.abs(errors).max()), least))
    return found


def _print_judged(rows: list[FindingRow]) -> None:
    headings = ("plane", "yields", "joints", "P off by, rms", "at most", "rms with own k and c")
    cells = [(*found[:3], *(f"{error:.1%}" for error in found[3:])) for found in judged(rows)]
    print("", *markdown_table(headings, cells), sep="\n")


def main() -> None:
    """Solve all variants in both planes, ranks side by side, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--element-size", type=float, default=0.04, help="on the arcs, over R [0.04]")
    parser.add_argument(
        "--rows", type=Path, help="take the rows of this file (postprocess/laws/finding.csv), solve nothing"
    )
    parser.add_argument("--csv", type=Path, help="write all rows into this file as well")
    arguments = parser.parse_args()
    rows = read_rows(arguments.rows) if arguments.rows else _solve_all(arguments.element_size)
    if MPI.COMM_WORLD.rank > 0:
        return
    if arguments.csv:
        write_rows(rows, arguments.csv)
    shown = {variant.name for variant in (*VARIANTS, *ELASTIC)}
    print(*markdown_table(HEADINGS, [_entries(row) for row in rows if row.joint in shown]), sep="\n")
    _print_judged(rows)


def _solve_all(element_size: float) -> list[FindingRow]:
    """The rows of all variants in both planes, on the first rank; collective."""
    comm = MPI.COMM_WORLD
    jobs = [(variant, plane) for plane in PLANES for variant in (*VARIANTS, *ELASTIC, *CROSSED)]
    mine = {i: solve(*jobs[i], element_size) for i in range(comm.rank, len(jobs), comm.size)}
    found = {i: result for part in comm.gather(mine) or [] for i, result in part.items()}
    for i, result in sorted(found.items()):
        if isinstance(result, str):
            print(f"{jobs[i][0].name}, plane {jobs[i][1]}: {result}")
    return [row for _, row in sorted(found.items()) if isinstance(row, FindingRow)]


if __name__ == "__main__":
    main()

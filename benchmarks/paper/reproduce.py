"""The paper's figures and the judgement of its claims, from runs that are solved where they are missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from mpi4py import MPI

from archord.benchmarks.case import Case
from archord.benchmarks.paper.claims import CLAIMS
from archord.benchmarks.paper.figures import Figure, fig2, fig3, fig4, fig5, fig7, fig8, fig9
from archord.benchmarks.paper.runs import (
    FULL_YIELD,
    JOINTS,
    MILD_YIELD,
    PAIRS,
    PLANES,
    Runs,
    cases,
    plastic,
    solve_missing,
)
from archord.output.folder import claim_folder
from archord.output.ranks import agreed
from archord.output.user_file import check_output
from archord.report.table import Table
from archord.scene.errors import InputError

# what makes it, and the joints it needs
FIGURES: dict[str, tuple[Callable[[Runs], Figure], list[str]]] = {
    "fig2": (fig2, ["elastic"]),
    "fig3": (fig3, ["elastic"]),
    "fig4": (fig4, ["elastic"]),
    "fig5": (fig5, [plastic(FULL_YIELD)]),
    "fig7": (fig7, [plastic(pair) for pair in PAIRS]),
    "fig8": (fig8, [plastic(MILD_YIELD), "elastic_0.1"]),
    "fig9": (fig9, ["elastic", plastic(FULL_YIELD)]),
}


def chosen(names: list[str]) -> list[str]:
    """The figures that ``names`` (or "all") ask for, in order. Raises `InputError` for an unknown one."""
    for name in names:
        if name not in (*FIGURES, "all"):
            raise InputError(f"{name}: is not a figure of the paper; figures are {', '.join(FIGURES)}, all.")
    return [name for name in FIGURES if name in names or "all" in names]


def reproduce(
    names: list[str], folder: Path, comm: MPI.Comm, said: Callable[[Case, float], None] = lambda case, P: None
) -> list[Path]:
    """Solve what ``names`` need and is not in ``folder`` yet, and write their CSV files and pictures.

    With all figures also ``report.md``. ``said(case, P)`` follows every run. Returns the files, on
    rank 0. Raises `InputError` for unknown figures and a folder that cannot be written, and RuntimeError if a run
    failed. Collective.
    """
    wanted = chosen(names)
    agreed(comm, lambda: _claim(folder, wanted))
    runs = Runs(folder / "runs")
    needed = cases(joint for name in wanted for joint in FIGURES[name][1])
    if complaints := solve_missing(needed, runs.folder, comm, said):
        raise RuntimeError("; ".join(complaints))
    if comm.rank != 0:
        return []
    files = [file for name in wanted for file in FIGURES[name][0](runs).write(folder, name)]
    return files + ([_report(runs, folder)] if len(wanted) == len(FIGURES) else [])


def _claim(folder: Path, wanted: list[str]) -> None:
    claim_folder(folder, force=True)
    for name in wanted:
        for kind in ("csv", "png"):
            check_output(folder / f"{name}.{kind}")


def mesh_errors(runs: Runs) -> dict[str, float]:
    """By run: the largest difference of P between the two meshes over all steps from 0.2 dR on, over P."""
    errors = {}
    for joint in JOINTS:
        for plane in PLANES:
            fine, coarse = (runs.curve(joint, plane, mesh) for mesh in ("fine", "coarse"))
            late = fine.delta >= 0.2 * fine.dR
            errors[f"{joint}, plane {plane}"] = float(np.abs(coarse.P / fine.P - 1)[late].max())
    return errors


def _report(runs: Runs, folder: Path) -> Path:
    """Write the claims, judged, and the figures to ``report.md``."""
    errors = mesh_errors(runs)
    worst = max(errors, key=lambda name: errors[name])
    table = Table("claim", "figure", "the paper", *(f"ours, plane {plane}" for plane in PLANES), "verdict")
    for claim in (judged(runs) for judged in CLAIMS):
        table.add(claim.name, claim.figure, claim.text, *claim.found.values(), claim.verdict)
    pictures = "\n".join(f"![figure {name[3:]}]({name}.png)\n" for name in FIGURES)
    text = f"""# The claims of Hu et al., judged

Hu et al., *A new model for elasto-plastic conformal contact between cylinders*. Like bodies, nu = 0.3 (the paper \
gives neither), block of 100 R, closest points on the deformed curves, small strains; E* = 1.

Two meshes, 4 % R and 2 % R on the arcs, differ in P by at most {errors[worst]:.2%} from 0.2 dR on ({worst}): the \
discretisation error of the finer one, which all numbers come from, is below that.

{table.markdown()}
{pictures}"""
    file = folder / "report.md"
    file.write_text(text, encoding="utf-8")
    return file

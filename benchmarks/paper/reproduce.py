"""The paper's figures and the judgement of its claims, from runs that are solved where they are
missing."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from mpi4py import MPI

from archord.benchmarks.paper.claims import judged
from archord.benchmarks.paper.figures import FIGURES, LAYOUTS, draw_zones, write
from archord.benchmarks.paper.runs import JOINTS, PLANES, Runs, cases, solve_missing
from archord.benchmarks.timing import Said
from archord.output.folder import claim_folder
from archord.output.ranks import agreed
from archord.report.errors import InputError
from archord.report.files import write_text


def chosen(names: Sequence[str]) -> list[str]:
    """The figures that ``names`` (or "all") ask for, in order. Raises `InputError` for an unknown
    one."""
    for name in names:
        if name not in (*FIGURES, "all"):
            raise InputError(
                name, f"is not a figure of the paper; figures are {', '.join(FIGURES)}, all."
            )
    return [name for name in FIGURES if name in names or "all" in names]


def reproduce(
    names: Sequence[str],
    folder: Path,
    comm: MPI.Comm,
    said: Said,
    strain: str = "small",
) -> list[Path]:
    """Solve what ``names`` need and is not in ``folder`` yet, and write their CSV files and
    pictures.

    With all figures also ``report.md``. All runs are of small or large ``strain``.
    ``said(sentence)`` follows each. Returns the files, on rank 0. Raises `InputError` for unknown
    figures and a folder that cannot be written, and RuntimeError if a run failed. Collective.
    """
    wanted = chosen(names)
    agreed(comm, lambda: claim_folder(folder, force=True))
    runs = Runs(folder / "runs", strain)
    needed = cases((joint for name in wanted for joint in LAYOUTS[name]["joints"]), strain)
    if complaints := solve_missing(needed, runs.folder, comm, said):
        raise RuntimeError("; ".join(complaints))
    if comm.rank != 0:
        return []
    tables = {
        name: [part for plane in PLANES for part in FIGURES[name](runs, plane)] for name in wanted
    }
    files = [file for name in wanted for file in write(tables[name], folder, name)]
    if "fig8" in wanted:
        files.append(draw_zones(runs, folder / "fig8_zones.png"))
    if len(wanted) == len(FIGURES):
        pictures = [file.name for file in files if file.suffix == ".png"]
        files.append(folder / "report.md")
        write_text(report(runs, judged(runs, tables).markdown(), pictures), files[-1])
    return files


def report(runs: Runs, claims: str, pictures: list[str]) -> str:
    """The judged ``claims`` and the figures as Markdown, and how far the meshes differ."""
    errors = {}
    for joint, plane in product(JOINTS, PLANES):
        fine, coarse = (runs.curve(joint, plane, mesh) for mesh in ("fine", "coarse"))
        late = fine.delta >= 0.2 * fine.dR
        off = np.abs(coarse.P / fine.P - 1)
        errors[f"{joint}, plane {plane}"] = float(off[late].max())
    worst, error = max(errors.items(), key=lambda item: item[1])
    shown = "\n".join(f"![{name}]({name})\n" for name in pictures)
    return f"""# The claims of Hu et al., judged

Hu et al., *A new model for elasto-plastic conformal contact between cylinders*. Like bodies, \
nu = 0.3 (the paper gives neither), block of 100 R, closest points on the deformed curves, \
{runs.strain} strains; E* = 1.

Two meshes, 4 % R and 2 % R on the arcs, differ in P by at most {error:.2%} from 0.2 dR on \
({worst}): the discretisation error of the finer one, which all numbers come from, is below that.

{claims}
{shown}"""

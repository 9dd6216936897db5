"""The paper's figures and the judgement of its claims, from runs that are solved where they are missing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from mpi4py import MPI

from archord.benchmarks.paper.claims import CLAIMS
from archord.benchmarks.paper.figures import Runs, Table, fig2, fig3, fig4, fig5, fig7, fig9
from archord.benchmarks.paper.first_yield import fig8
from archord.benchmarks.paper.runs import PAIRS, Case, cases, plastic, solve_missing
from archord.benchmarks.report_files import markdown_table
from archord.output.folder import claim_folder
from archord.output.ranks import agreed
from archord.output.user_file import check_output
from archord.scene.errors import InputError

_PLASTIC = [plastic(pair) for pair in PAIRS]
FIGURES: dict[str, tuple[Callable[[Runs], tuple[Table, Callable]], list[str], tuple[float, float]]] = {
    # what draws it, the scenes it needs, its size in inches
    "fig2": (fig2, ["elastic"], (6.5, 4.5)),
    "fig3": (fig3, ["elastic"], (6.5, 4.5)),
    "fig4": (fig4, ["elastic"], (6.5, 4.5)),
    "fig5": (fig5, ["plastic_0.5_0.2"], (11, 4.5)),
    "fig7": (fig7, _PLASTIC, (6.5, 4.5)),
    "fig8": (fig8, ["plastic_0.1_0.1", "elastic_0.1"], (17, 8)),
    "fig9": (fig9, ["elastic", "plastic_0.5_0.2"], (6.5, 4.5)),
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

    With all figures also ``report.md`` and ``report.html``. ``said(case, P)`` follows every run. Returns the files, on
    rank 0. Raises `InputError` for unknown figures and a folder that cannot be written, and RuntimeError if a run
    failed. Collective.
    """
    wanted = chosen(names)
    agreed(comm, lambda: _claim(folder, wanted))
    runs = Runs(folder / "runs")
    complaints = solve_missing(cases(s for name in wanted for s in FIGURES[name][1]), runs.folder, comm, said)
    if complaints:
        raise RuntimeError("; ".join(complaints))
    if comm.rank != 0:
        return []
    files = [file for name in wanted for file in _draw(name, runs, folder)]
    return files + (_report(runs, folder) if len(wanted) == len(FIGURES) else [])


def _claim(folder: Path, wanted: list[str]) -> None:
    claim_folder(folder, force=True)
    for name in wanted:
        for kind in ("csv", "png"):
            check_output(folder / f"{name}.{kind}")


def _draw(name: str, runs: Runs, folder: Path) -> list[Path]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    make, _, size = FIGURES[name]
    table, draw = make(runs)
    table.write(folder / f"{name}.csv")
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure)
    for axes in figure.axes:
        if axes.get_legend_handles_labels()[1]:
            axes.legend(frameon=False, fontsize=8)
            axes.grid(alpha=0.3)
    figure.savefig(folder / f"{name}.png", dpi=120)
    return [folder / f"{name}.csv", folder / f"{name}.png"]


def mesh_errors(runs: Runs) -> dict[str, float]:
    """By run: the largest difference of P between the two meshes over all steps from 0.2 dR on, over P."""
    errors = {}
    for case in cases(["elastic", "elastic_0.1", *_PLASTIC]):
        if case.mesh == "fine":
            fine, coarse = (runs.curve(case.scene, case.plane, mesh) for mesh in ("fine", "coarse"))
            late = fine.delta >= 0.2 * fine.dR
            errors[f"{case.scene}, plane {case.plane}"] = float(np.abs(coarse.P / fine.P - 1)[late].max())
    return errors


def _report(runs: Runs, folder: Path) -> list[Path]:
    from markdown_it import MarkdownIt

    errors = mesh_errors(runs)
    worst = max(errors, key=lambda name: errors[name])
    lines = [
        "# The claims of Hu et al., judged",
        "",
        "Hu et al., *A new model for elasto-plastic conformal contact between cylinders*. Like bodies, nu = 0.3 (the "
        "paper gives neither), block of 100 R, closest points on the deformed curves, small strains; E* = 1.",
        "",
        f"Two meshes, 4 % R and 2 % R on the arcs, differ in P by at most {errors[worst]:.2%} from 0.2 dR on "
        f"({worst}): the discretisation error of the finer one, which all numbers come from, is below that.",
        "",
    ]
    headings = ("claim", "figure", "the paper", "ours, plane strain", "ours, plane stress", "verdict")
    judged = [(c.name, c.figure, c.text, c.strain, c.stress, c.verdict) for c in (f(runs) for f in CLAIMS)]
    lines += [*markdown_table(headings, judged), "", *(f"![figure {name[3:]}]({name}.png)\n" for name in FIGURES)]
    text = "\n".join(lines) + "\n"
    (folder / "report.md").write_text(text, encoding="utf-8")
    body = MarkdownIt("commonmark").enable("table").render(text)
    style = "body{font:16px/1.5 sans-serif;max-width:75em;margin:2em auto}td,th{border:1px solid #ccc;padding:.4em}"
    style += "table{border-collapse:collapse}img{max-width:100%}"
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>Hu et al.</title><style>{style}</style>'
    html = f"{head}{body}</html>\n"
    (folder / "report.html").write_text(html, encoding="utf-8")
    return [folder / "report.md", folder / "report.html"]

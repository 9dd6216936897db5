"""A second opinion: CalculiX on the deck of a scene, what its result files say, and a table of both.

``python3 -m archord.benchmarks.peers.calculix`` prints the table of docs/peers.md.
"""

from __future__ import annotations

import math
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import get_args

import numpy as np

from archord.benchmarks.case import Case, paper_joint
from archord.benchmarks.timing import Failure, Process, Run, run_once
from archord.geometry.basis import Array
from archord.geometry.joint_mesh import Facets
from archord.postprocess.deck import Elements, PlaneMesh, deck, deck_mesh, loaded_nodes, thickness
from archord.report.table import Table
from archord.scene.scene import Scene

HEADINGS = (
    "case", "element", "dofs", "P/(E* R): archord", "CalculiX", "difference", "p0/E*: archord", "CalculiX",
    "PEEQ max: archord", "CalculiX", "PEEQ integral/R2: archord", "CalculiX", "seconds: archord", "CalculiX",
)  # fmt: skip
_HEADER = re.compile(r"^ *(\S.*?) *\([^)]*\) *for set (\S+) and time +(\S+)$")
_EXPONENT = re.compile(r"(?<=\d)(?=[+-]\d{3}$)")  # Fortran leaves out the E before three digits
_NEAR_THE_AXIS = 0.2  # radians


@dataclass(frozen=True)
class PrintedBlock:
    """One table of a ``.dat`` file: ``quantity`` on the set ``name`` at ``time``, its ``rows`` ``(n, columns)``."""

    quantity: str
    name: str
    time: float
    rows: Array


@dataclass(frozen=True)
class SecondOpinion:
    """CalculiX's results for the whole joint at the last step, as in `archord.presets.measures.Measures`.

    ``forces`` ``(steps,)`` is P at the end of every step, ``force_balance`` the largest difference between the
    reactions of pin and block over P, ``pressure`` ``(n,)`` that of the nodes on the pin's arc at the growing angles
    ``angle`` ``(n,)`` from the contact axis. The PEEQ are zero in elastic scenes.
    """

    forces: Array
    force_balance: float
    angle: Array
    pressure: Array
    peeq_max: float
    peeq_integral: float
    iterations: int

    @property
    def P(self) -> float:
        """Force at the last step."""
        return float(self.forces[-1])

    @property
    def p0(self) -> float:
        """Pressure on the contact axis: an even parabola through the nodes near it; nan if fewer than three are
        pressed."""
        near = (self.pressure > 0) & (self.angle <= max(_NEAR_THE_AXIS, 2.001 * math.pi / 2 / (len(self.angle) - 1)))
        return float(np.polyfit(self.angle[near] ** 2, self.pressure[near], 1)[-1]) if near.sum() >= 3 else math.nan


def process(scene: Scene, mesh: PlaneMesh, folder: Path, thick: float | None = None, limit: float = 1800.0) -> Process:
    """CalculiX on the deck of ``scene`` on ``mesh``, which is written into ``folder``; its result is a `SecondOpinion`.

    The model has the deck's thickness, or ``thick``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    thick = thickness(scene) if thick is None else thick
    (folder / "joint.inp").write_text(deck(scene, mesh, thick), encoding="utf-8")
    old = tuple(f"joint.{kind}" for kind in ("dat", "frd", "sta", "cvg", "12d"))
    return Process(("ccx", "joint"), folder, lambda: read_opinion(scene, mesh, folder, thick), limit, clear=old)


def read_opinion(scene: Scene, mesh: PlaneMesh, folder: Path, thick: float) -> SecondOpinion:
    """CalculiX's results in ``folder``. Raises `Failure` if it did not reach the last step."""
    printed = read_printed((folder / "joint.dat").read_text()) if (folder / "joint.dat").exists() else []
    pin, block = (step_forces(printed, name, thick) for name in (loaded_nodes(scene), "BLOCK_HELD"))
    if len(pin) != len(scene.targets):
        said = (folder / "stdout.txt").read_text(errors="replace").splitlines()
        errors = [line.strip() for line in said if "*ERROR" in line]
        raise Failure("; ".join([f"CalculiX ended after step {len(pin)} of {len(scene.targets)}", *errors]))
    pressure = read_contact_pressure((folder / "joint.frd").read_text(), len(mesh.x))
    arc = np.unique(mesh.edge_nodes(Facets.PIN_ARC))
    angle = np.arctan2(mesh.x[arc, 0], -mesh.x[arc, 1] - scene.joint.dR)
    order = np.argsort(angle)
    largest, integral = plastic_strain(printed, mesh)
    increments = [line.split() for line in (folder / "joint.sta").read_text().splitlines()]
    return SecondOpinion(
        forces=pin,
        force_balance=float(np.abs(pin + block).max() / pin[-1]),
        angle=angle[order],
        pressure=pressure[arc[order]],
        peeq_max=largest,
        peeq_integral=integral,
        iterations=sum(int(row[3]) for row in increments if len(row) >= 6 and row[0].isdigit() and row[3].isdigit()),
    )


def read_printed(text: str) -> list[PrintedBlock]:
    """All tables of the ``.dat`` file ``text``, in its order."""
    found: list[tuple[re.Match, list[list[float]]]] = []
    for line in text.splitlines():
        header = _HEADER.match(line)
        if header:
            found.append((header, []))
        elif found and line.strip() and not line.lstrip()[0].isalpha():
            found[-1][1].append([float(_EXPONENT.sub("E", word)) for word in line.split()])
    return [PrintedBlock(h[1], h[2], float(h[3]), np.array(rows, dtype=float)) for h, rows in found]


def step_forces(printed: list[PrintedBlock], name: str, thick: float) -> Array:
    """Downward force ``(steps,)`` of the whole joint on the node set ``name`` at the end of each step.

    Per unit thickness, of a model that is ``thick``. Steps last one unit of time. CalculiX prints increments too, and
    sometimes the end of a step twice: the last counts.
    """
    forces: dict[int, float] = {}
    for block in printed:
        step = round(block.time)
        if block.quantity == "total force" and block.name == name and abs(block.time - step) < 1e-4:
            forces[step] = -2 * float(block.rows[0, 1]) / thick
    return np.array([forces[k] for k in sorted(forces)])


def plastic_strain(printed: list[PrintedBlock], mesh: PlaneMesh) -> tuple[float, float]:
    """Largest PEEQ at an integration point, and its integral over the whole joint, at the last time printed.

    Means of the elements times their areas: the points of a triangle have equal weights where its edges are straight.
    """
    latest: dict[str, Array] = {b.name: b.rows for b in printed if b.quantity == "equivalent plastic strain"}
    if not latest:
        return 0.0, 0.0
    rows = np.concatenate(list(latest.values()))
    element = rows[:, 0].astype(int) - 1
    count = np.bincount(element, minlength=len(mesh.elements))
    total = np.bincount(element, rows[:, 2], minlength=len(mesh.elements))
    return float(rows[:, 2].max()), 2 * float((total / np.maximum(count, 1)) @ areas(mesh))


def areas(mesh: PlaneMesh) -> Array:
    """Areas ``(m,)``, counting the curved edges' parabolic segments; positive if counterclockwise."""

    def polygons(order: list[int]) -> Array:
        x, y = np.moveaxis(mesh.x[mesh.elements[:, order]], 2, 0)
        return 0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1)

    corners = polygons([0, 1, 2])
    if mesh.elements.shape[1] == 3:
        return corners
    return corners + 4 / 3 * (polygons([0, 3, 1, 4, 2, 5]) - corners)  # Archimedes: a segment has 4/3 of its triangle


def read_contact_pressure(text: str, n_nodes: int) -> Array:
    """Contact pressure ``(n_nodes,)`` at the nodes, from the last CONTACT block of the ``.frd`` file ``text``.

    Columns 4 to 13 of a record are the node, from 14 on twelve to a component (COPEN, CSLIP1, CSLIP2, CPRESS, ...).
    """
    pressure = np.zeros(n_nodes)
    reading = False
    for line in text.splitlines():
        if line.startswith(" -4"):
            reading = line.split()[1] == "CONTACT"
        elif line.startswith(" -3"):
            reading = False
        elif reading and line.startswith(" -1"):
            pressure[int(line[3:13]) - 1] = float(line[49:61])
    return pressure


def cases() -> Iterator[Case]:
    """The paper's joint, elastic and plastic (sigY/E* = 0.2 %, perfect), plane strain and plane stress; R = E* = 1."""
    for plane, solid, plastic_steps in (("strain", {}, 20), ("stress", {"E": 2.0}, 10)):
        for name, steps, yield_stress in (("elastic", 4, None), ("plastic", plastic_steps, 0.002)):
            scene = paper_joint(0.04, steps, yield_stress, pin=solid, block=solid, analysis={"plane": plane})
            yield Case(f"plane {plane}, {name}", scene)


def row(case: Case, elements: Elements, ours: Run, thick: float | None = None) -> list:
    """One line of the table, which says so if CalculiX does not get to the end; ``thick`` as in `process`."""
    scene, m = case.scene, ours.result
    name = case.name if thick is None else f"{case.name}, R thick"
    mesh = deck_mesh(scene, elements)
    try:
        with tempfile.TemporaryDirectory() as folder:
            theirs = run_once(process(scene, mesh, Path(folder), thick))
    except Failure as failure:
        return [name, elements, failure] + [""] * (len(HEADINGS) - 3)
    c = theirs.result
    cells = [name, f"CP{'E' if scene.analysis.plane == 'strain' else 'S'}{mesh.elements.shape[1]}", 2 * len(mesh.x)]
    cells += [f"{m.P:.6g}", f"{c.P:.6g}", f"{100 * (c.P / m.P - 1):+.2f} %", f"{m.p0:.4g}", f"{c.p0:.4g}"]
    yielded = [f"{m.peeq_max:.2e}", f"{c.peeq_max:.2e}", f"{m.peeq_integral:.4g}", f"{c.peeq_integral:.4g}"]
    return [*cells, *(yielded if scene.plastic else "----"), f"{ours.seconds:.1f}", f"{theirs.seconds:.1f}"]


def main() -> int:
    """Solve the cases with both and print the table; returns the exit code."""
    if shutil.which("ccx") is None:
        print(
            "CalculiX (ccx) is not installed here: run ARCHORD_TARGET=peers docker/run python3 -m "
            "archord.benchmarks.peers.calculix, or install Debian's calculix-ccx.",
            file=sys.stderr,
        )
        return 2
    table = Table(*HEADINGS)
    with tempfile.TemporaryDirectory() as folder:
        for case in cases():
            start = perf_counter()
            last = case.solve(Path(folder)).steps[-1]
            ours = Run(perf_counter() - start, 0.0, 0, last)
            for elements in get_args(Elements):
                table.add(*row(case, elements, ours))
            if case.scene.plastic and case.scene.analysis.plane == "stress":
                table.add(*row(case, "quadratic", ours, case.scene.joint.radius))
            print(f"{case.name}: {perf_counter() - start:.0f} s", file=sys.stderr)
    print(table.markdown(), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())

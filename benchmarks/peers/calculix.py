"""A second opinion: CalculiX on the deck of a scene, and what its result files say."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from archord.benchmarks.timing import Failure, Process
from archord.geometry.basis import Array
from archord.geometry.shapes.joint_mesh import Facets
from archord.postprocess.deck import PlaneMesh, deck, loaded_nodes, thickness
from archord.scene.scene import Scene

_HEADER = re.compile(r"^ *(\S.*?) *\([^)]*\) *for set (\S+) and time +(\S+)$")
_EXPONENT = re.compile(r"(?<=\d)(?=[+-]\d{3}$)")  # Fortran leaves out the E before three digits
_NEAR_THE_AXIS = 0.2  # radians

Printed = list[tuple[str, str, float, Array]]  # tables of a ``.dat`` file: quantity, set, time, rows ``(n, columns)``


@dataclass(frozen=True)
class SecondOpinion:
    """CalculiX's results for the whole joint at the last step, as in `archord.presets.measures.Measures`; iterations
    of all steps."""

    P: float
    p0: float
    peeq_integral: float
    iterations: int


def process(scene: Scene, mesh: PlaneMesh, folder: Path) -> Process:
    """CalculiX on the deck of ``scene`` on ``mesh``, which is written into ``folder``; its result is a
    `SecondOpinion`."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "joint.inp").write_text(deck(scene, mesh), encoding="utf-8")
    old = tuple(f"joint.{kind}" for kind in ("dat", "frd", "sta", "cvg", "12d"))
    return Process(("ccx", "joint"), folder, lambda: read_opinion(scene, mesh, folder), clear=old)


def read_opinion(scene: Scene, mesh: PlaneMesh, folder: Path) -> SecondOpinion:
    """CalculiX's results in ``folder``. Raises `Failure` if it did not reach the last step."""
    printed = read_printed((folder / "joint.dat").read_text()) if (folder / "joint.dat").exists() else []
    forces = step_forces(printed, loaded_nodes(scene))
    if len(forces) != len(scene.targets):
        said = (folder / "stdout.txt").read_text(errors="replace").splitlines()
        errors = [line.strip() for line in said if "*ERROR" in line]
        raise Failure("; ".join([f"CalculiX ended after step {len(forces)} of {len(scene.targets)}", *errors]))
    arc = np.unique(mesh.edge_nodes(Facets.PIN_ARC))
    angle = np.arctan2(mesh.x[arc, 0], -mesh.x[arc, 1] - scene.joint.dR)
    pressure = read_contact_pressure((folder / "joint.frd").read_text(), len(mesh.x))[arc]
    increments = [line.split() for line in (folder / "joint.sta").read_text().splitlines()]
    return SecondOpinion(
        float(forces[-1]) / thickness(scene),
        axis_pressure(angle, pressure),
        peeq_integral(printed, mesh),
        sum(int(row[3]) for row in increments if len(row) >= 6 and row[0].isdigit() and row[3].isdigit()),
    )


def axis_pressure(angle: Array, pressure: Array) -> float:
    """Pressure on the contact axis: an even parabola through the nodal values ``(n,)`` within 0.2 rad of it; nan if
    fewer than three of them are pressed."""
    near = (pressure > 0) & (angle <= _NEAR_THE_AXIS)
    return float(np.polyfit(angle[near] ** 2, pressure[near], 1)[-1]) if near.sum() >= 3 else math.nan


def read_printed(text: str) -> Printed:
    """All tables of the ``.dat`` file ``text``, in its order."""
    found: list[tuple[re.Match, list[list[float]]]] = []
    for line in text.splitlines():
        header = _HEADER.match(line)
        if header:
            found.append((header, []))
        elif found and line.strip() and not line.lstrip()[0].isalpha():
            found[-1][1].append([float(_EXPONENT.sub("E", word)) for word in line.split()])
    return [(h[1], h[2], float(h[3]), np.array(rows, dtype=float)) for h, rows in found]


def step_forces(printed: Printed, nodes: str) -> Array:
    """Downward force ``(steps,)`` of the whole joint on the set ``nodes`` at the end of each step.

    Steps last one unit of time. CalculiX prints increments too, and sometimes the end of a step twice: the last counts.
    """
    forces: dict[int, float] = {}
    for quantity, name, time, rows in printed:
        if (quantity, name) == ("total force", nodes) and abs(time - round(time)) < 1e-4:
            forces[round(time)] = -2 * float(rows[0, 1])
    return np.array([forces[k] for k in sorted(forces)])


def peeq_integral(printed: Printed, mesh: PlaneMesh) -> float:
    """The integral of PEEQ over the whole joint at the last time printed.

    Means of the elements times their areas: the points of a triangle have equal weights where its edges are straight.
    """
    latest = {name: rows for quantity, name, _, rows in printed if quantity == "equivalent plastic strain"}
    rows = np.concatenate([np.zeros((0, 3)), *latest.values()])
    element = rows[:, 0].astype(int) - 1
    count = np.bincount(element, minlength=len(mesh.elements))
    total = np.bincount(element, rows[:, 2], minlength=len(mesh.elements))
    return 2 * float((total / np.maximum(count, 1)) @ areas(mesh))


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
    for line in text.rpartition(" -4  CONTACT")[2].partition("\n -3")[0].splitlines():
        if line.startswith(" -1"):
            pressure[int(line[3:13]) - 1] = float(line[49:61])
    return pressure

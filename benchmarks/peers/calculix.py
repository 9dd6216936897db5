"""A second opinion: CalculiX on the deck of a scene, and what its result files say.

As a program, ``python3 -m archord.benchmarks.peers.calculix SCENE [SECTION.KEY=VALUE ...]``, it
solves a scene, with these keys changed, by archord and by CalculiX on the same mesh, whole
processes with one thread each, and prints their last forces, their stresses at nodes and times.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from archord.benchmarks.peers.joint_script import axis_pressure
from archord.benchmarks.timing import Failure, Process, run_once, solving
from archord.geometry.basis import Array
from archord.materials.elasticity import von_mises
from archord.materials.kinematics import Arrays
from archord.postprocess.decks.deck import deck, system_of
from archord.postprocess.decks.mesh import DeckMesh, deck_mesh, label, surface_name
from archord.postprocess.decks.model import thickness
from archord.postprocess.decks.moved import moved_sets
from archord.postprocess.run import Run
from archord.presets.views import view_of
from archord.report.table import Table
from archord.scene.file import AnyScene, load_scene
from archord.solver.path.system import System
from archord.solver.problem import Problem

_HEADER = re.compile(r"^ *(\S.*?) *\([^)]*\) *for set (\S+) and time +(\S+)$")
_EXPONENT = re.compile(r"(?<=\d)(?=[+-]\d{3}$)")  # Fortran leaves out the E before three digits
_LONG = 3600.0  # seconds

Printed = list[
    tuple[str, str, float, Array]
]  # tables of a ``.dat`` file: quantity, set, time, rows ``(n, columns)``


@dataclass(frozen=True)
class SecondOpinion:
    """CalculiX's results on ``mesh``: the ``forces`` ``(steps,)`` on drives by name; at the last
    step the ``displacement`` ``(n, d)`` and the ``stress`` ``(n, 4)``, in space ``(n, 6)``, at the
    nodes (xx, yy, zz, xy, yz, zx), the pressure on the axis of a joint and the integral of PEEQ
    over the whole, nan in space; iterations of all steps."""

    mesh: DeckMesh
    forces: Arrays
    displacement: Array
    stress: Array
    p0: float | None
    peeq_integral: float
    iterations: int

    @property
    def P(self) -> float:
        """The last force on the first drive."""
        return float(next(iter(self.forces.values()))[-1])


def process(scene: AnyScene, folder: Path, given: Problem | None = None) -> Process:
    """CalculiX on the deck of ``scene``, or of the problem that was ``given`` from Python; the deck
    is written into ``folder``. Its result is a `SecondOpinion`."""
    system = system_of(scene, given)
    mesh = deck_mesh(system)
    folder.mkdir(parents=True, exist_ok=True)
    text = deck(system, mesh, scene.targets)
    (folder / "deck.inp").write_text(text, encoding="utf-8")
    old = tuple(f"deck.{kind}" for kind in ("dat", "frd", "sta", "cvg", "12d"))
    return Process(
        "CalculiX",
        ("ccx", "deck"),
        folder,
        lambda: read_opinion(scene, system, mesh, folder),
        clear=old,
    )


def read_opinion(scene: AnyScene, system: System, mesh: DeckMesh, folder: Path) -> SecondOpinion:
    """CalculiX's results in ``folder``. Raises `Failure` if it did not reach the last step."""
    tables = folder / "deck.dat"
    printed = read_printed(tables.read_text()) if tables.exists() else []
    held = moved_sets(system, mesh)[0]
    reached = len(step_forces(printed, label(held.node_set)))
    if reached != len(scene.targets):
        said = (folder / "stdout.txt").read_text(errors="replace").splitlines()
        faults = [f"CalculiX ended after step {reached} of {len(scene.targets)}"]
        faults += [line.strip() for line in said if "*ERROR" in line]
        raise Failure("; ".join(faults))
    text = (folder / "deck.frd").read_text()
    kinematics = system.problem.kinematics
    p0 = None
    centre = view_of(scene).arc_centre
    if centre is not None:
        pin_surface = surface_name(system.problem.interactions[0], 0)
        arc = np.unique(mesh.surfaces[pin_surface].nodes)
        from_centre = mesh.x - centre
        angle = np.arctan2(from_centre[:, 0], -from_centre[:, 1])
        pressure = read_nodal(text, "CONTACT", mesh)[:, 3]
        pressed = arc[pressure[arc] > 0]
        p0 = axis_pressure(angle[pressed], pressure[pressed])
    status = (folder / "deck.sta").read_text()
    increments = [line.split() for line in status.splitlines()]
    counted = [row for row in increments if len(row) > 5 and row[0].isdigit() and row[3].isdigit()]
    return SecondOpinion(
        mesh,
        drive_forces(system, mesh, printed),
        read_nodal(text, "DISP", mesh)[:, : kinematics.dimension],
        read_nodal(text, "STRESS", mesh)[:, : kinematics.n_stress],
        p0,
        peeq_integral(printed, mesh) * system.problem.whole,
        sum(int(row[3]) for row in counted),
    )


def drive_forces(system: System, mesh: DeckMesh, printed: Printed) -> Arrays:
    """Force ``(steps,)`` of the whole on every drive of supports and discs at the end of each step;
    nan where the nodes of a set do not move alike."""
    share = system.problem.whole / thickness(system.problem, mesh)
    forces: Arrays = {}
    for m in moved_sets(system, mesh):
        for drive, rate in m.rates.items():
            alike = m.whole and np.ptp(rate) == 0
            factor = share * rate[0] if alike else math.nan
            of_set = step_forces(printed, label(m.node_set))
            force = factor * of_set[:, m.axis]
            forces[drive] = force + forces.get(drive, 0.0)
    return forces


def read_printed(text: str) -> Printed:
    """All tables of the ``.dat`` file ``text``, in its order."""
    found: list[tuple[re.Match, list[list[float]]]] = []
    for line in text.splitlines():
        header = _HEADER.match(line)
        if header:
            found.append((header, []))
        elif found and line.strip() and not line.lstrip()[0].isalpha():
            _, rows = found[-1]
            rows.append([float(_EXPONENT.sub("E", word)) for word in line.split()])
    return [(h[1], h[2], float(h[3]), np.array(rows, dtype=float)) for h, rows in found]


def step_forces(printed: Printed, nodes: str) -> Array:
    """Forces ``(steps, 3)`` on the set ``nodes`` at the end of each step, which lasts one unit of
    time. CalculiX prints increments too, and sometimes the end of a step twice: the last counts."""
    forces = {}
    for quantity, name, time, rows in printed:
        step = round(time)
        if (quantity, name) == ("total force", nodes) and abs(time - step) < 1e-4:
            forces[step] = rows[0]
    of_steps = [forces[step] for step in sorted(forces)]
    return np.array(of_steps).reshape(-1, 3)


def peeq_integral(printed: Printed, mesh: DeckMesh) -> float:
    """The integral of PEEQ over the deck's model at the last time printed: means of the elements
    times their areas, as the points of a triangle have equal weights where its edges are
    straight; nan in space."""
    latest = {
        name: rows for quantity, name, _, rows in printed if quantity == "equivalent plastic strain"
    }
    if mesh.x.shape[1] == 3:
        return math.nan
    rows = np.concatenate([np.zeros((0, 3)), *latest.values()])
    area = np.concatenate([areas(mesh.x[nodes]) for nodes in mesh.elements.values()])
    element = rows[:, 0].astype(int) - 1
    count = np.bincount(element, minlength=len(area))
    total = np.bincount(element, rows[:, 2], minlength=len(area))
    mean = total / np.maximum(count, 1)
    return float(mean @ area)


def areas(x: Array) -> Array:
    """Areas ``(m,)`` of elements by their nodes ``(m, 6 or 8, 2)``, counting curved edges'
    parabolic segments; positive if counterclockwise."""
    n = x.shape[1] // 2
    corners = x[:, :n]
    around = np.stack([corners, x[:, n:]], axis=2).reshape(x.shape)  # corners and middles in turn
    straight = _polygon_areas(corners)
    whole = _polygon_areas(around)
    return straight + 4 / 3 * (whole - straight)  # Archimedes: a segment has 4/3 of its triangle


def _polygon_areas(x: Array) -> Array:
    """Areas ``(m,)`` of polygons by their corners ``(m, n, 2)``."""
    edges = np.stack([x, np.roll(x, -1, axis=1)], axis=-1)
    return np.linalg.det(edges).sum(axis=1) / 2


def read_nodal(text: str, block: str, mesh: DeckMesh) -> Array:
    """Values ``(n, 6)`` at the nodes of ``mesh``, from the last ``block`` of the ``.frd`` file
    ``text``: "DISP" (x, y, z), "CONTACT" (the fourth is the pressure), "STRESS" (xx, yy, zz, xy,
    yz, zx); zero elsewhere.

    Columns 4 to 13 of a record are the node, from 14 on twelve to a component.
    """
    values = np.zeros((len(mesh.x), 6))
    _, _, from_block = text.rpartition(f" -4  {block}")
    last_block, _, _ = from_block.partition("\n -3")
    for line in last_block.splitlines():
        if line.startswith(" -1"):
            node = int(line[3:13]) - 1
            found = [float(line[k : k + 12]) for k in range(13, len(line.rstrip()), 12)]
            values[node, : len(found)] = found
    return values


def compare(scene: Path, overrides: Sequence[str], folder: Path) -> Table:
    """archord and CalculiX on ``scene`` with ``overrides``, in ``folder``: forces, the largest von
    Mises stress at a node of every body, the difference of its stresses (root of the mean square
    over nodes, over the largest of archord's), and seconds. Raises `InputError` and `Failure`."""
    overrides = ["output.fields=nodes", *overrides]
    changes = [word for override in overrides for word in ("--set", override)]
    command = solving(str(scene.resolve()), "run", *changes)
    ours = run_once(Process("archord", command, folder, lambda: Run(folder / "run")))
    calculix = process(load_scene(scene, overrides), folder / "calculix")
    theirs = run_once(replace(calculix, limit=_LONG))
    table = Table("", "archord {:.6g}", "CalculiX {:.6g}", "difference {:+.2%}", left=1)
    run = ours.result
    opinion = theirs.result

    def add(what: str, one: float, other: float) -> None:
        table.add(what, one, other, other / one - 1)

    for load, forces in opinion.forces.items():
        column = f"{load} force" if load else "P"
        add(f"{load} force".strip(), run.columns[column][-1], forces[-1])
    fields = run.fields()
    for body, tag in run.bodies.items():
        of_body = np.flatnonzero(fields.body_of_node == tag)
        nodes = np.unique(opinion.mesh.elements[body])
        _, nearest = KDTree(fields.coordinates[of_body]).query(opinion.mesh.x[nodes])
        one = fields.stress[of_body[nearest]]
        other = opinion.stress[nodes]
        add(f"{body}: largest von Mises stress", von_mises(one).max(), von_mises(other).max())
        off = np.linalg.norm(other - one) / np.linalg.norm(one)
        table.add(f"{body}: stresses", "", "", f"{off:.2%}")
    longer = theirs.seconds / ours.seconds
    table.add("seconds", f"{ours.seconds:.1f}", f"{theirs.seconds:.1f}", f"times {longer:.1f}")
    return table


if __name__ == "__main__":
    print(compare(Path(sys.argv[1]), sys.argv[2:], Path("runs/calculix")))

"""CalculiX run on a deck of `archord.benchmarks.peers.deck`, and what its result files say of the joint."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from archord.benchmarks.peers.deck import deck, loaded_nodes, thickness
from archord.benchmarks.peers.deck_mesh import Array, PlaneMesh
from archord.geometry.joint_mesh import Facets
from archord.scene.errors import InputError
from archord.scene.scene import Scene

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
    """CalculiX's results for the whole joint at the last step, as in `archord.output.measures.Measures`.

    ``forces`` ``(steps,)`` is P at the end of every step, ``force_balance`` the largest difference between the
    reactions of pin and block over P. The PEEQ are zero in elastic scenes.
    """

    forces: Array
    force_balance: float
    p0: float
    peeq_max: float
    peeq_integral: float
    seconds: float

    @property
    def P(self) -> float:
        """Force at the last step."""
        return float(self.forces[-1])


def require_calculix() -> None:
    """Raise `InputError` if there is no ``ccx`` to run."""
    if shutil.which("ccx") is None:
        raise InputError(
            "CalculiX (ccx) is not installed here: run ARCHORD_TARGET=peers docker/run python3 -m "
            "archord.benchmarks.peers.peers, or install Debian's calculix-ccx."
        )


def run_calculix(
    scene: Scene, mesh: PlaneMesh, folder: Path, *, thick: float | None = None, timeout: float = 1800
) -> SecondOpinion:
    """Solve ``scene`` on ``mesh`` with CalculiX in ``folder``, in a model of the deck's thickness, or ``thick``.

    Raises `InputError` if there is no ``ccx``, RuntimeError if it does not reach the last step within ``timeout``
    seconds.
    """
    require_calculix()
    thick = thickness(scene) if thick is None else thick
    (folder / "joint.inp").write_text(deck(scene, mesh, thick), encoding="utf-8")
    start = perf_counter()
    try:
        done = subprocess.run(["ccx", "joint"], cwd=folder, capture_output=True, text=True, timeout=timeout)
    except subprocess.TimeoutExpired:
        raise RuntimeError(f"CalculiX did not finish within {timeout:g} s") from None
    return read_opinion(scene, mesh, folder, done.stdout, thick, perf_counter() - start)


def read_opinion(
    scene: Scene, mesh: PlaneMesh, folder: Path, said: str, thick: float | None = None, seconds: float = math.nan
) -> SecondOpinion:
    """CalculiX's results in ``folder``, for which it took ``seconds`` and ``said`` this on the terminal.

    Raises RuntimeError if it did not reach the last step.
    """
    thick = thickness(scene) if thick is None else thick
    printed = read_printed((folder / "joint.dat").read_text()) if (folder / "joint.dat").exists() else []
    pin, block = (step_forces(printed, name, thick) for name in (loaded_nodes(scene), "BLOCK_HELD"))
    if len(pin) != len(scene.targets):
        errors = [line.strip() for line in said.splitlines() if "*ERROR" in line]
        raise RuntimeError("; ".join([f"CalculiX ended after step {len(pin)} of {len(scene.targets)}", *errors]))
    pressure = read_contact_pressure((folder / "joint.frd").read_text(), len(mesh.x))
    largest, integral = plastic_strain(printed, mesh)
    return SecondOpinion(
        forces=pin,
        force_balance=float(np.abs(pin + block).max() / pin[-1]),
        p0=axis_pressure(scene, mesh, pressure),
        peeq_max=largest,
        peeq_integral=integral,
        seconds=seconds,
    )


def read_printed(text: str) -> list[PrintedBlock]:
    """All tables of the ``.dat`` file ``text``, in its order."""
    blocks: list[PrintedBlock] = []
    rows: list[list[float]] = []

    def close() -> None:
        if blocks:
            last = blocks.pop()
            blocks.append(PrintedBlock(last.quantity, last.name, last.time, np.array(rows, dtype=float)))

    for line in text.splitlines():
        header = _HEADER.match(line)
        if header:
            close()
            rows = []
            blocks.append(PrintedBlock(header[1], header[2], float(header[3]), np.empty((0, 0))))
        elif line.strip() and blocks and not line.lstrip()[0].isalpha():
            rows.append([float(_EXPONENT.sub("E", word)) for word in line.split()])
    close()
    return blocks


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
    return float(rows[:, 2].max()), 2 * float((total / np.maximum(count, 1)) @ mesh.areas())


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


def axis_pressure(scene: Scene, mesh: PlaneMesh, pressure: Array) -> float:
    """Pressure ``p0`` on the contact axis: an even parabola through the ``pressure`` at the pin's nodes near it."""
    nodes = np.unique(mesh.edge_nodes(Facets.PIN_ARC))
    x, y = mesh.x[nodes].T
    angle = np.arctan2(x, -y - scene.joint.dR)
    order = np.argsort(angle)
    pressed = order[pressure[nodes[order]] > 0]
    near = pressed[angle[pressed] <= max(_NEAR_THE_AXIS, 2.001 * math.pi / 2 / (len(nodes) - 1))]
    if len(near) < 3:
        return math.nan
    return float(np.polyfit(angle[near] ** 2, pressure[nodes[near]], 1)[-1])

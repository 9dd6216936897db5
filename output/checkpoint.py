"""checkpoint.h5: what a run needs to go on, on any number of ranks: displacement, increment,
history, step control.

The file is an HDF5 file behind a line of text that holds its format and a checksum over the rest,
so that a damaged one is refused before it is read. Nodes, cells and points are in the order of the
mesh generator; of the points with history only those that yielded are stored. Each step replaces
the file in one move.
"""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from archord.geometry.basis import Array
from archord.measures.energies import Work
from archord.measures.record import Record
from archord.output.files.disk import replace_file
from archord.output.files.step_file import all_arrays, hdf5_in_memory, image, put
from archord.report.by_name import ByName
from archord.report.errors import InputError
from archord.report.readable import require_file
from archord.report.version import VERSION
from archord.solver.contact.quadrature import RULE
from archord.solver.path.load_path import Position
from archord.solver.path.mesh_order import Arrays, MeshOrder
from archord.solver.path.newton import Newton
from archord.solver.path.stepping import Step

_HEADER = 512  # HDF5 looks for its own beginning at powers of two from here


@dataclass
class Checkpoint:
    """What the file holds of a run after ``step`` output steps.

    ``arrays`` are in the mesh generator's order: "fields/displacement" and "fields/increment" ``(n,
    2)``, and what `MeshOrder.collect_history` returns. ``scalars`` is whatever JSON can hold,
    ``scene`` the resolved scene as TOML.
    """

    step: int
    scene: str
    mesh: str
    scalars: ByName
    arrays: Arrays

    @property
    def contact_points(self) -> str:
        """The rule by which contact points lie; version 0.2 did not write its own."""
        return self.scalars.get("contact_points", "halved")


def halt(
    order: MeshOrder, scene: str, m: Record, step: Step, position: Position, work: Work
) -> Checkpoint:
    """The checkpoint (on rank 0) of a run of ``scene`` after the step ``m``, reached as ``step``
    says, from which `resume` goes on. Collective."""
    system = order.system
    springs = system.equilibrium.springs
    unknowns = system.equilibrium.unknowns
    u, levels = unknowns.split(unknowns.state())
    scalars = {
        "measures": m.plain(),
        "step": asdict(step),
        "work": asdict(work),
        "position": {name: value for name, value in vars(position).items() if name != "increment"},
        "largest_reaction": system.equilibrium.largest_reaction,
        "stabilisation_energy": springs.energy if springs else 0.0,
        "springs_idle": springs is not None and springs.idle,
        "gamma_by_and_by": system.solver.continues_gamma,
        "level": levels.tolist(),
        "contact_points": RULE.get(),
        "sets": order.sets_digest,
    }
    arrays = order.collect_history() | {"fields/displacement": order.collect(u)}
    if position.increment is not None:
        of_nodes, of_levels = unknowns.split(position.increment)
        scalars["level_increment"] = of_levels.tolist()
        arrays["fields/increment"] = order.collect(of_nodes)
    mesh = order.mesh_digest() if system.comm.rank == 0 else ""
    return Checkpoint(m.step, scene, mesh, scalars, arrays)


def require_same_mesh(order: MeshOrder, path: Path, checkpoint: Checkpoint | None) -> Any:
    """The scalars of ``checkpoint`` (needed on rank 0 only, read from ``path``). Raises
    `InputError` if it is of another mesh, or its sets lie elsewhere. Collective."""
    known = checkpoint and (checkpoint.mesh == order.mesh_digest(), checkpoint.scalars)
    same_mesh, scalars = order.system.comm.bcast(known)
    fault = ""
    if not same_mesh:
        fault = "belongs to another mesh than the scene makes here (another version of gmsh?)"
    elif "sets" in scalars and scalars["sets"] != order.system.comm.bcast(order.sets_digest):
        fault = "belongs to other bodies, supports, loads or surfaces of this mesh: its sets differ"
    if fault:
        raise InputError(path, f"{fault}, so that the run cannot be continued.")
    return scalars


def resume(
    order: MeshOrder, path: Path, checkpoint: Checkpoint | None
) -> tuple[Record, Step, Position, Work]:
    """Give the system the state of ``checkpoint`` (needed on rank 0 only, read from ``path``);
    returns what `halt` was given. Raises `InputError` as `require_same_mesh`. Collective."""
    scalars = require_same_mesh(order, path, checkpoint)
    order.spread_history(checkpoint.arrays if checkpoint else None)

    def state(name: str, level: str) -> Array:
        return np.append(
            order.spread(checkpoint.arrays[name] if checkpoint else None), scalars[level]
        )

    position = Position(**scalars["position"])
    if "level_increment" in scalars:
        position.increment = state("fields/increment", "level_increment")
    system = order.system
    if system.equilibrium.springs:
        system.equilibrium.springs.energy = scalars["stabilisation_energy"]
        # version 0.2 did not write it; where they are not idle, guesses only take longer
        system.equilibrium.springs.idle = scalars.get("springs_idle", False)
    system.solver.continues_gamma = scalars["gamma_by_and_by"]
    solved = state("fields/displacement", "level")
    system.equilibrium.resume(position.load, solved, scalars["largest_reaction"])
    step = Step(**scalars["step"])
    step.attempts = [_newton(attempt) for attempt in scalars["step"]["attempts"]]
    return Record.read(scalars["measures"]), step, position, Work(**scalars["work"])


def _newton(attempt: ByName) -> Newton:
    """A solve as a checkpoint holds it; version 0.1 called active-set changes flips."""
    names = {"flips": "active_set_changes"}
    return Newton(**{names.get(name, name): value for name, value in attempt.items()})


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Replace ``path`` by ``checkpoint``. Raises `OSError`."""
    facts = {
        "archord": VERSION,
        "step": checkpoint.step,
        "scene": checkpoint.scene,
        "scalars": checkpoint.scalars,
    }
    with hdf5_in_memory() as file:
        file.attrs["mesh"] = checkpoint.mesh
        file["facts"] = json.dumps(facts)
        for name, values in checkpoint.arrays.items():
            put(file, name, values)
        body = image(file)
    replace_file(path, _header(body) + body, durable=True)


def _header(body: bytes) -> bytes:
    """What stands before the HDF5 file ``body``."""
    line = f"archord checkpoint, format 1, sha256 {hashlib.sha256(body).hexdigest()}\n"
    return line.encode().ljust(_HEADER, b"\0")


def read(path: Path) -> Checkpoint:
    """Read ``path``, of this version or 0.1. Raises `InputError` if it is missing, damaged, or of a
    newer archord."""
    try:
        content = require_file(path).read_bytes()
    except OSError as error:
        raise InputError(
            path, f"cannot be read, so that the run cannot be continued: {error.strerror}."
        ) from None
    body = content[_HEADER:]
    if content[:_HEADER] != _header(body):
        raise InputError(
            path, "is damaged or of a newer archord, so that the run cannot be continued."
        )
    with h5py.File(io.BytesIO(body), "r") as file:
        mesh = file.attrs["mesh"]
        arrays = dict(all_arrays(file))
    facts = json.loads(bytes(arrays.pop("facts")))
    return Checkpoint(facts["step"], facts["scene"], mesh, facts["scalars"], arrays)

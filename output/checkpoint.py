"""checkpoint.h5: what a run needs to go on, on any number of ranks: displacement, increment, history, step control.

The file is an HDF5 file behind a line of text that holds its format and a checksum over the rest, so that a damaged one
is refused before it is read. Nodes, cells and points are in the order of the mesh generator; of the points with history
only those that yielded are stored. Each step replaces the file in one move.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from archord.geometry.basis import Array
from archord.output.disk import replace_file
from archord.presets.measures import Measures, Work
from archord.report.version import VERSION
from archord.scene.errors import InputError
from archord.solver.load_path import Position
from archord.solver.mesh_order import Arrays, MeshOrder
from archord.solver.newton import Newton
from archord.solver.stepping import Step

FORMAT = 1
_HEADER = 512  # HDF5 looks for its own beginning at powers of two from here
_FIRST_LINE = re.compile(rb"archord checkpoint, format (\d+), sha256 ([0-9a-f]{64})\n")


@dataclass
class Checkpoint:
    """State of a run after ``step`` output steps.

    ``fields`` are nodal ``(n, 2)`` and ``history`` is as `MeshOrder.collect_history` returns it, both in the mesh
    generator's order; ``scalars`` is whatever JSON can hold, ``scene`` the resolved scene as TOML.
    """

    step: int
    scene: str
    mesh: str
    fields: dict[str, Array]
    history: dict[str, Arrays]
    scalars: dict[str, Any] = field(default_factory=dict)
    version: str = VERSION


@dataclass
class RunState:
    """Where a run is after an output step: the step, in numbers and in how it was reached, and what the next one starts
    from."""

    measures: Measures
    step: Step
    position: Position
    work: Work


def collect(order: MeshOrder, step: int, scene: str, fields: dict[str, Array], scalars: dict[str, Any]) -> Checkpoint:
    """The history of all points, nodal ``fields`` ``(n_local, 2)`` and ``scalars`` after ``step``, on rank 0.

    Collective.
    """
    whole = {name: order.collect(values) for name, values in fields.items()}
    history = order.collect_history()
    mesh = order.mesh_digest() if order.system.comm.rank == 0 else ""
    return Checkpoint(step, scene, mesh, whole, history, scalars)


def restore(order: MeshOrder, path: Path, checkpoint: Checkpoint | None) -> tuple[dict[str, Array], dict[str, Any]]:
    """Give the points the history of ``checkpoint`` (known on rank 0, read from ``path``); returns this rank's nodal
    fields ``(n_local, 2)`` and the scalars. Collective. Raises `InputError` on every rank if it is of another mesh."""
    comm = order.system.comm
    fault = None
    if checkpoint is not None and checkpoint.mesh != order.mesh_digest():
        fault = (
            f"{path}: belongs to another mesh than the scene makes here (another version of gmsh?), so that the run "
            "cannot be continued."
        )
    fault = comm.bcast(fault)
    if fault:
        raise InputError(fault)
    order.spread_history(None if checkpoint is None else checkpoint.history)
    names, scalars = comm.bcast(None if checkpoint is None else (list(checkpoint.fields), checkpoint.scalars))
    fields = {name: order.spread(None if checkpoint is None else checkpoint.fields[name]) for name in names}
    return fields, scalars


def halt(order: MeshOrder, scene: str, at: RunState) -> Checkpoint:
    """The checkpoint (on rank 0) of a run of ``scene``, from which `resume` goes on. Collective."""
    system, position = order.system, at.position
    state = system.equilibrium.state()
    fields = {"displacement": _nodal(state)}
    scalars = {
        "measures": asdict(at.measures),
        "step": asdict(at.step),
        "work": vars(at.work),
        "position": {name: value for name, value in vars(position).items() if name != "increment"},
        "largest_reaction": system.equilibrium.largest_reaction,
        "gamma_by_and_by": system.solver.continues_gamma,
        "level": float(state[-1]),
    }
    if position.increment is not None:
        fields["increment"] = _nodal(position.increment)
        scalars["level_increment"] = float(position.increment[-1])
    return collect(order, at.measures.step, scene, fields, scalars)


def resume(order: MeshOrder, path: Path, checkpoint: Checkpoint | None) -> RunState:
    """Give the system the state of ``checkpoint`` (needed on rank 0 only, read from ``path``). Collective.

    Raises `InputError` if it is of another mesh.
    """
    fields, scalars = restore(order, path, checkpoint)
    position = Position(**scalars["position"])
    if "increment" in fields:
        position.increment = np.append(fields["increment"], scalars["level_increment"])
    work = Work()
    vars(work).update(scalars["work"])
    step = Step(**scalars["step"])
    step.attempts = [_newton(attempt) for attempt in scalars["step"]["attempts"]]
    state = np.append(fields["displacement"], scalars["level"])
    order.system.solver.continues_gamma = scalars.get("gamma_by_and_by", False)
    order.system.equilibrium.resume(position.load, state, scalars["largest_reaction"])
    return RunState(Measures(**scalars["measures"]), step, position, work)


def _newton(attempt: dict[str, Any]) -> Newton:
    """A solve as a checkpoint holds it; version 0.1 called active-set changes flips."""
    changes = {"active_set_changes": attempt.pop("flips")} if "flips" in attempt else {}
    return Newton(**attempt, **changes)


def _nodal(state: Array) -> Array:
    """The displacements ``(n_local, 2)`` in a state of the equilibrium."""
    return state[:-1].reshape(-1, 2)


def write(path: Path, checkpoint: Checkpoint) -> None:
    """Replace ``path`` by ``checkpoint``. Raises `OSError`."""
    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        facts = {"archord": checkpoint.version, "step": checkpoint.step, "scene": checkpoint.scene}
        file.attrs["mesh"] = checkpoint.mesh
        file["facts"] = json.dumps(facts | {"scalars": checkpoint.scalars})
        for name, values in checkpoint.fields.items():
            file[f"fields/{name}"] = values
        for place, arrays in checkpoint.history.items():
            for name, values in arrays.items():
                file[f"history/{place}/{name}"] = values
    body = memory.getvalue()
    line = f"archord checkpoint, format {FORMAT}, sha256 {hashlib.sha256(body).hexdigest()}\n"
    replace_file(path, line.encode().ljust(_HEADER, b"\0") + body, durable=True)


def read(path: Path) -> Checkpoint:
    """Read ``path``. Raises `InputError` if it is missing, damaged, or of a newer archord."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: is missing, so that the run cannot be continued.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}.") from None
    line = _FIRST_LINE.match(content)
    if line is None:
        raise InputError(f"{path}: is damaged or no checkpoint, so that the run cannot be continued.")
    if int(line[1]) > FORMAT:
        raise InputError(
            f"{path}: has format {int(line[1])}, of a newer archord; this one ({VERSION}) reads up to {FORMAT}."
        )
    body = content[_HEADER:]
    padding = content[line.end() : _HEADER]
    if any(padding) or hashlib.sha256(body).hexdigest().encode() != line[2]:
        raise InputError(f"{path}: is damaged (its checksum is wrong), so that the run cannot be continued.")
    with h5py.File(io.BytesIO(body), "r") as file:
        facts = json.loads(file["facts"].asstr()[()])
        history = {
            place: {name: values[()] for name, values in group.items()}
            for place, group in file.get("history", {}).items()
        }
        fields = {name: values[()] for name, values in file["fields"].items()}
        mesh = file.attrs["mesh"]
    return Checkpoint(facts["step"], facts["scene"], mesh, fields, history, facts["scalars"], facts["archord"])

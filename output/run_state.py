"""Where a run stands after an output step, between the joint in memory and the checkpoint on disk."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.output.checkpoint import Checkpoint, collect, restore
from archord.presets.measures import Measures, Work
from archord.scene.file import resolved
from archord.solver.load_path import Position
from archord.solver.mesh_order import MeshOrder
from archord.solver.newton import Newton
from archord.solver.stepping import Step


@dataclass
class Standing:
    """The last output step, in numbers and in how it was reached, and what the next one starts from."""

    measures: Measures
    step: Step
    position: Position
    work: Work


def halt(order: MeshOrder, standing: Standing) -> Checkpoint:
    """The checkpoint (on rank 0) from which `resume` goes on. Collective."""
    joint, position = order.system, standing.position
    state = joint.equilibrium.state()
    fields = {"displacement": _nodal(state)}
    scalars = {
        "measures": asdict(standing.measures),
        "step": asdict(standing.step),
        "work": vars(standing.work),
        "position": {name: value for name, value in vars(position).items() if name != "increment"},
        "largest_reaction": joint.equilibrium.largest_reaction,
        "gamma_by_and_by": joint.solver.continues_gamma,
        "level": float(state[-1]),
    }
    if position.increment is not None:
        fields["increment"] = _nodal(position.increment)
        scalars["level_increment"] = float(position.increment[-1])
    return collect(order, standing.measures.step, resolved(joint.scene), fields, scalars)


def resume(order: MeshOrder, path: Path, checkpoint: Checkpoint | None) -> Standing:
    """Give the joint the state of ``checkpoint`` (needed on rank 0 only, read from ``path``). Collective.

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
    return Standing(Measures(**scalars["measures"]), step, position, work)


def _newton(attempt: dict[str, Any]) -> Newton:
    """A solve as a checkpoint holds it; version 0.1 called active-set changes flips."""
    changes = {"active_set_changes": attempt.pop("flips")} if "flips" in attempt else {}
    return Newton(**attempt, **changes)


def _nodal(state: Array) -> Array:
    """The displacements ``(n_local, 2)`` in a state of the equilibrium."""
    return state[:-1].reshape(-1, 2)

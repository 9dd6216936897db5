"""What a run can be continued from, and with which scene: planned by rank 0, from the files in the run's folder."""

from __future__ import annotations

import json
import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from archord.output import checkpoint as checkpoints
from archord.output.checkpoint import Checkpoint
from archord.output.folder import CHECKPOINT
from archord.presets.measures import Measures
from archord.scene.errors import InputError
from archord.scene.file import load_scene, parse_scene, resolved
from archord.scene.keys import toml_value
from archord.scene.scene import Scene

_MAY_DIFFER = ("stepping.", "analysis.max_iterations")
_SAME = 1e-9  # relative difference up to which two targets are one


@dataclass
class Start:
    """A run to go on from: its last checkpoint, its run.json, and the steps ``done`` before the checkpoint's."""

    checkpoint: Checkpoint
    report: dict[str, Any]
    done: list[Measures]


@dataclass
class Plan:
    """The scene to solve and from where; no ``start`` means from the beginning, ``finished`` that nothing is to do.

    ``said`` is a sentence for the user.
    """

    scene: Scene
    start: Start | None
    said: str
    finished: bool = False


def plan_restart(folder: Path, scene: Scene | None = None) -> Plan:
    """How to continue the interrupted run in ``folder`` with ``scene``, by default the run's own.

    Raises `InputError` if the scene is another one than the run's or its files do not allow it.
    """
    if scene is not None and not (folder / "scene.toml").exists() and not (folder / CHECKPOINT).exists():
        return Plan(scene, None, f"{folder} holds no run yet: starting from the beginning")
    own = load_scene(folder / "scene.toml")
    scene = own if scene is None else scene
    _same_but_for(folder, own, scene, ())
    if not (folder / CHECKPOINT).exists():
        return Plan(scene, None, f"{folder} holds no accepted step: starting from the beginning")
    start = _start(folder, scene)
    step, total = start.checkpoint.step, len(scene.targets)
    if step == total and start.report["status"] == "done":
        return Plan(scene, None, f"the run in {folder} is finished: nothing to do", finished=True)
    return Plan(scene, start, f"continuing {folder} after step {step} of {total}")


def plan_extension(folder: Path, scene: Scene) -> Plan:
    """How to continue the finished run in ``folder`` to the end of the path of ``scene``.

    That path begins with the run's own, or both only grow; then its targets beyond the run's end are added. Raises
    `InputError` if neither holds, another key differs, or the run is not finished.
    """
    if not (folder / "scene.toml").exists():
        raise InputError(f"{folder}: is not a run folder: scene.toml is missing.")
    own = load_scene(folder / "scene.toml")
    _same_but_for(folder, own, scene, ("load.displacement", "load.relative_force", "load.force", "load.steps"))
    if own.force_controlled != scene.force_controlled:
        raise InputError(f"{folder}: was loaded by load.{own.load.name}; load.{scene.load.name} cannot extend it.")
    done, wanted = np.array(own.targets), np.array(scene.targets)
    scale = np.abs(done).max()
    if len(wanted) >= len(done) and np.allclose(wanted[: len(done)], done, rtol=0, atol=_SAME * scale):
        added = wanted[len(done) :]
    elif own.monotonic and scene.monotonic:
        added = wanted[wanted > done[-1] + _SAME * scale]
    else:
        raise InputError(
            f"{folder}: its path does not begin the new one; unless both only grow, load.{scene.load.name} must start "
            "with the targets and steps of the run."
        )
    if not len(added):
        raise InputError(f"{folder}: ends at {own.targets[-1]:g} already; load.{scene.load.name} goes no further.")
    if not (folder / CHECKPOINT).exists():
        raise InputError(f"{folder / CHECKPOINT}: is missing, so that the run cannot be continued.")
    longer = _extended(own, scene, added)
    start = _start(folder, longer)
    step, total = start.checkpoint.step, len(own.targets)
    if start.report["status"] != "done" or step != total:
        raise InputError(f"{folder}: is not finished ({step} of {total} steps); finish it with --restart first.")
    return Plan(longer, start, f"extending {folder} from step {step} to step {len(longer.targets)}")


def _extended(own: Scene, scene: Scene, added: np.ndarray) -> Scene:
    """``scene`` with the path of ``own`` and, behind it, the targets ``added``, evenly spaced ones in one leg."""
    name = own.load.name
    begin, legs, steps = own.targets[-1], list(own.load.legs), list(own.load.leg_steps)
    spacing = np.diff([begin, *added])
    n_own = len(legs)
    for end, width, before in zip(added, spacing, [np.nan, *spacing], strict=False):
        leg = float(f"{end / own.load_unit:.15g}")
        if len(legs) > n_own and abs(width - before) <= _SAME * abs(width):
            legs[-1], steps[-1] = leg, steps[-1] + 1
        else:
            legs.append(leg)
            steps.append(1)
    data = tomllib.loads(resolved(scene))
    load = own.load.model_dump(exclude_none=True)
    return parse_scene(data | {"load": load | {name: legs, "steps": steps}}, "the extended scene")


def _start(folder: Path, scene: Scene) -> Start:
    """Read and compare what the run left."""
    found = checkpoints.read(folder / CHECKPOINT)
    before = parse_scene(tomllib.loads(found.scene), str(folder / CHECKPOINT))
    _same_but_for(folder, before, scene, ("load.",))
    n = found.step
    if not np.allclose(before.targets[:n], scene.targets[:n], rtol=_SAME, atol=0) or len(scene.targets) < n:
        raise InputError(f"{folder / CHECKPOINT}: was reached on another path than that of the scene.")
    path = folder / "run.json"
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        names = [field.name for field in fields(Measures)]
        done = [Measures(**{name: step[name] for name in names}) for step in report["steps"][: n - 1]]
        if len(done) < n - 1 or not {"status", "started", "command", "warnings"} <= report.keys():
            raise KeyError("steps")
    except FileNotFoundError:
        raise InputError(f"{path}: is missing, so that the run cannot be continued.") from None
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(f"{path}: does not hold the {n - 1} steps before the checkpoint's.") from None
    return Start(found, report, done)


def _same_but_for(folder: Path, own: Scene, scene: Scene, free: tuple[str, ...]) -> None:
    """Raise `InputError` naming a key that differs between the run's ``own`` scene and ``scene``, unless it may."""
    a, b = (_keys(s) for s in (own, scene))
    for key in sorted({*a, *b}):
        if a.get(key) != b.get(key) and not key.startswith((*_MAY_DIFFER, *free)):
            there, here = (toml_value(v[key]) if key in v else "absent" for v in (a, b))
            raise InputError(
                f"{folder}: was solved with {key} = {there}, the scene says {here}; only [stepping] and "
                f"analysis.max_iterations may change{' besides the load' if free else ''}."
            )


def _keys(scene: Scene) -> dict[str, Any]:
    """Every key of the resolved scene by its dotted name."""
    found: dict[str, Any] = {}
    for section, keys in tomllib.loads(resolved(scene)).items():
        if isinstance(keys, dict):
            found |= {f"{section}.{name}": value for name, value in keys.items()}
        else:
            found[section] = keys
    return found

"""What a run can be continued from, and with which scene: planned by rank 0, from the files in the
run's folder."""

from __future__ import annotations

import tomllib
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from archord.measures.record import Record
from archord.output import checkpoint as checkpoints
from archord.output.checkpoint import Checkpoint
from archord.output.files.seal import TABLES, fault_of, read_report, require_intact
from archord.output.finished import fault_of_mesh, fault_of_run, history_fault
from archord.output.folder import CHECKPOINT, report_of
from archord.report.by_name import ByName
from archord.report.errors import InputError
from archord.report.readable import require_file
from archord.scene.file import AnyScene, find_mesh, load_scene, parse_any, scene_keys
from archord.scene.parts import LoadSection
from archord.scene.sections.errors import toml_value

if TYPE_CHECKING:
    from archord.solver.path.system import System

_TARGETS = ("load.displacement", "load.relative_force", "load.force", "load.steps", "path.steps")
_MAY_DIFFER = ("stepping.", "analysis.max_iterations", *_TARGETS)
_OUT_OF_BALANCE = 1e-4  # over the largest reaction
_SAME = 1e-9  # relative difference up to which two targets are one


@dataclass
class Start:
    """A run to go on from: its checkpoint, its run.json, and the steps ``done`` before the
    checkpoint's."""

    checkpoint: Checkpoint
    report: ByName
    done: list[Record]


@dataclass
class Plan:
    """The scene to solve and from where; no ``start`` means from the beginning, ``finished`` that
    nothing is to do. ``said`` is a sentence for the user."""

    scene: AnyScene
    start: Start | None
    said: str
    finished: bool = False


def plan_restart(folder: Path, scene: AnyScene | None = None, *, extend: bool = False) -> Plan:
    """How to continue the run in ``folder`` with ``scene``, by default the run's own; to ``extend``
    it, that must go further than the run did.

    Raises `InputError` if the accepted steps are not the first ones of the scene, or the run's
    files do not allow it.
    """
    scene = load_scene(folder / "scene.toml") if scene is None else scene
    if not extend and not (folder / CHECKPOINT).exists():
        if (folder / "scene.toml").exists():
            _same_but_for_the_load(folder, load_scene(folder / "scene.toml"), scene)
        if scene.output.checkpoint:
            said = f"{folder} holds no accepted step: starting from the beginning"
            return Plan(scene, None, said)
        return _plan_without_checkpoint(folder, scene)
    start = _start(folder, scene)
    step = start.checkpoint.step
    total = len(scene.targets)
    if extend and step == total:
        raise InputError(
            folder, f"ends at {scene.targets[-1]:g} already; {scene.loading} goes no further."
        )
    if step == total and start.report["status"] == "done":
        lost = _lost_tables(folder, scene, start.report)
        if lost:
            return Plan(
                scene, start, f"the run in {folder} is finished: writing {' and '.join(lost)} again"
            )
        said = f"the run in {folder} is finished: nothing to do"
        return Plan(scene, start, said, finished=True)
    said = f"{'extending' if extend else 'continuing'} {folder} after step {step} of {total}"
    changed = [name for name in TABLES if fault_of(folder, name, start.report.get("files", {}))]
    return Plan(scene, start, f"{said}, writing {' and '.join(changed)} again" if changed else said)


def _plan_without_checkpoint(folder: Path, scene: AnyScene) -> Plan:
    """A finished run stays, another one is solved from the beginning."""
    report = report_of(folder)
    if report.get("status") == "done" and not fault_of_run(folder, scene, report):
        said = f"the run in {folder} is finished: nothing to do"
        return Plan(scene, None, said, finished=True)
    said = f"{folder} has no checkpoint, as output.checkpoint = false: starting from the beginning"
    return Plan(scene, None, said)


def _lost_tables(folder: Path, scene: AnyScene, report: ByName) -> list[str]:
    """Those of the files that a run makes from the others which are missing, changed, or lack a
    step."""
    seals = report.get("files", {})
    lost = [name for name in TABLES if fault_of(folder, name, seals)]
    if "history.csv" not in lost and history_fault(folder, report):
        lost.append("history.csv")
    if scene.output.fields and not _ends(folder / "fields.xdmf", "</Xdmf>\n"):
        lost.append("fields.xdmf")
    return lost


def _ends(path: Path, ending: str) -> bool:
    with suppress(OSError, ValueError):
        return require_file(path).read_text(encoding="utf-8").endswith(ending)
    return False


def _start(folder: Path, scene: AnyScene) -> Start:
    """Read what the run left. Raises `InputError` if that is not the first steps of ``scene``."""
    path = folder / CHECKPOINT
    if not scene.output.checkpoint and not path.exists():
        said = "has no checkpoint, as it was solved with output.checkpoint = false"
        raise InputError(folder, f"{said}, so that the run cannot be continued.")
    checkpoint = checkpoints.read(path)
    data = tomllib.loads(checkpoint.scene)
    find_mesh(data.get("mesh"), folder)
    before = parse_any(data, str(path))
    _same_but_for_the_load(folder, before, scene)
    n = checkpoint.step
    reached = np.array(before.travelled[:n])
    wanted = np.array(scene.travelled[:n])
    same = len(wanted) == n
    if same:
        apart = np.abs(wanted - reached).max(axis=0)
        same = (apart <= _SAME * np.abs(reached).max(axis=0)).all()
    if not same:
        said = f"{scene.loading} and its steps must begin as the steps of the run"
        raise InputError(path, f"its {n} steps are not the first ones of the scene's path; {said}.")
    path = folder / "run.json"
    try:
        report = read_report(path)
        done = [Record.read(step) for step in report["steps"][: n - 1]]
        if len(done) < n - 1 or not {"status", "started", "command", "warnings"} <= report.keys():
            raise KeyError("steps")
    except (OSError, ValueError, KeyError, TypeError):
        said = (
            f"is missing, was changed, or lacks some of the {n - 1} steps before the checkpoint's"
        )
        raise InputError(path, f"{said}.") from None
    if fault := fault_of_mesh(scene, report):
        raise InputError(folder, f"{fault}, so that the run cannot be continued.")
    seals = report.get("files", {})
    require_intact(folder, [name for name in seals if name not in TABLES])
    return Start(checkpoint, report, done)


def _same_but_for_the_load(folder: Path, own: AnyScene, scene: AnyScene) -> None:
    """Raise `InputError` naming a key that differs between the run's ``own`` scene and ``scene``,
    unless it may."""
    if own.loading != scene.loading:
        raise InputError(
            folder, f"was loaded by {own.loading}; {scene.loading} cannot continue it."
        )
    a, b = (_without_targets(scene_keys(each)) for each in (own, scene))
    for key in sorted({*a, *b}):
        if a.get(key) != b.get(key) and not key.startswith(_MAY_DIFFER):
            there, here = (toml_value(keys[key]) if key in keys else "absent" for keys in (a, b))
            raise InputError(
                folder,
                f"was solved with {key} = {there}, the scene says {here}; only "
                "[stepping], analysis.max_iterations and the load's further targets may change.",
            )


def _without_targets(keys: ByName) -> ByName:
    """The ``keys`` of a scene, its loads without their values."""
    if "load" not in keys:
        return keys
    loads = [
        {key: value for key, value in load.items() if key not in LoadSection.kinds}
        for load in keys["load"]
    ]
    return keys | {"load": loads}


def require_same_sides(folder: Path, before: ByName, system: System) -> None:
    """Raise `InputError` where the run with the report ``before`` integrated a contact on other
    sides than the ``system`` does, as earlier versions did."""
    shares = before.get("model", {}).get("contact_shares")
    if not isinstance(shares, dict):
        return
    for interface in system.contact.interfaces:
        name = interface.interaction.name
        now = len(interface.pairs)
        if len(shares.get(name, interface.pairs)) != now:
            said = f"was solved with {name!r} integrated on {len(shares[name])} sides"
            raise InputError(folder, f"{said}, which is {now} in this version: solve it again.")


def require_balance(folder: Path, step: int, system: System) -> None:
    """Raise `InputError` where the ``system`` has taken up a ``step`` that is no equilibrium in
    this version: what it solves has changed since the run was halted. Collective."""
    off = system.equilibrium.out_of_balance()
    if off > max(_OUT_OF_BALANCE, 10 * system.problem.tolerance):
        said = f"was halted after step {step} by a version that solves it otherwise"
        raise InputError(
            folder, f"{said}: {off:.2g} of its forces are out of balance here; solve it again."
        )

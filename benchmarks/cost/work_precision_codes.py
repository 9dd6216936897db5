"""The codes of the work-precision benchmark as processes to be timed: archord, CalculiX on its decks, and peers."""

from __future__ import annotations

import importlib.metadata
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from archord.benchmarks.case import matches, slug
from archord.benchmarks.cost.work_precision_cases import DECKS, SERIES, JointCase, Kinematics, Mesh, Series
from archord.benchmarks.cost.work_precision_reference import interpolated, profile_of, values_of
from archord.benchmarks.peers import calculix
from archord.benchmarks.peers.installed import Peer, installed
from archord.benchmarks.timing import LIMIT, Failure, Process, last_core
from archord.geometry.basis import Array
from archord.output.history import read_history
from archord.postprocess.deck import deck_mesh
from archord.scene.errors import InputError
from archord.scene.file import resolved

OURS, CALCULIX = "archord", "CalculiX"


@dataclass(frozen=True)
class Values:
    """What a code found at the last step: ``quantities`` (P/(E* R), p0/E*, eps [rad], dissipation/(E* R2)) and the
    pressure ``profile`` ``(401,)`` over E*, of the ``side`` "pin" or "hole", or "both", their mean; what it does
    not tell is absent."""

    quantities: dict[str, float]
    dofs: int | None = None
    kinematics: Kinematics = "current"
    iterations: int | None = None
    factorisations: int | None = None
    profile: Array | None = None
    side: str = "hole"


@dataclass(frozen=True, kw_only=True)
class Task(Process):
    """``code`` on the mesh of element size ``size`` (in R) of a ``series`` of ``case``, to be timed; `read` gives
    `Values`."""

    case: str
    code: str
    series: str
    size: float
    steps: int
    version: str = ""

    @property
    def label(self) -> str:
        """The mesh."""
        return f"{self.size:g} R"

    @property
    def name(self) -> str:
        """The code, its series and the mesh."""
        return f"{self.code}, {self.series}, {self.label}"


def tasks(
    case: JointCase, folder: Path, *, quick: bool = False, peers: bool = True, limit: float = LIMIT
) -> Iterator[Task]:
    """All points of ``case``; what they need is written below ``folder``. CalculiX and peers where they are installed;
    ``quick``: only one or two of each code's coarsest meshes."""
    for series in SERIES:
        if case.name in series.cases and (series.quick or not quick):
            for mesh in series.meshes[: (1 if case.yield_stress else 2) if quick else None]:
                yield _archord_task(case, series, mesh, folder, limit)
    for series in DECKS if peers and shutil.which("ccx") else ():
        if case.name in series.cases:
            for mesh in series.meshes[: 1 if quick else None]:
                yield _calculix_task(case, series, mesh, folder, limit)
    for peer in installed() if peers else ():
        for size, order in peer.series.get(case.name, ())[: 1 if quick else None]:
            yield peer_task(case, peer, size, order, folder, limit)


def chosen(found: Sequence[Task], patterns: Sequence[str]) -> list[Task]:
    """Those whose code, series or "code, series, mesh" is one of ``patterns`` (with * and ?), or contains it; all
    without any.

    Raises `InputError` for a pattern that fits none.
    """

    chosen_by = {p: [t for t in found if matches(p, t.name, t.code, t.series)] for p in patterns}
    for pattern, fitting in chosen_by.items():
        if not fitting:
            known = ", ".join(dict.fromkeys(name for t in found for name in (t.code, t.series)))
            raise InputError(f"--only {pattern}: no code or series has such a name; there are {known}.")
    return [t for t in found if not patterns or any(t in fitting for fitting in chosen_by.values())]


def _task(case: JointCase, code: str, series: str, size: float, folder: Path) -> Task:
    """The task, without a command, in a folder of its own, which is made."""
    place = (folder / slug(f"{case.name} {code} {series} {size:g} R")).resolve()
    place.mkdir(parents=True, exist_ok=True)
    kind = (code, case.name, series)
    return Task(
        (), place, core=last_core(), kind=kind, case=case.name, code=code, series=series, size=size, steps=case.steps
    )


def _archord_task(case: JointCase, series: Series, mesh: Mesh, folder: Path, limit: float) -> Task:
    scene = case.scene(mesh)
    task = _task(case, OURS, series.name, scene.joint.h, folder)
    (task.folder / "input.toml").write_text(resolved(scene), encoding="utf-8")

    def read() -> Values:
        run = task.folder / "run"
        report = json.loads((run / "run.json").read_text(encoding="utf-8"))
        if report["status"] != "done":
            raise Failure(report["message"])
        return Values(
            values_of(run, case),
            report["mesh"]["dofs"],
            scene.analysis.kinematics,
            round(sum(read_history(run / "history.csv")["iterations"])),
            report["totals"].get("factorisations"),
            profile_of(run)["both"] / scene.E_star,
            "both",
        )

    command = (sys.executable, "-m", "archord", "solve", "input.toml", "-o", "run", "--force", "--quiet")
    return replace(task, command=command, read=read, limit=limit, version=importlib.metadata.version("archord"))


def _calculix_task(case: JointCase, series: Series, keys: Mesh, folder: Path, limit: float) -> Task:
    if case.name == "elastic":
        case = replace(case, steps=series.elastic_steps)
    scene = case.scene(keys)
    task = _task(case, CALCULIX, series.name, scene.joint.h, folder)
    mesh = deck_mesh(scene, series.elements or "quadratic")
    ccx = calculix.process(scene, mesh, task.folder)

    def read() -> Values:
        opinion = ccx.read()
        values = {"P": opinion.P, "p0": opinion.p0}
        if case.yield_stress:
            # perfect plasticity: every point that flows dissipates the yield stress times its PEEQ
            values["dissipation"] = case.yield_stress * opinion.peeq_integral
        # no contact angle: pressures at the nodes near the edge scatter too much to find one
        known = {name: value for name, value in values.items() if math.isfinite(value)}
        profile = interpolated(opinion.angle, opinion.pressure)
        return Values(known, 2 * len(mesh.x), iterations=opinion.iterations, profile=profile, side="pin")

    return replace(task, command=ccx.command, clear=ccx.clear, read=read, limit=limit, version=_calculix_version())


@cache
def _calculix_version() -> str:
    found = re.search(r"Version (\S+)", subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout)
    return found[1] if found else ""


def peer_task(case: JointCase, peer: Peer, size: float, order: int, folder: Path, limit: float = LIMIT) -> Task:
    """A mesh of ``peer``'s, for its own time limit or, if that is less, ``limit``."""
    task = _task(case, peer.label, f"order {order}", size, folder)
    output = task.folder / "result.json"
    return replace(
        task,
        command=tuple(peer.command(case.name, size, order, case.steps, output)),
        read=lambda: peer_values(output),
        limit=min(limit, peer.time_limit),
        clear=(output.name,),
        version=peer.version,
    )


def peer_values(output: Path) -> Values:
    """What a peer's script wrote: {"P", "p0", "eps", "dofs", "iterations", "kinematics", "failed"}; null where it does
    not know. Raises `Failure` with its own sentence, or if that is no such file."""
    try:
        data = json.loads(output.read_text(encoding="utf-8"))
        if data["failed"]:
            raise Failure(data["failed"])
        values = {name: float(data[name]) for name in ("P", "p0", "eps") if data[name] is not None}
        return Values(values, data["dofs"], data["kinematics"], data["iterations"])
    except OSError:
        raise Failure(f"wrote no {output.name}") from None
    except (ValueError, KeyError, TypeError) as error:
        raise Failure(f"{output.name} is not what a peer's script writes: {error!r}") from None

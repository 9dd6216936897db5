"""The codes of the work-precision benchmark as tasks: archord, CalculiX on exported decks, and installed peers."""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import json
import math
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from time import perf_counter
from typing import Any

from archord.benchmarks.cost.pressure_profile import interpolated
from archord.benchmarks.cost.work_precision_cases import DECKS, SERIES, Case, DeckSeries, Mesh, Series
from archord.benchmarks.cost.work_precision_reference import profile_of, values_of
from archord.benchmarks.cost.work_precision_run import LIMIT, RunFailure, Task, Values
from archord.benchmarks.peers.calculix import read_opinion
from archord.output.history import read_history
from archord.postprocess.deck import PlaneMesh, deck, deck_mesh
from archord.scene.file import resolved
from archord.scene.scene import Scene

OURS, CALCULIX = "archord", "CalculiX"
_PEERS = "archord.benchmarks.peers.installed"


def archord_tasks(case: Case, folder: Path, limit: float = LIMIT, quick: bool = False) -> Iterator[Task]:
    """archord's series of ``case``, with their scenes written below ``folder``."""
    for series in SERIES:
        if case.name in series.cases and (series.quick or not quick):
            for mesh in series.meshes[: _quick_count(case) if quick else None]:
                yield _archord_task(case, series, mesh, folder, limit)


def _quick_count(case: Case) -> int:
    return 1 if case.yield_stress else 2


def _archord_task(case: Case, series: Series, mesh: Mesh, folder: Path, limit: float) -> Task:
    scene = case.scene(mesh)
    label = f"{scene.joint.h:g} R"
    place = (folder / slug(case.name, OURS, series.name, label)).resolve()
    place.mkdir(parents=True, exist_ok=True)
    (place / "input.toml").write_text(resolved(scene), encoding="utf-8")
    command = (sys.executable, "-m", "archord", "solve", "input.toml", "-o", "run", "--force", "--quiet")

    def read() -> Values:
        run = place / "run"
        report = json.loads((run / "run.json").read_text(encoding="utf-8"))
        if report["status"] != "done":
            raise RunFailure(report["message"])
        values = {name: value for name, value in values_of(run).items() if name in case.quantities}
        return Values(
            values,
            report["mesh"]["dofs"],
            scene.analysis.kinematics,
            round(sum(read_history(run / "history.csv")["iterations"])),
            report["totals"].get("factorisations"),
            profile_of(run)["both"] / scene.E_star,
            "both",
        )

    return Task(
        case.name, OURS, series.name, label, scene.joint.h, case.steps, command, place, read, limit,
        version=importlib.metadata.version("archord"),
    )  # fmt: skip


def calculix_tasks(case: Case, folder: Path, limit: float = LIMIT, quick: bool = False) -> Iterator[Task]:
    """CalculiX on decks written below ``folder``; nothing where it is not installed."""
    if shutil.which("ccx") is None:
        return
    for series in DECKS:
        if case.name not in series.steps:
            continue
        for mesh in series.meshes[: 1 if quick else None]:
            yield _calculix_task(case, series, mesh, folder, limit)


def _calculix_task(case: Case, series: DeckSeries, keys: Mesh, folder: Path, limit: float) -> Task:
    case = replace(case, steps=series.steps[case.name])
    scene = case.scene(keys)
    size, label = scene.joint.h, f"{scene.joint.h:g} R"
    place = (folder / slug(case.name, CALCULIX, series.name, label)).resolve()
    place.mkdir(parents=True, exist_ok=True)
    start = perf_counter()
    mesh = deck_mesh(scene, series.elements)
    (place / "joint.inp").write_text(deck(scene, mesh), encoding="utf-8")
    export = perf_counter() - start

    def read() -> Values:
        return calculix_values(case, scene, mesh, place)

    results = tuple(f"joint.{kind}" for kind in ("dat", "frd", "sta", "cvg", "12d"))
    return Task(
        case.name, CALCULIX, series.name, label, size, case.steps, ("ccx", "joint"), place, read,
        limit=limit, export=export, clear=results, version=_calculix_version(),
    )  # fmt: skip


@cache
def _calculix_version() -> str:
    said = subprocess.run(["ccx", "-v"], capture_output=True, text=True).stdout
    found = re.search(r"Version (\S+)", said)
    return found[1] if found else ""


def calculix_values(case: Case, scene: Scene, mesh: PlaneMesh, place: Path) -> Values:
    """What CalculiX's result files in ``place`` say. Raises `RunFailure` if it did not reach the last step.

    There is no contact angle: pressures at the nodes near the edge scatter too much to find one.
    """
    try:
        said = (place / "stdout.txt").read_text(errors="replace")
        opinion = read_opinion(scene, mesh, place, said)
    except (RuntimeError, OSError) as error:
        raise RunFailure(str(error)) from None
    values = {"P": opinion.P, "p0": opinion.p0}
    if case.yield_stress:
        # perfect plasticity: every point that flows dissipates the yield stress times its PEEQ
        values["dissipation"] = case.yield_stress * opinion.peeq_integral
    said_iterations = _iterations(place / "joint.sta")
    return Values(
        {name: value for name, value in values.items() if math.isfinite(value)},
        2 * len(mesh.x),
        iterations=said_iterations,
        profile=interpolated(opinion.angle, opinion.pressure),
        side="pin",
    )


def _iterations(sta: Path) -> int | None:
    """Sum of the iterations of all increments in a ``.sta`` file: its fourth column."""
    if not sta.is_file():
        return None
    rows = [line.split() for line in sta.read_text().splitlines()]
    return sum(int(row[3]) for row in rows if len(row) >= 6 and row[0].isdigit() and row[3].isdigit())


def peer_tasks(case: Case, folder: Path, limit: float = LIMIT, quick: bool = False) -> Iterator[Task]:
    """Every installed code of `archord.benchmarks.peers.installed`, where there is one."""
    for peer in _installed_peers():
        for size, order in peer.series.get(case.name, ())[: 1 if quick else None]:
            yield _peer_task(case, peer, size, order, folder, limit)


@cache
def _installed_peers() -> list[Any]:
    if importlib.util.find_spec(_PEERS) is None:
        return []
    return importlib.import_module(_PEERS).installed()


def _peer_task(case: Case, peer: Any, size: float, order: int, folder: Path, limit: float) -> Task:
    series, label = f"order {order}", f"{size:g} R"
    place = (folder / slug(case.name, peer.label, series, label)).resolve()
    output = place / "result.json"
    command = tuple(map(str, peer.command(case.name, size, order, case.steps, output)))

    def read() -> Values:
        return peer_values(output)

    return Task(
        case.name, peer.label, series, label, size, case.steps, command, place, read,
        limit=min(limit, float(peer.time_limit)), clear=(output.name,), version=peer.version,
    )  # fmt: skip


def peer_values(output: Path) -> Values:
    """What a peer's script wrote: {"P", "p0", "eps", "dofs", "iterations", "kinematics", "failed"}; null where it does
    not know. Raises `RunFailure` with its own sentence, or if that is no such file."""
    try:
        data = json.loads(output.read_text(encoding="utf-8"))
        failed = data.get("failed")
        if failed:
            raise RunFailure(str(failed))
        values = {name: float(data[name]) for name in ("P", "p0", "eps") if data.get(name) is not None}
        iterations = data.get("iterations")
        return Values(values, int(data["dofs"]), data["kinematics"], None if iterations is None else int(iterations))
    except OSError:
        raise RunFailure(f"wrote no {output.name}") from None
    except (ValueError, KeyError, AttributeError) as error:
        raise RunFailure(f"{output.name} is not what a peer's script writes: {error!r}") from None


def slug(*names: str) -> str:
    """A folder's name for a point."""
    kept = ("".join(c if c.isalnum() or c in ".-+" else "_" for c in name) for name in names)
    return "__".join(kept)

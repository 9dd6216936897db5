"""A scene solved into a run folder: scene.toml, history.csv, fields.xdmf/.h5, contact.h5 and run.json."""

from __future__ import annotations

import json
import math
import os
import platform
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from typing import Any

from mpi4py import MPI

from archord.solver.contact_file import ContactWriter
from archord.solver.fields import FieldWriter
from archord.solver.history import History
from archord.solver.joint import Joint
from archord.solver.measures import Measures, Work, arc_profiles, measure
from archord.solver.run_folder import FILES
from archord.solver.scene import Scene, resolved
from archord.solver.stepping import Step, StepFailure, march
from archord.solver.timer import Timer

_EDGE_WARNING = 0.99  # share of the arc's end facet in contact from which the modelled arc is too short


@dataclass
class Outcome:
    """How a run ended: ``status`` is "done" or "stopped" or "interrupted" (``message`` says why), and its steps."""

    folder: Path
    status: str
    message: str
    steps: list[Measures]


@dataclass
class _Report:
    """What run.json holds; rewritten after every step."""

    status: str
    message: str
    started: str
    command: list[str]
    versions: dict[str, str]
    ranks: int
    mesh: dict[str, Any]
    model: dict[str, Any]
    tolerances: dict[str, float]
    warnings: list[str] = field(default_factory=list)
    steps: list[dict[str, Any]] = field(default_factory=list)
    totals: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    error_estimates: dict[str, float] = field(default_factory=dict)


def solve_scene(
    scene: Scene,
    folder: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    *,
    command: list[str] | None = None,
    timer: Timer | None = None,
    begun: float | None = None,
    on_start: Callable[[Joint], None] = lambda joint: None,
    on_step: Callable[[Measures], None] = lambda measures: None,
    on_attempt: Callable[[float, int], None] = lambda load, iterations: None,
) -> Outcome:
    """Solve ``scene`` and write everything to the existing ``folder`` (see `run_folder.claim_folder`). Collective.

    ``on_start``, ``on_step`` and ``on_attempt(load, Newton iterations)`` report progress on every rank. ``begun`` is the
    ``perf_counter`` from which the seconds count. A step that cannot be solved ends the run with status "stopped", Ctrl-C with
    "interrupted"; what was accepted before stays.
    """
    begun = perf_counter() if begun is None else begun
    timer = timer or Timer()
    joint = Joint(scene, comm, timer=timer)
    root = comm.rank == 0
    on_start(joint)
    n = scene.load.steps
    report, history, contact_file = _report(joint, command or sys.argv), None, None
    with timer("output"):
        if root:
            for name in FILES:
                (folder / name).unlink(missing_ok=True)
            (folder / "scene.toml").write_text(resolved(scene), encoding="utf-8")
            history = History(folder / "history.csv", scene)
        comm.barrier()
        fields = FieldWriter(folder, joint, n)
    steps: list[Measures] = []
    work = Work()
    last = perf_counter()

    def substep_done(load: float) -> None:
        work.add(load, joint.forces()["pin"])

    def target_done(step: Step) -> None:
        nonlocal contact_file, last
        with timer("output"):
            profiles = arc_profiles(joint)
            seconds, last = perf_counter() - last, perf_counter()
            m = measure(joint, len(steps) + 1, step, profiles, work, seconds)
            steps.append(m)
            fields.write(m.step, m.delta)
            if root:
                contact_file = contact_file or ContactWriter(folder, profiles, n)
                contact_file.write(m.step, m.delta, profiles)
                history.add(m)
                _note_warnings(report, joint, profiles, m)
                report.steps.append(asdict(m) | {"substeps": step.substeps, "residuals": step.residuals})
                _write_report(folder, report, timer, begun, steps)
        on_step(m)

    status, message = "done", ""
    try:
        march(
            joint.equilibrium,
            [scene.delta * k / n for k in range(1, n)] + [scene.delta],
            joint.rigid_translation,
            max_cutbacks=scene.load.max_cutbacks,
            substep_done=substep_done,
            target_done=target_done,
            attempted=on_attempt,
        )
    except StepFailure as failure:
        status, message = "stopped", str(failure)
    except KeyboardInterrupt:
        status, message = "interrupted", f"interrupted after {len(steps)} steps"
    if root:
        report.status, report.message = status, message
        _write_report(folder, report, timer, begun, steps)
    return Outcome(folder, status, message, steps)


def _report(joint: Joint, command: list[str]) -> _Report:
    import dolfinx
    import numpy
    from petsc4py import PETSc

    import archord

    scene, equilibrium = joint.scene, joint.equilibrium
    geometry = scene.joint
    versions = {
        "archord": archord.__version__,
        "dolfinx": dolfinx.__version__,
        "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
        "mpi": MPI.Get_library_version().split(",")[0].strip(),
        "numpy": numpy.__version__,
        "python": platform.python_version(),
    }
    mesh = {
        "cells": joint.n_cells,
        "dofs": joint.n_dofs,
        "contact_facets": {name: side.curve.n_facets for name, side in joint.sides.items()},
        "element_size_on_arc": geometry.h,
        "shortest_edge_on_arc": min(float(numpy.diff(s.curve.arc_length(numpy.array([0.0, 1.0]))).min()) for s in joint.sides.values()),
        "block_size": geometry.W,
    }
    model = {
        "E_star": scene.E_star,
        "clearance": geometry.dR,
        "delta": scene.delta,
        "plastic": joint.bulk.plastic,
        "bodies": {"pin": "rigid" if scene.pin.rigid else "deformable", "block": "deformable"},
    }
    return _Report(
        status="running",
        message="",
        started=datetime.now(UTC).isoformat(timespec="seconds"),
        command=command,
        versions=versions,
        ranks=joint.comm.size,
        mesh=mesh,
        model=model,
        tolerances={"newton": equilibrium.tolerance, "gamma_factor": scene.analysis.gamma_factor},
    )


def _note_warnings(report: _Report, joint: Joint, profiles: dict, m: Measures) -> None:
    warnings = []
    if any(p.in_contact[-1] >= _EDGE_WARNING for p in profiles.values()):
        warnings.append(f"step {m.step}: the contact reaches the end of the modelled quarter arc")
    active = min(int((p.in_contact > 0).sum()) for p in profiles.values())
    if 0 < active < 5:
        warnings.append(f"step {m.step}: only {active} facets in contact; a smaller element_size would resolve it")
    if m.delta > 0.1 * joint.scene.joint.radius:
        warnings.append(f"step {m.step}: delta exceeds 0.1 R, too much for small-strain theory")
    if m.force_balance > 1e-8:
        warnings.append(f"step {m.step}: forces at pin, contact and block differ by {m.force_balance:.1e} of P")
    report.warnings += warnings


def _write_report(folder: Path, report: _Report, timer: Timer, begun: float, steps: list[Measures]) -> None:
    """Replace run.json in one move, so that a reader never sees half of it."""
    s = dict(timer.seconds)
    inside = ("return mapping", "assemble force", "contact", "assemble bulk", "assemble contact")
    if "solve" in s:
        s["linear solve"] = s.pop("solve") - sum(s.get(name, 0.0) for name in inside)
    s["total"] = perf_counter() - begun
    report.seconds = {name: round(value, 4) for name, value in s.items()}
    report.totals = {
        "newton_iterations": sum(m.iterations for m in steps),
        "cutbacks": sum(m.cutbacks for m in steps),
        "factorisations": timer.counts.get("assemble bulk", 0),
        "residual_evaluations": timer.counts.get("return mapping", 0),
        "accepted_steps": len(steps),
    }
    if steps:
        m = steps[-1]
        report.error_estimates = {
            "force_balance": max(m.force_balance for m in steps),
            "energy_balance": abs(m.work - m.elastic_energy - m.plastic_dissipation) / m.work if m.work else math.nan,
            "newton_residual": max(s["residuals"][-1][-1] for s in report.steps),
        }
    new = folder / "run.json.new"
    new.write_text(json.dumps(asdict(report), indent=1) + "\n", encoding="utf-8")
    os.replace(new, folder / "run.json")

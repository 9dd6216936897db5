"""run.json: how a run was made and what it cost; rewritten after every step."""

from __future__ import annotations

import json
import math
import platform
import resource
import sys
from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from mpi4py import MPI

from archord.output.disk import replace_file
from archord.presets.arc import ArcProfile
from archord.presets.joint import Joint
from archord.presets.measures import Measures
from archord.solver.stepping import Step
from archord.solver.timer import BEFORE_SOLVING

_INSIDE_SOLVE = ("return mapping", "assemble force", "contact", "assemble bulk", "assemble contact", "assemble border")
_KILOBYTES = 1 if sys.platform == "darwin" else 1024  # unit of ru_maxrss in bytes
_FEW_FACETS = 5
_ROUGH = 0.01  # of the clearance
_APART = (
    "the bodies never touched: P is 0 in every step, as the load never presses the pin into the hole; give a "
    "displacement or a force above 0 if it should"
)


class Report:
    """The content of run.json for ``joint``; ``begun`` is the ``perf_counter`` from which the seconds count.

    A run that goes on has the steps ``done`` behind it, and ``before`` is its run.json.
    """

    def __init__(
        self,
        path: Path,
        joint: Joint,
        begun: float,
        done: Sequence[Measures] = (),
        before: dict[str, Any] | None = None,
    ) -> None:
        self.path, self.joint, self.begun = path, joint, begun
        self.measures = list(done)
        self._residual = 0.0
        self.peak_memory: list[int] = []  # bytes, per rank; whoever knows all ranks sets it
        self.content: dict[str, Any] = {
            "status": "running",
            "message": "",
            "started": datetime.now(UTC).isoformat(timespec="seconds"),
            "command": sys.argv,
            "versions": _versions(),
            "ranks": joint.comm.size,
            "mesh": _mesh(joint),
            "model": _model(joint),
            "tolerances": {
                "newton": joint.solver.tolerance,
                "gamma_factor": joint.scene.analysis.gamma_factor,
            },
            "linear_solver": {},
            "restarts": [],
            "warnings": _rough_arcs(joint),
            "steps": [],
        }
        self._before: dict[str, Any] = before or {}
        if before is not None:
            self._go_on(before, len(self.measures))

    def _go_on(self, before: dict[str, Any], done: int) -> None:
        """Take over what the run's earlier processes noted, and note this one."""
        now, steps = self.content["started"], before["steps"][:done]
        restart = {"when": now, "after_step": done + 1, "ranks": self.joint.comm.size, "command": sys.argv}
        self._residual = max((r[-1][-1] or 0.0 for step in steps if (r := step["residuals"]) and r[-1]), default=0.0)
        self.content |= {
            "started": before["started"],
            "command": before["command"],
            "restarts": [*before.get("restarts", []), restart],
            "warnings": [w for w in before["warnings"] if _step_of(w) <= done and w != _APART],
            "steps": steps,
        }

    def add(self, m: Measures, step: Step, profiles: dict[str, ArcProfile], core_peeq: float = 0.0) -> None:
        """Note an accepted output step, at which the core has a PEEQ of up to ``core_peeq`` (`Joint.core_peeq`)."""
        self.measures.append(m)
        if m.contact_area:
            self._residual = max(self._residual, step.residual)
        self.content["warnings"] += _warnings(self.joint, profiles, m, step.residual, core_peeq)
        self.content["steps"].append(
            asdict(m)
            | {"substeps": step.substeps, "coarse_iterations": step.coarse_iterations}
            | {"factorisations": sum(a.factorisations for a in step.attempts)}
            | {"evaluations": sum(a.evaluations for a in step.attempts)}
            | {"residuals": [a.residuals for a in step.attempts]}
        )
        self.write()

    def finish(self, status: str, message: str, failed: Step | None = None) -> None:
        """Note how the run ended, and the output step that ``failed``."""
        self.content |= {"status": status, "message": message}
        if status == "done" and not any(m.contact_area for m in self.measures):
            self.content["warnings"].append(_APART)
        if failed is not None:
            self.content["failed_step"] = asdict(failed)
        self.write()

    def write(self) -> None:
        """Replace run.json in one move, so that a reader never sees half of it. Raises `OSError`."""
        self.content |= {"totals": self._totals(), "seconds": self._seconds(), "error_estimates": self._errors()}
        self.content["linear_solver"] = self.joint.equilibrium.choice.words()  # a matrix may decide otherwise later
        self.content["peak_memory"] = self.peak_memory
        replace_file(self.path, json.dumps(_finite(self.content), indent=1, allow_nan=False) + "\n")

    def _totals(self) -> dict[str, int]:
        counts, before = self.joint.timer.counts, self._before.get("totals", {})
        return {
            "newton_iterations": sum(m.iterations for m in self.measures),
            "cutbacks": sum(m.cutbacks for m in self.measures),
            "factorisations": self.joint.factorisations + before.get("factorisations", 0),
            "residual_evaluations": counts.get("return mapping", 0) + before.get("residual_evaluations", 0),
            "accepted_steps": len(self.measures),
        }

    def _seconds(self) -> dict[str, float]:
        s = dict(self.joint.timer.seconds)
        if "solve" in s:
            s["linear solve"] = s.pop("solve") - sum(s.get(name, 0.0) for name in _INSIDE_SOLVE)
        before = s.pop(BEFORE_SOLVING, 0.0)
        s["setup"] -= before
        s["linear solve"] = s.get("linear solve", 0.0) + before
        s["total"] = perf_counter() - self.begun
        for name, value in self._before.get("seconds", {}).items():
            s[name] = s.get(name, 0.0) + value
        return {name: round(value, 4) for name, value in s.items()}

    def _errors(self) -> dict[str, float | None]:
        if not self.measures:
            return {}
        return {
            "force_balance": max(m.force_balance for m in self.measures),
            "energy_balance": energy_balance(self.measures, press_fit=self.joint.scene.joint.dR < 0),
            "newton_residual": self._residual,
        }


def peak_memory() -> int:
    """The largest resident set of this process so far, in bytes.

    Linux hands ``ru_maxrss`` down to the programs that a process starts; its own file of the process starts at zero.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        return 1024 * next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM:"))
    except (OSError, StopIteration, ValueError):
        return _KILOBYTES * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def energy_balance(steps: Sequence[Measures], *, press_fit: bool = False) -> float | None:
    """How far work and stored and dissipated energy of the last of the ``steps`` are apart, over the largest work.

    The pin of a ``press_fit``, too large for its hole, stores energy before there is a load, by work that nobody
    counted: there both count from the first step on, and the result is None where that is the only one.
    """
    if press_fit and len(steps) == 1:
        return None
    missing = [m.work - m.elastic_energy - m.plastic_dissipation for m in (steps[0], steps[-1])]
    work = max((abs(m.work) for m in steps if m.contact_area), default=0.0)
    return abs(missing[1] - (missing[0] if press_fit else 0.0)) / work if work else 0.0


def _step_of(warning: str) -> int:
    """The step that a warning is about; 0 if it is about the joint."""
    return int(warning.removeprefix("step ").partition(":")[0]) if warning.startswith("step ") else 0


def _finite(value: Any) -> Any:
    """``value`` with null for numbers that are none, which JSON does not know (residuals of a solve that failed)."""
    if isinstance(value, dict):
        return {name: _finite(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _versions() -> dict[str, str]:
    import dolfinx
    from petsc4py import PETSc

    import archord

    return {
        "archord": archord.__version__,
        "dolfinx": dolfinx.__version__,
        "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
        "mpi": MPI.Get_library_version().split(",")[0].strip(),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }


def _mesh(joint: Joint) -> dict[str, Any]:
    lengths = {name: s.facet_lengths() for name, s in joint.sides.items()}
    return {
        "cells": joint.n_cells,
        "dofs": joint.n_dofs,
        "contact_facets": {name: len(length) for name, length in lengths.items()},
        "element_size_on_arc": {name: [float(length.min()), float(length.max())] for name, length in lengths.items()},
        "growth": joint.scene.joint.growth,
        "block_size": joint.scene.joint.W,
    }


def _model(joint: Joint) -> dict[str, Any]:
    scene = joint.scene
    return {
        "E_star": scene.E_star,
        "clearance": scene.joint.dR,
        "target": scene.target,
        "plastic": joint.bulk.plastic,
        "pin": "rigid" if scene.pin.rigid else "deformable",
        "contact_shares": [pair.share for pair in joint.contact.pairs],
    }


def _rough_arcs(joint: Joint) -> list[str]:
    """A warning if the parabolic facets depart too much from their circles for the clearance.

    A parabola through ends and middle of an arc of half-angle ``a`` is off by ``R (1 - cos a)^2/8``. Equal facets that
    face each other are off alike, which leaves the gap as it is.
    """
    geometry = joint.scene.joint
    if not joint.scene.pin.rigid and geometry.size_ratio == 1:
        return []
    lengths = [side.facet_lengths().max() for side in joint.sides.values()]
    off = (1 - np.cos(max(lengths) / geometry.radius / 2)) ** 2 / 8 * geometry.radius / abs(geometry.dR)
    if off <= _ROUGH:
        return []
    return [f"the elements on the arcs are too long for the clearance, they depart from the circles by {off:.1g} dR"]


def _warnings(
    joint: Joint, profiles: dict[str, ArcProfile], m: Measures, residual: float, core_peeq: float
) -> list[str]:
    said = []
    if joint.scene.joint.model == "block" and any(p.in_contact[-1] > 0 for p in profiles.values()):
        said.append("the contact reaches the end of the modelled quarter arc, beyond which it cannot spread")
    touching = max(1, min(int((p.in_contact > 0).sum()) for p in profiles.values()))
    if m.contact_area and touching < _FEW_FACETS:
        said.append(
            f"only {touching} facet{'s' if touching != 1 else ''} in contact; a smaller element_size would resolve it"
        )
    if core_peeq > 0:
        said.append(
            f"the pin yields where the force is applied, with PEEQ up to {core_peeq:.1e} in its core, and delta, the "
            "mean displacement of the core, contains by how much it is squashed there; a larger load.core_radius would "
            "spread the force"
        )
    if abs(m.delta) > 0.1 * joint.scene.joint.radius:
        said.append("delta exceeds 0.1 R, too much for small-strain theory")
    if residual > 1e-8 and m.contact_area:
        said.append(f"round-off limits the residual to {residual:.1e} of the reaction")
    if m.force_balance > 1e-8:
        said.append(f"forces at pin, contact and block differ by {m.force_balance:.1e} of P")
    return [f"step {m.step}: {text}" for text in said]

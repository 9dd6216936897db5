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

import dolfinx
import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from archord.output.disk import replace_file
from archord.presets.joint import Joint
from archord.presets.joint_report import APART, mesh_facts, model_facts, rough_arcs
from archord.presets.measures import Measures, energy_balance
from archord.report.version import VERSION
from archord.solver.stepping import Step
from archord.solver.timer import BEFORE_SOLVING

_INSIDE_SOLVE = ("return mapping", "assemble force", "contact", "assemble bulk", "assemble contact", "assemble border")
_KILOBYTES = 1 if sys.platform == "darwin" else 1024  # unit of ru_maxrss in bytes


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
            "mesh": mesh_facts(joint),
            "model": model_facts(joint),
            "tolerances": {
                "newton": joint.problem.tolerance,
                "gamma_factor": joint.scene.analysis.gamma_factor,
            },
            "linear_solver": {},
            "restarts": [],
            "warnings": rough_arcs(joint),
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
            "warnings": [w for w in before["warnings"] if _step_of(w) <= done and w != APART],
            "steps": steps,
        }

    def add(self, m: Measures, step: Step, warnings: Sequence[str]) -> None:
        """Note an accepted output step, and what to warn of at it."""
        self.measures.append(m)
        if m.contact_area:
            self._residual = max(self._residual, step.residual)
        self.content["warnings"] += [f"step {m.step}: {text}" for text in warnings]
        self.content["steps"].append(
            asdict(m)
            | {"substeps": step.substeps, "coarse_iterations": step.coarse_iterations}
            | {"factorisations": sum(a.factorisations for a in step.attempts)}
            | {"evaluations": sum(a.evaluations for a in step.attempts)}
            | {"residuals": [a.residuals for a in step.attempts]}
        )
        self.write()

    def finish(self, status: str, message: str, failed: Step | None = None) -> list[str]:
        """Note how the run ended, and the output step that ``failed``; returns all warnings."""
        self.content |= {"status": status, "message": message}
        if status == "done" and not any(m.contact_area for m in self.measures):
            self.content["warnings"].append(APART)
        if failed is not None:
            self.content["failed_step"] = asdict(failed)
        self.write()
        return self.content["warnings"]

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
    return {
        "archord": VERSION,
        "dolfinx": dolfinx.__version__,
        "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
        "mpi": MPI.Get_library_version().split(",")[0].strip(),
        "numpy": np.__version__,
        "python": platform.python_version(),
    }

"""run.json: how a run was made and what it cost; rewritten while it goes on."""

from __future__ import annotations

import json
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

from archord.kernels.compat import versions
from archord.measures.account import Account
from archord.measures.energies import WORK_OFF
from archord.measures.record import Record
from archord.output.files.disk import replace_file
from archord.output.files.seal import report_text, seals_of
from archord.presets.joint_doubts import APART
from archord.report.by_name import Amounts, ByName
from archord.report.doubts import Told, kind, tell
from archord.report.timer import BEFORE_SOLVING
from archord.report.version import VERSION
from archord.solver.path.stepping import Step

_INSIDE_SOLVE = (
    "return mapping",
    "assemble force",
    "contact",
    "assemble bulk",
    "assemble contact",
    "assemble border",
)


class Report:
    """run.json of an ``account``, on a mesh with these ``worst_cells``; ``begun`` is the
    ``perf_counter`` from which the seconds count.

    ``steps`` are the steps of the run, also of the run that it goes on from, with the run.json
    ``before``; whoever appends one to them calls `add`, and `write`.
    """

    def __init__(
        self,
        path: Path,
        account: Account,
        worst_cells: Amounts,
        begun: float,
        steps: list[Record],
        before: ByName,
    ) -> None:
        self.path = path
        self.account = account
        self.system = account.system
        self.begun = begun
        self.steps = steps
        self._before = before
        now = datetime.now(UTC).isoformat(timespec="seconds")
        n = len(steps)
        ranks = self.system.comm.size
        restarts = list(before.get("restarts", []))
        if before:
            restarts.append({"when": now, "after_step": n + 1, "ranks": ranks, "command": sys.argv})
        told = [Told(**one) for one in before.get("told", [])]
        warnings = before.get("warnings", account.warnings)
        warnings = [said for said in warnings if said not in map(str, told)]
        # the step after those done is noted once more
        self._told = {kind(one.said): one for one in told if one.first <= n}
        self._others = [
            w for w in warnings if not w.startswith((f"step {n + 1}:", APART, WORK_OFF))
        ]
        facts = account.facts()
        facts["mesh"]["worst_cells"] = worst_cells
        self.content = {
            "status": "running",
            "message": "",
            "started": before.get("started", now),
            "command": before.get("command", sys.argv),
            "versions": {
                "archord": VERSION,
                **versions(),
                "numpy": np.__version__,
                "python": platform.python_version(),
            },
            "ranks": ranks,
            "peak_memory": [],
            **facts,
            "tolerances": {
                "newton": self.system.problem.tolerance,
                "gamma_factor": account.scene.analysis.gamma_factor,
            },
            "restarts": restarts,
            "warnings": self._others,
            "steps": before.get("steps", [])[:n],
        }

    def add(self, step: Step, warnings: Sequence[str]) -> None:
        """Note how the last of the steps was reached, and what to warn of at it."""
        m = self.steps[-1]
        tell(self._told, m.step, warnings)
        cost = {
            "substeps": step.substeps,
            "coarse_iterations": step.coarse_iterations,
            "factorisations": sum(a.factorisations for a in step.attempts),
            "evaluations": sum(a.evaluations for a in step.attempts),
            "krylov_iterations": sum(a.krylov_iterations for a in step.attempts),
            "residuals": [a.residuals for a in step.attempts],
        }
        self.content["steps"].append(_finite(m.plain() | cost))

    def finish(self, warnings: list[str], **ending: Any) -> list[str]:
        """Note how the run ended, what else to warn of, and what its files are by then; returns all
        warnings. Raises `OSError`."""
        self.content |= _finite(ending)
        self._others += warnings
        self.content["files"] = seals_of(self.path.parent)
        self.write()
        return self.content["warnings"]

    def write(self) -> None:
        """Replace run.json in one move, with a line for each of its keys. Raises `OSError`."""
        self.content["warnings"] = [*self._others, *map(str, self._told.values())]
        content = self.content | {
            "told": [asdict(one) for one in self._told.values()],
            # a matrix may decide otherwise later
            "linear_solver": self.system.equilibrium.linear.choice.words(),
            "totals": self._totals(),
            "seconds": self._seconds(),
            "error_estimates": self._errors(),
        }
        replace_file(self.path, report_text(content))

    def unseal(self) -> None:
        """Let run.json, as it was before, say nothing of files that are going to be written. Raises
        `OSError`."""
        if "files" in self._before:
            before = {name: value for name, value in self._before.items() if name != "files"}
            replace_file(self.path, report_text(before))

    def _totals(self) -> dict[str, int]:
        before = self._before.get("totals", {})
        factorisations = self.system.equilibrium.linear.tangent.factorisations
        evaluations = self.system.timer.counts.get("return mapping", 0)
        krylov = [step.get("krylov_iterations", 0) for step in self.content["steps"]]
        return {
            "newton_iterations": sum(m.iterations for m in self.steps),
            "cutbacks": sum(m.cutbacks for m in self.steps),
            "factorisations": factorisations + before.get("factorisations", 0),
            "krylov_iterations": sum(krylov),
            "residual_evaluations": evaluations + before.get("residual_evaluations", 0),
            "accepted_steps": len(self.steps),
        }

    def _seconds(self) -> Amounts:
        seconds = dict(self.system.timer.seconds)
        before_solving = seconds.pop(BEFORE_SOLVING, 0.0)
        seconds["setup"] -= before_solving
        seconds["linear solve"] = before_solving
        if "solve" in seconds:
            inside = sum(seconds.get(name, 0.0) for name in _INSIDE_SOLVE)
            seconds["linear solve"] += seconds.pop("solve") - inside
        seconds["total"] = perf_counter() - self.begun
        for name, value in self._before.get("seconds", {}).items():
            seconds[name] = seconds.get(name, 0.0) + value
        return {name: round(value, 4) for name, value in seconds.items()}

    def _errors(self) -> dict[str, float | None]:
        if not self.steps:
            return {}
        touching = [step["residuals"] for step in self.content["steps"] if step["contact_area"]]
        return {
            "force_balance": max(m.force_balance for m in self.steps),
            "energy_balance": self.account.energy_balance(self.steps),
            "newton_residual": max((r[-1][-1] for r in touching if r and r[-1]), default=0.0),
        }


def peak_memory() -> int:
    """The largest resident set of this process so far, in bytes.

    Linux hands ``ru_maxrss`` down to the programs that a process starts; its own file of the
    process starts at zero.
    """
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        _, _, after = status.partition("VmHWM:")
        return 1024 * int(after.split()[0])
    except (OSError, IndexError, ValueError):
        return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _finite(value: ByName) -> ByName:
    """``value`` with null for numbers that are none, which JSON does not know (residuals of a solve
    that failed)."""
    return json.loads(json.dumps(value), parse_constant=lambda name: None)

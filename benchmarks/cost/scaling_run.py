"""One run of the scaling benchmark, as a user would start it, and what its run.json says it cost."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

from archord.benchmarks.cost.scaling_cases import Case
from archord.output.folder import claim_folder
from archord.scene.errors import InputError
from archord.scene.file import resolved

# the parts of a run, and the timers that they sum up
PARTS = {
    "start-up": ("start-up",),
    "mesh": ("mesh",),
    "setup": ("setup",),
    "coarse start": ("coarse start",),
    "bulk": ("return mapping", "assemble force", "assemble bulk", "assemble border"),
    "contact": ("contact", "assemble contact"),
    "linear solve": ("linear solve",),
    "output": ("output", "checkpoint"),
}
REST = "rest"  # what no timer covers


@dataclass(frozen=True)
class Cost:
    """What a run cost. ``seconds`` by part, as rank 0 spent them, sum up to ``total``, the process's from outside;
    ``memory`` is the peak of each rank in bytes, ``force`` the last P/(E* R).

    A run that did not finish has a ``fault``, and nothing else.
    """

    case: Case
    fault: str = ""
    dofs: int = 0
    total: float = 0.0
    seconds: dict[str, float] = field(default_factory=dict)
    memory: list[int] = field(default_factory=list)
    iterations: int = 0
    coarse_iterations: int = 0
    factorisations: int = 0
    evaluations: int = 0
    force: float = 0.0

    @property
    def contact_share(self) -> float:
        """Part of the time that the contact takes, evaluation and assembly."""
        return self.seconds["contact"] / self.total

    @property
    def share_around_factors(self) -> float:
        """Part of the solve that is not the linear solver's: contact search, assembly, return map."""
        around = self.seconds["contact"] + self.seconds["bulk"]
        return around / (around + self.seconds["linear solve"])

    @property
    def peak(self) -> int:
        """Memory of the rank that needs most, in bytes."""
        return max(self.memory)


def launcher(ranks: int) -> list[str]:
    """The words before a command that start it on ``ranks`` ranks. Raises `InputError` if there is no mpirun."""
    if ranks == 1:
        return []
    if shutil.which("mpirun") is None:
        raise InputError(f"--ranks {ranks}: mpirun is not installed; only 1 is possible here.")
    return ["mpirun", "-n", str(ranks)]


def solve(case: Case, folder: Path) -> Cost:
    """Run ``case`` in processes of its own below ``folder``. A run that fails is told as it is."""
    run, scene = folder / case.name, folder / f"{case.name}.toml"
    claim_folder(run, force=True)
    scene.write_text(resolved(case.scene()), encoding="utf-8")
    archord = [sys.executable, "-m", "archord", "solve", str(scene), "-o", str(run), "--force", "--quiet"]
    begun = perf_counter()
    done = subprocess.run(launcher(case.ranks) + archord, capture_output=True, text=True, check=False)
    total = perf_counter() - begun
    if done.returncode:
        said = done.stderr.strip().splitlines() or [""]
        return Cost(case, fault=f"exit code {done.returncode}: {said[-1]}")
    return read_cost(case, json.loads((run / "run.json").read_text(encoding="utf-8")), total)


def middle(costs: Sequence[Cost]) -> Cost:
    """Of runs of one case the one with the median time, or the first that failed."""
    failed = [cost for cost in costs if cost.fault]
    return failed[0] if failed else sorted(costs, key=lambda cost: cost.total)[(len(costs) - 1) // 2]


def read_cost(case: Case, report: dict[str, Any], total: float) -> Cost:
    """The cost that run.json tells, of a run that took ``total`` seconds from outside."""
    spent, totals, model = report["seconds"], report["totals"], report["model"]
    seconds = {part: sum(spent.get(name, 0.0) for name in names) for part, names in PARTS.items()}
    seconds[REST] = total - sum(seconds.values())
    return Cost(
        case,
        dofs=report["mesh"]["dofs"],
        total=total,
        seconds=seconds,
        memory=report["peak_memory"],
        iterations=totals["newton_iterations"],
        coarse_iterations=sum(step["coarse_iterations"] for step in report["steps"]),
        factorisations=totals["factorisations"],
        evaluations=totals["residual_evaluations"],
        force=report["steps"][-1]["P"] / model["E_star"],
    )

"""How time and memory grow with the mesh and fall with the ranks: ``archord benchmark scaling``.

The paper's joint, refined everywhere alike, on one rank and on several. Everything that is concluded is concluded from
measured costs.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

from scipy.optimize import brentq

from archord.benchmarks.case import paper_joint
from archord.benchmarks.timing import Process, Timing, time_all
from archord.output.folder import claim_folder
from archord.scene.errors import InputError
from archord.scene.file import resolved
from archord.scene.geometry import JointGeometry
from archord.scene.scene import Scene

ELASTIC = (5_000, 30_000, 100_000, 300_000, 1_000_000)  # dofs
PLASTIC = (5_000, 30_000, 100_000)
ELASTIC_STEPS, PLASTIC_STEPS = 2, 5
YIELD_STRESS = 0.002  # over E*
_COARSEST = {"element_size": 0.04, "growth": 0.25}  # both are scaled, so that the meshes are alike
_SCALES = 0.045, 2.0  # of those; growth then stays within its limits
_DOFS_PER_CELL = 4.15  # expected, of fine meshes: two nodes a triangle, and gmsh makes a few more of them
_A_DAY = 86400.0  # seconds that a run may take

SPEED_UP_AT, ROUNDS = 1_000_000, 3  # dofs at which a speed-up is asked for, and how often they are solved
SAME_FORCE = 1e-8  # relative difference of P between numbers of ranks
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
class Setting:
    """The joint with about ``dofs`` unknowns, elastic or ``plastic``, on ``ranks`` ranks."""

    dofs: int
    ranks: int
    plastic: bool = False

    @property
    def material(self) -> str:
        """Elastic or plastic."""
        return "plastic" if self.plastic else "elastic"

    @property
    def name(self) -> str:
        """Material, size and ranks."""
        return f"{self.material}_{self.dofs}_on_{self.ranks}"

    def scene(self) -> Scene:
        """The joint to solve."""
        size, growth = refined(self.dofs)
        steps, strength = (PLASTIC_STEPS, YIELD_STRESS) if self.plastic else (ELASTIC_STEPS, None)
        return paper_joint(size, steps, strength, joint={"growth": growth})


def refined(dofs: float) -> tuple[float, float]:
    """Element size on the arcs, over R, and growth of a mesh with about ``dofs`` unknowns."""

    def excess(scale: float) -> float:
        sizes: dict[str, Any] = {name: scale * value for name, value in _COARSEST.items()}
        # without its checks, which refuse meshes beyond the wanted one
        cells = JointGeometry.model_construct(radius=1.0, clearance=0.005, **sizes).expected_cells
        return _DOFS_PER_CELL * cells - dofs

    scale = brentq(excess, *_SCALES, rtol=1e-6)
    return scale * _COARSEST["element_size"], scale * _COARSEST["growth"]


def settings(largest: float, ranks: Sequence[int]) -> list[Setting]:
    """All runs up to ``largest`` dofs, the smallest first: the elastic series on every number of ``ranks``, the plastic
    one on one rank. Raises `InputError` if no size is left, or ``ranks`` do not begin with 1.
    """
    if largest < ELASTIC[0]:
        raise InputError(f"--largest {largest:g}: must be at least {ELASTIC[0]}, the dofs of the smallest mesh.")
    if not ranks or ranks[0] != 1 or sorted(set(ranks)) != list(ranks):
        raise InputError(
            f"--ranks {','.join(map(str, ranks))}: must be numbers of ranks that rise from 1, like 1,2, as everything "
            "is compared with one rank."
        )
    found = [*(Setting(n, r) for n in ELASTIC for r in ranks), *(Setting(n, 1, plastic=True) for n in PLASTIC)]
    small = [setting for setting in found if setting.dofs <= largest]
    return sorted(small, key=lambda setting: setting.dofs * (PLASTIC_STEPS if setting.plastic else 1))


@dataclass(frozen=True)
class Cost:
    """What a run cost. ``seconds`` by part, as rank 0 spent them, sum up to ``total``, the process's from outside;
    ``memory`` is the peak of each rank in bytes, ``force`` the last P/(E* R).

    A run that did not finish has a ``fault``, and nothing else.
    """

    setting: Setting
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
    def linear_solve(self) -> float:
        """Seconds of all factorisations and solves."""
        return self.seconds["linear solve"]

    @property
    def contact_share(self) -> float:
        """Part of the time that the contact takes, evaluation and assembly."""
        return self.seconds["contact"] / self.total

    @property
    def share_around_factors(self) -> float:
        """Part of the solve that is not the linear solver's: contact search, assembly, return map."""
        around = self.seconds["contact"] + self.seconds["bulk"]
        return around / (around + self.linear_solve)

    @property
    def each_factor(self) -> float:
        """Seconds of a factorisation and its solves."""
        return self.linear_solve / self.factorisations

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


def process(setting: Setting, folder: Path) -> Process:
    """The run of ``setting`` as a user would start it, in the existing ``folder``, whose result is its run.json."""
    run, scene = folder.resolve() / setting.name, folder.resolve() / f"{setting.name}.toml"
    claim_folder(run, force=True)
    scene.write_text(resolved(setting.scene()), encoding="utf-8")
    archord = (sys.executable, "-m", "archord", "solve", str(scene), "-o", str(run), "--force", "--quiet")
    command = (*launcher(setting.ranks), *archord)
    return Process(command, folder, lambda: json.loads((run / "run.json").read_text(encoding="utf-8")), _A_DAY)


def cost_of(setting: Setting, timing: Timing) -> Cost:
    """The cost of the run with the median time, as its run.json tells it."""
    if timing.failure:
        return Cost(setting, timing.failure)
    report, total = timing.middle.result, timing.middle.seconds
    spent, totals = report["seconds"], report["totals"]
    seconds = {part: sum(spent.get(name, 0.0) for name in names) for part, names in PARTS.items()}
    return Cost(
        setting,
        dofs=report["mesh"]["dofs"],
        total=total,
        seconds=seconds | {REST: total - sum(seconds.values())},
        memory=report["peak_memory"],
        iterations=totals["newton_iterations"],
        coarse_iterations=sum(step["coarse_iterations"] for step in report["steps"]),
        factorisations=totals["factorisations"],
        evaluations=totals["residual_evaluations"],
        force=report["steps"][-1]["P"] / report["model"]["E_star"],
    )


def run(
    largest: float, ranks: Sequence[int], folder: Path, repeats: int, said: Callable[[Cost], None] = lambda cost: None
) -> list[Cost]:
    """Solve all settings up to ``largest`` dofs below ``folder``, each ``repeats`` times, of which the run with the
    median time counts; ``said`` follows each. Raises `InputError`.

    Numbers of ranks take turns, and the size at which a speed-up is asked for is solved `ROUNDS` times at least: the
    time of such a run can differ by a third. Both materials are solved once before, on a small mesh, so that no run
    pays for compiling forms.
    """
    found = settings(largest, ranks)
    launcher(max(ranks))
    folder.mkdir(parents=True, exist_ok=True)
    time_all([process(Setting(3000, 1, plastic), folder) for plastic in (False, True)], 1)
    costs = []
    for (dofs, _), same in groupby(found, key=lambda setting: (setting.dofs, setting.plastic)):
        of_size = list(same)
        rounds = max(repeats, ROUNDS if dofs == SPEED_UP_AT and len(of_size) > 1 else 1)
        timings = time_all([process(setting, folder) for setting in of_size], rounds)
        for setting, timing in zip(of_size, timings, strict=True):
            costs.append(cost_of(setting, timing))
            said(costs[-1])
    return costs


@dataclass(frozen=True)
class Costs:
    """The costs of all runs, and the finished ones in series and pairs."""

    all: list[Cost]

    @property
    def ranks(self) -> list[int]:
        """Numbers of ranks, 1 first."""
        return sorted({c.setting.ranks for c in self.all})

    def series(self, ranks: int, *, plastic: bool = False) -> list[Cost]:
        """Finished runs on ``ranks`` ranks by size."""
        found = (c for c in self.all if not c.fault and (c.setting.ranks, c.setting.plastic) == (ranks, plastic))
        return sorted(found, key=lambda cost: cost.dofs)

    def strong(self) -> list[tuple[Cost, list[Cost]]]:
        """Each size that was solved on one rank and on several: that on one, those on several."""
        several = [cost for ranks in self.ranks[1:] for cost in self.series(ranks)]
        found = [(one, [c for c in several if c.setting.dofs == one.setting.dofs]) for one in self.series(1)]
        return [(one, others) for one, others in found if others]

    def faults(self) -> list[str]:
        """A sentence for every run that did not finish, and every force that depends on the number of ranks."""
        said = [f"{cost.setting.name}: {cost.fault}" for cost in self.all if cost.fault]
        for one, several in self.strong():
            for cost in several:
                difference = abs(cost.force / one.force - 1)
                if not difference <= SAME_FORCE:
                    said.append(f"{cost.setting.name}: P differs by {difference:.1e} from that on 1 rank")
        return said

"""How time and memory grow with the mesh and fall with the ranks: ``archord benchmark scaling``.

The paper's joint, refined everywhere alike, on one rank and on several. A cost is a dict: "name",
"material", "dofs", "ranks", "iterations", "coarse iterations", "factorisations", "P" (over E* R),
"total" (seconds of the whole process from outside), "parts" (seconds by part, as rank 0 spent them,
which sum up to it), "memory" (peak bytes of each rank).
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from archord.benchmarks.case import paper_joint, write_table
from archord.benchmarks.cost.scaling_picture import draw
from archord.benchmarks.timing import Process, Said, Timing, solving, time_all
from archord.report.errors import InputError
from archord.report.files import read_json
from archord.scene.file import resolved
from archord.scene.presets.joint import Scene

Cost = dict[str, Any]
# element size on the arcs over R by about how many dofs that gives; the elements grow by 6.25 times
# that
SIZES = {
    5_000: 0.0350518,
    30_000: 0.0143099,
    100_000: 0.00783783,
    300_000: 0.00452517,
    1_000_000: 0.00247854,
}
PLASTIC_LARGEST = 100_000  # dofs
YIELD_STRESS = 0.002  # over E*
ELASTIC_STEPS = 2
PLASTIC_STEPS = 5
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
_A_DAY = 86400.0  # seconds that a run may take


@dataclass(frozen=True)
class Setting:
    """The joint with about ``dofs`` unknowns, elastic or plastic, on ``ranks`` ranks."""

    dofs: int
    ranks: int
    material: str = "elastic"

    @property
    def name(self) -> str:
        """Material, size and ranks."""
        return f"{self.material}_{self.dofs}_on_{self.ranks}"

    def process(self, folder: Path) -> Process:
        """The run as a user would start it, in the existing ``folder``, whose result is its
        run.json."""
        plastic = self.material == "plastic"
        steps = PLASTIC_STEPS if plastic else ELASTIC_STEPS
        scene = refined(SIZES[self.dofs], steps, YIELD_STRESS if plastic else None)
        file = folder / f"{self.name}.toml"
        file.write_text(resolved(scene), encoding="utf-8")
        command = (*launcher(self.ranks), *solving(file.name, self.name))
        read = partial(read_json, folder / self.name / "run.json")
        return Process(self.name, command, folder, read, _A_DAY, kind=self.material)


def refined(size: float, steps: int, yield_stress: float | None = None) -> Scene:
    """The paper's joint with elements of ``size`` on its arcs that grow in proportion: all such
    meshes are alike."""
    return paper_joint(size, steps, yield_stress, joint={"growth": 6.25 * size})


def launcher(ranks: int) -> list[str]:
    """The words before a command that start it on ``ranks`` ranks. Raises `InputError` if there is
    no mpirun."""
    if ranks == 1:
        return []
    if shutil.which("mpirun") is None:
        raise InputError(f"--ranks {ranks}: mpirun is not installed; only 1 is possible here.")
    return ["mpirun", "-n", str(ranks)]


def settings(largest: float, ranks: int) -> list[Setting]:
    """All runs up to ``largest`` dofs by size: elastic on 1, 2, 4, ... up to ``ranks`` ranks,
    plastic on one."""
    found = []
    for dofs in SIZES:
        if dofs > largest:
            continue
        found += [Setting(dofs, 1 << k) for k in range(ranks.bit_length())]
        if dofs <= PLASTIC_LARGEST:
            found.append(Setting(dofs, 1, "plastic"))
    return found


def run(
    chosen: Sequence[Setting], folder: Path, repeats: int, said: Said
) -> tuple[list[Cost], list[str]]:
    """Solve the ``chosen`` settings ``repeats`` times below ``folder`` (see `time_all`).

    Returns the costs of those that finish, and a sentence for every one that does not, and for
    every force that depends on the number of ranks. Raises `InputError`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    timings = time_all([setting.process(folder) for setting in chosen], repeats, said)
    costs = []
    faults = []
    for setting, timing in zip(chosen, timings, strict=True):
        if timing.failure:
            faults.append(f"{timing.process.name}: {timing.failure}")
        else:
            costs.append(cost_of(setting, timing))
    return costs, faults + unlike(costs)


def cost_of(setting: Setting, timing: Timing) -> Cost:
    """The cost of the run with the median time, as its run.json tells it."""
    report = timing.middle.result
    total = timing.middle.seconds
    parts = {
        part: sum(report["seconds"].get(name, 0.0) for name in names)
        for part, names in PARTS.items()
    }
    return {
        "name": setting.name,
        "material": setting.material,
        "dofs": report["mesh"]["dofs"],
        "ranks": setting.ranks,
        "iterations": report["totals"]["newton_iterations"],
        "coarse iterations": sum(step["coarse_iterations"] for step in report["steps"]),
        "factorisations": report["totals"]["factorisations"],
        "P": report["steps"][-1]["P"] / report["model"]["E_star"],
        "total": total,
        "parts": parts | {"rest": total - sum(parts.values())},  # what no timer covers
        "memory": report["peak_memory"],
    }


def unlike(costs: Sequence[Cost]) -> list[str]:
    """A sentence for every force that depends on the number of ranks."""
    faults = []
    for cost in costs:
        one = _alone(cost, costs)
        if one is None:
            continue
        off = abs(cost["P"] / one["P"] - 1)
        if not off <= SAME_FORCE:
            faults.append(f"{cost['name']}: P differs by {off:.1e} from that on 1 rank")
    return faults


def _alone(cost: Cost, costs: Sequence[Cost]) -> Cost | None:
    """The same joint on one rank."""
    same = cost["material"], cost["dofs"], 1
    return next((c for c in costs if (c["material"], c["dofs"], c["ranks"]) == same), None)


def exponent(dofs: Sequence[float], values: Sequence[float]) -> float:
    """The power of ``dofs``, at least two, with which ``values`` grow: least squares of their
    logarithms."""
    return float(np.polyfit(np.log(dofs), np.log(values), 1)[0])


def row(cost: Cost, costs: Sequence[Cost]) -> dict[str, object]:
    """The entries of a run by heading."""
    one = _alone(cost, costs)
    plain = ("material", "dofs", "ranks", "iterations", "coarse iterations", "factorisations")
    return {
        **{key: cost[key] for key in plain},
        **{f"{part} [s]": f"{seconds:.2f}" for part, seconds in cost["parts"].items()},
        "total [s]": f"{cost['total']:.1f}",
        "times faster": f"{one['total'] / cost['total']:.2f}" if one else "",
        "peak memory per rank [MB]": ", ".join(f"{memory / 1e6:.0f}" for memory in cost["memory"]),
        "P/(E* R)": f"{cost['P']:.10g}",
    }


def write(costs: Sequence[Cost], folder: Path) -> tuple[str, list[Path]]:
    """`write_table` of ``costs``, with the powers of N with which time and memory grow below it,
    and a picture."""
    costs = sorted(costs, key=lambda c: (c["material"], c["dofs"], c["ranks"]))
    text = ""
    for material in ("elastic", "plastic"):
        same = [cost for cost in costs if (cost["material"], cost["ranks"]) == (material, 1)]
        if len(same) < 2:
            continue
        dofs = [cost["dofs"] for cost in same]
        growing = {
            "time": [cost["total"] for cost in same],
            "linear solve": [cost["parts"]["linear solve"] for cost in same],
            "memory": [max(cost["memory"]) for cost in same],
        }
        powers = [f"{name} N^{exponent(dofs, found):.2f}" for name, found in growing.items()]
        text += f"\nLeast squares over {len(same)} sizes on one rank, {material}: "
        text += f"{', '.join(powers)}.\n"
    rows = [row(cost, costs) for cost in costs]
    return write_table(folder, "scaling", rows, text, partial(draw, costs))

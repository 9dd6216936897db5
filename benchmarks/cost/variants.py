"""Scenes and sweeps with one thing switched, by turns: ``archord benchmark variants``.

Each run is a process of its own, timed from outside; nothing else should run. The sets of
variants.toml are in groups: "joint" (one scene in variants: each should load only what it
uses), "sweep" (on one rank and on two), "yielding" (a sweep of joints that yield, with and without
what a sweep leaves out) and "strategies" (without each linear strategy;
docs/development/linear_strategies.md says what was decided by it).
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from archord.benchmarks.case import paper_joint, slug
from archord.benchmarks.cost.scaling import launcher
from archord.benchmarks.timing import Process, Said, Timing, time_all
from archord.report.files import Row, read_json, toml_beside
from archord.scene.file import resolved
from archord.scene.presets.joint import Scene

SETS = toml_beside(__file__, "variants.toml")["set"]
ABSENT = ("matplotlib", "pyvista", "scipy", "rich", "numba")  # from a solve
WATCHED = (
    *ABSENT,
    "dolfinx",
    "archord.materials.j2",
    "archord.output.fields",
    "kernel radial_return",
    "kernel closest_point",
)
WITHOUT = {
    "": "",
    "revised": "from archord.solver.linear import look_ahead; look_ahead.MOST_REVISIONS = 0",
    **{
        name: f"from archord.solver.linear.choose import LEFT_OUT; LEFT_OUT.add({name!r})"
        for name in ("condensed", "lagged", "substructured")
    },
}
_SCENES = Path(__file__).resolve().parents[2] / "scenes"
_A_DAY = 86400.0  # seconds that a run may take
# Runs the command line after a statement, and leaves a note of what that loaded before the note
# itself does.
_PROBE = """
import sys
note, change, arguments = sys.argv[1], sys.argv[2], sys.argv[3:]
from archord.cli import launcher_rank, run
exec(change)
code = run(arguments)
modules = sorted(sys.modules)
import json, re
from pathlib import Path
kernels = sorted(set(re.findall(r"/(\\w+)-[0-9a-f]{16}\\.so", Path("/proc/self/maps").read_text())))
if launcher_rank() == 0:
    Path(note).write_text(json.dumps([*modules, *("kernel " + name for name in kernels)]))
sys.exit(code)
"""


@dataclass(frozen=True)
class Variant:
    """Of the set ``case``: ``scene`` or a ``sweep`` of scenes/ is solved, or the run of
    ``picture_of`` drawn, on ``ranks`` ranks, ``without`` a linear strategy, with the ``options`` of
    the command; what is ``unused`` must not be loaded."""

    case: str
    name: str
    scene: Scene | None = None
    sweep: str = ""
    picture_of: str = ""
    ranks: int = 1
    without: str = ""
    options: Sequence[str] = ()
    unused: Sequence[str] = ()

    def process(self, folder: Path) -> Process:
        """Its process in the existing ``folder``; the result is what it loaded. Raises `InputError`
        without mpirun."""
        place = self.folder(folder)
        note = folder / "note.json"
        if self.picture_of:
            run = replace(self, name=self.picture_of).folder(folder)
            arguments = ["picture", run.name, "-o", f"{place.name}.png"]
        elif self.scene is None:
            arguments = ["sweep", str(_SCENES / self.sweep), "-q", "-o", place.name]
        else:
            place.with_suffix(".toml").write_text(resolved(self.scene), encoding="utf-8")
            arguments = ["solve", f"{place.name}.toml", "-q", "-o", place.name]
        command = (
            *launcher(self.ranks),
            sys.executable,
            "-c",
            _PROBE,
            note.name,
            WITHOUT[self.without],
            *arguments,
            *self.options,
        )

        name = f"{self.case}, {self.name}"
        return Process(
            name,
            command,
            folder,
            lambda: read_json(note),
            _A_DAY,
            clear=(place.name,),
            kind=place.name,
        )

    def folder(self, parent: Path) -> Path:
        """Its output folder below ``parent``."""
        return parent / slug(f"{self.case} {self.name}")

    def faults(self, loaded: Sequence[str]) -> list[str]:
        """A sentence for everything ``loaded`` that is not used."""
        unused = {*self.unused, *(ABSENT if self.scene is not None else ())}
        return [
            f"{self.case}, {self.name}: loads {name}, which it does not need"
            for name in loaded
            if name in unused
        ]


def variants(group: str) -> list[Variant]:
    """The variants of a group, set by set."""
    found = []
    for given in SETS:
        if given["group"] != group:
            continue
        for name, own in given["variants"].items():
            scene = None
            if "scene" in given and "picture_of" not in own:
                scene = paper_joint(**given["scene"] | own.get("scene", {}))
            keys = own | {"scene": scene, "sweep": given.get("sweep", "")}
            found.append(Variant(given["name"], name, **keys))
    return found


def run(
    chosen: Sequence[Variant], folder: Path, repeats: int, said: Said
) -> tuple[list[Row], list[str]]:
    """Run the ``chosen`` variants ``repeats`` times below ``folder`` (see `time_all`), each once
    before, uncounted.

    Returns a row of entries for each, whose ratios are to the first of its set, run by run, the
    median; and a sentence for every failure and for everything loaded that is not used. Raises
    `InputError`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    processes = [variant.process(folder.resolve()) for variant in chosen]
    rows: list[Row] = []
    faults: list[str] = []
    firsts: dict[str, Timing] = {}
    for variant, timing in zip(chosen, time_all(processes, repeats, said), strict=True):
        first = firsts.setdefault(variant.case, timing)
        if failure := timing.failure or first.failure:
            faults.append(f"{timing.process.name}: {failure}")
            continue
        loaded = timing.middle.result
        files = [file for file in variant.folder(folder).rglob("*") if file.is_file()]
        written = sum(file.stat().st_size for file in files)
        row = {
            "case": variant.case,
            "variant": variant.name,
            "seconds": f"{timing.median:.2f}",
            "times as long": f"{ratio(timing, first, 'seconds'):.2f}",
            "CPU [s]": f"{median(run.cpu for run in timing.runs):.2f}",
            "times the CPU": f"{ratio(timing, first, 'cpu'):.2f}",
            "peak memory [MB]": f"{timing.middle.memory / 1e6:.0f}",
            "written [kB]": f"{written / 1e3:.0f}",
            "loads": ", ".join(name for name in WATCHED if name in loaded),
        }
        rows.append(row)
        faults += variant.faults(loaded)
    return rows, faults


def ratio(one: Timing, other: Timing, what: str) -> float:
    """``what`` ("seconds" or "cpu") of the runs of ``one`` over the runs of ``other``: the median
    of the pairs."""
    return median(
        getattr(a, what) / getattr(b, what) for a, b in zip(one.runs, other.runs, strict=False)
    )

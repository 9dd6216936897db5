"""What one scene costs in variants: each should pay only for what it uses. ``archord benchmark variants``."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

from archord.benchmarks.case import paper_joint, slug
from archord.benchmarks.timing import Process, Timing, time_all
from archord.output.folder import claim_folder
from archord.report.files import write_report
from archord.report.table import Table
from archord.scene.file import resolved

STEPS, ELEMENT_SIZE, YIELD_STRESS = 5, 0.04, 0.002
PLOTTING = ("matplotlib", "pyvista")
PLASTICITY = ("archord.materials.j2", "kernel radial_return")
FIELDS = ("archord.output.fields",)
CURVES = ("kernel closest_point",)
ALWAYS_ABSENT = (*PLOTTING, "scipy", "rich", "numba")  # from a solve
WATCHED = (*ALWAYS_ABSENT, *PLASTICITY, *FIELDS, *CURVES, "dolfinx")

# Runs the command line in a process of its own, and leaves a note of what that loaded before the note itself does.
_PROBE = """
import sys
note, arguments = sys.argv[1], sys.argv[2:]
from archord.cli import run
code = run(arguments)
modules = sorted(sys.modules)
import json, re
from pathlib import Path
kernels = sorted(set(re.findall(r"/(\\w+)-[0-9a-f]{16}\\.so", Path("/proc/self/maps").read_text())))
Path(note).write_text(json.dumps({"modules": modules, "kernels": kernels}))
sys.exit(code)
"""


@dataclass(frozen=True)
class Variant:
    """One way to treat the scene: the ``sections`` that differ, and what must not be loaded for it.

    With ``drawn`` it is the picture of the run of another variant.
    """

    name: str
    unused: tuple[str, ...]
    yield_stress: float | None = None
    sections: dict[str, dict] = field(default_factory=dict)
    drawn: str = ""


_NO_FIELDS = {"output": {"fields": False}}
_RIGID = {"pin": {"rigid": True}}
VARIANTS = (
    Variant("elastic", (*ALWAYS_ABSENT, *PLASTICITY)),
    Variant("elastic, rigid pin", (*ALWAYS_ABSENT, *PLASTICITY, *CURVES), sections=_RIGID),
    Variant("elastic, no fields", (*ALWAYS_ABSENT, *PLASTICITY, *FIELDS), sections=_NO_FIELDS),
    Variant("plastic", ALWAYS_ABSENT, YIELD_STRESS),
    Variant("plastic, rigid pin", (*ALWAYS_ABSENT, *CURVES), YIELD_STRESS, _RIGID),
    Variant("plastic, no fields", (*ALWAYS_ABSENT, *FIELDS), YIELD_STRESS, _NO_FIELDS),
    Variant("picture of plastic", ("dolfinx", "pyvista", *FIELDS, *PLASTICITY, *CURVES), drawn="plastic"),
)


@dataclass(frozen=True)
class Use:
    """What a variant used: median ``seconds`` of its process, peak ``memory`` and ``written`` in bytes, the number of
    ``modules`` loaded, and those of `WATCHED` that were ``loaded``; ``dofs`` of its run."""

    variant: Variant
    dofs: int
    seconds: float
    memory: int
    modules: int
    loaded: tuple[str, ...]
    written: int

    def faults(self) -> list[str]:
        """A sentence for everything loaded that the variant does not use."""
        unused = [name for name in self.loaded if name in self.variant.unused]
        return [f"{self.variant.name}: loads {name}, which it does not need" for name in unused]


def run(
    folder: Path,
    repeats: int = 3,
    said: Callable[[str], None] = lambda sentence: None,
    variants: Sequence[Variant] = VARIANTS,
) -> list[Use]:
    """Run the ``variants`` ``repeats`` times, in turn, in processes of their own below ``folder``; ``said`` follows
    each.

    The first runs compile forms and kernels, which no variant pays for: each runs once more, uncounted.
    Raises `RuntimeError` if one fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = {process(variant, folder): variant for variant in variants}

    def told(done: Process, repeat: int, sentence: str) -> None:
        said(f"{names[done].name}: {sentence}{'' if repeat else ' (not counted)'}")

    return [use_of(names[timing.process], timing, folder) for timing in time_all(list(names), repeats, told)]


def process(variant: Variant, folder: Path) -> Process:
    """The command of ``variant`` in the existing ``folder``; its result is the note of what it loaded."""
    run_folder, note = folder.resolve() / slug(variant.drawn or variant.name), folder.resolve() / "note.json"
    arguments = ["picture", str(run_folder)]
    if not variant.drawn:
        scene = folder.resolve() / f"{slug(variant.name)}.toml"
        joint = paper_joint(ELEMENT_SIZE, STEPS, variant.yield_stress, **variant.sections)
        scene.write_text(resolved(joint), encoding="utf-8")
        claim_folder(run_folder, force=True)
        arguments = ["solve", str(scene), "-o", str(run_folder), "--force", "--quiet"]

    def read() -> dict[str, Any]:
        return json.loads(note.read_text(encoding="utf-8"))

    return Process((sys.executable, "-c", _PROBE, str(note), *arguments), folder, read, kind=variant.name)


def use_of(variant: Variant, timing: Timing, folder: Path) -> Use:
    """What ``variant`` used. Raises `RuntimeError` if it failed."""
    if timing.failure:
        raise RuntimeError(f"{variant.name}: {timing.failure}")
    run_folder = folder / slug(variant.drawn or variant.name)
    note = timing.middle.result
    names = {*note["modules"], *(f"kernel {name}" for name in note["kernels"])}
    report = json.loads((run_folder / "run.json").read_text(encoding="utf-8"))
    files = (f for f in run_folder.rglob("*") if f.is_file() and (f.name == "picture.png") == bool(variant.drawn))
    return Use(
        variant,
        dofs=report["mesh"]["dofs"],
        seconds=timing.median,
        memory=int(median(run.memory for run in timing.runs)),
        modules=len(note["modules"]),
        loaded=tuple(name for name in WATCHED if name in names),
        written=sum(file.stat().st_size for file in files),
    )


def row(used: Use) -> dict[str, object]:
    """The entries of a variant by heading."""
    return {
        "variant": used.variant.name,
        "dofs": used.dofs,
        "seconds": f"{used.seconds:.2f}",
        "peak memory [MB]": f"{used.memory / 1e6:.0f}",
        "modules": used.modules,
        "written [kB]": f"{used.written / 1e3:.0f}",
        **{name: "loaded" if name in used.loaded else "" for name in WATCHED},
    }


def write(uses: Sequence[Use], folder: Path) -> tuple[str, list[Path]]:
    """Write variants.csv and variants.md into ``folder``; returns the table and the files."""
    rows = [row(used) for used in uses]
    text = Table.of(rows).markdown()
    return text, write_report(folder, "variants", rows, text)

"""What one scene costs in variants: each should pay only for what it uses. ``archord benchmark variants``."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from archord.benchmarks.case import paper_joint
from archord.benchmarks.report_files import rows_table, write_files
from archord.output.folder import claim_folder
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
from archord.output.run_json import peak_memory
kernels = sorted(set(re.findall(r"/(\\w+)-[0-9a-f]{16}\\.so", Path("/proc/self/maps").read_text())))
Path(note).write_text(json.dumps({"modules": modules, "kernels": kernels, "memory": peak_memory()}))
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


def run(folder: Path, repeats: int = 3, said: Callable[[Use], None] = lambda used: None) -> list[Use]:
    """Run every variant ``repeats`` times in processes of their own below ``folder``; ``said`` follows each.

    The first runs compile forms and kernels, which no variant pays for: each runs once more, uncounted.
    Raises `RuntimeError` if one fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    uses = []
    for variant in VARIANTS:
        uses.append(use(variant, folder, repeats))
        said(uses[-1])
    return uses


def use(variant: Variant, folder: Path, repeats: int) -> Use:
    """What ``variant`` uses, of the runs below the existing ``folder``. Raises `RuntimeError` if it fails."""
    run_folder = folder / slug(variant.drawn or variant.name)
    arguments = ["picture", str(run_folder)]
    if not variant.drawn:
        scene = folder / f"{slug(variant.name)}.toml"
        joint = paper_joint(ELEMENT_SIZE, STEPS, variant.yield_stress, **variant.sections)
        scene.write_text(resolved(joint), encoding="utf-8")
        claim_folder(run_folder, force=True)
        arguments = ["solve", str(scene), "-o", str(run_folder), "--force", "--quiet"]
    _process(variant, arguments, folder)
    processes = [_process(variant, arguments, folder) for _ in range(repeats)]
    note = processes[0][1]
    names = {*note["modules"], *(f"kernel {name}" for name in note["kernels"])}
    report = json.loads((run_folder / "run.json").read_text(encoding="utf-8"))
    files = [file for file in run_folder.rglob("*") if file.is_file()]
    written = sum(file.stat().st_size for file in files if (file.name == "picture.png") == bool(variant.drawn))
    return Use(
        variant,
        dofs=report["mesh"]["dofs"],
        seconds=median(seconds for seconds, _ in processes),
        memory=int(median(note["memory"] for _, note in processes)),
        modules=len(note["modules"]),
        loaded=tuple(name for name in WATCHED if name in names),
        written=written,
    )


def _process(variant: Variant, arguments: list[str], folder: Path) -> tuple[float, dict[str, Any]]:
    """Seconds of a process with the command line ``arguments``, and its note."""
    note = folder / "note.json"
    begun = perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", _PROBE, str(note), *arguments], capture_output=True, text=True, check=False
    )
    seconds = perf_counter() - begun
    if done.returncode:
        raise RuntimeError(f"{variant.name}: exit code {done.returncode}: {done.stderr.strip()[-300:]}")
    return seconds, json.loads(note.read_text(encoding="utf-8"))


def slug(name: str) -> str:
    """``name`` as the name of a folder."""
    return name.replace(",", "").replace(" ", "_")


def row(used: Use) -> dict[str, str]:
    """The entries of a variant by heading."""
    return {
        "variant": used.variant.name,
        "dofs": str(used.dofs),
        "seconds": f"{used.seconds:.2f}",
        "peak memory [MB]": f"{used.memory / 1e6:.0f}",
        "modules": str(used.modules),
        "written [kB]": f"{used.written / 1e3:.0f}",
        **{name: "loaded" if name in used.loaded else "" for name in WATCHED},
    }


def markdown(uses: list[Use]) -> str:
    """The variants as a table."""
    return "\n".join([*rows_table([row(used) for used in uses]), ""])


def write_report(uses: list[Use], folder: Path) -> list[Path]:
    """Write variants.csv and variants.md into ``folder``; returns the files."""
    return write_files(folder, "variants", [row(used) for used in uses], markdown(uses))

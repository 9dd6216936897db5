"""What one scene costs in variants: each should pay only for what it uses. ``archord benchmark variants``."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from archord.benchmarks.case import Case, paper_joint
from archord.benchmarks.timing import Process, Timing, time_all
from archord.output.folder import claim_folder
from archord.report.files import write_report
from archord.report.table import Table
from archord.scene.file import resolved

PLASTICITY = ("archord.materials.j2", "kernel radial_return")
FIELDS = ("archord.output.fields",)
CURVES = ("kernel closest_point",)
ABSENT = ("matplotlib", "pyvista", "scipy", "rich", "numba")  # from a solve
WATCHED = (*ABSENT, *PLASTICITY, *FIELDS, *CURVES, "dolfinx")

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
    """A joint that is solved or, if ``drawn``, the picture of its run; what is ``unused`` must not be loaded for it."""

    case: Case
    unused: tuple[str, ...]
    drawn: bool = False

    @property
    def name(self) -> str:
        """What the tables call it."""
        return f"picture of {self.case.name}" if self.drawn else self.case.name


def variants(element_size: float = 0.04, steps: int = 5) -> list[Variant]:
    """The paper's joint, elastic and plastic, deformable, with a rigid pin, without fields; and a picture."""
    ways: dict[str, tuple[tuple[str, ...], dict]] = {
        "": ((), {}),
        ", rigid pin": (CURVES, {"pin": {"rigid": True}}),
        ", no fields": (FIELDS, {"output": {"fields": False}}),
    }
    found = [
        Variant(Case(material + way, paper_joint(element_size, steps, strength, **keys)), ABSENT + plain + unused)
        for material, strength, plain in (("elastic", None, PLASTICITY), ("plastic", 0.002, ()))
        for way, (unused, keys) in ways.items()
    ]
    drawn = Variant(found[len(ways)].case, ("dolfinx", "pyvista", *FIELDS, *PLASTICITY, *CURVES), drawn=True)
    return [*found, drawn]


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
    chosen: Sequence[Variant],
    folder: Path,
    repeats: int = 3,
    said: Callable[[str], None] = lambda sentence: None,
    *,
    warm: bool = True,
) -> list[Use]:
    """Run the ``chosen`` ones ``repeats`` times, in turn, in processes of their own below ``folder``; ``said`` follows
    each.

    The first runs compile forms and kernels, which no variant pays for: each runs once more, uncounted, if ``warm``.
    Raises `RuntimeError` if one fails.
    """
    folder.mkdir(parents=True, exist_ok=True)
    processes = [process(variant, folder.resolve(), warm) for variant in chosen]

    def told(done: Process, repeat: int, sentence: str) -> None:
        said(f"{chosen[processes.index(done)].name}: {sentence}{'' if repeat else ' (not counted)'}")

    return [use_of(*pair, folder) for pair in zip(chosen, time_all(processes, repeats, told), strict=True)]


def process(variant: Variant, folder: Path, warm: bool) -> Process:
    """The command of ``variant`` in the existing ``folder``; its result is the note of what it loaded."""
    run_folder, note = variant.case.folder(folder), folder / "note.json"
    arguments = ["picture", str(run_folder)]
    if not variant.drawn:
        scene = run_folder.with_suffix(".toml")
        scene.write_text(resolved(variant.case.scene), encoding="utf-8")
        claim_folder(run_folder, force=True)
        arguments = ["solve", str(scene), "-o", str(run_folder), "--force", "--quiet"]
    command = (sys.executable, "-c", _PROBE, str(note), *arguments)
    kind = variant.name if warm else None
    return Process(command, folder, lambda: json.loads(note.read_text(encoding="utf-8")), kind=kind)


def use_of(variant: Variant, timing: Timing, folder: Path) -> Use:
    """What ``variant`` used. Raises `RuntimeError` if it failed."""
    if timing.failure:
        raise RuntimeError(f"{variant.name}: {timing.failure}")
    run_folder, note = variant.case.folder(folder), timing.middle.result
    names = {*note["modules"], *(f"kernel {name}" for name in note["kernels"])}
    report = json.loads((run_folder / "run.json").read_text(encoding="utf-8"))
    files = (f for f in run_folder.rglob("*") if f.is_file() and (f.name == "picture.png") == variant.drawn)
    return Use(
        variant,
        dofs=report["mesh"]["dofs"],
        seconds=timing.median,
        memory=timing.middle.memory,
        modules=len(note["modules"]),
        loaded=tuple(name for name in WATCHED if name in names),
        written=sum(file.stat().st_size for file in files),
    )


def write(uses: Sequence[Use], folder: Path) -> tuple[str, list[Path]]:
    """Write variants.csv and variants.md into ``folder``; returns the table and the files."""
    rows = [
        {
            "variant": used.variant.name,
            "dofs": used.dofs,
            "seconds": f"{used.seconds:.2f}",
            "peak memory [MB]": f"{used.memory / 1e6:.0f}",
            "modules": used.modules,
            "written [kB]": f"{used.written / 1e3:.0f}",
            **{name: "loaded" if name in used.loaded else "" for name in WATCHED},
        }
        for used in uses
    ]
    text = Table.of(rows).markdown()
    return text, write_report(folder, "variants", rows, text)

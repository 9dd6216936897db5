"""A sweep solved into its folder: sweep.toml, cases/, and the tables."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from pathlib import Path

from archord.output.disk import replace_file
from archord.scene.errors import InputError
from archord.scene.scene import Scene
from archord.studies import tables
from archord.studies.cases import Case, Sweep, read_sweep
from archord.studies.sweep_file import SweepFile
from archord.studies.tables import CASES, Result, Tables, of_case, report_of, result_of

FILE = "sweep.toml"
_DOFS_PER_CELL = {2: 4.3, 3: 9.5}
_ITERATIONS = 5.5  # Newton iterations of an output step
_SETUP = 0.1, 2e-5  # seconds of a joint, and per dof
_STEP = 0.02  # seconds of output and checkpoint
_ITERATION = {False: 3e-6, True: 5e-6}  # seconds per dof of an elastic and of a plastic iteration
_LINEAR = 3e4  # dofs up to which an iteration costs in proportion to them


@dataclass(frozen=True)
class Share:
    """Part ``index`` of ``total`` of a sweep, for a job array."""

    index: int = 1
    total: int = 1

    @classmethod
    def parse(cls, text: str) -> Share:
        """``"3/10"``. Raises `InputError`."""
        found = re.fullmatch(r"(\d+)/(\d+)", text)
        if not found or not 1 <= int(found[1]) <= int(found[2]):
            raise InputError(f"--array {text}: must be I/N, with I from 1 to N.")
        return cls(int(found[1]), int(found[2]))

    def of(self, cases: list[Case]) -> list[Case]:
        """Every ``total``-th of ``cases``, the longest first, so that all parts take about as long."""
        longest = sorted(cases, key=lambda case: -expected_seconds(case.scene))
        return longest[self.index - 1 :: self.total]


@dataclass(frozen=True)
class Job:
    """A scene to solve into ``folder``, expected to take ``cost`` seconds."""

    scene: Scene
    folder: Path
    cost: float

    @property
    def mesh(self) -> str:
        """The same for scenes whose meshes are the same."""
        return f"{self.scene.joint!r} {self.scene.analysis.degree} {self.scene.pin.rigid}"


def check_ranks(ranks: int, ranks_per_case: int) -> None:
    """Raise `InputError` if ``ranks`` are no whole number of groups."""
    if ranks % ranks_per_case:
        raise InputError(f"--ranks-per-case {ranks_per_case}: must divide the number of ranks, {ranks}.")


def default_folder(path: Path) -> Path:
    """runs/NAME for NAME.sweep.toml or NAME.toml."""
    return Path("runs") / path.stem.removesuffix(".sweep")


def claim(sweep: Sweep, folder: Path) -> None:
    """Make ``folder`` ready for the sweep, or go on in it, and write the resolved sweep file.

    A folder of another sweep must share a case with this one: then it is taken for an earlier state of the same. Raises
    `InputError` if the folder cannot be used, or holds something else.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder}: is a file, not the folder of a sweep.")
        if folder.exists() and any(folder.iterdir()) and not (folder / FILE).exists():
            raise InputError(f"{folder}: is not empty and holds no sweep; choose another folder with -o.")
        (folder / CASES).mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise InputError(f"{folder}: cannot be used for a sweep: Permission denied.")
        text = resolved(sweep.file)
        with tables.alone(folder):
            if _holds_another(folder, sweep, text):
                raise InputError(
                    f"{folder}: holds another sweep, which has no case in common with {sweep.path}; choose another "
                    "folder with -o, or remove this one."
                )
            replace_file(folder / FILE, text)
    except OSError as error:
        raise InputError(f"{folder}: cannot be used for a sweep: {error.strerror}.") from None


def _holds_another(folder: Path, sweep: Sweep, text: str) -> bool:
    """Whether the sweep in ``folder`` has no case of ``sweep``, whose resolved file is ``text``."""
    try:
        if (folder / FILE).read_text(encoding="utf-8") == text:
            return False
        held = read_sweep(folder / FILE)
    except (OSError, InputError):  # none yet, or none that this version reads: nothing tells that it is another
        return False
    return not {case.run for case in held.cases} & {case.run for case in sweep.cases}


def resolved(file: SweepFile) -> str:
    """The sweep as TOML with its base scene in it; it gives the same cases."""
    import tomli_w

    return tomli_w.dumps(file.model_dump(by_alias=True, exclude_none=True, exclude_defaults=True))


def open_jobs(sweep: Sweep, folder: Path, share: Share, *, retry: bool) -> tuple[list[Result], list[Job]]:
    """What of this ``share`` has ended already, and the jobs that are left; with ``retry`` also those that failed."""
    ended, jobs = [], []
    for case in share.of(sweep.distinct):
        run = of_case(case, folder)
        result = result_of(run)
        if case.scene.analysis.accuracy is not None and result.status == "done" and "accuracy" not in report_of(run):
            result = replace(result, status="open", steps=0)  # killed between two meshes
        if result.status == "done" or (result.ended and not retry):
            ended.append(result)
        else:
            rest = 1 - result.steps / max(1, len(case.scene.targets))
            jobs.append(Job(case.scene, run, expected_seconds(case.scene) * max(rest, 0.05)))
    return ended, jobs


def gather(sweep: Sweep, folder: Path, results: list[Result]) -> Tables:
    """Write the tables of what is there, with the ``results`` of this process. Raises `InputError` if they cannot be
    written."""
    try:
        return tables.write(sweep, folder, {r.run: r for r in results if r.status in ("failed", "busy")})
    except OSError as error:
        raise InputError(f"{error.filename} cannot be written: {error.strerror}.") from None


def expected_dofs(scene: Scene) -> float:
    """About how many dofs the mesh of ``scene`` will have; a rigid pin, a tenth of them or less, counts as meshed."""
    return _DOFS_PER_CELL[scene.analysis.degree] * scene.joint.expected_cells


def expected_seconds(scene: Scene) -> float:
    """About how long ``scene`` will take on one rank of a machine of 2020, in a process that has solved before.

    Fitted by hand to runs of 2 450 to 8 336 dofs, elastic and plastic (README); beyond ``_LINEAR`` dofs the
    factorisation of a plane mesh grows as dofs^1.5 (George 1973).
    """
    dofs = expected_dofs(scene)
    iteration = _ITERATION[scene.plastic] * dofs * max(1.0, (dofs / _LINEAR) ** 0.5)
    return _SETUP[0] + _SETUP[1] * dofs + len(scene.targets) * (_STEP + _ITERATIONS * iteration)

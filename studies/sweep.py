"""A sweep's folder: sweep.toml and cases/, with a run folder for each case; what is left, and what it costs."""

from __future__ import annotations

import re
from pathlib import Path

from archord.output.disk import replace_file
from archord.output.folder import occupied
from archord.scene.errors import InputError
from archord.scene.scene import Scene
from archord.studies.cases import Case, Sweep
from archord.studies.tables import CASES, Result, result_of

FILE = "sweep.toml"
_DOFS_PER_CELL = {2: 4.3, 3: 9.5}
_STEP = {False: 1.7e-5, True: 2.8e-5}  # seconds per dof of an elastic and of a plastic output step
_LINEAR = 3e4  # dofs up to which a step costs in proportion to them


def claim(sweep: Sweep, folder: Path) -> None:
    """Make ``folder`` ready for the sweep, or go on in it, and write the resolved sweep file. Raises `InputError` if it
    cannot be used or holds something else; a sweep that shares a case is taken for an earlier state of this one."""
    try:
        if folder.is_dir() and any(folder.iterdir()) and not (folder / FILE).exists():
            raise InputError(f"{folder}: is not empty and holds no sweep; choose another folder with -o.")
        (folder / CASES).mkdir(parents=True, exist_ok=True)
        with occupied(folder / CASES, wait=True):
            held = {run.name for run in (folder / CASES).iterdir()}
            if held and held.isdisjoint(case.run for case in sweep.cases):
                raise InputError(
                    f"{folder}: holds another sweep, which has no case in common with {sweep.path}; choose another "
                    "folder with -o, or remove this one."
                )
            replace_file(folder / FILE, sweep.file.resolved())
    except OSError as error:
        raise InputError(f"{folder}: cannot be used for a sweep: {error.strerror}.") from None


def part_of(cases: list[Case], part: str) -> list[Case]:
    """Part "I/N" of ``cases`` for a job array: every N-th, the longest first, so that all parts take about as long.
    Raises `InputError`."""
    found = re.fullmatch(r"(\d+)/(\d+)", part)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise InputError(f"--array {part}: must be I/N, with I from 1 to N.")
    longest = sorted(cases, key=lambda case: -expected_seconds(case.scene))
    return longest[int(found[1]) - 1 :: int(found[2])]


def open_cases(cases: list[Case], folder: Path, *, retry: bool) -> tuple[list[Result], list[Case]]:
    """What of ``cases`` has ended already, and those that are left; with ``retry`` also those that failed."""
    over = ("done",) if retry else ("done", "stopped", "failed")
    results = [result_of(case, folder) for case in cases]
    left = [case for case, result in zip(cases, results, strict=True) if result.status not in over]
    return [result for result in results if result.status in over], left


def expected_seconds(scene: Scene) -> float:
    """About how long ``scene`` will take on one rank of a machine of 2020, in a process that has solved before.

    Fitted by hand to runs of 2 450 to 8 336 dofs, elastic and plastic (README); beyond ``_LINEAR`` dofs the
    factorisation of a plane mesh grows as dofs^1.5 (George 1973).
    """
    dofs = _DOFS_PER_CELL[scene.analysis.degree] * scene.joint.expected_cells
    step = 0.02 + _STEP[scene.plastic] * dofs * max(1.0, (dofs / _LINEAR) ** 0.5)
    return 0.1 + 2e-5 * dofs + len(scene.targets) * step

"""A sweep's folder as an object: its cases, their histories in one table, and their runs."""

from __future__ import annotations

import csv
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from archord.output.folder import is_sweep
from archord.postprocess.run import Run
from archord.scene.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_FIRST = ["case", "run", "status"]  # columns before the varied keys


def short(heading: str) -> str:
    """The ``heading`` of a varied key without its section, but for the bodies, which have the same keys."""
    section, dot, name = heading.partition(".")
    return name if dot and section not in ("pin", "block") else heading


class Sweep:
    """The sweep in ``folder``, as its tables were when this was made.

    Cases are numbered from 1; cases whose scenes are the same share a run. Raises `InputError` if the folder is not
    that of a sweep or its table of cases cannot be read.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        for name in ("sweep.toml", "cases.csv"):
            if not (self.folder / name).is_file():
                cure = f"; archord sweep {self.folder} --gather writes it" if is_sweep(self.folder) else ""
                raise InputError(f"{self.folder}: is not the folder of a sweep: {name} is missing{cure}.")
        path = self.folder / "cases.csv"
        try:
            with path.open(newline="", encoding="utf-8") as file:
                reader = csv.DictReader(file)
                headings, self.rows = list(reader.fieldnames or []), list(reader)
            if (
                headings[:3] != _FIRST
                or "message" not in headings
                or any(None in (*row, *row.values()) for row in self.rows)
            ):
                raise ValueError("headings")
        except (OSError, ValueError, csv.Error):
            raise InputError(f"{path}: cannot be read as the cases of a sweep.") from None
        self.headings = headings
        self.varied = headings[len(_FIRST) : headings.index("message")]

    def __len__(self) -> int:
        """Number of cases."""
        return len(self.rows)

    def __repr__(self) -> str:
        """Folder, keys and number of cases by status."""
        return f"<Sweep {self.folder}: {len(self)} cases over {', '.join(self.keys)}; {self.states}>"

    @property
    def states(self) -> str:
        """Number of cases by status, in words."""
        states = [row["status"] for row in self.rows]
        return ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))

    @property
    def keys(self) -> list[str]:
        """The varied keys, without units."""
        return [heading.partition(" [")[0] for heading in self.varied]

    @cached_property
    def moving(self) -> list[str]:
        """Headings of those varied keys that are not the same in all cases."""
        return [heading for heading in self.varied if len({row[heading] for row in self.rows}) > 1]

    @cached_property
    def cases(self) -> pd.DataFrame:
        """cases.csv: a row for each case, with the values of its last step; ``attrs["units"]`` names units."""
        return self._frame("cases.csv")

    @cached_property
    def history(self) -> pd.DataFrame:
        """sweep.csv: a row for each case and accepted step; ``attrs["units"]`` names units."""
        return self._frame("sweep.csv")

    def _frame(self, name: str) -> pd.DataFrame:
        from archord.postprocess.frames import sweep_frame

        return sweep_frame(self.folder / name)

    def run(self, case: int | str) -> Run:
        """The run of a case, by the case's number or the run's name. Raises `InputError` if there is none (yet)."""
        for row in self.rows:
            if row["run"] == case or row["case"] == str(case):
                return Run(self.folder / "cases" / row["run"])
        raise InputError(f"{self.folder}: has no case {case}; its cases are 1 to {len(self)}.")

    @cached_property
    def runs(self) -> dict[int, Run]:
        """The runs by case that have an accepted step; cases that share a run by the first of them.

        A run that cannot be read is left out; `unreadable` tells why.
        """
        return {case: run for case, run in self._read.items() if isinstance(run, Run) and run.steps}

    @property
    def unreadable(self) -> dict[int, str]:
        """Sentences by case, for runs that have results which cannot be read."""
        return {case: fault for case, fault in self._read.items() if isinstance(fault, str)}

    @cached_property
    def _read(self) -> dict[int, Run | str]:
        found: dict[int, Run | str] = {}
        for name, case in {row["run"]: int(row["case"]) for row in reversed(self.rows)}.items():
            folder = self.folder / "cases" / name
            if (folder / "history.csv").is_file():
                try:
                    found[case] = Run(folder)
                except InputError as error:
                    found[case] = str(error)
        return dict(sorted(found.items()))

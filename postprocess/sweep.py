"""A sweep's folder as an object: its cases, their histories in one table, and their runs."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from archord.output.folder import is_sweep
from archord.postprocess.run import Run
from archord.report.errors import InputError

if TYPE_CHECKING:
    import pandas as pd

_FIRST = ["case", "run", "status"]  # columns before the varied keys


class Sweep:
    """The sweep in a folder, as it was when this was made.

    Cases are numbered from 1. Cases whose scenes are the same share a run.

    Parameters
    ----------
    folder : str or Path
        The folder of the sweep.

    Attributes
    ----------
    folder : Path
        The folder of the sweep.
    cases : DataFrame
        What cases.csv holds: a row for each case, with the values of its last step.
    keys : list of str
        The varied keys.

    Raises
    ------
    InputError
        For a folder that is not a sweep's, and for a table of cases that cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> import archord
    >>> folder = Path("runs/doctest_sweep")
    >>> folder.mkdir(parents=True, exist_ok=True)
    >>> _ = (folder / "sweep.toml").write_text("")
    >>> table = "case,run,status,joint.clearance [mm],message\\n1,a,done,0.05,\\n2,b,done,0.1,\\n"
    >>> _ = (folder / "cases.csv").write_text(table)
    >>> sweep = archord.Sweep(folder)
    >>> sweep.keys, sweep.states
    (['joint.clearance'], '2 done')
    >>> sweep.label(2)
    'clearance = 0.1 mm'
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        for name in ("sweep.toml", "cases.csv"):
            if not (self.folder / name).is_file():
                cure = ""
                if is_sweep(self.folder):
                    cure = f"; archord sweep {self.folder} --gather writes it"
                raise InputError(
                    self.folder, f"is not the folder of a sweep: {name} is missing{cure}."
                )
        self.cases = self._read("cases.csv", _FIRST)
        names = list(self.cases)
        self.keys = names[len(_FIRST) : names.index("message")]

    def __len__(self) -> int:
        """Number of cases."""
        return len(self.cases)

    @property
    def states(self) -> str:
        """Number of cases by status, in words."""
        return ", ".join(
            f"{n} {state}" for state, n in self.cases["status"].value_counts(sort=False).items()
        )

    @property
    def moving(self) -> list[str]:
        """Those varied keys that are not the same in all cases."""
        return [key for key in self.keys if self.cases[key].nunique(dropna=False) > 1]

    @cached_property
    def history(self) -> pd.DataFrame:
        """sweep.csv: a row for each case and accepted step; ``attrs["units"]`` names units."""
        return self._read("sweep.csv", [])

    def _read(self, name: str, first: list[str]) -> pd.DataFrame:
        from archord.postprocess.arrays.frames import read_frame

        try:
            table = read_frame(self.folder / name)
            if list(table)[: len(first)] != first or (first and "message" not in table):
                raise ValueError("columns")
        except (OSError, ValueError):
            raise InputError(self.folder / name, "cannot be read as a table of a sweep.") from None
        return table

    def run(self, case: int | str) -> Run:
        """The run of a case, by the case's number or the run's name. Raises `InputError` if there
        is none (yet)."""
        found = self.cases["run"][(self.cases["case"] == case) | (self.cases["run"] == case)]
        if found.empty:
            raise InputError(self.folder, f"has no case {case}; its cases are 1 to {len(self)}.")
        return Run(self.folder / "cases" / found.iloc[0])

    @cached_property
    def runs(self) -> dict[int, Run]:
        """The runs by case that have an accepted step and can be read; cases that share a run by
        the first of them."""
        return {case: run for case, run in self._found[0].items() if run.steps}

    @property
    def unread(self) -> dict[int, str]:
        """Why runs of cases that are done cannot be read, in words, by case."""
        return self._found[1]

    def label(self, case: int) -> str:
        """What is varied and how in a ``case``, for legends: ``clearance = 0.05 mm, E = 210000
        MPa``."""
        row = self.cases[self.cases["case"] == case].iloc[0]
        units = self.cases.attrs["units"]
        short = {key: key.rpartition(".")[2] for key in self.moving}
        names = list(short.values())
        said = []
        for key, name in short.items():
            named = name if names.count(name) == 1 else key
            said.append(f"{named} = {shown(row[key], 'none')} {units.get(key, '')}".rstrip())
        return ", ".join(said) or f"case {case}"

    @cached_property
    def _found(self) -> tuple[dict[int, Run], dict[int, str]]:
        """Runs that can be read, and why runs of other cases that are done cannot."""
        found = {}
        faults = {}
        first = self.cases.drop_duplicates("run")
        for case, status in zip(first["case"], first["status"], strict=True):
            try:
                found[int(case)] = self.run(int(case))
            except InputError as error:
                if status == "done":
                    faults[int(case)] = str(error)
        return found, faults


def shown(value: object, missing: str) -> str:
    """A value of a table, ``missing`` for what is no number."""
    if isinstance(value, float):
        return missing if np.isnan(value) else f"{value:.6g}"
    return str(value)

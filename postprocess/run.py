"""A run folder as an object: scene, status, history, contact pressure and fields. It reads, and
never solves.

Arrays and tables are read when they are asked for, and pandas is imported only for tables.
"""

from __future__ import annotations

import csv
import logging
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from archord.materials.kinematics import Kinematics, kinematics
from archord.output.files.seal import ChangedError, read_report, require_intact
from archord.output.folder import is_sweep
from archord.output.history import fault_of_history, read_history
from archord.postprocess.around_axis import (
    ALONG_Z,
    ORIGIN,
    Axis,
    LineLoad,
    Unrolled,
    line_load,
    unrolled,
)
from archord.postprocess.arrays.arc import read_contact
from archord.postprocess.arrays.fields import BODIES, Fields, read_fields, read_points
from archord.postprocess.curve import CURVES, RunCurve
from archord.postprocess.probes.ask import probe
from archord.postprocess.probes.probe import Probe
from archord.presets.views import view_of
from archord.report.by_name import Amounts, ByName, Words
from archord.report.errors import InputError
from archord.scene.file import load_scene

if TYPE_CHECKING:
    import pandas as pd

_UNKNOWN_MIRRORS = (
    "archord: %s: not all mirrors of the modelled part are known (docs/results.md): if one of them "
    "is across the axis, the line load is on the modelled side alone, with the force of both sides."
)
_WHOLE = ("step", "iterations", "cutbacks")  # columns of whole numbers
_NEEDED = (*_WHOLE, "seconds")


class _Report(BaseModel):
    """What is read of a run.json; other keys may hold anything."""

    status: str
    message: str
    warnings: list[str]
    versions: Words
    seconds: Amounts
    totals: Amounts
    steps: list[ByName]
    mesh: ByName = {}
    bodies: dict[str, Annotated[list[int], Field(min_length=1)]] = {}
    error_estimates: dict[str, float | None] = {}
    peak_memory: list[float] = []
    accuracy: ByName | None = None


class Run:
    """The run in a folder, as it was when this was made.

    A run that still goes on is loaded again to see more. Steps are counted from 1.

    Parameters
    ----------
    folder : str or Path
        The run folder.

    Attributes
    ----------
    folder : Path
        The run folder.
    status : str
        How the run ended: "done", "stopped" or "interrupted"; "running" if it has not, or was
        killed.
    message : str
        Why it stopped.
    steps : int
        The number of accepted steps.
    columns : dict
        The columns of history.csv by name, as plain lists.
    units : dict
        Their units by name.
    summary : dict
        What run.json holds.
    warnings : list of str
        The warnings in it.
    scene : Scene or ProblemScene
        The scene that was solved.
    view : object
        What kind of problem it was: its path, its forces, its surfaces.

    Raises
    ------
    InputError
        For a folder that is no run folder, and for a scene, report or history that cannot be read.

    Examples
    --------
    >>> import archord
    >>> joint = {"radius": 10.0, "clearance": 0.1, "relative_element_size": 0.2}
    >>> steel = {"E": 210e3, "nu": 0.3}
    >>> load = {"displacement": 0.5, "steps": 1}
    >>> scene = archord.Scene(joint=joint, pin=steel, block=steel, load=load)
    >>> run = archord.solve(scene, "runs/doctest", force=True)
    >>> run.status, run.steps
    ('done', 1)
    >>> print(f"{run.columns['P'][-1]:.0f} {run.units['P']}")
    5263 N/mm
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        if is_sweep(self.folder):
            cases = self.folder / "cases"
            raise InputError(
                self.folder, f"is a sweep, not a run; its runs are the folders in {cases}."
            )
        for name in ("scene.toml", "history.csv", "run.json"):
            if not (self.folder / name).is_file():
                raise InputError(self.folder, f"is not a run folder: {name} is missing.")
        # before the history, which a run writes first
        self.summary: ByName = self._read_report()
        require_intact(self.folder, ["scene.toml"])
        self.scene: Any = load_scene(self.folder / "scene.toml")
        self.view = view_of(self.scene)
        self.columns, self.units = self._read_history()
        self.status: str = self.summary["status"]
        self.message: str = self.summary["message"]
        self.warnings: list[str] = self.summary["warnings"]
        self.steps = len(self.columns["step"])

    @property
    def kinematics(self) -> Kinematics:
        """How displacement becomes strain: names of coordinates and of components."""
        return kinematics(self.scene.analysis.plane)

    @cached_property
    def history(self) -> pd.DataFrame:
        """history.csv: a row for each accepted step; ``history.attrs["units"]`` names the unit of
        every column."""
        from archord.postprocess.arrays.frames import frame_of

        return frame_of(self.columns, self.units).astype(dict.fromkeys(_WHOLE, int))

    @cached_property
    def curve(self) -> RunCurve:
        """P (per unit thickness), p0 and eps over delta as arrays, for laws and fits. Raises
        `InputError` without an accepted step, and of a run that is not of a joint."""
        if "P" not in self.columns:
            raise InputError(
                self.folder, "is the run of a general scene; this is for runs of a [joint]."
            )
        if self.kinematics.dimension == 3:
            raise InputError(self.folder, "is in space; this is for joints in a plane.")
        self.number(None)
        columns = {name: np.array(self.columns[name]) for name in CURVES}
        columns["P"] /= self.scene.thickness
        return RunCurve(str(self.folder), self.scene, **columns, folder=self.folder)

    def contact(self, step: int | None = None) -> ByName:
        """The contact along the integrated surfaces at ``step`` (the last), arrays by name: of a
        joint "pin" and "hole". Raises `InputError` without such a step, and where nothing may
        touch."""
        step = self.number(step)
        if not self.has_contact:
            raise InputError(self.folder, "has no contact: its scene has no interaction.")
        if not self.has_profiles:
            raise InputError(
                self.folder, "has no contact.h5: it was solved with output.contact = false."
            )
        return read_contact(self.folder, self.scene, step)

    def arc(self, step: int | None = None, side: str | None = None) -> Any:
        """One ``side`` of `contact` (the last one: the hole). Raises `InputError` without such a
        step or side."""
        arcs = self.contact(step)
        if side is not None and side not in arcs:
            sides = ", ".join(arcs)
            raise InputError(self.folder, f"has no side {side!r}; its sides are {sides}.")
        return arcs[side or list(arcs)[-1]]

    def unrolled(
        self,
        side: str,
        step: int | None = None,
        *,
        point: Sequence[float] = ORIGIN,
        direction: Sequence[float] = ALONG_Z,
    ) -> Unrolled:
        """One ``side`` of `contact` in space at ``step`` (the last), around the axis through a
        ``point`` along a ``direction``. Raises `InputError`."""
        self._require_space("unrolled contact")
        return unrolled(self.arc(step, side), Axis(point, direction))

    def line_load(
        self,
        interaction: str,
        step: int | None = None,
        *,
        point: Sequence[float] = ORIGIN,
        direction: Sequence[float] = ALONG_Z,
        along: Sequence[float] | None = None,
    ) -> LineLoad:
        """The load of an ``interaction`` in space at ``step`` (the last) on its second surface,
        along the axis through a ``point`` along a ``direction``; of pieces between the places
        ``along`` the axis, by default 40 equal ones. It is of the whole, on both sides of a mirror
        across the axis; the logger "archord" warns where mirrors are not known. Raises
        `InputError`."""
        self._require_space("line loads")
        shares = self.summary["model"]["contact_shares"]
        if interaction not in shares:
            known = ", ".join(shares) or "none"
            raise InputError(
                self.folder, f"has no interaction {interaction!r}; its interactions are {known}."
            )
        part = next(part for part in self.scene.interaction if part.name == interaction)
        met = self.contact(step)
        profiles = [met[side] for side in part.surfaces if side in met]
        signs = [
            1.0 if side == part.surfaces[-1] else -1.0 for side in part.surfaces if side in met
        ]
        whole = self.scene.analysis.symmetry * np.multiply(signs, shares[interaction])
        mirrors = self.summary["model"].get("mirrors") or ()  # runs of version 0.2 lack them
        if 2 ** len(mirrors) < self.scene.analysis.symmetry:
            logging.getLogger("archord").warning(_UNKNOWN_MIRRORS, self.folder)
        return line_load(profiles, whole, Axis(point, direction), along, mirrors)

    def _require_space(self, what: str) -> None:
        """Raise `InputError` for a run that is not in space."""
        if self.kinematics.dimension != 3:
            raise InputError(self.folder, f"has no {what}, which are for runs in space.")

    def pressure(self, step: int | None = None, side: str | None = None) -> pd.DataFrame:
        """`contact` as a table with a row for each point; of one ``side`` if given. Raises
        `InputError`."""
        from archord.postprocess.arrays.frames import contact_frame

        arcs = {side: self.arc(step, side)} if side else self.contact(step)
        return contact_frame(arcs, self.scene)

    def fields(self, step: int | None = None) -> Fields:
        """Mesh, displacement, stress and plastic strain at ``step`` (the last). Raises
        `InputError`."""
        return read_fields(self.folder, self.scene, self.number(step), self.bodies)

    @property
    def bodies(self) -> dict[str, int]:
        """What marks the cells of each body in `fields`, by name."""
        return {name: min(tags) for name, tags in self.summary.get("bodies", {}).items()} or BODIES

    @property
    def has_contact(self) -> bool:
        """Whether anything may touch."""
        return self.view.has_contact

    @property
    def has_profiles(self) -> bool:
        """Whether the run wrote the contact along the surfaces."""
        return self.has_contact and self.scene.output.contact

    @property
    def sides(self) -> list[str]:
        """All surfaces in contact, in the order of their numbers."""
        return list(self.view.sides or self.contact())

    @property
    def path(self) -> list[float]:
        """How far the load was at every step: delta of a joint, else the load factor."""
        return self.columns[self.view.path_name]

    def heading(self, name: str) -> str:
        """The name of a column with its unit."""
        return f"{name} [{self.units[name]}]" if name in self.units else name

    def points(self, step: int | None = None) -> dict[str, np.ndarray]:
        """The integration points at ``step`` (the last): see `read_points`. Raises `InputError`."""
        return read_points(self.folder, self.scene, self.number(step))

    def probe(
        self,
        edge: str = "",
        quantity: str = "",
        step: int | None = None,
        line: Sequence[float] | None = None,
    ) -> Probe:
        """A ``quantity`` along an ``edge`` (the hoop stress) or a ``line`` x0, y0, x1, y1, in space
        x0, y0, z0, x1, y1, z1 (von Mises'): see `archord.postprocess.probes.ask.probe`. Raises
        `InputError`."""
        return probe(self, edge, quantity, self.number(step), () if line is None else tuple(line))

    def number(self, step: int | None) -> int:
        """``step``, or the number of the last accepted step. Raises `InputError` if the run has no
        such step."""
        if not self.steps:
            raise InputError(self.folder, "holds no accepted step.")
        if step is None:
            return self.steps
        is_number = isinstance(step, int | float | np.number)
        if not (is_number and 1 <= step <= self.steps and step == int(step)):
            raise InputError(
                self.folder, f"has no step {step!r}; its accepted steps are 1 to {self.steps}."
            )
        return int(step)

    def _read_history(self) -> tuple[dict[str, list[float]], Words]:
        """Columns of history.csv by name, and their units."""
        path = self.folder / "history.csv"
        try:
            columns = read_history(path)
            headings = next(csv.reader([path.read_text(encoding="utf-8").partition("\n")[0]]))
            needed = [columns[name] for name in (*_NEEDED, *self.view.needed)]
            if not np.isfinite(needed).all():
                raise ValueError("numbers that are not finite")
        except (ValueError, IndexError, KeyError, OSError):
            raise InputError(path, "cannot be read as the history of a run.") from None
        if fault := fault_of_history(columns, self.summary):
            cure = f"archord solve {self.folder} --restart writes it again"
            raise InputError(path, f"{fault}; {cure}.")
        require_intact(self.folder, ["history.csv"])
        named = (heading.partition(" [") for heading in headings)
        return columns, {name: unit.removesuffix("]") for name, _, unit in named if unit}

    def _read_report(self) -> ByName:
        path = self.folder / "run.json"
        fault = ""
        try:
            report = read_report(path)
            _Report.model_validate(report, strict=True)
            return report
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            if place:
                fault = f": {place}: {first['msg'].lower()}"
        except ChangedError as error:
            fault = f": {error}"
        except (OSError, ValueError):
            pass
        raise InputError(path, f"cannot be read as the report of a run{fault}.")

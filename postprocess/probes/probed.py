"""What probes ask of a run, what they find there, and values at its nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple, Protocol

from archord.materials.kinematics import Kinematics
from archord.materials.material import Array
from archord.postprocess.arrays.fields import Fields
from archord.presets.views import ProblemView
from archord.report.errors import InputError


class Probed(Protocol):
    """What is asked of a run."""

    folder: Path
    scene: Any
    view: ProblemView
    columns: dict[str, list[float]]
    steps: int

    @property
    def kinematics(self) -> Kinematics:
        """See `Run.kinematics`."""

    def fields(self, step: int | None = None) -> Fields:
        """See `Run.fields`."""

    def arc(self, step: int | None = None, side: str | None = None) -> Any:
        """See `Run.arc`."""


class Along(NamedTuple):
    """Values along an edge or a line: the arrays of a `Probe` with the same names."""

    x: Array
    s: Array
    values: Array
    angle: Array | None = None


def nodal(run: Probed, fields: Fields, quantity: str, nodes: Any = ..., **more: Array) -> Array:
    """The quantity at ``nodes``, any shape: a nodal field, or one ``more`` that is known there."""
    known = fields.nodal_fields()
    for axis in range(fields.displacement.shape[1]):
        known[f"u{'xyz'[axis]}"] = fields.displacement[:, axis]
    known = {name: values[nodes] for name, values in known.items()} | more
    if quantity in known:
        return known[quantity]
    why = ""
    if fields.stress is None:
        why = ' (the run was solved with output.fields = "cells")'
    raise InputError(run.folder, f"has no {quantity!r} there, but {', '.join(known)}{why}.")

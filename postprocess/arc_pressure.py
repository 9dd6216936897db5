"""The contact pressure on the arcs of a run, as contact.h5 holds it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from archord.geometry.basis import Array
from archord.output.step_file import step_name
from archord.postprocess.run_curve import RunCurve
from archord.scene.errors import InputError
from archord.scene.scene import Scene

SIDES = ("pin", "hole")


@dataclass(frozen=True)
class ArcPressure:
    """One side at one step: ``q`` points on each of ``n`` facets, ordered from the contact axis; one half of the joint.

    ``pressure`` is linear on each facet, with the facet's force; ``weight`` is arc length. In the facet at the edge of
    the contact the line may dip below zero.
    """

    radius: float
    angle: Array  # (n, q) from the contact axis [rad]
    weight: Array  # (n, q)
    pressure: Array  # (n, q) positive in compression

    @property
    def resultant(self) -> float:
        """Vertical force of the whole joint, ``2 sum(weight pressure cos(angle))``, on the undeformed arc."""
        return 2 * float((self.weight * self.pressure * np.cos(self.angle)).sum())

    def facet_means(self) -> tuple[Array, Array]:
        """Angle ``(n,)`` and pressure ``(n,)`` of the facets: their means, which do not scatter where it yields."""
        total = self.weight.sum(axis=1)
        return (self.weight * self.angle).sum(axis=1) / total, (self.weight * self.pressure).sum(axis=1) / total


@dataclass(frozen=True)
class ArcContact(ArcPressure):
    """With everything else that contact.h5 holds of the side."""

    s: Array  # (n, q) arc length from the contact axis
    raw_pressure: Array  # (n, q) as the solver integrates it
    gap: Array  # (n, q) positive when open
    coordinates: Array  # (n, q, 2) deformed


def read_arcs(run: RunCurve, step: int) -> dict[str, ArcContact]:
    """The sides of ``run`` at ``step`` (from 1); a side whose arc was not integrated is absent. Raises `InputError`."""
    if run.folder is None:
        raise InputError(f"{run.name}: is not a run folder: contact.h5 is missing.")
    return read_contact(run.folder, run.scene, step, len(run.delta))


def read_contact(folder: str | Path, scene: Scene, step: int, steps: int) -> dict[str, ArcContact]:
    """The sides at ``step`` (from 1) of the run of ``scene`` in ``folder``, which has so many accepted ``steps``.

    Raises `InputError` if contact.h5 is missing, damaged or does not hold the step.
    """
    path = Path(folder) / "contact.h5"
    if not path.is_file():
        raise InputError(f"{folder}: is not a run folder: contact.h5 is missing.")
    if not 1 <= step <= steps:
        raise InputError(f"{folder}: has no step {step}; its accepted steps are 1 to {steps}.")
    geometry, at = scene.joint, step_name(step)
    radius = {"pin": geometry.radius, "hole": geometry.radius + geometry.dR}
    try:
        with h5py.File(path) as file:
            if int(file["accepted"][()]) < step:
                raise KeyError(step)
            return {
                side: ArcContact(
                    radius[side],
                    file[f"{side}/angle"][()],
                    file[f"{side}/weight"][()],
                    file[f"{side}/pressure/{at}"][()],
                    file[f"{side}/s"][()],
                    file[f"{side}/raw_pressure/{at}"][()],
                    file[f"{side}/gap/{at}"][()],
                    file[f"{side}/coordinates/{at}"][()],
                )
                for side in SIDES
                if side in file
            }
    except (OSError, KeyError, RuntimeError, TypeError, ValueError):
        raise InputError(f"{path}: cannot be read as the contact of a run.") from None


def undeformed(arc: ArcPressure, side: str, scene: Scene) -> Array:
    """Points ``(n, q, 2)`` of the ``side`` of ``scene`` before it is loaded: on its circle, in the mesh's frame.

    The hole's centre is the origin. So is the pin's in a ring; in a block it touches the hole, ``(0, -dR)``.
    """
    g = scene.joint
    centre = -g.dR if side == "pin" and g.model == "block" else 0.0
    return np.stack([arc.radius * np.sin(arc.angle), centre - arc.radius * np.cos(arc.angle)], axis=-1)

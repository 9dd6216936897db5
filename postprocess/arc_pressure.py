"""The contact pressure on the arcs of a run, as contact.h5 holds it."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.run_curve import RunCurve
from archord.solver.scene import SceneError
from archord.solver.step_file import step_name

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


def read_arcs(run: RunCurve, step: int) -> dict[str, ArcPressure]:
    """The sides of ``run`` at ``step`` (from 1); a side whose arc was not integrated is absent. Raises `SceneError`."""
    file_name = (run.folder / "contact.h5") if run.folder else None
    if file_name is None or not file_name.is_file():
        raise SceneError(f"{run.name}: is not a run folder: contact.h5 is missing.")
    n = len(run.delta)
    if not 1 <= step <= n:
        raise SceneError(f"{run.name}: has no step {step}; its accepted steps are 1 to {n}.")
    radius = {"pin": run.R, "hole": run.R + run.dR}
    try:
        with h5py.File(file_name) as file:
            return {
                side: ArcPressure(
                    radius[side],
                    file[f"{side}/angle"][()],
                    file[f"{side}/weight"][()],
                    file[f"{side}/pressure/{step_name(step)}"][()],
                )
                for side in SIDES
                if side in file
            }
    except (OSError, KeyError):
        raise SceneError(f"{file_name}: cannot be read as the contact of a run.") from None

"""Where and when an elastic joint would yield first (Hu et al., figure 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from archord.postprocess.curve import RunCurve
from archord.postprocess.fields import BODIES, read_fields

_CORNER = 85  # degrees from the contact axis beyond which the block is held


@dataclass(frozen=True)
class FirstYield:
    """The first cell to yield: delta/dR, body, depth below the contact over R, angle."""

    delta: float
    body: str
    depth: float
    angle: float  # degrees from the contact axis

    def __str__(self) -> str:
        """For a table."""
        return f"δ/ΔR = {self.delta:.3f}, in the {self.body}, {self.depth:.3f} R below the contact at {self.angle:.0f}°"


def first_yield(elastic: RunCurve, yield_stress: float, near_contact: float = 2.0) -> FirstYield:
    """From an elastic run: the cell no deeper than ``near_contact`` R whose von Mises stress reaches ``yield_stress``
    first.

    The stress is the cell's mean, interpolated linearly between the steps. The pressed diameter of the pin and the held
    corner of the block can yield before the contact does: a depth of less than R leaves them out.
    """
    assert elastic.folder is not None
    fields = [read_fields(elastic.folder, elastic.scene, k + 1) for k in range(len(elastic.delta))]
    centroid = fields[0].coordinates[fields[0].cells[:, :3]].mean(axis=1)
    stress = np.array([np.zeros(len(centroid)), *(field.von_mises for field in fields)])
    delta = np.concatenate([[0.0], elastic.delta])
    above, cell = stress >= yield_stress, np.arange(len(centroid))
    step = np.maximum(above.argmax(axis=0), 1)
    low, high = stress[step - 1, cell], stress[step, cell]
    share = (yield_stress - low) / np.maximum(high - low, 1e-300)
    when = np.where(above.any(axis=0), delta[step - 1] + share * (delta[step] - delta[step - 1]), np.inf)
    pin = fields[0].body == BODIES["pin"]
    radius = np.linalg.norm(centroid + np.where(pin[:, None], [0.0, elastic.dR], 0.0), axis=1)
    depth = np.where(pin, elastic.R - radius, radius - elastic.R - elastic.dR) / elastic.R
    angle = np.degrees(np.arctan2(centroid[:, 0], -centroid[:, 1]))
    when[(depth > near_contact) | ((angle > _CORNER) & (near_contact < 1))] = np.inf
    first = int(np.argmin(when))
    body = "pin" if pin[first] else "block"
    return FirstYield(float(when[first]) / elastic.dR, body, float(depth[first]), float(angle[first]))

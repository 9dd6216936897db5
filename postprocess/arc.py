"""The contact on the arcs of a run, as contact.h5 holds it."""

from __future__ import annotations

import h5py
import numpy as np

from archord.materials.material import Array
from archord.output.step_file import step_name
from archord.postprocess.curve import RunCurve
from archord.presets.arc import ArcProfile
from archord.presets.edge import PER_STEP
from archord.scene.errors import InputError
from archord.scene.scene import Scene


def read_arcs(run: RunCurve, step: int) -> dict[str, ArcProfile]:
    """The sides of ``run`` at ``step`` (from 1); a side whose arc was not integrated is absent.

    Raises `InputError` if contact.h5 is missing, damaged or does not hold the step.
    """
    path = run.folder / "contact.h5" if run.folder else None
    if path is None or not path.is_file():
        raise InputError(f"{run.name}: is not a complete run folder: contact.h5 is missing.")
    radius, found = {"pin": run.R, "hole": run.R + run.dR}, {}
    try:
        with h5py.File(path) as file:
            if int(file["accepted"][()]) < step:
                raise KeyError(step)
            for side in (side for side in radius if side in file):
                arrays = {name: file[f"{side}/{name}"][()] for name in ("s", "weight")}
                arrays |= {name: file[f"{side}/{name}/{step_name(step)}"][()] for name in PER_STEP}
                found[side] = ArcProfile(**arrays, radius=radius[side])
    except (OSError, KeyError, RuntimeError, TypeError, ValueError):
        raise InputError(f"{path}: cannot be read as the contact of a run.") from None
    return found


def undeformed(arc: ArcProfile, side: str, scene: Scene) -> Array:
    """Points ``(n, q, 2)`` of the ``side`` of ``scene`` before it is loaded: on its circle, in the mesh's frame.

    The hole's centre is the origin. So is the pin's in a ring; in a block it touches the hole, ``(0, -dR)``.
    """
    g = scene.joint
    centre = -g.pin_depth if side == "pin" else 0.0
    return np.stack([arc.radius * np.sin(arc.angle), centre - arc.radius * np.cos(arc.angle)], axis=-1)

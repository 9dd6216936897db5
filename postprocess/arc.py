"""The contact on the arcs of a joint, and on the surfaces of any run, as contact.h5 holds it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from archord.materials.material import Array
from archord.output.step_file import step_name
from archord.postprocess.curve import RunCurve
from archord.presets.arc import ArcProfile
from archord.presets.edge import PER_STEP, SurfaceProfile
from archord.scene.errors import InputError


@contextmanager
def opened(folder: str | Path, name: str, step: int) -> Iterator[h5py.File]:
    """The open ``name``.h5 of a run ("contact", "fields"), which holds the step. Raises `InputError` if it is missing,
    and in place of what reading it raises."""
    path = Path(folder) / f"{name}.h5"
    if not path.is_file():
        raise InputError(f"{folder}: is not a complete run folder: {path.name} is missing.")
    try:
        with h5py.File(path) as file:
            if int(file["accepted"][()]) < step:
                raise KeyError(step)
            yield file
    except (OSError, KeyError, RuntimeError, TypeError, ValueError, IndexError):
        raise InputError(f"{path}: cannot be read as the {name} of a run at step {step}.") from None


def read_arcs(run: RunCurve, step: int) -> dict[str, ArcProfile]:
    """The sides of ``run``, of a joint, at ``step`` (from 1); a side whose arc was not integrated is absent.

    Raises `InputError` as `opened`.
    """
    radius = {"pin": run.R, "hole": run.R + run.dR}
    found = _read(run.folder or Path(run.name), step, ("s", "weight"), PER_STEP)
    return {side: ArcProfile(**found[side], radius=radius[side]) for side in radius if side in found}


def read_surfaces(folder: Path, step: int) -> dict[str, SurfaceProfile]:
    """The integrated surfaces of a general run at ``step``, by name. Raises `InputError` as `opened`."""
    found = _read(folder, step, ("s", "weight", "X"), (*PER_STEP, "slip"))
    return {name: SurfaceProfile(**arrays) for name, arrays in found.items()}


def _read(folder: Path, step: int, fixed: tuple[str, ...], per_step: tuple[str, ...]) -> dict[str, dict[str, Array]]:
    names = {name: name for name in fixed} | {name: f"{name}/{step_name(step)}" for name in per_step}
    with opened(folder, "contact", step) as file:
        groups = {key: group for key, group in file.items() if isinstance(group, h5py.Group)}
        return {key: {name: group[at][()] for name, at in names.items()} for key, group in groups.items()}


def undeformed(profile: ArcProfile | SurfaceProfile, side: str, scene: Any) -> Array:
    """Points ``(n, q, 2)`` of a surface before it is loaded; of a joint's ``side`` on its circle, in the mesh's frame.

    The hole's centre is the origin. So is the pin's in a ring; in a block it touches the hole, ``(0, -dR)``.
    """
    if isinstance(profile, SurfaceProfile):
        return profile.X
    centre, angle = -scene.joint.pin_depth if side == "pin" else 0.0, profile.angle
    return np.stack([profile.radius * np.sin(angle), centre - profile.radius * np.cos(angle)], axis=-1)

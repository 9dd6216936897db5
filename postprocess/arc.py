"""The contact on the arcs of a joint, and on the surfaces of any run, as contact.h5 holds it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from archord.materials.material import Array
from archord.output.files.seal import require_intact
from archord.output.files.step_file import step_name
from archord.presets.arc import ArcProfile
from archord.presets.edge import OF_FRICTION, PER_STEP, SurfaceProfile
from archord.scene.errors import InputError
from archord.scene.scene import Scene


@contextmanager
def opened(folder: str | Path, name: str, step: int) -> Iterator[h5py.File]:
    """The open ``name``.h5 of a run ("contact", "fields"), which holds the step. Raises
    `InputError` if it is missing or was changed after the run, and in place of what reading it
    raises."""
    path = Path(folder) / f"{name}.h5"
    if not path.is_file():
        raise InputError(f"{folder}: is not a complete run folder: {path.name} is missing.")
    require_intact(
        Path(folder), [path.name, f"{name}/{step_name(0)}.h5", f"{name}/{step_name(step)}.h5"]
    )
    try:
        with h5py.File(path) as file:
            if int(file["accepted"][()]) < step:
                raise KeyError(step)
            yield file
    except (MemoryError, OSError, KeyError, RuntimeError, TypeError, ValueError, IndexError):
        raise InputError(f"{path}: cannot be read as the {name} of a run at step {step}.") from None


def read_contact(folder: str | Path, scene: Any, step: int) -> dict[str, Any]:
    """The integrated surfaces of the run of ``scene`` at ``step`` (from 1): `SurfaceProfile` by
    name, of a joint `ArcProfile` of "pin" and "hole". Raises `InputError` as `opened`."""
    joint = isinstance(scene, Scene)
    fixed, per_step = (
        ("s", "weight", *(() if joint else ("X",))),
        (*PER_STEP, *(() if joint else ("slip",))),
    )
    names = {name: name for name in fixed} | {
        name: f"{name}/{step_name(step)}" for name in per_step
    }
    with opened(folder, "contact", step) as file:
        groups = {key: group for key, group in file.items() if isinstance(group, h5py.Group)}
        if all("shear" in group for group in groups.values()):
            names |= {name: f"{name}/{step_name(step)}" for name in OF_FRICTION}
        found = {
            key: {name: group[at][()] for name, at in names.items()}
            for key, group in groups.items()
        }
    if not joint:
        return {name: SurfaceProfile(**arrays) for name, arrays in found.items()}
    radius = {"pin": scene.joint.radius, "hole": scene.joint.radius + scene.joint.dR}
    return {
        side: ArcProfile(**found[side], radius=radius[side]) for side in radius if side in found
    }


def undeformed(profile: ArcProfile | SurfaceProfile, side: str, scene: Any) -> Array:
    """Points ``(n, q, 2)`` of a surface before it is loaded; of a joint's ``side`` on its circle,
    in the mesh's frame.

    The hole's centre is the origin. So is the pin's in a ring; in a block it touches the hole,
    ``(0, -dR)``.
    """
    if isinstance(profile, SurfaceProfile):
        return profile.X
    centre, angle = -scene.joint.pin_depth if side == "pin" else 0.0, profile.angle
    return np.stack(
        [profile.radius * np.sin(angle), centre - profile.radius * np.cos(angle)], axis=-1
    )

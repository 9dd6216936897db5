"""The contact on the surfaces of a run, as contact.h5 holds it; of a joint on its arcs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from archord.materials.material import Array, Arrays
from archord.measures.edge import AnyProfile, PatchProfile, SurfaceProfile
from archord.output.files.seal import require_intact
from archord.output.files.step_file import UNREADABLE, step_name
from archord.presets.arc import ArcProfile
from archord.report.by_name import ByName
from archord.report.errors import InputError

_OF_ARCS = ("pin", "hole")


@contextmanager
def opened(folder: str | Path, name: str, step: int) -> Iterator[h5py.File]:
    """The open ``name``.h5 of a run ("contact", "fields"), which holds the step. Raises
    `InputError` if it is missing or was changed after the run, and in place of what reading it
    raises."""
    path = Path(folder) / f"{name}.h5"
    if not path.is_file():
        raise InputError(folder, f"is not a complete run folder: {path.name} is missing.")
    apart = [f"{name}/{step_name(k)}.h5" for k in (0, step)]
    require_intact(Path(folder), [path.name, *apart])
    try:
        with h5py.File(path) as file:
            if int(file["accepted"][()]) < step:
                raise KeyError(step)
            yield file
    except UNREADABLE:
        raise InputError(path, f"cannot be read as the {name} of a run at step {step}.") from None


def read_contact(folder: str | Path, scene: Any, step: int) -> ByName:
    """The integrated surfaces of the run of ``scene`` at ``step`` (from 1): `SurfaceProfile` by
    name, in space `PatchProfile`, of a joint `ArcProfile` of "pin" and "hole". Raises `InputError`
    as `opened`."""
    with opened(folder, "contact", step) as file:
        found = {
            name: _arrays_of(group, step)
            for name, group in file.items()
            if isinstance(group, h5py.Group)
        }
        if not any("angle" in arrays for arrays in found.values()):
            in_space = scene.analysis.plane == "space"
            make = PatchProfile if in_space else SurfaceProfile
            return {name: make(**arrays) for name, arrays in found.items()}
        profiles = {}
        for name in _OF_ARCS:
            if name in found:
                del found[name]["angle"]  # follows from the arc length
                clearance = scene.joint.dR if name == "hole" else 0.0
                radius = scene.joint.radius + clearance
                profiles[name] = ArcProfile(**found[name], radius=radius)
        return profiles


def _arrays_of(surface: h5py.Group, step: int) -> Arrays:
    """What contact.h5 has of a ``surface``: what does not change, and what it was at the
    ``step``."""
    return {
        name: item[()] if isinstance(item, h5py.Dataset) else item[step_name(step)][()]
        for name, item in surface.items()
    }


def undeformed(profile: ArcProfile | AnyProfile, side: str, scene: Any) -> Array:
    """Points ``(n, q, d)`` of a surface before it is loaded; of a joint's ``side`` on its circle,
    in the mesh's frame.

    The hole's centre is the origin. So is the pin's in a ring; in a block it touches the hole,
    ``(0, -dR)``.
    """
    if isinstance(profile, AnyProfile):
        return profile.X
    centre = -scene.joint.pin_depth if side == "pin" else 0.0
    x = profile.radius * np.sin(profile.angle)
    y = centre - profile.radius * np.cos(profile.angle)
    return np.stack([x, y], axis=-1)

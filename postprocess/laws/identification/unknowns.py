"""What a fit may change: keys of a scene that the law knows, and the machine around the joint."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from archord.postprocess.laws.general.general_law import CLEARANCES, NU
from archord.postprocess.laws.general.joint import LawJoint
from archord.report.by_name import Amounts, ByName, Names
from archord.report.errors import InputError
from archord.scene.file import ALTERNATIVES
from archord.scene.presets.joint import Scene

OFFSET = "offset"
COMPLIANCE = "machine compliance"
_WIDE = 20.0  # factor on the scene's value, both ways
_SOFTEST = 50.0  # compliance of a machine times E* and thickness
_TRIED = 1.01  # factor on a value, by which the law must notice it
# what a joint knows and the general law does not
_IGNORED: ByName = {
    "k": 0.85,
    "c": 1.0,
    "length": None,
    "block_size": None,
    "whole": False,
    "fixed_pairs": False,
}


@dataclass(frozen=True)
class Unknown:
    """A number that a fit seeks: ``value = start exp(z)``, or ``start + unit z`` with a ``unit``.

    ``keys`` of the scene have this one value; an unknown of the machine has none.
    """

    name: str
    keys: Names
    start: float
    low: float
    high: float
    unit: float | None = None

    def value(self, z: Any) -> Any:
        """The value at ``z``."""
        return self.start * np.exp(z) if self.unit is None else self.start + self.unit * z

    def z(self, value: float) -> float:
        """The z of a ``value``."""
        if self.unit is None:
            return math.log(value / self.start)
        return (value - self.start) / self.unit


def of_scene(scene: Scene, frees: Iterable[str]) -> list[Unknown]:
    """The unknowns of ``--free``: a key, keys with commas between that have one value, and bounds
    behind: ``KEY,KEY=LOW:HIGH``. Raises `InputError`."""
    found: list[Unknown] = []
    for free in frees:
        names, _, bounds = free.partition("=")
        keys = tuple(name.strip() for name in names.split(","))
        twice = {key for one in found for key in one.keys} & {*keys}
        if twice or len({*keys}) < len(keys):
            raise InputError(f"--free {free}: frees a key twice.")
        given = [key for one in found for key in one.keys]
        for key in keys:
            section, _, name = key.partition(".")
            others = {f"{section}.{n}" for names in _alternatives(section, name) for n in names}
            clash = [other for other in (*given, *keys) if other in others and other != key]
            if clash:
                said = f"{key} and {clash[0]} say one thing; free one of them"
                raise InputError(f"--free {free}: {said}.")
        unknown = _of_keys(scene, free, keys)
        found.append(_bounded(unknown, free, bounds) if bounds else unknown)
    return found


def _of_keys(scene: Scene, free: str, keys: Names) -> Unknown:
    starts = [_start(scene, free, key) for key in keys]
    start = starts[0]
    for key in keys:
        _require_known(scene, free, key, start)
    name = " = ".join(keys)
    last = keys[0].partition(".")[2]
    if last == "nu":
        return Unknown(name, keys, start, *NU, unit=1.0)
    if last in ("clearance", "relative_clearance"):
        radius = scene.joint.radius if last == "clearance" else 1.0
        low, high = (radius * end for end in CLEARANCES)
        return Unknown(name, keys, min(max(start, 1.01 * low), 0.99 * high), low, high)
    return Unknown(name, keys, start, start / _WIDE, start * _WIDE)


def _start(scene: Scene, free: str, key: str) -> float:
    """The value of ``key`` that the scene begins with."""
    section, _, name = key.partition(".")
    part = getattr(scene, section, None)
    if name not in getattr(type(part), "model_fields", ()):
        raise InputError(f"--free {free}: a scene has no key {key}.")
    value = scene.joint.dR if key == "joint.clearance" else getattr(part, name)
    if key == "joint.relative_clearance":
        value = scene.joint.dR / scene.joint.radius
    if value is None:
        raise InputError(f"--free {free}: the scene has no {key} to begin with; --set one.")
    if isinstance(value, bool) or not isinstance(value, float | int) or value <= 0:
        raise InputError(f"--free {free}: {key} is no positive number in the scene.")
    return float(value)


def _require_known(scene: Scene, free: str, key: str, start: float) -> None:
    """Raise `InputError` for a ``key`` that the law does not depend on."""
    try:
        seen = [_seen(changed(scene, {key: factor * start})) for factor in (1.0, _TRIED)]
    except ValueError as error:
        raise InputError(f"--free {free}: cannot change alone: {error}") from None
    if seen[0] == seen[1]:
        raise InputError(f"--free {free}: the law does not depend on {key}.")


def _seen(scene: Scene) -> tuple[LawJoint, float]:
    """What the law sees of a scene."""
    return replace(LawJoint.from_scene(scene), **_IGNORED), scene.thickness


def _bounded(unknown: Unknown, free: str, bounds: str) -> Unknown:
    try:
        low, high = map(float, bounds.split(":"))
    except ValueError:
        raise InputError(f"--free {free}: bounds must read LOW:HIGH, like 200:600.") from None
    if not 0 < low < high < math.inf:
        raise InputError(f"--free {free}: bounds must be positive, the lower one first.")
    start = unknown.start if low < unknown.start < high else math.sqrt(low * high)
    return replace(unknown, start=start, low=low, high=high)


def of_machine(
    scene: Scene, begins: float, travel: float, offset: float | None, stiffness: float | None
) -> tuple[list[Unknown], Amounts]:
    """The unknowns of the machine, and what is fixed: an ``offset`` or a ``stiffness`` that is
    given. The curve ``begins`` at about this reading, and has this ``travel``."""
    free = []
    fixed = {}
    if offset is None:
        unit = scene.joint.dR
        free.append(Unknown(OFFSET, (), begins, begins - travel, begins + travel, unit))
    else:
        fixed[OFFSET] = offset
    if stiffness is None:
        unit = 1 / (scene.E_star * scene.thickness)
        free.append(Unknown(COMPLIANCE, (), 0.0, 0.0, _SOFTEST * unit, unit))
    else:
        fixed[COMPLIANCE] = 1 / stiffness
    return free, fixed


def changed(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The ``scene`` with these values of keys, which are not checked; alternatives give way."""
    sections: dict[str, dict[str, float | None]] = {}
    for key, value in values.items():
        section, _, name = key.partition(".")
        update = sections.setdefault(section, {})
        for names in _alternatives(section, name):
            update.update(dict.fromkeys(names))
        update[name] = value
    parts = {
        section: getattr(scene, section).model_copy(update=update)
        for section, update in sections.items()
    }
    return scene.model_copy(update=parts)


def _alternatives(section: str, name: str) -> Sequence[Names]:
    return [names for names in ALTERNATIVES.get(section, ()) if name in names]

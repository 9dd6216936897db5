"""The joint that ``archord law`` is asked about: of its options, or of a scene that they change."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from archord.report.by_name import ByName, Names, Words
from archord.report.errors import InputError

if TYPE_CHECKING:
    from archord.postprocess.laws.general.joint import LawJoint
    from archord.scene.presets.joint import Scene

# What options change in a scene.
_KEYS = {
    "radius": "joint.radius",
    "clearance": "joint.clearance",
    "length": "analysis.thickness",
    "plane": "analysis.plane",
}
_OF_BODIES = ("nu", "yield_stress")


def joint_of(
    scene: Path | None, overrides: Names, given: ByName, needed: Words
) -> tuple[LawJoint, Words, float]:
    """The joint of the scene, which the options given change as ``--set`` would, or of the options
    alone; the names of the units; and the thickness. ``needed`` has the law by each parameter that
    one needs."""
    from archord.postprocess.laws.general.joint import LawJoint

    values = {name: value for name, value in given.items() if value is not None}
    if scene is not None:
        return _joint_of_scene(scene, overrides, values, needed)
    if overrides:
        raise InputError("--set: changes a scene; give one with --scene.")
    missing = [name for name in ("radius", "clearance", "E_star", *needed) if name not in values]
    if missing:
        raise InputError(_ask_for(missing, needed))
    for name, other in (("plane", "nu"), ("nu", "plane")):
        if name in values and other not in values:
            raise InputError(
                _option(name), f"says nothing without {_option(other)}; give both or none."
            )
    strength = values.pop("yield_stress", None)
    return LawJoint(**values, pin_yield=strength, block_yield=strength), {}, 1.0


@contextmanager
def of_scene(scene: Path | None) -> Iterator[None]:
    """Let what laws refuse of the joint of a ``scene`` name its file and the key."""
    try:
        yield
    except ValueError as error:
        from archord.postprocess.laws.general.joint import keys_of

        _, _, reason = str(error).partition(": ")
        keys = keys_of(reason)
        if scene is None or not keys:
            raise
        raise InputError(f"{scene}: {keys}: {error}") from None


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _ask_for(missing: list[str], needed: Words) -> str:
    """The sentence that asks for all that is ``missing`` of a joint; ``needed`` has the law by
    parameter."""
    names = ", ".join(map(_option, missing))
    by_law: dict[str, list[str]] = {}
    for name in missing:
        if name in needed:
            by_law.setdefault(needed[name], []).append(name)
    if sum(map(len, by_law.values())) == len(missing):
        said = [f"{law}: this law needs {' and '.join(own)}." for law, own in by_law.items()]
        return f"{' '.join(said)} Give {names}, or the --scene of a joint."
    why = [f"{law} needs {' and '.join(map(_option, own))}" for law, own in by_law.items()]
    said = [f"{names}: missing", *why, "give all, or the --scene of a joint"]
    return f"{'; '.join(said)}."


def _joint_of_scene(
    path: Path, overrides: Names, values: ByName, needed: Words
) -> tuple[LawJoint, Words, float]:
    """As `joint_of`, of the scene ``path``."""
    from archord.postprocess.laws.general.joint import LawJoint

    if "E_star" in values:
        said = (
            "does not go with --scene, which has E* of E and nu of its bodies; change these by "
            "--set"
        )
        raise InputError(f"--E-star {values['E_star']:g}: {said}.")
    before = law_scene(path, overrides)
    changes = {
        f"{key}={value}": name for name, value in values.items() for key in _keys(before, name)
    }
    typed = {change: f"{_option(name)} {values[name]}" for change, name in changes.items()}
    set_keys = {override.partition("=")[0].strip(): override for override in overrides}
    for change, option in typed.items():
        same = set_keys.get(change.partition("=")[0])
        if same:
            raise InputError(option, f"does not go with --set {same}; give one of them.")
    try:
        found = law_scene(path, (*overrides, *changes))
    except InputError as error:
        said = str(error)
        for change, option in typed.items():
            said = said.replace(f"--set {change}:", f"{option}:")
        raise InputError(said) from None
    thick = found.analysis.thickness
    units = found.units.model_dump() | {"force": found.units.force_of(thick)}
    units["stiffness"] = units["stress"] if thick is None else f"{units['force']}/{units['length']}"
    coefficients = {name: values[name] for name in ("k", "c") if name in values}
    joint = dataclasses.replace(LawJoint.from_scene(found), **coefficients)
    if "length" in needed and joint.length is None:
        raise InputError(f"{needed['length']}: this law needs length. Give --length.")
    return joint, units, found.thickness


def law_scene(path: Path, overrides: Names) -> Scene:
    """The scene in ``path``. The closed-form laws are of the paper's joint alone: raises
    `InputError` for a scene that has none."""
    from archord.scene.file import load_scene

    found: Any = load_scene(path, overrides)
    if not found.has_laws:
        raise InputError(path, "must be the scene of a [joint]; this is a general one.")
    return found


def _keys(scene: Scene, name: str) -> list[str]:
    """The keys of a scene that the option ``name`` changes: a yield stress in the bodies that
    yield, or in both."""
    if name in _KEYS:
        return [_KEYS[name]]
    if name not in _OF_BODIES:
        return []
    bodies = list(scene.solids)
    if name == "yield_stress":
        yielding = [body for body in bodies if scene.solids[body].yield_stress is not None]
        bodies = yielding or bodies
    return [f"{body}.{name}" for body in bodies]

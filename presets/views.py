"""What tables, pictures and exports must know of a kind of runs: of general scenes, and of a
[joint], with its one force and its arcs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from archord.scene.presets.joint import Scene

_CURVES = ("delta", "P", "p0", "eps", "peeq_max")
_PARTS = ("body", "interaction", "coupling", "support", "load")


class ProblemView:
    """The runs of a general ``scene``."""

    path_name: str = "load_factor"  # the column that tells how far the load is
    needed: tuple[str, ...] = ()  # columns that every run has, with finite numbers
    sides: tuple[str, ...] = ()  # all surfaces of contact.h5 in their order, where that is known

    def __init__(self, scene: Any) -> None:
        self.scene = scene

    @property
    def has_contact(self) -> bool:
        """Whether anything may touch."""
        return bool(self.scene.interaction)

    @property
    def forces(self) -> dict[str, str]:
        """The column of the force of every load, by the load's name."""
        return {load.name: f"{load.name} force" for load in self.scene.load}

    @property
    def pulls(self) -> dict[str, str]:
        """The `forces` that are resultants: pressures and moments are left out."""
        pulling = {
            load.name
            for load in self.scene.load
            if load.pressure is None and load.direction != "rotation"
        }
        return {name: column for name, column in self.forces.items() if name in pulling}

    def facts(self) -> Iterator[tuple[str, str]]:
        """What was solved: names, and what is said of them."""
        yield "problem", f"{plane_words(self.scene)}, {self.scene.loading}"
        for section in _PARTS:
            for part in getattr(self.scene, section):
                yield f"{section} {part.name}", given(part)


class JointView(ProblemView):
    """The runs of a ``scene`` with a [joint]."""

    path_name = "delta"
    needed = (*_CURVES, "delta/dR", "P/(E* R)", "p0/E*")
    sides = ("pin", "hole")
    has_contact = True

    @property
    def forces(self) -> dict[str, str]:
        """The column of the force on the joint."""
        return {"P": "P"}

    @property
    def pulls(self) -> dict[str, str]:
        """The same."""
        return self.forces

    def facts(self) -> Iterator[tuple[str, str]]:
        """The joint, its analysis and its bodies."""
        scene = self.scene
        g = scene.joint
        length = scene.units.length
        sizes = f"R = {g.radius:g} {length}, dR = {g.dR:g} {length}, dR/R = {g.dR / g.radius:g}"
        yield "joint", f"{g.model}, {sizes}"
        stiffness = f"E* = {scene.E_star:g} {scene.units.stress}"
        yield "", f"{plane_words(scene)}, contact {scene.analysis.kinematics}, {stiffness}"
        yield "pin", given(scene.pin)
        yield "block", given(scene.block)


def view_of(scene: Any) -> ProblemView:
    """The view of the runs of a ``scene``."""
    return JointView(scene) if isinstance(scene, Scene) else ProblemView(scene)


def plane_words(scene: Any) -> str:
    """The kinematics of a ``scene`` in words."""
    plane = scene.analysis.plane
    return plane if plane == "axisymmetric" else f"plane {plane}"


def given(part: Any) -> str:
    """The keys of a ``part`` of a scene that say something, but its name."""
    keys = part.model_dump(exclude_none=True, exclude={"name"})
    said = [f"{key} = {value}" for key, value in keys.items() if _says_something(value)]
    return ", ".join(said)


def _says_something(value: object) -> bool:
    return value is not False and value not in ("", [])

"""What tables, pictures and exports must know of the runs of a general scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

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

"""The section ``load`` of a scene: the targets that displacement or force take in turn, and the steps up to each."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from archord.scene.keys import LINE, Section, key

LOADS = ("displacement", "displacement_absolute", "force", "relative_force")
Targets = float | Annotated[list[float], Field(min_length=1, max_length=10_000)]
Steps = Annotated[int, Field(ge=1, le=10_000)]


class Load(Section):
    """The displacement of the pin, from first touch, or the force on it: a ramp to a target, or to several in turn."""

    displacement: Targets | None = key(
        "displacement delta of the pin, in clearances dR, at most R/2: the target, or a list of targets in turn",
        default=None,
        example=2.0,
    )
    displacement_absolute: Targets | None = key(
        "displacement delta of the pin, instead of displacement", "length", default=None
    )
    force: Targets | None = key(
        "force P on the whole pin per unit thickness, instead of a displacement", "force", default=None
    )
    relative_force: Targets | None = key("P/(E* R), instead of force", default=None)
    path: str | None = key(
        "CSV file with the targets, instead of a list: one column, headed by one of the four names above; each row is "
        "one step unless steps is given",
        default=None,
        min_length=1,
        pattern=LINE,
    )
    core_radius: float = key(
        "ring: radius of the core over which the force is spread, over R", default=0.1, ge=0.01, le=0.5
    )
    steps: Steps | Annotated[list[Steps], Field(min_length=1)] = key(
        "equal output steps up to each target: one number for all, or a list with one for each", default=20
    )

    @model_validator(mode="after")
    def _one_load(self) -> Load:
        given = [name for name in LOADS if getattr(self, name) is not None]
        if len(given) > 1:
            raise ValueError(f"{given[0]}|must not be given together with {given[1]}")
        if not given:
            raise ValueError(f"displacement|is missing (or {', '.join(LOADS[1:])}, path)")
        n = len(self.legs)
        if isinstance(self.steps, list) and len(self.steps) != n:
            raise ValueError(f"steps|must have one number for each of the {n} targets of {self.name}")
        if sum(self.leg_steps) > 10_000:
            raise ValueError("steps|must not add up to more than 10000 steps")
        return self

    @property
    def name(self) -> str:
        """The key that holds the load."""
        return next(name for name in LOADS if getattr(self, name) is not None)

    @property
    def legs(self) -> list[float]:
        """The targets in turn, as given."""
        value = getattr(self, self.name)
        return value if isinstance(value, list) else [value]

    @property
    def leg_steps(self) -> list[int]:
        """Output steps up to each target."""
        return self.steps if isinstance(self.steps, list) else [self.steps] * len(self.legs)

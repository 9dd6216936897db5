"""Loads and their stages in the words of a scene."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Discriminator, Field, Tag

from archord.report.by_name import Names
from archord.scene.sections.keys import Name, Section, after, given, key, require

LOADS = ("displacement", "displacement_absolute", "force", "relative_force")
MOST_STEPS = 10_000  # output steps
Steps = Annotated[int, Field(ge=1, le=MOST_STEPS)]
_Kind = Discriminator(lambda value: "list" if isinstance(value, list) else "number")
StepCounts = Annotated[
    Annotated[Steps, Tag("number")] | Annotated[list[Steps], Field(min_length=1), Tag("list")],
    _Kind,
]
Targets = Annotated[
    Annotated[float, Tag("number")] | Annotated[list[float], Field(min_length=1), Tag("list")],
    _Kind,
]


class Loading(Section):
    """A load of one of several ``kinds`` (keys): one value, or a list of values at the ends of
    stages."""

    kinds: ClassVar[Names] = ("displacement", "force")

    @after
    def _one_kind(self):
        given(self, self.kinds)
        return self

    @property
    def kind(self) -> str:
        """The key that holds the load."""
        return given(self, self.kinds)

    @property
    def stages(self) -> list[float]:
        """The values at the ends of the stages, as given."""
        value = getattr(self, self.kind)
        return value if isinstance(value, list) else [value]


def steps_of(steps: int | list[int], n: int, place: str) -> list[int]:
    """Output steps of each of ``n`` stages. Raises `Fault` if they are not that many."""
    each = steps if isinstance(steps, list) else [steps] * n
    require(len(each) == n, place, f"must have one number for each of the {n} stages")
    require(sum(each) <= MOST_STEPS, place, f"must not add up to more than {MOST_STEPS} steps")
    return each


class JointLoad(Loading):
    """The displacement of the pin, from first touch, or the force on it: a ramp to a target, or to
    several in turn."""

    kinds = (*LOADS, "path")
    displacement: Targets | None = key(
        "displacement of the pin over dR: target, or list", default=None, example=2.0
    )
    displacement_absolute: Targets | None = key(
        "displacement delta of the pin, instead", "length", other=0.1
    )
    force: Targets | None = key(
        "force P on the whole pin, instead of a displacement", "force", other=1000.0
    )
    relative_force: Targets | None = key("P/(E* R), instead of force", other=0.01)
    path: Name | None = key(
        "CSV file of targets: one column, headed by one of the names above", other="cycle.csv"
    )
    core_radius: float = key(
        "ring: radius over R of the core that the force acts on", default=0.1, ge=0.01, le=0.5
    )
    steps: StepCounts = key(
        "output steps up to each target: one number for all, or a list", default=20
    )

    @after
    def _steps(self) -> JointLoad:
        require(
            self.path is None,
            "path",
            "is for scene files alone; give the list of its targets instead",
        )
        steps_of(self.steps, len(self.stages), "steps")
        return self

    @property
    def stage_steps(self) -> list[int]:
        """Output steps up to each target."""
        return steps_of(self.steps, len(self.stages), "steps")

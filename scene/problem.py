"""A general scene, checked: a problem of bodies in contact, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from itertools import product
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from archord.scene.keys import key, require
from archord.scene.parts import Body, Coupling, Interaction, Load, Mesh, Path, ProblemAnalysis, Support
from archord.scene.scene import RANGE, SOFTEST, WEAKEST, Checked
from archord.scene.sections import MOST_STEPS, ProblemOutput, Stepping, Units

FORMAT = 2
CHOSEN = ("stepping", "initial"), ("stepping", "maximum")  # what an accuracy chooses, beside the mesh
# parts whose names must differ, as results, reactions and drives are found by them
_APART = {
    "body": (),
    "interaction": ("body", "coupling"),
    "coupling": (),
    "support": ("coupling", "load"),
    "load": (),
}
LIVE: dict[str, Any] = {}  # meshes given from Python, by what stands in the place of their file


class MeshScene(Checked):
    """A mesh alone, with the keys of its section."""

    newest: ClassVar[int] = FORMAT
    mesh: Mesh = Field(description="the mesh")


class ProblemScene(Checked):
    """Bodies on a mesh, what they touch, what holds them and what loads them.

    As `Scene`, of sections; `[[body]]` and its like are lists of tables. Raises `InputError`.
    """

    newest: ClassVar[int] = FORMAT
    format: Literal[2] = key("version of the scene format", default=FORMAT)
    units: Units = Field(default_factory=Units, description="names of the units")
    mesh: Mesh = Field(description="the mesh")
    body: list[Body] = Field(description="deformable bodies", min_length=1)
    interaction: list[Interaction] = Field(default_factory=list, description="contact and ties")
    coupling: list[Coupling] = Field(default_factory=list, description="reference points")
    support: list[Support] = Field(default_factory=list, description="what is held")
    load: list[Load] = Field(description="what moves or presses", min_length=1)
    path: Path = Field(default_factory=Path, description="stages and steps of the loads")
    analysis: ProblemAnalysis = Field(default_factory=ProblemAnalysis, description="model and solver")
    stepping: Stepping = Field(default_factory=Stepping, description="control of the steps between outputs")
    output: ProblemOutput = Field(default_factory=ProblemOutput, description="what is written")

    @model_validator(mode="after")
    def _consistent(self) -> ProblemScene:
        for section, others in _APART.items():
            for part, other in product(getattr(self, section), (section, *others)):
                alike = [p for p in getattr(self, other) if p.name == part.name and p is not part]
                said = f"must not be the name of {'another' if other == section else 'a'} {other}, too"
                require(not alike, (section, part.name, "name"), said)
        used = [name for i in self.interaction for name in i.surfaces]
        many = [name for name, count in Counter(used).items() if count > 1]
        require(not many, "interaction", f"uses the facet sets {many} more than once")
        self._directions()
        stiffest = max(body.E for body in self.body)
        for body in self.body:
            at = "body", body.name
            require(RANGE[0] <= body.E <= RANGE[1], (*at, "E"), "must be between 1e-30 and 1e30; choose other units")
            require(stiffest <= body.E / SOFTEST, (*at, "E"), f"must be at least {SOFTEST:g} of the largest E")
            strong = body.yield_stress is None or body.yield_stress >= WEAKEST * body.E
            require(strong, (*at, "yield_stress"), f"must be at least {WEAKEST:g} times E")
        for section, name in CHOSEN if self.analysis.accuracy is not None else ():
            free = name not in getattr(self, section).model_fields_set
            require(free, f"{section}.{name}", "must not be given together with analysis.accuracy, which chooses it")
        steps = self.path.steps
        n = self.n_stages
        fits = not isinstance(steps, list) or len(steps) == n
        require(fits, "path.steps", f"must have one number for each of the {n} stages")
        require(len(self.targets) <= MOST_STEPS, "path.steps", f"must not add up to more than {MOST_STEPS} steps")
        return self

    def _directions(self) -> None:
        """Raise ValueError where one direction of one place is held or loaded twice, or turns what cannot turn."""
        couplings, discs = {c.name for c in self.coupling}, {i.name for i in self.interaction if i.rigid}
        seen: dict[tuple[str, str], str] = {}
        parts = [("support", s.name, s.on, f) for s in self.support for f in s.fixed]
        parts += [("load", q.name, q.on, q.direction) for q in self.load if q.direction]
        for section, name, on, freedom in parts:
            at = (section, name, "fixed" if section == "support" else "direction")
            turns = freedom != "rotation" or on in couplings
            require(turns, at, f'must be "x" or "y": {on!r} is no coupling, which alone has a rotation')
            before = seen.get((on, freedom))
            said = f"repeats {freedom!r} of {on!r}, which {before} holds or loads already"
            require(before is None or on not in couplings | discs, at, said)
            seen[on, freedom] = f"the {section} {name!r}"
        for support in self.support:
            require(
                support.on not in discs, ("support", support.name, "on"), "must not be a rigid disc, which stands still"
            )
        for load in self.load:
            free = load.kind != "pressure" or load.on not in couplings | discs
            require(free, ("load", load.name, "on"), "must be a facet set for a pressure")

    @property
    def n_stages(self) -> int:
        """How many stages the loads have."""
        return max(len(load.stages) for load in self.load)

    @property
    def fits(self) -> bool:
        """Whether a stage comes before them in which interferences arise."""
        return any(i.interference or i.overlap for i in self.interaction)

    def values(self, load: Load) -> tuple[float, ...]:
        """Values of ``load`` at load factors 0, 1, 2, ..., the ends of all stages."""
        given = [*load.stages, *[load.stages[-1]] * (self.n_stages - len(load.stages))]
        return (0.0,) * (1 + self.fits) + tuple(given)

    @property
    def targets(self) -> list[float]:
        """The load factor at every output step; stage k ends at k."""
        steps = self.path.steps
        each = steps if isinstance(steps, list) else [steps] * self.n_stages
        counts = [self.path.fit_steps] * self.fits + each
        return [stage + k / n for stage, n in enumerate(counts) for k in range(1, n + 1)]

    @property
    def travelled(self) -> list[list[float]]:
        """Load factor and value of every load at every output step: what two scenes share as far as they agree."""
        table = [np.interp(self.targets, range(len(v)), v) for v in map(self.values, self.load)]
        return [[float(v) for v in row] for row in np.column_stack([self.targets, *table])]

    @property
    def steps_numbered(self) -> bool:
        """Whether results name steps by number: no, by the load factor."""
        return False

    @property
    def loaded_by(self) -> Any:
        """What a run must be loaded by to be continued with this scene."""
        return [(load.name, load.on, load.direction, load.kind) for load in self.load]

    @property
    def accurate(self) -> str:
        """Name of what an accuracy is asked of."""
        load = self.load[-1]  # that of its two columns which it does not prescribe
        return f"{load.name} {'force' if load.kind == 'displacement' else 'displacement'}"

    @property
    def loading(self) -> str:
        """The loads in words."""
        return "load " + ", ".join(f'"{load.name}"' for load in self.load)

    @property
    def loads_said(self) -> str:
        """Values and steps in words."""
        return f"{[load.stages for load in self.load]} and {self.path.steps}"

    @property
    def thickness(self) -> float:
        """Thickness, 1 if forces are per unit thickness."""
        return self.analysis.thickness or 1.0

    @property
    def force_unit(self) -> str:
        """Unit of forces."""
        return self.units.force_of(self.analysis.thickness)

    @property
    def plastic(self) -> bool:
        """Whether any body can yield."""
        return any(body.yield_stress is not None for body in self.body)


def is_problem(data: Mapping[str, Any]) -> bool:
    """Whether ``data`` is meant as a general scene."""
    return "joint" not in data and not {"mesh", "body", "interaction"}.isdisjoint(data)

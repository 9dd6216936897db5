"""A general scene, checked: a problem of bodies in contact, in words."""

from __future__ import annotations

from itertools import product
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field

from archord.report.by_name import Names, Words
from archord.report.units import scale_lacks
from archord.scene.columns import require_different
from archord.scene.parts import (
    IN_PLANE,
    IN_SPACE,
    BodySection,
    CouplingSection,
    InteractionSection,
    LoadSection,
    MeshSection,
    PathSection,
    SupportSection,
    turns,
)
from archord.scene.presets.joint import STEPS
from archord.scene.presets.way_back import doubts_of_way_back
from archord.scene.sections.analysis import ProblemAnalysis, ProblemOutput, Stepping
from archord.scene.sections.bodies import require_solids
from archord.scene.sections.checked import Checked
from archord.scene.sections.keys import after, key, require, unused
from archord.scene.sections.loading import steps_of
from archord.scene.sections.units import Units

FORMAT = 2
_SECONDS = 0.5  # of an output step: a guess, as the mesh is not known yet
_RIGHT_ANGLE = 1.5708
_TURNS_LINEARLY = (
    "must be at most 1.5708, a right angle in radians: a coupling turns linearly, but at large "
    "strain a rigid one whose rotations are all prescribed, which may turn by 6.2832"
)
# parts whose names must differ, as results, reactions and drives are found by them
_APART = {
    "body": (),
    "interaction": ("body", "coupling"),
    "coupling": (),
    "support": ("coupling", "load"),
    "load": (),
}


class MeshScene(Checked):
    """A mesh alone, with the keys of its section."""

    format: Literal[2] = 2
    mesh: MeshSection = Field(description="the mesh")


class ProblemScene(Checked):
    """Bodies on a mesh, what they touch, what holds them and what loads them.

    Sections are given as tables or as their classes, as in `Scene`. docs/scene.md has the keys of
    each section.

    Parameters
    ----------
    units : dict
        Names of the units.
    mesh : dict
        The mesh.
    body : list of dict
        The deformable bodies.
    interaction : list of dict
        Contact and ties.
    coupling : list of dict
        Reference points.
    support : list of dict
        What is held.
    load : list of dict
        What moves or presses.
    path : dict
        Stages and steps of the loads.
    analysis : dict
        Model and solver.
    stepping : dict
        The control of the steps between outputs.
    output : dict
        What is written.
    format : int
        The version of the scene format, by default the newest.

    Raises
    ------
    InputError
        One sentence for each fault.

    Examples
    --------
    >>> import archord
    >>> scene = archord.ProblemScene(
    ...     mesh={"file": "lug.msh"},
    ...     body=[{"name": "lug", "E": 210e3, "nu": 0.3}],
    ...     support=[{"name": "clamp", "on": "left", "fixed": ["x", "y"]}],
    ...     load=[{"name": "pull", "on": "right", "direction": "x", "displacement": [0.3, 0.0]}],
    ... )
    >>> scene.n_stages
    2
    """

    chosen: ClassVar[Names] = STEPS
    format: Literal[2] = key("version of the scene format", default=FORMAT)
    units: Units = Field(default_factory=Units, description="names of the units")
    mesh: MeshSection = Field(description="the mesh")
    body: list[BodySection] = Field(description="deformable bodies", min_length=1)
    interaction: list[InteractionSection] = Field(
        default_factory=list, description="contact and ties"
    )
    coupling: list[CouplingSection] = Field(default_factory=list, description="reference points")
    support: list[SupportSection] = Field(default_factory=list, description="what is held")
    load: list[LoadSection] = Field(description="what moves or presses", min_length=1)
    path: PathSection = Field(
        default_factory=PathSection, description="stages and steps of the loads"
    )
    analysis: ProblemAnalysis = Field(
        default_factory=ProblemAnalysis, description="model and solver"
    )
    stepping: Stepping = Field(
        default_factory=Stepping, description="control of the steps between outputs"
    )
    output: ProblemOutput = Field(default_factory=ProblemOutput, description="what is written")

    def _turns_finitely(self, coupling: str) -> bool:
        """Whether the rotations of a ``coupling`` are finite: at large strain, if all of them are
        prescribed."""
        rigid = [part.name for part in self.coupling if part.kind == "rigid"]
        moved = [load for load in self.load if load.displacement is not None]
        prescribed = {load.direction for load in moved if load.on == coupling}
        prescribed.update(*(part.fixed for part in self.support if part.on == coupling))
        is_large = self.analysis.strain == "large"
        freedoms = IN_SPACE if self.in_space else IN_PLANE
        return is_large and coupling in rigid and prescribed.issuperset(filter(turns, freedoms))

    @after
    def _consistent(self) -> ProblemScene:
        for section, others in _APART.items():
            for part, other in product(getattr(self, section), (section, *others)):
                alike = [p for p in getattr(self, other) if p.name == part.name and p is not part]
                said = (
                    f"must not be the name of {'another' if other == section else 'a'} {other}, too"
                )
                require(not alike, (section, part.name, "name"), said)
        used: Words = {}
        for part, name in [(i, name) for i in self.interaction for name in i.surfaces]:
            place = ("interaction", part.name, "surfaces")
            other = used.setdefault(name, part.name)
            said = (
                f"must not name {name!r}, which {other!r} has already; give its facets a second "
                "name in mesh.sets if they meet another body here"
            )
            require(other == part.name, place, said)
        drawn = self.analysis.plane != "axisymmetric" or self.mesh.shape is None
        said = 'must be "strain" or "stress" for the shape of a preset, which is plane'
        require(drawn, "analysis.plane", said)
        if self.in_space:
            object.__setattr__(self.analysis, "plane", "space")
        for load in self.load:
            near = load.largest_turn <= _RIGHT_ANGLE or self._turns_finitely(load.on)
            require(near, ("load", load.name, "displacement"), _TURNS_LINEARLY)
        lacking = scale_lacks(self.mesh.file or "", self.mesh.scale, self.units.length)
        require(not lacking, "mesh.scale", lacking)
        self._require_dimension()
        self._directions()
        require_different(self)
        require_solids({("body", name): body for name, body in self.solids.items()})
        self.require_open()
        steps_of(self.path.steps, self.n_stages, "path.steps")
        return self

    @property
    def in_space(self) -> bool:
        """Whether bodies are in space: as the scene says, or as its directions and points are."""
        if "plane" in self.analysis.model_fields_set:
            return self.analysis.plane == "space"
        used = {freedom for *_, freedom in self._directed}
        return not used <= {*IN_PLANE} or any(len(point) == 3 for _, point in self._points)

    @property
    def _directed(self) -> list[tuple[str, str, str, str]]:
        """Sections, names, places and directions of what is held or loaded in a direction."""
        found: list[tuple[str, str, str, str]] = []
        found += [("support", s.name, s.on, freedom) for s in self.support for freedom in s.fixed]
        found += [("load", q.name, q.on, q.direction) for q in self.load if q.direction]
        return found

    @property
    def _points(self) -> list[tuple[Names, list[float]]]:
        """Keys and values of points."""
        points: list[tuple[Names, list[float]]] = []
        points += [(("coupling", c.name, "point"), c.point) for c in self.coupling]
        for part in self.interaction:
            if part.rigid is not None:
                points.append((("interaction", part.name, "rigid", "centre"), part.rigid.centre))
        for load in self.load:
            if load.core:
                points.append((("load", load.name, "core", "centre"), load.core.centre))
        return points

    def _require_dimension(self) -> None:
        """Raise `Fault` for a point of another dimension, and for what only a plane has."""
        count = 3 if self.in_space else 2
        for place, point in self._points:
            said = f"must have {count} numbers {self._where}"
            require(len(point) == count, place, said)
        if self.in_space:
            said = "is for planes: bodies in space are drawn whole"
            require(self.analysis.thickness is None, "analysis.thickness", said)
        for part in self.interaction:
            is_plane = part.rigid is None or part.rigid.axis is None
            place = ("interaction", part.name, "rigid", "axis")
            require(self.in_space or is_plane, place, "is for cylinders in space")

    @property
    def _where(self) -> str:
        return "in space" if self.in_space else "in a plane"

    def _directions(self) -> None:
        """Raise `Fault` where a direction is of another dimension, one direction of one place is
        held or loaded twice, or what cannot turn turns."""
        allowed = IN_SPACE if self.in_space else IN_PLANE
        couplings = {c.name for c in self.coupling}
        discs = {i.name for i in self.interaction if i.rigid}
        seen: dict[tuple[str, str], str] = {}
        for section, name, on, freedom in self._directed:
            at = (section, name, "fixed" if section == "support" else "direction")
            said = f"must be among {', '.join(allowed)} {self._where}"
            require(freedom in allowed, at, said)
            fits = not turns(freedom) or on in couplings
            axes = '"x", "y" or "z"' if self.in_space else '"x" or "y"'
            said = f"must be {axes}: {on!r} is no coupling, which alone has a rotation"
            require(fits, at, said)
            before = seen.get((on, freedom))
            said = f"repeats {freedom!r} of {on!r}, which {before} holds or loads already"
            require(before is None or on not in couplings | discs, at, said)
            seen[on, freedom] = f"the {section} {name!r}"
            require(
                section == "load" or on not in discs,
                (section, name, "on"),
                "must not be a rigid disc",
            )
        for load in (load for load in self.load if load.kind == "pressure"):
            place = ("load", load.name, "on")
            axes = "xyz" if self.in_space else "xy"
            held = {(load.on, axis) for axis in axes} <= seen.keys()
            said = f"must not be held in {' and '.join(axes)}: a pressure moves nothing there"
            require(load.on not in couplings | discs, place, "must be a facet set for a pressure")
            require(not held, place, said)

    @property
    def doubts(self) -> list[str]:
        """What to warn of before anything is solved."""
        found = super().doubts
        if not self.fits:
            found += unused(self.path, "path", "fit_steps", "an overlap or an interference")
        return [*found, *doubts_of_way_back(self.mesh.shape, self.load)]

    @property
    def expected_seconds(self) -> float:
        """About how long a solve will take on one rank of a machine of 2020."""
        return _SECONDS * len(self.targets)

    @property
    def n_stages(self) -> int:
        """How many stages the loads have."""
        return max(len(load.stages) for load in self.load)

    @property
    def fits(self) -> bool:
        """Whether a stage comes before them in which interferences arise."""
        return any(i.interference or i.overlap for i in self.interaction)

    def values(self, load: LoadSection) -> tuple[float, ...]:
        """Values of ``load`` at load factors 0, 1, 2, ..., the ends of all stages."""
        begins = 2 if self.fits else 1
        kept = self.n_stages - len(load.stages)
        return (*[0.0] * begins, *load.stages, *[load.stages[-1]] * kept)

    @property
    def targets(self) -> list[float]:
        """The load factor at every output step; stage k ends at k."""
        counts = steps_of(self.path.steps, self.n_stages, "path.steps")
        if self.fits:
            counts = [self.path.fit_steps, *counts]
        return [stage + k / n for stage, n in enumerate(counts) for k in range(1, n + 1)]

    @property
    def travelled(self) -> list[list[float]]:
        """Load factor and value of every load at every output step: what two scenes share as far as
        they agree."""
        table = [np.interp(self.targets, range(len(v)), v) for v in map(self.values, self.load)]
        return [[float(v) for v in row] for row in np.column_stack([self.targets, *table])]

    @property
    def has_friction(self) -> bool:
        """Whether there is friction in a contact."""
        return any(part.has_friction for part in self.interaction)

    @property
    def accurate(self) -> str:
        """Name of what an accuracy is asked of."""
        load = self.load[-1]
        not_prescribed = "force" if load.kind == "displacement" else "displacement"
        return f"{load.name} {not_prescribed}"

    @property
    def loading(self) -> str:
        """What a run must be loaded by to be continued with this scene, in words."""
        return " and ".join(
            f'load "{q.name}" ({q.kind} {q.direction or "normal"} on {q.on})' for q in self.load
        )

    @property
    def solids(self) -> dict[str, BodySection]:
        """The bodies by name."""
        return {body.name: body for body in self.body}

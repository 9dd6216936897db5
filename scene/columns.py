"""The columns of history.csv that parts of a general scene make, and names that do not go
together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from archord.scene.parts import (
    IN_PLANE,
    IN_SPACE,
    BodySection,
    CouplingSection,
    InteractionSection,
    LoadSection,
    SupportSection,
)
from archord.scene.sections.analysis import ProblemAnalysis
from archord.scene.sections.keys import require
from archord.scene.sections.units import Units

Column = tuple[str, str, str, str]  # section and name of a part, what follows the name, unit


class Parts(Protocol):
    """What a general scene tells of its columns."""

    units: Units
    analysis: ProblemAnalysis
    body: list[BodySection]
    interaction: list[InteractionSection]
    coupling: list[CouplingSection]
    support: list[SupportSection]
    load: list[LoadSection]

    @property
    def in_space(self) -> bool:
        """Whether bodies are in space."""


def part_columns(scene: Parts) -> Iterator[Column]:
    """The columns of loads, supports, couplings, interactions, their laws and bodies of ``scene``,
    in order."""
    units = scene.units
    length = units.length
    plane = scene.analysis.plane
    depth = scene.analysis.depth
    force = units.force_of(depth)
    moment = units.energy_of(depth)
    volume = f"{length}{3 if depth else 2}"  # displaced; per unit thickness an area
    axes = {"axisymmetric": "rz", "space": "xyz"}.get(plane, "xy")
    for load in scene.load:
        turns = (load.direction or "").startswith("rotation")
        along, by = ("rad", moment) if turns else (length, force)
        if load.kind == "pressure":
            along = volume
            by = units.stress
        yield "load", load.name, "displacement", along
        yield "load", load.name, "force", by
    couplings = {coupling.name for coupling in scene.coupling}
    turned = {"moment": moment}
    if plane == "axisymmetric":
        turned = {}  # a ring has none
    elif plane == "space":
        turned = {f"moment {axis}": moment for axis in axes}
    for name in supporting(scene):
        section = "coupling" if name in couplings else "support"
        for what, unit in (dict.fromkeys(axes, force) | turned).items():
            yield section, name, what, unit
    moved = {f"displacement {axis}": length for axis in axes}
    moved |= {f"rotation {axis}": "rad" for axis in axes}
    for coupling in scene.coupling:
        if plane == "space" and coupling.kind == "distributing":
            for what, unit in moved.items():
                yield "coupling", coupling.name, what, unit
    places = [f"at {axis}" for axis in axes]
    touching = {"contact length": length, "largest slip": length, "arcs": ""}
    if plane == "axisymmetric":
        touching = {"contact area": f"{length}2", "largest slip": length, "arcs": ""}
    elif plane == "space":
        touching = {"contact area": f"{length}2", "contact fraction": "", "largest slip": length}
    for interaction in scene.interaction:
        measured = {f"force {axis}": force for axis in axes}
        measured |= turned if plane == "space" else {}
        measured |= {"largest pressure": units.stress} | dict.fromkeys(places, length)
        measured |= touching
        if interaction.has_friction:
            measured |= turned | {"largest shear": units.stress}
        for what, unit in measured.items():
            yield "interaction", interaction.name, what, unit
        for what, unit in interaction.quantities.items():
            yield "law", interaction.name, what, unit
    for body in scene.body:
        if body.plastic:
            for what, unit in ({"peeq_max": ""} | dict.fromkeys(places, length)).items():
                yield "body", body.name, what, unit


def supporting(scene: Parts) -> list[str]:
    """Names of what has a reaction: supports of sets, and rigid couplings."""
    couplings = {coupling.name for coupling in scene.coupling}
    supports = [support.name for support in scene.support if support.on not in couplings]
    return [*supports, *(coupling.name for coupling in scene.coupling if coupling.kind == "rigid")]


def require_different(scene: Parts) -> None:
    """Raise `Fault` where two parts of ``scene`` make one column, or a name is the name of a
    coupling's motion."""
    first: dict[str, tuple[str, str]] = {}
    for section, part, what, _ in part_columns(scene):
        column = f"{part} {what}"
        other = first.setdefault(column, (section, part))
        said = (
            f"makes the column {column!r} of history.csv, as the {other[0]} {other[1]!r} does: "
            "rename one of them"
        )
        key = ("own", "quantities") if section == "law" else ("name",)
        place = "interaction" if section == "law" else section
        require(other == (section, part), (place, part, *key), said)
    motions = {
        f"{c.name} {freedom}": c.name for c in scene.coupling for freedom in _motions(scene, c)
    }
    given = {coupling.name: "coupling" for coupling in scene.coupling}
    given |= {
        support.name: "support" for support in scene.support if support.name in supporting(scene)
    }
    given |= {load.name: "load" for load in scene.load}
    for name, section in given.items():
        said = (
            f"is what results call a motion of the coupling {motions.get(name)!r}: rename one of "
            "them"
        )
        require(name not in motions, (section, name, "name"), said)


def _motions(scene: Parts, coupling: CouplingSection) -> list[str]:
    """Freedoms of the ``coupling`` that are solved for by a name made of its own.

    They are free ones of a rigid coupling, held ones of a distributing one; a load gives its name
    instead.
    """
    freedoms = IN_SPACE if scene.in_space else IN_PLANE
    loaded = {load.direction for load in scene.load if load.on == coupling.name}
    held = {
        freedom
        for support in scene.support
        if support.on == coupling.name
        for freedom in support.fixed
    }
    solved = held if coupling.kind == "distributing" else {*freedoms} - held
    return sorted(solved - loaded)

"""What commands, tables, pictures and exports must know of a kind of runs: of general scenes, and
of a [joint], with its one force and its arcs."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from archord.measures.record import Record
from archord.presets.mesh_family import MeshFamily, ProblemFamily
from archord.report.by_name import Amounts, Names, Words
from archord.scene.presets.joint import Scene

_CURVES = ("delta", "P", "p0", "eps", "peeq_max")
_PARTS = ("body", "interaction", "coupling", "support", "load")
_LOADS_SHOWN = 3


class Printed(NamedTuple):
    """A column of the steps that a solve prints: its heading, the format of its numbers, which
    begins with the width, and the number of a step."""

    heading: str
    form: str
    value: Callable[[Record], float]

    @property
    def width(self) -> int:
        """The width of the column."""
        return int(self.form.partition(".")[0])


class ProblemView:
    """The runs of a general ``scene``."""

    path_name: str = "load_factor"  # the column that tells how far the load is
    needed: Names = ()  # columns that every run has, with finite numbers
    sides: Names = ()  # all surfaces of contact.h5 in their order, where that is known

    def __init__(self, scene: Any) -> None:
        self.scene = scene

    @property
    def has_contact(self) -> bool:
        """Whether anything may touch."""
        return bool(self.scene.interaction)

    @property
    def forces(self) -> Words:
        """The column of the force of every load, by the load's name."""
        return {load.name: f"{load.name} force" for load in self.scene.load}

    @property
    def pulls(self) -> Words:
        """The `forces` that are resultants: pressures and moments are left out."""
        pulling = {
            load.name
            for load in self.scene.load
            if load.pressure is None and not str(load.direction).startswith("rotation")
        }
        return {name: column for name, column in self.forces.items() if name in pulling}

    @property
    def arc_centre(self) -> tuple[float, float] | None:
        """The centre about which angles of contact count; None where contact is not on one arc."""
        return None

    @property
    def work_columns(self) -> list[tuple[str, str]]:
        """The columns of force and displacement that do the work of the loads."""
        return [(f"{load.name} force", f"{load.name} displacement") for load in self.scene.load]

    @property
    def title(self) -> str:
        """What is solved, in words."""
        count = len(self.scene.body)
        bodies = "1 body" if count == 1 else f"{count} bodies"
        return f"{bodies}, {self.kind}, {plane_words(self.scene)}"

    @property
    def kind(self) -> str:
        """Whether bodies can yield, in words."""
        return "elastic-plastic" if self.scene.plastic else "elastic"

    @property
    def printed(self) -> list[Printed]:
        """The columns of the steps that a solve prints: displacement and force of the first loads,
        and the largest PEEQ of all bodies."""
        shown = self.scene.load[:_LOADS_SHOWN]
        names = [f"{load.name} {what}" for load in shown for what in ("displacement", "force")]
        return [
            Printed("load factor", "11.5g", lambda m: m.at),
            *map(_plain_column, names),
            Printed("PEEQ max", "9.2e", _largest_peeq),
        ]

    @property
    def size_heading(self) -> str:
        """What heads the element sizes of meshes that are solved to an accuracy."""
        return "size/file" if self.scene.mesh.shape is None else "elements/R"

    @property
    def last_value(self) -> tuple[str, float]:
        """What tells how accurate a mesh is: its heading, and the unit that its values are in."""
        return "last value", 1.0

    def mesh_family(self, accuracy: float) -> MeshFamily | ProblemFamily:
        """The meshes that are solved to the ``accuracy``."""
        return ProblemFamily(self.scene)

    def quantities(self, last: Record) -> Amounts:
        """What benchmarks compare at the step ``last``: all columns."""
        return last.values

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
    def forces(self) -> Words:
        """The column of the force on the joint."""
        return {"P": "P"}

    @property
    def pulls(self) -> Words:
        """The same."""
        return self.forces

    @property
    def arc_centre(self) -> tuple[float, float]:
        """The centre of the pin, which touches the hole at first."""
        return 0.0, -self.scene.joint.dR

    @property
    def work_columns(self) -> list[tuple[str, str]]:
        """The columns of P and delta."""
        return [("P", "delta")]

    @property
    def title(self) -> str:
        """The joint in words."""
        joint = self.scene.joint
        ratio = joint.dR / joint.radius
        return f"{self.kind} joint, {plane_words(self.scene)}, dR/R = {ratio:g}"

    @property
    def printed(self) -> list[Printed]:
        """Load, displacement, contact and the largest PEEQ, all without units."""
        dR = self.scene.joint.dR
        unit = self._force_unit
        E_star = self.scene.E_star
        return [
            Printed("delta/dR", "9.5g", lambda m: m["delta"] / dR),
            # no minus before a zero
            Printed("P/(E* R)", "11.7f", lambda m: round(m["P"] / unit, 7) + 0.0),
            Printed("eps/deg", "8.3f", lambda m: math.degrees(m["eps"])),
            Printed("p0/E*", "9.6f", lambda m: m["p0"] / E_star),
            Printed("PEEQ max", "9.2e", lambda m: m["peeq_max"]),
            Printed("at contact", "10.2e", _peeq_at_contact),
        ]

    @property
    def _force_unit(self) -> float:
        """E* R times the thickness."""
        return self.scene.E_star * self.scene.joint.radius * self.scene.thickness

    @property
    def size_heading(self) -> str:
        """Element sizes are over the radius of the pin."""
        return "elements/R"

    @property
    def last_value(self) -> tuple[str, float]:
        """P, or delta under a force, without units."""
        if self.scene.force_controlled:
            return "delta/dR", self.scene.joint.dR
        return "P/(E* R)", self._force_unit

    def mesh_family(self, accuracy: float) -> MeshFamily:
        """The meshes that are solved to the ``accuracy``, half of which is for the steps where
        bodies yield."""
        return MeshFamily(self.scene, accuracy / 2 if self.scene.plastic else accuracy)

    def quantities(self, last: Record) -> Amounts:
        """What benchmarks compare at the step ``last``, without units."""
        E_star = self.scene.E_star
        R = self.scene.joint.radius
        P = last["P"] / self.scene.thickness
        p0 = last["p0"]
        return {
            "P/(E* R)": P / (E_star * R),
            "p0/E*": p0 / E_star,
            "eps": last["eps"],
            "delta/dR": last["delta"] / self.scene.joint.dR,
            "p0/P": p0 * R / P if P else 0.0,
        }

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


def _plain_column(name: str) -> Printed:
    return Printed(name, f"{max(14, len(name))}.6g", lambda m: m[name])


def _largest_peeq(m: Record) -> float:
    found = (value for name, value in m.values.items() if name.endswith("peeq_max"))
    return max(found, default=0.0)


def _peeq_at_contact(m: Record) -> float:
    return m.values.get("contact peeq_max", m["peeq_max"])


def plane_words(scene: Any) -> str:
    """The kinematics of a ``scene`` in words."""
    plane = scene.analysis.plane
    return plane if plane in ("axisymmetric", "space") else f"plane {plane}"


def given(part: Any) -> str:
    """The keys of a ``part`` of a scene that say something, but its name."""
    own = getattr(part, "own", None)
    hidden = {"name", "own"}
    if own is not None:  # it takes the place of these keys
        hidden |= {"law", "friction", "hardening"}
    if getattr(part, "friction", 0.0) and getattr(part, "law", "") == "frictionless":
        hidden.add("law")  # the name of the law without its friction
    keys = part.model_dump(exclude_none=True, exclude=hidden)
    said = [f"{key} = {value}" for key, value in keys.items() if _says_something(value)]
    if own is not None:
        said.append(own.text)
    return ", ".join(said)


def _says_something(value: object) -> bool:
    return value is not False and value not in ("", [])

"""The paper's joint as a scene: a pin joint and its loading, in any consistent set of units."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, ClassVar, Literal

from pydantic import Field

from archord.materials.elasticity import contact_modulus
from archord.materials.thickening import block_thickens, error_of_small_strain
from archord.report.by_name import ByName, Names
from archord.report.errors import InputError
from archord.scene.presets.joint_geometry import JointGeometry
from archord.scene.presets.preset import general_scene, require_solid
from archord.scene.presets.space import COARSE, Space, held
from archord.scene.sections.analysis import Analysis, Output, Stepping
from archord.scene.sections.bodies import Pin, Solid, require_solids
from archord.scene.sections.checked import Checked
from archord.scene.sections.keys import after, key, require, unused
from archord.scene.sections.loading import JointLoad
from archord.scene.sections.units import Units

# version of the scene format: rises when a scene gets a meaning that an older archord would get
# wrong
FORMAT = 1
STEPS = (
    "stepping.initial",
    "stepping.maximum",
)  # what an accuracy chooses of any scene, and of a joint
CHOSEN = ("joint.element_size", "joint.relative_element_size", "joint.growth", *STEPS)
_DOFS_PER_CELL = {2: 4.3, 3: 9.5}
_SECONDS = {False: 1.7e-5, True: 2.8e-5}  # per dof of an elastic and of a plastic output step
_LINEAR = 3e4  # dofs up to which a step costs in proportion to them
_FAR = 0.1  # displacement over R beyond which small strain may be qualitatively wrong
_STIFFEST = 1.6  # P over E* delta of no joint in a block: 1.53 where the clearance vanishes
_STIFFEST_STUCK = (
    3.5  # the same with friction: 2.2 with a coefficient of 1, 3.15 where nothing slides
)


class Scene(Checked):
    """A pin joint and how to load it.

    Sections are given as tables or as their classes. Numbers and lists may be numpy's; None means
    absent. docs/scene.md has the keys of each section.

    Parameters
    ----------
    units : dict
        Names of the units.
    joint : dict
        Geometry and mesh.
    pin, block : dict
        The materials.
    analysis : dict
        Model and solver.
    load : dict
        The loading.
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
    >>> steel = {"E": 210e3, "nu": 0.3}
    >>> joint = {"radius": 10.0, "clearance": 0.05}
    >>> scene = archord.Scene(joint=joint, pin=steel, block=steel, load={"displacement": 2.0})
    >>> print(f"{scene.E_star:.0f}")
    115385
    >>> try:
    ...     archord.Scene(joint=joint, pin=steel, block={"E": -1.0, "nu": 0.3}, load={"force": 1e3})
    ... except archord.InputError as error:
    ...     print(error)
    scene: block.E = -1.0 must be greater than 0.
    """

    chosen: ClassVar[Names] = CHOSEN
    has_laws: ClassVar[bool] = True
    format: Literal[1] = key(
        "version of the scene format; a scene of a newer version is refused", default=FORMAT
    )
    units: Units = Field(default_factory=Units, description="names of the units")
    joint: JointGeometry = Field(description="geometry and mesh")
    pin: Pin = Field(description="material of the pin")
    block: Solid = Field(description="material of the block")
    space: Space | None = Field(None, description="the joint in space instead of a plane")
    analysis: Analysis = Field(default_factory=Analysis, description="model and solver")
    load: JointLoad = Field(description="loading")
    stepping: Stepping = Field(
        default_factory=Stepping, description="control of the steps between outputs"
    )
    output: Output = Field(default_factory=Output, description="what is written")

    @after
    def _consistent(self) -> Scene:
        joint = self.joint
        pin = self.pin
        load = f"load.{self.load.kind}"
        self.require_open()
        if self.space is not None:
            require(not joint.is_ring, "joint.model", 'must be "block" in space')
            require_solid(self, True, joint.radius)
        require_solids({(name,): body for name, body in self.solids.items()})
        said = 'must be "block" or "both": a rigid pin has no contact edge to integrate'
        require(not pin.rigid or self.analysis.integration != "pin", "analysis.integration", said)
        if joint.is_ring:
            said = 'does not load a joint whose model is "ring"; give force or relative_force'
            require(self.force_controlled, load, said)
            require(not pin.rigid, "pin.rigid", 'must be false where joint.model is "ring"')
            require(
                not pin.whole,
                "pin.whole",
                'is for joint.model = "block": the pin of a ring is whole anyway',
            )
        scale, what = (
            (self.E_star * self.thickness, "E* R") if self.force_controlled else (1.0, "the radius")
        )
        most = 0.5 * scale * joint.radius
        unit = " clearances" if self.load.kind == "displacement" else ""
        said = f"must not exceed {most / self.load_unit:g}{unit}, half {what}"
        require(max(map(abs, self.targets)) <= most, load, said)
        return self

    def require_mesh(self) -> None:
        """Raise `InputError` if the scene leaves its mesh to `archord.studies.accuracy`."""
        if self.analysis.accuracy is not None:
            raise InputError(
                f"analysis.accuracy = {self.analysis.accuracy:g}: leaves the mesh open; drop it "
                "here."
            )

    def general(self) -> ByName:
        """The general scene that it stands for; its pin is pressed along -y."""
        g = self.joint
        pin = self.pin
        load = self.load
        contact: ByName = {
            "name": "contact",
            "surfaces": ["pin", "hole"],
            "overlap": max(-g.dR, 0.0),
        }
        if pin.rigid:
            contact |= {"surfaces": ["hole"], "rigid": {"centre": [0.0, -g.dR], "radius": g.radius}}
        elif self.analysis.integration != "both":
            contact["integrated"] = "pin" if self.analysis.integration == "pin" else "hole"
        on = "pin" if g.is_ring else "pin top"
        if pin.rigid:
            on = "contact"
        press: ByName = {"name": "press", "on": on, "direction": "y"}
        press["force" if self.force_controlled else "displacement"] = [
            -at * self.load_unit for at in load.stages
        ]
        if g.is_ring:
            press["core"] = {"centre": [0.0, 0.0], "radius": load.core_radius * g.radius}
        shape = g.model_dump(exclude_none=True) | {"kind": "joint", "core_radius": load.core_radius}
        if self.space is not None and not {"element_size", "relative_element_size"} & shape.keys():
            shape["relative_element_size"] = COARSE
        parts = {
            "interaction": [contact],
            "support": [held("axis", "x", on="symmetry"), held("block", "x", "y", on="block held")],
            "load": [press],
            "path": {"steps": load.stage_steps},
        }
        middles = ["block held"] if pin.rigid else ["pin top", "block held"]
        return general_scene(self, shape, 2, {"block": self.block}, middles, **parts)

    def resolved_data(self) -> ByName:
        """The table of the scene, with every default filled in but for what an accuracy chooses."""
        data = super().resolved_data()
        joint = data["joint"]
        joint["block_size"] = self.joint.W
        if "element_size" not in joint and self.analysis.accuracy is None:
            joint.setdefault("relative_element_size", 0.04)
        if self.pin.rigid:
            data["pin"] = {"rigid": True}
        return data

    @property
    def has_friction(self) -> bool:
        """Whether there is friction in a contact."""
        return self.analysis.friction > 0

    @property
    def fits(self) -> bool:
        """Whether pin and hole are pressed into each other before they are loaded."""
        return self.joint.dR < 0

    @property
    def expected_cells(self) -> float:
        """About how many triangles the mesh will have."""
        return self.joint.expected_cells

    @property
    def expected_seconds(self) -> float:
        """About how long a solve will take on one rank of a machine of 2020, in a process that has
        solved before.

        Fitted by hand to runs of 2 450 to 8 336 dofs, elastic and plastic (README); beyond
        ``_LINEAR`` dofs the factorisation of a plane mesh grows as dofs^1.5 (George 1973).
        """
        dofs = _DOFS_PER_CELL[self.analysis.degree] * self.expected_cells
        step = 0.02 + _SECONDS[self.plastic] * dofs * max(1.0, (dofs / _LINEAR) ** 0.5)
        return 0.1 + 2e-5 * dofs + len(self.targets) * step

    def heading(self, key: str) -> str:
        """The dotted ``key`` with its unit: ``joint.clearance [mm]``."""
        section, _, name = key.partition(".")
        extra = type(getattr(self, section)).model_fields[name].json_schema_extra
        kind = extra.get("unit") if isinstance(extra, dict) else None
        if not kind:
            return key
        units = self.units.model_dump() | {"force": self.units.force_of(self.analysis.thickness)}
        return f"{key} [{units[kind]}]"

    def value(self, key: str, given: Any = None) -> Any:
        """What the scene says for the dotted ``key``; for the file of a path, of which it holds the
        targets, what was ``given``."""
        if key == "load.path":
            return given
        section, _, name = key.partition(".")
        return getattr(getattr(self, section), name)

    @property
    def force_controlled(self) -> bool:
        """Whether the load is a force."""
        return self.load.kind in ("force", "relative_force")

    @property
    def doubts(self) -> list[str]:
        """What to warn of before anything is solved."""
        return [*super().doubts, *self.doubts_of_strain, *self._doubts_of_path, *self._unused]

    @property
    def _unused(self) -> list[str]:
        """Warnings of keys that say nothing about this joint."""
        joint = self.joint
        load = self.load
        found = []
        if not joint.is_ring:
            found += unused(load, "load", "core_radius", 'joint.model = "ring"')
        if joint.edge_angle is None:
            found += unused(joint, "joint", "edge_ratio", "joint.edge_angle")
        return found

    @property
    def _doubts_of_path(self) -> list[str]:
        """A warning of a pin that is lifted so far that it would meet the half of the hole that is
        not there."""
        lifted = -min(self.targets)
        if self.force_controlled or lifted <= 2 * self.joint.dR:
            return []
        return [
            f"load.{self.load.kind} lifts the pin by {lifted / self.joint.dR:.3g} dR: beyond 2 dR "
            "it would meet the upper half of the hole, which is not modelled, so P stays 0 there; "
            "a joint that is loaded both ways takes two scenes, one for each direction"
        ]

    @property
    def doubts_of_strain(self) -> list[str]:
        """A warning of loads for which small strain is not meant."""
        farthest = max(map(abs, self.targets)) / self.joint.radius
        least = ""
        if self.force_controlled:
            stiffest = _STIFFEST_STUCK if self.analysis.friction else _STIFFEST
            farthest = farthest / (stiffest * self.E_star * self.thickness)
            least = "at least "
        if farthest <= self.small or self.joint.is_ring:
            return []
        moved = f"load.{self.load.kind} moves the pin by {least}{farthest:.2g} R"
        error = self.too_low * farthest
        fall = ", and may let it fall where it should rise" if farthest > _FAR else ""
        said = f"{moved}: small-strain theory makes P about {100 * error:.2g} % too low there{fall}"
        return [f'{said}; analysis.strain = "large" is for that']

    @property
    def too_low(self) -> float:
        """By what part of itself P of small strain is about too low, over delta/R: of elastic
        joints 0.15 to 0.17, of yielding ones 0.2 to 0.8, of dR/R from 0.5 to 5 % and delta up to
        R/10; more of those whose block thickens."""
        if self._block_thickens:
            clearance = self.joint.dR / self.joint.radius
            return error_of_small_strain(clearance, hardens=not self.block.perfectly_plastic)
        return 0.4 if self.plastic else 0.16

    @property
    def _block_thickens(self) -> bool:
        """Whether small strain leaves out that the block thickens; of rings that is not known."""
        if self.space is not None or self.joint.is_ring:
            return False
        return block_thickens(self.analysis.plane, self.pin.yield_stress, self.block.yield_stress)

    @property
    def small(self) -> float:
        """The displacement over R up to which P of the chosen theory of strain is good to 1 %."""
        return math.inf if self.analysis.strain == "large" else 0.01 / self.too_low

    @property
    def thickness(self) -> float:
        """Thickness of the block, 1 if forces are per unit thickness."""
        return super().thickness if self.space is None else self.space.thickness

    @property
    def load_unit(self) -> float:
        """What the targets of the section load are multiplied by."""
        scale = {
            "displacement": self.joint.dR,
            "relative_force": self.E_star * self.joint.radius * self.thickness,
        }
        return scale.get(self.load.kind, 1.0)

    @property
    def targets(self) -> list[float]:
        """The load at every output step: the displacement of the pin, or the force on it."""
        ends = [0.0, *(stage * self.load_unit for stage in self.load.stages)]
        found = []
        for (begin, end), n in zip(pairwise(ends), self.load.stage_steps, strict=True):
            found += [begin + (end - begin) * k / n for k in range(1, n)]
            found.append(end)
        return found

    @property
    def travelled(self) -> list[list[float]]:
        """The load at every output step: what two scenes share as far as they agree."""
        return [[target] for target in self.targets]

    @property
    def accurate(self) -> str:
        """Name of what an accuracy is asked of."""
        return "delta" if self.force_controlled else "P"

    @property
    def loading(self) -> str:
        """What a run must be loaded by to be continued with this scene, in words."""
        return "a force" if self.force_controlled else "a displacement"

    @property
    def E_star(self) -> float:
        """Contact modulus of the pair, ``1/E* = sum over deformable bodies of 1/E*_i`` (Johnson
        1985, eq. 4.20)."""
        plane = self.analysis.plane
        return 1 / sum(1 / contact_modulus(s.E, s.nu, plane) for s in self.solids.values())

    @property
    def solids(self) -> dict[str, Solid]:
        """The deformable bodies by name."""
        return {"block": self.block} if self.pin.rigid else {"pin": self.pin, "block": self.block}

"""The section ``joint`` of a scene: the radius of the pin, the clearance, and how finely
pin and hole are meshed; and the same as a shape of a general scene."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from archord.report.by_name import ByName
from archord.scene.presets.preset import PinPart
from archord.scene.presets.space import Space
from archord.scene.sections.keys import Positive, Section, after, given, key, require

_WIDEST = 1e6  # block_size over R
_THINNEST = 0.02  # wall of a ring over R
_MOST_CELLS = 1e6  # triangles: some 10 GB, and minutes for a mesh generator that is not parallel
Angle = Annotated[float, Field(gt=0, lt=math.pi / 2)]


class JointGeometry(Section):
    """The pin of radius ``R`` in a hole of radius ``R + dR``, and the mesh of both."""

    model: Literal["block", "ring"] = key(
        "block: the paper's quarter joint; ring: a ring and half a pin, loaded at its core "
        "(Persson)",
        default="block",
    )
    radius: float = key("radius R of the pin", "length", gt=0, example=10.0)
    clearance: float | None = key(
        "dR = hole radius - pin radius; in a ring also negative", "length", other=0.05
    )
    relative_clearance: float | None = key(
        "dR/R, instead of clearance: 1e-6 to 0.5", default=None, example=0.005
    )
    block_size: Positive | None = key(
        "side of the block, outer radius of ring; 100 R if absent", "length", other=1e3
    )
    element_size: Positive | None = key(
        "edge length of the elements on the arcs, up to 0.5 R", "length", other=0.4
    )
    relative_element_size: Positive | None = key(
        "element_size/R; 0.04 if both are absent", default=None, example=0.04
    )
    size_ratio: float = key(
        "element size on the pin's arc over that on the hole's", default=1.0, ge=0.01, le=100
    )
    edge_angle: Angle | None = key(
        "block: angle [rad] of the contact's end; elements shrink toward it", other=1.0
    )
    edge_ratio: float = key(
        "element size at edge_angle over element_size", default=0.25, ge=0.01, le=1
    )
    growth: float = key(
        "growth of the element size per unit of distance from the arcs", default=0.25, ge=0.01, le=2
    )

    @after
    def _geometry(self) -> JointGeometry:
        name = given(self, ("clearance", "relative_clearance"))
        require(
            1e-30 <= self.radius <= 1e30,
            "radius",
            "must be between 1e-30 and 1e30; choose other units",
        )
        dR = self.dR / self.radius
        h = self.h / self.radius
        require(
            dR > 0 or self.is_ring,
            name,
            'must be positive; an interference is for joint.model = "ring"',
        )
        require(
            1e-6 <= abs(dR) <= 0.5,
            name,
            "must be between 1e-6 and 0.5 times the radius, in a ring or minus that",
        )
        sizes = "element_size", "relative_element_size"
        name = sizes[0] if self.relative_element_size is None else given(self, sizes)
        require(1e-4 <= h <= 0.5, name, "must be between 1e-4 and 0.5 times the radius")
        require(
            1e-4 <= self.size_ratio * h <= 0.5,
            "size_ratio",
            "must leave elements of 1e-4 to 0.5 R on the pin",
        )
        require(
            self.edge_angle is None or not self.is_ring,
            "edge_angle",
            'is for joint.model = "block" alone',
        )
        hole = self.radius + self.dR
        least = 2 * hole
        said = f"must be at least twice the radius of the hole, {least:g}"
        if self.is_ring:
            least = hole + _THINNEST * self.radius
            said = f"must leave a wall of at least {_THINNEST:g} times R, {least:g} or more"
        require(least <= self.W * (1 + 1e-9), "block_size", said)
        require(
            self.W / self.radius <= _WIDEST,
            "block_size",
            f"must not exceed {_WIDEST:g} times the radius",
        )
        cells = self.expected_cells
        made = f"makes {cells:.0e} of at most {_MOST_CELLS:.0e} triangles"
        said = f"with growth = {self.growth:g} {made}; increase either of them"
        require(cells <= _MOST_CELLS, name, said)
        return self

    def arguments(self) -> ByName:
        """What draws it: lengths, and what is drawn."""
        edge = None
        if self.edge_angle is not None:
            edge = (self.edge_angle, self.edge_ratio * self.h)
        return {
            "ring": self.is_ring,
            "radius": self.radius,
            "clearance": self.dR,
            "block_size": self.W,
            "element_size": self.h,
            "growth": self.growth,
            "size_ratio": self.size_ratio,
            "edge": edge,
            "expected_cells": self.expected_cells,
        }

    @property
    def expected_cells(self) -> float:
        """About how many triangles the mesh will have.

        It is the area of the bodies over the area of equilateral triangles of the size ``t = h +
        growth |r - R|`` at radius r, integrated in closed form (lengths in R).
        """
        h = self.h / self.radius
        g = self.growth
        width = self.W / self.radius

        def ring(
            sign: int, depth: float
        ) -> float:  # integral of r dr / t^2 from the arc outward (1) or inward (-1)
            t = h + g * depth
            straight = (1 - sign * h / g) / g * (1 / h - 1 / t)
            return straight + sign * math.log(t / h) / g**2

        unit_triangle = math.sqrt(3) / 4
        return self.arc_end * (ring(-1, 1.0) + ring(1, width - 1)) / unit_triangle

    @property
    def is_block(self) -> bool:
        """Whether it is the paper's joint, for which there are laws."""
        return self.model == "block"

    @property
    def is_ring(self) -> bool:
        """Whether the hole's body is a ring under opposite forces, without supports, instead of a
        held block."""
        return self.model == "ring"

    @property
    def arc_end(self) -> float:
        """Angle [rad] from the contact axis to which the arcs are modelled: a quarter of a circle,
        in a ring half."""
        return math.pi if self.is_ring else math.pi / 2

    @property
    def pin_depth(self) -> float:
        """How far the pin's centre lies below the hole's centre at first.

        The pin and the hole touch there. In a ring they are concentric.
        """
        return 0.0 if self.is_ring else self.dR

    @property
    def dR(self) -> float:
        """Clearance."""
        return (
            self.clearance
            if self.clearance is not None
            else (self.relative_clearance or 0.0) * self.radius
        )

    @property
    def W(self) -> float:
        """Width of the block."""
        return 100 * self.radius if self.block_size is None else self.block_size

    @property
    def h(self) -> float:
        """Element size on the arcs, or on the hole's alone (see `size_ratio`)."""
        return (
            (self.relative_element_size or 0.04) * self.radius
            if self.element_size is None
            else self.element_size
        )


class JointShape(JointGeometry):
    """The paper's joint: half a block or a ring with a pin."""

    pin: PinPart = "half"
    core_radius: float = key("ring: radius over R of the core that the force acts on", default=0.1)
    space: Space | None = Field(None, description="lengths along z of a joint in space")
    kind: Literal["joint"] = "joint"
    drawing: ClassVar[str] = "archord.geometry.shapes.pin_in_block:pin_joint"

    def arguments(self) -> ByName:
        """What draws it."""
        drawn: ByName = {
            "kind": self.kind,
            "pin": self.pin,
            "core_radius": self.core_radius,
        }
        if self.space is not None:
            drawn["space"] = self.space.arguments()
        return super().arguments() | drawn

"""The two cases of the work-precision benchmark, and the series of meshes that archord and CalculiX solve them on.

A series is one line of `SERIES`: a name and the sections of the scene that each of its meshes sets.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from archord.benchmarks.case import paper_joint
from archord.postprocess.deck import Elements
from archord.scene.scene import Scene

Kinematics = Literal["current", "reference"]
Mesh = Mapping[str, Any]  # keys of a scene by section
QUANTITIES = ("P", "p0", "eps", "profile", "dissipation")


@dataclass(frozen=True)
class JointCase:
    """The paper's joint (dR/R = 0.5 %, R = E* = 1, plane strain, like bodies) pressed by 2 dR in ``steps`` steps."""

    name: str
    title: str
    steps: int
    yield_stress: float | None = None

    @property
    def quantities(self) -> tuple[str, ...]:
        """What it is judged by; elastic bodies dissipate nothing."""
        return QUANTITIES if self.yield_stress else QUANTITIES[:-1]

    def scene(self, mesh: Mesh, kinematics: Kinematics = "current") -> Scene:
        """The case with the sections of ``mesh``. Raises `InputError` if they do not make a scene."""
        sections: dict[str, Any] = {name: dict(keys) for name, keys in mesh.items()}
        sections["analysis"] = sections.get("analysis", {}) | {"kinematics": kinematics}
        return paper_joint(steps=self.steps, yield_stress=self.yield_stress, **sections)


@dataclass(frozen=True)
class Series:
    """Meshes from coarse to fine for the ``cases``; ``quick`` series are those that ``--quick`` solves one or two of.

    With ``elements`` they are meshes of CalculiX's, on which the elastic case has ``elastic_steps``.
    """

    name: str
    meshes: tuple[Mesh, ...]
    cases: tuple[str, ...] = ("elastic", "plastic")
    quick: bool = False
    elements: Elements | None = None
    elastic_steps: int = 2


CASES = {
    case.name: case
    for case in (
        JointCase("elastic", "elastic, 2 steps to 2 dR", 2),
        JointCase("plastic", "elasto-plastic, sigY/E* = 0.2 %, 20 steps to 2 dR", 20, 0.002),
    )
}


# Where the contact ends at 2 dR; from a run on any mesh.
EDGE = {"elastic": 1.17, "plastic": 1.395}


def meshes(
    *sizes: float, growth: float = 0.0, ratio: float = 0.0, most: float = 2.0, edge: str = "", degree: int = 2
) -> tuple[Mesh, ...]:
    """A mesh for each element size on the arc (in R), of one ``growth`` or, so that they are refined everywhere, of
    ``ratio`` times the size, but no more than ``most``. Four times finer at the ``edge`` of the contact in that case.
    """
    fine = {"edge_angle": EDGE[edge]} if edge else {}
    return tuple(
        {
            "joint": {"element_size": h, "growth": growth or min(most, round(ratio * h, 6)), **fine},
            "analysis": {"degree": degree},
        }
        for h in sizes
    )


SERIES = (
    Series("edge, growth 0.3", meshes(0.12, 0.1, 0.08, 0.06, 0.04, growth=0.3, edge="plastic"), ("plastic",)),
    Series("edge, growth 0.12", meshes(0.12, 0.08, 0.06, growth=0.12, edge="plastic"), ("plastic",)),
    Series("edge, growth 0.25", meshes(0.12, 0.08, 0.06, 0.04, growth=0.25, edge="elastic"), ("elastic",)),
    Series("degree 3, edge, growth 0.5", meshes(0.16, 0.12, 0.08, growth=0.5, edge="elastic", degree=3), ("elastic",)),
    Series("degree 3, growth 0.35", meshes(0.08, 0.06, 0.04, growth=0.35, degree=3), ("elastic",)),
    Series("degree 3, growth = 5 h", meshes(0.04, 0.02, 0.01, ratio=5.0, degree=3), ("elastic",)),
    Series("growth 0.25", meshes(0.16, 0.12, 0.08, 0.06, 0.04, growth=0.25), quick=True),
    Series("growth = 6.25 h", meshes(0.06, 0.04, 0.03, 0.02, 0.014, ratio=6.25)),
)
# In 2 steps CalculiX is off by 2e-3 on some meshes, in 4 it is not.
DECKS = (
    Series("CPE6", meshes(0.08, 0.06, 0.04, ratio=6.25, most=0.25), elements="quadratic"),
    Series(
        "CPE6, 4 steps",
        meshes(0.06, 0.04, 0.02, ratio=6.25, most=0.25),
        ("elastic",),
        elements="quadratic",
        elastic_steps=4,
    ),
    Series("CPE3", meshes(0.06, 0.03, ratio=6.25, most=0.25), elements="linear"),
)


def families(case: JointCase) -> list[Series]:
    """What the reference is extrapolated from: two families that are refined everywhere, near and far elements in
    different shares; the finest mesh of either for the elastic case alone."""
    count = 4 if case.yield_stress else 5
    sizes = {6.25: (0.02, 0.014, 0.01, 0.007, 0.005), 12.5: (0.014, 0.01, 0.007, 0.005, 0.0035)}
    return [Series(f"growth = {ratio:g} h", meshes(*sizes[ratio][:count], ratio=ratio)) for ratio in sizes]

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


def meshes(*sizes: float, growth: float, **sections: Mapping[str, Any]) -> tuple[Mesh, ...]:
    """A mesh for each element size on the arc (in R); ``sections`` are keys that all of them set."""
    joint = sections.pop("joint", {})
    return tuple({"joint": {"element_size": h, "growth": growth, **joint}, **sections} for h in sizes)


def scaled(*sizes: float, ratio: float, most: float = 2.0, **sections: Mapping[str, Any]) -> tuple[Mesh, ...]:
    """Meshes whose growth is ``ratio`` times the element size (in R), but no more than ``most``, so that they are
    refined everywhere."""
    return tuple(mesh for h in sizes for mesh in meshes(h, growth=min(most, round(ratio * h, 6)), **sections))


# Where the contact ends at 2 dR; from a run on any mesh.
EDGE = {"elastic": 1.17, "plastic": 1.395}


def edged(case: str, *sizes: float, growth: float, degree: int = 2) -> tuple[Mesh, ...]:
    """Meshes that are four times finer at the contact's edge."""
    joint = {"edge_angle": EDGE[case]}
    return meshes(*sizes, growth=growth, joint=joint, analysis={"degree": degree})


SERIES = (
    Series("edge, growth 0.3", edged("plastic", 0.12, 0.1, 0.08, 0.06, 0.04, growth=0.3), ("plastic",)),
    Series("edge, growth 0.12", edged("plastic", 0.12, 0.08, 0.06, growth=0.12), ("plastic",)),
    Series("edge, growth 0.25", edged("elastic", 0.12, 0.08, 0.06, 0.04, growth=0.25), ("elastic",)),
    Series("degree 3, edge, growth 0.5", edged("elastic", 0.16, 0.12, 0.08, growth=0.5, degree=3), ("elastic",)),
    Series("degree 3, growth 0.35", meshes(0.08, 0.06, 0.04, growth=0.35, analysis={"degree": 3}), ("elastic",)),
    Series("degree 3, growth = 5 h", scaled(0.04, 0.02, 0.01, ratio=5.0, analysis={"degree": 3}), ("elastic",)),
    Series("growth 0.25", meshes(0.16, 0.12, 0.08, 0.06, 0.04, growth=0.25), quick=True),
    Series("growth = 6.25 h", scaled(0.06, 0.04, 0.03, 0.02, 0.014, ratio=6.25)),
)


def _deck(name: str, elements: Elements, *sizes: float, **options: Any) -> Series:
    return Series(name, scaled(*sizes, ratio=6.25, most=0.25), elements=elements, **options)


# In 2 steps CalculiX is off by 2e-3 on some meshes, in 4 it is not.
DECKS = (
    _deck("CPE6", "quadratic", 0.08, 0.06, 0.04),
    _deck("CPE6, 4 steps", "quadratic", 0.06, 0.04, 0.02, cases=("elastic",), elastic_steps=4),
    _deck("CPE3", "linear", 0.06, 0.03),
)

_FAMILIES = (  # growth over element size, and element sizes, the finest of the elastic case alone
    (6.25, (0.02, 0.014, 0.01, 0.007, 0.005)),
    (12.5, (0.014, 0.01, 0.007, 0.005, 0.0035)),
)


def families(case: JointCase) -> list[Series]:
    """What the reference is extrapolated from: two families that are refined everywhere, near and far elements in
    different shares."""
    count = 4 if case.yield_stress else 5
    return [Series(f"growth = {ratio:g} h", scaled(*sizes[:count], ratio=ratio)) for ratio, sizes in _FAMILIES]

"""The joints of `archord.benchmarks.paper.finding`: what is varied around the paper's joint."""

from __future__ import annotations

from dataclasses import dataclass

from archord.benchmarks.paper.runs import Plane
from archord.scene.file import parse_scene
from archord.scene.scene import Scene


@dataclass(frozen=True)
class Variant:
    """A joint in units of R = E* = 1; ``ratio`` is E of the pin over that of the block (None: a rigid pin).

    Without ``yielding`` bodies it is elastic, and ``yield_stress`` means nothing.
    """

    name: str
    nu: float = 0.3
    ratio: float | None = 1.0
    yielding: tuple[str, ...] = ("pin", "block")
    clearance: float = 0.005
    yield_stress: float = 0.002
    kinematics: str = "current"

    @property
    def s(self) -> float | None:
        """Relative yield stress ``sigY R/(E* dR)``; None for an elastic joint."""
        return self.yield_stress / self.clearance if self.yielding else None

    def scene(self, plane: Plane, element_size: float, steps: int = 20) -> Scene:
        """The scene in a plane."""
        factor = 1 - self.nu**2 if plane == "strain" else 1.0
        block = factor * (1 + (0.0 if self.ratio is None else 1 / self.ratio))
        moduli = {"pin": None if self.ratio is None else self.ratio * block, "block": block}
        bodies = {
            name: {"rigid": True}
            if E is None
            else {"E": E, "nu": self.nu} | ({"yield_stress": self.yield_stress} if name in self.yielding else {})
            for name, E in moduli.items()
        }
        return parse_scene(
            {
                "joint": {"radius": 1.0, "clearance": self.clearance, "relative_element_size": element_size},
                **bodies,
                "analysis": {"plane": plane, "kinematics": self.kinematics},
                "load": {"displacement": 2.0, "steps": steps},
            }
        )


VARIANTS = (
    Variant("reference: like bodies, nu = 0.3"),
    Variant("nu = 0", nu=0.0),
    Variant("nu = 0.2", nu=0.2),
    Variant("nu = 0.4", nu=0.4),
    Variant("nu = 0.49", nu=0.49),
    Variant("pin 3 times stiffer", ratio=3.0),
    Variant("pin 10 times stiffer", ratio=10.0),
    Variant("pin 3 times softer", ratio=1 / 3),
    Variant("rigid pin", ratio=None, yielding=("block",)),
    Variant("only the block yields", yielding=("block",)),
    Variant("only the pin yields", yielding=("pin",)),
    Variant("pin 10 times stiffer, only the block yields", ratio=10.0, yielding=("block",)),
    Variant("reference kinematics", kinematics="reference"),
    Variant("dR/R = 0.1 %, sigY/E* = 0.04 %", clearance=0.001, yield_stress=0.0004),
    Variant("dR/R = 1 %, sigY/E* = 0.4 %", clearance=0.01, yield_stress=0.004),
    Variant("sigY/E* = 0.1 %", yield_stress=0.001),
    Variant("sigY/E* = 0.15 %", yield_stress=0.0015),
    Variant("sigY/E* = 0.3 %", yield_stress=0.003),
    Variant("sigY/E* = 0.4 %", yield_stress=0.004),
    Variant("sigY/E* = 0.5 %", yield_stress=0.005),
)


def _more(s: float | None, nu: float = 0.3, ratio: float | None = 1.0, block_alone: bool = False) -> Variant:
    """A joint off the axes of `VARIANTS`, with dR/R = 0.5 %."""
    pin = "rigid pin" if ratio is None else f"E1/E2 = {ratio:.3g}"
    body = "" if s is None else ", only the block yields" if block_alone or ratio is None else ", both yield"
    name = f"{'elastic' if s is None else f's = {s:g}'}, nu = {nu:g}, {pin}{body}"
    bodies = () if s is None else ("block",) if block_alone or ratio is None else ("pin", "block")
    return Variant(name, nu, ratio, bodies, yield_stress=0.005 * (s or 0.4))


ELASTIC = (
    *(_more(None, nu) for nu in (0.0, 0.3, 0.49)),
    *(_more(None, ratio=ratio) for ratio in (3.0, 10.0, 1 / 3, None)),
    *(_more(None, nu, ratio) for nu, ratio in ((0.0, 10.0), (0.49, 10.0), (0.0, None), (0.49, 1 / 3))),
)
CROSSED = (
    *(_more(s, nu) for s in (0.2, 0.8) for nu in (0.0, 0.49)),
    *(_more(s, ratio=ratio) for s in (0.2, 0.8) for ratio in (10.0, 1 / 3)),
    *(_more(s, nu, ratio) for s, nu, ratio in ((0.2, 0.0, 10.0), (0.8, 0.49, 1 / 3), (1.25, 0.3, 1.0))),
    *(_more(0.4, ratio=ratio, block_alone=True) for ratio in (1 / 3, 3.0)),
    *(_more(s, block_alone=True) for s in (0.2, 0.8)),
    *(_more(s, ratio=None) for s in (0.2, 0.6, 0.8)),
    *(_more(0.4, nu, ratio=None) for nu in (0.0, 0.49)),
    *(_more(s, nu, 10.0, block_alone=True) for s, nu in ((0.2, 0.0), (0.8, 0.49))),
)

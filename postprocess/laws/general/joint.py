"""What the laws know of a joint."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from archord.materials.elasticity import contact_modulus
from archord.materials.thickening import block_thickens, error_of_small_strain
from archord.report.by_name import ByName

if TYPE_CHECKING:
    from archord.materials.hardening import Hardening
    from archord.scene.presets.joint import Scene
    from archord.scene.sections.bodies import Solid

LARGE = 100.0  # width of the block over R, for which the laws of P(delta) are
# fall of P in a block of W, times (W/R)^2
_SOFTER = 1.4  # of like elastic bodies
_SOFTEST = 2.5  # of any
_FELT = 1e-3  # share of P by which a small block must change it to be worth a word
# as `factor_fit` prints it of joints that other joints tell
ROUGH_PRESSURE = "p0 of a joint with friction is off by some 3 %, and by 19 % at worst"
FIXED_PAIRS = (
    'of closest points on the deformed curves; with analysis.kinematics = "reference" P of a run '
    "is lower: in the paper's elastic joint at 2 dR by 0.15 %"
)
# The keys of a scene by how laws begin to refuse its joint.
_REFUSED = {
    "nu of the pin": "pin.nu",
    "nu of the block": "block.nu",
    "Dundurs' beta": "pin.nu, block.nu",
    "dR/R": "joint.clearance",
    "E(pin)/E(block)": "pin.E, block.E",
    "sigY R/(E* dR)": "pin.yield_stress, block.yield_stress",
    "friction": "analysis.friction",
    "a body has back stresses": "pin.back_stresses, block.back_stresses",
    "a body hardens": "pin.hardening, block.hardening",
    "this is a ring": "joint.model",
    "is a law for a pin in a block": "joint.model",
}
_LATEST = 1.3  # s of a block that yields before 3 dR


def keys_of(reason: str) -> str:
    """The keys of a scene that a law's ``reason`` to refuse its joint is about, "" of others."""
    return next((keys for words, keys in _REFUSED.items() if reason.startswith(words)), "")


class LawRangeWarning(UserWarning):
    """A law was asked outside its range; the message tells the range."""


@dataclass(frozen=True)
class LawJoint:
    """A pin in a hole, as the laws know it, in any consistent units.

    Laws of P(delta) are for a pin in a wide block. They warn of a joint that is another one.

    Parameters
    ----------
    radius : float
        The radius R1 of the pin.
    clearance : float
        The radius of the hole is R2 = R1 + ``clearance``.
    E_star : float
        The contact modulus of the plane.
    pin_yield, block_yield : float
        The yield stresses; None is an elastic body.
    k : float
        Winkler's coefficient (Hu et al., eq. 6).
    c : float
        The plateau of the pressure over the yield stress (Hu et al., eq. 10).
    length : float
        The length along the axis.
    pin_share : float
        The share of the pin in the compliance 1/E*: 0 is a rigid pin, 1/2 are like bodies.
    plane : {"strain", "stress"}
        The plane.
    nu : float
        Poisson's ratio of the block.
    pin_nu : float
        Poisson's ratio of the pin; None is the block's ratio, or a rigid pin.
    pin_hardening, block_hardening : Hardening
        How the yield stress grows with PEEQ, in the units of ``E_star``; None is perfect
        plasticity.
    kinematic : bool
        Whether a body that yields has back stresses, which no law knows.
    ring : bool
        Whether the pin is in a ring, not in a block.
    block_size : float
        The width of the block; None is a wide one.
    whole : bool
        Whether the pin is whole, not cut at the pressed diameter.
    friction : float
        The coefficient of friction, which the law of solved joints alone knows.
    large_strain : bool
        Whether strain is large, which the law of solved joints alone knows.
    fixed_pairs : bool
        Whether contact is of the pairs of points of the undeformed curves.

    Raises
    ------
    ValueError
        For values that make no joint.

    Examples
    --------
    >>> from archord.postprocess.laws.general.joint import LawJoint
    >>> joint = LawJoint(radius=10.0, clearance=0.05, E_star=115e3, block_yield=355.0)
    >>> joint.unit
    5750.0
    >>> joint.yielding
    'block'
    """

    radius: float
    clearance: float
    E_star: float
    pin_yield: float | None = None
    block_yield: float | None = None
    k: float = 0.85
    c: float = 1.0
    length: float | None = None
    pin_share: float = 0.5
    plane: str | None = None
    nu: float | None = None
    pin_nu: float | None = None
    pin_hardening: Hardening | None = None
    block_hardening: Hardening | None = None
    kinematic: bool = False
    ring: bool = False
    block_size: float | None = None
    whole: bool = False
    friction: float = 0.0
    large_strain: bool = False
    fixed_pairs: bool = False

    def __post_init__(self) -> None:
        """Check the values; numbers of numpy become Python's, which files can hold."""
        for name, value in vars(self).items():
            if isinstance(value, (np.generic, np.ndarray)):
                object.__setattr__(self, name, value.item())
        positive = "radius clearance E_star k c pin_yield block_yield length block_size"
        for name in positive.split():
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value:g} must be a positive number.")
        for name in ("kinematic", "ring", "whole", "large_strain", "fixed_pairs"):
            value = getattr(self, name)
            if value not in (False, True):
                raise ValueError(f"{name} = {value!r} must be True or False.")
        if not 0 <= self.pin_share <= 1:
            raise ValueError(f"pin_share = {self.pin_share:g} must be between 0 and 1.")
        for name in ("nu", "pin_nu"):
            value = getattr(self, name)
            if value is not None and not -1 < value < 0.5:
                raise ValueError(f"{name} = {value:g} must be between -1 and 0.5.")
        for body in ("pin", "block"):
            law = getattr(self, f"{body}_hardening")
            stress = getattr(self, f"{body}_yield")
            if law is None:
                continue
            if not hasattr(law, "stress"):
                said = f"must be a Hardening, like LinearHardening, not {law!r}"
                raise ValueError(f"{body}_hardening {said}.")
            if stress is None:
                raise ValueError(f"{body}_hardening needs {body}_yield, where it begins.")
            begins = float(law.stress(np.zeros(1))[0])
            if not math.isclose(begins, stress, rel_tol=1e-6):
                said = f"{body}_hardening begins at {begins:g}, not at {body}_yield = {stress:g}"
                raise ValueError(f"{said}.")
        if self.plane not in (None, "strain", "stress"):
            raise ValueError(f"plane = {self.plane!r} must be one of strain, stress.")

    @classmethod
    def from_scene(cls, scene: Scene) -> LawJoint:
        """The joint of ``scene``."""
        plane = scene.analysis.plane
        pin = scene.solids.get("pin")
        block = scene.block
        given: ByName = {"pin_share": 0.0}
        if pin is not None:
            stiffness = contact_modulus(pin.E, pin.nu, plane)
            given = {
                "pin_share": 1 / (1 + stiffness / contact_modulus(block.E, block.nu, plane)),
                "pin_yield": pin.yield_stress,
                "pin_hardening": _hardening(pin),
            }
        return cls(
            scene.joint.radius,
            scene.joint.dR,
            scene.E_star,
            block_yield=block.yield_stress,
            length=scene.analysis.thickness,
            plane=plane,
            nu=block.nu,
            pin_nu=scene.pin.nu,
            block_hardening=_hardening(block),
            ring=not scene.joint.is_block,
            block_size=scene.joint.W,
            whole=scene.pin.whole,
            friction=scene.analysis.friction,
            large_strain=scene.analysis.strain == "large",
            fixed_pairs=scene.analysis.kinematics == "reference",
            kinematic=any(solid.back_stresses for solid in scene.solids.values()),
            **given,
        )

    @property
    def yield_stress(self) -> float | None:
        """Yield stress of the weaker body; None if neither yields."""
        return min(
            (stress for stress in (self.pin_yield, self.block_yield) if stress is not None),
            default=None,
        )

    @property
    def yielding(self) -> str:
        """Which bodies yield: "none", "pin", "block", "both" at one stress, or "unlike", each at
        its own."""
        if self.pin_yield is None:
            return "none" if self.block_yield is None else "block"
        if self.block_yield is None:
            return "pin"
        alike = math.isclose(self.pin_yield, self.block_yield, rel_tol=1e-6)
        return "both" if alike else "unlike"

    @property
    def hardens(self) -> bool:
        """Whether a body that yields hardens."""
        laws = self.pin_hardening, self.block_hardening
        return self.kinematic or any(law is not None for law in laws)

    @property
    def elastic(self) -> LawJoint:
        """The joint whose bodies do not yield."""
        perfectly_plastic = replace(self, pin_hardening=None, block_hardening=None)
        return replace(perfectly_plastic, pin_yield=None, block_yield=None)

    @property
    def dundurs_alpha(self) -> float:
        """``(E1' - E2')/(E1' + E2')``: positive where the pin is the stiffer body."""
        return 1 - 2 * self.pin_share

    @property
    def dundurs_beta(self) -> float:
        """Dundurs' other constant; zero where plane and nu are unknown, as for like bodies."""
        if self.plane is None or self.nu is None:
            return 0.0
        pin, block = (
            _transverse(self.nu if nu is None else nu, self.plane) for nu in (self.pin_nu, self.nu)
        )
        return (1 - self.pin_share) * block - self.pin_share * pin

    @property
    def relative_radius(self) -> float:
        """Relative radius of curvature ``R* = R1 R2 / dR``."""
        return self.radius * (self.radius + self.clearance) / self.clearance

    @property
    def unit(self) -> float:
        """Unit of the load, ``E* dR``."""
        return self.E_star * self.clearance

    @property
    def softer(self) -> tuple[float, float]:
        """By what share of itself P(delta) is about smaller in this block than in one of `LARGE` R,
        and at most: from widths of 2.5 to 50 R, solved up to delta = 2 dR. The factor of
        ``(R/W)^2`` is 1.2 to 1.4 for like elastic bodies, to 2 for a rigid pin, to 2.4 beyond
        yield."""
        narrow = 0.0 if self.block_size is None else (self.radius / self.block_size) ** 2
        return _SOFTER * narrow, _SOFTEST * narrow

    @property
    def other_shapes(self) -> list[str]:
        """What of its shape makes its P another one than that of laws, and by how much, in words
        that follow "is a law"."""
        said = []
        about, most = self.softer
        if self.block_size and about > _FELT:
            said.append(
                f"for a block of {LARGE:g} R; in this one of {self.block_size / self.radius:.4g} "
                f"R the joint is softer, and its P about {about:.1%} smaller than the law's (up to "
                f"{most:.1%} with a rigid pin, or beyond yield)"
            )
        if self.whole:
            said.append(
                "for half a pin, cut where it is pressed; of a whole one P is higher: 2 %, beyond "
                "yield 10 %"
            )
        return said

    @property
    def missed_by_small_strain(self) -> float:
        """The part of P by which it is too low at 2 dR, about, where a block thickens (see
        materials/thickening.py); 0 otherwise, and at large strain."""
        thickens = block_thickens(self.plane, self.pin_yield, self.block_yield)
        latest = _LATEST * self.unit / self.radius
        if self.large_strain or not thickens or (self.block_yield or 0.0) > latest:
            return 0.0
        clearance = self.clearance / self.radius
        hardens = self.block_hardening is not None
        return 2 * clearance * error_of_small_strain(clearance, hardens=hardens)

    @property
    def small_strain(self) -> list[str]:
        """What small strain leaves out where that is much, in words that follow "is a law"."""
        missed = self.missed_by_small_strain
        if not missed:
            return []
        return [
            "of small strain; where the block yields it thickens, and P is higher, at 2 dR by "
            f"about {missed:.1%}: large strain has that"
        ]

    @property
    def unlike_solved(self) -> list[str]:
        """What is unlike the joints that the general law is of, in words that follow "is a
        law"."""
        said = [*self.other_shapes, *self.small_strain]
        return [*said, FIXED_PAIRS] if self.fixed_pairs else said

    @property
    def onset(self) -> float:
        """``s = sigY R/(E* dR)``; infinite without a yield stress."""
        return (
            math.inf if self.yield_stress is None else self.yield_stress * self.radius / self.unit
        )

    @property
    def threshold(self) -> float:
        """Largest pressure of the foundation, ``c sigY``; infinite without a yield stress."""
        return math.inf if self.yield_stress is None else self.c * self.yield_stress

    @property
    def first_yield(self) -> float:
        """Critical displacement ``delta0 = c sigY R/(k E*)`` (Hu et al.: c = 1); infinite without a
        yield stress."""
        return self.radius * self.threshold / (self.k * self.E_star)


def _hardening(solid: Solid) -> Hardening | None:
    """The curve of a ``solid`` that hardens."""
    if solid.yield_stress is None:
        return None
    straight = solid.law.linear
    return solid.law if straight is None or straight[1] else None


def _transverse(nu: float, plane: str) -> float:
    """``(kappa - 1)/(kappa + 1)`` with Kolosov's constant: the part of Dundurs' beta that a body
    brings."""
    kappa = 3 - 4 * nu if plane == "strain" else (3 - nu) / (1 + nu)
    return (kappa - 1) / (kappa + 1)

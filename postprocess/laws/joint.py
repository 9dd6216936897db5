"""What the laws know of a joint."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from archord.materials.elasticity import contact_modulus
from archord.materials.material import Plane
from archord.scene.scene import Scene

Array = npt.NDArray[np.floating]
LARGE = 100.0  # width of the block over R, for which the laws of P(delta) are
_SOFTER, _SOFTEST = 1.4, 2.5  # fall of P in a block of W, times (W/R)^2: of like elastic bodies, and of any


@dataclass(frozen=True)
class LawJoint:
    """A pin of radius ``radius`` (R1) in a hole of radius R2 = R1 + ``clearance``, in any consistent units.

    ``E_star`` is the contact modulus of the plane, ``yield_stress`` that of the weaker body, ``k`` Winkler's
    coefficient and ``c`` the plateau of the pressure over the yield stress (Hu et al., eqs 6 and 10), ``length`` along
    the axis. ``dundurs_alpha`` = (E1' - E2')/(E1' + E2') is positive where the pin is the stiffer body,
    ``dundurs_beta`` goes with it; both are zero for like bodies. Only the calibrated law asks for ``plane``, ``nu`` of
    the block, ``pin_nu`` (None: the block's, or rigid), and which bodies have the yield stress, ``yielding`` ("unlike":
    each its own). Laws of P(delta) are for a pin in a wide block, and say so of a ``ring``, where ``block_size`` (None:
    wide) is small, or the pin is ``whole``, not cut at the pressed diameter; those with yielding say so where a body
    ``hardens``. Raises ValueError for values that make no joint.
    """

    radius: float
    clearance: float
    E_star: float
    yield_stress: float | None = None
    k: float = 0.85
    c: float = 1.0
    length: float | None = None
    dundurs_alpha: float = 0.0
    dundurs_beta: float = 0.0
    plane: str | None = None
    nu: float | None = None
    pin_nu: float | None = None
    yielding: str = "both"
    ring: bool = False
    block_size: float | None = None
    hardens: bool = False
    whole: bool = False

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("radius", "clearance", "E_star", "k", "c", "yield_stress", "length", "block_size"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value:g} must be a positive number.")
        for name, most in (("dundurs_alpha", 1), ("dundurs_beta", 0.5)):
            if not abs(getattr(self, name)) <= most:
                raise ValueError(f"{name} = {getattr(self, name):g} must be between {-most:g} and {most:g}.")
        for name, value in (("nu", self.nu), ("pin_nu", self.pin_nu)):
            if value is not None and not -1 < value < 0.5:
                raise ValueError(f"{name} = {value:g} must be between -1 and 0.5.")
        for name, known in (("plane", (None, "strain", "stress")), ("yielding", ("both", "block", "pin", "unlike"))):
            if getattr(self, name) not in known:
                raise ValueError(f"{name} = {getattr(self, name)!r} must be one of {', '.join(filter(None, known))}.")

    @classmethod
    def from_scene(cls, scene: Scene) -> LawJoint:
        """The joint of ``scene``; of two yield stresses the lower one, of hardening only whether there is any."""
        plane, pin, block = scene.analysis.plane, scene.solids.get("pin"), scene.block
        alpha, first, yields, second = 1.0, 0.0, [None, block.yield_stress], _transverse(block.nu, plane)
        if pin is not None:
            ratio = contact_modulus(pin.E, pin.nu, plane) / contact_modulus(block.E, block.nu, plane)
            alpha, first, yields[0] = (ratio - 1) / (ratio + 1), _transverse(pin.nu, plane), pin.yield_stress
        return cls(
            scene.joint.radius,
            scene.joint.dR,
            scene.E_star,
            length=scene.analysis.thickness,
            yield_stress=min((stress for stress in yields if stress is not None), default=None),
            dundurs_alpha=alpha,
            # in the compliances 1/E1' = (1 - alpha)/(2 E*), 1/E2' = (1 + alpha)/(2 E*)
            dundurs_beta=((1 + alpha) * second - (1 - alpha) * first) / 2,
            plane=plane,
            nu=block.nu,
            pin_nu=scene.pin.nu,
            yielding=_yielding(*yields),
            ring=not scene.joint.is_block,
            block_size=scene.joint.W,
            hardens=not all(solid.perfectly_plastic for solid in scene.solids.values()),
            whole=scene.pin.whole,
        )

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
        """By what share of itself P(delta) is about smaller in this block than in one of `LARGE` R, and at most: from
        widths of 2.5 to 50 R, solved up to delta = 2 dR. The factor of ``(R/W)^2`` is 1.2 to 1.4 for like elastic
        bodies, to 2 for a rigid pin, to 2.4 beyond yield."""
        narrow = 0.0 if self.block_size is None else (self.radius / self.block_size) ** 2
        return _SOFTER * narrow, _SOFTEST * narrow

    @property
    def onset(self) -> float:
        """``s = sigY R/(E* dR)``; infinite without a yield stress."""
        return math.inf if self.yield_stress is None else self.yield_stress * self.radius / self.unit

    @property
    def threshold(self) -> float:
        """Largest pressure of the foundation, ``c sigY``; infinite without a yield stress."""
        return math.inf if self.yield_stress is None else self.c * self.yield_stress

    @property
    def first_yield(self) -> float:
        """Critical displacement ``delta0 = c sigY R/(k E*)`` (Hu et al.: c = 1); infinite without a yield stress."""
        return self.radius * self.threshold / (self.k * self.E_star)


def _yielding(pin: float | None, block: float | None) -> str:
    if pin is not None and block is not None:
        return "both" if math.isclose(pin, block, rel_tol=1e-6) else "unlike"
    return "pin" if pin is not None else "block" if block is not None else "both"


def _transverse(nu: float, plane: Plane) -> float:
    """``(kappa - 1)/(kappa + 1)`` with Kolosov's constant: the part of Dundurs' beta that a body brings."""
    kappa = 3 - 4 * nu if plane == "strain" else (3 - nu) / (1 + nu)
    return (kappa - 1) / (kappa + 1)

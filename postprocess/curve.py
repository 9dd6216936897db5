"""The curves of a run, P, p0 and eps over delta, with the joint they belong to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from archord.materials.kinematics import Bools
from archord.materials.material import Array
from archord.scene.presets.joint import Scene

CURVES = ("delta", "P", "p0", "eps", "peeq_max")
_SAME = 1e-6  # relative difference of two forces that are the same but for what Newton leaves


@dataclass(frozen=True)
class RunCurve:
    """Accepted steps of a run, in the scene's units: arrays ``(n,)`` over the steps. Forces are per
    unit thickness. ``step`` holds the numbers of the steps in the run, 1 to n if absent."""

    name: str
    scene: Scene
    delta: Array
    P: Array
    p0: Array
    eps: Array
    peeq_max: Array
    folder: Path | None = None
    step: np.ndarray | None = None

    @property
    def numbers(self) -> np.ndarray:
        """Number of each step in the run ``(n,)``."""
        return np.arange(1, len(self.delta) + 1) if self.step is None else self.step

    @property
    def E_star(self) -> float:
        """Contact modulus."""
        return self.scene.E_star

    @property
    def R(self) -> float:
        """Radius of the pin."""
        return self.scene.joint.radius

    @property
    def dR(self) -> float:
        """Clearance."""
        return self.scene.joint.dR

    @property
    def x(self) -> Array:
        """Displacement over the clearance."""
        return self.delta / self.dR

    @property
    def unit(self) -> float:
        """Unit of forces, ``E* dR``."""
        return self.E_star * self.dR

    @property
    def sigY(self) -> float | None:
        """Yield stress of the weaker body; None if neither yields."""
        known = [solid.yield_stress for solid in self.scene.solids.values()]
        return min((stress for stress in known if stress is not None), default=None)

    @property
    def plane(self) -> str:
        """Plane of the analysis: "strain" or "stress"."""
        return self.scene.analysis.plane

    def loading(self) -> RunCurve:
        """The steps at which the pin is deeper in the hole than ever before; unloading and what it
        repeats left out.

        A joint that yields comes back from unloading a little deeper and softer, to the first
        loading's curve only beyond: the first step that counts again is one whose P is larger than
        ever before, too.
        """
        first = on_first_loading(self.delta, self.P)
        chosen = {name: getattr(self, name)[first] for name in CURVES}
        return replace(self, **chosen, step=self.numbers[first])


def rms(errors: Array) -> float:
    """The root of the mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def on_first_loading(delta: Array, P: Array) -> Bools:
    """Whether each of the steps ``(n,)`` is one of `RunCurve.loading`."""
    deepest, largest = (np.maximum.accumulate([0.0, *values])[:-1] for values in (delta, P))
    deeper = delta > deepest * (1 + 1e-9)
    stronger = largest * (1 + _SAME) < P
    first = np.zeros(len(delta), dtype=bool)
    going_on = True
    for k in range(len(delta)):
        going_on = bool(deeper[k] and (going_on or stronger[k]))
        first[k] = going_on
    return first


def first_loading(load: Array) -> slice:
    """The steps before ``load`` ``(n,)`` first goes back."""
    back = np.flatnonzero(np.diff(load) <= 0)
    return slice(int(back[0]) + 1 if len(back) else None)


def gap_name(dR: float, symbol: str = "dR") -> str:
    """A clearance as it stands in names of quantities: of its size alone, where it is an
    interference."""
    return symbol if dR > 0 else f"|{symbol}|"

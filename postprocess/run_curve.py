"""The curves of a run, P and p0 over delta, with the joint they belong to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from archord.geometry.basis import Array
from archord.output.folder import no_run
from archord.output.history import read_history
from archord.scene.errors import InputError
from archord.scene.file import load_scene
from archord.scene.scene import Scene

_SAME = 1e-6  # relative difference of two forces that are the same but for what Newton leaves


@dataclass(frozen=True)
class RunCurve:
    """Accepted steps of a run, in the scene's units: arrays ``(n,)`` over the steps."""

    name: str
    scene: Scene
    delta: Array
    P: Array
    p0: Array
    eps: Array
    peeq_max: Array
    folder: Path | None = None

    @cached_property
    def E_star(self) -> float:
        """Contact modulus."""
        return self.scene.E_star

    @property
    def R(self) -> float:
        """Radius of the pin."""
        return self.scene.joint.radius

    @cached_property
    def dR(self) -> float:
        """Clearance."""
        return self.scene.joint.dR

    @cached_property
    def sigY(self) -> float | None:
        """Yield stress of the weaker body; None if neither yields."""
        given = [s.yield_stress for s in (self.scene.pin, self.scene.block) if s.yield_stress is not None]
        return min(given, default=None)

    def loading(self) -> RunCurve:
        """The steps at which the pin is deeper in the hole than ever before; unloading and what it repeats left out.

        A joint that yields comes back from unloading a little deeper and softer, to the first loading's curve only
        beyond: the first step that counts again is one whose P is larger than ever before, too.
        """
        deepest, largest = (np.maximum.accumulate([0.0, *values])[:-1] for values in (self.delta, self.P))
        deeper, stronger = self.delta > deepest * (1 + 1e-9), largest * (1 + _SAME) < self.P
        first, going_on = np.zeros(len(self.delta), dtype=bool), True
        for i in range(len(first)):
            first[i] = going_on = deeper[i] and (going_on or stronger[i])
        curves = {name: getattr(self, name)[first] for name in ("delta", "P", "p0", "eps", "peeq_max")}
        return replace(self, **curves)

    @property
    def plane(self) -> str:
        """Plane of the analysis: "strain" or "stress"."""
        return self.scene.analysis.plane


def read_run(folder: str | Path) -> RunCurve:
    """The curves in the run folder ``folder``. Raises `InputError` if it is not one, or holds no accepted step."""
    folder = Path(folder)
    for name in ("scene.toml", "history.csv"):
        if not (folder / name).is_file():
            raise no_run(folder, name)
    scene = load_scene(folder / "scene.toml")
    try:
        history = read_history(folder / "history.csv")
        delta, P, p0, eps, peeq = [np.array(history[name]) for name in ("delta", "P", "p0", "eps", "peeq_max")]
    except (ValueError, IndexError, KeyError, OSError):
        raise InputError(f"{folder / 'history.csv'}: cannot be read as the history of a run.") from None
    if not np.isfinite([delta, P, p0, eps, peeq]).all():
        raise InputError(f"{folder / 'history.csv'}: holds numbers that are not finite.")
    if not len(delta):
        raise InputError(f"{folder}: holds no accepted step.")
    return RunCurve(str(folder), scene, delta, P, p0, eps, peeq, folder)

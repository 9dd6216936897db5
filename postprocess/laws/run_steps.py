"""What a run knows of P(delta): force over displacement of its joint, or of one load of a general
scene."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.curve import on_first_loading
from archord.postprocess.run import Run
from archord.report.version import VERSION
from archord.scene.errors import InputError
from archord.scene.file import resolved

_OPEN = 1e-6  # of the largest force: nothing touches


@dataclass(frozen=True)
class RunSteps:
    """Accepted steps of a run, ``(n,)``: displacement ``x`` over ``length`` and force ``y`` over
    ``force``, positive where they press, energy ``dissipated`` over both, largest pressure ``peak``
    over ``pressure`` and semi-angle ``angle`` [rad], nan if unknown.

    Units are dR, E* dR and E* dR/R of a joint, else those of the run; forces are of the run's
    thickness, per unit of it if it has none.
    """

    run: Run
    names: tuple[str, str]  # of the columns of displacement and force
    x: Array
    y: Array
    dissipated: Array
    peak: Array
    angle: Array
    length: float
    force: float
    pressure: float

    @property
    def closed(self) -> np.ndarray:
        """Where anything touches."""
        return self.y > _OPEN * self.y.max()

    @property
    def first(self) -> np.ndarray:
        """Indices of the steps that were deeper than all before."""
        return np.flatnonzero(on_first_loading(self.x, self.y))

    def said(self, displacement: float | None = None, force: float | None = None) -> str:
        """A displacement or force of the table with the run's unit."""
        value, name = (displacement, self.names[0]) if force is None else (force, self.names[1])
        scale = self.length if force is None else self.force
        return f"{(value or 0.0) * scale:.6g} {self.run.units.get(name, '')}".rstrip()

    @property
    def units(self) -> dict[str, Any]:
        """Units of x, y and peak as numbers, the names of their units, and the length that forces
        are of, as `JointCurve` has them."""
        length_unit, force_unit = (self.run.units.get(name, "-") for name in self.names)
        numbers = {"length": self.length, "force": self.force, "pressure": self.pressure}
        words = {"length_unit": length_unit, "force_unit": force_unit}
        return numbers | words | {"pin_length": self.run.scene.thickness}

    def require_rising(self, steps: np.ndarray) -> None:
        """Raise `InputError` if the force does not rise from each of the ``steps`` to the next."""
        for a, b in pairwise(steps):
            if not self.y[a] < self.y[b]:
                ends = " to ".join(f"{self.said(self.x[k])} (step {k + 1})" for k in (a, b))
                raise InputError(
                    f"{self.run.folder}: the force does not rise from {ends}, from {self.said(force=self.y[a])} to "
                    f"{self.said(force=self.y[b])}; in a table it must."
                )

    @property
    def accuracy(self) -> float | None:
        """The error of mesh and steps that `analysis.accuracy` estimates of force or displacement,
        over the largest."""
        known = self.run.scene.accurate in self.names
        return (self.run.summary.get("accuracy") or {}).get("estimated") if known else None

    def mesh_error(self, slope: Array) -> Array | float:
        """`accuracy` as an error of y where its slope is ``slope``; 0 if unknown."""
        of_displacement = self.run.scene.accurate == self.names[0]
        return (self.accuracy or 0.0) * (self.x.max() * slope if of_displacement else self.y.max())

    @property
    def about(self) -> dict[str, Any]:
        """What the table is of."""
        run, scene = self.run, self.run.scene
        sha = hashlib.sha256(resolved(scene).encode()).hexdigest()[:16]
        joint = (
            {"R": scene.joint.radius, "dR": scene.joint.dR, "E*": scene.E_star}
            if "P" in run.columns
            else {}
        )
        thick, accuracy = scene.analysis.thickness, self.accuracy
        units = ", ".join(f"{name} in {run.units.get(name, '-')}" for name in self.names)
        said = "unknown: the scene asks for no analysis.accuracy"
        return {
            "title": f"{self.names[1]} over {self.names[0]} of the run {run.folder.resolve().name}",
            "made by": f"archord {VERSION}, fit --table; run of archord {run.summary['versions'].get('archord', '?')}",
            "scene": f"sha256 {sha}; plane {scene.analysis.plane}",
            "units": f"{units}, {'per unit thickness' if thick is None else f'of a thickness of {thick:g}'}",
            **joint,
            "error of mesh and steps": said
            if accuracy is None
            else f"{accuracy:.2g} of the largest (estimated)",
        }


def read_steps(run: Run, of: str | None = None) -> RunSteps:
    """The steps of a joint's ``run``, or of its load ``of``, which need not be named if it is the
    only one; where an interference arises first, from the end of that on. Raises `InputError` of a
    run without a step or contact, or such a load."""
    run.number(None)
    scene, columns = run.scene, {name: np.array(values) for name, values in run.columns.items()}
    columns["unknown"] = np.full(run.steps, np.nan)
    if not run.has_contact:
        raise InputError(f"{run.folder}: has no contact, and a table is of a joint's.")
    if "P" in run.columns:
        if of is not None:
            raise InputError(
                f"{run.folder}: is the run of a joint, which has one load; --of is for general scenes."
            )
        gap = abs(scene.joint.dR)
        units = gap, scene.E_star * gap * scene.thickness, scene.E_star * gap / scene.joint.radius
        known = scene.joint.dR > 0  # or the fit presses without a load
        names, begin = ["delta", "P", *(("p0", "eps") if known else ("unknown", "unknown"))], 0
    else:
        loads = [load.name for load in scene.load]
        if of not in loads and (of or len(loads) > 1):
            raise InputError(f"{run.folder}: --of must name one of its loads: {', '.join(loads)}.")
        of, begin = of or loads[0], scene.path.fit_steps if scene.fits else 0
        alone = len(scene.interaction) == 1 and not scene.fits
        largest = f"{scene.interaction[0].name} largest pressure" if alone else "unknown"
        names, units = [f"{of} displacement", f"{of} force", largest, "unknown"], (1.0, 1.0, 1.0)
    names.append("plastic_dissipation")
    delta, P, peak, angle, lost = (columns[name][begin:] for name in names)
    if begin:  # what an interference does is none of the load's
        was = [columns[name][:begin][-1] for name in names]
        delta, lost = delta - was[0], lost - was[4]
        if abs(was[1]) > _OPEN * np.abs(P).max(initial=0.0):
            raise InputError(
                f"{run.folder}: {names[1]} is {was[1]:.6g} before the load moves; a table begins at 0."
            )
    sign = next((np.sign(d) for d in delta if d), 1.0)
    x, y = sign * delta / units[0], sign * P / units[1]
    return RunSteps(
        run,
        (names[0], names[1]),
        x,
        y,
        lost / (units[0] * units[1]),
        peak / units[2],
        angle,
        *units,
    )

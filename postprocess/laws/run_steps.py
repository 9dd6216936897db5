"""What a run knows of P(delta): force over displacement of its joint, or of one load of a general
scene."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from archord.materials.kinematics import Bools, Ints
from archord.materials.material import Array
from archord.postprocess.curve import on_first_loading
from archord.postprocess.run import Run
from archord.report.by_name import ByName
from archord.report.errors import InputError
from archord.report.version import VERSION
from archord.scene.file import resolved
from archord.scene.parts import turns

_OPEN = 1e-6  # of the largest force: nothing touches


@dataclass(frozen=True)
class RunSteps:
    """Accepted steps of a run. Units are dR, E* dR and E* dR/R of a joint, else the units of the
    run; forces are of the run's thickness, per unit of it if it has none.

    - ``names``: of the columns of displacement and force
    - ``x``, ``y`` ``(n,)``: displacement over ``length`` and force over ``force``, positive where
      they press
    - ``dissipated`` ``(n,)``: energy over both units
    - ``peak`` ``(n,)``: largest pressure over ``pressure``, nan if unknown
    - ``angle`` ``(n,)``: semi-angle [rad], nan if unknown
    - ``begin``: how many steps of the run are before, in which an interference arises
    """

    run: Run
    names: tuple[str, str]
    x: Array
    y: Array
    dissipated: Array
    peak: Array
    angle: Array
    length: float
    force: float
    pressure: float
    begin: int = 0

    @property
    def closed(self) -> Bools:
        """Where anything touches."""
        return self.y > _OPEN * self.y.max()

    @property
    def first(self) -> Ints:
        """Indices of the steps that were deeper than all before."""
        return np.flatnonzero(on_first_loading(self.x, self.y))

    def at(self, x: float) -> str:
        """A displacement of the table with the run's unit."""
        return self._with_unit(x * self.length, self.names[0])

    def load(self, y: float) -> str:
        """A force of the table with the run's unit."""
        return self._with_unit(y * self.force, self.names[1])

    def _with_unit(self, value: float, name: str) -> str:
        return f"{value:.6g} {self.run.units.get(name, '')}".rstrip()

    @property
    def radius(self) -> float | None:
        """The radius of a joint's pin that has clearance; else None."""
        if not _is_of_joint(self.run) or self.run.scene.joint.dR <= 0:
            return None
        return self.run.scene.joint.radius

    @property
    def units(self) -> ByName:
        """Units of x, y and peak as numbers, the names of their units, and the length that forces
        are of, as `JointCurve` has them."""
        length_unit, force_unit = (self.run.units.get(name, "-") for name in self.names)
        return {
            "length": self.length,
            "force": self.force,
            "pressure": self.pressure,
            "length_unit": length_unit,
            "force_unit": force_unit,
            "pin_length": self.pin_length,
            "radius": self.radius,
        }

    @property
    def pin_length(self) -> float:
        """The length of the pin that carries the forces: the thickness of what it lies in; 1 for
        forces per unit length, and in space on an own mesh, which does not tell it."""
        scene = self.run.scene
        shape = None if scene.has_laws else scene.mesh.shape
        if shape is None or shape.space is None:
            return scene.thickness
        return shape.inner.thickness if shape.kind == "clevis" else shape.space.thickness

    def require_rising(self, steps: np.ndarray) -> None:
        """Raise `InputError` if the force does not rise from each of the ``steps`` to the next."""
        for a, b in pairwise(steps):
            if not self.y[a] < self.y[b]:
                before = self.begin + 1
                ends = [f"{self.at(self.x[i])} (step {before + i})" for i in (a, b)]
                raise InputError(
                    self.run.folder,
                    f"the force does not rise from {' to '.join(ends)}, from "
                    f"{self.load(self.y[a])} to {self.load(self.y[b])}; in a table it must.",
                )

    @property
    def accuracy(self) -> float | None:
        """The error of mesh and steps that `analysis.accuracy` estimates of force or displacement,
        over the largest."""
        known = self.run.scene.accurate in self.names
        return (self.run.summary.get("accuracy") or {}).get("estimated") if known else None

    def mesh_error(self, slope: Array) -> Array | float:
        """`accuracy` as an error of y where its slope is ``slope``; 0 if unknown."""
        largest = self.y.max()
        if self.run.scene.accurate == self.names[0]:
            largest = self.x.max() * slope
        return (self.accuracy or 0.0) * largest

    @property
    def about(self) -> ByName:
        """What the table is of."""
        run = self.run
        scene = run.scene
        sha = hashlib.sha256(resolved(scene).encode()).hexdigest()[:16]
        made = run.summary["versions"].get("archord", "?")
        units = ", ".join(f"{name} in {run.units.get(name, '-')}" for name in self.names)
        thick = scene.analysis.thickness
        of = "per unit thickness" if thick is None else f"of a thickness of {thick:g}"
        if scene.analysis.plane == "space":
            of = "of the whole"
        error = "unknown: the scene asks for no analysis.accuracy"
        if self.accuracy is not None:
            error = f"{self.accuracy:.2g} of the largest (estimated)"
        about = {
            "title": f"{self.names[1]} over {self.names[0]} of the run {run.folder.resolve().name}",
            "made by": f"archord {VERSION}, fit --table; run of archord {made}",
            "scene": f"sha256 {sha}; plane {scene.analysis.plane}",
            "units": f"{units}, {of}",
        }
        if _is_of_joint(run):
            about |= {"R": scene.joint.radius, "dR": scene.joint.dR, "E*": scene.E_star}
        return about | {"error of mesh and steps": error}


def read_steps(run: Run, of: str | None = None) -> RunSteps:
    """The steps of a joint's ``run``, or of its load ``of``, which need not be named if it is the
    only one; where an interference arises first, from the end of that on. Raises `InputError` of a
    run without a step or contact, or such a load."""
    run.number(None)
    if not run.has_contact:
        raise InputError(run.folder, "has no contact, and a table is of a joint's.")
    if run.scene.analysis.plane == "axisymmetric":
        raise InputError(
            run.folder,
            "is of a body of revolution, whose forces are of the whole ring; a "
            "table has forces per length of a pin. history.csv has force over displacement.",
        )
    begin = 0  # steps before the load moves
    length = force = pressure = 1.0
    if _is_of_joint(run):
        if of is not None:
            raise InputError(
                run.folder, "is the run of a joint, which has one load; --of is for general scenes."
            )
        scene = run.scene
        length = abs(scene.joint.dR)
        force = scene.E_star * length * scene.thickness
        pressure = scene.E_star * length / scene.joint.radius
        names = ["delta", "P"]
        if scene.joint.dR > 0:  # a fit presses without a load
            names += ["p0", "eps"]
    else:
        begin = run.scene.path.fit_steps if run.scene.fits else 0
        names = _columns_of_load(run, of)
    values = [np.array(run.columns[name]) for name in [*names, "plastic_dissipation"]]
    if begin:  # what an interference does is none of the load's
        before, after = zip(
            *((column[begin - 1], column[begin:]) for column in values), strict=True
        )
        if abs(before[1]) > _OPEN * np.abs(after[1]).max(initial=0.0):
            raise InputError(
                run.folder,
                f"{names[1]} is {before[1]:.6g} before the load moves; a table begins at 0.",
            )
        values = [after[0] - before[0], *after[1:-1], after[-1] - before[-1]]
    delta, P, *told, lost = values
    unknown = np.full(len(delta), np.nan)
    peak, angle = [*told, unknown, unknown][:2]
    # a joint's load presses where it is positive, whatever comes first
    sign = 1.0 if _is_of_joint(run) else next((np.sign(d) for d in delta if d), 1.0)
    return RunSteps(
        run=run,
        names=(names[0], names[1]),
        x=sign * delta / length,
        y=sign * P / force,
        dissipated=lost / (length * force),
        peak=peak / pressure,
        angle=angle,
        length=length,
        force=force,
        pressure=pressure,
        begin=begin,
    )


def _is_of_joint(run: Run) -> bool:
    """Whether the run is of a joint in a plane, not of loads by name."""
    return run.scene.has_laws


def _columns_of_load(run: Run, of: str | None) -> list[str]:
    """The columns of displacement and force of the load ``of``, and of the pressure of its only
    interaction."""
    scene = run.scene
    loads = [load.name for load in scene.load]
    if of not in loads and (of or len(loads) > 1):
        raise InputError(run.folder, f"--of must name one of its loads: {', '.join(loads)}.")
    of = of or loads[0]
    load = next(load for load in scene.load if load.name == of)
    other = ""
    if load.kind == "pressure":
        other = "a pressure over a volume that it displaces"
    elif turns(load.direction):
        other = "a moment over an angle"
    if other:
        said = f"{of!r} is {other}; a table has forces per length of a pin. history.csv has it"
        raise InputError(run.folder, f"{said}.")
    names = [f"{of} displacement", f"{of} force"]
    if len(scene.interaction) == 1 and not scene.fits:
        names.append(f"{scene.interaction[0].name} largest pressure")
    return names

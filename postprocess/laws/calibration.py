"""Calibration of the plastic-Winkler law on runs, each alone and all together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from archord.postprocess.convergence import Refined, group
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.curve_fit import CurveFit, fit_curve
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.joint import LawJoint
from archord.scene.errors import InputError

_LIKE = 0.01  # share of P by which the blocks of runs of one fit may change it


@dataclass(frozen=True)
class Calibration:
    """Fits to P(delta) of each run, and the one to all ``scenes`` together, each on its finest mesh."""

    each: tuple[CurveFit, ...]
    joint: CurveFit
    scenes: tuple[Refined, ...]

    def law(self) -> FittedLaw:
        """The law for the joint of the first scene, with k and c of all scenes."""
        run, found, parts = self.scenes[0].run, self.joint.estimates, self.joint.residuals
        numbers: dict[str, Any] = {name: getattr(run, name) for name in ("E_star", "R", "dR", "plane")}
        if not run.sigY:
            found.pop("c", None)
        for name, estimate in found.items():
            numbers |= {name: estimate.value, f"{name}_error": estimate.error}
        loads, units = np.concatenate([part.load for part in parts]), run.scene.units
        numbers |= {"sigY": run.sigY if "c" in found else None, "fitted_to": tuple(part.name for part in parts)}
        numbers |= {"length_unit": units.length, "force_unit": units.force_of(None)}
        return FittedLaw(**numbers, fitted_range=(float(loads.min()), float(loads.max())))


def calibrate(runs: list[RunCurve], load_range: tuple[float, float] = (0.0, np.inf)) -> Calibration:
    """Fit the law to each of ``runs`` and to all scenes together, over ``load_range`` of ``delta/dR``; of runs of one
    scene on several meshes, which give the error of the mesh, the finest. Raises `InputError` where the range, the
    steps or the runs do not allow a fit."""
    low, high = load_range
    if not 0 <= low < high:
        raise InputError(f"--range {low:g} {high:g}: must be two displacements in clearances, 0 or more and rising.")
    check_compatible(runs)
    scenes = group(runs)
    finest = {id(scene.run): scene for scene in scenes}
    each = tuple(fit_curve([finest.get(id(run), Refined(run))], load_range) for run in runs)
    return Calibration(each, fit_curve(scenes, load_range), tuple(scenes))


def check_compatible(runs: list[RunCurve]) -> None:
    """Raise `InputError` for runs that have no such law, or none in common."""
    for run in runs:
        if not run.scene.joint.is_block:
            model = run.scene.joint.model
            raise InputError(f'{run.name}: joint.model = "{model}" has no law to fit; only "block" has.')
        for body, solid in (("pin", run.scene.pin), ("block", run.scene.block)):
            if not solid.perfectly_plastic:
                said = f" = {solid.hardening:g}" if isinstance(solid.hardening, float) and solid.hardening else ""
                raise InputError(f"{run.name}: {body}.hardening{said} does not fit: the law is for perfect plasticity, "
                                 "hardening = 0.")  # fmt: skip
    first = runs[0]
    for run in runs[1:]:
        own, wanted = (LawJoint.from_scene(each.scene) for each in (run, first))
        ours, theirs = ((joint.dundurs_alpha, joint.nu or 0.0, joint.pin_nu or 0.0) for joint in (own, wanted))
        softer, fault = abs(own.softer[0] - wanted.softer[0]), ""
        if own.plane != wanted.plane:
            fault = f"analysis.plane = {run.plane!r} does not fit: {first.name} is in plane {first.plane}"
        elif not np.allclose(ours, theirs, rtol=1e-6, atol=1e-9):
            fault = f"the Poisson's ratios or the ratio of the moduli are not those of {first.name}"
        elif own.whole != wanted.whole:
            fault = f"pin.whole = {str(own.whole).lower()} does not fit: {first.name} has the other"
        elif softer > _LIKE:
            sizes = [f"{each.scene.joint.W / each.R:.4g} R" for each in (run, first)]
            fault = (f"joint.block_size is {sizes[0]} and that of {first.name} {sizes[1]}, by which their P differs by "
                     f"about {softer:.1%}")  # fmt: skip
        if fault:
            raise InputError(f"{run.name}: {fault}; one law is for one kind of joint: fit them separately.")

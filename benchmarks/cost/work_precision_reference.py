"""The values that errors are measured against: ``archord benchmark work-precision --reference``.

For each case and kinematics two families of meshes (`archord.benchmarks.cost.work_precision_cases.families`), which
refine near and far elements in different shares, are extrapolated, each by itself. The value is their mean; the stated
error is what the two differ by or, if that is more, how far an extrapolation moves when one of its meshes is left out.

The pressures on single facets scatter with how the facets of both sides meet, by 0.5 %, on fine meshes as on coarse
ones: so the profile is the mean of the finest meshes, smoothed; its error is the largest L2 difference between the two
families, each smoothed by itself, and between this and twice as many terms.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from archord.benchmarks.case import Case
from archord.benchmarks.cost.work_precision_cases import CASES, JointCase, Kinematics, Series, families
from archord.geometry.basis import Array
from archord.output.history import read_history
from archord.postprocess.arc import SIDES, read_arcs
from archord.postprocess.convergence import extrapolated
from archord.postprocess.curve import read_run
from archord.presets.arc import ArcProfile

FILE = Path(__file__).with_name("work_precision_reference.json")
COLUMNS = {"P": "P/(E* R)", "p0": "p0/E*", "eps": "eps", "dissipation": "plastic_dissipation/(E* R2)"}  # of history.csv
ANGLES = np.linspace(0.0, np.pi / 2, 401)  # of pressure profiles, from the contact axis
_FINEST = 3  # meshes of each family whose profiles are taken
_TERMS = {"elastic": 6, "plastic": 10}  # of the smoothed profile


@dataclass(frozen=True)
class Reference:
    """Values of a case and their relative errors by quantity; ``profile`` by side, ``(401,)`` at `ANGLES`."""

    values: dict[str, float]
    errors: dict[str, float]
    profile: dict[str, Array]


def stored() -> dict[str, dict[str, Any]]:
    """All that the file says of the references, by case and kinematics: quantities, extrapolations, runs."""
    return json.loads(FILE.read_text(encoding="utf-8"))["cases"] if FILE.exists() else {}


def read_reference(case: str, kinematics: Kinematics = "current") -> Reference:
    """The stored values."""
    data = stored()[case][kinematics]
    values, errors = ({name: q[key] for name, q in data["quantities"].items()} for key in ("value", "error"))
    profile = {side: np.array(pressures) for side, pressures in data.get("profile", {}).items()}
    return Reference(values, errors, profile | {"both": _mean(profile)} if profile else {})


def _mean(profile: dict[str, Array]) -> Array:
    """The pressure at an angle, of which the unbiased contact integrates one half on either side."""
    return np.mean(list(profile.values()), axis=0)


def values_of(folder: Path, case: JointCase) -> dict[str, float]:
    """The quantities that ``case`` is judged by, at a run's last step."""
    history = read_history(folder / "history.csv")
    return {name: history[column][-1] for name, column in COLUMNS.items() if name in case.quantities}


def profile_of(folder: Path) -> dict[str, Array]:
    """The pressure ``(401,)`` at `ANGLES` by side, and of "both", at a run's last step."""
    run = read_run(folder)
    arcs = read_arcs(run, len(run.delta))
    sides = {side: sampled(arcs[side]) for side in SIDES if side in arcs}
    return sides | {"both": _mean(sides)}


def compute(
    case: JointCase, kinematics: Kinematics, folder: Path, said: Callable[[str], None] = lambda sentence: None
) -> None:
    """Solve both families of ``case`` below ``folder`` (what is done there already is taken) and store the result.

    Raises RuntimeError if a run does not get to its end.
    """
    chosen = families(case)
    runs = [_solve(case, kinematics, series, folder, said) for series in chosen]
    entry: dict[str, Any] = {
        "quantities": {
            quantity: combined([[(r["element_size"], r[quantity]) for r in found] for found in runs])
            for quantity in COLUMNS
            if quantity in case.quantities
        },
        "families": [{"name": series.name, "runs": found} for series, found in zip(chosen, runs, strict=True)],
    }
    samples = [[profile_of(folder / r["folder"]) for r in found[-_FINEST:]] for found in runs]
    profile, apart = smooth_profile(samples, _TERMS[case.name])
    entry["quantities"]["profile"] = {"value": 0.0, "error": apart}
    if kinematics == "current":
        entry["profile"] = {side: [float(f"{p:.7g}") for p in values] for side, values in profile.items()}
    everything = stored()
    # Fixed pairs can be chosen with either side's normals, which is a difference of the order of (dR/R)^2: another
    # code's choice, which the file holds, tells how much of the value depends on that.
    if independent := everything.get(case.name, {}).get(kinematics, {}).get("independent"):
        entry["independent"], force = independent, entry["quantities"]["P"]
        if independent["another choice of pairs"]:
            force["error"] = max(force["error"], abs(independent["P"] / force["value"] - 1))
    everything.setdefault(case.name, {})[kinematics] = entry
    ordered = {name: everything[name] for name in CASES if name in everything}
    text = json.dumps({"angles": f"{len(ANGLES)} equal ones from 0 to pi/2", "cases": ordered}, indent=1)
    # one line for each list of numbers
    text = re.sub(r"\[[^][{}]*\]", lambda numbers: json.dumps(json.loads(numbers[0])), text)
    FILE.write_text(text + "\n", encoding="utf-8")


def smooth_profile(families: list[list[dict[str, Array]]], terms: int) -> tuple[dict[str, Array], float]:
    """The profile by side and its relative L2 error from the profiles of each family's meshes."""
    profile, apart = {}, 0.0
    for side in families[0][0]:
        means = [np.mean([sample[side] for sample in family], axis=0) for family in families]
        everything = np.mean(means, axis=0)
        profile[side] = smoothed(everything, terms)
        first, second = (smoothed(mean, terms) for mean in means)
        rougher = smoothed(everything, 2 * terms)
        apart = max(apart, profile_error(first, second), profile_error(rougher, profile[side]))
    return profile, apart


def combined(found: list[list[tuple[float, float]]]) -> dict[str, Any]:
    """Value and relative error from the pairs (element size, value) of each family."""
    limits = [extrapolated(*zip(*pairs, strict=True)) for pairs in found]
    value = float(np.mean([limit.value for limit in limits]))
    error = max([float(np.ptp([limit.value for limit in limits])), *(limit.error for limit in limits)])
    extrapolations = [{"value": limit.value, "order": limit.order, "moves by": limit.error} for limit in limits]
    return {"value": value, "error": error / abs(value), "extrapolations": extrapolations}


def _solve(
    joint: JointCase, kinematics: Kinematics, series: Series, folder: Path, said: Callable[[str], None]
) -> list[dict[str, Any]]:
    """What the file holds of the run on each mesh of ``series``."""
    found = []
    for mesh in series.meshes:
        scene = joint.scene(mesh, kinematics)
        g = scene.joint
        case = Case(f"{joint.name}_{kinematics}_{g.h:g}_{g.growth:g}", scene)
        if not case.is_done(folder):
            case.solve(folder)
        run = case.folder(folder)
        report = json.loads((run / "run.json").read_text(encoding="utf-8"))
        values, dofs = values_of(run, joint), report["mesh"]["dofs"]
        found.append({"element_size": g.h, "growth": g.growth, "dofs": dofs, **values, "folder": run.name})
        said(f"{run.name}: {dofs} dofs, {values}, {report['seconds']['total']:.0f} s")
    return found


def sampled(arc: ArcProfile) -> Array:
    """Pressure ``(401,)`` of a run's side at `ANGLES`: linear between the points that contact.h5 holds."""
    order = np.argsort(arc.angle, axis=None)
    return interpolated(arc.angle.ravel()[order], arc.pressure.ravel()[order])


def interpolated(angle: Array, pressure: Array) -> Array:
    """Pressure ``(401,)`` at `ANGLES` of one known at growing angles ``(n,)``; constant beyond the ends."""
    return np.interp(ANGLES, angle, pressure)


def profile_error(pressure: Array, reference: Array) -> float:
    """Relative L2 difference over the arc, ``sqrt(int (p - p_ref)^2 / int p_ref^2)``; both ``(401,)`` at `ANGLES`."""
    difference = np.trapezoid((pressure - reference) ** 2, ANGLES)
    return float(np.sqrt(difference / np.trapezoid(reference**2, ANGLES)))


def smoothed(pressure: Array, terms: int) -> Array:
    """``pressure`` ``(401,)`` at `ANGLES` without the scatter from facet to facet, by least squares.

    The fit is ``sqrt(1 - x^2)`` times an even polynomial of ``terms`` coefficients in ``x = angle/edge``, the form of a
    contact pressure with an elastic edge, the edge itself free; zero beyond it. Raises ValueError where nothing is
    pressed.
    """
    pressed = np.flatnonzero(pressure > 0)
    if len(pressed) <= terms:
        raise ValueError("a profile to be smoothed must be pressed at more angles than there are terms")
    guess = float(ANGLES[pressed[-1]])

    def misfit(edge: float) -> float:
        return float(np.sum((_fit(pressure, edge, terms) - pressure) ** 2))

    # the last angle that is pressed may be anywhere within the last facet
    best = min(np.linspace(0.97, 1.03, 61) * guess, key=misfit)
    found = minimize_scalar(misfit, bounds=(best - 1e-3 * guess, best + 1e-3 * guess), method="bounded")
    return _fit(pressure, float(found.x), terms)


def _fit(pressure: Array, edge: float, terms: int) -> Array:
    inside = edge > ANGLES
    x = ANGLES[inside] / edge
    # Chebyshev polynomials of even degree: powers would be ill-conditioned
    A = np.stack([np.sqrt(1 - x**2) * np.cos(2 * k * np.arccos(x)) for k in range(terms)], axis=1)
    fit = np.zeros_like(ANGLES)
    fit[inside] = A @ np.linalg.lstsq(A, pressure[inside], rcond=None)[0]
    return fit

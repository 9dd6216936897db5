"""Runs against the first of them: P, p0 and eps at common displacements, and what differs in their scenes.

Runs that were led through the same displacements are compared step by step, unloading included. Of others the first
loading counts, the steps before the pin first goes back, at those displacements of the first run that all reach;
between their steps the others are interpolated by monotone cubics (Fritsch and Carlson 1980).
"""

from __future__ import annotations

import json
import os
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.materials.material import Array
from archord.postprocess.curve import RunCurve, gap_name
from archord.postprocess.run import Run
from archord.scene.errors import InputError
from archord.scene.file import resolved
from archord.scene.scene import Scene

_SAME = 1e-9  # relative difference up to which displacements, or sizes of the joint, are the same
_NOTHING = 1e-9  # part of the largest value below which a relative difference says nothing


@dataclass(frozen=True)
class Compared:
    """One quantity of ``r`` runs at ``n`` common loads."""

    quantity: str
    unit: str
    load_name: str  # "delta [mm]" or "delta/dR"
    load: Array  # (n,)
    values: Array  # (r, n)
    interpolated: np.ndarray  # (r, n) whether the value lies between steps

    @property
    def relative(self) -> Array:
        """``value/first - 1`` ``(r, n)``; NaN where the first is nothing beside its largest value and the other is
        not."""
        first = self.values[0]
        scale = _NOTHING * np.abs(self.values).max(initial=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = (self.values - first) / np.abs(first)
        nothing = np.abs(first) <= scale
        relative[:, nothing] = np.where(np.abs(self.values[:, nothing] - first[nothing]) <= scale, 0.0, np.nan)
        return relative

    @property
    def largest(self) -> Array:
        """Largest size ``(r,)`` of the relative difference."""
        relative = np.abs(self.relative)
        return np.array([np.nanmax(row) if np.isfinite(row).any() else np.nan for row in relative])


@dataclass(frozen=True)
class Comparison:
    """Runs and their ``names``; ``absolute`` is empty where their units differ, ``dimensionless`` where R, dR and E*
    are the same."""

    runs: list[Run]
    names: list[str]
    step_by_step: bool
    absolute: list[Compared]
    dimensionless: list[Compared]

    @property
    def compared(self) -> list[Compared]:
        """All quantities."""
        return self.absolute + self.dimensionless


def compare_runs(runs: list[Run]) -> Comparison:
    """Compare ``runs`` with the first. Raises `InputError` for fewer than two, one without steps, or no common load."""
    if len(runs) < 2:
        raise InputError("compare: needs two runs or more.")
    curves = [run.curve for run in runs]
    step_by_step = _alike(curves)
    scenes = [run.scene for run in runs]
    absolute = _quantities(curves, False, step_by_step) if same_units(scenes) else []
    dimensionless = [] if same_size(scenes) else _quantities(curves, True, step_by_step)
    if not absolute and not dimensionless:
        raise InputError(f"{runs[0].folder}: shares no range of displacements with the others.")
    return Comparison(runs, short_names([run.folder for run in runs]), step_by_step, absolute, dimensionless)


def same_units(scenes: list[Scene]) -> bool:
    """Whether all ``scenes`` have the same units."""
    return len({(scene.units.length, scene.units.stress) for scene in scenes}) == 1


def same_size(scenes: list[Scene]) -> bool:
    """Whether all ``scenes`` have the same units, R, dR and E*."""
    sizes = np.array([[scene.joint.radius, scene.joint.dR, scene.E_star] for scene in scenes])
    return same_units(scenes) and np.allclose(sizes, sizes[0], rtol=_SAME, atol=0)


def _alike(curves: list[RunCurve]) -> bool:
    """Whether all runs have the same displacements over the clearance."""
    loads = [scaled(curve, "delta", True) for curve in curves]
    return all(len(load) == len(loads[0]) and np.allclose(load, loads[0], rtol=_SAME, atol=_SAME) for load in loads)


def scaled(curve: RunCurve, name: str, dimensionless: bool) -> Array:
    """A quantity of the ``curve``, or "delta", ``(n,)``; ``dimensionless`` over powers of E*, R and the clearance."""
    gap = abs(curve.dR)
    scale = {"delta": gap, "P": curve.E_star * gap, "p0": curve.E_star * gap / curve.R, "eps": 1.0}
    return getattr(curve, name) / (scale[name] if dimensionless else 1.0)


def _quantities(curves: list[RunCurve], dimensionless: bool, step_by_step: bool) -> list[Compared]:
    units, same_gap = curves[0].scene.units, np.ptp([c.dR for c in curves]) <= _SAME * abs(curves[0].dR)
    whole = step_by_step and (dimensionless or same_gap)
    parts = curves if whole else [c.first_loading() for c in curves]
    loads = [scaled(part, "delta", dimensionless) for part in parts]
    load = loads[0] if whole else _common(loads)
    if not len(load):
        return []
    gap = gap_name(min(c.dR for c in curves))
    named = {"P": ("P", units.force), "p0": ("p0", units.stress), "eps": ("eps", "rad")}
    load_name = f"delta [{units.length}]"
    if dimensionless:
        named |= {"P": (f"P/(E* {gap})", ""), "p0": (f"p0 R/(E* {gap})", "")}
        load_name = f"delta/{gap}"
    found = []
    for name, (shown, unit) in named.items():
        curves_of = [scaled(part, name, dimensionless) for part in parts]
        pairs = [
            (y, np.zeros(len(y), dtype=bool)) if whole else _at(load, x, y)
            for x, y in zip(loads, curves_of, strict=True)
        ]
        values, between = (np.array(both) for both in zip(*pairs, strict=True))
        found.append(Compared(shown, unit, load_name, load, values, between))
    return found


def _common(loads: list[Array]) -> Array:
    """Loads of the first run within the range of all."""
    low, high = max(x[0] for x in loads), min(x[-1] for x in loads)
    margin = _SAME * abs(high)
    return loads[0][(loads[0] >= low - margin) & (loads[0] <= high + margin)]


def _at(load: Array, x: Array, y: Array) -> tuple[Array, np.ndarray]:
    """``y(x)`` at ``load`` ``(n,)``, and where that lies between the ``x``."""
    nearest = np.abs(load[:, None] - x).argmin(axis=1)
    between = ~np.isclose(x[nearest], load, rtol=_SAME, atol=0)
    value = y[nearest].astype(float)
    if between.any():
        from scipy.interpolate import PchipInterpolator

        value[between] = PchipInterpolator(x, y)(load[between])
    return value, between


def short_names(folders: list[Path]) -> list[str]:
    """Names of the folders without what all paths begin with; numbered where two are the same."""
    paths = [Path(os.path.abspath(folder)) for folder in folders]
    parents = [path.parent.parts for path in paths]
    n = len(os.path.commonprefix(parents)) if len(set(paths)) > 1 else len(parents[0])
    names = [str(Path(*path.parts[n:])) for path in paths]
    count = [names[: k + 1].count(name) for k, name in enumerate(names)]
    return [name if names.count(name) == 1 else f"{name} ({n})" for name, n in zip(names, count, strict=True)]


def _scene_keys(scene: Scene) -> dict[str, Any]:
    """Every key of the resolved scene by its dotted name."""
    found: dict[str, Any] = {}
    for section, keys in tomllib.loads(resolved(scene)).items():
        found |= {f"{section}.{k}": v for k, v in keys.items()} if isinstance(keys, dict) else {section: keys}
    return found


def differing_keys(scenes: list[Scene]) -> dict[str, list[str]]:
    """Keys in which the ``scenes`` differ, and their values as TOML writes them; empty where a scene has none."""
    tables = [_scene_keys(scene) for scene in scenes]
    names = list(dict.fromkeys(name for table in tables for name in table))
    rows = {name: [json.dumps(t[name], ensure_ascii=False) if name in t else "" for t in tables] for name in names}
    return {name: values for name, values in rows.items() if len(set(values)) > 1}

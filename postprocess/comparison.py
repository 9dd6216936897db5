"""Runs against the first of them: P, p0 and eps at common displacements, and what differs in their scenes.

Runs that were led through the same displacements are compared step by step, unloading included. Of others the first
loading counts, the steps before the pin first goes back, at those displacements of the first run that all reach;
between their steps the others are interpolated by monotone cubics (Fritsch and Carlson 1980).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from archord.materials.material import Array
from archord.postprocess.curve import RunCurve, gap_name
from archord.postprocess.run import Run
from archord.scene.errors import InputError
from archord.scene.file import scene_keys
from archord.scene.scene import Scene

COMPARED = ("P", "p0", "eps")
_SAME = 1e-9  # relative difference up to which displacements, or sizes of the joint, are the same
_NOTHING = 1e-9  # part of the largest value below which a relative difference says nothing


@dataclass(frozen=True)
class Comparison:
    """``r`` runs at ``n`` common displacements, in the form of `comparable`."""

    runs: list[Run]
    labels: dict[str, str]  # of "delta", or the load factor, and of the quantities: `COMPARED`, of a joint
    step_by_step: bool
    delta: Array  # (n,)
    values: dict[str, Array]  # (r, n)
    interpolated: np.ndarray  # (r, n) whether the values lie between steps

    def relative(self, name: str) -> Array:
        """``value/first - 1`` ``(r, n)``; NaN where the first is nothing beside its largest value and the other is
        not."""
        values = self.values[name]
        first, nothing = values[0], _NOTHING * np.abs(values).max(initial=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = (values - first) / np.abs(first)
        unknown = np.where(np.abs(values - first) <= nothing, 0.0, np.nan)
        return np.where(np.abs(first) > nothing, relative, unknown)


def compare_runs(runs: list[Run]) -> Comparison:
    """Compare ``runs`` with the first. Raises `InputError` for fewer than two, one without steps, or no common load."""
    if len(runs) < 2:
        raise InputError("compare: needs two runs or more.")
    if not any(run.is_joint for run in runs):
        return _of_problems(runs)
    curves, labels, _ = comparable(runs)
    delta = curves[0].delta
    margin = _SAME * np.abs(delta).max()
    step_by_step = all(len(c.delta) == len(delta) and np.allclose(c.delta, delta, rtol=0, atol=margin) for c in curves)
    between: np.ndarray = np.zeros((len(runs), len(delta)), dtype=bool)
    if not step_by_step:
        curves = [curve.first_loading() for curve in curves]
        low, high = max(c.delta[0] for c in curves), min(c.delta[-1] for c in curves)
        delta = curves[0].delta
        delta = delta[(delta >= low - margin) & (delta <= high + margin)]
        if not len(delta):
            raise InputError(f"{runs[0].folder}: shares no range of displacements with the others.")
        between = np.array([np.abs(delta[:, None] - c.delta).min(axis=1) > margin for c in curves])
        curves = [_at(delta, curve, k) for curve, k in zip(curves, between, strict=True)]
    values = {name: np.array([getattr(curve, name) for curve in curves]) for name in COMPARED}
    return Comparison(runs, labels, step_by_step, delta, values, between)


def _of_problems(runs: list[Run]) -> Comparison:
    """Forces, largest pressures and PEEQ that all ``runs`` of general scenes have, at load factors of the first."""
    from scipy.interpolate import PchipInterpolator

    for run in runs:
        run.number(None)
        if (run.scene.units, run.force_unit) != (runs[0].scene.units, runs[0].force_unit):
            raise InputError(f"{run.folder}: has other units, or another unit of force, than {runs[0].folder}.")
    paths = [np.array(run.path) for run in runs]
    low, high = (ends(path[end] for path in paths) for ends, end in ((max, 0), (min, -1)))
    at = paths[0][(paths[0] >= low - _SAME) & (paths[0] <= high + _SAME)]
    units, ends = runs[0].history.attrs["units"], (" force", " largest pressure", " peeq_max")
    names = [n for n in runs[0].columns if n.endswith(ends) and all(n in run.columns for run in runs)]
    if not len(at) or not names:
        raise InputError(f"{runs[0].folder}: shares no range of load factors, or no load, with the others.")
    between = np.array([np.abs(at[:, None] - path).min(axis=1) > _SAME for path in paths])
    values: dict[str, Array] = {name: np.empty((len(runs), len(at))) for name in names}
    for k, (run, path) in enumerate(zip(runs, paths, strict=True)):
        for name in names:
            table = np.array(run.columns[name])
            values[name][k] = table[np.abs(at[:, None] - path).argmin(axis=1)]
            if between[k].any():
                values[name][k, between[k]] = PchipInterpolator(path, table)(at[between[k]])
    labels = {"delta": "load factor"} | {n: f"{n} [{units[n]}]" if n in units else n for n in names}
    return Comparison(runs, labels, not between.any(), at, values, between)


def _at(delta: Array, curve: RunCurve, between: np.ndarray) -> RunCurve:
    """The ``curve`` at ``delta`` ``(n,)``; interpolated where that lies ``between`` its steps."""
    found = curve.at(np.abs(delta[:, None] - curve.delta).argmin(axis=1))
    if between.any():
        from scipy.interpolate import PchipInterpolator

        for name in COMPARED:
            getattr(found, name)[between] = PchipInterpolator(curve.delta, getattr(curve, name))(delta[between])
    return found


def comparable(runs: Sequence[Run]) -> tuple[list[RunCurve], dict[str, str], list[float]]:
    """The curves of ``runs``, the labels of their quantities, and what pressures are divided by: as they are where the
    units, R, dR and E* of all are the same, else over powers of E*, R and the clearance."""
    curves, units = [run.curve for run in runs], [run.scene.units for run in runs]
    sizes = np.array([[curve.R, curve.dR, curve.E_star] for curve in curves])
    if all(unit == units[0] for unit in units) and np.allclose(sizes, sizes[0], rtol=_SAME, atol=0):
        named = {"delta": units[0].length, "P": units[0].force, "p0": units[0].stress, "eps": "rad"}
        return curves, {name: f"{name} [{unit}]" for name, unit in named.items()}, [1.0] * len(runs)
    gap = gap_name(min(curve.dR for curve in curves))
    labels = {"delta": f"delta/{gap}", "P": f"P/(E* {gap})", "p0": f"p0 R/(E* {gap})", "eps": "eps [rad]"}
    scales = [c.E_star * abs(c.dR) / c.R for c in curves]
    scaled = [
        replace(c, delta=c.delta / abs(c.dR), P=c.P / (p * c.R), p0=c.p0 / p)
        for c, p in zip(curves, scales, strict=True)
    ]
    return scaled, labels, scales


def differing_keys(scenes: Sequence[Scene]) -> dict[str, list[str]]:
    """Keys in which the ``scenes`` differ, and their values as TOML writes them; empty where a scene has none."""
    tables = [scene_keys(scene) for scene in scenes]
    names = list(dict.fromkeys(name for table in tables for name in table))
    rows = {name: [json.dumps(t[name], ensure_ascii=False) if name in t else "" for t in tables] for name in names}
    return {name: values for name, values in rows.items() if len(set(values)) > 1}

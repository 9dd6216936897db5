"""Runs against the first of them: their curves at common loads, and what differs in their scenes.

Of joints P, p0 and eps over the displacement, or where forces load all of them delta, p0 and eps
over the force; of general runs the quantities that all of them have over the load factor. Runs that
were led through the same loads are compared step by step, unloading included. Of others the first
loading counts, the steps before the pin first goes back, at those loads of the first run that all
reach; between their steps the others are interpolated by monotone cubics (Fritsch and Carlson
1980).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from archord.materials.kinematics import Bools
from archord.materials.material import Array, Arrays
from archord.postprocess.curve import first_loading, gap_name
from archord.postprocess.run import Run
from archord.report.by_name import Words
from archord.report.errors import InputError
from archord.scene.file import scene_keys

COMPARED = ("P", "p0", "eps")
COMMON = (
    " force",
    " displacement",
    " largest pressure",
    " peeq_max",
)  # ends of what general runs are compared by
_SAME = 1e-9  # relative difference up to which loads, or sizes of the joint, are the same
_NOTHING = 1e-9  # part of the largest value below which a relative difference says nothing


@dataclass(frozen=True)
class Comparison:
    """``r`` runs at ``n`` common loads. Of general runs these are load factors, at which the loads
    ``unlike`` have other values from run to run."""

    runs: list[Run]
    labels: Words  # of "load" and of the quantities
    step_by_step: bool
    load: Array  # (n,)
    values: Arrays  # (r, n)
    interpolated: Bools  # (r, n) whether the values lie between steps
    unlike: Sequence[str] = ()

    def relative(self, name: str) -> Array:
        """``value/first - 1`` ``(r, n)``; NaN where the first is nothing beside its largest value
        and the other is not."""
        values = self.values[name]
        first = values[0]
        nothing = _NOTHING * np.abs(values).max(initial=0.0)
        difference = values - first
        with np.errstate(divide="ignore", invalid="ignore"):
            relative = values / first - 1
        unknown = np.where(np.abs(difference) <= nothing, 0.0, np.nan)
        return np.where(np.abs(first) > nothing, relative, unknown)


def compare_runs(runs: list[Run]) -> Comparison:
    """Compare ``runs`` with the first. Raises `InputError` for fewer than two, one without steps,
    or no common load."""
    if len(runs) < 2:
        raise InputError("compare: needs two runs or more.")
    tables, labels, _ = curves_of(runs)
    load = tables[0]["load"]
    margin = _SAME * np.abs(load).max()
    step_by_step = all(_same_loads(table["load"], load, margin) for table in tables)
    between = np.zeros((len(runs), len(load)), dtype=bool)
    if not step_by_step:
        tables = [_on_first_loading(table) for table in tables]
        load = _shared_loads([table["load"] for table in tables], margin)
        if not len(load):
            raise InputError(runs[0].folder, "shares no range of loads with the others.")
        distances = [np.abs(load[:, None] - table["load"]).min(axis=1) for table in tables]
        between = np.array(distances) > margin
        tables = [_at(load, table, k) for table, k in zip(tables, between, strict=True)]
    names = [name for name in labels if name != "load"]
    values = {name: np.array([table[name] for table in tables]) for name in names}
    return Comparison(runs, labels, step_by_step, load, values, between, _unlike(runs, load))


def _unlike(runs: Sequence[Run], factor: Array) -> list[str]:
    """The loads of general ``runs`` that are not the same in all of them at the load factors
    ``(n,)``."""
    scenes = [run.scene for run in runs]
    if any(scene.has_laws for scene in scenes):
        return []
    fitted = {scene.fits for scene in scenes}
    found = []
    for load in scenes[0].load:
        told = []
        for scene in scenes:
            before = float(scene.fits and len(fitted) > 1)
            known = [own for own in scene.load if (own.name, own.kind) == (load.name, load.kind)]
            values = [scene.values(own) for own in known]
            told += [np.interp(factor + before, range(len(each)), each) for each in values]
        margin = _SAME * np.abs(told).max(initial=0.0)
        if len(told) < len(runs) or np.ptp(told, axis=0).max() > margin:
            found.append(load.name)
    return found


def _same_loads(one: Array, other: Array, margin: float) -> bool:
    return len(one) == len(other) and np.allclose(one, other, rtol=0, atol=margin)


def _shared_loads(loads: list[Array], margin: float) -> Array:
    """The first of the rising ``loads`` where all others reach them."""
    low = max(load[0] for load in loads) - margin
    high = min(load[-1] for load in loads) + margin
    first = loads[0]
    return first[(first >= low) & (first <= high)]


def _on_first_loading(table: Arrays) -> Arrays:
    first = first_loading(table["load"])
    return {name: values[first] for name, values in table.items()}


Curves = tuple[list[Arrays], Words, Array]


def curves_of(runs: Sequence[Run]) -> Curves:
    """What is compared of each run over its "load", ``(n,)`` by name; their labels; and what
    pressures are divided by.

    Of joints P (delta, where forces load all of them), p0 and eps, as they are where the units, R,
    dR and E* of all are the same, else over powers of E*, R and the clearance. Raises `InputError`
    for general runs without a common quantity or unit.
    """
    if any("P" in run.columns and run.kinematics.dimension == 2 for run in runs):
        return _curves_of_joints(runs)
    return _common_columns(runs)


def _common_columns(runs: Sequence[Run]) -> Curves:
    """The quantities of parts that all general runs have, but what the loads prescribe. Where only
    some of them begin with a stage of fits, loads count from its end on."""
    first = runs[0]
    fitted = {run.scene.fits for run in runs}
    shared = set.intersection(*(set(run.columns) for run in runs))
    shared -= {f"{load.name} {load.kind}" for load in first.scene.load}
    names = [name for name in first.columns if name.endswith(COMMON) and name in shared]
    tables = []
    for run in runs:
        run.number(None)
        if any(run.units.get(name) != first.units.get(name) for name in names):
            raise InputError(run.folder, f"has other units than {first.folder}.")
        before = float(run.scene.fits and len(fitted) > 1)
        load = np.array(run.path) - before
        loaded = load > _SAME
        columns = {name: np.array(run.columns[name]) for name in names}
        table = {"load": load} | columns
        tables.append({name: values[loaded] for name, values in table.items()})
    if not names or not all(len(table["load"]) for table in tables):
        raise InputError(first.folder, "shares no load with the others.")
    after_fits = ", after press fits" if len(fitted) > 1 else ""
    labels = {"load": f"load factor{after_fits}"}
    labels |= {name: first.heading(name) for name in names}
    return tables, labels, np.ones(len(runs))


def _curves_of_joints(runs: Sequence[Run]) -> Curves:
    """P, delta, p0 and eps of joints."""
    curves = [run.curve for run in runs]
    units = [run.scene.units for run in runs]
    sizes = np.array([[curve.R, curve.dR, curve.E_star] for curve in curves])
    R, dR, E_star = np.abs(sizes).T
    alike = all(unit == units[0] for unit in units)
    if alike and np.allclose(sizes, sizes[0], rtol=_SAME, atol=0):
        length = units[0].length
        stress = units[0].stress
        force = units[0].force_of(None)
        labels = {"delta": f"delta [{length}]", "P": f"P [{force}]", "p0": f"p0 [{stress}]"}
        per = dict.fromkeys(labels, np.ones_like(R))
    else:
        gap = gap_name(min(curve.dR for curve in curves))
        labels = {"delta": f"delta/{gap}", "P": f"P/(E* {gap})", "p0": f"p0 R/(E* {gap})"}
        per = {"delta": dR, "P": E_star * dR, "p0": E_star * dR / R}
    labels["eps"] = "eps [rad]"
    per["eps"] = np.ones_like(R)
    load = "P" if all(run.scene.force_controlled for run in runs) else "delta"
    named = {name: "load" if name == load else name for name in (load, *labels)}
    tables = [
        {named[name]: getattr(curve, name) / per[name][k] for name in named}
        for k, curve in enumerate(curves)
    ]
    return tables, {named[name]: labels[name] for name in named}, per["p0"]


def _at(load: Array, table: Arrays, between: Bools) -> Arrays:
    """The first loading of a run at ``load`` ``(n,)``; interpolated where that lies ``between`` its
    own loads."""
    own = table["load"]
    nearest = np.abs(load[:, None] - own).argmin(axis=1)
    found = {name: values[nearest] for name, values in table.items()}
    if between.any():
        from scipy.interpolate import PchipInterpolator

        for name, values in table.items():
            found[name][between] = PchipInterpolator(own, values)(load[between])
    return found


def differing_keys(scenes: Sequence[Any]) -> dict[str, list[str]]:
    """Keys in which the ``scenes`` differ, and their values as TOML writes them; empty where a
    scene has none."""
    tables = [scene_keys(scene) for scene in scenes]
    rows = {}
    for name in dict.fromkeys(name for table in tables for name in table):
        shown = [json.dumps(t[name], ensure_ascii=False) if name in t else "" for t in tables]
        if len(set(shown)) > 1:
            rows[name] = shown
    return rows

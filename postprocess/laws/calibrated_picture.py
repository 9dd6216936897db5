"""A picture of a sweep's fit: k and c of its cases over what decides them, and the model's lines."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.output.output_file import writing
from archord.postprocess.laws.calibrated_fit import predictions
from archord.postprocess.laws.calibrated_model import SOFT, CalibratedModel, Points, equivalent
from archord.postprocess.laws.fitted_cases import FittedCase
from archord.scene.errors import InputError

PAPER_K = 0.85
_KINDS = {("strain", "both"): "C0", ("strain", "block"): "C1", ("stress", "both"): "C2", ("stress", "block"): "C4"}
_PLANES = {"strain": ("o", "-"), "stress": ("s", "--")}
_ALIKE = 0.01


@dataclass(frozen=True)
class _Joint:
    """What a line of the model is drawn for."""

    plane: str
    alpha: float = 0.0
    nu: float = 0.3
    s: float = math.inf
    clearance: float = 0.005

    @property
    def pin_nu(self) -> float:
        return self.nu


def draw_calibrated(cases: list[FittedCase], model: CalibratedModel | None, target: str | Path) -> Path:
    """Draw k against Poisson's ratio, moduli and the onset of yielding, c against sigY/E* and dR/R, and the model
    against the cases, as ``target``; returns the file.

    Points are cases of like Poisson's ratios (k) or like bodies with nu = 0.3 (c), lines the model, where there is one.
    Raises `InputError` for an unknown format.
    """
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    target = Path(target)
    figure, axes = plt.subplots(2, 3, figsize=(14.5, 8.4), layout="constrained")
    try:
        formats = figure.canvas.get_supported_filetypes()
        if target.suffix[1:].lower() not in formats:
            raise InputError(f"{target}: must end in one of {', '.join('.' + name for name in sorted(formats))}.")
        _k_over_nu(axes[0, 0], cases, model)
        _k_over_moduli(axes[0, 1], cases, model)
        _k_over_onset(axes[0, 2], cases, model)
        _c_over(axes[1, 0], cases, model, "strength", "sigY / E*", "clearance", "ΔR/R", (0.001, 0.005, 0.02))
        _c_over(axes[1, 1], cases, model, "clearance", "ΔR / R", "strength", "sigY/E*", (0.0005, 0.001, 0.002, 0.004))
        _parity(axes[1, 2], cases, model)
        for axis in axes.flat:
            if not axis.lines:  # a sweep need not have what belongs here
                axis.text(0.5, 0.5, "no such case", transform=axis.transAxes, ha="center", color="0.4")
            axis.grid(alpha=0.3)
            if axis.get_legend_handles_labels()[0]:
                axis.legend(frameon=False, fontsize="x-small")
        with writing(target):
            figure.savefig(target, dpi=110)
    finally:
        plt.close(figure)
    return target


def _elastic(cases: list[FittedCase]) -> list[FittedCase]:
    """Elastic cases whose bodies have one Poisson's ratio."""
    return [c for c in cases if c.yielding == "none" and (math.isnan(c.pin_nu) or abs(c.pin_nu - c.nu) < 1e-6)]


def _like(cases: list[FittedCase]) -> list[FittedCase]:
    """Cases of like bodies with nu = 0.3 that tell a c."""
    return [c for c in cases if c.yielding == "both" and abs(c.alpha) < _ALIKE and abs(c.nu - 0.3) < _ALIKE
            and abs(c.pin_nu - 0.3) < _ALIKE and math.isfinite(c.told_c)]  # fmt: skip


def _draw(axis, points: list[FittedCase], value: Callable[[FittedCase], tuple[float, float]], color: str) -> None:
    for plane, (marker, _) in _PLANES.items():
        rows = [value(case) for case in points if case.plane == plane]
        if rows:
            axis.plot(*zip(*rows, strict=True), marker, ms=4, mfc="none", color=color)


def _line(axis, x: Array, joints: list[Any], model: CalibratedModel, which: int, **style: Any) -> None:
    """k (``which`` 0) or c (1) of the model for ``joints``, where it holds."""
    kind = joints[0].plane, "none" if math.isinf(joints[0].s) else "both"
    values = model.coefficients(kind, Points.of(joints))[which]
    soft = [(1 - j.alpha) / 2 * equivalent(j.nu, j.plane) > SOFT for j in joints]
    axis.plot(x, np.where(soft, np.nan, values), ls=_PLANES[kind[0]][1], **style)


def _k_over_nu(axis, cases: list[FittedCase], model: CalibratedModel | None) -> None:
    nu = np.linspace(0, 0.49, 60)
    for i, (alpha, words) in enumerate(((-0.5, "pin 3 times softer"), (0.0, "like bodies"),
                                        (0.5, "pin 3 times stiffer"), (1.0, "rigid pin"))):  # fmt: skip
        same = [c for c in _elastic(cases) if abs(c.alpha - alpha) < _ALIKE]
        _draw(axis, same, lambda c: (c.nu, c.k), f"C{i}")
        for plane in _PLANES if model else ():
            joints = [_Joint(plane, alpha, n) for n in nu]
            _line(axis, nu, joints, model, 0, color=f"C{i}", lw=1, label=words if plane == "strain" else None)
    axis.axhline(PAPER_K, color="black", lw=0.8, label="k = 0.85")
    axis.set(
        xlabel="ν of both bodies", ylabel="k, elastic", title="○ — plane strain, □ -- plane stress", ylim=(0.4, 1.3)
    )


def _k_over_moduli(axis, cases: list[FittedCase], model: CalibratedModel | None) -> None:
    alpha = np.linspace(-0.5, 0.98, 80)
    for i, nu in enumerate((0.0, 0.3, 0.49)):
        same = [c for c in _elastic(cases) if abs(c.nu - nu) < 1e-3 and c.alpha < 1]
        _draw(axis, same, lambda c: (c.ratio, c.k), f"C{i}")
        for plane in _PLANES if model else ():
            joints = [_Joint(plane, a, nu) for a in alpha]
            x = (1 + alpha) / (1 - alpha)
            _line(axis, x, joints, model, 0, color=f"C{i}", lw=1, label=f"ν = {nu:g}" if plane == "strain" else None)
    axis.axhline(PAPER_K, color="black", lw=0.8, label="k = 0.85")
    axis.set(xlabel="E of the pin / E of the block", ylabel="k, elastic", xscale="log", ylim=(0.4, 1.3))


def _k_over_onset(axis, cases: list[FittedCase], model: CalibratedModel | None) -> None:
    if model is None:
        return
    for kind, color in _KINDS.items():
        same = [c for c in cases if c.kind == kind]
        if same:
            k = model.elastic_k(Points.of(same))
            axis.plot([c.s for c in same] / k, [c.k for c in same] / k, _PLANES[kind[0]][0], ms=4, mfc="none",
                      color=color, label=f"plane {kind[0]}, {kind[1]}")  # fmt: skip
    axis.set(
        xlabel="s / k of the elastic joint,  s = sigY R/(E* ΔR)", ylabel="k / k of the elastic joint", xscale="log"
    )


def _c_over(
    axis, cases: list[FittedCase], model: CalibratedModel | None, over: str, label: str, by: str, name: str,
    values: tuple[float, ...],
) -> None:  # fmt: skip
    """c of like bodies, nu = 0.3, over one of dR/R and sigY/E*, in the colour of the other."""
    _draw(axis, [c for c in _like(cases)], lambda c: (getattr(c, over), c.c), "0.4")
    for i, value in enumerate(values):
        same = [c for c in _like(cases) if math.isclose(getattr(c, by), value, rel_tol=0.02)]
        _draw(axis, same, lambda c: (getattr(c, over), c.c), f"C{i}")
        for plane in _PLANES:
            bounds = model.bounds_of((plane, "both")) if model else None
            if model is None or bounds is None:
                continue
            low, high = max(0.1, bounds.s[0]), 1.2
            s = np.geomspace(low, high, 50)
            x = s * value if over == "strength" else value / s
            joints = [_Joint(plane, s=one, clearance=value) for one in s]
            shown = (x >= 0.001) & (x <= 0.02) if over == "clearance" else np.full(s.shape, True)
            if shown.any():
                drawn = [j for j, yes in zip(joints, shown, strict=True) if yes]
                said = f"{name} = {value:.2%}" if plane == "strain" else None
                _line(axis, x[shown], drawn, model, 1, color=f"C{i}", lw=1, label=said)
    if axis.lines:
        axis.axhline(1, color="black", lw=0.8, label="c = 1")
    axis.set(xlabel=label, ylabel="c, like bodies, ν = 0.3", xscale="log")


def _parity(axis, cases: list[FittedCase], model: CalibratedModel | None) -> None:
    from matplotlib.ticker import FixedLocator, NullFormatter

    if model is None:
        return
    kinds = {*_KINDS, ("strain", "none"), ("stress", "none")} & {(b.plane, b.yielding) for b in model.bounds}
    same = [c for c in cases if c.kind in kinds]
    k, c = predictions(model, same)
    axis.plot([case.k for case in same], k, ".", ms=4, color="C0", label="k")
    axis.plot([case.told_c for case in same], np.where(np.isfinite(c), c, np.nan), ".", ms=4, color="C3", label="c")
    ends = np.array([0.3, 2.6])
    axis.plot(ends, ends, color="black", lw=0.8)
    axis.fill_between(ends, 0.95 * ends, 1.05 * ends, color="0.85", label="5 %")
    axis.set(xlabel="of the case itself", ylabel="of the model", xscale="log", yscale="log", xlim=ends, ylim=ends)
    for side in (axis.xaxis, axis.yaxis):  # over less than a decade matplotlib's own labels overlap
        side.set_major_locator(FixedLocator([0.3, 0.5, 1.0, 2.0]))
        side.set_major_formatter("{x:g}")
        side.set_minor_formatter(NullFormatter())

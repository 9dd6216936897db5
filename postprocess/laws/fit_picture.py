"""A picture of a calibration: P(delta) and p0(delta) with their fits, and the residuals."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from archord.output.output_file import writing
from archord.postprocess.laws.calibration import Calibration, Fits
from archord.postprocess.laws.curve_fit import CurveFit, dimensionless_law
from archord.scene.errors import InputError


def draw_fit(calibration: Calibration, target: str | Path) -> Path:
    """Draw the fit to all scenes as ``target``; returns the file. Raises `InputError` for an unknown format."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    target = Path(target)
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained")
    try:
        formats = figure.canvas.get_supported_filetypes()
        if target.suffix[1:].lower() not in formats:
            raise InputError(f"{target}: must end in one of {', '.join('.' + name for name in sorted(formats))}.")
        fits = calibration.joint
        _curve(axes[0], fits, fits.P, "P / (E* ΔR)", "force")
        _curve(axes[1], fits, fits.p0, "p0 R / (E* ΔR)", "peak pressure")
        _residuals(axes[2], fits.P, fits.p0)
        with writing(target):
            figure.savefig(target, dpi=110)
    finally:
        plt.close(figure)
    return target


def _curve(axes, fits: Fits, fit: CurveFit, label: str, what: str) -> None:
    for i, (run, part) in enumerate(zip(fits.runs, fit.residuals, strict=True)):
        axes.plot(part.load, part.data, "o", ms=4, mfc="none", color=f"C{i}", label=part.name)
        if fit.k:
            load = np.linspace(0, part.load.max(), 400)
            c = fit.c.value if fit.c else None
            law = dimensionless_law(fit.quantity, run, load * run.dR, fit.k.value, c)
            axes.plot(load, law, "-", lw=1.4, color=f"C{i}")
    found = [
        f"{name} = {estimate.value:.3f} ± {estimate.error:.3f}"
        for name, estimate in (("k", fit.k), ("c", fit.c))
        if estimate
    ]
    axes.set(xlabel="δ / ΔR", ylabel=label, xlim=(0, None), ylim=(0, None))
    axes.set_title(f"{what}: {', '.join(found)}", fontsize="medium")
    axes.legend(frameon=False, fontsize="small")
    axes.grid(alpha=0.3)


def _residuals(axes, force: CurveFit, peak: CurveFit) -> None:
    for fit, style in ((force, "o-"), (peak, "s--")):
        for i, part in enumerate(fit.residuals):
            label = f"{fit.quantity}: {part.name}"
            axes.plot(part.load, 100 * part.relative, style, ms=3, lw=1, color=f"C{i}", label=label)
    axes.axhline(0, color="black", lw=0.8)
    axes.set(xlabel="δ / ΔR", ylabel="law / run - 1 [%]", title="residuals", xlim=(0, None))
    axes.legend(frameon=False, fontsize="small")
    axes.grid(alpha=0.3)

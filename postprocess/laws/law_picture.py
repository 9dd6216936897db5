"""A picture of closed-form laws against each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from archord.output.output_file import check_output, writing
from archord.postprocess.laws.law import Law, Outside
from archord.postprocess.laws.law_joint import LawJoint
from archord.postprocess.laws.law_tables import sample
from archord.scene.errors import InputError

_POINTS = 400


def draw_laws(
    laws: list[Law],
    joint: LawJoint,
    target: str | Path,
    by: str = "displacement",
    to: float = 2.0,
    outside: Outside = "nan",
) -> Path:
    """Draw force, peak pressure and contact angle of ``laws`` as ``target``; returns the file.

    Without displacements (``by`` "load") pressure and angle are drawn over the force. Raises `InputError` if ``target``
    cannot be written.
    """
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    target = Path(target)
    formats = plt.gcf().canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in formats:
        raise InputError(f"{target}: must end in one of {', '.join('.' + name for name in sorted(formats))}.")
    check_output(target)
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.4), layout="constrained")
    force = joint.E_star * joint.clearance
    for law in laws:
        state = sample(law, joint, by, to, _POINTS, outside)
        x = state.load / force if by == "load" else state.delta / joint.clearance
        other = state.delta / joint.clearance if by == "load" else state.load / force
        ends = np.isnan(other).any()
        for axis, y in zip(axes, (other, state.peak_pressure / joint.E_star, np.degrees(state.angle)), strict=True):
            (line,) = axis.plot(x, y, label=law.name)
            drawn = np.flatnonzero(~np.isnan(x) & ~np.isnan(y))
            if ends and len(drawn):
                axis.plot(x[drawn[-1]], y[drawn[-1]], "o", ms=4, color=line.get_color())
    names = ("P / (E* ΔR)", "δ / ΔR") if by == "load" else ("δ / ΔR", "P / (E* ΔR)")
    for axis, label in zip(axes, (names[1], "p0 / E*", "contact semi-angle [°]"), strict=True):
        axis.set(xlabel=names[0], ylabel=label, xlim=(0, to), ylim=(0, None))
        axis.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    with writing(target):
        figure.savefig(target, dpi=110)
    plt.close(figure)
    return target

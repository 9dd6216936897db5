"""The plateau of the contact pressure of a yielding joint."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.postprocess.arc_pressure import ArcPressure, read_arcs
from archord.postprocess.run_curve import RunCurve


def median_pressure(arc: ArcPressure) -> float:
    """The pressure exceeded on half of the contact: median of the facets' means, by their width across the load.

    Of a pressure that is cut off over more than half of that width it is the plateau itself, wherever the edge lies;
    of the parabola ``p0 (1 - x^2/l^2)`` it is ``3/4 p0``. 0 without contact.
    """
    width = arc.weight.sum(axis=1)
    mean = (arc.weight * arc.pressure).sum(axis=1) / width
    across = (arc.weight * np.cos(arc.angle)).sum(axis=1)
    pressed = mean > 0
    if not pressed.any():
        return 0.0
    order = np.argsort(mean[pressed])
    p, share = mean[pressed][order], across[pressed][order]
    middle = np.cumsum(share) - share / 2
    return float(np.interp(share.sum() / 2, middle, p))


def peak_facet_pressure(arc: ArcPressure) -> float:
    """Largest mean pressure of a facet."""
    return float(((arc.weight * arc.pressure).sum(axis=1) / arc.weight.sum(axis=1)).max())


def plateau_pressure(run: RunCurve) -> tuple[Array, Array]:
    """Median pressure and its ratio to the largest (1: flat; parabola: 3/4), each ``(n steps,)``, mean of the sides.

    Raises `InputError` if contact.h5 cannot be read.
    """
    rows = []
    for step in range(1, len(run.delta) + 1):
        arcs = list(read_arcs(run, step).values())
        rows.append([np.mean([f(arc) for arc in arcs]) for f in (median_pressure, peak_facet_pressure)])
    median, peak = np.array(rows).T
    return median, median / np.where(peak > 0, peak, 1.0)

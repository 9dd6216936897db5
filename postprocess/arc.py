"""The contact on the arcs of a run, as contact.h5 holds it, and the plateau of its pressure."""

from __future__ import annotations

import h5py
import numpy as np

from archord.materials.material import Array
from archord.output.step_file import step_name
from archord.postprocess.curve import RunCurve
from archord.presets.arc import ArcProfile
from archord.scene.errors import InputError
from archord.scene.scene import Scene

_FIXED, _PER_STEP = ("s", "weight"), ("coordinates", "pressure", "raw_pressure", "gap")


def read_arcs(run: RunCurve, step: int) -> dict[str, ArcProfile]:
    """The sides of ``run`` at ``step`` (from 1); a side whose arc was not integrated is absent.

    Raises `InputError` if contact.h5 is missing, damaged or does not hold the step.
    """
    path = run.folder / "contact.h5" if run.folder else None
    if path is None or not path.is_file():
        raise InputError(f"{run.name}: is not a complete run folder: contact.h5 is missing.")
    radius, found = {"pin": run.R, "hole": run.R + run.dR}, {}
    try:
        with h5py.File(path) as file:
            if int(file["accepted"][()]) < step:
                raise KeyError(step)
            for side in (side for side in radius if side in file):
                arrays = {name: file[f"{side}/{name}"][()] for name in _FIXED}
                arrays |= {name: file[f"{side}/{name}/{step_name(step)}"][()] for name in _PER_STEP}
                found[side] = ArcProfile(radius[side], **arrays)
    except (OSError, KeyError, RuntimeError, TypeError, ValueError):
        raise InputError(f"{path}: cannot be read as the contact of a run.") from None
    return found


def undeformed(arc: ArcProfile, side: str, scene: Scene) -> Array:
    """Points ``(n, q, 2)`` of the ``side`` of ``scene`` before it is loaded: on its circle, in the mesh's frame.

    The hole's centre is the origin. So is the pin's in a ring; in a block it touches the hole, ``(0, -dR)``.
    """
    g = scene.joint
    centre = -g.pin_depth if side == "pin" else 0.0
    return np.stack([arc.radius * np.sin(arc.angle), centre - arc.radius * np.cos(arc.angle)], axis=-1)


def median_pressure(arc: ArcProfile) -> float:
    """The pressure exceeded on half of the contact: median of the facets' means, by their width across the load.

    Of a pressure that is cut off over more than half of that width it is the plateau itself, wherever the edge lies;
    of the parabola ``p0 (1 - x^2/l^2)`` it is ``3/4 p0``. 0 without contact.
    """
    mean = arc.facet_means()[1]
    across = (arc.weight * np.cos(arc.angle)).sum(axis=1)
    pressed = mean > 0
    if not pressed.any():
        return 0.0
    order = np.argsort(mean[pressed])
    p, share = mean[pressed][order], across[pressed][order]
    middle = np.cumsum(share) - share / 2
    return float(np.interp(share.sum() / 2, middle, p))


def plateau_pressure(run: RunCurve) -> tuple[Array, Array]:
    """Median pressure and its ratio to the largest of a facet (1: flat; parabola: 3/4), each ``(n steps,)``, mean of
    the sides. Raises `InputError` if contact.h5 cannot be read."""
    steps = [list(read_arcs(run, step).values()) for step in range(1, len(run.delta) + 1)]
    median = np.array([np.mean([median_pressure(arc) for arc in arcs]) for arcs in steps])
    peak = np.array([np.mean([arc.facet_means()[1].max() for arc in arcs]) for arcs in steps])
    return median, median / np.where(peak > 0, peak, 1.0)

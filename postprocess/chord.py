"""The contact pressure projected from the arc onto the chord from the deepest point to the edge of
the contact.

Hu et al., "A new model for elasto-plastic conformal contact between cylinders", eq. 15. A point at
the angle ``phi`` from the contact axis is projected along its radius onto the chord of length ``l =
2 R sin(eps/2)``, at

    x = R cos(eps/2) [ tan(phi - eps/2) + tan(eps/2) ],    dx = R dphi cos(eps/2)/cos^2(phi -
    eps/2),

and the pressure there carries the arc's vertical force, ``py dx = p cos(phi) R dphi``.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from archord.materials.material import Array
from archord.postprocess.run import Run
from archord.presets.arc import SYMMETRY
from archord.report.errors import InputError


@dataclass(frozen=True)
class ChordPressure:
    """Vertical pressure on the chord of one half of the joint, at ``n`` points ordered from the
    contact axis.

    ``x`` runs from 0 at the deepest point to the ``length`` at the edge ``eps`` of the contact, and
    beyond where points carry pressure there.
    """

    x: Array  # (n,)
    py: Array  # (n,) positive in compression
    weight: Array  # (n,) each point's share of the chord
    eps: float
    R: float

    @property
    def length(self) -> float:
        """Length ``l`` of the chord (eq. 5)."""
        return 2 * self.R * float(np.sin(self.eps / 2))

    @property
    def x_over_l(self) -> Array:
        """Chord coordinate ``x/l`` ``(n,)``."""
        return np.divide(self.x, self.length)

    @property
    def resultant(self) -> float:
        """Force per unit thickness of the whole joint, both halves."""
        return SYMMETRY * float(self.weight @ self.py)


def chord_coordinate(phi: ArrayLike, eps: float, R: float) -> Array:
    """Chord coordinate ``x`` of the angle ``phi`` [rad], any shape; ``x(0) = 0`` and ``x(eps) =
    l``."""
    distance = R * np.cos(eps / 2)  # of the chord from the centre
    from_middle = np.tan(np.asarray(phi) - eps / 2)
    return distance * (from_middle + np.tan(eps / 2))


def arc_angle(x: ArrayLike, eps: float, R: float) -> Array:
    """Angle ``phi`` [rad] that is projected to ``x``, any shape; the inverse of
    `chord_coordinate`."""
    distance = R * np.cos(eps / 2)
    from_middle = np.asarray(x) / distance - np.tan(eps / 2)
    return eps / 2 + np.arctan(from_middle)


def chord_projection(
    phi: ArrayLike, pressure: ArrayLike, eps: float, R: float, weight: ArrayLike | None = None
) -> ChordPressure:
    """Project ``pressure`` at the rising angles ``phi`` [rad] from the contact axis onto the chord
    of ``eps`` (eq. 15).

    Arrays of one shape; ``weight`` is each point's share of arc length, by default the
    trapezoidal rule's. The resultant is the arc's, whatever ``eps`` is: points beyond it stay
    as long as they carry pressure. Raises ValueError for arrays that are no such arc, and for
    pressure beyond pi/2.
    """
    angle = np.ravel(np.asarray(phi, float))
    p = np.ravel(np.asarray(pressure, float))
    gap = np.diff(angle) * R
    measure = (np.append(gap, 0.0) + np.append(0.0, gap)) / 2
    if weight is not None:
        measure = np.ravel(np.asarray(weight, float))
    if not (0 < eps < np.pi and 0 < R < np.inf):
        raise ValueError(
            f"the contact semi-angle {eps:g} must be between 0 and pi, the radius {R:g} positive."
        )
    if not 1 < len(angle) == len(p) == len(measure):
        raise ValueError("phi, pressure and weight must have the same length, two or more.")
    if not (angle[0] >= 0 and (gap >= 0).all() and np.isfinite(p).all()):
        raise ValueError(
            "phi must rise from the contact axis, from 0 or more, and the pressure must be finite."
        )
    kept = (angle <= eps) | (p != 0)
    angle = angle[kept]
    if len(angle) and angle[-1] > np.pi / 2 * (1 + 1e-12):
        raise ValueError("the contact must end within pi/2 of the axis.")
    stretch = np.cos(eps / 2) / np.cos(angle - eps / 2) ** 2
    x = chord_coordinate(angle, eps, R)
    return ChordPressure(x, p[kept] * np.cos(angle) / stretch, measure[kept] * stretch, eps, R)


def read_chord_pressure(
    folder: str | Path, step: int | None = None, side: str | None = None
) -> ChordPressure:
    """Read the contact pressure of a run of a joint, projected onto the chord.

    Parameters
    ----------
    folder : str or Path
        The run folder.
    step : int
        The step, from 1; by default the last one.
    side : {"pin", "hole"}
        The side; by default the hole if both are there.

    Returns
    -------
    ChordPressure
        Its ``R`` is the side's own radius, and its ``eps`` the semi-angle in history.csv.

    Raises
    ------
    InputError
        Where there is no such run, step or side, no contact angle, or one beyond pi/2 (a ring).

    Examples
    --------
    >>> import archord
    >>> from archord.postprocess.chord import read_chord_pressure
    >>> joint = {"radius": 10.0, "clearance": 0.1, "relative_element_size": 0.2}
    >>> steel = {"E": 210e3, "nu": 0.3}
    >>> load = {"displacement": 0.5, "steps": 1}
    >>> scene = archord.Scene(joint=joint, pin=steel, block=steel, load=load)
    >>> run = archord.solve(scene, "runs/doctest", force=True)
    >>> chord = read_chord_pressure(run.folder)
    >>> print(f"{chord.length:.1f}")
    6.9
    """
    run = Run(folder)
    number = run.number(step)
    arc = run.arc(number, side)
    eps = run.curve.eps[number - 1]
    try:
        return chord_projection(arc.angle, arc.pressure, eps, arc.radius, arc.weight)
    except ValueError as error:
        raise InputError(folder, f"step {number} cannot be projected: {error}") from None

"""The tables of the force element: a way back that loses energy wherever the joint goes deeper.

The element unloads along ``r back(h)``, ``h = (x - z)/r``, from the deepest x, with r(x) and z(x)
cubics (see ``element.py``). Where x grows, the energy ``r^2 B(h)``, ``B = int back``, that the
joint would give back changes by

    dW/dx = -r back(h) (dz/dx + phi(h) dr/dx),    phi(h) = h - 2 B(h)/back(h).

It may only fall, at every displacement up to x: ``dz/dx >= 0`` and ``dz/dx + phi dr/dx >= 0``. The
tables of a law keep this to 1e-4 of the energy, their fits' error. Here z is raised by as little as
makes it true throughout: the slope of a cubic lies between its slopes at the nodes and ``3 rise -
d0 - d1``.

Tables are arrays ``(n,)`` over the nodes ``x`` of a `JointCurve`.
"""

from __future__ import annotations

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.joint_curve import JointCurve, first_touch, hermite

_PLACES = 1000  # of first loading that are compared
_SAMPLES = 4000  # of phi, up to its largest argument
_FIRST = 1e-3  # of them, over the last node
_MARGIN = 1.01  # of h between two nodes, over the larger one there


def stored(curve: JointCurve) -> Array:
    """The energy B ``(n,)`` of the curve ``back`` at the nodes, in units of x times y."""
    width = np.diff(curve.x)
    mean = (curve.back[:-1] + curve.back[1:]) / 2
    bend = curve.dback[:-1] - curve.dback[1:]
    pieces = width * mean + width**2 / 12 * bend
    if curve.touch.size:
        pieces[0] = _touch_energy(curve.touch, curve.x[1])
    return np.append(0.0, np.cumsum(pieces))


def _touch_energy(touch: Array, x: float) -> float:
    """The energy of the logarithmic law up to ``x``, as ``element.touch_energy`` has it."""
    _, b, c = touch
    (y,), (slope,) = first_touch(touch, np.array([x]))
    power = x * slope / y
    first = b / (2 * power + 1)
    second = 2 * c * x / (2 * power + 2)
    contact = np.pi * x * y - y + np.log1p(y)
    rise = x * y**2 * (first + second)
    return (contact + rise) / (2 * np.pi)


def shift(curve: JointCurve) -> tuple[Array, Array]:
    """The displacement z at which the way back opens and its slope, ``(n,)`` each, so that no
    energy is gained anywhere."""
    r = curve.ratio
    dr = curve.dratio
    # r back(h) is first loading y, and so are their slopes
    h = curve._inverse(curve.back, curve.dback, curve.y / r)
    back, dback = curve._curve(curve.back, curve.dback, h)
    rises = dback > 0
    dh = np.ones_like(h)
    left = curve.dy - dr * back
    np.divide(left, r * dback, out=dh, where=rises)
    z = curve.x - r * h
    dz = 1 - dr * h - r * dh
    return _losing(curve, z, dz, h)


def fall(curve: JointCurve) -> float:
    """By how much the element's force on first loading is below the law's where z was raised: the
    largest difference, over the largest force."""
    shifts, slopes = shift(curve)
    x = np.linspace(0.0, curve.x[-1], _PLACES)
    ratio, _ = hermite(curve.x, curve.ratio, curve.dratio, x)
    opens, _ = hermite(curve.x, shifts, slopes, x)
    beyond = np.maximum(x - opens, 0.0)
    back, _ = curve._curve(curve.back, curve.dback, beyond / ratio)
    wanted, _ = curve._curve(curve.y, curve.dy, x)
    missing = wanted - ratio * back
    return float(missing.max() / wanted.max())


def _losing(curve: JointCurve, z: Array, dz: Array, h: Array) -> tuple[Array, Array]:
    """``z`` and ``dz`` raised where energy would be gained."""
    width = np.diff(curve.x)
    dr = curve.dratio
    between = _MARGIN * np.maximum(h[:-1], h[1:])
    phi = _largest_phi(curve, between)  # (n - 1,)
    # at the nodes
    before = np.append(0.0, phi)
    after = np.append(phi, 0.0)
    at_nodes = np.maximum(before, after)
    least_slope = np.maximum(-dr * at_nodes, 0.0)
    dz = np.maximum(dz, least_slope)
    # between them
    rise_of_ratio = np.diff(curve.ratio) / width
    steepest = 3 * rise_of_ratio - dr[:-1] - dr[1:]
    least_middle = np.maximum(-steepest * phi, 0.0)
    least_rise = width / 3 * (dz[:-1] + dz[1:] + least_middle)
    raised = z.copy()
    for i, rise in enumerate(least_rise):
        raised[i + 1] = max(z[i + 1], raised[i] + rise)
    return raised, dz


def _largest_phi(curve: JointCurve, h: Array) -> Array:
    """The largest ``phi`` up to ``h`` (any shape)."""
    end = max(h.max(), curve.x[-1])
    u = np.geomspace(_FIRST * curve.x[-1], end, _SAMPLES)
    back, _ = curve._curve(curve.back, curve.dback, u)
    first = u[0] * back[0] / 2
    mean = (back[1:] + back[:-1]) / 2
    pieces = np.diff(u) * mean
    energy = np.cumsum(np.append(first, pieces))
    phi = u - 2 * energy / back
    largest = np.maximum.accumulate(phi)
    sample = np.minimum(np.searchsorted(u, h), _SAMPLES - 1)
    return largest[sample]

"""The tables of the force element: a way back that loses energy wherever the joint goes deeper.

The element unloads along ``r back((x - z)/r)`` from the deepest x, r(x) and z(x) cubics (see
``element.py``). Where x grows, the energy ``r^2 B`` that the joint would give back changes by

    dW/dx = -r back(h) (dz/dx + phi(h) dr/dx),    phi(h) = h - 2 B(h)/back(h),    h = (x - z)/r.

It may only fall, at every displacement up to x: ``dz/dx >= 0`` and ``dz/dx + phi dr/dx >= 0``. The
tables of a law keep this to 1e-4 of the energy, their fits' error. Here z is raised by as little as
makes it true throughout: the slope of a cubic lies between its slopes at the nodes and ``3 rise -
d0 - d1``.
"""

from __future__ import annotations

import numpy as np

from archord.postprocess.laws.general.joint import Array
from archord.postprocess.laws.general.joint_curve import JointCurve, first_touch

_SAMPLES = 4000  # of phi, up to its largest argument
_FIRST = 1e-3  # of them, over the last node


def stored(curve: JointCurve) -> Array:
    """The energy ``(n,)`` of the curve ``back`` at the nodes, in units of x times y."""
    width = np.diff(curve.x)
    begin, end = curve.back[:-1], curve.back[1:]
    bend = curve.dback[:-1] - curve.dback[1:]
    pieces = width * (begin + end) / 2 + width**2 * bend / 12
    if curve.touch.size:
        pieces[0] = _touch_energy(curve.touch, curve.x[1:2])[0]
    return np.append(0.0, np.cumsum(pieces))


def _touch_energy(touch: Array, x: Array) -> Array:
    """The energy of the logarithmic law, as ``element.touch_energy`` has it."""
    _, b, c = touch
    y, slope = first_touch(touch, x)
    power = x * slope / y
    rise = x * y**2 * (b / (2 * power + 1) + 2 * c * x / (2 * power + 2))
    return (np.pi * x * y - y + np.log1p(y) + rise) / (2 * np.pi)


def shift(curve: JointCurve) -> tuple[Array, Array]:
    """The displacement z at which the way back opens and its slope, ``(n,)`` each, so that no
    energy is gained anywhere."""
    x = curve.x
    r = curve.ratio
    dr = curve.dratio
    h = curve._inverse(curve.back, curve.dback, curve.y / r)
    z = x - r * h
    back, steepness = curve._curve(curve.back, curve.dback, h)
    steep = steepness > 0
    grows = np.divide(curve.dy - dr * back, r * steepness, out=np.ones_like(x), where=steep)
    dz = 1 - dr * h - r * grows
    return _losing(curve, z, dz, h)


def _losing(curve: JointCurve, z: Array, dz: Array, h: Array) -> tuple[Array, Array]:
    """``z`` and ``dz`` raised where energy would be gained."""
    width = np.diff(curve.x)
    dr = curve.dratio
    phi = _phi(curve, 1.01 * np.maximum(h[:-1], h[1:]))
    around = np.maximum(np.append(0.0, phi), np.append(phi, 0.0))
    dz = np.maximum(dz, np.maximum(-dr * around, 0.0))
    middle = 3 * np.diff(curve.ratio) / width - dr[:-1] - dr[1:]
    least = width / 3 * (dz[:-1] + dz[1:] + np.maximum(-middle * phi, 0.0))
    raised = z.copy()
    for i, rise in enumerate(least):
        raised[i + 1] = max(z[i + 1], raised[i] + rise)
    return raised, dz


def _phi(curve: JointCurve, h: Array) -> Array:
    """The largest ``phi`` up to ``h`` (any shape)."""
    u = np.geomspace(_FIRST * curve.x[-1], max(h.max(), curve.x[-1]), _SAMPLES)
    back, _ = curve._curve(curve.back, curve.dback, u)
    pieces = np.diff(u) * (back[1:] + back[:-1]) / 2
    energy = np.cumsum(np.append(u[0] * back[0] / 2, pieces))
    phi = np.maximum.accumulate(u - 2 * energy / back)
    return phi[np.minimum(np.searchsorted(u, h), len(u) - 1)]

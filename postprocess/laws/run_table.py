"""Any run as a law: P(delta) of its steps as a monotone cubic, with the way back that it took.

First loading is the cubic of Fritsch and Carlson (1980) through the steps that were deeper than all
before. The way back follows the run's own unloading B(u), where u counts from the displacement z at
which it opens. Where unloading shifts by dz the work P dz is lost: from any other displacement the
joint opens at

    z(delta) = z0 + c int dD/P,

D the plastic dissipation, z0 where contact begins, and c such that the unloading that was solved
opens where it did. The ratio of `JointCurve` follows from that both curves meet; B is softer where
it opens than the first step.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.joint_curve import JointCurve, hermite
from archord.postprocess.laws.run_steps import RunSteps, read_steps
from archord.postprocess.run import Run
from archord.scene.errors import InputError

_ELASTIC = 1e-9  # of the largest force times displacement: nothing was dissipated
_POWER = 1.2  # of the displacement in the force of first touch; contacts of lines have 1.1 to 1.3
_AT_ONCE = 0.1  # of the first step with contact: what is found to begin before begins at 0
_SAME = 1e-9  # of the range: nodes that are one
_FEWEST, _FEWEST_BACK = 6, 3  # steps with contact
# error of ways back that were not solved, over the force they begin at (docs/calibration.md)
_UNSEEN = 0.03
# error at first touch over that at the first step: 5 to 8 % of P against the logarithm of line
# contact
_FIRST = 4.0
_WANTED, _EARLY = (
    0.01,
    0.1,
)  # error of first loading to be asked for, and from which share of its end on
_BISECTIONS, _LARGEST = 60, 7.0  # of ln(ratio)
_SOFTER = 0.9  # slope of the way back where it opens over that up to the first step, at most
_LEAST = 1e-3  # slope at an end over that of the last two nodes


class _Cubic(NamedTuple):
    """A cubic through ``f`` at ``x`` with slopes ``df``, straight on beyond the ends."""

    x: Array
    f: Array
    df: Array

    def at(self, x: Array) -> tuple[Array, Array]:
        """Values and slopes."""
        return hermite(self.x, self.f, self.df, x)


class _WayBack(NamedTuple):
    """The curve of unloading, its ratio at the nodes of first loading, and the unloading (indices)
    that it is of."""

    curve: _Cubic
    ratio: Array
    steps: np.ndarray
    said: str


def run_table(run: Run, of: str | None = None) -> JointCurve:
    """The law of ``run``, in the units of `RunSteps`; of a general scene that of its load ``of``.
    Expected errors are those of the cubic through every second step, of unloadings that were not
    used, and of mesh and steps, as far as the run knows; ``about`` tells them.

    Raises `InputError` without contact, with fewer than 6 steps of first loading, where the force
    does not rise on it, and if the run yields and does not unload.
    """
    steps = read_steps(run, of)
    x, y, first = steps.x, steps.y, steps.first
    k = first[steps.closed[first].argmax() :] if y.max(initial=0.0) > 0 else first[:0]
    if len(k) < _FEWEST:
        said = f"has {len(k)} steps of first loading with contact, and a table needs {_FEWEST}"
        raise InputError(f"{run.folder}: {said}; press further, or in more steps.")
    steps.require_rising(k)
    start = _opening(x[k], y[k], x[first[: -len(k)]])
    begin = np.unique([0.0, start if start > _AT_ONCE * x[k[0]] else 0.0])
    loading = _cubic(np.append(begin, x[k]), np.append(0 * begin, y[k]), touching=len(begin) == 1)
    back = _way_back(steps, k, loading)

    tables = _tables(steps, k, loading, back)
    nodes = tables["x"]
    left_out = _left_out(loading.x[-len(k) - 1 :] - begin[-1], loading.f[-len(k) - 1 :])[1:] / y[k]
    mesh = np.interp(nodes, x[k], steps.mesh_error(loading.df[-len(k) :]) / y[k])
    sizes = _around(np.abs(left_out))
    error = np.interp(nodes, np.append(begin[-1], x[k]), np.append(_FIRST * sizes[0], sizes)) + mesh
    curve = JointCurve(**tables, error=error, back_error=error)
    back_error, said = _errors_back(curve, steps, k, back)
    about = steps.about | {
        "first loading": f"{len(k)} steps to {steps.said(x[k[-1]])}, {steps.said(force=y[k[-1]])}",
        "contact begins at": steps.said(begin[-1]),
        "error of first loading": f"{_sizes(left_out)} of P, by the cubic through every second step",
        "steps for 1 %": _steps_asked(x[k], left_out),
        "way back": back.said,
        "error of the way back": said,
    }
    return replace(
        curve, back_error=error if back_error is None else back_error + mesh, about=about
    )


def _tables(steps: RunSteps, k: np.ndarray, loading: _Cubic, back: _WayBack) -> dict[str, Any]:
    """All cubics at the nodes of both ways, by their names in `JointCurve`."""
    apart = np.abs(back.curve.x[:, None] - loading.x).min(axis=1) > _SAME * loading.x[-1]
    nodes, touched = np.union1d(loading.x, back.curve.x[apart]), np.append(k[0], k)
    x, root = np.append(0.0, steps.x[k]), np.sqrt(steps.y[touched])
    cubics = {"y": loading, "back": back.curve, "ratio": _cubic(loading.x, back.ratio)}
    cubics |= {
        "peak": _cubic(x, steps.peak[touched] / root),
        "angle": _cubic(x, steps.angle[touched] / root),
    }
    tables: dict[str, Any] = {"x": nodes, "toe": np.zeros(len(nodes)), "touch": np.empty(0)}
    for name, cubic in cubics.items():
        tables[name], tables[f"d{name}"] = cubic.at(nodes)
    return tables | steps.units


def _way_back(steps: RunSteps, k: np.ndarray, loading: _Cubic) -> _WayBack:
    """That of the largest displacement that the run unloads from after yielding; first loading if
    it does not yield. ``k`` are the steps of ``loading``."""
    start = loading.x[-len(k) - 1]
    least = _ELASTIC * np.ptp(steps.x) * steps.y.max()
    if steps.dissipated.max() <= least:
        own = _Cubic(*(values[-len(k) - 1 :] for values in loading))
        return _WayBack(
            own._replace(x=own.x - start),
            np.ones(len(loading.x)),
            k[:0],
            "along first loading: elastic",
        )
    folder, ways = (
        steps.run.folder,
        [way for way in _unloadings(steps, k) if steps.dissipated[way[0]] > least],
    )
    if not ways:
        remedy = "a last target of 0 for the load, as load.displacement = [2.0, 0.0], gives it"
        raise InputError(
            f"{folder}: yields and never unloads after, so its way back is unknown; {remedy}."
        )
    on, off = (ways[-1][mask] for mask in (steps.closed[ways[-1]], ~steps.closed[ways[-1]]))
    if len(on) < _FEWEST_BACK:
        raise InputError(
            f"{folder}: unloads in {len(on)} steps with contact, and a table needs {_FEWEST_BACK}."
        )
    on = on[::-1]
    steps.require_rising(on)
    x, y = steps.x[on], steps.y[on]
    z = _opening(x, y, steps.x[off])
    curve = _cubic(np.append(0.0, x - z), np.append(0.0, y), touching=True)
    curve.df[0] = min(curve.df[0], _SOFTER * loading.f[-len(k)] / (loading.x[-len(k)] - start))
    lost = np.append(np.zeros(len(loading.x) - len(k)), steps.dissipated[k])
    shift = np.cumsum(
        np.append(0.0, np.diff(lost) / ((loading.f[1:] + loading.f[:-1]) / 2).clip(_SAME * y[-1]))
    )
    deepest = loading.x == x[-1]
    ratio = _meeting(curve, loading.x - start - (z - start) * shift / shift[deepest], loading.f)
    ratio[loading.x <= start], ratio[deepest] = ratio[loading.x > start][0], 1.0
    said = f"from {steps.said(x[-1])} in {len(on)} steps, opens at {steps.said(z)}"
    left = "" if len(off) else f", extended from {steps.said(force=y[0])} to none"
    return _WayBack(curve, ratio, ways[-1], said + left)


def _errors_back(
    curve: JointCurve, steps: RunSteps, k: np.ndarray, back: _WayBack
) -> tuple[Array | None, str]:
    """Errors at the nodes of the way back from there, over the force it begins at; None of what
    does not yield. And in words those of the unloadings that ``curve`` is not made of."""
    seen = {}
    for way in _unloadings(steps, k):
        x, top = steps.x[way], steps.y[way[0]]
        seen[x[0]] = (
            curve.at(x * curve.length, x[:1] * curve.length).load / curve.force - steps.y[way]
        ) / top
    own, others = (
        steps.x[back.steps[:1]],
        [errors for x, errors in seen.items() if x not in steps.x[back.steps[:1]]],
    )
    said = (
        f"{_sizes(np.concatenate(others))} of the force it begins at, in {len(others)} others"
        if others
        else ""
    )
    if not len(own):
        return None, said or "that of first loading"
    seen[own[0]] = _left_out(back.curve.x, back.curve.f) / back.curve.f[-1]
    worst = np.interp(curve.x, sorted(seen), [np.abs(seen[x]).max() for x in sorted(seen)])
    unseen = (curve.x > own[0]) | (not others and curve.x < own[0])
    return np.where(
        unseen, _UNSEEN, worst
    ), said or f"not measured, as there is no other: {_UNSEEN:.0%} assumed"


def _unloadings(steps: RunSteps, k: np.ndarray) -> list[np.ndarray]:
    """Indices of the steps of each way back from one of the steps ``k``, which begins it."""
    back = np.append(np.diff(steps.x) < 0, False)
    return [np.arange(i, i + back[i:].argmin() + 1) for i in k if back[i]]


def _opening(x: Array, y: Array, off: Array) -> float:
    """Where a contact of forces ``y`` at rising ``x`` opens: not before the steps without any, at
    ``off``."""
    found = x[0] - (x[1] - x[0]) / ((y[1] / y[0]) ** (1 / _POWER) - 1)
    return float(max(found, off.max(initial=0.0)))


def _meeting(curve: _Cubic, u: Array, y: Array) -> Array:
    """The ratio r, ``r B(u/r) = y``, which falls with r as B is convex: bisection of its
    logarithm."""
    low: Array = np.full(len(u), -_LARGEST)
    high: Array = -low
    for _ in range(_BISECTIONS):
        r = np.exp((low + high) / 2)
        stiff = r * curve.at(u / r)[0] > y
        low, high = np.where(stiff, np.log(r), low), np.where(stiff, high, np.log(r))
    return np.exp((low + high) / 2)


def _cubic(x: Array, f: Array, touching: bool = False) -> _Cubic:
    """The monotone cubic, which goes on at its end as between the last nodes; of a ``f`` with nan,
    nan. With ``touching`` a force from first touch at ``x[0] = 0``: half way to the first step it
    is a power of the displacement, whose exponent the first two steps tell."""
    from scipy.interpolate import PchipInterpolator

    if np.isnan(f).any():
        return _Cubic(x, 0 * x + np.nan, 0 * x + np.nan)
    df = PchipInterpolator(x, f)(x, 1)
    df[-1] = max(df[-1], _LEAST * (f[-1] - f[-2]) / (x[-1] - x[-2]), key=abs)
    if touching:
        power = np.log(f[2] / f[1]) / np.log(x[2] / x[1])
        df[0] = max(df[1] + 8 * (0.5**power - 0.5) * f[1] / x[1], 0.0)
    return _Cubic(x, f, df)


def _left_out(x: Array, f: Array) -> Array:
    """What the cubic through every second node is wrong by at the others, ``(n,)``; 0 at both
    ends."""
    error = np.zeros(len(x))
    for begin in (1, 2):
        out = np.arange(begin, len(x) - 1, 2)
        kept = np.delete(np.arange(len(x)), out)
        error[out] = _cubic(x[kept], f[kept], touching=True).at(x[out])[0] - f[out]
    return error


def _steps_asked(x: Array, left_out: Array) -> str:
    """How many steps of first loading leave errors of 1 %, from those ``left_out`` at the steps
    ``x``, which fall with the square of the step's length; below `_EARLY` of the largest x, near
    first touch, they fall far more slowly."""
    worst = float(np.abs(left_out[x > _EARLY * x[-1]]).max())
    where = f"above {_EARLY:.0%} of the largest displacement"
    if worst <= _WANTED:
        return f"the {len(x)} of this run are enough {where}: largest error {worst:.2%}"
    wanted = int(np.ceil(len(x) * np.sqrt(worst / _WANTED)))
    return f"about {wanted} of equal length on first loading, instead of {len(x)}; {where}"


def _around(errors: Array) -> Array:
    """The largest of every one and its neighbours."""
    return np.maximum.reduce([errors, np.append(errors[1:], 0.0), np.append(0.0, errors[:-1])])


def _sizes(errors: Array) -> str:
    """Rms and largest."""
    return f"rms {np.sqrt(np.mean(errors**2)):.2%}, largest {np.abs(errors).max():.2%}"

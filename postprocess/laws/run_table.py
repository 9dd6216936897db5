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
from typing import NamedTuple

import numpy as np

from archord.materials.kinematics import Ints
from archord.materials.material import Array
from archord.postprocess.curve import rms
from archord.postprocess.laws.general.joint_curve import JointCurve, hermite
from archord.postprocess.laws.run_steps import RunSteps, read_steps
from archord.postprocess.run import Run
from archord.report.by_name import ByName
from archord.report.errors import InputError

_ELASTIC = 1e-9  # of the largest force times displacement: nothing was dissipated
_POWER = 1.2  # of the displacement in the force of first touch; contacts of lines have 1.1 to 1.3
_AT_ONCE = 0.1  # of the first step with contact: what is found to begin before begins at 0
_SAME = 1e-9  # of the range: nodes that are one
_FEWEST = 6  # steps of first loading with contact
_FEWEST_BACK = 3  # steps of unloading with contact
# error of ways back that were not solved, over the force they begin at (docs/calibration.md)
_UNSEEN = 0.03
_FELT = 1e-3  # of it, beyond which a way back along first loading is known less well than that
# error at first touch over that at the first step: 5 to 8 % of P against the logarithm of line
# contact
_FIRST = 4.0
_WANTED = 0.01  # error of first loading to be asked for
_EARLY = 0.1  # share of its end from which on it is
_BISECTIONS = 60  # of ln(ratio)
_LARGEST = 7.0  # ln(ratio)
_SOFTER = 0.9  # slope of the way back where it opens over that up to the first step, at most
_LEAST = 1e-3  # slope at an end over the slope of the last two nodes
_REMEDY = "a last target of 0 for the load, as load.displacement = [2.0, 0.0], gives it"


class _Cubic(NamedTuple):
    """A cubic through ``f`` at ``x`` with slopes ``df``, straight on beyond the ends."""

    x: Array
    f: Array
    df: Array

    def at(self, x: Array) -> tuple[Array, Array]:
        """Values and slopes."""
        return hermite(self.x, self.f, self.df, x)


class _WayBack(NamedTuple):
    """The way back: ``curve`` of unloading, its ``ratio`` at the nodes of first loading, the
    ``steps`` (indices) of the unloading that it is of, and what is ``said`` of it."""

    curve: _Cubic
    ratio: Array
    steps: Ints
    said: str


def run_table(run: Run, of: str | None = None) -> JointCurve:
    """The law of ``run``, in the units of `RunSteps`; of a general scene the law of its load
    ``of``. Expected errors are errors of the cubic through every second step, of unloadings that
    were not used, and of mesh and steps, as far as the run knows; ``about`` tells them.

    Raises `InputError` without contact, with fewer than 6 steps of first loading, where the force
    does not rise on it, and if the run yields or rubs and does not unload.
    """
    steps = read_steps(run, of)
    k = _steps_of_loading(steps)
    x = steps.x[k]
    y = steps.y[k]
    before = steps.x[steps.first[: -len(k)]]
    start = _opening(x, y, before)
    if start <= _AT_ONCE * x[0]:
        start = 0.0
    without_force = np.unique([0.0, start])
    displacements = np.append(without_force, x)
    forces = np.append(0 * without_force, y)
    loading = _cubic(displacements, forces, touching=len(without_force) == 1)
    back = _way_back(steps, k, loading)

    tables = _tables(steps, k, loading, back)
    nodes = tables["x"]
    last = slice(-len(k) - 1, None)
    off_cubic = _left_out(loading.x[last] - start, loading.f[last])
    left_out = off_cubic[1:] / y
    of_mesh = steps.mesh_error(loading.df[-len(k) :])
    mesh = np.interp(nodes, x, of_mesh / y)
    sizes = _around(np.abs(left_out))
    at_first_touch = _FIRST * sizes[0]
    of_steps = np.interp(nodes, [start, *x], [at_first_touch, *sizes])
    error = of_steps + mesh
    curve = JointCurve(**tables, error=error, back_error=error)
    measured, said = _errors_back(curve, steps, k, back)
    about = steps.about | {
        "first loading": f"{len(k)} steps to {steps.at(x[-1])}, {steps.load(y[-1])}",
        "contact begins at": steps.at(start),
        "error of first loading": (
            f"{_sizes(left_out)} of P, by the cubic through every second step"
        ),
        "steps for 1 %": _steps_asked(x, left_out),
        "way back": back.said,
        "error of the way back": said,
    }
    if measured is not None:
        back_error = measured + mesh
        if len(back.steps):
            curve = replace(curve, back_error=back_error)
        elif (back_error > error + _FELT).any():  # elastic: it comes back along first loading
            curve = replace(curve, back_error=np.maximum(back_error, error))
    return replace(curve, about=about)


def _steps_of_loading(steps: RunSteps) -> Ints:
    """Indices of the steps of first loading, from the first contact on."""
    first = steps.first
    has_force = steps.y.max(initial=0.0) > 0
    touching = np.flatnonzero(steps.closed[first] & has_force)
    k = first[touching[0] :] if len(touching) else first[:0]
    if len(k) < _FEWEST:
        said = f"has {len(k)} steps of first loading with contact, and a table needs {_FEWEST}"
        raise InputError(steps.run.folder, f"{said}; press further, or in more steps.")
    steps.require_rising(k)
    return k


def _tables(steps: RunSteps, k: Ints, loading: _Cubic, back: _WayBack) -> ByName:
    """All cubics at the nodes of both ways, by their names in `JointCurve`."""
    on_way_back = back.curve.x
    distance = np.abs(on_way_back[:, None] - loading.x).min(axis=1)
    is_new = distance > _SAME * loading.x[-1]
    nodes = np.union1d(loading.x, on_way_back[is_new])
    touched = np.append(k[0], k)
    x = np.append(0.0, steps.x[k])
    root = np.sqrt(steps.y[touched])
    cubics = {
        "y": loading,
        "back": back.curve,
        "ratio": _cubic(loading.x, back.ratio),
        "peak": _cubic(x, steps.peak[touched] / root),
        "angle": _cubic(x, steps.angle[touched] / root),
    }
    sharp = np.zeros(len(nodes))
    tables = {"x": nodes, "toe": sharp, "touch": np.empty(0)}
    for name, cubic in cubics.items():
        tables[name], tables[f"d{name}"] = cubic.at(nodes)
    return tables | steps.units


def _way_back(steps: RunSteps, k: Ints, loading: _Cubic) -> _WayBack:
    """The way back of the largest displacement that the run unloads from after yielding; first
    loading if it does not yield. ``k`` are the steps of ``loading``."""
    start = loading.x[-len(k) - 1]
    least = _ELASTIC * np.ptp(steps.x) * steps.y.max()
    if steps.dissipated.max() <= least:
        _require_way_back(steps, k)
        x, f, df = (values[-len(k) - 1 :] for values in loading)
        same = _Cubic(x - start, f, df)
        ratio: Array = np.ones(len(loading.x))
        return _WayBack(same, ratio, k[:0], "along first loading: elastic")
    way = _last_unloading(steps, k, least)
    closed = steps.closed[way]
    on = way[closed][::-1]  # by rising displacement
    off = way[~closed]
    x = steps.x[on]
    y = steps.y[on]
    z = _opening(x, y, steps.x[off])
    curve = _cubic(np.append(0.0, x - z), np.append(0.0, y), touching=True)
    first = -len(k)  # the first step with contact
    secant = loading.f[first] / (loading.x[first] - start)
    curve.df[0] = min(curve.df[0], _SOFTER * secant)
    deepest = loading.x == x[-1]
    shift = _shift(loading, steps.dissipated[k], _SAME * y[-1])
    opens_later = (z - start) * shift / shift[deepest]
    travel = loading.x - start - opens_later
    ratio = _meeting(curve, travel, loading.f)
    is_touching = loading.x > start
    ratio[~is_touching] = ratio[is_touching][0]
    ratio[deepest] = 1.0
    said = f"from {steps.at(x[-1])} in {len(on)} steps, opens at {steps.at(z)}"
    if not len(off):
        said += f", extended from {steps.load(y[0])} to none"
    return _WayBack(curve, ratio, way, said)


def _require_way_back(steps: RunSteps, k: Ints) -> None:
    """Raise `InputError` of a run that does not yield, but rubs, and never comes back from the
    steps ``k``: it would come back by other forces."""
    rubbed = steps.run.columns.get("friction_dissipation", [0.0])
    if max(rubbed) > 0 and not _unloadings(steps, k):
        raise InputError(
            f"{steps.run.folder}: has friction and never unloads, so its way back is unknown; "
            f"{_REMEDY}."
        )


def _last_unloading(steps: RunSteps, k: Ints, least: float) -> Ints:
    """Indices of the steps of the last unloading from one of the steps ``k`` that has dissipated
    more than ``least``. Raises `InputError` without one of enough steps."""
    folder = steps.run.folder
    ways = [way for way in _unloadings(steps, k) if steps.dissipated[way[0]] > least]
    if not ways:
        remedy = "a last target of 0 for the load, as load.displacement = [2.0, 0.0], gives it"
        raise InputError(
            folder, f"yields and never unloads after, so its way back is unknown; {remedy}."
        )
    way = ways[-1]
    on = way[steps.closed[way]]
    if len(on) < _FEWEST_BACK:
        raise InputError(
            folder, f"unloads in {len(on)} steps with contact, and a table needs {_FEWEST_BACK}."
        )
    steps.require_rising(on[::-1])
    return way


def _shift(loading: _Cubic, dissipated: Array, least: float) -> Array:
    """``int dD/P`` at the nodes of ``loading``, with the dissipation at its last nodes; forces are
    taken to be ``least`` at least."""
    before_contact = np.zeros(len(loading.x) - len(dissipated))
    lost = np.append(before_contact, dissipated)
    force = (loading.f[1:] + loading.f[:-1]) / 2
    shifts = np.diff(lost) / force.clip(least)
    return np.append(0.0, np.cumsum(shifts))


def _errors_back(
    curve: JointCurve, steps: RunSteps, k: Ints, back: _WayBack
) -> tuple[Array | None, str]:
    """Errors at the nodes of the way back from there, over the force it begins at; None of what
    does not yield and has not come back. And in words the errors of the unloadings that ``curve``
    is not made of."""
    errors = {}  # by the displacement that a way back begins at
    for way in _unloadings(steps, k):
        x = steps.x[way]
        y = steps.y[way]
        delta = x * curve.length
        told = curve.at(delta, delta[0]).load / curve.force
        errors[x[0]] = (told - y) / y[0]
    others = dict(errors)
    if len(back.steps):
        others.pop(steps.x[back.steps[0]])
    said = ""
    if others:
        sizes = _sizes(np.concatenate([*others.values()]))
        said = f"{sizes} of the force it begins at, in {len(others)} others"
    if not len(back.steps):
        if not others:
            return None, "the error of first loading"
        return _worst(curve, errors), said
    own = steps.x[back.steps[0]]
    errors[own] = _left_out(back.curve.x, back.curve.f) / back.curve.f[-1]
    worst = _worst(curve, errors)
    unseen = curve.x > own
    if not others:
        unseen |= curve.x < own
        said = f"not measured, as there is no other: {_UNSEEN:.0%} assumed"
    return np.where(unseen, _UNSEEN, worst), said


def _worst(curve: JointCurve, errors: dict[float, Array]) -> Array:
    """The largest of the ``errors`` of each way back, at the nodes that it begins at."""
    known = sorted(errors)
    largest = [np.abs(errors[x]).max() for x in known]
    return np.interp(curve.x, known, largest)


def _unloadings(steps: RunSteps, k: Ints) -> list[Ints]:
    """Indices of the steps of each way back from one of the steps ``k``, which begins it."""
    back = np.append(np.diff(steps.x) < 0, False)
    return [np.arange(i, i + back[i:].argmin() + 1) for i in k if back[i]]


def _opening(x: Array, y: Array, off: Array) -> float:
    """Where a contact of forces ``y`` at rising ``x`` opens: not before the steps without any, at
    ``off``."""
    farther = (y[1] / y[0]) ** (1 / _POWER)  # the second step from there, over the first
    found = x[0] - (x[1] - x[0]) / (farther - 1)
    return float(max(found, off.max(initial=0.0)))


def _meeting(curve: _Cubic, u: Array, y: Array) -> Array:
    """The ratio r, ``r B(u/r) = y``, which falls with r as B is convex: bisection of its
    logarithm."""
    low: Array = np.full(len(u), -_LARGEST)
    high: Array = -low
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        r = np.exp(middle)
        unloading, _ = curve.at(u / r)
        stiff = r * unloading > y
        low = np.where(stiff, middle, low)
        high = np.where(stiff, high, middle)
    return np.exp((low + high) / 2)


def _cubic(x: Array, f: Array, touching: bool = False) -> _Cubic:
    """The monotone cubic, which goes on at its end as between the last nodes; of a ``f`` with nan,
    nan. With ``touching`` a force from first touch at ``x[0] = 0``: half way to the first step it
    is a power of the displacement, whose exponent the first two steps tell."""
    from scipy.interpolate import PchipInterpolator

    if np.isnan(f).any():
        unknown = 0 * x + np.nan
        return _Cubic(x, unknown, unknown)
    df = PchipInterpolator(x, f)(x, 1)
    last = (f[-1] - f[-2]) / (x[-1] - x[-2])
    df[-1] = max(df[-1], _LEAST * last, key=abs)
    if touching:
        grown = np.log(f[2] / f[1])
        farther = np.log(x[2] / x[1])
        power = grown / farther
        bend = 8 * (0.5**power - 0.5)
        steeper = bend * f[1] / x[1]
        df[0] = max(df[1] + steeper, 0.0)
    return _Cubic(x, f, df)


def _left_out(x: Array, f: Array) -> Array:
    """What the cubic through every second node is wrong by at the others, ``(n,)``; 0 at both
    ends."""
    error = np.zeros(len(x))
    for begin in (1, 2):
        out = np.arange(begin, len(x) - 1, 2)
        kept = np.delete(np.arange(len(x)), out)
        value, _ = _cubic(x[kept], f[kept], touching=True).at(x[out])
        error[out] = value - f[out]
    return error


def _steps_asked(x: Array, left_out: Array) -> str:
    """How many steps of first loading leave errors of 1 %, from those ``left_out`` at the steps
    ``x``, which fall with the square of the step's length; below `_EARLY` of the largest x, near
    first touch, they fall far more slowly."""
    is_late = x > _EARLY * x[-1]
    worst = float(np.abs(left_out[is_late]).max())
    where = f"above {_EARLY:.0%} of the largest displacement"
    if worst <= _WANTED:
        return f"the {len(x)} of this run are enough {where}: largest error {worst:.2%}"
    shorter = np.sqrt(worst / _WANTED)
    wanted = int(np.ceil(len(x) * shorter))
    return f"about {wanted} of equal length on first loading, instead of {len(x)}; {where}"


def _around(errors: Array) -> Array:
    """The largest of every one and its neighbours."""
    after = np.append(errors[1:], 0.0)
    before = np.append(0.0, errors[:-1])
    return np.maximum.reduce([errors, after, before])


def _sizes(errors: Array) -> str:
    """Rms and largest."""
    return f"rms {rms(errors):.2%}, largest {np.abs(errors).max():.2%}"

"""The law of one joint as a program of numbers: what ``JointCurve.at`` says, in the few words that
all languages have.

``translate.py`` prints these functions in other languages. So they keep to assignments, ``if``,
and ``for`` with a count that is known before, have one ``return``, of names, at their end, and
change no parameter. What ``WITH_...`` switches off and what is never called is left out of an
export. Tables are in the joint's units; an export has its own instead of those below.
"""

# ruff: noqa: SIM102, SIM108, SIM300, RUF059 (no "and", and a name for every result: words that all
# languages have)

from __future__ import annotations

import math

Table = tuple[float, ...]

WITH_TOUCH = True  # the logarithmic law below the first node
WITH_WAY_BACK = True  # a way back below first loading, after yielding
WITH_TOE = True  # which ends more softly than it begins
WITH_CHORD = False  # a formula for first loading instead of tables
WITH_PLATEAU = False  # which has a largest pressure

LAST = 1  # index of the last node
HALVINGS = 1  # of the table, to find an interval
RANGE = 1.0  # displacement up to which the tables reach
REACH = 1.0  # the same, with what round-off may add
LENGTH = 1.0  # clearance dR
FORCE = 1.0  # unit of force of the logarithmic law
NODES: Table = (0.0, 1.0)  # displacements of the tables
LOAD: Table = (0.0, 1.0)  # force of first loading
LOAD_SLOPE: Table = (1.0, 1.0)
BACK: Table = (0.0, 1.0)  # force of the curve that unloading follows
BACK_SLOPE: Table = (1.0, 1.0)
RATIO: Table = (1.0, 1.0)  # its scale, by the deepest displacement
RATIO_SLOPE: Table = (0.0, 0.0)
TOE: Table = (0.0, 0.0)  # how far before its end the way back bends, by the deepest displacement
TOUCH: Table = (2.0, 0.0, 0.0)  # a, b, c of the logarithmic law
PEAK: Table = (1.0, 1.0)  # largest pressure over the root of the force
PEAK_SLOPE: Table = (0.0, 0.0)
ANGLE: Table = (1.0, 1.0)  # semi-angle over the root of the force
ANGLE_SLOPE: Table = (0.0, 0.0)
RADIUS = 1.0  # radius of the pin
FOUNDATION = 1.0  # largest pressure over displacement of the formula
PLATEAU = 1.0  # its largest pressure
WIDEST = 1.5  # semi-angle that no contact exceeds
ERROR: Table = (0.0, 0.0)  # expected error on first loading, over the force
BACK_ERROR: Table = (0.0, 0.0)  # on the way back, over the largest force


def warn_outside(delta: float) -> None:
    """Say where the law is used beyond its tables: a function of each language's own."""


def infinity_less_infinity(value: float, last: float) -> float:
    """nan, of numbers that are not 0."""
    big = value
    bound = last
    for _ in range(8):
        big = big * 1e100
        bound = bound * 1e100
    nothing = big - bound
    return nothing


def beyond(value: float, last: float) -> float:
    """0 up to last; nan beyond and of nan: added to what is unknown there."""
    doubt = 0.0
    if value <= last:
        doubt = 0.0
    else:
        doubt = infinity_less_infinity(value, last)
    return doubt


def no_number(delta: float, deepest: float) -> float:
    """0, but nan if one of both is nan or infinite."""
    doubt = beyond(delta, 1e300) + beyond(deepest, 1e300)
    return doubt


def unknown(delta: float, deepest: float) -> float:
    """0 where the tables tell of the state, else nan."""
    doubt = beyond(delta, REACH) + beyond(deepest, 1e300)
    if WITH_WAY_BACK:
        if delta > 0:
            doubt = doubt + beyond(deepest, REACH)
    return doubt


def interval(table: Table, value: float) -> int:
    """The last i below the last node with table[i] <= value, or 0: bisection, in as many steps as
    the table may need."""
    low: int = 0
    high: int = LAST
    for _ in range(HALVINGS):
        middle: int = (low + high) // 2
        if table[middle] <= value:
            low = middle
        else:
            high = middle
    return low


def piece(f: Table, df: Table, i: int) -> tuple[float, float, float, float]:
    """Hermite's cubic from node i to the next, f + t (first + t (square + t cube)) with t from 0 to
    1: width, first, square, cube."""
    width = NODES[i + 1] - NODES[i]
    rise = f[i + 1] - f[i]
    first = width * df[i]
    last = width * df[i + 1]
    square = 3 * rise - 2 * first - last
    cube = first + last - 2 * rise
    return width, first, square, cube


def cubic(f: Table, df: Table, x: float) -> tuple[float, float]:
    """Hermite's cubic through f with slopes df at x, and its slope; straight on beyond the last
    node."""
    i: int = interval(NODES, x)
    inside = min(x, NODES[LAST])
    width, first, square, cube = piece(f, df, i)
    t = (inside - NODES[i]) / width
    slope = (first + t * (2 * square + t * 3 * cube)) / width
    value = f[i] + t * (first + t * (square + t * cube)) + slope * (x - inside)
    return value, slope


def straight(f: Table, x: float) -> float:
    """f at x, straight between nodes, constant beyond the last one."""
    i: int = interval(NODES, x)
    t = max(0.0, min((x - NODES[i]) / (NODES[i + 1] - NODES[i]), 1.0))
    value = f[i] * (1 - t) + f[i + 1] * t
    return value


def first_touch(delta: float) -> tuple[float, float]:
    """Force and stiffness of line contact: pi x t - ln(1 + t) = a + b x + c x^2, t = FORCE/P, by
    Newton's method."""
    x = max(delta / LENGTH, 1e-290)
    level = TOUCH[0] + x * (TOUCH[1] + x * TOUCH[2])
    t = (level + math.log(1 + level / (math.pi * x))) / (math.pi * x)
    for _ in range(6):
        t = t - (math.pi * x * t - math.log(1 + t) - level) / (math.pi * x - 1 / (1 + t))
    P = FORCE / t
    stiffness = (
        (math.pi - (TOUCH[1] + 2 * TOUCH[2] * x) / t)
        / (math.pi * x * t - t / (1 + t))
        * FORCE
        / LENGTH
    )
    return P, stiffness


def curve(f: Table, df: Table, delta: float) -> tuple[float, float]:
    """Force and stiffness by the tables f and df; 0 where the joint is open."""
    if delta <= 0:
        P = 0.0
        stiffness = 0.0
    else:
        P, stiffness = cubic(f, df, delta)
        if WITH_TOUCH:
            if delta < NODES[1]:
                P, stiffness = first_touch(delta)
    return P, stiffness


def chord(delta: float) -> tuple[float, float]:
    """Force and stiffness of a parabola of pressure over the chord, cut off at the plateau (Hu et
    al., eqs 9 to 12)."""
    P = 0.0
    stiffness = 0.0
    if delta > 0:
        length = RADIUS * math.sqrt(2 * delta / (LENGTH + delta))
        longer = LENGTH / (2 * (LENGTH + delta))
        peak = FOUNDATION * delta
        P = 4.0 / 3 * peak * length
        stiffness = 4.0 / 3 * FOUNDATION * length * (1 + longer)
        if WITH_PLATEAU:
            if peak > PLATEAU:
                u = PLATEAU / peak
                s = math.sqrt(1 - u)
                flank = u * (2 + s) / (3 * (1 + s) * (1 + s))
                P = 2 * PLATEAU * length * (s + flank)
                stiffness = 2 * PLATEAU * length / delta * (flank + (flank + s) * longer)
    return P, stiffness


def touch_displacement(P: float) -> float:
    """The displacement at which the line contact has the force P > 0: Newton's method."""
    y = P / FORCE
    x = y * (TOUCH[0] + math.log(1 + 1 / y)) / math.pi
    for _ in range(6):
        miss = math.pi * x / y - TOUCH[0] - x * (TOUCH[1] + TOUCH[2] * x) - math.log(1 + 1 / y)
        x = x - miss / (math.pi / y - TOUCH[1] - 2 * TOUCH[2] * x)
    delta = x * LENGTH
    return delta


def table_displacement(P: float) -> float:
    """The displacement between nodes at which the table BACK has the force P: Newton's method,
    bracketed."""
    i: int = interval(BACK, P)
    width, first, square, cube = piece(BACK, BACK_SLOPE, i)
    low = 0.0
    high = 1.0
    t = (P - BACK[i]) / (BACK[i + 1] - BACK[i])
    for _ in range(12):
        miss = BACK[i] + t * (first + t * (square + t * cube)) - P
        slope = first + t * (2 * square + t * 3 * cube)
        if miss < 0:
            low = t
        else:
            high = t
        t = t - miss / max(slope, 1e-100)
        if (t - low) * (high - t) < 0:
            t = (low + high) / 2
    delta = NODES[i] + width * t
    return delta


def back_displacement(P: float) -> float:
    """The displacement at which the curve of unloading has the force P; 0 where P <= 0."""
    delta = 0.0
    if P > BACK[LAST]:
        delta = NODES[LAST] + (P - BACK[LAST]) / BACK_SLOPE[LAST]
    elif P > 0:
        delta = table_displacement(P)
        if WITH_TOUCH:
            if P < BACK[1]:
                delta = touch_displacement(P)
    return delta


def scale(deepest: float) -> float:
    """The clearance of the elastic joint that the joint is on its way back, over its own."""
    ratio, slope = cubic(RATIO, RATIO_SLOPE, deepest)
    ratio = max(ratio, 1e-3)
    return ratio


def way_back(delta: float, deepest: float) -> tuple[float, float]:
    """Force and stiffness below the deepest displacement: r BACK(h(a)/r), which meets first loading
    there."""
    ratio = scale(deepest)
    largest, stiffness = curve(LOAD, LOAD_SLOPE, deepest)
    travel = ratio * back_displacement(largest / ratio)
    a = delta - deepest + travel
    bend = 1.0
    if WITH_TOE:
        toe = straight(TOE, deepest)
        cut = (math.sqrt(2) - 1) * toe
        root = max(math.sqrt(a * a + toe * toe), 1e-300)
        share = travel / max(travel + math.sqrt(travel * travel + toe * toe) - cut, 1e-300)
        bend = share * (1 + a / root)
        a = share * (a + root - cut)
    P, stiffness = curve(BACK, BACK_SLOPE, a / ratio)
    P = ratio * P
    stiffness = bend * stiffness
    return P, stiffness


def force(delta: float, deepest: float = 0.0) -> tuple[float, float]:
    """Force P and stiffness dP/d(delta), nan beyond the tables, after the joint has been as deep as
    deepest."""
    warn_outside(max(delta, deepest))
    if WITH_CHORD:
        P, stiffness = chord(delta)
    else:
        P, stiffness = curve(LOAD, LOAD_SLOPE, delta)
    if WITH_WAY_BACK:
        if delta < deepest:
            below, slope = way_back(delta, deepest)
            if below <= P:
                P = below
                stiffness = slope
    P = P + no_number(delta, deepest)
    stiffness = stiffness + unknown(delta, deepest)
    return P, stiffness


def deeper(deepest: float, delta: float) -> float:
    """The deepest displacement after an accepted step at delta; nan if one of both is nan."""
    deepest_now = max(deepest, delta) + no_number(delta, deepest)
    return deepest_now


def residual(deepest: float) -> float:
    """The displacement at which the joint opens on its way back: residual clearance."""
    z = beyond(deepest, 1e300)
    if WITH_WAY_BACK:
        start = max(deepest, 0.0)
        ratio = scale(start)
        largest, slope = curve(LOAD, LOAD_SLOPE, start)
        z = start - ratio * back_displacement(largest / ratio)
        if WITH_TOE:
            z = z - straight(TOE, start)
        z = max(z, 0.0) + beyond(deepest, REACH)
    return z


def expected_error(delta: float, deepest: float = 0.0) -> float:
    """The error of the force, in its unit, below which 9 of 10 joints stay; nan beyond the
    tables."""
    place = delta
    share = straight(ERROR, delta)
    if WITH_WAY_BACK:
        if delta < deepest:
            place = deepest
            share = straight(BACK_ERROR, deepest)
    P, slope = curve(LOAD, LOAD_SLOPE, place)
    error = P * share
    if delta <= 0:
        error = 0.0
    error = error + unknown(delta, deepest)
    return error


def peak_pressure(delta: float) -> float:
    """The largest contact pressure on first loading; nan beyond the tables."""
    P, slope = curve(LOAD, LOAD_SLOPE, delta)
    root, slope = cubic(PEAK, PEAK_SLOPE, max(delta, 0.0))
    p0 = root * math.sqrt(P) + beyond(delta, REACH)
    return p0


def contact_angle(delta: float) -> float:
    """The semi-angle of the contact [rad] on first loading; nan beyond the tables."""
    P, slope = curve(LOAD, LOAD_SLOPE, delta)
    root, slope = cubic(ANGLE, ANGLE_SLOPE, max(delta, 0.0))
    angle = min(root * math.sqrt(P), WIDEST) + beyond(delta, REACH)
    return angle

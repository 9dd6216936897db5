"""The force between pin and hole as a vector, with its Jacobian: what users put into a program of
rigid bodies. Translated like ``algorithm.py``, and written in the same few words.

The quasi-static force is minus the gradient of an energy ``W(delta, D)`` at frozen memory, ``delta
= |e| - dR``, where ``e`` goes from the hole's centre to the pin's and ``D`` is the deepest
displacement in its direction. A joint that has been as deep as D is the elastic joint ``BACK`` of
another clearance and origin:

    W = r^2 B((delta - z)/r),    B = int BACK,    r = RATIO(D), z = SHIFT(D).

First loading is where D = delta. As D differs from one direction to the next, the force has a part
across e as well, ``-(dW/dD) (dD/dtheta)/|e|``, which draws the pin into the dent. ``D`` only grows,
and ``dW/dD <= 0`` (``dents.py`` sees to it): no path gains energy.
"""

# ruff: noqa: SIM102, RUF059 (as in algorithm.py)

from __future__ import annotations

import math

from archord.postprocess.laws.exports.algorithm import (
    BACK,
    BACK_SLOPE,
    FORCE,
    LAST,
    LENGTH,
    LOAD,
    LOAD_SLOPE,
    NODES,
    RADIUS,
    RATIO,
    RATIO_SLOPE,
    TOUCH,
    WITH_CHORD,
    WITH_TOUCH,
    WITH_WAY_BACK,
    Table,
    beyond,
    chord,
    cubic,
    curve,
    interval,
    piece,
    warn_outside,
)

SECTORS = 72  # directions whose deepest displacement is remembered
SECTOR = 2 * math.pi / SECTORS
SMOOTHED = (2 + math.cos(SECTOR)) / 3  # of a cosine at the sectors, by the spline through them
FADED = 3.0  # slip speed from which friction is dynamic, over the speed of sticking
SHIFT: Table = (0.0, 0.0)  # displacement at which the way back opens, by the deepest one
SHIFT_SLOPE: Table = (0.0, 0.0)
STORED: Table = (0.0, 0.5)  # energy of the curve that unloading follows


def hunt_crossley(restitution: float, speed: float) -> float:
    """The damping c of the factor 1 + c d(delta)/dt that leaves this coefficient of restitution to
    an impact of this speed: 3/2 (1 - e)/v (Hunt and Crossley 1975)."""
    damping = 3.0 / 2 * (1 - restitution) / speed
    return damping


def lankarani_nikravesh(restitution: float, speed: float) -> float:
    """The damping c by the energy lost: 3/4 (1 - e^2)/v (Lankarani and Nikravesh 1990)."""
    damping = 3.0 / 4 * (1 - restitution * restitution) / speed
    return damping


def sector(k: int) -> int:
    """The sector k, counted on past the last one and back past the first."""
    place: int = k
    if k < 0:
        place = k + SECTORS
    if k >= SECTORS:
        place = k - SECTORS
    return place


def sector_deeper(deepest: float, k: int, ex: float, ey: float) -> float:
    """The deepest displacement of sector k after an accepted step at e: how far the pin has pushed
    the hole in this direction."""
    doubt = beyond(deepest, 1e300) + beyond(abs(ex) + abs(ey), 1e300)
    deepest_now = deepest
    if math.sqrt(ex * ex + ey * ey) > LENGTH:
        angle = k * SECTOR - math.pi
        pushed = (ex * math.cos(angle) + ey * math.sin(angle)) / SMOOTHED - LENGTH
        if pushed > deepest:
            deepest_now = pushed
    deepest_now = deepest_now + doubt
    return deepest_now


def remembered(dents: Table, angle: float) -> tuple[float, float, float]:
    """The deepest displacement in a direction, with its first and second derivative by the angle: a
    cubic B-spline of the sectors."""
    place = (angle + math.pi) / SECTOR
    i: int = int(place)
    t = place - i
    a = dents[sector(i - 1)]
    b = dents[sector(i)]
    c = dents[sector(i + 1)]
    d = dents[sector(i + 2)]
    left = b - a
    middle = c - b
    right = d - c
    deepest = (a + 4 * b + c) / 6 + t * (
        (left + middle) / 2 + t * ((middle - left) / 2 + t * (right - 2 * middle + left) / 6)
    )
    turn = (left + middle + t * (2 * (middle - left) + t * (right - 2 * middle + left))) / 2
    bend = middle - left + t * (right - 2 * middle + left)
    turn = turn / SECTOR
    bend = bend / (SECTOR * SECTOR)
    return deepest, turn, bend


def curvature(f: Table, df: Table, x: float) -> float:
    """The second derivative of `cubic`."""
    i: int = interval(NODES, x)
    width, first, square, cube = piece(f, df, i)
    t = (x - NODES[i]) / width
    bend = (2 * square + 6 * t * cube) / (width * width)
    return bend


def touch_energy(x: float, P: float, stiffness: float) -> float:
    """The energy of the logarithmic law: int y dx by parts, with the small int y^2 dF as of a power
    of x."""
    y = P / FORCE
    u = x / LENGTH
    power = u * LENGTH * stiffness / P
    rise = u * y * y * (TOUCH[1] / (2 * power + 1) + 2 * TOUCH[2] * u / (2 * power + 2))
    energy = FORCE * LENGTH / (2 * math.pi) * (math.pi * u * y - y + math.log(1 + y) + rise)
    return energy


def energy_of_back(x: float, P: float, stiffness: float) -> float:
    """The energy of the curve BACK up to x, where it has this force and stiffness."""
    energy = 0.0
    if x > 0:
        i: int = interval(NODES, x)
        inside = min(x, NODES[LAST])
        over = x - inside
        width, first, square, cube = piece(BACK, BACK_SLOPE, i)
        t = (inside - NODES[i]) / width
        mean = BACK[i] + t * (first / 2 + t * (square / 3 + t * cube / 4))
        energy = STORED[i] + width * t * mean
        energy = energy + over * (P - stiffness * over / 2)
        if WITH_TOUCH:
            if x < NODES[1]:
                energy = touch_energy(x, P, stiffness)
    return energy


def elastic_energy(delta: float, deepest: float) -> float:
    """The energy W that the joint gives back from delta <= deepest."""
    ratio, slope = cubic(RATIO, RATIO_SLOPE, deepest)
    shift, slope = cubic(SHIFT, SHIFT_SLOPE, deepest)
    x = (delta - shift) / ratio
    P, stiffness = curve(BACK, BACK_SLOPE, x)
    energy = ratio * ratio * energy_of_back(x, P, stiffness)
    return energy


def elastic(delta: float, deepest: float) -> tuple[float, float, float, float, float]:
    """Derivatives of the energy W at delta <= deepest: by delta, by deepest; and second ones, by
    delta, by both, by deepest."""
    ratio, thinner = cubic(RATIO, RATIO_SLOPE, deepest)
    shift, opener = cubic(SHIFT, SHIFT_SLOPE, deepest)
    thinner2 = curvature(RATIO, RATIO_SLOPE, deepest)
    opener2 = curvature(SHIFT, SHIFT_SLOPE, deepest)
    x = (delta - shift) / ratio
    back, stiffness = curve(BACK, BACK_SLOPE, x)
    energy = energy_of_back(x, back, stiffness)
    recedes = opener + thinner * x
    P = ratio * back
    loss = ratio * (2 * thinner * energy - back * recedes)
    softer = thinner * back - stiffness * recedes
    loss2 = (
        2 * thinner * (thinner * energy - back * recedes)
        + stiffness * recedes * recedes
        + ratio * (2 * thinner2 * energy - back * (opener2 + thinner2 * x))
    )
    return P, loss, stiffness, softer, loss2


def first_loading(delta: float) -> tuple[float, float]:
    """Force and stiffness where the joint is as deep as never before."""
    if WITH_CHORD:
        P, stiffness = chord(delta)
    else:
        if WITH_WAY_BACK:
            P, loss, stiffness, softer, loss2 = elastic(delta, min(delta, NODES[LAST]))
            if delta < NODES[LAST]:
                stiffness = stiffness + softer
        else:
            P, stiffness = curve(LOAD, LOAD_SLOPE, delta)
    return P, stiffness


def pressed(dents: Table, angle: float, delta: float) -> tuple[float, float, float, float, float]:
    """Derivatives of the energy at frozen memory: by delta (the force P), by the angle; and second
    ones, by delta, by both, by the angle."""
    turn_force = 0.0
    mixed = 0.0
    turn_stiffness = 0.0
    if WITH_WAY_BACK:
        deepest, turn, bend = remembered(dents, angle)
        if deepest > NODES[LAST]:
            deepest = NODES[LAST]
            turn = 0.0
            bend = 0.0
        P, loss, stiffness, softer, loss2 = elastic(min(delta, deepest), deepest)
        if delta > deepest:
            P, stiffness = first_loading(delta)
            loss2 = loss2 + softer
            softer = 0.0
        turn_force = loss * turn
        mixed = softer * turn
        turn_stiffness = loss2 * turn * turn + loss * bend
    else:
        P, stiffness = first_loading(delta)
    return P, turn_force, stiffness, mixed, turn_stiffness


def damped(rate: float, damping: float) -> tuple[float, float]:
    """The factor 1 + c d(delta)/dt of the force and its derivative by the rate; below 1/2 it goes
    on as a hyperbola, so that it is never negative."""
    u = damping * rate
    factor = 1 + u
    slope = damping
    if u < -0.5:
        factor = -0.25 / u
        slope = 0.25 * damping / (u * u)
    return factor, slope


def friction(
    slip: float, mu_static: float, mu_dynamic: float, stick_speed: float
) -> tuple[float, float]:
    """The coefficient of friction with the sign of the slip speed, and its derivative: it rises to
    the static one at the speed of sticking, and falls to the dynamic one at FADED times this speed,
    both along cubic steps."""
    w = abs(slip) / stick_speed
    mu = mu_static * w * (3 - w * w) / 2
    slope = 1.5 * mu_static * (1 - w * w)
    if w > 1:
        t = min((w - 1) / (FADED - 1), 1.0)
        mu = mu_static - (mu_static - mu_dynamic) * t * t * (3 - 2 * t)
        slope = (mu_dynamic - mu_static) * 6 * t * (1 - t) / (FADED - 1)
    if slip < 0:
        mu = -mu
    slope = slope / stick_speed
    return mu, slope


def turned(
    nn: float, nt: float, tn: float, tt: float, nx: float, ny: float
) -> tuple[float, float, float, float]:
    """The matrix with these entries along n and across it, in x and y: xx, xy, yx, yy."""
    xx = nn * nx * nx - (nt + tn) * nx * ny + tt * ny * ny
    xy = nn * nx * ny + nt * nx * nx - tn * ny * ny - tt * nx * ny
    yx = nn * nx * ny - nt * ny * ny + tn * nx * nx - tt * nx * ny
    yy = nn * ny * ny + (nt + tn) * nx * ny + tt * nx * nx
    return xx, xy, yx, yy


def stored_energy(dents: Table, ex: float, ey: float) -> float:
    """The energy that the joint would give back from an accepted position, until it opens."""
    distance = math.sqrt(ex * ex + ey * ey)
    delta = distance - LENGTH
    energy = 0.0
    none = beyond(distance, 1e300)
    if delta > 0:
        if WITH_WAY_BACK:
            deepest, turn, bend = remembered(dents, math.atan2(ey, ex))
            energy = elastic_energy(delta, min(max(delta, deepest), NODES[LAST]))
            none = none + beyond(deepest, 1e300)
        else:
            P, stiffness = curve(BACK, BACK_SLOPE, delta)
            energy = energy_of_back(delta, P, stiffness)
    energy = energy + none
    return energy


def forces(
    dents: Table,
    ex: float,
    ey: float,
    vx: float,
    vy: float,
    omega: float,
    damping: float,
    mu_static: float,
    mu_dynamic: float,
    stick_speed: float,
) -> tuple[float, ...]:
    """Force and torque on the pin at eccentricity e with its rate v and the angular velocity of the
    pin less the hole's; and their derivatives by e, v and omega."""
    distance = math.sqrt(ex * ex + ey * ey)
    delta = distance - LENGTH
    warn_outside(delta)
    none = beyond(distance, 1e300) + beyond(abs(vx) + abs(vy) + abs(omega), 1e300)
    far = max(distance, LENGTH)
    nx = ex / far
    ny = ey / far
    rate = nx * vx + ny * vy + none
    across = nx * vy - ny * vx
    P = 0.0
    turn_force = 0.0
    stiffness = 0.0
    mixed = 0.0
    turn_stiffness = 0.0
    if delta > 0:
        P, turn_force, stiffness, mixed, turn_stiffness = pressed(dents, math.atan2(ey, ex), delta)
    factor, gain = damped(rate, damping)
    mu, steep = friction(across + omega * RADIUS, mu_static, mu_dynamic, stick_speed)
    N = P * factor
    side = -turn_force / far - mu * N
    Fx = -N * nx - side * ny
    Fy = -N * ny + side * nx
    torque = -mu * N * RADIUS
    N_e = stiffness * factor
    N_turn = (mixed * factor + P * gain * across) / far
    mu_turn = -steep * rate / far
    side_e = (turn_force / far - mixed) / far - mu * N_e
    side_turn = -turn_stiffness / (far * far) - mu * N_turn - mu_turn * N
    Fx_ex, Fx_ey, Fy_ex, Fy_ey = turned(
        -N_e, -N_turn - side / far, side_e, side_turn - N / far, nx, ny
    )
    T_e = -RADIUS * mu * N_e
    T_turn = -RADIUS * (mu * N_turn + mu_turn * N)
    T_ex = T_e * nx - T_turn * ny
    T_ey = T_e * ny + T_turn * nx
    N_v = P * gain
    rub = steep * N
    Fx_vx, Fx_vy, Fy_vx, Fy_vy = turned(-N_v, 0.0, -mu * N_v, -rub, nx, ny)
    T_vx = -RADIUS * (mu * N_v * nx - rub * ny)
    T_vy = -RADIUS * (mu * N_v * ny + rub * nx)
    Fx_omega = rub * RADIUS * ny
    Fy_omega = -rub * RADIUS * nx
    T_omega = -rub * RADIUS * RADIUS
    return (
        Fx,
        Fy,
        torque,
        Fx_ex,
        Fx_ey,
        Fx_vx,
        Fx_vy,
        Fx_omega,
        Fy_ex,
        Fy_ey,
        Fy_vx,
        Fy_vy,
        Fy_omega,
        T_ex,
        T_ey,
        T_vx,
        T_vy,
        T_omega,
    )

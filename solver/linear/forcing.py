"""How accurately Newton's linear systems are solved where they are solved by iterations."""

from __future__ import annotations

from collections.abc import Sequence

LOOSEST = 2e-3  # residual of a linear system over its right-hand side
# powers of the last reduction of the residual of Newton's method
AS_NEWTON = 2.0  # what is left is as large as the residual to which that converges
BELOW_NEWTON = 2.5  # it hardly counts, where an iteration of Krylov's method costs little
_MARGIN = 0.01  # of the goal: what the last linear system may leave, as reactions fall meanwhile


def forcing_term(
    residuals: Sequence[float], goal: float, *, is_linear: bool, power: float = AS_NEWTON
) -> float:
    """Residual over right-hand side to which the next linear system is solved, after these
    ``residuals`` of Newton's method, which is to reach the ``goal``.

    It falls with the residuals as this ``power`` of the last reduction, so that Newton's method
    stays superlinear (Eisenstat and Walker 1996, 2.6), and no further than the goal needs. A system
    that ``is_linear`` goes there at once.
    """
    now = residuals[-1]
    if not now > 0:
        return LOOSEST
    needed = _MARGIN * goal / now
    wanted = 0.0
    if not is_linear:
        reduction = now / residuals[-2] if len(residuals) > 1 else 1.0
        wanted = reduction**power
    return min(LOOSEST, max(needed, wanted))

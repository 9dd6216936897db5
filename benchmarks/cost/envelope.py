"""What a code's best choices cost: error against seconds, and how two codes compare at the same error."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

Pairs = list[tuple[float, float]]


def lasting(errors: Sequence[float | None]) -> list[float | None]:
    """The errors of a series, coarse to fine, with each as large as any that follows on a finer mesh.

    An error that happens to pass through zero on one mesh proves nothing of the method. Unknown errors stay None.
    """
    found: list[float | None] = []
    worst = 0.0
    for error in reversed(errors):
        worst = worst if error is None else max(worst, error)
        found.append(None if error is None else worst)
    return found[::-1]


def envelope(pairs: Iterable[tuple[float, float]]) -> Pairs:
    """Those of the pairs (seconds, error) that no other beats in both, in the order of their seconds."""
    kept: Pairs = []
    for seconds, error in sorted(pairs):
        if not kept or error < kept[-1][1]:
            kept.append((seconds, error))
    return kept


def seconds_at(error: float, kept: Pairs) -> float | None:
    """Seconds to ``error`` along an envelope, straight in log-log; None if it does not get there.

    Nothing is extrapolated: errors above that of the cheapest point cost what it costs.
    """
    if not kept or error < kept[-1][1]:
        return None
    seconds, errors = np.log([max(s, 1e-300) for s, _ in kept]), np.log([max(e, 1e-300) for _, e in kept])
    return float(np.exp(np.interp(np.log(error), errors[::-1], seconds[::-1])))

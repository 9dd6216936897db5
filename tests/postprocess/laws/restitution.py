"""The restitution of an elastic impact with the damping of Hunt and Crossley, and of Lankarani and
Nikravesh: ``python3 -m tests.postprocess.laws.restitution`` prints docs/law_exports.md's table."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from archord.postprocess.laws.exports.element import (
    damped,
    hunt_crossley,
    lankarani_nikravesh,
)


def restitution(damping: float) -> float:
    """The speed after an impact of speed 1: the work of the force P f(v) is ``int P d(delta)`` both
    ways, so ``int v/f(v) dv`` is the same."""

    def passed(v: float) -> float:
        speeds, weights = np.polynomial.legendre.leggauss(80)
        at = v * (speeds + 1) / 2
        factors = np.array([damped(float(speed), damping)[0] for speed in at])
        return float(abs(v) / 2 * (weights @ (np.abs(at) / factors)))

    return float(brentq(lambda v: passed(-v) - passed(1.0), 1e-6, 1.0, xtol=1e-9))


def main() -> None:
    """Print the table."""
    for asked in (0.95, 0.9, 0.8, 0.7, 0.5, 0.3):
        found = [restitution(law(asked, 1.0)) for law in (hunt_crossley, lankarani_nikravesh)]
        print(f"| {asked:.2f} | {found[0]:.2f} | {found[1]:.2f} |")


if __name__ == "__main__":
    main()

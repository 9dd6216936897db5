"""By how much a deeper cycle may lose less energy than a shallower one by the general law, and by
how much its residual clearance may be smaller: of joints that the law is fitted to.

    python3 -m archord.benchmarks.law_cycles
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import trapezoid

from archord.materials.material import Array
from archord.postprocess.laws.general.general_law import law_of_numbers
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.general.yield_model import Numbers, stored_joints

_EACH = 20  # of the joints
_DEPTHS = np.linspace(0.1, 3.0, 59)  # dR
_POINTS = 600  # of a cycle


def falls(law: JointCurve) -> tuple[float, float]:
    """The largest falls with depth of the energy lost, over the work of loading, and of the
    residual clearance [dR]."""
    lost = []
    work = []
    for deepest in _DEPTHS:
        x = np.linspace(0.0, deepest, _POINTS)
        load = law.at(x).load
        work.append(trapezoid(load, x))
        lost.append(trapezoid(load - law.at(x, deepest).load, x))
    energy = _fall(np.array(lost)) / np.array(work)
    return float(energy.max()), float(_fall(law.residual(_DEPTHS)).max())


def _fall(values: Array) -> Array:
    """How far each of ``values`` ``(n,)`` is below the largest before it."""
    return np.maximum.accumulate(values) - values


def main() -> None:
    """Print the largest falls."""
    numbers = np.unique(stored_joints().numbers, axis=0)[::_EACH]
    energy, residual = np.array([falls(law_of_numbers(Numbers(*each))) for each in numbers]).T
    print(f"{len(numbers)} joints: a deeper cycle loses less in {(energy > 1e-6).mean():.0%},")
    print(f"by up to {energy.max():.2%} of the work of loading, and opens earlier by up to")
    print(
        f"{residual.max():.2f} dR ({np.mean(residual > 0.01):.0%} of the joints by more than 0.01)"
    )


if __name__ == "__main__":
    main()

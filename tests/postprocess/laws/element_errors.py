"""How far the force element is from the law's own force on a straight way, on joints drawn at
random: ``python3 -m tests.postprocess.laws.element_errors`` prints numbers of docs/law_exports.md.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator

import numpy as np

from archord.postprocess.laws.exports import dents
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve, hermite

JOINTS = 150


def joints() -> Iterator[JointCurve]:
    """Joints within the range of the general law that come back in another way than they went: a
    body yields, or, in half of them each, contact has friction or strain is large."""
    rng = np.random.default_rng(3)
    while True:
        unit = 1e4
        yields = [None if rng.random() < 0.3 else unit * s for s in rng.uniform(0.2, 1.5, 2)]
        clearance = 10 ** rng.uniform(-3, -1.7)
        joint = LawJoint(
            1.0,
            clearance,
            unit / clearance,
            *yields,
            pin_share=rng.uniform(0.1, 0.75),
            plane=str(rng.choice(["strain", "stress"])),
            nu=rng.uniform(0, 0.49),
            pin_nu=rng.uniform(0, 0.49),
            friction=rng.choice([0.0, rng.uniform(0, 0.3)]),
            large_strain=bool(rng.random() < 0.5),
        )
        try:
            law = general_law(joint)
        except ValueError:
            continue
        if law.yields:
            yield law


def errors(law: JointCurve) -> tuple[float, float]:
    """The largest difference on first loading, and on three ways back, over the largest force."""
    shift, slope = dents.shift(law)

    def element(x: np.ndarray, deepest: np.ndarray) -> np.ndarray:
        ratio, _ = hermite(law.x, law.ratio, law.dratio, deepest)
        opens, _ = hermite(law.x, shift, slope, deepest)
        return ratio * law._curve(law.back, law.dback, np.maximum((x - opens) / ratio, 0.0))[0]

    def miss(x: np.ndarray, deepest: np.ndarray) -> float:
        wanted = law.at(x * law.length, deepest * law.length).load / law.force
        return float(np.abs(element(x, deepest) - wanted).max() / wanted.max())

    x = np.linspace(1e-3, law.x[-1], 3000)
    back = [miss(np.linspace(0.0, most, 200), np.full(200, most)) for most in (1.0, 2.0, 3.0)]
    return miss(x, x), max(back)


def main() -> None:
    """Print median, 9 in 10 and largest."""
    warnings.simplefilter("ignore")
    found = [errors(law) for law, _ in zip(joints(), range(JOINTS), strict=False)]
    for name, values in zip(("first loading", "way back"), np.transpose(found), strict=True):
        median, usual, largest = np.quantile(values, [0.5, 0.9, 1.0])
        print(f"{name}: median {median:.2%}, 9 in 10 within {usual:.2%}, largest {largest:.2%}")


if __name__ == "__main__":
    main()

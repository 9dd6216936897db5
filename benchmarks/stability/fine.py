"""Fine-mesh values for the stability benchmark: ``python3 -m archord.benchmarks.stability.fine``.

Solves the joints of the cases that ``fine.json`` lacks on fine meshes, and writes the quantities of their last step
there, by case.
"""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path

from archord.benchmarks.case import quantities, varied
from archord.benchmarks.stability.cases import FINE, cases
from archord.scene.scene import Scene

Values = dict[str, dict[str, float]]  # by case and quantity
FILE = Path(__file__).with_name("fine.json")
_SIZE, _TINY = 0.025, 0.0025  # element size over R, where a few elements of 10 %R touch
_TINY_LOAD = 0.02  # delta/dR up to which the contact is tiny


def fine_scene(scene: Scene) -> Scene:
    """The joint of ``scene`` with equal elements of 2.5 %R (0.25 %R for tiny contacts) or half as large, the default
    gamma factor and, if it can yield, at least 20 and at least twice as many steps."""
    given = scene.joint
    tiny = not scene.force_controlled and 0 < max(scene.targets) <= _TINY_LOAD * given.dR
    size = _TINY if tiny else min(_SIZE, given.h / given.radius / 2) if given.size_ratio == 1 else _SIZE
    joint = {"element_size": None, "relative_element_size": size, "size_ratio": None}
    return varied(
        scene,
        joint=joint | ({"growth": 1.0} if tiny else {}),
        analysis={"gamma_factor": None},
        load={"steps": [max(20, 2 * n) for n in scene.load.leg_steps]} if scene.plastic else {},
    )


def read_fine() -> Values:
    """The stored values."""
    return json.loads(FILE.read_text(encoding="utf-8"))


def main() -> None:
    """Solve what is missing, and write after each. Raises RuntimeError if a run stops."""
    known, values = cases(), read_fine()
    for name, case in known.items():
        if name not in values and any(expected.value == FINE for expected in case.expected):
            fine = replace(case, scene=fine_scene(case.scene))
            with tempfile.TemporaryDirectory() as folder:
                values[name] = quantities(fine.scene, fine.solve(Path(folder)).steps[-1])
            print(f"{case.group}: {name}: {values[name]}", flush=True)
            kept = {other: values[other] for other in known if other in values}
            FILE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

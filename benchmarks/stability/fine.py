"""Fine-mesh values for the stability benchmark: ``python3 -m archord.benchmarks.stability.fine [PATTERN]``.

Solves the joints of the cases (those that are missing, or those whose name or group matches PATTERN) on fine meshes
and writes ``fine.json``: by case the quantities of the last step, the element size over R and the number of steps.
"""

from __future__ import annotations

import json
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from archord.benchmarks.case import Case, matches, quantities, varied
from archord.benchmarks.stability.cases import FINE, cases
from archord.scene.file import resolved
from archord.scene.scene import Scene

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


def read_fine() -> dict[str, dict[str, float]]:
    """The stored values by case and quantity."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def _solve(case: Case) -> dict[str, float]:
    """What is stored of a case that has its fine scene. Raises RuntimeError if its run stopped."""
    with tempfile.TemporaryDirectory() as folder:
        steps = case.solve(Path(folder)).steps
    mesh = {"element_size/R": case.scene.joint.h / case.scene.joint.radius, "steps": len(steps)}
    return quantities(case.scene, steps[-1]) | mesh


def main(pattern: str = "") -> None:
    """Solve what is asked for and write after each."""
    known = cases()
    fine = {
        name: replace(case, scene=fine_scene(case.scene))
        for name, case in known.items()
        if any(expected.value == FINE for expected in case.expected)
    }
    values = read_fine()
    wanted = [c for c in fine.values() if (matches(pattern, c.name, c.group) if pattern else c.name not in values)]
    # cases that differ in gamma, mesh or steps only have the same fine scene
    same = {} if pattern else {resolved(fine[name].scene): values[name] for name in values if name in fine}
    for case in wanted:
        begun, scene = perf_counter(), resolved(case.scene)
        try:
            same[scene] = values[case.name] = same.get(scene) or _solve(case)
        except RuntimeError as error:
            print(error, flush=True)
            continue
        print(f"{perf_counter() - begun:6.1f} s  {case.group}: {case.name}: {same[scene]}", flush=True)
        kept = {name: values[name] for name in known if name in values}
        FILE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])

"""Fine-mesh values for the stability benchmark: ``python3 -m archord.benchmarks.stability.fine [PATTERN]``.

Solves the joints of the cases (those that are missing, or those whose name or group contains PATTERN) again on fine
meshes and writes ``fine.json``: by case the quantities of the last step, the element size over R and the
number of steps.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from archord.benchmarks.stability.cases import FINE, Case, cases
from archord.benchmarks.stability.run import quantities
from archord.output.run import solve_scene
from archord.scene.file import parse_scene, resolved
from archord.scene.scene import Scene

FILE = Path(__file__).with_name("fine.json")
_SIZE, _TINY = 0.025, 0.0025  # element size over R, where a few elements of 10 %R touch
_TINY_LOAD = 0.02  # delta/dR up to which the contact is tiny


def fine_scene(scene: Scene) -> Scene:
    """The joint of ``scene`` with equal elements of 2.5 %R (0.25 %R for tiny contacts) or half as large, the default
    gamma factor and, if it can yield, at least 20 and at least twice as many steps."""
    load, joint = scene.load, scene.joint
    data = scene.model_dump(exclude_none=True)
    tiny = not scene.force_controlled and 0 < max(scene.targets) <= _TINY_LOAD * joint.dR
    for key in ("element_size", "size_ratio"):
        data["joint"].pop(key, None)
    size = _TINY if tiny else min(_SIZE, joint.h / joint.radius / 2) if joint.size_ratio == 1 else _SIZE
    data["joint"] |= {"relative_element_size": size} | ({"growth": 1.0} if tiny else {})
    data["analysis"].pop("gamma_factor")
    if scene.plastic:
        data["load"]["steps"] = [max(20, 2 * n) for n in load.leg_steps]
    return parse_scene(data)


def read_fine() -> dict[str, dict[str, float]]:
    """The stored values by case and quantity."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def _solve(case: Case) -> dict[str, float]:
    scene = fine_scene(case.scene)
    with tempfile.TemporaryDirectory() as folder:
        outcome = solve_scene(scene, Path(folder))
    if outcome.status == "interrupted":
        raise KeyboardInterrupt
    if outcome.status != "done":
        raise RuntimeError(f"{case.name}: {outcome.message}")
    mesh = {"element_size/R": scene.joint.h / scene.joint.radius, "steps": len(outcome.steps)}
    return quantities(scene, outcome.steps[-1]) | mesh


def main(pattern: str = "") -> None:
    """Solve what is asked for and write after each."""
    known = cases()
    compared = [c for c in known.values() if any(e.value == FINE for e in c.expected)]
    if pattern:
        wanted = [c for c in compared if pattern in f"{c.group}: {c.name}"]
    else:
        wanted = [c for c in compared if c.name not in read_fine()]
    # cases that differ in gamma, mesh or steps only have the same fine scene
    same = {resolved(fine_scene(known[n].scene)): v for n, v in read_fine().items() if n in known and not pattern}
    for case in wanted:
        begun = perf_counter()
        try:
            found = same.get(resolved(fine_scene(case.scene))) or _solve(case)
        except RuntimeError as error:
            print(error, flush=True)
            continue
        print(f"{perf_counter() - begun:6.1f} s  {case.group}: {case.name}: {found}", flush=True)
        same[resolved(fine_scene(case.scene))] = found
        values = read_fine() | {case.name: found}
        kept = {name: values[name] for name in known if name in values}
        FILE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])

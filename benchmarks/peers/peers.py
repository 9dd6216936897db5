"""archord beside CalculiX on one mesh, as a table: ``python3 -m archord.benchmarks.peers.peers`` (docs/peers.md)."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

from archord.benchmarks.case import paper_joint
from archord.benchmarks.peers.calculix import SecondOpinion, require_calculix, run_calculix
from archord.benchmarks.peers.deck_mesh import Elements, deck_mesh
from archord.output.measures import Measures
from archord.output.run import solve_scene
from archord.scene.errors import InputError
from archord.scene.scene import Scene

_HEADINGS = (
    "case", "element", "dofs", "P/(E* R): archord", "CalculiX", "difference", "p0/E*: archord", "CalculiX",
    "PEEQ max: archord", "CalculiX", "PEEQ integral/R2: archord", "CalculiX", "seconds: archord", "CalculiX",
)  # fmt: skip


def cases() -> Iterator[tuple[str, Scene]]:
    """The paper's joint, elastic and plastic (sigY/E* = 0.2 %, perfect), in plane strain and plane stress; E* = 1."""
    for plane in ("strain", "stress"):
        solid = {} if plane == "strain" else {"E": 2.0}
        for name, steps, yield_stress in (("elastic", 4, None), ("plastic", 20 if plane == "strain" else 10, 0.002)):
            scene = paper_joint(0.04, steps, yield_stress, pin=solid, block=solid, analysis={"plane": plane})
            yield f"plane {plane}, {name}", scene


def ours(scene: Scene) -> tuple[Measures, float]:
    """archord's last step, and its seconds from meshing on. Raises RuntimeError if it does not get there."""
    start = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        outcome = solve_scene(scene, Path(folder))
    if outcome.status != "done":
        raise RuntimeError(outcome.message)
    return outcome.steps[-1], perf_counter() - start


def theirs(scene: Scene, elements: Elements, thick: float | None = None) -> tuple[SecondOpinion, int]:
    """CalculiX's results on archord's mesh, and its degrees of freedom in the plane; ``thick`` as in `run_calculix`."""
    mesh = deck_mesh(scene, elements)
    with tempfile.TemporaryDirectory() as folder:
        return run_calculix(scene, mesh, Path(folder), thick=thick), 2 * len(mesh.x)


def row(name: str, scene: Scene, elements: Elements, m: Measures, seconds: float, thick: float | None = None) -> str:
    """One line of the table, which says so if CalculiX does not get to the end."""
    try:
        c, dofs = theirs(scene, elements, thick)
    except RuntimeError as error:
        cells = [name, elements, str(error)] + [""] * (len(_HEADINGS) - 3)
        return "| " + " | ".join(cells) + " |"
    force, pressure, area = scene.E_star * scene.joint.radius, scene.E_star, scene.joint.radius**2
    plane = "CPE" if scene.analysis.plane == "strain" else "CPS"
    cells = [name, plane + ("6" if elements == "quadratic" else "3"), str(dofs)]
    cells += [f"{m.P / force:.6g}", f"{c.P / force:.6g}", f"{100 * (c.P / m.P - 1):+.2f} %"]
    cells += [f"{m.p0 / pressure:.4g}", f"{c.p0 / pressure:.4g}"]
    if scene.plastic:
        cells += [f"{m.peeq_max:.2e}", f"{c.peeq_max:.2e}"]
        cells += [f"{m.peeq_integral / area:.4g}", f"{c.peeq_integral / area:.4g}"]
    else:
        cells += ["-"] * 4
    return "| " + " | ".join([*cells, f"{seconds:.1f}", f"{c.seconds:.1f}"]) + " |"


def main() -> int:
    """Solve the cases with both and print the table; returns the exit code."""
    try:
        require_calculix()
        print("| " + " | ".join(_HEADINGS) + " |\n|" + "---|" * len(_HEADINGS), flush=True)
        for name, scene in cases():
            m, seconds = ours(scene)
            for elements in ("quadratic", "linear"):
                print(row(name, scene, elements, m, seconds), flush=True)
            if scene.plastic and scene.analysis.plane == "stress":
                print(row(f"{name}, R thick", scene, "quadratic", m, seconds, scene.joint.radius), flush=True)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())

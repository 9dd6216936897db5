"""How far P of joints like those that the general law is fitted to is from P on the finest mesh.

python3 -m archord.studies.law_design --meshes > meshes.sweep.toml
mpirun -n 2 archord sweep meshes.sweep.toml
python3 -m archord.benchmarks.law_meshes runs/meshes
"""

from __future__ import annotations

import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

from archord.benchmarks.law_check import kind_of
from archord.materials.material import Array
from archord.postprocess.laws.general.general_law import joint_numbers
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.law_fit import JUDGED, NodeRun, rms_largest, within
from archord.postprocess.run import Run
from archord.report.table import Table


def by_size(folder: Path) -> dict[LawJoint, dict[float, Array]]:
    """By joint and size of its elements over R: the nodes ``(n, 4)`` of `NodeRun`, of the sweep in
    ``folder``."""
    found: dict[LawJoint, dict[float, Array]] = defaultdict(dict)
    for path in sorted((folder / "cases").iterdir()):
        run = Run(path)
        if run.steps == sum(run.scene.load.stage_steps):
            size = run.scene.joint.relative_element_size or 0.0
            found[LawJoint.from_scene(run.scene)][size] = NodeRun.of(run).nodes
    return dict(found)


def mesh_table(folder: Path) -> Table:
    """Errors of P by kind of joint and size of the elements, in per cent of P on the finest
    mesh."""
    errors = defaultdict(list)
    for joint, solved in by_size(folder).items():
        finest = solved[min(solved)]
        usual = within(finest[:, 0], JUDGED)
        for size, nodes in solved.items():
            if size > min(solved):
                off = 100 * (nodes[usual, 1] / finest[usual, 1] - 1)
                errors[kind_of(joint_numbers(joint)), size].append(off)
    columns = ("elements over R {:g}", "number", "mean {:+.2f}", "rms/largest")
    table = Table("joints", *columns, left=1)
    for (kind, size), parts in sorted(errors.items()):
        off = np.concatenate(parts)
        table.add(kind, size, len(parts), off.mean(), rms_largest(off))
    return table


if __name__ == "__main__":
    print(mesh_table(Path(sys.argv[1])).markdown())

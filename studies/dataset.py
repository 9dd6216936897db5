"""A dataset of solved joints: first loading and way back, with the error of each force, as CSV
tables with checksums.

The joints are drawn once, always the same 5 000, in an order in which any first part of them holds
all kinds. They are solved as a sweep. The tables have six digits. A machine with the same libraries
writes the same bytes; other libraries may change a last digit.
"""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from archord.materials.material import Array
from archord.postprocess.laws.general.elastic_model import elastic_model
from archord.postprocess.laws.general.law_fit import NodeRun, first_loading, solved_in
from archord.postprocess.laws.general.yield_model import (
    Numbers,
    Yielding,
    first_yield,
    mesh_excess,
    sides_of,
)
from archord.report.files import write_rows, write_text
from archord.studies.law_design import FRESH, Drawn, Row, joints, sweep_file

JOINTS = 5000
SEED = 2026
_MESH_ERROR = 6e-4  # of P, relative: elements of 5 %R, beyond 0.1 dR
_WHOLE_EXCESS = 5 / 3  # of elements of 5 %R, over their excess beside 2 %R: of first order
_SHUFFLE = 1
_TOLERANCE = 1e-10  # of the solver
_ELASTIC = [0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0]  # delta/dR
_BACK = (0.97, 0.93, 0.88, 0.82, 0.75, 0.67, 0.58, 0.48, 0.37, 0.25)  # parts of the deepest
NUMBERS = ("plane strain", "p", "m", "n", "dR/R", "pin s", "block s")
_COLUMNS = ("delta/dR", "P/(E* dR)", "error of P/(E* dR)", "p0 R/(E* dR)", "eps")


def scenes(number: int) -> list[Row]:
    """The scenes of the first ``number`` joints."""
    drawn = [joint for kind, share in _shares() for joint in joints(kind, share, SEED)]
    order = np.random.default_rng(_SHUFFLE).permutation(len(drawn))
    return [row for place in order[:number] for row in _runs(drawn[place])]


def _shares() -> list[tuple[str, int]]:
    """How many of all joints are of each kind, as in the check of the law."""
    ends = np.cumsum([0, *FRESH.values()])
    scaled = np.round(ends * JOINTS / ends[-1])
    shares = np.diff(scaled)
    return [(kind, int(share)) for kind, share in zip(FRESH, shares, strict=True)]


def _runs(joint: Drawn) -> list[Row]:
    """The scenes of a joint: elastic to 3 dR; what yields also back, and once more with twice as
    many steps."""
    if np.isinf(joint.first):
        return [joint.own | {"load.displacement": _ELASTIC}]
    end = _ELASTIC[-1]
    late = [joint.first * 0.95 * 1.2**k for k in range(30)]
    early = [x for x in _ELASTIC if x < 0.8 * joint.first]
    before_end = [x for x in late if x < 2.9]
    loading = [*early, *before_end, end]
    back = [end * part for part in _BACK]
    return [
        joint.own | {"load.displacement": [*loading, *back]},
        joint.own | {"load.displacement": loading, "load.steps": 2},
    ]


def write_sweep(number: int, file: Path) -> None:
    """Write the sweep of the first ``number`` joints."""
    write_text(sweep_file(scenes(number), tolerance=_TOLERANCE), file)


def write_tables(sweep: Path, folder: Path) -> list[Path]:
    """Write joints.csv, curves.csv and SHA256SUMS into ``folder``, from the solved joints of the
    folder ``sweep``, of which it may hold more than the sweep has; returns the files. Raises
    `OSError`, and `ValueError` if none is solved."""
    with (sweep / "cases.csv").open(encoding="utf-8", newline="") as text:
        names = {row["run"] for row in csv.DictReader(text)}
    solved = sorted(solved_in(sweep, names).items())
    if not solved:
        raise ValueError(f"{sweep}: no joint is solved.")
    table = []
    curves = []
    for number, (numbers, runs) in enumerate(solved, 1):
        table.append({"joint": number} | _written(NUMBERS, numbers))
        curves += [{"joint": number} | row for row in _curve(numbers, runs)]
    files = [folder / "joints.csv", folder / "curves.csv"]
    for file, rows in zip(files, (table, curves), strict=True):
        write_rows(rows, file)
    sums = folder / "SHA256SUMS"
    write_text(checksums(files), sums)
    return [*files, sums]


def checksums(files: Iterable[Path]) -> str:
    """A line for each of the ``files``, as ``sha256sum -c`` reads them."""
    digests = ((hashlib.sha256(file.read_bytes()).hexdigest(), file.name) for file in files)
    return "".join(f"{digest}  {name}\n" for digest, name in digests)


def _curve(numbers: Numbers, runs: Sequence[NodeRun]) -> Iterable[dict[str, object]]:
    """First loading of the joint with these ``numbers``, extrapolated to infinitely many steps
    where it was solved twice, and the way back."""
    nodes = first_loading(list(runs))
    x, y, p0, eps = nodes.T
    mesh = _mesh_error(numbers, x)
    errors = np.hypot(mesh, _step_error(runs, nodes))
    for values in zip(x, y, errors * y, p0, eps, strict=True):
        yield _row("loading", *values)
    for run in runs:
        if run.steps > 1 or len(run.back) < 2:
            continue
        deepest, largest = map(float, run.back[0])
        extrapolated = float(np.interp(deepest, x, y))
        error = mesh[-1] * largest + abs(extrapolated - largest)
        for delta, force in run.back[1:]:
            yield _row(f"back from {deepest:.4g}", delta, force, error)


def _mesh_error(numbers: Numbers, x: Array) -> Array:
    """The relative error of P by the mesh at ``x`` ``(k,)``: larger where a block yields in plane
    stress."""
    side, *_ = sides_of(numbers)
    block = numbers.block
    begins = first_yield(elastic_model(), numbers.strain, numbers.elastic, block)
    excess = mesh_excess(side, Yielding(np.inf, block), x / begins)  # the most that it can be
    return np.hypot(_MESH_ERROR, _WHOLE_EXCESS * excess)


def _step_error(runs: Sequence[NodeRun], nodes: Array) -> Array:
    """What the extrapolated forces differ from the forces of the finer run; 0 without one.

    Where steps were cut, both runs may have had the same ones, and their difference tells nothing.
    There the error is twice the largest of the nodes before and behind whose steps were not:
    forces of a cut run lie between the forces of the other and infinitely many steps.
    """
    n = len(nodes)
    loading = [run for run in runs if run.loading == n]
    fine = [run for run in loading if run.steps == 2]
    if not fine:
        return np.zeros(n)
    finer = fine[0].nodes[:n, 1]
    error = np.abs(finer / nodes[:, 1] - 1)
    cut = np.any([run.cut[:n] for run in loading], axis=0)
    whole = np.arange(n) if cut.all() else np.flatnonzero(~cut)
    behind = np.searchsorted(whole, np.arange(n)).clip(max=len(whole) - 1)
    before = (behind - 1).clip(min=0)
    beside = np.maximum(error[whole[before]], error[whole[behind]])
    return np.where(cut, 2 * np.maximum(error, beside), error)


def _row(way: str, *numbers: float) -> dict[str, object]:
    """A row of curves.csv; a way back has no p0 and eps."""
    return {"way": way} | _written(_COLUMNS[: len(numbers)], numbers)


def _written(names: Iterable[str], numbers: Iterable[float]) -> dict[str, object]:
    """The ``numbers`` by their ``names``, with six digits."""
    return {name: f"{value:.6g}" for name, value in zip(names, numbers, strict=True)}

"""What a run folder must be at any moment, whatever happened to the run."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import h5py
import numpy as np
from mpi4py import MPI

from archord.output import checkpoint
from archord.output.files.seal import read_report, report_text
from archord.output.files.step_file import all_arrays
from archord.output.folder import claim_folder
from archord.output.history import read_history
from archord.output.run import solve_scene
from archord.scene.file import load_scene
from archord.scene.presets.joint import Scene


def solved(scenes: dict[str, Scene], folder: Path) -> dict[str, Path]:
    """The run folders of ``scenes`` by name, made in ``folder`` and solved on this rank alone."""
    folders = {name: folder / name for name in scenes}
    for name, scene in scenes.items():
        claim_folder(folders[name], False)
        solve_scene(scene, folders[name], MPI.COMM_SELF)
    return folders


def contents(folder: Path) -> dict[Path, bytes]:
    """What all files of a run hold."""
    return {path: path.read_bytes() for path in folder.rglob("*.*") if path.is_file()}


def rewrite_report(folder: Path, **changes: object) -> None:
    """Let the run in ``folder`` have these ``changes`` in its run.json, as if it had been written
    so."""
    path = folder / "run.json"
    path.write_text(report_text(read_report(path) | changes))


def accepted_steps(folder: Path) -> int:
    """Open every file that is there, in full; the number of steps from which the run would go on.

    Fields and contact are at most one step ahead of the checkpoint, tables at most one behind it.
    """
    steps = (
        checkpoint.read(folder / "checkpoint.h5").step if (folder / "checkpoint.h5").exists() else 0
    )
    found = {}
    arrays = {}
    if (folder / "scene.toml").exists():
        load_scene(folder / "scene.toml")
    if (folder / "history.csv").exists():
        history = read_history(folder / "history.csv")
        found["history.csv"] = len(history["step"])
        assert history["step"] == list(range(1, found["history.csv"] + 1))
    if (folder / "run.json").exists():
        report = json.loads((folder / "run.json").read_text())
        found["run.json"] = len(report["steps"])
    for name in ("fields.h5", "contact.h5"):
        if (folder / name).exists():
            arrays[name] = _step_file(folder / name)
    if (folder / "fields.xdmf").exists():
        arrays["fields.xdmf"] = _xdmf(folder / "fields.xdmf")
    assert all(steps - 1 <= n <= steps for n in found.values()), (steps, found)
    assert all(steps <= n <= steps + 1 for n in arrays.values()), (steps, arrays)
    return steps


def _step_file(path: Path) -> int:
    with h5py.File(path) as file:
        accepted = int(file["accepted"][()])
        assert (np.diff(file["load"][:accepted]) != 0).all()
        for name, values in all_arrays(file):
            assert np.isfinite(values).all(), name
    return accepted


def _xdmf(path: Path) -> int:
    grids = ET.parse(path).getroot().findall(".//Grid[@GridType='Uniform']")
    for item in (item for grid in grids for item in grid.iter("DataItem")):
        name, _, dataset = str(item.text).partition(":")
        with h5py.File(path.parent / name) as file:
            assert file[dataset].shape == tuple(
                int(n) for n in item.attrib["Dimensions"].split()
            ), item.text
    return len(grids)


def same_run(one: Path, other: Path, tolerance: float, fields: float = 0.0) -> None:
    """All numbers of two finished runs agree, relative to the largest of their kind: tables, fields
    and contact.

    ``fields`` is the tolerance of values at points, if it is another one.
    """
    a, b = (read_history(folder / "history.csv") for folder in (one, other))
    assert set(a) == set(b)
    for name in set(a) - {"seconds", "force_balance"}:
        _agree(
            name, np.array(a[name]), np.array(b[name]), max(tolerance, 1e-11)
        )  # the table has 12 digits
    reports = [json.loads((folder / "run.json").read_text()) for folder in (one, other)]
    for name in ("delta", "P", "p0", "eps", "peeq_max", "peeq_integral", "elastic_energy", "work"):
        _agree(
            name,
            *(np.array([step[name] for step in report["steps"]]) for report in reports),
            tolerance,
        )
    for name in ("fields.h5", "contact.h5"):
        assert (one / name).exists() == (other / name).exists()
        if not (one / name).exists():
            continue
        with h5py.File(one / name) as first, h5py.File(other / name) as second:
            assert first["accepted"][()] == second["accepted"][()] == len(a["step"])
            arrays = [dict(all_arrays(file)) for file in (first, second)]
            assert set(arrays[0]) == set(arrays[1])
            for key, values in arrays[0].items():
                _agree(
                    f"{name}/{key}",
                    values,
                    arrays[1][key],
                    tolerance if key == "load" else fields or tolerance,
                )


def _agree(name: str, a: np.ndarray, b: np.ndarray, tolerance: float) -> None:
    assert a.shape == b.shape, name
    difference = np.abs(a.astype(float) - b).max(initial=0.0)
    assert difference <= tolerance * np.abs(a).max(initial=0.0), (name, difference)

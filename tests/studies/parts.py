"""Sweeps small enough for tests."""

import csv
from pathlib import Path

from archord.cli import run
from archord.presets import joint_measures

BASE = """
[base]
units = { length = "R", stress = "E*" }
joint = { radius = 1.0, clearance = 0.005, relative_element_size = 0.3, growth = 1.0 }
pin = { E = 1.82, nu = 0.3 }
block = { E = 1.82, nu = 0.3 }
load = { displacement = 1.0, steps = 2 }
analysis = { tolerance = 1e-10 }
output = { fields = false, contact = true }
"""
SOFT = "[grid]\npin.E = [0.5, 1.0, 1.82]\nload.steps = [2, 3]\n"  # six cases on one mesh
# Newton needs more, and no step may be cut
STUCK = "analysis.max_iterations = 2\nstepping.minimum = 1.0\n"


def written(folder: Path, text: str, name: str = "some") -> str:
    path = folder / f"{name}.sweep.toml"
    path.write_text(text + BASE)
    return str(path)


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def numbers(folder: Path, name: str = "sweep.csv") -> list[dict[str, str]]:
    """The rows of a table without what depends on the clock."""
    return [{k: v for k, v in row.items() if k != "seconds [s]"} for row in table(folder / name)]


def times(folder: Path) -> dict[str, int]:
    """When what was solved was written, by file."""
    return {str(p.relative_to(folder)): p.stat().st_mtime_ns for p in folder.glob("cases/*/*")}


def sweep(*arguments: str | Path) -> int:
    return run(["sweep", *map(str, arguments)])


def break_mesh(monkeypatch, message: str, below: float) -> None:
    """Let every case fail whose pin has less than this E."""
    true_problem = joint_measures.joint_problem

    def broken(scene, *rest):
        if below > scene.pin.E:
            raise ValueError(message)
        return true_problem(scene, *rest)

    monkeypatch.setattr(joint_measures, "joint_problem", broken)

"""archord without what solves: laws, fits of run folders, tables and pictures, and a sentence for
the rest."""

import json
import subprocess
import sys

BLOCKED = """
import sys

BLOCKED = "dolfinx dolfinx_solver petsc4py mpi4py gmsh basix ufl ffcx".split()

class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in BLOCKED:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Blocked())
"""
PROGRAM = """
import json
import archord
from archord.cli import run

for command in json.loads(sys.argv[1]):
    print("#", run(command), flush=True)
joint = archord.load(sys.argv[2])
has_pressure = joint.pressure(step=2).shape[0] > 0
print(len(joint.history["P"]), has_pressure, joint.fields(step=2).displacement.shape[1])
"""
SCENE = "scenes/steel_pin.toml"


def without_solver(tmp_path, commands, run):
    program = [
        sys.executable,
        "-c",
        BLOCKED + PROGRAM,
        json.dumps([[str(word) for word in c] for c in commands]),
        run,
    ]
    return subprocess.run(program, capture_output=True, text=True, check=False)


def test_runs_are_read_fitted_drawn_and_exported_and_laws_tell_joints(runs, tmp_path):
    plastic = runs["plastic"]
    elastic = runs["elastic"]
    commands = [
        ["show", plastic, "-o", tmp_path / "shown.png"],
        ["picture", plastic, "-o", tmp_path / "drawn.png"],
        ["compare", plastic, elastic, "-o", tmp_path / "compared.png"],
        ["export", plastic, "--csv", tmp_path / "csv", "--vtk", tmp_path / "vtk"],
        ["fit", elastic, "--json", tmp_path / "law.json"],
        ["law", "--scene", SCENE],
        ["laws"],
    ]
    result = without_solver(tmp_path, commands, plastic)
    assert result.returncode == 0, result.stderr
    codes = [line for line in result.stdout.splitlines() if line.startswith("# ")]
    assert codes == ["# 0"] * len(commands), result.stderr
    assert result.stdout.splitlines()[-1] == "8 True 2"
    assert all(
        (tmp_path / name).stat().st_size > 10_000
        for name in ("shown.png", "drawn.png", "compared.png")
    )


def test_what_solves_says_in_one_sentence_what_it_needs(runs, tmp_path):
    out = tmp_path / "out"
    commands = [["solve", SCENE, "-o", out], ["mesh", "scenes/lug.toml"], ["export-deck", SCENE]]
    result = without_solver(tmp_path, commands, runs["elastic"])
    codes = [line for line in result.stdout.splitlines() if line.startswith("# ")]
    assert codes == ["# 2"] * len(commands)
    assert result.stderr.splitlines() == [
        f"archord {command}: No module named 'mpi4py'; pip install 'archord[solve]' brings what "
        "solves (docs/containers.md)."
        for command, *_ in commands
    ]
    assert not out.exists()

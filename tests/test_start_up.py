"""Commands load no library that they do not need: each costs a part of a second."""

import subprocess
import sys

import pytest

from tests.test_cli import COARSE, ENVIRONMENT, SCENE

JOINT = ["--radius", "10", "--clearance", "0.05", "--E-star", "115385"]
ELASTIC = ["--set", "pin.yield_stress=none", "--set", "block.yield_stress=none"]
SOLVER = {"dolfinx", "petsc4py", "mpi4py", "gmsh"}
PLOTTING = {"matplotlib", "pyvista", "vtk"}
LAUNCHER = {"OMPI_COMM_WORLD_RANK": "0", "OMPI_COMM_WORLD_SIZE": "2", "PMIX_RANK": "0"}


@pytest.mark.parametrize(
    ("arguments", "environment", "needless"),
    [
        (["--help"], {}, {*SOLVER, *PLOTTING, "numpy", "pydantic"}),
        (["laws"], LAUNCHER, {*SOLVER, *PLOTTING}),
        (["law", "paper", *JOINT], {}, {*SOLVER, *PLOTTING}),
        (["fit", "{elastic}"], {}, {*SOLVER, *PLOTTING}),
        (
            ["show", "{coarse}", "--no-pictures"],
            {},
            {*SOLVER, *PLOTTING, "pandas", "scipy", "basix", "cffi"},
        ),
        (["solve", SCENE, *COARSE, *ELASTIC, "-q"], {}, {*PLOTTING, "archord.materials.j2"}),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_commands_load_only_what_they_need(runs, tmp_path, arguments, environment, needless):
    """No plotting library without a picture, no solver and no MPI without a solve, not even under a
    launcher; an elastic scene leaves the return map alone."""
    code = (
        "import sys; from archord.cli import run; print(run(sys.argv[1:]), *sys.modules, "
        "file=sys.stderr)"
    )
    command = [sys.executable, "-c", code, *(argument.format(**runs) for argument in arguments)]
    result = subprocess.run(
        command,
        cwd=tmp_path,
        env=ENVIRONMENT | environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    status, *loaded = result.stderr.split()
    assert status == "0", result.stderr
    assert needless.isdisjoint(loaded)
    assert ("dolfinx" in loaded) == (arguments[0] == "solve")

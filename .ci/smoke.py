"""Two scenes, solved by the archord that is installed: forces at their last step, to the digits of
every other place.

``[mpirun -n 2] python3 .ci/smoke.py FOLDER`` solves into a new folder.
"""

import sys
from pathlib import Path

import archord  # first: it finds the MPI of PyPI's dolfinx

# isort: split
from mpi4py import MPI

EXPECTED = {"steel_pin": ("P", 7722.0940312), "lug": ("pull force", 5569.66251827)}
SCENES = Path(__file__).parents[1] / "scenes"

for name, (column, value) in EXPECTED.items():
    run = archord.solve(archord.load_scene(SCENES / f"{name}.toml"), Path(sys.argv[1]) / name)
    found = float(run.columns[column][-1])
    versions = run.summary["versions"]
    if abs(found / value - 1) > 1e-9:
        sys.exit(f"{name}: {column} is {found}, and {value} elsewhere ({versions})")
    if MPI.COMM_WORLD.rank == 0:
        print(
            f"{name}: {column} = {found}, with dolfinx {versions['dolfinx']} and PETSc "
            f"{versions['petsc']}"
        )

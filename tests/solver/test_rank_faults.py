"""An exception on one rank only."""

import subprocess
import sys
import textwrap
from time import perf_counter

import pytest

FAULT = """
    import sys
    from mpi4py import MPI
    from archord.{module} import {owner}

    healthy, calls = {owner}.{name}, 0

    def broken(*arguments, **options):
        global calls
        calls += 1
        if MPI.COMM_WORLD.rank == 1 and calls == {call}:
            raise RuntimeError("the fault of rank one")
        return healthy(*arguments, **options)

    {owner}.{name} = broken
    from archord.cli import run
    sys.exit(run(["solve", "joint.toml", "-o", "run", "-q"]))
"""
SCENE = """
    [joint]
    radius = 1.0
    relative_clearance = 0.005
    relative_element_size = 0.3
    [pin]
    E = 1.82
    nu = 0.3
    yield_stress = 0.002
    [block]
    E = 1.82
    nu = 0.3
    [load]
    displacement = 2.0
    steps = 4
"""
PLACES = {
    "setup": ("solver.bulk.bulk", "Bulk", "__init__", 1),
    "residual": ("solver.contact.contact", "Contact", "evaluate", 7),
    "tangent": ("solver.contact.tangent", "ContactTangent", "filled", 4),
    "return map": ("materials.material", "Points", "update", 13),
    "output": ("solver.path.mesh_order", "MeshOrder", "collect_history", 2),
}


@pytest.mark.parametrize("place", PLACES)
def test_an_exception_on_one_rank_ends_the_run(tmp_path, place):
    """Within five seconds of it, with that rank's message, its exit code, and the steps before it
    readable."""
    module, owner, name, call = PLACES[place]
    (tmp_path / "joint.toml").write_text(textwrap.dedent(SCENE), encoding="utf-8")
    source = textwrap.dedent(FAULT).format(module=module, owner=owner, name=name, call=call)
    (tmp_path / "fault.py").write_text(source, encoding="utf-8")
    command = ["mpirun", "-n", "2", sys.executable, "fault.py"]
    begun = perf_counter()
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    assert "rank 1 failed: the fault of rank one" in done.stderr
    assert perf_counter() - begun < 25  # start-up, meshing and the steps before the fault included

"""A scene with a mesh of gmsh solved where programs solve many: in workers of pools, however they
start, and in threads."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import gmsh
import pytest

import archord

SCENE = """
mesh = { file = "bar.msh" }
body = [ { name = "bar", E = 1000.0, nu = 0.3 } ]
support = [ { name = "clamp", on = "left", fixed = ["x", "y"] } ]
load = [ { name = "pull", on = "right", direction = "x", displacement = 0.1 } ]
path = { steps = 1 }
analysis = { plane = "stress" }
"""


@pytest.fixture
def scene(tmp_path):
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    face = gmsh.model.occ.addRectangle(0, 0, 0, 4, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [face], name="bar")
    for name, line in (("left", 4), ("right", 2)):
        gmsh.model.addPhysicalGroup(1, [line], name=name)
    gmsh.model.mesh.generate(2)
    gmsh.write(str(tmp_path / "bar.msh"))
    gmsh.finalize()
    (tmp_path / "bar.toml").write_text(SCENE)
    return tmp_path / "bar.toml"


def solved(scene: str, name: str) -> float:
    run = archord.solve(scene, Path(scene).with_name(name))
    assert run.status == "done"
    return run.columns["pull force"][0]


@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_a_worker_of_a_pool_solves(scene, method):
    """In a process of its own, so that a fork has what a user's program has."""
    program = scene.with_name("program.py")
    program.write_text(
        "import multiprocessing, archord\n"
        "def job(k):\n"
        f"    return archord.solve({str(scene)!r}, {str(scene.with_name('pool'))!r} + "
        "str(k)).status\n"
        "if __name__ == '__main__':\n"
        f"    with multiprocessing.get_context({method!r}).Pool(2) as pool:\n"
        "        print(pool.map(job, [1, 2]))\n"
    )
    done = subprocess.run(
        [sys.executable, str(program)], capture_output=True, text=True, timeout=120
    )
    assert done.stdout.strip() == "['done', 'done']", done.stderr


def test_a_thread_solves(scene):
    with ThreadPoolExecutor(1) as threads:
        assert threads.submit(solved, str(scene), "thread").result() == pytest.approx(
            solved(str(scene), "main")
        )


def test_a_thread_may_load_archord_first(scene):
    program = (
        "import threading, archord\n"
        f"job = threading.Thread(target=archord.solve, args=({str(scene)!r}, "
        f"{str(scene.with_name('first'))!r}))\n"
        "job.start()\njob.join()\n"
        f"print(archord.load({str(scene.with_name('first'))!r}).status)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120
    )
    assert done.stdout.strip() == "done", done.stderr

"""Scene files gone wrong: refused in sentences or solved in order, whatever is in them."""

import json
import math
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from archord.scene.errors import InputError
from archord.scene.file import load_scene, parse_scene, resolved
from tests.fuzz.fuzzing import FuzzCase, faults, scene_of
from tests.fuzz.mutations import KINDS, base_scenes

ROOT = Path(__file__).parents[2]
ENVIRONMENT = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_COMM", "PMIX_"))}


def test_a_mutated_file_is_a_scene_or_refused_in_sentences(tmp_path):
    """Nothing but `InputError`, in lines that end like sentences; a file that is accepted is resolved to itself."""
    path, refused, kinds = tmp_path / "scene.toml", 0, set()
    for number in range(150):
        _, kind, content = scene_of(1, number)
        kinds.add(kind)
        path.write_bytes(content)
        try:
            scene = load_scene(path)
        except InputError as error:
            refused += 1
            lines = str(error).splitlines()
            assert lines, number
            assert all(line.startswith(str(path)) and line.endswith(".") and len(line) < 1000 for line in lines), number
        else:
            again = parse_scene(tomllib.loads(resolved(scene)))
            assert (again.target, again.E_star, again.joint.h) == (scene.target, scene.E_star, scene.joint.h), number
    assert kinds == set(KINDS)
    assert 30 < refused < 140


def test_the_command_ends_in_order_on_mutated_files(tmp_path):
    """Exit codes 0, 2 and 3 only, no traceback, no number that is none, nothing left of a refused scene."""
    options = ("--seed", "1", "--cases", "12", "--keep", str(tmp_path))
    command = [sys.executable, "-m", "tests.fuzz", *options]
    result = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stdout
    assert "12 cases, seed 1" in result.stdout
    assert "exit code 0" in result.stdout
    assert "exit code 2" in result.stdout


def test_cases_are_reproducible_and_their_bases_good():
    """A case depends on seed and number alone; what is mutated was a scene."""
    assert [scene_of(3, n) for n in range(20)] == [scene_of(3, n) for n in range(20)]
    assert scene_of(3, 0) != scene_of(4, 0)
    for name, text in base_scenes().items():
        assert parse_scene(tomllib.loads(text), name).load.steps == 2


@pytest.mark.parametrize(
    ("code", "stderr", "found"),
    [
        (2, "scene.toml: is wrong.\n", []),
        (2, "", ["refused without a word"]),
        (2, "Traceback (most recent call last):\n", ["'Traceback' on stderr", "refused in something"]),
        (1, "", ["exit code 1"]),
        (-11, "", ["exit code -11"]),
        (3, "", ["stopped without a reason"]),
    ],
)
def test_faults_are_seen(tmp_path, code, stderr, found):
    """What the fuzzer is for."""
    (tmp_path / "stderr").write_text(stderr)
    said = faults(tmp_path, code)
    assert len(said) == len(found)
    assert all(a.startswith(b) for a, b in zip(said, found, strict=True))


def test_numbers_that_are_not_finite_are_seen(tmp_path):
    """In a table and in run.json; and a folder that a refused scene leaves."""
    (tmp_path / "stderr").write_text("scene.toml: is wrong.\n")
    run = tmp_path / "run"
    run.mkdir()
    assert faults(tmp_path, 2) == ["refused, yet a run folder was left"]
    (run / "history.csv").write_text("step,P [N]\n1,2.0\n2,nan\n")
    (run / "run.json").write_text(json.dumps({"x": math.inf}))
    assert faults(tmp_path, 0) == ["run.json: Infinity", "history.csv: P"]
    assert FuzzCase(0, "", "", 143, 1.0, []).slow

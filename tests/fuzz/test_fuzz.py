"""Scene files gone wrong: refused in sentences or solved in order, whatever is in them."""

import shutil
import tomllib

import pytest

from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_any, resolved
from tests.fuzz.fuzzing import faults, run_case, run_mesh_case, scene_of
from tests.fuzz.mutations import KINDS, base_scenes


def test_a_mutated_file_is_a_scene_or_refused_in_sentences(tmp_path):
    """Nothing but `InputError`, in lines that end like sentences; a file that is accepted is
    resolved to itself."""
    path = tmp_path / "scene.toml"
    refused = 0
    kinds = set()
    for number in range(300):
        kind, content = scene_of(number)
        assert (kind, content) == scene_of(number)
        kinds.add(kind)
        path.write_bytes(content)
        try:
            scene = load_scene(path)
        except InputError as error:
            refused += 1
            lines = str(error).splitlines()
            assert lines, number
            assert all(
                line.startswith(str(path)) and line.endswith(".") and len(line) < 1000
                for line in lines
            ), number
        else:
            again = parse_any(tomllib.loads(resolved(scene)))
            assert tomllib.loads(resolved(again)) == tomllib.loads(resolved(scene)), number
            assert again.targets == scene.targets, number
    assert kinds == set(KINDS)
    assert 60 < refused < 290


def test_the_command_ends_in_order_on_mutated_files(tmp_path, request):
    """Exit codes 0, 2 and 3 only, no traceback, no number that is none, nothing left of a refused
    scene."""
    codes = set()
    for number in range(request.config.getoption("--cases")):
        case = run_case(number, tmp_path / str(number))
        assert not case.faults, (number, case)
        codes.add(case.code)
        shutil.rmtree(tmp_path / str(number))
    assert codes >= {0, 2}


def test_the_command_ends_in_order_on_mutated_meshes(tmp_path, request):
    """As on mutated scenes."""
    codes = set()
    for number in range(18, 18 + request.config.getoption("--cases") // 2):
        case = run_mesh_case(number, tmp_path / str(number))
        assert not case.faults, (number, case)
        codes.add(case.code)
        shutil.rmtree(tmp_path / str(number))
    assert codes >= {0, 2}


def test_what_is_mutated_was_a_scene():
    assert scene_of(0) != scene_of(1)
    for name, text in base_scenes().items():
        assert len(parse_any(tomllib.loads(text), name).targets) <= 7, name


@pytest.mark.parametrize(
    ("code", "stderr", "history", "found"),
    [
        (2, "scene.toml: is wrong.\n", None, []),
        (2, "", None, ["refused without a word"]),
        (
            2,
            "Traceback:\n",
            None,
            ["'Traceback' on stderr", "refused in something that is no sentence"],
        ),
        (-11, "", None, ["exit code -11"]),
        (3, "", None, ["stopped without a reason"]),
        (2, "scene.toml: is wrong.\n", "", ["refused, yet a run folder was left"]),
        (0, "", "step,P [N]\n1,2.0\n2,nan\n", ["history.csv: P"]),
    ],
)
def test_faults_are_seen(tmp_path, code, stderr, history, found):
    """What the fuzzer is for."""
    (tmp_path / "stderr").write_text(stderr)
    if history is not None:
        (tmp_path / "run").mkdir()
        (tmp_path / "run" / "history.csv").write_text(history)
    assert faults(tmp_path, code) == found

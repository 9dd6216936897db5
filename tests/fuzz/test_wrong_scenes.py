"""General scenes that contradict themselves or their mesh: one sentence that names the fault, exit
code 2, nothing left; exit code 3 where only the solution tells."""

import tomllib

import pytest
import tomli_w

from archord.cli import run
from tests.fuzz.mutations import GENERAL

PRESS = {"name": "press", "on": "top of upper", "direction": "y", "displacement": -0.01}
BETWEEN = {"name": "contact", "surfaces": ["top of lower", "bottom of upper"]}
FLOOR = {"name": "floor", "on": "floor", "fixed": ["x", "y"]}
SIDE = {"name": "side", "on": "left of upper", "fixed": ["x"]}
POINT = {"name": "point", "facets": "top of upper", "point": [0.5, 2.0]}
SOLVABLE = {
    "support": [FLOOR, SIDE],
    "coupling": [],
    "load": [PRESS],
    "interaction": [BETWEEN],
    "path": {"steps": 1},
}


def written(folder, changes):
    data = tomllib.loads((GENERAL / "blocks.toml").read_text(encoding="utf-8")) | SOLVABLE | changes
    data["mesh"]["file"] = str(GENERAL / "blocks.inp")
    (folder / "scene.toml").write_text(tomli_w.dumps(data), encoding="utf-8")
    return ["solve", str(folder / "scene.toml"), "-q", "-o", str(folder / "run")]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"support": []}, "nothing holds the body 'lower'"),
        (
            {"support": [FLOOR | {"on": "flor"}, SIDE]},
            "no set or coupling 'flor' (did you mean 'floor'?)",
        ),
        ({"load": [PRESS | {"on": "nowhere"}]}, "no set or coupling 'nowhere'"),
        (
            {"load": [PRESS | {"direction": "rotation"}]},
            "is no coupling, which alone has a rotation",
        ),
        (
            {"interaction": [BETWEEN | {"surfaces": ["top of lower"] * 2}]},
            "must be two different facet sets",
        ),
        (
            {"interaction": [BETWEEN | {"surfaces": ["top of lower", "left of lower"]}]},
            "they must face each other",
        ),
        (
            {"interaction": [BETWEEN | {"surfaces": ["bottom of lower", "top of upper"]}]},
            "they must face each other",
        ),
        (
            {"support": [FLOOR, SIDE, SIDE | {"name": "top", "on": PRESS["on"], "fixed": ["y"]}]},
            "'top' and 'press'",
        ),
        (
            {"coupling": [POINT, POINT | {"name": "other"}], "load": [PRESS | {"on": "point"}]},
            "both prescribe how",
        ),
        ({"path": {"steps": [1, 2]}}, "must have one number for each of the 1 stages"),
        (
            {
                "body": [
                    {"name": "lower", "E": 1e30, "nu": 0.3},
                    {"name": "upper", "E": 1.0, "nu": 0.3},
                ]
            },
            "the largest E",
        ),
    ],
)
def test_a_contradiction_is_a_sentence(tmp_path, refused, changes, said):
    assert said in refused(written(tmp_path, changes))
    assert not (tmp_path / "run").exists()


def test_springs_that_carry_a_force_stop_the_run_at_once(tmp_path, capsys):
    """A body that is pulled away hangs on them alone: no step is accepted, and the body is
    named."""
    away = {"name": "away", "on": "top of upper", "direction": "y", "force": 1.0}
    assert run(written(tmp_path, {"load": [away], "path": {"steps": 3}})) == 3
    said = capsys.readouterr().err
    assert "nothing holds what the loads move" in said
    assert "no contact carries 'upper'; hold it by a support" in said
    assert "0 accepted steps are in" in said


def test_moduli_a_million_apart_are_told(tmp_path, capsys):
    bodies = [{"name": "lower", "E": 1000.0, "nu": 0.3}, {"name": "upper", "E": 1e9, "nu": 0.3}]
    assert run(written(tmp_path, {"body": bodies})) == 0
    assert (
        "'upper' is 1.0e+06 times as stiff as 'lower': look whether their E have"
        in capsys.readouterr().err
    )


def test_no_load_at_all_is_no_imbalance(tmp_path, capsys):
    """Forces of round-off are not told as forces that do not balance."""
    assert run(written(tmp_path, {"load": [PRESS | {"displacement": 0.0}]})) == 0
    assert "balance" not in capsys.readouterr().err

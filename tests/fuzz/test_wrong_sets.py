"""Meshes whose sets, nodes and cells are not what was meant: warned of, or refused where a load
would be lost."""

import tomllib

import pytest
import tomli_w
from mpi4py import MPI

from archord.cli import run
from archord.presets.account import account_of
from archord.scene.file import load_scene
from tests.fuzz.mutations import GENERAL
from tests.fuzz.test_wrong_scenes import BETWEEN, FLOOR, PRESS, SIDE

ON_FLOOR = FLOOR | {"on": "bottom of lower"}
PARTS = {"support": [ON_FLOOR, SIDE], "coupling": [], "load": [PRESS], "interaction": [BETWEEN]}


def written(folder, old, new, **changes):
    """A scene on the two blocks, in whose mesh ``old`` is ``new``."""
    mesh = (GENERAL / "blocks.inp").read_text(encoding="utf-8")
    assert mesh.count(old) == 1
    (folder / "blocks.inp").write_text(mesh.replace(old, new), encoding="utf-8")
    data = tomllib.loads((GENERAL / "blocks.toml").read_text(encoding="utf-8")) | PARTS | changes
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps(data), encoding="utf-8")
    return path


def warned(path):
    return account_of(load_scene(path), MPI.COMM_SELF).warnings


def test_sets_as_meant_have_nothing_said_of_them(tmp_path):
    assert warned(written(tmp_path, "two blocks", "blocks")) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "9, 15, 16, 20, 19",
            "9, 19, 20, 16, 15",
            "the facet set 'top of upper' has 1 of its 3 facets inside a body, as at (0.5, 1.5): "
            "look whether",
        ),
        (
            "8, S3\n9, S3\n",
            "8, S3\n",
            "the facet set 'top of upper' leaves out 1 single facets that no set has, as at (0.5, "
            "2)",
        ),
        (
            "NAME=bottom of lower\n",
            "NAME=bottom of lower\n6, S1\n",
            "the set 'bottom of lower' of 'floor' has 1 facets of the surface 'bottom of upper' of "
            "'contact', as at (0.5, 1), which it moves whatever they touch",
        ),
        (
            "17, 1.000000, 1.500000",
            "17, 99.000000, 1.500000",
            "cells are far longer than wide, the worst at (25.3333, 1.",
        ),
    ],
)
def test_what_was_hardly_meant_is_warned_of(tmp_path, old, new, said):
    assert said in "\n".join(warned(written(tmp_path, old, new)))


@pytest.mark.parametrize(
    "changes",
    [
        {"load": [PRESS, {"name": "wind", "on": "left of lower", "pressure": 1.0}]},
        {
            "coupling": [
                {
                    "name": "arm",
                    "facets": "left of lower",
                    "point": [0.0, 0.5],
                    "kind": "distributing",
                }
            ]
        },
    ],
)
def test_a_load_on_facets_inside_a_body_is_refused(tmp_path, refused, changes):
    """The part of the load on them was lost, without a word."""
    path = written(tmp_path, "1, S4\n3, S4", "1, S2\n3, S4", **changes)
    said = refused(["solve", str(path), "-q", "-o", str(tmp_path / "run")])
    assert (
        "the facet set 'left of lower' has 1 of its 2 facets inside a body, as at (0.5, 0.25)"
        in said
    )


def test_surfaces_that_part_are_told(tmp_path, capsys):
    """In step 2 the load pulls them apart; that they part when a load goes back is no news."""
    pull = PRESS | {"displacement": [-0.01, 0.02]}
    path = written(tmp_path, "two blocks", "blocks", load=[pull], path={"steps": 1})
    assert run(["solve", str(path), "-q", "-o", str(tmp_path / "run")]) == 0
    assert (
        "no surfaces touch from step 2 on, though the loads displace farther"
        in capsys.readouterr().err
    )
    path = written(
        tmp_path, "two blocks", "blocks", load=[PRESS | {"displacement": [-0.01, 0.005]}]
    )
    assert run(["solve", str(path), "-q", "-o", str(tmp_path / "back")]) == 0
    assert "no surfaces touch" not in capsys.readouterr().err

"""The joints that the representative strain is fitted to: the recipe makes the sweep that was
solved, and pairs of named metals are those of scenes."""

from __future__ import annotations

import hashlib
import tomllib

import numpy as np
import pytest

from archord.materials.named import metals
from archord.postprocess.laws.general.general_law import SMALLEST_S, joint_numbers, outside
from archord.postprocess.laws.general.joint import LawJoint
from archord.scene.presets.joint import Scene
from archord.studies import hardening_design

SOLVED = "c3a9600309cbb23954c7b7e46b6dee098c214f4ae2f4d22956a8c236b3ee7ad6"  # SHA-256


def test_the_recipe_makes_the_sweep_that_was_solved(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """To the byte, by the command of docs/development/law_fit.md."""
    monkeypatch.setattr("sys.argv", ["hardening_design"])
    hardening_design.main()
    text = capsys.readouterr().out
    assert hashlib.sha256(text.encode()).hexdigest() == SOLVED
    assert len(tomllib.loads(text)["list"]) == 1522


@pytest.mark.parametrize("plane", SMALLEST_S)
def test_a_pair_of_metals_is_the_joint_of_the_scene_that_names_them(plane: str) -> None:
    named = {"pin": "CuSn12-C", "block": "S355"}
    scene = Scene.model_validate(
        {
            "joint": {"radius": 10.0, "clearance": 0.05},
            "analysis": {"plane": plane},
            "load": {"displacement": 2.0},
        }
        | {body: {"material": metal} for body, metal in named.items()}
    )
    metal_of = {body: metals()[metal] for body, metal in named.items()}
    drawn = hardening_design.pair(metal_of, plane == "strain", 0.005)
    np.testing.assert_allclose(drawn.numbers, joint_numbers(LawJoint.from_scene(scene)), rtol=1e-12)


@pytest.mark.parametrize("plane", SMALLEST_S)
def test_all_pairs_of_metals_are_in_the_laws_range(plane: str) -> None:
    """Those that yield; each metal is in one of them at least."""
    pairs = list(hardening_design.all_pairs(plane))
    assert len(pairs) > 0.8 * len(metals()) ** 2
    for joint in pairs:
        own = joint.own
        described = LawJoint(
            radius=1.0,
            clearance=own["joint.clearance"],
            E_star=1.0,
            plane=plane,
            pin_share=joint.numbers[1],
            nu=own["block.nu"],
            pin_nu=own["pin.nu"],
            pin_yield=own["pin.yield_stress"],
            block_yield=own["block.yield_stress"],
        )
        assert outside(described) == ""

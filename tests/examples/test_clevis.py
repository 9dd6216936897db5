"""The clevis of docs/step_to_margin.md: what is drawn, and what its scenes name."""

import re
import runpy
import shutil
from pathlib import Path

import pytest

import archord
from archord.cli import run as command

FOLDER = Path(__file__).parents[2] / "examples" / "clevis"


def test_the_step_file_has_the_faces_that_the_scene_names(tmp_path, capsys):
    """The holes and the pin by their radii, and the plates of the preset by their volumes."""
    folder = shutil.copytree(FOLDER, tmp_path / "clevis")
    runpy.run_path(str(folder / "draw.py"))
    capsys.readouterr()
    assert command(["mesh", str(folder / "clevis.toml"), "-o", str(tmp_path / "mesh.png")]) == 0
    printed = capsys.readouterr().out
    radii = dict(re.findall(r"^(face \d+) .* R ([\d.]+) ", printed, re.MULTILINE))
    named = {name: radii[name] for name in ("face 6", "face 13", "face 17")}
    assert named == {"face 6": "6.03", "face 13": "6.03", "face 17": "6"}
    scene = archord.load_scene(folder / "clevis.toml")
    preset = archord.load_scene(folder / "preset.toml")
    assert {body.name: body.yield_stress for body in scene.body} == {
        body.name: body.yield_stress for body in preset.body
    }
    assert preset.load[0].force == scene.load[0].force == pytest.approx(60000.0)

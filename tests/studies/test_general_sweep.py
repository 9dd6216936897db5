"""Sweeps of general scenes and of presets: cases, names, tables, pictures."""

from pathlib import Path

import pytest
from mpi4py import MPI

import archord
from archord.cli import run
from archord.geometry.meshes.formats.source import Mesh
from archord.geometry.meshes.stored import store_mesh
from archord.output.restart import plan_restart
from archord.scene.mesh_digests import digests
from archord.studies.cases import read_sweep
from tests.studies.parts import sweep, table

LUG = """
[grid]
lug.width = [36.0, 40.0]
load.displacement = [0.05, 0.1]
[base]
pin = { E = 210000.0, nu = 0.3 }
plate = { E = 210000.0, nu = 0.3 }
load = { displacement = 0.1, steps = 1 }
lug.radius = 9.9
lug.clearance = 0.1
lug.edge_distance = 20.0
lug.length = 60.0
lug.width = 40.0
lug.element_size = 3.0
"""

BLOCK = """
[base]
format = 2
mesh = {{ file = "{mesh}" }}
body = [{{ name = "block", E = 210000.0, nu = 0.3 }}]
support = [{{ name = "base", on = "block bottom", fixed = ["x", "y"] }}]
load = [{{ name = "press", on = "block top", direction = "y", displacement = 0.01 }}]
path = {{ steps = 1 }}
[grid]
body.block.E = [210000.0]
"""


def store_block(file, width: float) -> None:
    """Write the mesh of a block of this width."""
    mesh = archord.rectangles({"block": (0, 0, width, 1)}, size=0.5, comm=MPI.COMM_SELF)
    with file.open("wb") as target:
        store_mesh(Mesh.of(mesh).plain(MPI.COMM_SELF), target)


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("general")
    (folder / "lug.sweep.toml").write_text(LUG)
    assert sweep(folder / "lug.sweep.toml", "-o", folder / "out", "-q") == 0
    return folder


def test_each_case_of_a_preset_is_what_solve_makes_of_it(swept, tmp_path):
    (tmp_path / "base.toml").write_text(LUG.partition("[base]")[2])
    keys = ["--set", "lug.width=36.0", "--set", "load.displacement=0.1"]
    keys += ["--set", "analysis.tolerance=1e-6"]
    assert (
        run(["solve", str(tmp_path / "base.toml"), *keys, "-o", str(tmp_path / "alone"), "-q"]) == 0
    )
    rows = table(swept / "out" / "cases.csv")
    assert [(row["lug.width"], row["load.displacement"]) for row in rows][1] == ("36", "0.1")
    alone = archord.load(tmp_path / "alone")
    assert float(rows[1]["pull force [N/mm]"]) == pytest.approx(
        alone.columns["pull force"][-1], rel=1e-12
    )
    assert {row["status"] for row in rows} == {"done"}


def test_a_general_sweep_is_shown_and_gone_on_with(swept, capsys):
    assert run(["show", str(swept / "out")]) == 0
    assert "pull force [N/mm]" in capsys.readouterr().out
    assert archord.load(swept / "out").label(2) == "width = 36, displacement = 0.1"
    assert sweep(swept / "lug.sweep.toml", "-o", swept / "out") == 0
    assert "4 of 4 cases are there already" in capsys.readouterr().out
    rows = table(swept / "out" / "cases.csv")
    next((swept / "out" / "cases").glob("*/history.csv")).unlink()
    assert sweep(swept / "lug.sweep.toml", "-o", swept / "out", "-q") == 0
    again = table(swept / "out" / "cases.csv")
    assert [row["pull force [N/mm]"] for row in again] == [row["pull force [N/mm]"] for row in rows]


@pytest.mark.parametrize("keys", [("yield_stress", "material"), ("material", "yield_stress")])
def test_a_material_leaves_what_else_a_sweep_varies(tmp_path, keys):
    """Whichever key is first, as with ``--set``: a material drops what the base says alone."""
    values = {"yield_stress": "[300.0, 400.0]", "material": '["S355"]'}
    grid = "".join(f"plate.{key} = {values[key]}\n" for key in keys)
    file = tmp_path / "steels.sweep.toml"
    file.write_text(LUG.replace("[grid]\n", f"[grid]\n{grid}"))
    cases = read_sweep(file).cases
    plates = [case.scene.solids["lug"] for case in cases]
    assert {plate.yield_stress for plate in plates} == {300.0, 400.0}
    assert len({case.run for case in cases}) == len(cases) == 8


def test_a_hardening_law_is_a_value(tmp_path):
    """Alone, and among the keys of a body."""
    law = "{ saturation = 300.0, rate = 10.0 }"
    steel = "E = 210000.0, nu = 0.3, yield_stress = 200.0"
    grids = (
        f"plate.yield_stress = [200.0]\nplate.hardening = [0.0, {law}]\n",
        f"plate = [{{ {steel} }}, {{ {steel}, hardening = {law} }}]\n",
    )
    for grid in grids:
        file = tmp_path / "laws.sweep.toml"
        file.write_text(LUG.replace("[grid]\n", f"[grid]\n{grid}"))
        cases = read_sweep(file).cases
        assert len({case.run for case in cases}) == len(cases) == 8
        hardened = [case for case in cases if case.scene.solids["lug"].hardening != 0]
        assert len(hardened) == 4
        assert hardened[0].value("plate.hardening") == {"saturation": 300.0, "rate": 10.0}
    joint = tmp_path / "joint.sweep.toml"
    steel_pin = Path("scenes/steel_pin.toml").resolve()
    joint.write_text(f'base = "{steel_pin}"\n[grid]\npin.hardening = [{law}]\n')
    (case,) = read_sweep(joint).cases
    assert case.value("pin.hardening") == {"saturation": 300.0, "rate": 10.0}


def test_keys_of_named_parts_vary(tmp_path):
    """As ``--set`` names them; a name that is none is refused once."""
    general = tmp_path / "g.toml"
    (tmp_path / "lug.toml").write_text(LUG.partition("[base]")[2])
    from archord.scene.file import load_scene, resolved

    general.write_text(resolved(load_scene(tmp_path / "lug.toml")))
    (tmp_path / "a.sweep.toml").write_text(f'base = "{general}"\n[grid]\nbody.lug.E = [1e5, 2e5]\n')
    design = read_sweep(tmp_path / "a.sweep.toml")
    assert [case.scene.solids["lug"].E for case in design.cases] == [1e5, 2e5]
    assert len({case.run for case in design.cases}) == 2
    (tmp_path / "b.sweep.toml").write_text(f'base = "{general}"\n[grid]\nbody.log.E = [1e5]\n')
    with pytest.raises(archord.InputError, match="with a name among"):
        read_sweep(tmp_path / "b.sweep.toml")


def test_a_sweep_in_space_varies_the_thickness(tmp_path, capsys):
    """A thicker joint carries more; Python's words are the same scene."""
    text = """
[grid]
space.thickness = [4.0, 8.0]
[base]
joint = { radius = 10.0, clearance = 0.05, block_size = 50.0, relative_element_size = 0.5 }
pin = { E = 210000.0, nu = 0.3 }
block = { E = 210000.0, nu = 0.3 }
space = { thickness = 4.0, rim_ratio = 1.0 }
load = { displacement = 1.0, steps = 1 }
"""
    (tmp_path / "t.sweep.toml").write_text(text)
    assert sweep(tmp_path / "t.sweep.toml", "-o", tmp_path / "out", "-q") == 0
    rows = table(tmp_path / "out" / "cases.csv")
    thin, thick = (abs(float(row["press force [N]"])) for row in rows)
    assert 1.5 * thin < thick < 2.5 * thin
    assert run(["show", str(tmp_path / "out")]) == 0
    assert "press force [N]" in capsys.readouterr().out
    steel = {"E": 210e3, "nu": 0.3}
    words = {
        "joint": {
            "radius": 10.0,
            "clearance": 0.05,
            "block_size": 50.0,
            "relative_element_size": 0.5,
        },
        "pin": steel,
        "block": steel,
        "space": {"thickness": 4.0, "rim_ratio": 1.0},
        "load": {"displacement": 1.0, "steps": 1},
    }
    alone = archord.solve(archord.Scene(**words), tmp_path / "alone")
    assert alone.kinematics.dimension == 3
    assert abs(alone.columns["press force"][-1]) == pytest.approx(thin, rel=1e-6)


def test_a_case_of_a_changed_mesh_file_is_solved_again(tmp_path, capsys):
    """Whether or not it could be continued; the cases of the mesh that is there stay."""
    mesh = tmp_path / "block.npz"
    text = BLOCK.format(mesh=mesh)
    for checkpoint in ("false", "true"):
        given = f"{text}[base.output]\ncheckpoint = {checkpoint}\n"
        file = tmp_path / f"{checkpoint}.sweep.toml"
        file.write_text(given)
        forces = []
        for width in (1.0, 2.0):
            store_block(mesh, width)
            assert sweep(file, "-o", tmp_path / checkpoint, "-q") == 0
            (row,) = table(tmp_path / checkpoint / "cases.csv")
            forces.append(float(row["press force [N/mm]"]))
        assert forces[1] > 1.5 * forces[0]
        assert "was changed after the run" in capsys.readouterr().err
        assert sweep(file, "-o", tmp_path / checkpoint) == 0
        assert "1 of 1 cases are there already" in capsys.readouterr().out
    case = next((tmp_path / "true" / "cases").iterdir())
    store_block(mesh, 1.0)
    with pytest.raises(archord.InputError, match="was changed after the run"):
        plan_restart(case)


def test_a_stopped_case_of_a_changed_mesh_file_is_solved_again(tmp_path, capsys):
    """A block of width 1 cannot carry what one of width 2 does."""
    mesh = tmp_path / "block.npz"
    text = BLOCK.format(mesh=mesh).replace("displacement = 0.01", "force = -600.0")
    file = tmp_path / "block.sweep.toml"
    file.write_text(text.replace("nu = 0.3", "nu = 0.3, yield_stress = 300.0"))
    store_block(mesh, 1.0)
    assert sweep(file, "-o", tmp_path / "out", "-q") == 3
    assert sweep(file, "-o", tmp_path / "out", "-q") == 3
    assert "was changed after the run" not in capsys.readouterr().err
    store_block(mesh, 2.0)
    assert sweep(file, "-o", tmp_path / "out", "--gather", "-q") == 0
    assert table(tmp_path / "out" / "sweep.csv") == []
    assert sweep(file, "-o", tmp_path / "out", "-q") == 0
    assert "was changed after the run" in capsys.readouterr().err
    (row,) = table(tmp_path / "out" / "cases.csv")
    assert row["status"] == "done"
    assert float(row["press force [N/mm]"]) == -600.0


DECK = """*INCLUDE, INPUT=nodes.txt
*ELEMENT, TYPE=CPE4, ELSET=block
1, 1, 2, 3, 4
*SURFACE, NAME=block bottom
1, S1
*SURFACE, NAME=block top
1, S3
"""


def test_a_case_whose_mesh_file_includes_a_changed_one_is_solved_again(tmp_path, capsys):
    mesh = tmp_path / "block.inp"
    mesh.write_text(DECK)
    file = tmp_path / "block.sweep.toml"
    file.write_text(BLOCK.format(mesh=mesh))
    forces = []
    for width in (1.0, 2.0):
        nodes = f"1, 0, 0\n2, {width}, 0\n3, {width}, 1\n4, 0, 1\n"
        (tmp_path / "nodes.txt").write_text(f"*NODE\n{nodes}")
        assert sweep(file, "-o", tmp_path / "sweep", "-q") == 0
        (row,) = table(tmp_path / "sweep" / "cases.csv")
        forces.append(float(row["press force [N/mm]"]))
    assert abs(forces[1]) > 1.5 * abs(forces[0])
    assert "block.inp with nodes.txt was changed after the run" in capsys.readouterr().err


def test_the_h5_of_an_xdmf_is_known(tmp_path):
    mesh = tmp_path / "block.xdmf"
    mesh.write_text('<DataItem Format="HDF">block.h5:/Mesh/geometry</DataItem>')
    (tmp_path / "block.h5").write_bytes(b"1")
    before = digests(mesh)
    (tmp_path / "block.h5").write_bytes(b"23")
    after = digests(mesh)
    assert [name for name in after if after[name] != before[name]] == ["block.h5"]


def test_a_key_that_a_case_drops_has_no_value(tmp_path):
    """Of a preset, too: its field in tables is empty."""
    path = tmp_path / "lug.sweep.toml"
    path.write_text(LUG.replace("[grid]", '[grid]\nanalysis.thickness = ["none", 5.0]'))
    thicknesses = {case.value("analysis.thickness") for case in read_sweep(path).cases}
    assert thicknesses == {None, 5.0}

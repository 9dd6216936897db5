"""Every example runs, and is exact or as close to its reference as it says."""

import runpy
from pathlib import Path

import gmsh
import numpy as np
import pytest

import archord
from archord.materials.named import named_material

FOLDER = Path(__file__).parents[2] / "examples"
SHORT = ["three_stack", "three_bodies", "lug", "own_material", "own_law", "axisymmetric_punch"]
SHORT.append("eccentric_press")


@pytest.fixture
def run_of(comm, monkeypatch, tmp_path):
    """The run of an example, in a folder of its own."""
    monkeypatch.chdir(comm.bcast(tmp_path))

    def example(name):
        return runpy.run_path(str(FOLDER / f"{name}.py"))["run"]

    return example


@pytest.mark.parametrize("name", SHORT)
def test_an_example_is_short(name):
    lines = (FOLDER / f"{name}.py").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 40
    assert max(map(len, lines)) <= 100


@pytest.mark.mpi
def test_a_stack_of_squares_is_exact(run_of):
    """Between walls the pressure of elastic squares is M strain, with M the modulus without lateral
    strain. A square that yields in plane strain has the pressure K strain + 2/3 sigY (J2). Weak
    springs hold the squares until they touch."""
    E = 1.0
    nu = 0.3
    yield_stress = 0.002
    depth = 0.02
    M = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    K = E / (3 * (1 - 2 * nu))
    exact = (depth + 2 * yield_stress / (3 * K)) / (2 / M + 1 / K)
    run = run_of("three_stack")
    assert -run.columns["lid force"][-1] == pytest.approx(exact, rel=2e-8)


@pytest.mark.mpi
def test_blocks_in_space_are_pressed_and_bent(run_of):
    """As columns are, without contraction across: the force is within the kern, so that the whole
    face touches; the pressure is linear over the face, and largest in the facet of a corner."""
    area = 20.0**2
    inertia = 20.0**4 / 12
    aside = np.array([2.0, -1.0])
    softness = 10.0 / 210e3 + 10.0 / 70e3
    run = run_of("eccentric_press")
    moved = -20e3 * softness * (1 / area + aside @ aside / inertia)
    assert run.columns["press displacement"][-1] == pytest.approx(moved, rel=2e-3)
    assert run.columns["base back z"][-1] == pytest.approx(20e3, rel=1e-8)
    assert run.columns["base back moment x"][-1] == pytest.approx(9.0 * 20e3, rel=1e-6)
    place = np.array([run.columns[f"contact at {axis}"][-1] for axis in "xy"])
    from_middle = place - 10.0
    expected = 20e3 * (1 / area + aside @ from_middle / inertia)
    assert run.columns["contact largest pressure"][-1] == pytest.approx(expected, rel=0.04)
    assert (from_middle * aside > 0).all()


@pytest.mark.mpi
def test_three_bodies_are_springs_in_a_row(run_of):
    """Their sides are free: a block is a spring of E times thickness times height over length. Weak
    springs hold the blocks until they touch."""
    softness = 1 / 210e3 + 1 / 10.0 + 1 / 70e3
    run = run_of("three_bodies")
    assert run.columns["push force"][-1] == pytest.approx(5.0 * 0.05 / softness, rel=3e-6)


@pytest.mark.mpi
def test_the_force_of_a_lug_is_that_of_other_codes(run_of):
    """Within 0.1 % at every displacement of two codes, one of them CalculiX 2.20, refined until the
    digits stood."""
    run = run_of("lug")
    gmsh.finalize()
    assert (run.folder / "picture.png").is_file()
    displacements = np.round(run.columns["pull displacement"], 9)
    found = dict(zip(displacements, run.columns["pull force"], strict=True))
    for d, P in {0.02: 590.7, 0.1: 4001, 0.2: 9539, 0.3: 15451}.items():
        assert found[d] == pytest.approx(P, rel=1e-3)


@pytest.mark.mpi
def test_an_own_material_follows_its_formula(run_of):
    """A bar without lateral contraction: force = E strain (1 + (strain / limit)^2) times its
    height. Its work is stored."""
    run = run_of("own_material")
    strain = np.array([0.01, 0.02])
    exact = 10.0 * strain * (1 + (strain / 0.02) ** 2)
    assert run.columns["pull force"] == pytest.approx(exact, rel=1e-9)
    energy = 2 * 10.0 * (strain**2 / 2 + strain**4 / 4 / 0.02**2)
    assert run.columns["elastic_energy"] == pytest.approx(energy, rel=1e-9)
    assert 'text = "Foam(E=10.0, limit=0.02)"' in (run.folder / "scene.toml").read_text()


@pytest.mark.mpi
def test_an_own_law_wears_by_archard(run_of):
    """The worn volume is k times the force times the way slid (Archard 1953), here within 0.3 %, as
    the block gives way a little."""
    run = run_of("own_law")
    slid = np.concatenate([np.zeros(4), np.linspace(0.05, 0.5, 10), np.linspace(0.55, 1.5, 20)])
    volume = run.columns["rub worn volume"]
    assert volume[4:] == pytest.approx(1e-6 * 500 * slid[4:], rel=3e-3, abs=1e-6)
    assert np.diff(volume).min() >= 0


@pytest.mark.mpi
def test_a_ball_on_a_block_has_the_pressure_of_hertz(run_of):
    """The largest pressure within 1 % of Hertz's contact under the same force (Johnson 1985, eq.
    4.24), which hardly depends on the depth of the block; the area within 5 %, as seven facets show
    the half-width."""
    E, R = 210e3 / (1 - 0.3**2), 40.0
    columns = run_of("axisymmetric_punch").columns
    force = -columns["press force"][-1]
    pressure = (6 * force * E**2 / (np.pi**3 * R**2)) ** (1 / 3)
    half_width = (3 * force * R / (4 * E)) ** (1 / 3)
    assert columns["contact largest pressure"][-1] == pytest.approx(pressure, rel=0.01)
    assert columns["contact contact area"][-1] == pytest.approx(np.pi * half_width**2, rel=0.05)


@pytest.mark.mpi
def test_a_ball_in_steel_has_the_pressure_of_tabor(comm, tmp_path):
    """The mean pressure is about three times the yield stress at Tabor's representative strain, 0.2
    a/R (The Hardness of Metals, 1951, chapter V); the block's base carries the ball, which leaves
    an indentation."""
    scene = archord.load_scene(FOLDER.parent / "scenes" / "ball.toml")
    columns = archord.solve(scene, comm.bcast(tmp_path) / "run").columns
    deepest = 9
    force = -np.array(columns["ball force"])
    area = columns["contact contact area"][deepest]
    strain = 0.2 * np.sqrt(area / np.pi) / 5.0
    yield_stress = named_material("S355", "MPa").hardening.stress(np.array([strain]))[0]
    assert 2.7 < force[deepest] / area / yield_stress < 3.2
    assert columns["base z"][deepest] == pytest.approx(force[deepest], rel=1e-8)
    assert columns["ball displacement"][-1] == pytest.approx(-0.18)
    assert force[-1] == 0


def test_the_force_of_an_eyebar_is_that_of_other_codes(tmp_path):
    """Within 0.3 % of CalculiX 2.20 (CPE8, 5 300 dofs, 20 steps to 0.1 mm); the part of the scene
    that costs little."""
    changes = {"load.press.displacement": 0.1, "path.steps": 20}
    run = archord.solve(
        archord.load_scene(FOLDER / "eyebar" / "eyebar.toml", changes), tmp_path / "run"
    )
    assert run.columns["press force"][-1] == pytest.approx(1187.7, rel=3e-3)
    assert sum(run.columns["cutbacks"]) == 0


def test_a_loaded_pin_is_that_of_calculix(tmp_path):
    """The largest pressure to 1 % of CalculiX 2.20 on the same mesh (220.9 MPa, the largest at a
    node)."""
    scene = archord.load_scene(FOLDER / "loaded_pin.toml", {"load.steps": 1, "load.at": "diameter"})
    run = archord.solve(scene, tmp_path / "run")
    assert run.columns["pin in lug largest pressure"][-1] == pytest.approx(220.9, rel=0.01)
    assert run.columns["clamp x"][-1] == pytest.approx(-20000, rel=1e-6)


def test_tolerances_of_a_fit_scatter_the_force_most_by_the_clearance(tmp_path, monkeypatch):
    """Rank correlations by hand of what the table holds; every joint has a force."""
    monkeypatch.setattr("sys.argv", ["tolerances.py", str(tmp_path / "scatter.png"), "60"])
    joints = runpy.run_path(str(FOLDER / "tolerances.py"))["joints"]
    ranks = joints.rank()
    correlation = np.corrcoef(ranks.clearance, ranks.P)[0, 1]
    assert np.isfinite(joints.P).all()
    assert correlation < -0.7
    assert np.corrcoef(ranks.block_yield, ranks.P)[0, 1] > 0
    assert (tmp_path / "scatter.png").is_file()


def test_every_example_is_tested():
    others = {"slider_crank", "tolerances"}
    assert {path.stem for path in FOLDER.glob("*.py")} == {*SHORT, *others}

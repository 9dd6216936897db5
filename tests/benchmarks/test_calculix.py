"""What CalculiX prints, read; and, where it is installed, CalculiX beside archord."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from archord.benchmarks.case import Case, paper_joint
from archord.benchmarks.peers import calculix
from archord.benchmarks.peers.calculix import (
    areas,
    drive_forces,
    peeq_integral,
    read_printed,
    step_forces,
)
from archord.benchmarks.peers.joint_script import axis_pressure
from archord.benchmarks.timing import run_once
from archord.postprocess.decks.deck import system_of
from archord.postprocess.decks.mesh import deck_mesh
from archord.postprocess.decks.model_lines import contact_stiffness

# Written by CalculiX 2.20 for this scene, quadratic elements; of the .frd displacements and
# contact.
REFERENCE = Path(__file__).parents[1] / "reference"
SCENE = paper_joint(0.4, 2, 0.002, joint={"element_size": 0.4, "block_size": 4.0, "growth": 1.0})


@pytest.fixture(scope="module")
def printed():
    return read_printed((REFERENCE / "calculix.dat").read_text())


@pytest.fixture(scope="module")
def system():
    return system_of(SCENE)


@pytest.fixture(scope="module")
def mesh(system):
    return deck_mesh(system)


def test_tables_have_their_names_times_and_rows(printed, mesh):
    """The reactions of a step, then PEEQ at nine points of every element."""
    reactions = [
        ["total force", name, t]
        for t in (1.0, 2.0)
        for name in ("SYMMETRY", "BLOCK_HELD", "PIN_TOP")
    ]
    strains = [["equivalent plastic strain", name, 2.0] for name in ("PIN", "BLOCK")]
    assert [key for *key, _ in printed] == reactions + strains
    assert {rows.shape for *_, rows in printed[:6]} == {(1, 3)}
    assert sum(len(rows) for *_, rows in printed[6:]) == 9 * sum(map(len, mesh.elements.values()))


def test_forces_are_the_whole_joints_and_balance(printed, system, mesh):
    """Twice the printed reaction, downward positive; pin and block opposite; growing with the
    steps."""
    (P,) = drive_forces(system, mesh, printed).values()
    np.testing.assert_array_equal(P, -2 * step_forces(printed, "PIN_TOP")[:, 1])
    np.testing.assert_allclose(P, 2 * step_forces(printed, "BLOCK_HELD")[:, 1], rtol=1e-6)
    assert 0 < P[0] < P[1]


def test_of_increments_the_end_of_the_step_counts():
    """Cut steps print in between, and CalculiX may print the end twice; three-digit exponents have
    no E."""
    text = "".join(
        f"\n total force (fx,fy,fz) for set TOP and time  {time}\n\n   1.0-101 {force} -2.5E-20\n"
        for time, force in (
            ("0.2500000E+00", -9.0),
            ("0.9999990E+00", -1.0),
            ("0.1000000E+01", -2.0),
            ("2.0", -3.0),
        )
    )
    assert step_forces(read_printed(text), "TOP")[:, 1].tolist() == [-2.0, -3.0]
    assert step_forces(read_printed(text), "BOTTOM").size == 0
    assert read_printed(text)[0][3][0, 0] == 1e-101


def test_uniform_plastic_strain_integrates_to_the_area(printed, mesh):
    """PEEQ 1 everywhere gives the area of the half model; an elastic run has none."""
    ones = [(*key, np.c_[rows[:, :2], np.ones(len(rows))]) for *key, rows in printed[6:]]
    area = sum(areas(mesh.x[nodes]).sum() for nodes in mesh.elements.values())
    assert peeq_integral(ones, mesh) == pytest.approx(area)
    assert peeq_integral(printed[:6], mesh) == 0
    assert (
        0 < peeq_integral(printed, mesh) < max(rows[:, 2].max() for *_, rows in printed[6:]) * area
    )


def test_contact_pressure_is_the_penetration_times_the_slope(system, mesh):
    """On the pin's arc, where CalculiX writes the gap three columns before; zero elsewhere."""
    text = (REFERENCE / "calculix.frd").read_text()
    pressure = calculix.read_nodal(text, "CONTACT", mesh)[:, 3]
    pressed = np.flatnonzero(pressure)
    assert len(pressed) >= 3
    assert set(pressed) <= set(mesh.surfaces["pin"].nodes.ravel())
    contact = text[text.index("CONTACT") :].splitlines()
    gap = {int(line[3:13]) - 1: float(line[13:25]) for line in contact if line.startswith(" -1")}
    slope = contact_stiffness(system.problem, mesh, system.problem.interactions[0])
    np.testing.assert_allclose(pressure[pressed], [-slope * gap[n] for n in pressed], rtol=1e-5)


def test_the_axis_pressure_of_an_even_parabola_is_its_top():
    """Exactly, whatever its curvature; without pressure there is none."""
    angle = np.linspace(0, np.pi / 2, 40)
    assert axis_pressure(angle, 3.0 - 0.5 * angle**2) == pytest.approx(3.0)
    assert axis_pressure(angle[:0], angle[:0]) is None


WITH_CALCULIX = pytest.mark.skipif(
    shutil.which("ccx") is None, reason="CalculiX is not installed (image target peers)"
)


@WITH_CALCULIX
def test_a_general_scene_is_compared_by_force_and_stresses(tmp_path):
    """A lug 5 mm thick, whose forces are those of the whole: half a percent of force, 2 % of
    stresses."""
    scene = tmp_path / "lug.toml"
    lug = (
        "[lug]\nradius = 9.9\nclearance = 0.1\nwidth = 40.0\nedge_distance = 20.0\nlength = "
        "60.0\nelement_size = 1.0\n"
    )
    steel = "E = 210000.0\nnu = 0.3\n"
    rest = "[load]\ndisplacement = 0.1\nsteps = 2\n[analysis]\nthickness = 5.0\n"
    scene.write_text(f"{lug}[pin]\n{steel}[plate]\n{steel}{rest}", encoding="utf-8")
    rows = {
        what: difference
        for what, _, _, difference in calculix.compare(scene, [], tmp_path / "work").rows
    }
    assert abs(float(rows["pull force"].rstrip("%"))) < 0.5
    assert [float(rows[f"{body}: stresses"].rstrip("%")) < 2 for body in ("pin", "lug")] == [
        True,
        True,
    ]


@WITH_CALCULIX
@pytest.mark.parametrize(
    ("yield_stress", "pin", "plane"),
    [(None, {}, "stress"), (0.002, {}, "strain"), (None, {"rigid": True}, "strain")],
)
def test_calculix_agrees(tmp_path, yield_stress, pin, plane):
    """The force of the joint, on the same coarse mesh."""
    sections = {"joint": {"block_size": 10.0}, "analysis": {"plane": plane}} | (
        {"pin": pin} if pin else {}
    )
    scene = paper_joint(0.08, 4, yield_stress, **sections)
    opinion = run_once(calculix.process(scene, tmp_path)).result
    last = Case("run", scene).solve(tmp_path).steps[-1]
    assert pytest.approx(last["P"], rel=2e-3) == opinion.P
    assert opinion.p0 == pytest.approx(last["p0"], rel=0.02)
    if yield_stress:
        assert opinion.peeq_integral == pytest.approx(last["peeq_integral"], rel=2e-2)

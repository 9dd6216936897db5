"""What every benchmark is made of: cases, the joint that they vary, ranks that take turns."""

import pytest

from archord.benchmarks.case import (
    Case,
    matches,
    paper_joint,
    side_by_side,
    slug,
    varied,
)
from archord.presets.views import view_of
from archord.scene.file import resolved


def test_a_variation_changes_what_it_names_and_nothing_else():
    """None drops a key; a rigid pin has no other key; without sections the scene stays itself."""
    scene = paper_joint(0.1, 3, 0.002, joint={"clearance": 0.01}, analysis={"plane": "stress"})
    assert resolved(varied(scene)) == resolved(scene)
    other = varied(scene, pin={"rigid": True}, load={"displacement": None, "relative_force": 0.003})
    assert other.pin.rigid
    assert other.targets == pytest.approx(
        [0.001 * other.E_star, 0.002 * other.E_star, 0.003 * other.E_star]
    )
    assert (other.joint, other.block, other.analysis) == (scene.joint, scene.block, scene.analysis)


def test_joints_are_compared_per_thickness():
    """What has no units is the same of a joint ten times as thick, whose force is ten times as
    large."""
    thin, thick = ({"P": P, "p0": 0.5, "eps": 1.0, "delta": 0.01} for P in (2.0, 20.0))
    scene = paper_joint()
    thicker = varied(scene, analysis={"thickness": 10.0})
    assert view_of(thicker).quantities(thick) == view_of(scene).quantities(thin)


def test_names_become_folders_and_are_found(tmp_path):
    assert slug("E_pin/E_block = 1e-6, 20 %R") == "E_pin_E_block_1e-6_20_pcR"
    assert Case("a, b", paper_joint()).folder(tmp_path) == tmp_path / "a_b"
    assert matches("GAMMA", "x", "gamma factor")
    assert matches("*factor", "gamma factor")
    assert not matches("factor?", "gamma factor")


def test_a_run_that_stops_is_a_sentence(tmp_path):
    """Nothing resists a pull; `attempt` gives what was reached, `solve` insists on the end."""
    load = {"displacement": None, "relative_force": -0.001}
    pulled = Case("pulled", paper_joint(0.3, 1, load=load, stepping={"minimum": 1.0}))
    assert pulled.attempt(tmp_path).status == "stopped"
    assert not pulled.is_done(tmp_path)
    with pytest.raises(RuntimeError, match=r"^pulled: no equilibrium"):
        pulled.solve(tmp_path)


@pytest.mark.mpi
def test_ranks_take_turns_and_all_know_the_results(comm):
    """In the order of the items, also where they are no multiple of the ranks."""
    for number in range(4):
        found = side_by_side(comm, range(number), lambda item: (item**2, comm.rank))
        assert found == [(item**2, item % comm.size) for item in range(number)]

"""The paper's figures: what they need is solved once, what they show follows from the runs."""

import csv

import numpy as np
import pytest
from mpi4py import MPI

from archord.benchmarks.case import paper_joint
from archord.benchmarks.paper import runs as paper_runs
from archord.benchmarks.paper.claims import CLAIMS, first_yield, verdict
from archord.benchmarks.paper.figures import FIGURES, LAYOUTS
from archord.benchmarks.paper.reproduce import chosen, reproduce
from archord.benchmarks.paper.runs import FULL_YIELD, JOINTS, PLANES, Runs, case, cases

STEPS = 4


def fast_growing(joint, **sections):
    """The paper's joint on elements that grow fast away from the contact."""
    return paper_joint(joint=joint | {"growth": 0.6}, **sections)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """All figures on meshes and in steps too coarse for the paper, two of them first."""
    target = tmp_path_factory.mktemp("paper")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paper_runs, "MESHES", {"coarse": 0.4, "fine": 0.2})
        patch.setattr(paper_runs, "paper_joint", fast_growing)
        patch.setattr(paper_runs, "STEPS", STEPS)
        solved: list[str] = []
        files = reproduce(
            ["fig5", "fig3"],
            target,
            MPI.COMM_SELF,
            lambda said: solved.append(said.partition(":")[0]),
        )
        assert solved == [one.name for one in cases(["elastic", FULL_YIELD])]
        assert [f.name for f in files] == ["fig3.csv", "fig3.png", "fig5.csv", "fig5.png"]
        reproduce(
            ["all"], target, MPI.COMM_SELF, lambda said: solved.append(said.partition(":")[0])
        )
        assert sorted(solved) == sorted(one.name for one in cases(JOINTS))
        yield target


def test_a_figure_s_table_holds_the_runs(folder):
    """Both planes, all steps, and the numbers of history.csv."""
    with (folder / "fig3.csv").open(newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [r["plane"] for r in table] == ["strain"] * STEPS + ["stress"] * STEPS
    run = Runs(folder / "runs").curve("elastic", "strain")
    ours = [float(r["p0 R/(E* delta)"]) for r in table[:STEPS]]
    np.testing.assert_allclose(ours, run.p0 * run.R / (run.E_star * run.delta), rtol=1e-8)
    winkler = [float(r["Winkler, k = 0.85"]) / float(r["delta/dR"]) for r in table]
    np.testing.assert_allclose(winkler, 0.85, rtol=1e-9)


def test_the_report_judges_every_claim_and_shows_every_figure(folder):
    """The finding, on any mesh: p0/sigY at 2 dR is capped near 1 in plane stress, and is not in
    plane strain."""
    text = (folder / "report.md").read_text(encoding="utf-8")
    claims = {
        line.split(" | ")[0][2:]: line for line in text.splitlines() if line.startswith("| C")
    }
    assert set(claims) == set(CLAIMS)
    assert "does not hold in plane strain" in claims["C5"]
    for name in FIGURES:
        assert f"({name}.png)" in text
    for plane, low, high in (("strain", 1.8, 2.1), ("stress", 1.0, 1.15)):
        run = Runs(folder / "runs").curve(FULL_YIELD, plane)
        assert low < run.p0[-1] / run.sigY < high


def test_first_yield_scales_with_the_yield_stress(folder):
    """Half the yield stress is reached earlier, none at all never; near the contact it begins on
    the axis."""
    run = Runs(folder / "runs").curve("elastic", "strain")
    early, late = (first_yield(run, s, near_contact=0.5) for s in (0.001, 0.002))
    assert 0 < early.delta < late.delta < 2
    assert late.angle < 15
    assert first_yield(run, 1.0).delta == np.inf


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("plane", PLANES)
def test_every_scene_of_the_paper_is_in_its_plane_with_unit_contact_modulus(joint, plane):
    """And some figure needs it."""
    scene = case(joint, plane).scene
    assert (scene.E_star, scene.analysis.plane) == (pytest.approx(1.0), plane)
    assert [scene.joint.dR, scene.pin.yield_stress or 0] == pytest.approx(
        [(v or 0) / 100 for v in JOINTS[joint]]
    )
    assert any(joint in LAYOUTS[name]["joints"] for name in FIGURES)


def test_figures_are_chosen_by_name(refused):
    """All, or some in the paper's order."""
    assert chosen(["all"]) == list(FIGURES) == list(LAYOUTS)
    assert chosen(["fig9", "fig2"]) == ["fig2", "fig9"]
    assert "fig6: is not a figure of the paper" in refused(["reproduce", "fig6"])


def test_claims_are_judged_by_their_deviation():
    """Within 5 %, within 15 %, beyond; in both planes at once where they agree."""
    said = "holds; k holds with a limit in plane strain, does not hold in plane stress"
    assert verdict({"": 0.04, "k": 0.14}, {"": 0.01, "k": 0.16}) == said

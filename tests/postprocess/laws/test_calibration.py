"""Data of a known law give it back, within the errors stated; units, meshes and several runs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from archord.postprocess.judgement.convergence import group
from archord.postprocess.laws.calibration import calibrate, fit_curve
from archord.postprocess.laws.fit_report import notes
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.run import Run
from archord.report.errors import InputError
from tests.output.run_files import solved
from tests.postprocess.synthetic import LOADS, curve
from tests.solver.solving import scene

DRAWS = 80


@pytest.mark.parametrize("quantity", ["P", "p0"])
@pytest.mark.parametrize(
    ("k", "c", "sigY"), [(0.83, None, None), (0.83, 1.0, 0.002), (0.7, 1.6, 0.001)]
)
def test_exact_data_give_their_law_back(quantity, k, c, sigY):
    """k, and c where the joint yields, to round-off of the search; R2 = 1 and no error."""
    found = fit_curve(group([curve(k, c, sigY=sigY)]), quantity=quantity)
    values = {name: estimate.value for name, estimate in found.estimates.items()}
    assert values == pytest.approx({"k": k} | ({"c": c} if c else {}), rel=1e-8)
    assert found.k.error < 1e-8
    assert found.quality[0] == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize(
    ("quantity", "c", "sigY"), [("P", None, None), ("p0", None, None), ("P", 1.3, 0.002)]
)
def test_the_interval_covers_the_truth_as_often_as_it_says(quantity, c, sigY):
    """Noise of 1 % of E* dR, many times: intervals hold k (and c) at their level, within 3 binomial
    sigmas."""
    truth = {"k": 0.83} | ({"c": c} if c else {})
    held = dict.fromkeys(truth, 0)
    for seed in range(DRAWS):
        run = curve(0.83, c, sigY=sigY, noise=0.01, seed=seed)
        for name, found in fit_curve(group([run]), quantity=quantity).estimates.items():
            low, high = found.interval
            held[name] += low <= truth[name] <= high
    for times in held.values():
        assert times / DRAWS == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / DRAWS))


def test_the_error_of_k_is_that_of_a_straight_line():
    """p0 R/(E* dR) = k delta/dR is a line through the origin: k and its error in closed form."""
    run = curve(0.83, noise=0.05, seed=3)
    found = fit_curve(group([run]), quantity="p0")
    y = run.p0 / 0.005
    x = LOADS
    k = (x @ y) / (x @ x)
    assert found.k.value == pytest.approx(k, rel=1e-8)
    assert found.k.error == pytest.approx(
        np.sqrt(((y - k * x) ** 2).sum() / 19 / (x @ x)), rel=1e-6
    )
    off = k * x / y - 1
    r2 = 1 - ((y - k * x) ** 2).sum() / ((y - y.mean()) ** 2).sum()
    quality = (r2, np.sqrt((off**2).mean()), max(off, key=abs), 20)
    assert found.quality == pytest.approx(quality, rel=1e-9)


@pytest.mark.parametrize("c", [None, 1.3])
def test_units_do_not_matter(c):
    """mm and MPa, or anything else: same k, c and errors, forces scale."""
    options = {"sigY": 0.002 if c else None, "noise": 0.01}
    a = calibrate([curve(0.83, c, **options)])
    b = calibrate([curve(0.83, c, R=1e-2, modulus=2.1e11, **options)])
    assert a.joint.estimates.keys() == b.joint.estimates.keys()
    for name, found in a.joint.estimates.items():
        assert b.joint.estimates[name].value == pytest.approx(found.value, rel=1e-7)
        assert b.joint.estimates[name].error == pytest.approx(found.error, rel=1e-5)
    law = a.law()
    other = b.law()
    delta = np.array([0.3, 1.1, 2.0]) * 0.005
    np.testing.assert_allclose(
        other.force(delta * 1e-2) / (2.1e11 * 1e-2), law.force(delta), rtol=1e-6
    )


def test_runs_of_other_clearance_and_strength_share_one_law():
    """Four joints made with one k and c: the joint fit finds them, and the law is that of the first
    joint."""
    joints = [(0.01, 0.004), (0.001, None), (0.005, 0.001), (0.002, 0.0005)]
    runs = [
        curve(0.83, 1.2 if sigY else None, dR=dR, sigY=sigY, name=f"run{i}")
        for i, (dR, sigY) in enumerate(joints)
    ]
    found = calibrate(runs)
    assert [fit.c is None for fit in found.each] == [False, True, False, False]
    assert found.joint.k.value == pytest.approx(0.83, rel=1e-8)
    assert found.joint.c.value == pytest.approx(1.2, rel=1e-8)
    assert found.joint.k.dof == 4 * 20 - 2
    np.testing.assert_allclose(found.law().force(runs[0].delta), runs[0].P, rtol=1e-7)
    assert calibrate(runs[1::-1]).law().c is None


@pytest.mark.parametrize("quantity", ["P", "p0"])
def test_runs_of_other_clearance_and_modulus_weigh_alike(quantity):
    """k = 0.8 at one clearance, 0.9 at ten times that: 0.85 together."""
    runs = [curve(0.8, dR=0.001), curve(0.9, dR=0.01, modulus=50.0, R=3.0)]
    assert fit_curve(group(runs), quantity=quantity).k.value == pytest.approx(0.85, rel=1e-8)


def test_the_range_selects_steps():
    """Only steps in the range are fitted, its ends included, and the law says so."""
    run = curve(0.83)
    bent = replace(run, P=np.where(run.delta > 1.001 * run.dR, 2 * run.P, run.P))
    found = calibrate([bent], (0.3, 1.0))
    assert found.joint.k.value == pytest.approx(0.83, rel=1e-8)
    assert found.joint.residuals[0].load == pytest.approx(LOADS[2:10])
    assert found.law().fitted_range == pytest.approx((0.3, 1.0))


@pytest.mark.parametrize("quantity", ["P", "p0"])
def test_before_yield_there_is_no_plateau_to_fit(quantity):
    """A falling p0/delta alone is not taken for one: k only, an elastic law."""
    run = curve(0.83, 1.3, sigY=0.004)
    bent = replace(run, p0=run.p0 * (1 - 0.45 * LOADS), P=run.P * (1 - 0.5 * LOADS))
    assert fit_curve(group([bent]), (0.1, 1.0), quantity).c is None
    assert calibrate([bent], (0.1, 1.0)).law().c is None


def test_serial_correlation_tells_noise_from_a_wrong_shape():
    """White noise: near -1/n. A curve of another shape: near 1."""
    noise = np.mean(
        [fit_curve(group([curve(0.83, noise=0.01, seed=s)])).serial_correlation for s in range(40)]
    )
    assert noise == pytest.approx(0, abs=0.15)
    run = curve(0.83)
    bent = replace(run, P=run.P * (1 - 0.1 * LOADS))
    assert fit_curve(group([bent])).serial_correlation > 0.7


def test_a_mesh_error_of_first_order_is_found_and_carried():
    """Data off by 2 h/R: the fit to the finer run is off by as much, says so, and covers the
    truth."""
    fine, coarse = (curve(0.83 * (1 + 2 * h), h=h, name=f"h{h}") for h in (0.02, 0.05))
    found = calibrate([coarse, fine])
    k = found.joint.k
    assert [scene.run.name for scene in found.scenes] == ["h0.02"]
    assert k.discretisation_error == pytest.approx(0.83 * 0.04, rel=1e-6)
    assert k.error == pytest.approx(np.hypot(k.standard_error, k.discretisation_error))
    assert k.interval[0] < 0.83 < k.interval[1]
    assert [fit.k.discretisation_error for fit in found.each] == [None, k.discretisation_error]
    stopped = replace(
        coarse, **{n: getattr(coarse, n)[:15] for n in ("delta", "P", "p0", "eps", "peeq_max")}
    )
    assert calibrate([stopped, fine]).joint.k.discretisation_error == pytest.approx(
        0.83 * 0.04, rel=1e-6
    )


@pytest.mark.parametrize("lost", [(7, 4), (4, 7), (7, 19)])
def test_the_steps_of_two_meshes_are_met_by_their_numbers(lost):
    """After an unloading the two curves may begin to count at different steps: the same error."""
    fine, coarse = (
        only(curve(0.83 * (1 + 2 * h), h=h, name=f"h{h}"), np.arange(20) != step)
        for h, step in zip((0.02, 0.05), lost, strict=True)
    )
    found = calibrate([coarse, fine]).joint.k
    assert found.discretisation_error == pytest.approx(0.83 * 0.04, rel=1e-6)


def only(run, chosen):
    """These steps of a run."""
    names = ("delta", "P", "p0", "eps", "peeq_max")
    return replace(
        run, **{name: getattr(run, name)[chosen] for name in names}, step=run.numbers[chosen]
    )


@pytest.mark.parametrize("quantity", ["P", "p0"])
def test_under_a_force_two_meshes_differ_in_delta(quantity):
    """The error is that of P and p0 at a common delta: P at a common step is the force itself."""
    fine, coarse = (
        under_forces(curve(0.83 * (1 + 2 * h), h=h, name=f"h{h}")) for h in (0.002, 0.005)
    )
    np.testing.assert_allclose(fine.P, coarse.P, rtol=1e-12)
    found = fit_curve(group([coarse, fine]), quantity=quantity).k
    assert found.value == pytest.approx(0.83 * 1.004, rel=1e-5)  # of the spline
    assert found.discretisation_error == pytest.approx(0.83 * 0.004, rel=0.02)


def under_forces(run):
    """The run under forces that are the same on every mesh."""
    forces = np.linspace(0.05, 0.95, 15) * curve(0.83).P[-1]
    at = {
        name: CubicSpline([0.0, *run.P], [0.0, *getattr(run, name)])(forces)
        for name in ("delta", "p0", "eps", "peeq_max")
    }
    return replace(run, P=forces, **at)


@pytest.mark.parametrize(("other", "scenes"), [(1.0, 1), (2.0, 2)])
def test_one_force_on_another_thickness_is_no_finer_mesh(other, scenes):
    """Forces per thickness differ then at every step."""
    forces = {"load": {"displacement": None, "force": 1e-3, "steps": 20}}
    runs = [
        replace(curve(0.83), scene=scene(h, analysis={"thickness": thickness}, **forces))
        for h, thickness in ((0.05, 1.0), (0.1, other))
    ]
    assert len(group(runs)) == scenes


def test_shorter_steps_are_no_finer_mesh():
    """Of bodies that yield they change the force, as a mesh does."""
    short = {"stepping": {"initial": 0.25, "maximum": 0.25}}
    coarse, fine, same = (
        replace(curve(0.83), scene=scene(h, **given))
        for h, given in ((0.1, {}), (0.05, short), (0.1, short))
    )
    assert [len(refined.runs) for refined in group([coarse, fine])] == [1, 1]
    assert [len(refined.runs) for refined in group([coarse, fine, same])] == [1, 2]


def test_three_meshes_tell_the_order():
    """Data off by A h^1.5, with ratios of mesh size that are no two alike: the error of k is
    exactly A h^1.5."""
    runs = [curve(0.83 * (1 + 2 * h**1.5), h=h, name=f"h{h}") for h in (0.03, 0.1, 0.05)]
    found = calibrate(runs).joint
    assert dict(found.orders)["h0.03"].value == pytest.approx(1.5, rel=1e-6)
    assert found.k.discretisation_error == pytest.approx(0.83 * 2 * 0.03**1.5, rel=1e-5)
    two = calibrate([run for run in runs if run.name != "h0.1"]).joint
    assert dict(two.orders)["h0.03"].words == "1 (assumed)"
    assert two.k.discretisation_error > found.k.discretisation_error


@pytest.mark.parametrize(
    ("errors", "order", "said"),
    [
        ((1.0, 1.01, 1.16), 2.0, "2 (from three meshes)"),
        ((1.0, 1.01, 1.022), 0.5, "0.5 (from three meshes)"),
        ((1.0, 1.01, 1.015), 1.0, "1 (assumed)"),
        ((1.0, 1.01, 0.99), 1.0, "1 (assumed)"),
    ],
)
def test_the_order_is_bounded_or_assumed(errors, order, said):
    """Meshes of h = 1, 2, 4: differences in the ratio 2^p."""
    runs = [
        curve(0.83 * e, h=h, name=f"h{h}") for e, h in zip(errors, (0.02, 0.04, 0.08), strict=True)
    ]
    (found,) = dict(calibrate(runs).joint.orders).values()
    assert (found.value, found.words) == (order, said)


def test_solved_runs(runs):
    """Elastic k of both curves near 0.83 on two meshes; of a thin plate c is near 1."""
    meshes = [Run(runs[name]).curve for name in ("elastic", "coarse")]
    elastic = calibrate(meshes).joint
    assert elastic.k.value == pytest.approx(0.83, abs=0.01)
    assert fit_curve(group(meshes), quantity="p0").k.value == pytest.approx(0.83, abs=0.03)
    assert 0 < elastic.k.discretisation_error < 0.01
    plastic = calibrate([Run(runs["plastic"]).curve], (0.25, 2)).joint
    assert plastic.k.discretisation_error is None
    assert plastic.c.value == pytest.approx(1.03, rel=0.15)


@pytest.mark.parametrize("other", [{"degree": 3}, {"gamma_factor": 2.0}])
def test_another_method_is_no_finer_mesh(other):
    """Its difference is not of the size of the elements, so no run is left out for the other."""
    runs = [curve(0.83), curve(0.85, h=0.1, name="other", analysis=other)]
    found = calibrate(runs)
    assert [refined.run for refined in found.scenes] == runs
    assert found.joint.k.discretisation_error is None


def test_a_thickness_leaves_the_law_and_a_whole_pin_has_one_of_its_own(runs, tmp_path):
    """P in history.csv is that of the thickness, P of a law never; k of a whole pin is told to be
    so."""
    sections = {"analysis": {"thickness": 7.0}, "pin": {"whole": True}}
    thick = Run(solved({"thick": scene(0.1, 6, **sections)}, tmp_path)["thick"])
    half = Run(runs["elastic"]).curve
    np.testing.assert_allclose(np.array(thick.columns["P"]), 7 * thick.curve.P, rtol=1e-12)
    whole = calibrate([thick.curve])
    assert whole.joint.k.value == pytest.approx(1.01 * calibrate([half]).joint.k.value, rel=0.01)
    assert any("k and c are of a whole pin" in said for said in notes(whole))
    assert not any("whole" in said for said in notes(calibrate([half])))
    assert LawJoint.from_scene(thick.scene).length == 7


def joint_with(name, **sections):
    """A run of the synthetic joint, with other keys in its scene."""
    return replace(curve(0.83), name=name, scene=scene(0.05, **sections))


@pytest.mark.parametrize(
    ("second", "said"),
    [
        (
            curve(0.83, name="other", analysis={"plane": "stress"}),
            "analysis.plane = 'stress' does not fit: run is in",
        ),
        (curve(0.83, name="other", h=0.05, dR=0.005), "is the same scene on the same mesh as run"),
        (
            joint_with("other", block={"nu": 0.4}),
            "the Poisson's ratios or the ratio of the moduli differ from run",
        ),
        (
            joint_with("other", block={"yield_stress": 0.002, "hardening": 0.1}),
            "block.hardening = 0.1 does not fit",
        ),
        (
            joint_with("other", pin={"whole": True}),
            "pin.whole = true does not fit: run has the other; one law is for one",
        ),
        (
            joint_with("other", analysis={"friction": 0.2}),
            r"analysis.friction = 0\.2 does not fit: the law is for",
        ),
        (
            joint_with("other", analysis={"strain": "large"}),
            "analysis.strain = 'large' does not fit: run has the other",
        ),
        (
            joint_with("other", analysis={"kinematics": "reference"}),
            "analysis.kinematics = 'reference' does not fit",
        ),
        (
            joint_with("other", block={"yield_stress": 0.002, "back_stresses": [[1.0, 10.0]]}),
            "block.back_stresses does not fit: .* archord fit RUN --table FILE",
        ),
        (
            joint_with("other", joint={"block_size": 5.0}),
            r"joint.block_size is 5 R and in run 100 R, .* 5\.6%",
        ),
    ],
)
def test_runs_that_do_not_fit_together(second, said):
    """One k is for one pair of materials in a plane, without hardening; a small block gives a
    softer joint."""
    with pytest.raises(InputError, match=f"other: {said}"):
        calibrate([curve(0.83), second])


def test_runs_whose_bodies_yield_otherwise_do_not_fit_together():
    """c depends on which body yields; elastic runs go with any."""
    block, both = (
        replace(
            curve(0.83, 1.2, sigY=0.002),
            name=name,
            scene=scene(0.05, block={"yield_stress": 0.002}, **pin),
        )
        for name, pin in (("block", {}), ("both", {"pin": {"yield_stress": 0.002}}))
    )
    with pytest.raises(
        InputError,
        match=r"both: yield stresses \(both\) do not fit: block has them otherwise \(block\)",
    ):
        calibrate([block, both])
    assert calibrate([curve(0.83), block]).law().k == pytest.approx(0.83, rel=1e-3)


@pytest.mark.parametrize("widths", [[5.0], [100.0, 50.0]])
def test_blocks_that_make_no_difference_are_fitted_together(widths):
    runs = [joint_with(f"{width}", joint={"block_size": width}) for width in widths]
    assert calibrate(runs).law().k == pytest.approx(0.83)


@pytest.mark.parametrize(
    ("load_range", "said"),
    [
        ((5.0, 6.0), "no step with contact from 5 to 6 clearances; its 20 steps are from 0.1 to 2"),
        ((1.0, 0.5), "--range 1 0.5: must be"),
        ((0.1, 0.1), "--range 0.1 0.1: must be"),
        ((0.05, 0.1), "1 points cannot determine 1 parameters"),
    ],
)
def test_ranges_that_cannot_be_fitted(load_range, said):
    with pytest.raises(InputError, match=said):
        calibrate([curve(0.83)], load_range)


def test_beyond_yield_p0_tells_nothing_of_k():
    """All steps on the plateau: P gives both coefficients, p0 is refused."""
    run = curve(0.83, 1.2, sigY=0.001)
    found = fit_curve(group([run]), (0.5, 2.0))
    assert (found.k.value, found.c.value) == pytest.approx((0.83, 1.2), rel=1e-6)
    with pytest.raises(InputError, match="p0 says nothing of k"):
        fit_curve(group([run]), (0.5, 2.0), "p0")

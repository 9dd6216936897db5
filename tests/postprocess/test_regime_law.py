"""The regime law is what its rows say, as good as it says, and silent elsewhere."""

import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import curve_fit

from archord.postprocess.chord_laws import plastic_force
from archord.postprocess.finding_rows import LOADS, read_rows, write_rows
from archord.postprocess.law_joint import LawJoint, LawRangeError, LawRangeWarning
from archord.postprocess.laws import LAWS
from archord.postprocess.regime_fit import alpha, fit_regimes
from archord.postprocess.regime_law import from_json, regime, shipped_fits, to_json
from archord.solver.scene import SceneError
from archord.solver.scene_file import load_scene

ROWS = read_rows()
CURRENT = [row for row in ROWS if row.kinematics == "current"]
SCENES = Path(__file__).parents[2] / "scenes"


def joint(row):
    return LawJoint(
        1.0, row.clearance, 1.0, None if math.isinf(row.s) else row.s * row.clearance, dundurs_alpha=alpha(row),
        plane=row.plane, nu=row.nu, yielding="both" if row.yielding == "none" else row.yielding,
    )  # fmt: skip


def test_k_and_c_of_every_row_are_those_of_its_curve():
    """An independent least squares fit to the stored forces."""
    for row in ROWS:
        delta, stress = LOADS * row.clearance, row.s * row.clearance

        def law(x, k, c=1.0, row=row, stress=stress):
            yields = None if math.isnan(row.c) else stress
            return plastic_force(LawJoint(1.0, row.clearance, 1.0, yields, k=k, c=c), x) / row.clearance

        start = [0.9 * row.k] if math.isnan(row.c) else [0.9 * row.k, 1.1 * row.c]
        found, _ = curve_fit(law, delta, row.P, p0=start, bounds=(0, np.inf), ftol=1e-14, xtol=1e-14)
        assert found == pytest.approx([row.k, row.c][: len(start)], rel=1e-5), row.joint


def test_the_shipped_coefficients_are_those_of_the_shipped_rows():
    """Fitted anew, number for number; ranges and errors too."""
    for fresh, shipped in zip(fit_regimes(ROWS), shipped_fits(), strict=True):
        assert vars(fresh).keys() == vars(shipped).keys()
        for name, value in vars(fresh).items():
            if isinstance(value, str):
                assert getattr(shipped, name) == value
            else:
                assert getattr(shipped, name) == pytest.approx(value, rel=2e-4, abs=2e-6), (shipped, name)


def test_the_files_give_back_what_was_written(tmp_path):
    write_rows(ROWS, tmp_path / "rows.csv")
    for one, other in zip(read_rows(tmp_path / "rows.csv"), ROWS, strict=True):
        assert (one.joint, one.plane, one.s, one.k) == (other.joint, other.plane, other.s, other.k)
        np.testing.assert_array_equal(one.P, other.P)
    assert from_json(to_json(shipped_fits())) == shipped_fits()


@pytest.mark.parametrize("fit", shipped_fits(), ids=lambda fit: f"{fit.plane}-{fit.yielding}")
def test_the_force_is_as_near_to_the_simulations_as_stated(fit):
    """Largest and mean difference, evaluated through the law as users do; and better than eqs 9 to 12 as printed."""
    rows = [r for r in CURRENT if (r.plane, r.yielding) == (fit.plane, fit.yielding)]
    rows = [r for r in rows if fit.yielding == "none" or math.isfinite(r.c)]
    late = LOADS > 0.45
    off, paper = [], []
    for row in rows:
        delta = LOADS * row.clearance
        off.append(LAWS["regime"].force(joint(row), delta, "raise") / row.clearance / row.P - 1)
        paper.append(plastic_force(joint(row), delta) / row.clearance / row.P - 1)
    off, paper = np.array(off)[:, late], np.array(paper)[:, late]
    assert np.abs(off).max() == pytest.approx(fit.P_error, abs=1e-4)
    assert np.sqrt((off**2).mean()) == pytest.approx(fit.P_rms, abs=1e-4)
    assert fit.P_rms < np.sqrt((paper**2).mean())


def test_no_single_row_carries_the_law():
    """Each joint that is not at a corner of the range is foretold by the others, k and c within 5 %."""
    inner = [
        r
        for r in CURRENT
        if r.yielding != "pin" and r.nu == 0.3 and 0.2 < r.s < 1 and -0.5 < alpha(r) < 0.8 and math.isfinite(r.c)
    ]
    assert len(inner) > 10
    for left_out in inner:
        fits = fit_regimes([row for row in ROWS if row is not left_out])
        fit = next(f for f in fits if (f.plane, f.yielding) == (left_out.plane, left_out.yielding))
        found = fit.coefficients(left_out.s, left_out.nu, alpha(left_out))
        assert found == pytest.approx((left_out.k, left_out.c), rel=0.05), left_out.joint


def test_a_scene_has_the_coefficients_of_its_numbers():
    """From the scene's joint or from numbers: the same k and c; without a yield stress the elastic k."""
    steel = LawJoint.from_scene(load_scene(SCENES / "steel_pin.toml"))
    found = regime("strain", 0.3, s=0.4)
    expected = plastic_force(LawJoint(10.0, 0.05, steel.E_star, steel.yield_stress, k=found.k, c=found.c), 0.07)
    assert LAWS["regime"].force(steel, 0.07) == pytest.approx(float(expected), rel=1e-12)
    assert LAWS["regime"].peak_pressure(steel, expected) == pytest.approx(found.c * steel.yield_stress)
    softer = LawJoint.from_scene(load_scene(SCENES / "steel_pin.toml", ["block.E=70000"]))
    assert (softer.plane, softer.nu, softer.yielding) == ("strain", 0.3, "both")
    elastic = regime("stress", 0.2, modulus_ratio=3.0)
    assert math.isinf(elastic.c)
    joint = LawJoint(1.0, 0.005, 1.0, dundurs_alpha=0.5, plane="stress", nu=0.2)
    by_paper = LawJoint(1.0, 0.005, 1.0, k=elastic.k)
    assert LAWS["regime"].force(joint, 0.004) == pytest.approx(float(LAWS["paper"].force(by_paper, 0.004)))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"s": 0.1}, r"sigY R/\(E\* dR\) = 0.1 is outside 0.2 to 1.25"),
        ({"s": 3.0}, "outside 0.2 to 1.25"),
        ({"nu": -0.2}, "Poisson's ratio = -0.2 is outside 0 to 0.49"),
        ({"modulus_ratio": 0.1}, "Dundurs' alpha = -0.8182 is outside"),
        ({"yielding": "pin"}, "only the pin yields"),
    ],
)
def test_outside_the_simulations_there_is_no_number(change, said):
    """nan and a warning that says what is outside; the formula, or an error, on request."""
    given = {"plane": "strain", "nu": 0.3, "s": 0.4} | change
    with pytest.warns(LawRangeWarning, match=said):
        found = regime(**given)
    assert math.isnan(found.k)
    assert math.isnan(found.c)
    with pytest.raises(LawRangeError, match=said):
        regime(**given, outside="raise")
    with pytest.warns(LawRangeWarning):
        assert regime(**given, outside="extrapolate").k > 0


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"clearance": 0.02, "yield_stress": 0.008}, "dR/R = 0.02 is more than 0.01"),
        ({"pin_nu": 0.4}, "Poisson's ratios 0.4 of the pin and 0.3 of the block are not alike"),
        ({"yielding": "unlike"}, "unlike yield stresses"),
    ],
)
def test_joints_unlike_those_simulated(change, said):
    given = {"radius": 1.0, "clearance": 0.005, "E_star": 1.0, "yield_stress": 0.002, "plane": "strain", "nu": 0.3}
    with pytest.warns(LawRangeWarning, match=said):
        assert np.isnan(LAWS["regime"].force(LawJoint(**(given | change)), 0.001))


@pytest.mark.parametrize(
    "bad", [{"plane": "axial"}, {"nu": 0.5}, {"s": 0.0}, {"modulus_ratio": -1.0}, {"yielding": "x"}]
)
def test_what_is_no_joint_is_refused(bad):
    with pytest.raises(SceneError, match=f"{next(iter(bad))} = "):
        regime(**({"plane": "strain", "nu": 0.3} | bad))


def test_the_limits_of_a_stiff_pin_agree():
    """A rigid pin is the limit of stiffer and stiffer ones, without a jump."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        stiff, rigid = (regime("strain", 0.3, ratio, 0.4, "block") for ratio in (1e9, math.inf))
    assert (stiff.k, stiff.c) == pytest.approx((rigid.k, rigid.c), rel=1e-8)

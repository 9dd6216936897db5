"""The model of k and c finds laws that are there, and its cross-validation knows those that are not."""

import math

import numpy as np
import pytest

from archord.postprocess.laws import study_cases
from archord.postprocess.laws.calibrated import CalibratedModel
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.study import TooFewError, cross_validate, errors, fit_model, predictions, study, summary
from archord.postprocess.laws.study_cases import joint_of_case, read_cases, split, table_of, usable
from archord.scene.errors import InputError

LOAD = np.linspace(0.2, 2.0, 10)


def form(elastic, late, strain):
    """The terms of a model, of plane stress but a constant."""
    parts = {"elastic": elastic, "late": late, "strain": strain, "stress": "1"}
    return {part: terms.split() for part, terms in parts.items()}


SMALL = form("p q pm qn", "1 p", "1 x q")
COMPLIANCE = (1.1, 1.3, -0.6, 0.7)
RATE, LATE, THRESHOLD = 3.0, (-0.5, -0.4), (0.2, -0.3, -0.1)
ALIKE = {"plane": "strain", "yielding": "none", "ratio": 1.0, "pin_nu": 0.3, "nu": 0.3, "s": math.inf}


def joints(*changes, load=LOAD):
    """Cases of like bodies with nu = 0.3 and dR/R = 0.5 %, but for ``changes``; k and c are not fitted yet."""
    rest = dict.fromkeys(("k_error", "k_mesh", "c", "c_error", "c_mesh"), math.nan)
    rest |= {"clearance": 0.005, "mesh": 0.05, "k": 1.0, "rms": 0.0, "largest": 0.0, "load": load, "P": load}
    cases = [ALIKE | rest | {"run": f"run{i}"} | change for i, change in enumerate(changes)]
    return table_of(case | {"strength": case["s"] * case["clearance"]} for case in cases)


def fitted(cases, k, c):
    """``cases`` whose curves are the law with ``k`` and ``c``."""
    cases = cases.assign(k=k, c=c)
    laws = [joint_of_case(case, case.k, case.c) for case in cases.itertuples()]
    cases["P"] = [plastic_winkler(law, LOAD * law.clearance).load / law.clearance for law in laws]
    return table_of(cases.to_dict("records"))


def truth(cases):
    """k and c of the model that the synthetic cases follow, written out by hand for plane strain."""
    p, q = (1 - cases.alpha) / 2, (1 + cases.alpha) / 2
    m, n = cases.pin_nu / (1 - cases.pin_nu), cases.nu / (1 - cases.nu)
    a, b, am, bn = COMPLIANCE
    k = 1 / (p * (a + am * m) + q * (b + bn * n))
    c = np.exp(THRESHOLD[0] + THRESHOLD[1] * np.log(cases.s / 0.4) + THRESHOLD[2] * q)
    return k * np.exp((LATE[0] + LATE[1] * p) * np.exp(-RATE * cases.s / k)), c.where(np.isfinite(cases.s))


def synthetic(number=60, noise=0.0, law=truth):
    """Cases of plane strain, elastic and plastic, that follow ``law``."""
    random = np.random.default_rng(1)
    changes, noises = [], []
    for i in range(number):
        ratio, s = np.exp(random.uniform([-1, -1.6], [2, 0]))
        nu, pin_nu = random.uniform(0, 0.45, 2)
        changes.append({"ratio": ratio, "nu": nu, "pin_nu": pin_nu} | ({"yielding": "both", "s": s} if i % 2 else {}))
        noises.append(np.exp(noise * random.standard_normal(2)))
    cases = joints(*changes)
    k, c = (value * off for value, off in zip(law(cases), np.transpose(noises), strict=True))
    return fitted(cases, k, c)


def test_the_coefficients_of_a_law_are_found():
    """All of them, from k and c alone; no case is then missed, those held out neither."""
    used, held = split(synthetic())
    assert len(held) == 8
    model = fit_model(used, SMALL)
    assert model.data["elastic"] == pytest.approx(list(COMPLIANCE), rel=1e-4)
    part = model.data["plastic"]["strain both"]
    assert [part["rate"], *part["late"]] == pytest.approx([RATE, *LATE], rel=1e-3)
    assert part["threshold"] == pytest.approx(list(THRESHOLD), rel=1e-3)
    off = errors(held, *predictions(model, held))
    assert set(off.what) == {"k", "c", "P", "P early"}
    assert off.off.abs().max() < 1e-4


def test_cross_validation_tells_the_noise():
    """Of a right form, the error on cases not seen is that of the cases, not less."""
    cases = synthetic(200, noise=0.02)
    found = summary(errors(cases, *cross_validate(cases, SMALL)))
    assert [found["k"]["rms"], found["c"]["rms"]] == pytest.approx([0.021, 0.021], abs=0.004)


def test_cross_validation_detects_a_useless_model():
    """Where k and c do not depend on anything, more terms fit better and predict worse than a constant."""
    random = np.random.default_rng(3)
    cases = synthetic(36, law=lambda cases: np.exp(0.3 * random.standard_normal((len(cases), 2)).T))
    cases.loc[cases.yielding == "none", ["c", "clear_c"]] = math.nan
    constant = form("1", "1", "1")
    many = form("p q pm qn pq pmm qnn", "1", "1 x q xq qn pm")
    seen = [summary(errors(cases, *predictions(fit_model(cases, terms), cases))) for terms in (constant, many)]
    unseen = [summary(errors(cases, *cross_validate(cases, terms))) for terms in (constant, many)]
    for name in ("k", "c"):
        assert seen[1][name]["rms"] < seen[0][name]["rms"]
        assert unseen[1][name]["rms"] > unseen[0][name]["rms"]


def test_cases_held_out_are_held_out():
    """They leave no trace in the coefficients, and do not depend on order."""
    cases = synthetic(60, noise=0.01)
    held, again = (set(split(some)[1].run) for some in (cases, cases[::-1]))
    assert again == held
    spoiled = cases.assign(k=cases.k.where(~cases.run.isin(held), 5 * cases.k))
    one, other = study(cases, form=SMALL), study(spoiled, form=SMALL)
    for name in ("elastic", "plastic"):
        assert one.data[name] == other.data[name]
    by = [model.data["errors"] for model in (one, other)]
    assert by[1]["held out"]["both all"]["k"]["rms"] > 0.7
    assert by[1]["cross-validated"] == by[0]["cross-validated"]


def test_plane_stress_is_plane_strain_with_other_constants():
    """nu in plane stress is nu/(1 + nu) in plane strain."""
    changes = [{"nu": nu, "pin_nu": nu} for nu in (0.4 / 1.4, 0.4)]
    cases = joints(*changes, changes[1] | {"plane": "stress"})
    strain, other, stress = fit_model(synthetic(), SMALL).elastic_k(cases)
    assert stress == pytest.approx(strain, rel=1e-12)
    assert stress != pytest.approx(other, rel=1e-3)


def test_too_few_cases_are_refused_and_kinds_without_cases_left_out():
    with pytest.raises(TooFewError, match="1 elastic cases are too few for a model: it takes 8"):
        fit_model(synthetic(2), SMALL)
    model = fit_model(synthetic(), SMALL)
    assert [*model.data["plastic"]] == ["strain both"]
    with pytest.raises(ValueError, match="no joint in plane stress of which both yields was fitted"):
        model.coefficients("stress both", synthetic(2))


def test_what_no_model_is_for_is_left_out():
    """A soft incompressible pin, a joint of which only the pin yields, and one that was not pressed as far."""
    short, soft = {"load": LOAD[:5], "P": LOAD[:5]}, {"ratio": 0.3, "pin_nu": 0.49}
    used, out = usable(joints({}, short, soft, {"yielding": "pin", "s": 0.4}))
    assert list(used.run) == ["run0"]
    assert [(run, reason.partition(" =")[0]) for run, reason in out] == [
        ("run1", "ends at 1 dR, others at 2"),
        ("run2", "(1 - alpha)/2 times the pin's equivalent Poisson's ratio"),
        ("run3", "only the pin yields"),
    ]


def test_files_give_back_what_was_written(tmp_path):
    """The model digit for digit, the cases to seven; a file of another kind is refused by name."""
    cases = synthetic(60, noise=0.01)
    model = study(cases, form=SMALL, provenance={"sweep": "abc"})
    assert CalibratedModel.from_json(model.to_json()) == model
    (tmp_path / "fit.csv").write_text(study_cases.as_csv(cases, {"archord": "1", "sweep": "a: b"}))
    back, notes = read_cases(tmp_path / "fit.csv")
    assert notes == {"archord": "1", "sweep": "a: b"}
    for name in ("run", "plane", "yielding", "digest"):
        assert list(back[name]) == list(cases[name])
    for name in [*study_cases.COLUMNS][3:-2]:
        np.testing.assert_allclose(back[name], cases[name], rtol=1e-6)
    np.testing.assert_allclose(np.stack(back.P), np.stack(cases.P), rtol=1e-6)
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"other\.csv: cannot be read as the fitted cases"):
        read_cases(tmp_path / "other.csv")
    spoiled = CalibratedModel(model.data | {"elastic": model.data["elastic"][1:]}).to_json()
    for text in ("{}", "[", '"1"', spoiled):
        with pytest.raises(ValueError, match="is not a calibrated law"):
            CalibratedModel.from_json(text)

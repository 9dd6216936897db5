"""The model of k and c finds laws that are there, and its cross-validation knows those that are not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from archord.postprocess.laws.calibrated import CalibratedModel, Points
from archord.postprocess.laws.chord_laws import plastic_force
from archord.postprocess.laws.study import (
    FORM,
    FittedCase,
    TooFewError,
    cross_validate,
    errors,
    fit_model,
    form,
    predictions,
    read_cases,
    split,
    study,
    usable,
    write_cases,
)
from archord.scene.errors import InputError

LOAD = np.linspace(0.2, 2.0, 10)
SMALL = form("small", "p q pm qn", "1 p", "1 x q", "1")
COMPLIANCE = (1.1, 1.3, -0.6, 0.7)
RATE, LATE, THRESHOLD = 3.0, (-0.5, -0.4), (0.2, -0.3, -0.1)


def case(plane, yielding, ratio, pin_nu, nu, s, clearance, k=1.0, c=math.nan):
    """A case whose curve is the law itself."""
    name = f"{plane}{yielding}{ratio:.4g}{pin_nu:.4g}{nu:.4g}{s:.4g}{clearance:.4g}"
    numbers = (ratio, pin_nu, nu, clearance, s * clearance, 0.05)
    fitted = (k, 0.0, math.nan, c, 0.0, math.nan, c, 0.0, 0.0)
    found = FittedCase(name, plane, yielding, *numbers, *fitted, LOAD, LOAD)
    return replace(found, P=plastic_force(found.joint(k, c), LOAD * clearance) / clearance)


def truth(found):
    """k and c of the model that the synthetic cases follow, written out by hand."""
    p, q = (1 - found.alpha) / 2, (1 + found.alpha) / 2
    m, n = (nu / (1 - nu) if found.plane == "strain" else nu for nu in (found.pin_nu, found.nu))
    a, b, am, bn = COMPLIANCE
    k = 1 / (p * (a + am * m) + q * (b + bn * n))
    if found.yielding == "none":
        return k, math.nan
    c = math.exp(THRESHOLD[0] + THRESHOLD[1] * math.log(found.s / 0.4) + THRESHOLD[2] * q)
    return k * math.exp((LATE[0] + LATE[1] * p) * math.exp(-RATE * found.s / k)), c


def synthetic(number=60, noise=0.0, law=truth):
    """Cases of plane strain, elastic and plastic, that follow ``law``."""
    random = np.random.default_rng(1)
    cases = []
    for i in range(number):
        ratio, s = np.exp(random.uniform([-1, -1.6], [2, 0]))
        nu, pin_nu = random.uniform(0, 0.45, 2)
        yielding = ("none", "both")[i % 2]
        found = case("strain", yielding, ratio, pin_nu, nu, s if i % 2 else math.inf, 0.005)
        k, c = (value * math.exp(noise * random.standard_normal()) for value in law(found))
        cases.append(case("strain", yielding, ratio, pin_nu, nu, found.s, 0.005, k, c))
    return cases


def test_the_coefficients_of_a_law_are_found():
    """All of them, from k and c alone; no case is then missed, those held out neither."""
    used, held = split(synthetic())
    assert len(held) == 8
    model = fit_model(used, SMALL)
    assert model.data["elastic"] == pytest.approx(list(COMPLIANCE), rel=1e-4)
    part = model.plastic(("strain", "both"))
    assert [part["rate"], *part["late"]] == pytest.approx([RATE, *LATE], rel=1e-3)
    assert part["threshold"] == pytest.approx(list(THRESHOLD), rel=1e-3)
    off = errors(held, *predictions(model, held))
    assert np.abs(off.k).max() < 1e-4
    assert max(np.abs(part).max() for part in off.P) < 1e-4


def test_cross_validation_tells_the_noise():
    """Of a right form, the error on cases not seen is that of the cases, not less."""
    found = cross_validate(synthetic(200, noise=0.02), SMALL).summary()
    assert 0.017 < found["k"]["rms"] < 0.025
    assert 0.017 < found["c"]["rms"] < 0.025


def test_cross_validation_detects_a_useless_model():
    """Where k and c do not depend on anything, more terms fit better and foretell worse than a constant."""
    random = np.random.default_rng(3)
    cases = synthetic(36, law=lambda found: tuple(np.exp(0.3 * random.standard_normal(2))))
    constant, many = (
        form("constant", "1", "", "1", "1"),
        form("many", "p q pm qn pq pmm qnn", "", "1 x q xq qn pm", "1"),
    )
    fitted = {terms["name"]: predictions(fit_model(cases, terms), cases) for terms in (constant, many)}
    seen = {name: errors(cases, *found).summary() for name, found in fitted.items()}
    foretold = {terms["name"]: cross_validate(cases, terms).summary() for terms in (constant, many)}
    for name in ("k", "c"):
        assert seen["many"][name]["rms"] < seen["constant"][name]["rms"]
        assert foretold["many"][name]["rms"] > foretold["constant"][name]["rms"]


def test_cases_held_out_are_held_out():
    """They leave no trace in the coefficients, and do not depend on order."""
    cases = synthetic(60, noise=0.01)
    held, again = ({c.run for c in split(some)[1]} for some in (cases, cases[::-1]))
    assert again == held
    spoiled = [replace(c, k=5 * c.k) if c.run in held else c for c in cases]
    one, other = study(cases, form=SMALL), study(spoiled, form=SMALL)
    for name in ("elastic", "plastic"):
        assert one.model.data[name] == other.model.data[name]
    by = [{what: row for what, _, kind, row in result.rows if kind == "all"} for result in (one, other)]
    assert by[1]["held out"]["k"]["rms"] > 0.7
    assert by[1]["cross-validated"] == by[0]["cross-validated"]


def test_late_yielding_tends_to_the_elastic_joint():
    """k of the plastic kind goes over into the elastic k, and falls short of it before."""
    model = fit_model(synthetic(), SMALL)
    joints = [case("strain", "both", 2.0, 0.3, 0.2, s, 0.005) for s in (0.3, 20.0)]
    (early, late), _ = model.coefficients(("strain", "both"), Points.of(joints))
    elastic = model.elastic_k(Points.of(joints))
    assert late == pytest.approx(elastic[1], rel=1e-9)
    assert early < 0.9 * elastic[0]


def test_the_planes_are_one_elastic_problem():
    """nu in plane stress is nu/(1 + nu) in plane strain."""
    model = fit_model(synthetic(), SMALL)
    stress = case("stress", "none", 1.0, 0.4, 0.4, math.inf, 0.005)
    strain = case("strain", "none", 1.0, 0.4 / 1.4, 0.4 / 1.4, math.inf, 0.005)
    one, other = (model.elastic_k(Points.of([c]))[0] for c in (stress, strain))
    assert one == pytest.approx(other, rel=1e-12)
    assert one != pytest.approx(model.elastic_k(Points.of([replace(stress, plane="strain")]))[0], rel=1e-3)


def test_a_rigid_pin_is_the_limit_of_stiff_ones():
    model = fit_model(synthetic(), SMALL)
    stiff = case("strain", "none", 1e9, 0.2, 0.3, math.inf, 0.005)
    rigid = case("strain", "none", math.inf, math.nan, 0.3, math.inf, 0.005)
    assert rigid.alpha == 1
    assert model.elastic_k(Points.of([stiff])) == pytest.approx(model.elastic_k(Points.of([rigid])), rel=1e-8)


def test_too_few_cases_are_refused_and_kinds_without_cases_left_out():
    with pytest.raises(TooFewError, match="1 elastic cases are too few for a model: it takes 8"):
        fit_model(synthetic(2), SMALL)
    model = fit_model(synthetic(), SMALL)
    assert [(p["plane"], p["yielding"]) for p in model.data["plastic"]] == [("strain", "both")]
    with pytest.raises(ValueError, match="no joint in plane stress of which both yields was fitted"):
        model.plastic(("stress", "both"))


def test_what_no_model_is_for_is_left_out():
    """A soft incompressible pin, a joint of which only the pin yields, and one that was not pressed as far."""
    good = case("strain", "none", 1.0, 0.3, 0.3, math.inf, 0.005)
    short = replace(good, load=LOAD[:5], P=LOAD[:5], run="short")
    soft = case("strain", "none", 0.3, 0.49, 0.3, math.inf, 0.005)
    pin = case("strain", "pin", 1.0, 0.3, 0.3, 0.4, 0.005)
    used, out = usable([good, short, soft, pin])
    assert used == [good]
    assert [reason.partition(" =")[0] for _, reason in out] == [
        "ends at 1 dR, others at 2", "(1 - alpha)/2 times the pin's equivalent Poisson's ratio", "only the pin yields",
    ]  # fmt: skip


def test_files_give_back_what_was_written(tmp_path):
    """The model digit for digit, the cases to seven; a file of another kind is refused by name."""
    cases = synthetic(60, noise=0.01)
    model = study(cases, form=SMALL, provenance={"sweep": "abc"}).model
    assert model.data["provenance"]["sweep"] == "abc"
    assert CalibratedModel.from_json(model.to_json()) == model
    write_cases(cases, {"archord": "1", "sweep": "a: b"}, tmp_path / "fit.csv")
    back, notes = read_cases(tmp_path / "fit.csv")
    assert notes == {"archord": "1", "sweep": "a: b"}
    for one, other in zip(back, cases, strict=True):
        assert (one.kind, one.run, one.digest) == (other.kind, other.run, other.digest)
        assert (one.k, one.alpha) == pytest.approx((other.k, other.alpha), rel=1e-6, abs=1e-6)
        np.testing.assert_allclose(one.P, other.P, rtol=1e-6)
    (tmp_path / "other.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"other\.csv: cannot be read as the fitted cases"):
        read_cases(tmp_path / "other.csv")
    spoiled = CalibratedModel(model.data | {"elastic": model.data["elastic"][1:]}).to_json()
    for text in ("{}", "[", '"1"', spoiled):
        with pytest.raises(ValueError, match="is not a calibrated law"):
            CalibratedModel.from_json(text)


def test_the_form_has_what_every_kind_needs():
    """Factors by name, each term once."""
    for names in (FORM[part] for part in ("elastic", "late", "strain", "stress")):
        assert len(set(names)) == len(names)
        assert set("".join(names)) <= set("1pqmnxd")

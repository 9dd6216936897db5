"""The closed-form laws by name, with formula, range, source and remarks: ``LAWS["johnson"].force(joint, delta)``."""

from __future__ import annotations

import difflib
from collections.abc import Callable
from functools import partial

from archord.postprocess.laws import calibrated_law
from archord.postprocess.laws import chord_laws as chord
from archord.postprocess.laws import hertz_laws as hertz
from archord.postprocess.laws import logarithmic_laws as log
from archord.postprocess.laws import persson_law as persson
from archord.postprocess.laws.law import Law
from archord.postprocess.laws.law_joint import LawJoint
from archord.scene.errors import InputError

_THIN = 0.1  # dR/R up to which R1 = R2 = R is an approximation
_ALIKE = 0.01  # Dundurs' beta that counts as zero
_HU = 'Hu et al., "A new model for elasto-plastic conformal contact between cylinders"'
_DEEPEST = 2.0  # displacement over clearance up to which Hu et al. compare their law with finite elements


def _deepest(joint: LawJoint) -> float:
    return _DEEPEST * joint.clearance


def _thick(joint: LawJoint) -> str:
    ratio = joint.clearance / joint.radius
    return f"dR/R = {ratio:.3g} is no small clearance" if ratio > _THIN else ""


def _unlike(joint: LawJoint) -> str:
    if abs(joint.dundurs_beta) > _ALIKE:
        return f"Dundurs' beta = {joint.dundurs_beta:.3g} is not zero"
    return _thick(joint)


def _logarithmic(
    name: str,
    title: str,
    formula: str,
    range: str,
    source: str,
    remarks: str,
    make: Callable[[LawJoint], log.Logarithm],
    limit: Callable[[LawJoint], float] | None = None,
    needs: tuple[str, ...] = (),
    hertz_pressure: bool = False,
) -> Law:
    return Law(
        name,
        title,
        formula,
        range,
        source,
        remarks,
        limit=limit or (lambda joint: make(joint).delta_limit),
        end=lambda joint: make(joint).delta_limit,
        needs=needs,
        force_at=lambda joint, delta: make(joint).force(delta),
        stiffness_at=lambda joint, delta: make(joint).stiffness(delta),
        displacement_of=lambda joint, P: make(joint).displacement(P),
        pressure_limit=hertz.hertz_load_limit if hertz_pressure else None,
        peak_of=hertz.hertz_pressure if hertz_pressure else None,
        angle_of=hertz.hertz_angle if hertz_pressure else None,
    )


def _slender(joint: LawJoint) -> float:
    limited = min(log.slender_load(joint), log.dubowsky_freudenstein(joint).load_limit)
    return float(log.dubowsky_freudenstein(joint).displacement(limited))


_RADZIMOVSKY = "delta = P/(pi E*) [2/3 + ln(4 R1/d) + ln(4 R2/d)], "
_RISING = "up to its load limit, beyond which delta(P) falls"
_SECOND_HAND = "not checked against the original, which was out of reach"

_ALL = [
    Law(
        "calibrated",
        "plastic-Winkler law with k and c of archord's simulations",
        "as paper-plastic with k, and c sigY in place of sigY; 1/k_e, A and ln c = polynomials of Dundurs' alpha, "
        "Poisson's ratios and ln s, ln(k/k_e) = A exp(-b s/k_e), s = sigY R/(E* dR), by plane and yielding body",
        calibrated_law.range_in_words(),
        "ours: fitted by archord fit to the cases of scenes/calibration.sweep.toml",
        calibrated_law.quality_in_words(),
        limit=_deepest,
        unfit=calibrated_law.unfit,
        needs=("plane", "nu"),
        force_at=calibrated_law.calibrated_force,
        stiffness_at=calibrated_law.calibrated_stiffness,
        peak_at=calibrated_law.calibrated_peak,
        angle_at=chord.chord_angle,
    ),
    Law(
        "paper",
        "elastic law of Hu et al. (eq. 9)",
        "P = (8/3) k E* delta sqrt(delta/(2 (dR + delta))); p0 = k E* delta/R; cos eps = dR/(dR + delta)",
        "delta <= 2 dR, dR <= 0.1 R; the paper compares up to delta = 2 dR for dR/R = 0.1 % to 1 %",
        f"{_HU}, eqs 3 to 9",
        "A parabola of pressure over the chord with Winkler's peak; k = 0.85 was fitted to finite elements. R is the "
        "radius of the pin.",
        limit=_deepest,
        unfit=_thick,
        force_at=chord.paper_force,
        stiffness_at=chord.paper_stiffness,
        peak_at=chord.winkler_pressure,
        angle_at=chord.chord_angle,
    ),
    Law(
        "paper-plastic",
        "elasto-plastic law of Hu et al. (eqs 11, 12)",
        "P = 2 sigY l [(delta/delta0) (2/3 - s + s^3/3) + s], s = sqrt(1 - delta0/delta), delta0 = R sigY/(k E*), "
        "l = 2 R sqrt(delta/(2 (dR + delta))); paper below delta0",
        "delta <= 2 dR, dR <= 0.1 R, perfect plasticity; the paper compares sigY/E* = 0.1 % to 0.6 %",
        f"{_HU}, eqs 10 to 12, derived anew from eq. 10",
        "The parabola cut off at the yield stress. Equals the elastic law at delta0, with the same slope.",
        limit=_deepest,
        unfit=_thick,
        needs=("yield_stress",),
        force_at=chord.plastic_force,
        stiffness_at=chord.plastic_stiffness,
        peak_at=chord.plastic_peak,
        angle_at=chord.chord_angle,
    ),
    Law(
        "winkler",
        "Winkler foundation on the arc",
        "P = k E* [(dR + delta) eps - dR sin eps], cos eps = dR/(dR + delta); p0 = k E* delta/R",
        "delta <= 2 dR, dR <= 0.1 R: the range of the geometry it shares with the law of Hu et al.",
        f"{_HU}, eqs 4 and 6 for the pressure; the integral over the arc is ours",
        "The foundation itself, without the parabola over the chord; dP/d(delta) = k E* (eps + sin eps cos eps).",
        limit=_deepest,
        unfit=_thick,
        force_at=chord.winkler_force,
        stiffness_at=chord.winkler_stiffness,
        peak_at=chord.winkler_pressure,
        angle_at=chord.chord_angle,
    ),
    Law(
        "liu",
        "Liu, Zhang and Yang",
        "P = (pi/2) E* delta sqrt(delta/(2 (dR + delta))); p0 = E* delta/(2 R)",
        "delta <= 2 dR, dR <= 0.1 R: ours, as for the law of Hu et al., whose geometry it shares",
        "Liu, Zhang and Yang 2007, Mechanism and Machine Theory 42, 183; form as in the public multibody code of the "
        "first author of Skrinjar, Slavic and Boltezar 2018",
        f"An ellipse of pressure over the chord. Form {_SECOND_HAND}; p0 follows from the form.",
        limit=_deepest,
        unfit=_thick,
        force_at=chord.liu_force,
        stiffness_at=chord.liu_stiffness,
        peak_at=lambda joint, delta: joint.E_star * delta / (2 * joint.radius),
        angle_at=chord.chord_angle,
    ),
    _logarithmic(
        "johnson",
        "Johnson",
        "delta = P/(pi E*) [ln(4 pi E* dR/P) - 1]",
        f"{_RISING}: P <= (4 pi/e^2) E* dR = 1.7007 E* dR, delta <= 0.5413 dR",
        f"Johnson 1985, Contact Mechanics, sections 4.2 and 5.6; {_HU}, eq. 16",
        "Hertz's line contact between pin and hole as half-spaces, so good for contacts small against R. p0 and eps "
        "are those of Hertz, in his range; the factor of 2 in eq. 7 as printed would need a diameter for R*.",
        log.johnson,
        hertz_pressure=True,
    ),
    _logarithmic(
        "radzimovsky",
        "Radzimovsky, as the paper prints it",
        _RADZIMOVSKY + "d = 1.6 (R* P/E*)^(1/2)",
        f"{_RISING}: P <= 6.25 e^(-1/3) E* dR = 4.478 E* dR, delta <= 1.4255 dR",
        f"Radzimovsky 1953, University of Illinois Bulletin 408; {_HU}, eqs 17 to 19",
        "d is neither the width nor the half-width of the contact: 1.6 belongs to Roark's K_D of diameters. The public "
        "multibody code of the first author of the 2018 review has the same d.",
        log.radzimovsky,
        hertz_pressure=True,
    ),
    _logarithmic(
        "radzimovsky-width",
        "Radzimovsky with the width of the contact (Roark)",
        _RADZIMOVSKY + "d = 1.6 (2 R* P/E*)^(1/2)",
        f"{_RISING}: P <= 3.125 e^(-1/3) E* dR = 2.239 E* dR, delta <= 0.7127 dR",
        "Radzimovsky 1953; Roark's Formulas for Stress and Strain (Young and Budynas), cylinders in contact",
        "d is the full width of Hertz's contact, 4 (R* P/(pi E*))^(1/2) = 2.257 (R* P/E*)^(1/2), to 0.3 %. Differs "
        "from Johnson by 2/3 + 1 - 2 ln 2 = 0.280 in the bracket. Roark's form is quoted from memory of the handbook.",
        partial(log.radzimovsky, width=log.ROARK_WIDTH),
        hertz_pressure=True,
    ),
    _logarithmic(
        "radzimovsky-2.41",
        "Radzimovsky with the load limit the paper states",
        _RADZIMOVSKY + "d = 2.181 (R* P/E*)^(1/2)",
        f"{_RISING}: P <= 2.41 E* dR, delta <= 0.7671 dR",
        f"{_HU}, the limit of 2.41 E* dR below eq. 9",
        "The coefficient is 4 e^(-1/6)/sqrt(2.41), from the limit; no reading of d we know gives it.",
        partial(log.radzimovsky, width=log.IMPLIED_WIDTH),
        hertz_pressure=True,
    ),
    _logarithmic(
        "esdu-78035",
        "ESDU 78035",
        "delta = F (s1 + s2)/L [ln(4 L dR/(F (s1 + s2))) + 1] = P/(pi E*) [ln(4 pi E* dR/P) + 1], "
        "s = (1 - nu^2)/(pi E), F = P L",
        f"{_RISING}: P <= 4 pi E* dR = 12.57 E* dR, delta <= 4 dR",
        "ESDU Item 78035 (Tribology Series, 1978), as quoted by Flores and Ambrosio 2004 and later reviews",
        f"Johnson's law with + 1 for - 1; the length cancels. Form {_SECOND_HAND}: quoted from memory of the reviews. "
        "A public multibody code has a factor of pi more before the bracket, so the displacement is uncertain by that; "
        "ours is the form that tends to half-spaces, P/(pi E*) ln(1/P), for small loads. The form with L^3 in the "
        "logarithm that is sometimes given under this name is dubowsky-freudenstein.",
        log.esdu,
    ),
    _logarithmic(
        "dubowsky-freudenstein",
        "Dubowsky and Freudenstein",
        "delta = F (s1 + s2)/L [ln(L^3 dR/(F R1 R2 (s1 + s2))) + 1], s = (1 - nu^2)/(pi E), F = P L",
        "contact no wider than the joint is long: P <= (pi/16) E* L^2/R*; formula ends at P = pi E* L^2/R*",
        "Dubowsky and Freudenstein 1971, as quoted by Flores and Ambrosio 2004 (m = 3)",
        "Two half-spaces under Hertz's pressure along a strip of length L (Lundberg 1939), which we confirmed by "
        f"quadrature, the pi in s included. Form {_SECOND_HAND}.",
        log.dubowsky_freudenstein,
        _slender,
        ("length",),
    ),
    Law(
        "lankarani-nikravesh",
        "Lankarani and Nikravesh, without damping",
        "P = (4/3) E* sqrt(R*) delta^(3/2)/L, R* = R1 R2/dR; p0 = (2/pi) E* sqrt(delta/R*)",
        "contact circle's radius sqrt(R* delta) <= R/2: delta <= R^2/(4 R*)",
        "Lankarani and Nikravesh 1990, 1994 (static part), as the code of Skrinjar uses it for cylinders",
        "Hertz's ball in a socket, used for pins with the exponent 3/2; exponents between 1 and 3/2, sometimes "
        "recommended, give the stiffness a unit that depends on them and are not offered. The range is Hertz's, ours.",
        limit=hertz.lankarani_nikravesh_limit,
        needs=("length",),
        force_at=hertz.lankarani_nikravesh_force,
        stiffness_at=hertz.lankarani_nikravesh_stiffness,
        displacement_of=hertz.lankarani_nikravesh_displacement,
        peak_at=hertz.lankarani_nikravesh_peak,
    ),
    Law(
        "hertz",
        "Hertz's line contact",
        "p0 = sqrt(P E*/(pi R*)), a = 2 sqrt(P R*/(pi E*)), eps = a/R1, R* = R1 R2/dR",
        "half-width a <= R/2: P <= (pi/16) E* R^2/R*",
        "Johnson 1985, eqs 4.43 and 4.45",
        "No displacement: in the plane it depends on the support. The bound on a is ours.",
        limit=hertz.hertz_load_limit,
        peak_of=hertz.hertz_pressure,
        angle_of=hertz.hertz_angle,
    ),
    Law(
        "persson",
        "Persson, with the angle of Ciavarella and Decuzzi",
        "E* dR/P = [2 - (1 + alpha) (ln(1 + b^2) + 2 b^4)]/[2 pi b^2 (1 + b^2)], b = tan(eps/2); R p0/P = 2 b/(pi "
        "sqrt(1 + b^2)) + artanh(b/sqrt(1 + b^2))/(pi b^2 (1 + b^2))",
        "any load; dR <= 0.1 R, Dundurs' beta = 0 (|beta| <= 0.01 counts as zero)",
        f"Persson 1964; Ciavarella and Decuzzi 2001; {_HU}, eqs 13, 14",
        "Exact for nearly equal radii. alpha = (E1' - E2')/(E1' + E2') is positive for the stiffer pin, the opposite "
        "of a convention in which the hole comes first. The pressure over P/R depends on eps alone. No displacement.",
        limit=lambda joint: float("inf"),
        unfit=_unlike,
        peak_of=persson.persson_peak,
        angle_of=persson.persson_angle,
    ),
]

LAWS: dict[str, Law] = {law.name: law for law in _ALL}


def find_law(name: str) -> Law:
    """The law called ``name``; raises `InputError` that names the nearest one and all."""
    if name in LAWS:
        return LAWS[name]
    near = difflib.get_close_matches(name, LAWS, 1)
    hint = f"did you mean {near[0]}? " if near else ""
    raise InputError(f"{name}: is not a known law; {hint}Laws are {', '.join(LAWS)}.")

"""Calibration of the plastic-Winkler law on runs, each alone and all together, and the law of a joint that it gives:
P(delta) for use elsewhere, as an object, as JSON and as plain Python."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, fields
from string import Template

import numpy as np
from numpy.typing import ArrayLike

from archord.postprocess.convergence import Refined, group
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.chord_laws import plastic_force, plastic_stiffness
from archord.postprocess.laws.curve_fit import CurveFit, fit_curve, fit_plateau
from archord.postprocess.laws.joint import Array, LawJoint
from archord.postprocess.laws.law import monotone_root
from archord.scene.errors import InputError

_LIKE = 0.01  # share of P by which the blocks of runs of one fit may change it


@dataclass(frozen=True)
class Fits:
    """All fits to one run, or to several together; ``plateau`` is None where nothing has yielded far enough."""

    runs: tuple[RunCurve, ...]
    P: CurveFit
    p0: CurveFit
    plateau: CurveFit | None
    finer: str | None = None  # name of the run of the same scene that the joint fit takes instead

    @property
    def curves(self) -> list[CurveFit]:
        """P, p0 and, if there is one, the plateau."""
        return [self.P, self.p0, *([self.plateau] if self.plateau else [])]


@dataclass(frozen=True)
class Calibration:
    """Fits to each run, and the one to all scenes together, each on its finest mesh."""

    each: tuple[Fits, ...]
    joint: Fits
    load_range: tuple[float, float]
    confidence: float
    hold_k: float | None = None

    def law(self, run: RunCurve | None = None) -> FittedLaw:
        """The law for the joint of ``run`` (by default the first), with k and c from P(delta) of all scenes."""
        run = run or self.joint.runs[0]
        k, c = self.joint.P.k, self.joint.P.c
        if k is None:
            raise InputError(f"{run.name}: P(delta) does not determine k; widen --range.")
        if run.sigY is None:
            c = None
        loads = np.concatenate([r.load for r in self.joint.P.residuals])
        return FittedLaw(
            k=k.value,
            E_star=run.E_star,
            R=run.R,
            dR=run.dR,
            k_error=k.error,
            c=c.value if c else None,
            sigY=run.sigY if c else None,
            c_error=c.error if c else None,
            fitted_range=(float(loads.min()), float(loads.max())),
            plane=run.plane,
            length_unit=run.scene.units.length,
            force_unit=run.scene.units.force,
            fitted_to=tuple(r.name for r in self.joint.runs),
        )


def calibrate(
    runs: list[RunCurve],
    load_range: tuple[float, float] = (0.0, np.inf),
    confidence: float = 0.95,
    hold_k: float | None = None,
) -> Calibration:
    """Fit the law to each of ``runs`` and to all scenes together, over ``load_range`` of ``delta/dR``.

    Runs of one scene on several meshes give the error of the mesh; the finest of them enters the joint fit. With
    ``hold_k`` only c is fitted. Raises `InputError` where the range, the steps or the runs do not allow a fit.
    """
    low, high = load_range
    if not 0 <= low < high:
        raise InputError(f"--range {low:g} {high:g}: must be two displacements in clearances, 0 or more and rising.")
    if not 0.5 <= confidence < 1:
        raise InputError(f"--confidence {confidence:g}: must be at least 0.5 and below 1.")
    if hold_k is not None and not 0 < hold_k < np.inf:
        raise InputError(f"--hold-k {hold_k:g}: must be a number greater than 0.")
    _check_compatible(runs)
    groups = group(runs)
    of = {id(r): g for g in groups for r in (g.run, *g.coarser)}
    each = []
    for run in runs:
        g = of[id(run)]
        alone = g if g.run is run else Refined(run)
        each.append(_fits([alone], load_range, confidence, hold_k, None if g.run is run else g.run.name))
    one = [f for f in each if f.finer is None]
    together = _fits(groups, load_range, confidence, hold_k) if len(groups) > 1 else one[0]
    if hold_k is not None and together.P.c is None:
        raise InputError(f"--hold-k {hold_k:g}: leaves nothing to fit: no two steps of the range are past yield.")
    return Calibration(tuple(each), together, load_range, confidence, hold_k)


def _check_compatible(runs: list[RunCurve]) -> None:
    if not runs:
        raise InputError("no run to fit.")
    first = runs[0]
    for run in runs:
        if run.scene.joint.model != "block":
            model = run.scene.joint.model
            raise InputError(f'{run.name}: joint.model = "{model}" has no law to fit; only "block" has.')
        for body, solid in (("pin", run.scene.pin), ("block", run.scene.block)):
            if solid.hardening > 0:
                raise InputError(f"{run.name}: {body}.hardening = {solid.hardening:g} does not fit: the law is for "
                                 "perfect plasticity, hardening = 0.")  # fmt: skip
        own, other = (LawJoint.from_scene(each.scene) for each in (run, first))
        if own.plane != other.plane:
            raise InputError(f"{run.name}: analysis.plane = {run.plane!r} does not fit: {first.name} is in plane "
                             f"{first.plane}; fit the planes separately.")  # fmt: skip
        numbers = ([joint.dundurs_alpha, joint.nu, joint.pin_nu or 0.0] for joint in (own, other))
        if not np.allclose(*numbers, rtol=1e-6, atol=1e-9):
            raise InputError(f"{run.name}: the Poisson's ratios or the ratio of the moduli are not those of "
                             f"{first.name}; one k is for one pair of materials, fit them separately.")  # fmt: skip
        softer = abs(own.softer[0] - other.softer[0])
        if softer > _LIKE:
            raise InputError(f"{run.name}: joint.block_size is {run.scene.joint.W / run.R:.4g} R and that of "
                             f"{first.name} {first.scene.joint.W / first.R:.4g} R, by which their P differs by about "
                             f"{softer:.1%}; fit them separately.")  # fmt: skip


def _fits(
    groups: list[Refined],
    load_range: tuple[float, float],
    confidence: float,
    hold_k: float | None,
    finer: str | None = None,
) -> Fits:
    force, peak = (fit_curve(curve, groups, load_range, confidence, hold_k) for curve in ("P", "p0"))
    plateau = fit_plateau(force, groups, load_range, confidence)
    return Fits(tuple(g.run for g in groups), force, peak, plateau, finer)


def winkler_coefficients(runs: Iterable[RunCurve]) -> dict[str, float]:
    """Winkler's k from P(delta) by the name of the run folder, of runs that have not yielded: the fit of those takes
    milliseconds."""
    found = {}
    for run in runs:
        if run.scene.joint.model == "block" and run.folder and not run.peeq_max.any():
            try:
                k = calibrate([run.loading()]).joint.P.k
            except InputError:
                continue
            if k is not None:
                found[run.folder.name] = k.value
    return found


@dataclass(frozen=True)
class FittedLaw:
    """Plastic-Winkler law of one joint (Hu et al., eqs. 9 to 12 with the threshold ``c sigY``).

    ``c`` and ``sigY`` are None for an elastic law. ``k_error`` and ``c_error`` are standard errors with the mesh's
    error in quadrature (``c_error`` may be None). ``fitted_range`` is the range of ``delta/dR`` of the fit; outside it
    the law extrapolates. Lengths, stresses and forces per unit thickness in the named units. Raises ValueError for
    values that no joint has.
    """

    k: float
    E_star: float
    R: float
    dR: float
    k_error: float
    c: float | None = None
    sigY: float | None = None
    c_error: float | None = None
    fitted_range: tuple[float, float] = (0.0, 0.0)
    plane: str = "strain"
    length_unit: str = "mm"
    force_unit: str = "N/mm"
    fitted_to: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("k", "E_star", "R", "dR", "c", "sigY"):
            value = getattr(self, name)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and 0 < value < math.inf) and not (value is None and name in ("c", "sigY")):
                raise ValueError(f"law: {name} = {value!r} must be a number greater than 0.")
        if (self.c is None) != (self.sigY is None):
            raise ValueError("law: c and sigY belong together; give both or none.")

    @property
    def onset(self) -> float | None:
        """Displacement ``delta0 = c sigY R/(k E*)`` at which the plateau begins; None for an elastic law."""
        return None if self.c is None else self.joint.first_yield

    @property
    def joint(self) -> LawJoint:
        """The joint with the law's coefficients, as the closed-form laws take it."""
        return LawJoint(self.R, self.dR, self.E_star, self.sigY, k=self.k, c=self.c or 1.0)

    def force(self, delta: ArrayLike) -> Array:
        """Force per unit thickness of the whole joint at ``delta`` (any shape); 0 where ``delta <= 0``."""
        return plastic_force(self.joint, np.maximum(delta, 0.0))

    def stiffness(self, delta: ArrayLike) -> Array:
        """``dP/d(delta)`` of `force` (any shape); 0 where ``delta <= 0``."""
        return plastic_stiffness(self.joint, np.maximum(delta, 0.0))

    def displacement(self, force: ArrayLike) -> Array:
        """The inverse of `force` (any shape): 0 where ``force <= 0``, nan where no displacement brings so much.

        The plastic law's force stays below ``2 sqrt(2) c sigY R``, twice the threshold on the longest chord.
        """
        joint = self.joint
        return monotone_root(
            lambda x: plastic_force(joint, x), lambda x: plastic_stiffness(joint, x), np.asarray(force, float), self.dR
        )

    def to_json(self) -> str:
        """The law as a JSON object; `from_json` gives it back, digit for digit."""
        return json.dumps(asdict(self), indent=2, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str) -> FittedLaw:
        """The law in ``text``, written by `to_json` or by ``archord fit --json``. Raises ValueError."""
        try:
            data = json.loads(text)
        except json.JSONDecodeError as error:
            raise ValueError(f"law: is not valid JSON: {error}.") from None
        if isinstance(data, dict) and isinstance(data.get("law"), dict):
            data = data["law"]
        known = {field.name for field in fields(cls)}
        if not isinstance(data, dict) or not {"k", "E_star", "R", "dR", "k_error"} <= data.keys() <= known:
            raise ValueError(f"law: must be a JSON object with keys out of {', '.join(sorted(known))}.")
        for name in ("fitted_range", "fitted_to"):
            if name in data:
                data[name] = tuple(data[name])
        return cls(**data)

    def to_python(self) -> str:
        """Source of a Python module with ``force(delta)`` and ``stiffness(delta)``, which needs only ``math``."""
        low, high = self.fitted_range
        numbers = {name: getattr(self, name) for name in ("k", "c", "sigY", "E_star", "R", "dR")}
        values = {name: "math.inf" if value is None else repr(float(value)) for name, value in numbers.items()}
        values |= {
            "note": "plastic-Winkler law" if self.c is not None else "Winkler law",
            "k_error": f"{self.k_error:.2g}",
            "c_comment": "no yield" if self.c is None else f"standard error {self.c_error or 0.0:.2g}",
            "range": f"{low:g} to {high:g}",
            "units": json.dumps(f"{self.length_unit}; force per unit thickness: {self.force_unit}"),
            "sources": json.dumps(", ".join(self.fitted_to)),
            "plane": self.plane,
        }
        return _MODULE.substitute(values)


PYTHON_BEGINS = '"""Force of a pin joint over its displacement: '  # by which a module of `to_python` is known

_MODULE = Template('''"""Force of a pin joint over its displacement: $note, calibrated by archord fit."""

# runs: $sources, plane $plane
# valid for delta from $range clearances dR
# length: $units

import math

K = $k  # foundation stiffness, standard error $k_error
C = $c  # plateau pressure over yield stress, $c_comment
E_STAR = $E_star  # contact modulus
R = $R  # radius of the pin
DR = $dR  # clearance
SIG_Y = $sigY  # yield stress


def force(delta, k=K, c=C, e_star=E_STAR, r=R, dr=DR, sig_y=SIG_Y):
    """Force per unit thickness at the displacement delta from first touch; 0 while the joint is open."""
    if delta <= 0.0:
        return 0.0
    chord = r * math.sqrt(2.0 * delta / (dr + delta))
    peak, threshold = k * e_star * delta / r, c * sig_y
    if peak <= threshold:
        return 4.0 / 3.0 * peak * chord
    u = threshold / peak
    s = math.sqrt(1.0 - u)
    return 2.0 * threshold * chord * (s + u * (2.0 + s) / (3.0 * (1.0 + s) ** 2))


def stiffness(delta, k=K, c=C, e_star=E_STAR, r=R, dr=DR, sig_y=SIG_Y):
    """Derivative of force; 0 while the joint is open."""
    if delta <= 0.0:
        return 0.0
    chord = r * math.sqrt(2.0 * delta / (dr + delta))
    peak, threshold = k * e_star * delta / r, c * sig_y
    longer = dr / (2.0 * (dr + delta))
    if peak <= threshold:
        return 4.0 / 3.0 * k * e_star / r * chord * (1.0 + longer)
    u = threshold / peak
    s = math.sqrt(1.0 - u)
    flank = u * (2.0 + s) / (3.0 * (1.0 + s) ** 2)
    return 2.0 * threshold * chord / delta * (flank + (flank + s) * longer)
''')

"""Joints of a sweep, each with the k and c fitted to it and its curve: rows of a CSV file.

Everything is dimensionless, so rows of different units and sizes stand side by side.
"""

from __future__ import annotations

import csv
import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.output.output_file import writing
from archord.postprocess.convergence import Refined
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.curve_fit import CurveFit, fit_curve, fit_plateau
from archord.postprocess.laws.law_joint import LawJoint
from archord.scene.errors import InputError

_TOLD = 0.65  # of the largest load: where the plateau must have begun for c to count
YIELDING = ("none", "both", "block", "pin", "unlike")


@dataclass(frozen=True)
class FittedCase:
    """One joint: the numbers that decide it, k and c with their standard errors, and its curve.

    ``ratio`` is E of the pin over E of the block (infinite: a rigid pin), ``pin_nu`` nan for a rigid pin, ``clearance``
    dR/R, ``strength`` sigY/E* of the weaker body (infinite: elastic), ``yielding`` one of `YIELDING`. ``c`` is nan
    where too few steps have yielded, ``k_mesh`` and ``c_mesh`` the errors of the mesh, nan where there was but one,
    ``plateau`` the median pressure over sigY (nan: none was measured). ``rms`` and
    ``largest`` are those of ``law/run - 1`` with the joint's own k and c. ``load`` is delta/dR, ``P`` the force over
    E* dR, ``(n,)`` each; ``mesh`` the element size on the arcs over R.
    """

    run: str
    plane: str
    yielding: str
    ratio: float
    pin_nu: float
    nu: float
    clearance: float
    strength: float
    mesh: float
    k: float
    k_error: float
    k_mesh: float
    c: float
    c_error: float
    c_mesh: float
    plateau: float
    rms: float
    largest: float
    load: Array
    P: Array

    @property
    def s(self) -> float:
        """Relative yield stress ``sigY R/(E* dR)``; infinite for an elastic joint."""
        return self.strength / self.clearance

    @property
    def told_c(self) -> float:
        """c where the plateau fills the last third of the range or more, else nan.

        A plateau that begins later does hardly show in P: the fit then takes c to mend the shape of the curve.
        """
        return self.c if self.c * self.s / self.k <= _TOLD * self.load[-1] else math.nan

    @property
    def alpha(self) -> float:
        """Dundurs' alpha, positive for the stiffer pin; 1 for a rigid one."""
        if math.isinf(self.ratio):
            return 1.0
        plane = (1 - self.nu**2) / (1 - self.pin_nu**2) if self.plane == "strain" else 1.0
        return (self.ratio * plane - 1) / (self.ratio * plane + 1)

    @property
    def kind(self) -> tuple[str, str]:
        """Plane, and which bodies yield."""
        return self.plane, self.yielding

    @property
    def digest(self) -> str:
        """A number made from those of the joint: the same wherever it stands, and random otherwise."""
        numbers = (self.ratio, self.pin_nu, self.nu, self.clearance, self.strength)
        said = f"{self.plane} {self.yielding} {' '.join(f'{value:.5g}' for value in numbers)}"
        return hashlib.sha256(said.encode()).hexdigest()

    def joint(self, k: float, c: float) -> LawJoint:
        """The joint in units of R = E* = 1 with these coefficients; elastic where c is nan or infinite."""
        plastic = math.isfinite(c) and math.isfinite(self.strength)
        return LawJoint(1.0, self.clearance, 1.0, self.strength if plastic else None, k=k, c=c if plastic else 1.0,
                        dundurs_alpha=self.alpha, plane=self.plane, nu=self.nu,
                        pin_nu=None if math.isnan(self.pin_nu) else self.pin_nu,
                        yielding="both" if self.yielding == "none" else self.yielding)  # fmt: skip


CSV_BEGINS = "# archord: "  # by which a file of `write_cases` is known
_WORDS = ("run", "plane", "yielding")
_CURVES = {"load": "delta/dR", "P": "P/(E* dR)"}
_HEADINGS = {
    "ratio": "E1/E2",
    "pin_nu": "nu1",
    "nu": "nu2",
    "clearance": "dR/R",
    "strength": "sigY/E*",
    "mesh": "h/R",
    "k_error": "k s.e.",
    "c_error": "c s.e.",
    "k_mesh": "k mesh",
    "c_mesh": "c mesh",
    **_CURVES,
}
_NAMES = tuple(field.name for field in fields(FittedCase))


def fit_case(
    refined: Refined, load_range: tuple[float, float] = (0.0, np.inf), confidence: float = 0.95, name: str = ""
) -> FittedCase:
    """Fit k and c to P(delta) of a joint, over ``load_range`` in clearances, called ``name`` [the run folder's].

    Raises `InputError` where the range or the steps do not allow a fit.
    """
    run = refined.run
    force = fit_curve("P", [refined], load_range, confidence)
    plateau = fit_plateau(force, [refined], load_range, confidence)
    return _row(run, force, plateau, name or run.name)


def _row(run: RunCurve, force: CurveFit, plateau: CurveFit | None, name: str) -> FittedCase:
    pin, block = run.scene.pin, run.scene.block
    joint, k, c = LawJoint.from_scene(run.scene), force.k, force.c
    assert k is not None
    part = force.residuals[0]
    return FittedCase(
        run=name,
        plane=run.plane,
        yielding="none" if run.sigY is None else joint.yielding,
        ratio=math.inf if pin.E is None else pin.E / block.E,
        pin_nu=math.nan if pin.nu is None else pin.nu,
        nu=block.nu,
        clearance=run.dR / run.R,
        strength=math.inf if run.sigY is None else run.sigY / run.E_star,
        mesh=run.scene.joint.h / run.R,
        k=k.value,
        k_error=k.standard_error,
        k_mesh=_known(k.discretisation_error),
        c=c.value if c else math.nan,
        c_error=c.standard_error if c else math.nan,
        c_mesh=_known(c.discretisation_error) if c else math.nan,
        plateau=plateau.c.value if plateau and plateau.c else math.nan,
        rms=force.rms,
        largest=force.largest,
        load=part.load,
        P=part.data,
    )


def _known(value: float | None) -> float:
    return math.nan if value is None else value


def read_cases(file: str | Path) -> tuple[list[FittedCase], dict[str, str]]:
    """The rows of ``file``, written by `write_cases`, and what it says about where they are from.

    Raises `InputError` if it cannot be read.
    """
    file = Path(file)
    try:
        lines = file.read_text(encoding="utf-8").splitlines()
        notes = dict(line[1:].strip().split(": ", 1) for line in lines if line.startswith("#"))
        return [_case(row) for row in csv.DictReader(line for line in lines if not line.startswith("#"))], notes
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}.") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputError(f"{file}: cannot be read as the fitted cases of a sweep, fit.csv.") from None


def _case(row: dict[str, str]) -> FittedCase:
    values: dict[str, Any] = {}
    for name in _NAMES:
        text = row[_HEADINGS.get(name, name)]
        if name in _CURVES:
            values[name] = np.array([float(value) for value in text.split()])
        else:
            values[name] = text if name in _WORDS else float(text or "nan")
    return FittedCase(**values)


def write_cases(cases: Iterable[FittedCase], notes: dict[str, str], file: str | Path) -> None:
    """Write ``cases`` with seven digits, below ``notes`` on where they are from. Raises `InputError`."""
    file = Path(file)
    with writing(file), file.open("w", encoding="utf-8", newline="") as stream:
        stream.writelines(f"# {name}: {value}\n" for name, value in notes.items())
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([_HEADINGS.get(name, name) for name in _NAMES])
        writer.writerows([_entry(getattr(case, name)) for name in _NAMES] for case in cases)


def _entry(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return " ".join(f"{entry:.7g}" for entry in value)
    return value if isinstance(value, str) else "" if math.isnan(value) else f"{value:.7g}"


def rounded(cases: Iterable[FittedCase]) -> list[FittedCase]:
    """``cases`` as `write_cases` and `read_cases` would give them back."""
    return [_case({_HEADINGS.get(name, name): _entry(getattr(case, name)) for name in _NAMES}) for case in cases]

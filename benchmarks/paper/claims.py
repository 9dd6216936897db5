"""The claims of Hu et al., each with our numbers in both planes and a verdict.

A law "holds" in a plane where it stays within 5 % of ours (15 %: "holds with a limit"); the paper says plane strain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from archord.benchmarks.paper.figures import X, Y, fig2, fig4, fig7, fig9
from archord.benchmarks.paper.first_yield import first_yields
from archord.benchmarks.paper.runs import FULL_YIELD, MESHES, PAIRS, PLANES, Runs, plastic
from archord.materials.material import Plane
from archord.postprocess.arc import read_arcs
from archord.postprocess.laws.calibration import calibrate
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.laws import find_law

GOOD, FAIR = 0.05, 0.15


@dataclass(frozen=True)
class Claim:
    """What the paper claims at a ``figure``, what we find in each plane, and the verdict."""

    name: str
    figure: str
    text: str
    found: dict[Plane, str]
    verdict: str

    @classmethod
    def judged(
        cls, name: str, figure: str, text: str, find: Callable[[Plane], tuple[str, float]], more: str = ""
    ) -> Claim:
        """With what ``find`` finds in a plane, in words, and how far off the claim is there; ``more`` ends the
        verdict."""
        found = {plane: find(plane) for plane in PLANES}
        verdict = _verdict({plane: deviation for plane, (_, deviation) in found.items()})
        return cls(name, figure, text, {plane: said for plane, (said, _) in found.items()}, verdict + more)


def grade(deviation: float) -> str:
    """The verdict on a claim that is so far off, relatively."""
    if deviation <= GOOD:
        return "holds"
    return "holds with a limit" if deviation <= FAIR else "does not hold"


def _verdict(deviations: dict[Plane, float]) -> str:
    """One verdict for both planes where they agree, else each."""
    strain, stress = (grade(deviations[plane]) for plane in PLANES)
    return strain if strain == stress else f"{strain} in plane strain, {stress} in plane stress"


def chord_pressure(runs: Runs) -> Claim:
    """C1."""
    figure, said = fig2(runs), {}
    off: dict[str, dict[Plane, float]] = {"Persson": {}, "parabola": {}}
    nearer = True
    for plane in PLANES:
        row = figure.columns(plane=plane)
        inside = row["x/l"] < 0.95  # the last facets hold the edge of the contact
        outer = row["x/l"][inside] > 0.5
        apart = {name: np.abs(row[name] - row["py/p0"])[inside] for name in ("Persson", "parabola", "ellipse")}
        nearer &= bool(apart["parabola"][outer].max() < apart["ellipse"][outer].max())
        for name in off:
            off[name][plane] = float(apart[name].max())
        said[plane] = (
            f"of p0, x/l < 0.95: Persson within {off['Persson'][plane]:.1%}, parabola within "
            f"{off['parabola'][plane]:.1%}, ellipse off by up to {apart['ellipse'][outer].max():.0%} for x/l > 0.5"
        )
    verdict = (
        f"Persson {_verdict(off['Persson'])}; the parabola {_verdict(off['parabola'])}, "
        f"{'nearer' if nearer else 'no nearer'} than the ellipse beyond x/l = 0.5"
    )
    text = "the chord pressure agrees with Persson and with the parabola, Hertz's ellipse deviates for x/l > 0.5"
    return Claim("C1", "2", text, said, verdict)


def peak_pressure(runs: Runs) -> Claim:
    """C2."""

    def find(plane: Plane) -> tuple[str, float]:
        run = runs.curve("elastic", plane)
        fit = calibrate([run, runs.curve("elastic", plane, "coarse")], (0.1, 2.0)).joint.p0.k
        assert fit is not None
        ratio = run.p0 * run.R / (run.E_star * run.delta)
        off = np.abs(0.85 / ratio - 1)
        late = float(run.delta[np.flatnonzero(off > GOOD).max(initial=-1) + 1] / run.dR)
        deviation = float(off[run.delta >= 0.499 * run.dR].max())
        return (
            f"k = {fit.value:.4f} ± {fit.error:.4f} over 0.1 to 2 dR; p0 R/(E* delta) goes from {ratio[0]:.3f} at 0.1 "
            f"dR over {ratio.min():.3f} to {ratio[-1]:.3f} at 2 dR; k = 0.85 is off by up to {deviation:.1%} from "
            f"0.5 dR on, and within {GOOD:.0%} from {late:.2g} dR on"
        ), deviation

    text = "p0 = k E* delta/R with k = 0.85 over a broad range; Johnson's only at small delta"
    return Claim.judged("C2", "3", text, find)


def elastic_force(runs: Runs) -> Claim:
    """C3."""
    figure = fig4(runs)

    def find(plane: Plane) -> tuple[str, float]:
        row = figure.columns(plane=plane)
        off = {name: row[name] / row[Y] - 1 for name in ("paper", "johnson", "radzimovsky")}
        at = int(np.argmin(np.abs(row[X] - 0.5)))
        deviation = float(np.abs(off["paper"])[row[X] >= 0.2].max())
        return (
            f"eq. 9 is off by {off['paper'][-1]:+.1%} at 2 dR and by up to {deviation:.1%} from 0.2 dR on; at 0.5 dR "
            f"Johnson by {off['johnson'][at]:+.0%}, Radzimovsky as printed by {off['radzimovsky'][at]:+.0%}"
        ), deviation

    run = runs.curve("elastic", "strain")
    joint, unit = LawJoint.from_scene(run.scene), run.E_star * run.dR
    laws = [find_law(name) for name in ("johnson", "radzimovsky")]
    ends = [float(law.force(joint, law.limit(joint))) / unit for law in laws]
    text = "eq. 9 matches up to 2 dR; Johnson and Radzimovsky fail past 0.5 dR, with limits of 1.71 and 2.41 E* dR"
    said = f"; the limits are {ends[0]:.4f} and, as printed, {ends[1]:.3f} E* dR"
    return Claim.judged("C3", "4", text, find, said)


def yield_plateau(runs: Runs) -> Claim:
    """C4."""

    def find(plane: Plane) -> tuple[str, float]:
        run = runs.curve(plastic(FULL_YIELD), plane)
        assert run.sigY is not None
        angle, pressure = read_arcs(run, len(run.delta))["hole"].facet_means()
        middle = pressure[angle < 0.5 * run.eps[-1]] / run.sigY
        mean = run.P[-1] / (2 * run.R * np.sin(run.eps[-1])) / run.sigY
        return (
            f"p0/sigY = {run.p0[-1] / run.sigY:.3f}; p over the inner half of the arc {middle.min():.2f} to "
            f"{middle.max():.2f} sigY; P/A = {mean:.3f} sigY"
        ), float(max(abs(middle.max() - 1), abs(middle.min() - 1), mean - 1, 0))

    text = "dR/R = 0.5 %, sigY/E* = 0.2 %, 2 dR: a flat zone with p near sigY, mean pressure at or slightly below sigY"
    return Claim.judged("C4", "5", text, find)


def plastic_force(runs: Runs) -> Claim:
    """C5."""
    figure = fig7(runs)

    def find(plane: Plane) -> tuple[str, float]:
        of_pair = [{"plane": plane, "dR/R [%]": dR, "sigY/E* [%]": sigma} for dR, sigma in PAIRS]
        last = [float(figure.columns(**where)["P/P(eq. 12)"][-1]) for where in of_pair]
        ratios = [f"{value:.3f} ({dR} %, {sigma} %)" for value, (dR, sigma) in zip(last, PAIRS, strict=True)]
        return f"P/P(eq. 12) at 2 dR: {', '.join(ratios)}", float(np.abs(1 / np.array(last) - 1).max())

    text = "eqs 11, 12 match for sigY/E* = 0.1 to 0.6 % and dR/R = 0.1, 0.5, 1 %"
    return Claim.judged("C5", "7", text, find)


def first_yield(runs: Runs) -> Claim:
    """C6."""
    anywhere, near = first_yields(runs), first_yields(runs, near_contact=0.5)
    said, grades = {}, []
    for plane in PLANES:
        onset = abs(min(near[plane].delta, anywhere[plane].delta) / 1.18 - 1)
        surface = near[plane].depth <= 2 * MESHES["fine"]  # two elements
        where = ", near the contact at the surface" if surface else ", but not at the surface"
        grades.append(f"plane {plane}: the onset {grade(onset)}{where}")
        said[plane] = f"first of all {anywhere[plane]}; near the contact {near[plane]}"
    text = "dR/R = sigY/E* = 0.1 %: first yield at 1.18 dR and at the surface; the zone grows with a flat pressure"
    return Claim("C6", "8", text, said, "; ".join(grades))


def force_over_angle(runs: Runs) -> Claim:
    """C7."""
    figure, at_angle = fig9(runs), "eq. 9 or 12 at the same angle"

    def find(plane: Plane) -> tuple[str, float]:
        elastic = figure.columns(plane=plane, joint="elastic")
        low, unit = elastic["tan(eps/2)"] < 0.4, np.interp(0.4, elastic["tan(eps/2)"], elastic[Y])
        law, exact = (np.abs(elastic[name] - elastic[Y])[low].max() / unit for name in (at_angle, "Persson"))
        run, yielding = runs.curve(plastic(FULL_YIELD), plane), figure.columns(plane=plane, joint="plastic")
        off = yielding[at_angle] / yielding[Y] - 1
        known = off[np.isfinite(off) & (run.delta > 0.5 * run.dR)]
        worst = known[np.abs(known).argmax()]
        return (
            f"tan(eps/2) < 0.4: eq. 9 off by up to {law:.0%} of P(0.4), Persson by up to {exact:.1%}; plastic: eq. 12 "
            f"at the same angle off by up to {worst:+.0%}"
        ), float(max(law, abs(worst)))

    text = (
        "P over eps: eq. 9 agrees with Persson for tan(eps/2) < 0.4; eq. 12 holds in the plastic range, Persson fails"
    )
    return Claim.judged("C7", "9", text, find)


CLAIMS: tuple[Callable[[Runs], Claim], ...] = (
    chord_pressure,
    peak_pressure,
    elastic_force,
    yield_plateau,
    plastic_force,
    first_yield,
    force_over_angle,
)

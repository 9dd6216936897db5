"""The claims of Hu et al., each with our numbers in both planes and a verdict.

A law "holds" in a plane where it stays within 5 % of ours (15 %: "holds with a limit"); the paper
says plane strain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from archord.benchmarks.paper.figures import Part, X, Y, columns, strength
from archord.benchmarks.paper.runs import FULL_YIELD, JOINTS, PLANES, Runs
from archord.materials.material import Plane
from archord.postprocess.arrays.fields import BODIES, read_fields
from archord.postprocess.curve import RunCurve
from archord.postprocess.judgement.convergence import group
from archord.postprocess.laws.calibration import fit_curve
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.laws import find_law
from archord.report.by_name import Amounts, Words
from archord.report.files import toml_beside
from archord.report.table import Table

TEXTS: dict[str, Words] = toml_beside(__file__, "claims.toml")
GOOD = 0.05
FAIR = 0.15
_CORNER = 85  # degrees from the contact axis beyond which the block is held
Tables = dict[str, list[Part]]  # of the figures, by name
Found = tuple[str, Amounts]  # in a plane: what we find, and how far off is what the claim is about


def grade(deviation: float) -> str:
    """The verdict on a claim that is so far off, relatively."""
    if deviation <= GOOD:
        return "holds"
    return "holds with a limit" if deviation <= FAIR else "does not hold"


def verdict(strain: Amounts, stress: Amounts) -> str:
    """On all that a claim is about, one for both planes where they agree, else each."""
    said = []
    for what in strain:
        one = grade(strain[what])
        other = grade(stress[what])
        both = one if one == other else f"{one} in plane strain, {other} in plane stress"
        said.append(f"{what} {both}".strip())
    return "; ".join(said)


def judged(runs: Runs, tables: Tables) -> Table:
    """All claims with what we find and the verdicts."""
    table = Table(
        "claim", "figure", "the paper", *(f"ours, plane {plane}" for plane in PLANES), "verdict"
    )
    for name, claim in TEXTS.items():
        (strain, off), (stress, off_in_stress) = (
            CLAIMS[name](runs, tables, plane) for plane in PLANES
        )
        table.add(name, claim["figure"], claim["text"], strain, stress, verdict(off, off_in_stress))
    return table


def chord_pressure(runs: Runs, tables: Tables, plane: Plane) -> Found:
    """C1."""
    row = columns(tables["fig2"], plane=plane)
    place = row["x/l"]
    inside = place < 0.95  # the last facets hold the edge of the contact
    outer = place[inside] > 0.5
    off = {
        name: np.abs(row[name] - row["py/p0"])[inside]
        for name in ("Persson", "parabola", "ellipse")
    }
    largest = {name: float(off[name].max()) for name in ("Persson", "parabola")}
    parabola = off["parabola"][outer].max()
    ellipse = off["ellipse"][outer].max()
    said = (
        f"of p0, x/l < 0.95: Persson within {largest['Persson']:.1%}, "
        f"parabola within {largest['parabola']:.1%}; "
        f"for x/l > 0.5 the parabola is off by up to {parabola:.0%}, "
        f"the ellipse by {ellipse:.0%}"
    )
    return said, largest


def peak_pressure(runs: Runs, tables: Tables, plane: Plane) -> Found:
    """C2."""
    run = runs.curve("elastic", plane)
    coarse = runs.curve("elastic", plane, "coarse")
    fit = fit_curve(group([run, coarse]), (0.1, 2.0), "p0").k
    ratio = columns(tables["fig3"], plane=plane)["p0 R/(E* delta)"]
    off = np.abs(0.85 / ratio - 1)
    last_bad = np.flatnonzero(off > GOOD).max(initial=-1)
    late = float(run.x[last_bad + 1])
    deviation = float(off[run.delta >= 0.499 * run.dR].max())
    said = (
        f"k = {fit.value:.4f} ± {fit.error:.4f} over 0.1 to 2 dR; "
        f"p0 R/(E* delta) goes from {ratio[0]:.3f} at 0.1 dR "
        f"over {ratio.min():.3f} to {ratio[-1]:.3f} at 2 dR; "
        f"k = 0.85 is off by up to {deviation:.1%} from 0.5 dR on, "
        f"and within {GOOD:.0%} from {late:.2g} dR on"
    )
    return said, {"": deviation}


def elastic_force(runs: Runs, tables: Tables, plane: Plane) -> Found:
    """C3."""
    row = columns(tables["fig4"], plane=plane)
    run = runs.curve("elastic", plane)
    x = row[X]
    off = {name: row[name] / row[Y] - 1 for name in ("paper", "johnson", "radzimovsky")}
    at = int(np.argmin(np.abs(x - 0.5)))
    deviation = float(np.abs(off["paper"])[x >= 0.2].max())
    joint = LawJoint.from_scene(run.scene)
    laws = [find_law(name) for name in ("johnson", "radzimovsky")]
    at_limits = [float(law.force(joint, law.limit(joint))) for law in laws]
    ends = [force / run.unit for force in at_limits]
    said = (
        f"eq. 9 is off by {off['paper'][-1]:+.1%} at 2 dR "
        f"and by up to {deviation:.1%} from 0.2 dR on; "
        f"at 0.5 dR Johnson by {off['johnson'][at]:+.0%}, "
        f"Radzimovsky as printed by {off['radzimovsky'][at]:+.0%}; "
        f"their limits are {ends[0]:.4f} and {ends[1]:.3f} E* dR"
    )
    return said, {"": deviation}


def yield_plateau(runs: Runs, tables: Tables, plane: Plane) -> Found:
    """C4."""
    run = runs.curve(FULL_YIELD, plane)
    angle, pressure = runs.run(FULL_YIELD, plane).arc(side="hole").facet_means()
    yield_stress = strength(run)
    inner = angle < 0.5 * run.eps[-1]
    middle = pressure[inner] / yield_stress
    mean = columns(tables["fig5b"], plane=plane)["P/(A sigY)"][-1]
    low = middle.min()
    high = middle.max()
    said = (
        f"p0/sigY = {run.p0[-1] / yield_stress:.3f}; "
        f"p over the inner half of the arc {low:.2f} to {high:.2f} sigY; P/A = {mean:.3f} sigY"
    )
    deviation = max(abs(high - 1), abs(low - 1), mean - 1, 0)
    return said, {"": float(deviation)}


def plastic_force(runs: Runs, tables: Tables, plane: Plane) -> Found:
    """C5."""
    pairs = [pair for pair in JOINTS.values() if pair[1] is not None]
    last = []
    ratios = []
    for dR, sigma in pairs:
        where = {"plane": plane, "dR/R [%]": dR, "sigY/E* [%]": sigma}
        ratio = columns(tables["fig7"], **where)["P/P(eq. 12)"]
        last.append(float(ratio[-1]))
        ratios.append(f"{last[-1]:.3f} ({dR} %, {sigma} %)")
    off = np.abs(1 / np.array(last) - 1)
    return f"P/P(eq. 12) at 2 dR: {', '.join(ratios)}", {"": float(off.max())}


@dataclass(frozen=True)
class FirstYield:
    """The first cell to yield: delta/dR, body, depth below the contact over R, angle."""

    delta: float
    body: str
    depth: float
    angle: float  # degrees from the contact axis

    def __str__(self) -> str:
        """For a table."""
        return (
            f"δ/ΔR = {self.delta:.3f}, in the {self.body}, {self.depth:.3f} R below the contact "
            f"at {self.angle:.0f}°"
        )


def first_yield(elastic: RunCurve, yield_stress: float, near_contact: float = 2.0) -> FirstYield:
    """From an elastic run: the cell no deeper than ``near_contact`` R whose von Mises stress
    reaches ``yield_stress`` first.

    The stress is the cell's mean, interpolated linearly between the steps. The pressed diameter of
    the pin and the held corner of the block can yield before the contact does: a depth of less than
    R leaves them out.
    """
    assert elastic.folder is not None
    steps = range(1, len(elastic.delta) + 1)
    fields = [read_fields(elastic.folder, elastic.scene, step) for step in steps]
    first = fields[0]
    corners = first.coordinates[first.cells[:, :3]]
    centroid = corners.mean(axis=1)
    x, y = centroid.T
    stress = np.array([0 * x, *(of_step.von_mises for of_step in fields)])
    delta = np.append(0.0, elastic.delta)
    above = stress >= yield_stress
    cell = np.arange(len(centroid))
    step = np.maximum(above.argmax(axis=0), 1)
    low = stress[step - 1, cell]
    high = stress[step, cell]
    share = (yield_stress - low) / np.maximum(high - low, 1e-300)
    before = delta[step - 1]
    reached = before + share * (delta[step] - before)
    when = np.where(above.any(axis=0), reached, np.inf)
    pin = first.body == BODIES["pin"]
    from_centre = centroid + np.where(pin[:, None], [0.0, elastic.dR], 0.0)
    radius = np.linalg.norm(from_centre, axis=1)
    below_surface = np.where(pin, elastic.R - radius, radius - elastic.R - elastic.dR)
    depth = below_surface / elastic.R
    angle = np.degrees(np.arctan2(x, -y))
    in_corner = (angle > _CORNER) & (near_contact < 1)
    when[(depth > near_contact) | in_corner] = np.inf
    k = int(np.argmin(when))
    body = "pin" if pin[k] else "block"
    return FirstYield(float(when[k]) / elastic.dR, body, float(depth[k]), float(angle[k]))


def onset(runs: Runs, tables: Tables, plane: Plane) -> Found:
    """C6."""
    run = runs.curve("elastic_0.1", plane)
    anywhere = first_yield(run, 0.001)
    near = first_yield(run, 0.001, near_contact=0.5)
    earliest = min(near.delta, anywhere.delta)
    deviation = abs(earliest / 1.18 - 1)
    return f"first of all {anywhere}; near the contact {near}", {"the onset": deviation}


def force_over_angle(runs: Runs, tables: Tables, plane: Plane) -> Found:
    """C7."""
    at_angle = "eq. 9 or 12 at the same angle"
    elastic = columns(tables["fig9"], plane=plane, joint="elastic")
    tangent = elastic["tan(eps/2)"]
    low = tangent < 0.4
    unit = np.interp(0.4, tangent, elastic[Y])
    off_by = {name: np.abs(elastic[name] - elastic[Y])[low] for name in (at_angle, "Persson")}
    law, exact = (off.max() / unit for off in off_by.values())
    yielding = columns(tables["fig9"], plane=plane, joint="plastic")
    off = yielding[at_angle] / yielding[Y] - 1
    known = off[np.isfinite(off) & (yielding[X] > 0.5)]
    worst = known[np.abs(known).argmax()]
    said = (
        f"tan(eps/2) < 0.4: eq. 9 off by up to {law:.0%} of P(0.4), Persson by up to {exact:.1%}; "
        f"plastic: eq. 12 at the same angle off by up to {worst:+.0%}"
    )
    return said, {"": float(max(law, abs(worst)))}


_JUDGES: tuple[Callable[[Runs, Tables, Plane], Found], ...] = (
    chord_pressure,
    peak_pressure,
    elastic_force,
    yield_plateau,
    plastic_force,
    onset,
    force_over_angle,
)
CLAIMS = dict(zip(TEXTS, _JUDGES, strict=True))

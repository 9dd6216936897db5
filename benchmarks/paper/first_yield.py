"""Where and when a joint yields first (Hu et al., figure 8), and the figure itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import h5py
import numpy as np

from archord.benchmarks.paper.figures import LABELS, MILD_YIELD, STYLES, Runs, Table, stacked
from archord.benchmarks.paper.runs import PLANES, Plane, plastic
from archord.output.step_file import step_name
from archord.postprocess.curve import RunCurve
from archord.postprocess.fields import SUBTRIANGLES, read_fields
from archord.postprocess.laws.joint import LawJoint
from archord.postprocess.laws.laws import find_law

STAGES = (1.25, 1.6, 2.0)  # A, B and C in clearances: just after the paper's first yield, and on to its end
_BODIES = {1: "pin", 2: "block"}


@dataclass(frozen=True)
class FirstYield:
    """The first cell to yield: delta/dR, body, depth below the contact over R, angle."""

    delta: float
    body: str
    depth: float
    angle: float  # degrees from the contact axis

    def __str__(self) -> str:
        """For a table."""
        return f"δ/ΔR = {self.delta:.3f}, in the {self.body}, {self.depth:.3f} R below the contact at {self.angle:.0f}°"


def first_yield(elastic: RunCurve, yield_stress: float, near_contact: float = 2.0) -> FirstYield:
    """From an elastic run: the cell no deeper than ``near_contact`` R whose von Mises stress reaches ``yield_stress``
    first.

    The stress is the cell's mean, interpolated linearly between the steps. The pressed diameter of the pin and the held
    corner of the block can yield before the contact does: a depth of less than R leaves the first out.
    """
    assert elastic.folder is not None
    with h5py.File(elastic.folder / "fields.h5") as file:
        corners = file["mesh/coordinates"][:, :2][file["mesh/cells"][:, :3]]
        body = file["mesh/body"][()]
        stress = np.array([file[f"von_mises/{step_name(k + 1)}"][()] for k in range(len(elastic.delta))])
    centroid = corners.mean(axis=1)
    stress = np.concatenate([np.zeros((1, stress.shape[1])), stress])
    delta = np.concatenate([[0.0], elastic.delta])
    above = stress >= yield_stress
    step = np.where(above.any(axis=0), above.argmax(axis=0), len(delta) - 1)
    cell = np.arange(stress.shape[1])
    low, high = stress[step - 1, cell], stress[step, cell]
    share = (yield_stress - low) / np.maximum(high - low, 1e-300)
    when = np.where(above.any(axis=0), delta[step - 1] + share * (delta[step] - delta[step - 1]), np.inf)
    pin = body == 1
    below = np.linalg.norm(centroid + np.where(pin[:, None], [0.0, elastic.dR], 0.0), axis=1)
    depth = np.where(pin, elastic.R - below, below - elastic.R - elastic.dR) / elastic.R
    corner = np.degrees(np.arctan2(centroid[:, 0], -centroid[:, 1])) > 85
    when[(depth > near_contact) | (corner if near_contact < 1 else False)] = np.inf
    first = int(np.argmin(when))
    angle = float(np.degrees(np.arctan2(centroid[first, 0], -centroid[first, 1])))
    return FirstYield(float(when[first]) / elastic.dR, _BODIES[int(body[first])], float(depth[first]), angle)


def first_yields(runs: Runs, near_contact: float = 2.0) -> dict[Plane, FirstYield]:
    """First yield of the pair of figure 8 in both planes, see `first_yield`."""
    stress = {plane: runs.curve(plastic(MILD_YIELD), plane).sigY for plane in PLANES}
    return {
        plane: first_yield(runs.curve("elastic_0.1", plane), stress[plane] or np.inf, near_contact) for plane in PLANES
    }


def fig8(runs: Runs) -> tuple[Table, Callable]:
    """Force over delta with the stages A, B, C, and the plastic zone at each of them."""
    parts, elastic = [], {}
    for plane in PLANES:
        run = runs.curve(plastic(MILD_YIELD), plane)
        elastic[plane] = runs.curve("elastic_0.1", plane)
        parts.append(
            {
                "plane": plane,
                "delta/dR": run.delta / run.dR,
                "P/(E* dR)": run.P / (run.E_star * run.dR),
                "elastic P/(E* dR)": elastic[plane].P / (run.E_star * run.dR),
                "eq. 12": find_law("paper-plastic").force(LawJoint.from_scene(run.scene), run.delta)
                / (run.E_star * run.dR),
                "PEEQ max": run.peeq_max,
            }
        )

    def draw(figure) -> None:
        axes = figure.subplots(2, 4)
        yields = first_yields(runs)
        for row, (plane, part) in enumerate(zip(PLANES, parts, strict=True)):
            run = runs.curve(plastic(MILD_YIELD), plane)
            first = axes[row, 0]
            first.plot(part["delta/dR"], part["P/(E* dR)"], "o", ms=3, label="ours", **STYLES[plane])
            first.plot(part["delta/dR"], part["elastic P/(E* dR)"], "-", lw=1, color="gray", label="ours, elastic")
            first.plot(part["delta/dR"], part["eq. 12"], "k-", lw=1, label="eqs 9, 12")
            first.axvline(yields[plane].delta, color="k", ls=":", lw=1, label=f"first yield, {yields[plane].delta:.2f}")
            first.set(xlabel="δ / ΔR", ylabel="P / (E* ΔR)", title=LABELS[plane])
            first.legend(frameon=False, fontsize=8)
            for name, stage, one in zip("ABC", STAGES, axes[row, 1:], strict=True):
                step = int(np.argmin(np.abs(run.delta / run.dR - stage)))
                first.plot(part["delta/dR"][step], part["P/(E* dR)"][step], "kx")
                first.annotate(
                    name, (part["delta/dR"][step], part["P/(E* dR)"][step]), (5, -8), textcoords="offset points"
                )
                assert run.folder is not None
                _draw_zone(figure, one, run, step + 1)
                one.set_title(f"{name}: δ = {run.delta[step] / run.dR:.3g} ΔR")

    return stacked(parts), draw


def _draw_zone(figure, axes, run: RunCurve, step: int) -> None:
    """PEEQ on the deformed shape near the contact."""
    assert run.folder is not None
    fields = read_fields(run.folder, run.scene, step)
    assert fields.peeq is not None
    x = fields.deformed / run.R
    near = np.abs(x[fields.cells[:, :3]]).max(axis=(1, 2)) < 3
    drawn = axes.tripcolor(
        *x.T, fields.cells[near][:, SUBTRIANGLES].reshape(-1, 3),
        facecolors=np.repeat(100 * fields.peeq[near], len(SUBTRIANGLES)), cmap="inferno_r",
    )  # fmt: skip
    figure.colorbar(drawn, ax=axes, label="equivalent plastic strain [%]", shrink=0.85)
    axes.set(xlim=(0, 1.5), ylim=(-1.9, 0.05), aspect="equal", xlabel="x / R", ylabel="y / R")

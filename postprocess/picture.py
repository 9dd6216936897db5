"""A picture of a run: the plastic zone (or the stress) around the contact, the pressure on the arc, and P(delta)."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np

from archord.postprocess.run_curve import read_run
from archord.solver.history import read_history
from archord.solver.output_file import check_output, writing
from archord.solver.run_folder import FILES
from archord.solver.scene import Scene, SceneError
from archord.solver.step_file import step_name

_SUBTRIANGLES = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]  # of a VTK second-order triangle


def draw(folder: str | Path, target: str | Path | None = None) -> Path:
    """Draw the run in ``folder`` as ``target`` (by default ``picture.png`` in it); returns the file.

    Raises `SceneError` if the folder holds no accepted step of a run, or ``target`` cannot be written.
    """
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    folder = Path(folder)
    missing = [name for name in FILES if not (folder / name).is_file()]
    run = read_run(folder)
    if not run.scene.output.fields:
        raise SceneError(f"{folder}: has no fields to draw: it was solved with output.fields = false.")
    if missing:
        raise SceneError(f"{folder}: is not a complete run folder: {missing[0]} is missing.")
    history = read_history(folder / "history.csv")
    target = Path(target) if target else folder / "picture.png"
    formats = plt.gcf().canvas.get_supported_filetypes()
    if target.suffix[1:].lower() not in formats:
        raise SceneError(f"{target}: must end in one of {', '.join('.' + name for name in sorted(formats))}.")
    check_output(target)
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), layout="constrained", width_ratios=[1.0, 1.1, 1.1])
    try:
        draw_zone(figure, axes[0], folder, run.scene, len(history["step"]))
        _pressure(axes[1], folder, run.scene, history)
    except (OSError, KeyError):
        plt.close(figure)
        raise SceneError(f"{folder}: fields.h5 or contact.h5 cannot be read, or lacks steps of history.csv.") from None
    axes[2].plot([0, *history["delta/dR"]], [0, *history["P/(E* R)"]], ".-", color="tab:blue")
    axes[2].set(xlabel="δ / ΔR", ylabel="P / (E* R)", title="force of the joint", xlim=(0, None), ylim=(0, None))
    axes[2].grid(alpha=0.3)
    with writing(target):
        figure.savefig(target, dpi=110)
    plt.close(figure)
    return target


def draw_zone(figure, axes, folder: Path, scene: Scene, step: int) -> None:
    """PEEQ, or von Mises stress over E* of an elastic joint, on the deformed shape near the contact."""
    R = scene.joint.radius
    with h5py.File(folder / "fields.h5") as file:
        x, cells = file["mesh/coordinates"][:, :2] / R, file["mesh/cells"][()]
        x = x + file[f"displacement/{step_name(step)}"][:, :2] / R
        plastic = "peeq" in file
        values = (
            file[f"peeq/{step_name(step)}"][()] if plastic else file[f"von_mises/{step_name(step)}"][()] / scene.E_star
        )
    near = (np.abs(x[cells[:, :3]]).max(axis=(1, 2))) < 3
    triangles = cells[near][:, _SUBTRIANGLES].reshape(-1, 3)
    shown = np.repeat(100 * values[near] if plastic else values[near], len(_SUBTRIANGLES))
    drawn = axes.tripcolor(x[:, 0], x[:, 1], triangles, facecolors=shown, cmap="inferno_r" if plastic else "viridis")
    label = "equivalent plastic strain [%]" if plastic else "von Mises stress / E*"
    figure.colorbar(drawn, ax=axes, label=label, shrink=0.85)
    axes.set(xlim=(0, 1.5), ylim=(-1.9, 0.05), aspect="equal", xlabel="x / R", ylabel="y / R")
    axes.set_title("plastic zone" if plastic else "stress")


def _pressure(axes, folder: Path, scene, history: dict[str, list[float]]) -> None:
    """Mean contact pressure of each facet over the angle from the contact axis, at up to four steps."""
    n = len(history["step"])
    steps = sorted({max(1, round(n * k / 4)) for k in range(1, 5)})
    with h5py.File(folder / "contact.h5") as file:
        for i, step in enumerate(steps):
            for name in ("pin", "hole"):
                if name in file:
                    weight = file[f"{name}/weight"][()]
                    angle, p = (
                        (file[f"{name}/{what}"][()] * weight).sum(axis=1) / weight.sum(axis=1)
                        for what in ("angle", f"pressure/{step_name(step)}")
                    )
                    style = {"color": f"C{i}", "lw": 1.4, "ls": "-" if name == "hole" else "--"}
                    label = f"δ = {history['delta/dR'][step - 1]:g} ΔR" if name == "hole" else None
                    axes.plot(np.degrees(angle), p / scene.E_star, label=label, **style)
    title = "contact pressure (hole solid, pin dashed)" if scene.pin.solid else "contact pressure"
    axes.set(xlabel="angle from the contact axis [°]", ylabel="p / E*", title=title, xlim=(0, 90), ylim=(0, None))
    axes.legend(frameon=False)
    axes.grid(alpha=0.3)

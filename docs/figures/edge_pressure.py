"""The pressure along the pin of a lug, over the chamfer of its hole: ``python3
docs/figures/edge_pressure.py`` solves a lug for each chamfer and writes edge_pressure.png.

The lug is ``scenes/lug_in_space.toml`` without yielding, under a displacement of 0.1 mm. Means of
the facets within 15 degrees of the load are drawn, on strips of the pin.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import archord
from archord.report.figure import new_figure, save

SCENE = Path(__file__).parents[2] / "scenes" / "lug_in_space.toml"
CHAMFERS = (0.0, 0.25, 0.5, 1.0)
NEAR = 15.0  # degrees from the load
ENDS = np.concatenate([np.linspace(0.0, 4.0, 5), np.linspace(4.25, 6.0, 8)])  # of the strips


def solved(chamfer: float, folder: Path) -> archord.Run:
    """The run of the lug with this ``chamfer``."""
    fine = {"lug.element_size": 1.5, "space.rim_ratio": 0.15}
    elastic = {"plate.material": None, "plate.E": 210000.0, "plate.nu": 0.3}
    load = {"load.displacement": 0.1, "load.steps": 1}
    scene = archord.load_scene(SCENE, fine | elastic | load | {"space.chamfer": chamfer})
    return archord.solve(scene, folder / f"chamfer_{chamfer:g}", force=True)


def pressure_along(run: archord.Run) -> np.ndarray:
    """Mean pressures of the strips of the pin."""
    pin = run.unrolled("pin")
    load = 180.0 * np.round(pin.angle[pin.pressure.argmax()] / 180.0)
    near = np.abs((pin.angle - load + 180) % 360 - 180) < NEAR
    strip = np.digitize(pin.along[near], ENDS) - 1
    inside = (strip >= 0) & (strip < len(ENDS) - 1)
    area = pin.area[near][inside]
    force = area * pin.pressure[near][inside]
    count = len(ENDS) - 1
    return np.bincount(strip[inside], force, count) / np.bincount(strip[inside], area, count)


def main() -> None:
    """Solve, print and draw."""
    figure = new_figure(7.0, 4.0)
    axes = figure.subplots()
    for chamfer in CHAMFERS:
        run = solved(chamfer, Path("runs"))
        mean = pressure_along(run)
        rim, middle = (run.columns[f"pin in lug {at} pressure"][-1] for at in ("rim", "mid"))
        force = run.columns["pull force"][-1]
        label = f"chamfer {chamfer:g} mm, rim/middle {rim / middle:.2f}"
        axes.stairs(mean, ENDS, baseline=None, label=label)
        print(f"{label}: {rim:.1f} and {middle:.1f} MPa at {force:.0f} N")
    axes.set_xlabel("place along the pin from the mid-plane of the lug [mm]")
    axes.set_ylabel("contact pressure under the load [MPa]")
    axes.set_ylim(bottom=0.0)
    axes.legend(frameon=False)
    save(figure, Path(__file__).with_suffix(".png"))


if __name__ == "__main__":
    sys.exit(main())

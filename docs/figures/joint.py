"""The joint, drawn: ``python3 docs/figures/joint.py`` writes joint.png beside this file.

Left, first touch: radii, clearance, supports and load. Right, pressed: displacement, semi-angle and
chord of the contact by the geometry of rigid circles (eq. 5 of the paper). The clearance is drawn
far too large.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from archord.report.figure import new_figure, save

R, GAP, DELTA = 1.0, 0.16, 0.12  # radius, clearance and displacement as drawn
WIDTH, DEPTH = 2.1, 1.95  # half the block's width, and its depth
EPS = np.arccos(GAP / (GAP + DELTA))
PIN, BLOCK, LINE, FORCE, SIZE = "#d6e3f1", "#ececec", "0.15", "#b03030", "#1f5fa8"


def point(radius: Any, angle: Any) -> np.ndarray:
    """The points ``(2, ...)`` at ``angle`` from the contact axis about the hole's centre."""
    return np.array([radius * np.sin(angle), -radius * np.cos(angle)])


def arrow(axes: Any, start: Any, end: Any, colour: str = SIZE, style: str = "-|>") -> None:
    """An arrow from ``start`` to ``end``."""
    axes.annotate(
        "",
        end,
        start,
        arrowprops={"arrowstyle": style, "color": colour, "shrinkA": 0, "shrinkB": 0},
    )


def bodies(axes: Any, depth: float) -> None:
    """The block with its hole, held at its top, and the pin below its diameter, which is ``depth``
    below the top."""
    half = np.linspace(-np.pi / 2, np.pi / 2, 181)
    reach = np.arctan2(R, depth)
    angle = np.linspace(-reach, reach, 181)
    circle = depth * np.cos(angle) + np.sqrt(R**2 - (depth * np.sin(angle)) ** 2)
    hole, pin = point(R + GAP, half), point(np.minimum(circle, R + GAP), angle)
    corners = np.array([[WIDTH, WIDTH, -WIDTH, -WIDTH], [0, -DEPTH, -DEPTH, 0]])
    axes.fill(*np.hstack([hole, corners]), fc=BLOCK, ec="none")
    axes.plot(*hole, color=LINE, lw=1.3)
    axes.fill(*pin, fc=PIN, ec=LINE, lw=1.3)
    for side in (-1, 1):
        inner, outer = side * (R + GAP), side * WIDTH
        axes.plot([inner, outer], [0, 0], color=LINE, lw=1.6)
        for x in np.linspace(min(inner, outer), max(inner, outer), 10):
            axes.plot([x, x + 0.08], [0, 0.11], color=LINE, lw=0.8)
    axes.plot([0, 0], [-DEPTH, 0.55], color="0.45", lw=0.8, ls=(0, (9, 3, 2, 3)))
    axes.set(xlim=(-WIDTH - 0.05, WIDTH + 0.1), ylim=(-DEPTH - 0.02, 0.72), aspect="equal")
    axes.axis("off")


def first_touch(axes: Any) -> None:
    """Radii, clearance, supports and load."""
    bodies(axes, GAP)
    for x in (-0.8, -0.4, 0.4, 0.8):
        arrow(axes, (x, 0.3), (x, -GAP), FORCE)
    axes.text(
        0,
        0.52,
        "displacement $\\delta$, force $P$",
        color=FORCE,
        ha="center",
        backgroundcolor="white",
    )
    for end, place in (
        (point(R, -0.75) - [0, GAP], (-0.42, -0.42)),
        (point(R + GAP, 0.75), (0.36, -0.74)),
    ):
        arrow(axes, (0, -GAP) if end[0] < 0 else (0, 0), end)
        axes.text(*place, "$R$" if end[0] < 0 else "$R + \\Delta R$", color=SIZE, ha="center")
    for y, shift in ((0, 0.25), (-GAP, -0.25)):
        axes.plot([-0.08, 0], [y, y], color=SIZE, lw=0.9)
        arrow(axes, (-0.06, y + shift), (-0.06, y))
    axes.text(-0.12, -GAP / 2, "$\\Delta R$", color=SIZE, ha="right", va="center")
    for x in (-1.63, 1.63):
        axes.text(x, 0.2, "held", ha="center")
    for name, place in {
        "pin": (-0.38, -0.95),
        "block": (-1.55, -1.1),
        "free": (-1.55, -1.85),
    }.items():
        axes.text(*place, name, ha="center")
    axes.set_title("first touch")


def pressed(axes: Any) -> None:
    """Displacement, semi-angle, chord and pressure of the contact."""
    bodies(axes, GAP + DELTA)
    edge, deepest = point(R + GAP, EPS), point(R + GAP, 0.0)
    for angle in np.linspace(-EPS, EPS, 13)[1:-1]:
        arrow(
            axes,
            point(R + GAP + 0.34 * (1 - (angle / EPS) ** 2) + 0.02, angle),
            point(R + GAP, angle),
            FORCE,
        )
    axes.text(-0.62, -1.62, "$p$", color=FORCE)
    axes.plot(*zip(deepest, edge, strict=True), color=SIZE, lw=1.4)
    middle = (deepest + edge) / 2
    axes.text(
        middle[0] - 0.05,
        middle[1] + 0.12,
        "chord $l$",
        color=SIZE,
        ha="center",
        va="bottom",
        rotation=29,
    )
    axes.plot(*zip((0, 0), edge, strict=True), color=SIZE, lw=0.9)
    axes.plot(*point(0.36, np.linspace(0, EPS, 30)), color=SIZE, lw=0.9)
    axes.text(
        *point(0.5, EPS / 2), "$\\varepsilon$", color=SIZE, ha="center", va="center", fontsize=12
    )
    for y in (-GAP, -GAP - DELTA):
        axes.plot([-0.92, -0.6], [y, y], color=SIZE, lw=0.9)
    arrow(axes, (-0.76, 0.1), (-0.76, -GAP))
    arrow(axes, (-0.76, -GAP - DELTA - 0.26), (-0.76, -GAP - DELTA))
    axes.text(-0.68, -GAP - DELTA / 2, "$\\delta$", color=SIZE, va="center")
    axes.set_title("pressed")


if __name__ == "__main__":
    figure = new_figure(10, 3.6)
    for axes, draw in zip(figure.subplots(1, 2), (first_touch, pressed), strict=True):
        draw(axes)
    print(save(figure, Path(__file__).with_suffix(".png")))

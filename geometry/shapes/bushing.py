"""A pin in any number of sleeves in a housing that is held at its outer edge: the half y >= 0.

The housing's centre is the origin. All bodies are drawn concentric, or shifted in +x until each
touches the next one out. Surfaces that interfere are drawn into each other, around one centre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import chain

from mpi4py import MPI

from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.joint_mesh import mesh_joint
from archord.geometry.shapes.sketch import Bore, PinPart, Sketch, around, in_radii

_LAYERS = 2  # across a wall, at least
_SLENDER = 4.0  # longest element of a wall over its thickness
_THIN = 4.0  # walls of fewer elements are cut into a grid


def bushing(
    comm: MPI.Comm,
    radius: float,
    rings: Sequence[Sequence[float]],
    element_size: float,
    growth: float,
    *,
    touching: bool = False,
    pin: PinPart = "half",
    **options,
) -> TaggedMesh:
    """Mesh the bodies "pin", "sleeve 1", ... and "housing", with ``options`` as for `mesh_joint`.

    ``rings`` are the inner and outer radii of sleeves and housing, from the pin outward. Lengths
    share one unit. All arcs are cut into equal angles, of elements ``element_size`` long on the
    pin, shorter if walls are thin; away from the arcs they grow by ``growth`` per unit of distance.
    Sets: "pin", "flat" (the pin's line across the axis, see `lug`), "sleeve 1 inside", "sleeve 1
    outside", ..., "bore", "outer edge" and "axis" (y = 0).
    """
    size, *radii = in_radii(radius, element_size, *chain.from_iterable(rings))
    rings = list(zip(radii[::2], radii[1::2], strict=True))
    longest = [longest_edge(outer - inner) for inner, outer in rings]
    size = min(size, *longest)
    within = [1.0, *(outer for _, outer in rings)]
    gaps = [touching * max(inner - r, 0.0) for (inner, _), r in zip(rings, within, strict=False)]
    shifts = [sum(gaps[i:]) for i in range(len(rings) + 1)]
    names = ["pin", *(f"sleeve {k}" for k in range(1, len(rings))), "housing"]
    of_sleeves = [(f"{name} inside", f"{name} outside") for name in names[1:-1]]
    sets = [*of_sleeves, ("bore", "outer edge")]
    of_rings = [name for pair in sets for name in pair]
    sketch = Sketch(names, ["pin", "flat", *of_rings, "axis"])
    x_pin, *x_rings = shifts
    sketch.pin(x_pin, 1, pin)
    sketch.bores.append(Bore(of_rings[0], size, growth))
    sketch.sizes["pin"] = f"{size!r} + {growth!r} * Abs({around(x_pin)} - 1)"
    for body, pair, (inner, outer), x in zip(names[1:], sets, rings, x_rings, strict=True):
        draw_ring(sketch, body, pair, (inner, outer), x, 1, size)
        r = around(x)
        nearest = between(x, inner, outer)
        away = f"{r} - {inner!r}" if body == "housing" else nearest
        sketch.sizes[body] = f"{size!r} * {r} + {growth!r} * Abs({away})"
    n_edges = math.pi / 2 / size
    sketch.parts |= {line: n_edges for name in sketch.circles for line in sketch.lines[name]}
    return mesh_joint(comm, sketch, radius=radius, **options)


def longest_edge(wall: float) -> float:
    """How long elements along a wall of this thickness may be."""
    return _SLENDER / _LAYERS * wall


def between(x: float, inner: float, outer: float) -> str:
    """The distance to the nearer of two circles about (x, 0), for sizes."""
    r = around(x)
    return f"Min(Abs({r} - {inner!r}), Abs({r} - {outer!r}))"


def draw_ring(
    sketch: Sketch,
    body: str,
    sets: Sequence[str],
    radii: Sequence[float],
    x: float,
    up: int,
    size: float,
) -> None:
    """Draw the half of a ring about (x, 0) above (``up`` = 1) or below the axis, between an inner
    and an outer radius, whose arcs go to two ``sets``; a wall of few elements of ``size`` is cut
    into a grid."""
    ends = [((x + r, 0.0), (x, up * r), (x - r, 0.0)) for r in radii]
    circles = [Circle(name, (x, 0.0), r) for name, r in zip(sets, radii, strict=True)]
    arcs = {
        on.facets: sketch.path(body, *places, on=on)
        for on, places in zip(circles, ends, strict=True)
    }
    inner, outer = ends
    across = [line for k in (0, 2) for line in sketch.path(body, inner[k], outer[k])]
    face = sketch.face(body, **arcs, axis=across)
    layers = (radii[1] - radii[0]) / (size * radii[0])
    if layers < _THIN:
        sketch.parts |= dict.fromkeys(across, max(_LAYERS, layers))
        sketch.grid[face] = [
            sketch.point(body, places[k]) for k in (0, 2) for places in (inner, outer)
        ]

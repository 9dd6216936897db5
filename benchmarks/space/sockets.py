"""A ball, or a pin, in a conforming socket: around an axis, in a plane, and as a layer in space.

A layer between held faces is in plane strain. Its elements of third degree have the bases of the
plane's ones. Its own contact points are other ones, and its trace constants know modes through the
layer. With the plane's points and constants it gives the plane's force, but for round-off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any
from unittest.mock import patch

import numpy as np

from archord.benchmarks.axisymmetric.case import Compared, elastic
from archord.benchmarks.space.revolved import of_quadrilaterals
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.layers import layered
from archord.geometry.shapes.sketch import Sketch
from archord.solver.contact.quadrature import segment_rule
from archord.solver.contact.surface import Surface
from archord.solver.path.system import System
from archord.solver.problem import Body, Interaction, Load, Problem, Support

AXIS = (Support("ball axis", fixed="x"), Support("axis", fixed="x"))
_BALL = 10.0
_SOCKET = 10.05
_WIDTH = 20.0
_DEPTH = 30.0
_PRESSED = 0.05
_LAYER = 0.5
_DEGREE = 3
_LOADS = (0.25, 0.5, 0.75, 1.0)  # with friction one step alone may follow another path
_Face = Callable[[Surface, Surface], None]


def socket_sketch(size: float) -> Sketch:
    """The lower half of a ball, or of a pin, that touches a recess from within."""
    names = ["ball", "ball top", "ball axis", "socket", "block top", "axis", "outside"]
    sketch = Sketch(["ball body", "block"], names)
    up = _BALL - _SOCKET
    around = Circle("ball", (0.0, up), _BALL)
    sides = {
        "ball": sketch.path("ball body", (0.0, up - _BALL), (_BALL, up), on=around),
        "ball top": sketch.path("ball body", (_BALL, up), (0.0, up)),
        "ball axis": sketch.path("ball body", (0.0, up), (0.0, up - _BALL)),
    }
    sketch.face("ball body", **sides)
    recess = Circle("socket", (0.0, 0.0), _SOCKET)
    corners = [(_WIDTH, 0.0), (_WIDTH, -_DEPTH), (0.0, -_DEPTH)]
    sides = {
        "socket": sketch.path("block", (0.0, -_SOCKET), (_SOCKET, 0.0), on=recess),
        "block top": sketch.path("block", (_SOCKET, 0.0), corners[0]),
        "outside": sketch.path("block", *corners),
        "axis": sketch.path("block", corners[-1], (0.0, -_SOCKET)),
    }
    sketch.face("block", **sides)
    grown = f"{size!r} + 0.3 * Abs(Sqrt(x*x + y*y) - {_SOCKET!r})"
    sketch.sizes |= {"ball body": grown, "block": grown}
    return sketch


def pressed(
    mesh: TaggedMesh, held: Sequence[Support], friction: float = 0.0, **how: Any
) -> Problem:
    """The ball is pressed into its socket."""
    top = "xy" if mesh.dimension == 2 else "xyz"
    return Problem(
        mesh,
        [Body("ball body", elastic()), Body("block", elastic())],
        [Interaction("contact", ("ball", "socket"), friction=friction)],
        [*held, Support("block top", fixed=top)],
        [Load("press", on="ball top", direction="y", displacement=-_PRESSED)],
        steps=1,
        **how,
    )


def layer(size: float, friction: float = 0.0) -> Iterator[Compared]:
    """One layer beside plane strain: with the plane's contact points and trace constants, and with
    its own."""
    flat = of_quadrilaterals(socket_sketch(size))
    heights = dict.fromkeys(("ball body", "block"), (0.0, _LAYER))
    faces = [
        Support(f"{name} {face}", fixed="z") for name in heights for face in ("below", "above")
    ]
    how = {"friction": friction, "degree": _DEGREE}
    plane = System(pressed(flat, AXIS, **how))
    plane.solve(_LOADS)
    expected = _LAYER * plane.drive_force("press")
    solid = pressed(layered(flat, heights), (*AXIS, *faces), **how)
    pairs = plane.equilibrium.contact.pairs
    faced = {pair.surface.name: (pair.surface, pair.opposite.curve) for pair in pairs}
    with patch.object(Surface, "face", _as_in_plane(faced)):
        alike = System(solid)
    for what, system in {"P, points of the plane": alike, "P": System(solid)}.items():
        system.solve(_LOADS)
        yield Compared(what, expected, "plane strain", system.drive_force("press"))


def _as_in_plane(faced: Mapping[str, tuple[Surface, Any]]) -> _Face:
    """A `Surface.face` of a layer's surfaces: the contact points of the plane's surfaces, at
    several heights, and their trace constants. ``faced`` has these surfaces and the curves that
    they face, by name."""
    at, of_heights = np.polynomial.legendre.leggauss(_DEGREE + 1)
    heights = _LAYER * (1 + at) / 2

    def face(solid: Surface, opposite: Surface) -> None:
        flat, opposite_curve = faced[solid.name]
        patches: Any = solid.curve
        curve: Any = flat.curve
        middles = patches.X[patches.connectivity].mean(axis=1)[:, :2]
        apart = np.linalg.norm(middles[:, None] - flat.point.mean(axis=1), axis=-1)
        below = apart.argmin(axis=1)  # the edge of each facet
        feet = flat.point[below]
        n, q, _ = feet.shape
        x = np.empty((n, q, len(heights), 3))
        x[..., :2] = feet[:, :, None]
        x[..., 2] = heights
        facet = np.repeat(np.arange(n), q * len(heights))
        xi = patches.coordinates(x.reshape(-1, 3), facet)
        _, along = segment_rule(curve, opposite_curve)
        weight = along[below][:, :, None] * of_heights / 2
        solid.place_points(xi.reshape(n, -1, 2), weight.reshape(n, -1))
        solid._constants = flat.gamma[below], flat.gamma_shear[below]

    return face

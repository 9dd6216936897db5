"""What a run in space looks like: a field on the deformed bodies, cut open, and the contact
pressure unrolled.

pyvista finds the faces, and matplotlib paints them from the farthest to the nearest: no display is
needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from archord.materials.material import Array
from archord.output.files.vtkhdf import SECOND_ORDER
from archord.postprocess.arrays.fields import Fields
from archord.postprocess.pictures.problems import (
    OF_PEEQ,
    Colours,
    colours_for,
    field_values,
    shown_step,
    step_words,
)
from archord.postprocess.run import Run
from archord.report.by_name import ByName
from archord.report.errors import InputError

AXES = "xyz"
_STEEP = 0.45  # height of the view over the plane of the other two axes
_DARKEST = 0.6  # brightness of a face that is seen from the side
_ELASTIC = 0.93  # grey of what has not yielded
_PRESSED = 1e-6  # of the largest pressure: a facet that is pressed


class Skin(NamedTuple):
    """The boundary of deformed bodies as ``k`` triangles.

    - ``corners`` ``(k, 3, 3)``: seen from outside against the clock
    - ``values`` ``(k, 3)``: of the field at the corners
    """

    corners: Array
    values: Array


class View(NamedTuple):
    """How bodies are seen: the unit vectors ``(3,)`` to the ``right``, ``up`` and ``towards`` the
    eye."""

    right: Array
    up: Array
    towards: Array

    @classmethod
    def from_octant(cls, signs: Sequence[int]) -> View:
        """Seen from the octant with these ``signs`` of x, y and z; y points up."""
        x, y, z = signs
        towards = np.array([x, _STEEP * y, 1.3 * z])
        towards = towards / np.linalg.norm(towards)
        right = np.cross([0.0, 1.0, 0.0], towards)
        right = right / np.linalg.norm(right)
        up = np.cross(towards, right)
        return cls(right, up, towards)

    def flat(self, x: Array) -> Array:
        """Points ``(..., 3)`` as they are drawn ``(..., 2)``."""
        return np.stack([x @ self.right, x @ self.up], axis=-1)


def skin_of(run: Run, fields: Fields, values: Array, cut: str = "") -> Skin:
    """The boundary of the bodies with the ``values`` of the cells ``(m,)`` or the nodes ``(n,)``;
    nothing beyond the plane of a ``cut`` as "z=5". Raises `InputError`."""
    import pyvista

    kind = SECOND_ORDER[fields.cells.shape[1]]
    grid = pyvista.UnstructuredGrid({kind: fields.cells}, fields.coordinates)
    grid.point_data["displacement"] = fields.displacement
    of_cells = len(values) == len(fields.cells)
    of_what = "cell_data" if of_cells else "point_data"
    getattr(grid, of_what)["value"] = values
    if cut:
        axis, place = _plane_of(run, fields, cut)
        normal = np.eye(3)[axis]
        grid = grid.clip(normal=normal, origin=place * normal)
    grid.cell_data["middle"] = grid.cell_centers().points
    surface = grid.extract_surface(nonlinear_subdivision=1).triangulate()
    triangles = surface.faces.reshape(-1, 4)[:, 1:].copy()
    corners = surface.points[triangles]
    outward = corners.mean(axis=1) - surface.cell_data["middle"]
    along = (_normals(corners) * outward).sum(axis=1)
    inside_out = along < 0
    triangles[inside_out] = triangles[inside_out, ::-1]
    x = surface.points + surface.point_data["displacement"]
    found = getattr(surface, of_what)["value"]
    at_corners = np.stack([found] * 3, axis=1) if of_cells else found[triangles]
    return Skin(x[triangles], at_corners)


def field_panel(
    axes: Any, run: Run, step: int | None = None, field: str = "", cut: str = ""
) -> None:
    """A ``field`` at ``step`` (see `shown_step`) on the deformed bodies, seen from the octant that
    shows most of it. Raises `InputError` for a field that the run does not have, and for a ``cut``
    that leaves nothing."""
    from matplotlib.collections import TriMesh
    from matplotlib.tri import Triangulation

    fields = run.fields(step or shown_step(run))
    values, label, map_name = field_values(run, fields, field)
    skin = skin_of(run, fields, values, cut)
    shown = skin.values
    if map_name == OF_PEEQ:
        shown = np.where(shown == 0, np.nan, shown)
    normal = _normals(skin.corners)
    size = np.abs(np.nan_to_num(shown)).mean(axis=1)
    view = _best_view(normal, size, cut)
    # Faces that look away are hidden, but their triangles can be nearer than those before them.
    facing = np.flatnonzero(normal @ view.towards > 0)
    nearness = skin.corners[facing].mean(axis=1) @ view.towards
    order = facing[np.argsort(nearness)]
    known = shown[np.isfinite(shown)]
    colours = colours_for(known, map_name)
    painted = _painted(colours, shown[order], normal[order], view)
    places = view.flat(skin.corners[order]).reshape(-1, 2)
    triangles = np.arange(len(places)).reshape(-1, 3)
    drawn = Triangulation(*places.T, triangles)
    axes.add_collection(TriMesh(drawn, facecolors=painted.reshape(-1, 4), rasterized=True))
    axes.autoscale_view()
    axes.set(aspect="equal", xticks=[], yticks=[], frame_on=False)
    _draw_axes(axes, view)
    axes.figure.colorbar(_scale(colours), ax=axes, label=label, shrink=0.85)
    axes.set_title(step_words(run, fields.step), fontsize="medium")


def _plane_of(run: Run, fields: Fields, cut: str) -> tuple[int, float]:
    """The axis that is normal to the plane of a ``cut`` as "z=5", and where it stands. Raises
    `InputError` for what is no plane through the bodies."""
    name, _, place = cut.partition("=")
    try:
        axis = AXES.index(name.strip() or "?")
        at = float(place)
    except ValueError:
        said = f'cut = "{cut}" must name a plane, as "z=0" or "x=12.5"'
        raise InputError(run.folder, f"{said}.") from None
    along = fields.coordinates[:, axis]
    low = along.min()
    high = along.max()
    if not low < at < high:
        said = f'cut = "{cut}" must lie within the bodies: {low:.4g} < {AXES[axis]} < {high:.4g}'
        raise InputError(run.folder, f"{said}.")
    return axis, at


def _normals(triangles: Array) -> Array:
    """Unit normals ``(k, 3)`` of ``triangles`` ``(k, 3, 3)``."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return normal / np.maximum(length, np.finfo(float).tiny)


def _best_view(normal: Array, size: Array, cut: str) -> View:
    """The view that shows most of a field of this ``size`` ``(k,)`` on faces with these ``normal``
    vectors ``(k, 3)``; of a cut, one of those that look into it."""
    views = []
    for signs in product((1, -1), repeat=3):
        if cut and signs[AXES.index(cut.strip()[0])] < 0:
            continue
        views.append(View.from_octant(signs))

    def shows(view: View) -> float:
        facing = np.maximum(normal @ view.towards, 0)
        return float(facing @ size)

    return max(views, key=shows)


def _painted(colours: Colours, values: Array, normal: Array, view: View) -> Array:
    """Colours ``(k, 3, 4)`` of the corners of faces with these ``values`` ``(k, 3)``, darker where
    the faces are seen from the side."""
    span = max(colours.high - colours.low, np.finfo(float).tiny)
    scaled = (values - colours.low) / span
    painted = colours.map(np.clip(np.nan_to_num(scaled), 0, 1))
    painted[~np.isfinite(values), :3] = _ELASTIC
    facing = np.abs(normal @ view.towards)
    light = _DARKEST + (1 - _DARKEST) * facing
    painted[..., :3] *= light[:, None, None]
    return painted


def _scale(colours: Colours) -> Any:
    """What a scale of colours is drawn from."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(colours.low, colours.high), colours.map)


def _draw_axes(axes: Any, view: View) -> None:
    """Three arrows in a corner that show where x, y and z point."""
    inset = axes.inset_axes([-0.08, -0.08, 0.26, 0.26])
    inset.set(xlim=(-1.6, 1.6), ylim=(-1.6, 1.6), aspect="equal")
    inset.axis("off")
    ends = view.flat(np.eye(3))
    arrow = {"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0}
    for name, end in zip(AXES, ends, strict=True):
        inset.annotate("", end, (0, 0), arrowprops=arrow)
        inset.text(*(1.4 * end), name, ha="center", va="center", fontsize="small")


def contact_panel(axes: Any, run: Run, steps: Sequence[int] = ()) -> None:
    """Mean contact pressure of the facets of the last surface that is a cylinder, over the angle
    and the place along its axis, at the first of ``steps`` (see `shown_step`); of other surfaces
    the facets as they lie in the plane that shows most of them. A tie has tension, too."""
    from matplotlib.collections import PolyCollection

    step = steps[0] if steps else shown_step(run)
    surfaces = run.contact(step)
    name, places, words = _unrolled(surfaces)
    profile = surfaces[name]
    pressure = profile.facet_pressure
    is_tied = any(name in part.surfaces and part.law == "tied" for part in run.scene.interaction)
    carried = np.abs(pressure) if is_tied else pressure
    pressed = carried > _PRESSED * carried.max(initial=0.0)
    colours = colours_for(pressure, "viridis")
    shown = np.where(pressed, pressure, np.nan)
    drawn = PolyCollection(places, array=shown, cmap=colours.map)
    low = colours.low if is_tied else 0.0
    drawn.set(clim=(low, colours.high), edgecolor="face", linewidth=0.2)
    axes.add_collection(drawn)
    axes.autoscale_view()
    length = run.scene.units.length
    across, along = (word.format(length=length) for word in words)
    axes.set(xlabel=across, ylabel=along)
    axes.set_title(f"contact pressure on {name}, step {step}", fontsize="medium")
    unit = run.scene.units.stress
    axes.figure.colorbar(drawn, ax=axes, label=f"pressure [{unit}]", shrink=0.85)


def _unrolled(surfaces: ByName) -> tuple[str, Array, tuple[str, str]]:
    """The surface that is drawn, its facets' corners ``(n, c, 2)`` in the picture, and the words on
    its axes."""
    # with compiled curves, which other commands do without
    from archord.geometry.curve import circle_through

    for name in reversed(surfaces):
        corners = surfaces[name].corners
        flat = corners.reshape(-1, 3)
        for axis in (2, 0, 1):
            a, b = (k for k in range(3) if k != axis)
            circle = circle_through(flat[:, [a, b]])
            if circle is not None:
                places = _angle_and_length(corners, circle[0], (a, b), axis)
                return name, places, ("angle [°]", f"{AXES[axis]} [{{length}}]")
    name = next(reversed(surfaces))
    corners = surfaces[name].corners
    thin = int(np.ptp(corners.reshape(-1, 3), axis=0).argmin())
    a, b = (k for k in range(3) if k != thin)
    labels = (f"{AXES[a]} [{{length}}]", f"{AXES[b]} [{{length}}]")
    return name, corners[..., [a, b]], labels


def _angle_and_length(corners: Array, centre: Array, across: tuple[int, int], axis: int) -> Array:
    """``corners`` ``(n, c, 3)`` of facets of a cylinder by the angle in degrees about its axis, and
    the place along it: ``(n, c, 2)``. No facet is torn apart."""
    arm = corners[..., list(across)] - centre
    middle = arm.mean(axis=1)
    direction = middle.mean(axis=0)
    zero = np.arctan2(direction[1], direction[0])
    of_facet = np.arctan2(middle[:, 1], middle[:, 0])
    of_corner = np.arctan2(arm[..., 1], arm[..., 0])
    turned = np.angle(np.exp(1j * (of_corner - of_facet[:, None])))
    of_facet = np.angle(np.exp(1j * (of_facet - zero))) + zero
    angle = np.degrees(of_facet[:, None] + turned)
    return np.stack([angle, corners[..., axis]], axis=-1)

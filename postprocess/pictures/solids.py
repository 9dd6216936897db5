"""What a run in space looks like: a field on the deformed bodies, cut open, and the contact
pressure unrolled.

pyvista finds the faces, and matplotlib paints them from the farthest to the nearest: no display is
needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from archord.geometry.vectors import unit
from archord.materials.kinematics import Ints
from archord.materials.material import Array
from archord.postprocess.arrays.fields import Fields
from archord.postprocess.pictures.problems import (
    HARDLY,
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
from archord.report.table import in_digits

AXES = "xyz"
_STEEP = 0.45  # height of the view over the plane of the other two axes
_DARKEST = 0.6  # brightness of a face in the shade
_LIGHT = np.array([-0.4, 0.2, 1.0])  # where it comes from: right, up and towards the eye
_SHARP = np.cos(np.radians(35.0))  # of the angle between the faces beside a sharp edge
_LINE = 8e-4  # half the width of a line over the size of the picture
_BEFORE = 2.0  # lengths of a line by which it is nearer than where it lies
_INK = 0.25  # grey of lines
_N_PIECES = 8
# the nodes of the straight pieces of cells of second order, in VTK's order
_OF_TETRAHEDRON = [
    [0, 4, 6, 7],
    [4, 1, 5, 8],
    [6, 5, 2, 9],
    [7, 8, 9, 3],
    [6, 8, 4, 5],
    [6, 8, 5, 9],
    [6, 8, 9, 7],
    [6, 8, 7, 4],
]
_OF_HEXAHEDRON = [
    [0, 8, 24, 11, 16, 22, 26, 20],
    [8, 1, 9, 24, 22, 17, 21, 26],
    [24, 9, 2, 10, 26, 21, 18, 23],
    [11, 24, 10, 3, 20, 26, 23, 19],
    [16, 22, 26, 20, 4, 12, 25, 15],
    [22, 17, 21, 26, 12, 5, 13, 25],
    [26, 21, 18, 23, 25, 13, 6, 14],
    [20, 26, 23, 19, 15, 25, 14, 7],
]
# by the nodes of a cell: VTK's number of its pieces, and the table
_PIECES = {10: (10, _OF_TETRAHEDRON), 27: (12, _OF_HEXAHEDRON)}
_ELASTIC = 0.93  # grey of what has not yielded
_BESIDE = 1e-5  # of the size: how far a cut is beside nodes, which would tear its face
_PRESSED = 1e-6  # of the largest pressure: a facet that is pressed


class Skin(NamedTuple):
    """The boundary of deformed bodies as ``k`` triangles.

    - ``corners`` ``(k, 3, 3)``: seen from outside against the clock
    - ``values`` ``(k, 3)``: of the field at the corners
    - ``edges`` ``(j, 2, 3)``: ends of the sides at which faces meet at a sharp angle
    - ``beside`` ``(j, 2)``: the triangles on both sides of each
    """

    corners: Array
    values: Array
    edges: Array
    beside: Ints


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
        towards = unit(np.array([x, _STEEP * y, 1.3 * z]))
        right = unit(np.cross([0.0, 1.0, 0.0], towards))
        up = np.cross(towards, right)
        return cls(right, up, towards)

    def flat(self, x: Array) -> Array:
        """Points ``(..., 3)`` as they are drawn ``(..., 2)``."""
        return np.stack([x @ self.right, x @ self.up], axis=-1)


class _Layer(NamedTuple):
    """``k`` triangles to paint.

    - ``places`` ``(k, 3, 2)``: their corners as they are drawn
    - ``nearness`` ``(k,)``: to the eye
    - ``colours`` ``(k, 3, 4)``: of the corners
    """

    places: Array
    nearness: Array
    colours: Array


def skin_of(run: Run, fields: Fields, values: Array, cut: str = "") -> Skin:
    """The boundary of the bodies with the ``values`` of the cells ``(m,)`` or the nodes ``(n,)``;
    nothing beyond the plane of a ``cut`` as "z=5". Raises `InputError`."""
    import pyvista

    # straight pieces of cells still meet where they are cut, which curved cells do not
    kind, table = _PIECES[fields.cells.shape[1]]
    pieces = fields.cells[:, table].reshape(-1, len(table[0]))
    grid = pyvista.UnstructuredGrid({kind: pieces}, fields.coordinates)
    grid.point_data["displacement"] = fields.displacement
    of_cells = len(values) == len(fields.cells)
    if of_cells:
        grid.cell_data["value"] = np.repeat(values, _N_PIECES)
    else:
        grid.point_data["value"] = values
    if cut:
        axis, place = _plane_of(run, fields, cut)
        off = np.abs(fields.coordinates[:, axis] - place).min()
        margin = _BESIDE * float(np.ptp(fields.coordinates))
        if off < margin:
            place -= margin
        normal = np.eye(3)[axis]
        grid = grid.clip(normal=normal, origin=place * normal)
    grid.cell_data["middle"] = grid.cell_centers().points
    surface = grid.extract_surface().triangulate()
    triangles = surface.faces.reshape(-1, 4)[:, 1:].copy()
    corners = surface.points[triangles]
    outward = corners.mean(axis=1) - surface.cell_data["middle"]
    inside_out = (_normals(corners) * outward).sum(axis=1) < 0
    triangles[inside_out] = triangles[inside_out, ::-1]
    x = surface.points + surface.point_data["displacement"]
    if of_cells:
        at_corners = np.stack([surface.cell_data["value"]] * 3, axis=1)
    else:
        at_corners = surface.point_data["value"][triangles]
    corners = x[triangles]
    ends, beside = _sharp(triangles, _normals(corners))
    return Skin(corners, at_corners, x[ends], beside)


def _sharp(triangles: Ints, normal: Array) -> tuple[Ints, Ints]:
    """The ends ``(j, 2)`` of the sides at which ``triangles`` ``(k, 3)`` with these ``normal``
    vectors meet at a sharp angle, and the two triangles ``(j, 2)`` beside each."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    ends, which, n_beside = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.ravel(), kind="stable")
    of_two = n_beside == 2
    pairs = order[np.repeat(of_two, n_beside)].reshape(-1, 2) // 3
    first, second = np.moveaxis(normal[pairs], 1, 0)
    is_sharp = (first * second).sum(axis=1) < _SHARP
    return ends[of_two][is_sharp], pairs[is_sharp]


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
        shown = np.where(shown <= HARDLY * shown.max(), np.nan, shown)
    normal = _normals(skin.corners)
    size = np.abs(np.nan_to_num(shown)).mean(axis=1)
    view = _best_view(normal, size, cut)
    # Faces that look away are hidden, but their triangles can be nearer than those before them.
    facing = normal @ view.towards > 0
    colours = colours_for(shown[np.isfinite(shown)], map_name)
    faces = _Layer(
        view.flat(skin.corners[facing]),
        skin.corners[facing].mean(axis=1) @ view.towards,
        _painted(colours, shown[facing], normal[facing], view),
    )
    width = _LINE * np.ptp(view.flat(skin.corners), axis=(0, 1)).max()
    lines = _lines(skin.edges[facing[skin.beside].any(axis=1)], view, width)
    places, nearness, painted = (np.concatenate(parts) for parts in zip(faces, lines, strict=True))
    order = np.argsort(nearness)
    places = places[order].reshape(-1, 2)
    triangles = np.arange(len(places)).reshape(-1, 3)
    drawn = Triangulation(*places.T, triangles)
    painted = painted[order].reshape(-1, 4)
    axes.add_collection(TriMesh(drawn, facecolors=painted, rasterized=True))
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


def _lines(edges: Array, view: View, width: float) -> _Layer:
    """The ``edges`` ``(j, 2, 3)`` as thin strips of two triangles each, twice this ``width``,
    before the faces beside them."""
    ends = view.flat(edges)
    along = np.diff(ends, axis=1)
    length = np.linalg.norm(along, axis=2, keepdims=True)
    right, up = np.moveaxis(along / np.maximum(length, np.finfo(float).tiny), 2, 0)
    aside = width * np.stack([-up, right], axis=2)
    (a, b), (c, d) = (np.moveaxis(ends + sign * aside, 1, 0) for sign in (-1, 1))
    strips = np.stack([a, b, d, a, d, c], axis=1).reshape(-1, 3, 2)
    nearness = edges.mean(axis=1) @ view.towards
    before = nearness + _BEFORE * np.linalg.norm(np.diff(edges, axis=1), axis=2)[:, 0]
    ink = np.array([_INK, _INK, _INK, 1.0])
    return _Layer(strips, before.repeat(2), np.broadcast_to(ink, (len(strips), 3, 4)))


def _painted(colours: Colours, values: Array, normal: Array, view: View) -> Array:
    """Colours ``(k, 3, 4)`` of the corners of faces with these ``values`` ``(k, 3)``, darker where
    the faces are in the shade."""
    span = max(colours.high - colours.low, np.finfo(float).tiny)
    scaled = (values - colours.low) / span
    painted = colours.map(np.clip(np.nan_to_num(scaled), 0, 1))
    painted[~np.isfinite(values), :3] = _ELASTIC
    direction = _LIGHT @ np.stack(view) / np.linalg.norm(_LIGHT)
    light = _DARKEST + (1 - _DARKEST) * np.maximum(normal @ direction, 0)
    painted[..., :3] *= light[:, None, None]
    return painted


def _scale(colours: Colours) -> Any:
    """What a scale of colours is drawn from."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(colours.low, colours.high), colours.map)


def _draw_axes(axes: Any, view: View) -> None:
    """Three arrows in a corner that show where x, y and z point."""
    inset = axes.inset_axes([-0.1, -0.16, 0.26, 0.26])
    inset.set(xlim=(-1.6, 1.6), ylim=(-1.6, 1.6), aspect="equal")
    inset.axis("off")
    ends = view.flat(np.eye(3))
    arrow = {"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0}
    for name, end in zip(AXES, ends, strict=True):
        inset.annotate("", end, (0, 0), arrowprops=arrow)
        inset.text(*(1.4 * end), name, ha="center", va="center", fontsize="small")


def contact_panel(axes: Any, run: Run, steps: Sequence[int] = ()) -> None:
    """Mean contact pressure of the facets of the last pair's cylinder, of two the shorter, over the
    angle and the place along its axis, at the first of ``steps`` (see `shown_step`); of other
    surfaces the facets as they lie in the plane that shows most of them. A tie has tension, too."""
    from matplotlib.collections import PolyCollection

    step = steps[0] if steps else shown_step(run)
    surfaces = run.contact(step)
    parts = run.scene.interaction
    pairs = ([name for name in part.surfaces if name in surfaces] for part in reversed(parts))
    name, places, words = _unrolled(surfaces, pairs)
    profile = surfaces[name]
    pressure = profile.facet_pressure
    is_tied = any(name in part.surfaces and part.law == "tied" for part in parts)
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


def _unrolled(
    surfaces: ByName, pairs: Iterable[Sequence[str]]
) -> tuple[str, Array, tuple[str, str]]:
    """The surface that is drawn, of the first of ``pairs`` that has cylinders, its facets' corners
    ``(n, c, 2)`` in the picture, and the words on its axes."""
    for names in pairs:
        cylinders = [found for name in names if (found := _cylinder(name, surfaces[name]))]
        if cylinders:
            drawn = min(cylinders, key=lambda each: (not each.is_pressed, each.length))
            places = _angle_and_length(surfaces[drawn.name].corners, drawn.centre, drawn.axis)
            return drawn.name, places, ("angle [°]", f"{AXES[drawn.axis]} [{{length}}]")
    name = next(reversed(surfaces))
    corners = surfaces[name].corners
    thin = int(np.ptp(corners.reshape(-1, 3), axis=0).argmin())
    a, b = (k for k in range(3) if k != thin)
    labels = (f"{AXES[a]} [{{length}}]", f"{AXES[b]} [{{length}}]")
    return name, corners[..., [a, b]], labels


class _Cylinder(NamedTuple):
    """A surface about a line along ``axis`` through the ``centre`` ``(2,)``.

    ``length`` is in six digits, so that round-off makes no cylinder the shorter one. ``is_pressed``
    tells whether anything presses it.
    """

    name: str
    length: float
    centre: Array
    axis: int
    is_pressed: bool


def _cylinder(name: str, profile: Any) -> _Cylinder | None:
    """The surface ``name``, if it is a cylinder along x, y or z."""
    # with compiled curves, which other commands do without
    from archord.geometry.curve import circle_through

    corners = profile.corners.reshape(-1, 3)
    for axis in (2, 0, 1):
        circle = circle_through(np.delete(corners, axis, axis=1))
        if circle is not None:
            length = in_digits(np.ptp(corners[:, axis]), 6)
            return _Cylinder(name, length, circle[0], axis, bool(profile.facet_pressure.any()))
    return None


def _angle_and_length(corners: Array, centre: Array, axis: int) -> Array:
    """``corners`` ``(n, c, 3)`` of facets of a cylinder by the angle in degrees about its axis
    through the ``centre`` ``(2,)``, and the place along it: ``(n, c, 2)``. No facet is torn
    apart."""
    arm = np.delete(corners, axis, axis=-1) - centre
    middle = arm.mean(axis=1)
    direction = middle.mean(axis=0)
    zero = np.arctan2(direction[1], direction[0])
    of_facet = np.arctan2(middle[:, 1], middle[:, 0])
    of_corner = np.arctan2(arm[..., 1], arm[..., 0])
    turned = np.angle(np.exp(1j * (of_corner - of_facet[:, None])))
    of_facet = np.angle(np.exp(1j * (of_facet - zero))) + zero
    angle = np.degrees(of_facet[:, None] + turned)
    return np.stack([angle, corners[..., axis]], axis=-1)

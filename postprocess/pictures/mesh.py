"""A mesh for people: its cells, named sets and circles as text, and a picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from archord.geometry.basis import TRIANGLE
from archord.geometry.curve import Curve, circle_through
from archord.geometry.meshes.cells import (
    along,
    corners_of,
    entities_of,
    lengths,
    n_sides,
    outer_sides,
    side_kind,
    sides_between,
    sides_of,
)
from archord.geometry.meshes.check import cracks, parts
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.quality import measures, place, poor_cells, quality
from archord.geometry.meshes.refine import cylinder_through
from archord.geometry.patches import Patches
from archord.materials.kinematics import Array, Bools, Ints
from archord.output.user_file import save_figure
from archord.report.figure import new_figure
from archord.report.table import Table


def mesh_text(name: str, mesh: MeshArrays) -> str:
    """What is in ``mesh``, in tables with a row a set, which tell the `quality` of the worst cells;
    warnings come last."""
    area = measures(mesh)
    is_plane = mesh.dimension == 2
    extents = " by ".join(f"{extent:g}" for extent in np.ptp(mesh.x, axis=0))
    plural = f"{mesh.kind.name}s".replace("hedrons", "hedra")
    kind = f"{plural} of order {mesh.order}"
    lowest = place(mesh.x.min(axis=0))
    extent = f"{extents} from {lowest}"
    head = f"{name}: {len(mesh.cells)} {kind}, {len(mesh.x)} nodes, {extent}"
    cells = {name: np.isin(mesh.bodies, tags) for name, tags in mesh.cell_sets.items()}
    size = "area {:.6g}" if is_plane else "volume {:.6g}"
    worst = ("Jacobian {:.2g}", "roundness {:.2g}")
    bodies = Table("cell set", "cells", size, "parts", *worst, left=1)
    good = quality(mesh)
    for name, inside in cells.items():
        n_parts = parts(mesh.kind, mesh.cells[inside]).max(initial=-1) + 1
        lowest_of = [values[inside].min(initial=1.0) for values in good]
        bodies.add(name, inside.sum(), area[inside].sum(), n_parts, *lowest_of)
    row = _facet_row if is_plane else _face_row
    shape = ["circle"] if is_plane else ["middle", "cylinder"]
    size = "length {:.5g}" if is_plane else "area {:.5g}"
    extremes = ("shortest {:.5g}", "longest {:.5g}")
    columns = ["facet set", "of", *shape, "facets", size, *extremes]
    facets = Table(*columns, left=columns.index("facets"))
    for name in mesh.facet_sets:
        entries = row(mesh, mesh.facets_of(name), cells)
        facets.add(name, *entries)
    points = Table("point set", "nodes", left=1)
    for name, nodes in mesh.point_sets.items():
        points.add(name, len(nodes))
    doubts = [*mesh.notes, *poor_cells(mesh, good)]
    for name, inside in cells.items():
        doubts += cracks(mesh, name, inside)
    parts_of_text = [head]
    parts_of_text += [str(table) for table in (bodies, facets, points) if table.rows]
    if doubts:
        parts_of_text.append("\n".join(f"warning: {said}" for said in doubts))
    return "\n\n".join(parts_of_text)


def _owners(mesh: MeshArrays, facets: Ints, cells: Mapping[str, Bools]) -> str:
    """The sets of the ``cells`` behind facets."""
    corners = corners_of(mesh.kind, facets)
    behind = sides_between(mesh.kind, mesh.cells, corners) // n_sides(mesh.kind)
    return ", ".join(name for name, inside in cells.items() if inside[behind].any())


def _face_row(mesh: MeshArrays, facets: Ints, cells: Mapping[str, Bools]) -> list[object]:
    """Owners, middle, cylinder, number, area, shortest and longest edge of the ``facets`` of a set
    in space."""
    kind = side_kind(mesh.kind)
    corners = corners_of(mesh.kind, facets)
    cylinder = cylinder_through(mesh.x, facets) if len(facets) else None
    middle = ""
    if len(facets):
        mean = mesh.x[corners].mean(axis=(0, 1))
        middle = place(mean.round(9) + 0.0)
    said = f"R {cylinder.radius:.8g}" if cylinder else ""
    length = lengths(mesh.x, entities_of(kind, facets, 1))
    area = Patches(mesh.x, facets, kind, mesh.order).areas().sum()
    owners = _owners(mesh, facets, cells)
    return [owners, middle, said, len(facets), area, *_extremes(length)]


def _extremes(length: Array) -> tuple[float, float]:
    """The shortest and the longest ``length`` ``(k,)`` in a set."""
    return length.min(initial=np.inf), length.max(initial=0.0)


def _facet_row(mesh: MeshArrays, edges: Ints, cells: Mapping[str, Bools]) -> list[object]:
    """Owners, circle, number, length, shortest and longest of the ``edges`` of a set."""
    nodes, count = np.unique(edges[:, :2], return_counts=True)
    curve = Curve(mesh.x, edges.shape[1] - 1, along(edges))
    ends = curve.arc_length(np.array([0.0, 1.0]))
    length = np.diff(ends)[:, 0]
    said = []
    circle = circle_through(mesh.x[nodes]) if len(nodes) else None
    if circle is not None:
        centre, radius = circle
        x, y = centre.round(9) + 0.0
        said.append(f"({x:.5g}, {y:.5g}) R {radius:.8g}")
        if edges.shape[1] == 2:
            sagitta = length.max() ** 2 / (8 * radius)
            said.append(f"sagitta {sagitta:.2g}")
    if len(nodes) and (count == 2).all():
        said.append("closed")
    owners = _owners(mesh, edges, cells)
    return [owners, ", ".join(said), len(edges), length.sum(), *_extremes(length)]


def draw_mesh(mesh: MeshArrays, target: Path) -> Path:
    """The cells, facets and points of named sets, each set in a colour, small ones over large;
    returns ``target``. Raises `InputError`."""
    if mesh.dimension == 3:
        return _draw_solids(mesh, target)
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection, PolyCollection

    width, height = np.ptp(mesh.x, axis=0)
    figure = new_figure(9.0, float(np.clip(9.0 * height / width, 3.0, 12.0)))
    axes = figure.add_subplot()
    colours = colormaps["tab10"]
    faint = colormaps["Pastel2"]
    around = [0, 1, 2] if mesh.kind == TRIANGLE else [0, 1, 3, 2]
    for k, (name, tags) in enumerate(mesh.cell_sets.items()):
        own = mesh.cells[np.isin(mesh.bodies, tags)]
        style = {"facecolors": [faint(k % 8)], "zorder": -len(own)}
        cells = PolyCollection(mesh.x[own][:, around], label=name, **style)
        axes.add_collection(cells)
    sides = mesh.x[along(sides_of(mesh.kind, mesh.cells))]
    axes.add_collection(LineCollection(sides, colors="0.5", linewidths=0.3, zorder=1))
    for k, name in enumerate(mesh.facet_sets):
        own = mesh.facets_of(name)
        above = 3 - len(own) / len(mesh.facets)
        style = {"colors": [colours(k % 10)], "linewidths": 2.0, "zorder": above}
        edges = LineCollection(mesh.x[along(own)], label=name, **style)
        axes.add_collection(edges)
    for k, (name, nodes) in enumerate(mesh.point_sets.items(), len(mesh.facet_sets)):
        axes.plot(*mesh.x[nodes].T, ".", color=colours(k % 10), label=name)
    axes.autoscale_view()
    axes.set_aspect("equal")
    figure.legend(loc="outside right upper")
    return save_figure(figure, target)


def _draw_solids(mesh: MeshArrays, target: Path) -> Path:
    """The boundary of bodies in space, with the facets of named sets, each set in a colour with its
    name in its middle."""
    from matplotlib import colormaps

    figure = new_figure(9.0, 8.0)
    axes = figure.add_subplot(projection="3d", computed_zorder=False)
    faint = {"alpha": 0.25, "shade": False}
    outer, _ = outer_sides(mesh.kind, mesh.cells)
    axes.plot_trisurf(*mesh.x.T, triangles=_triangles(mesh, outer), color="0.9", **faint)
    for k, name in enumerate(mesh.facet_sets):
        facets = mesh.facets_of(name)
        if len(facets):
            colour = colormaps["tab10"](k % 10)
            triangles = _triangles(mesh, facets)
            axes.plot_trisurf(*mesh.x.T, triangles=triangles, color=colour, **faint)
            middle = mesh.x[triangles].mean(axis=(0, 1))
            axes.text(*middle, name, zorder=3)
    axes.set_aspect("equal")
    return save_figure(figure, target)


def _triangles(mesh: MeshArrays, facets: Ints) -> Ints:
    """Nodes ``(k, 3)`` of the triangles that facets in space are, or are cut into."""
    corners = corners_of(mesh.kind, facets)
    if corners.shape[1] == 3:
        return corners
    return np.concatenate([corners[:, [0, 1, 2]], corners[:, [3, 2, 1]]])

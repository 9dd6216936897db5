"""A mesh for people: its cells, named sets and circles as text, and a picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from archord.geometry.basis import TRIANGLE
from archord.geometry.curve import Curve, circle_through
from archord.geometry.meshes.cells import along, n_sides, sides_between, sides_of
from archord.geometry.meshes.check import cracks, parts
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.quality import distorted, measures
from archord.postprocess.pictures.pictures import save_figure
from archord.report.figure import new_figure
from archord.report.table import Table


def mesh_text(name: str, mesh: MeshArrays) -> str:
    """What is in ``mesh``, in tables with a row a set; warnings come last."""
    area = measures(mesh)
    width, height = np.ptp(mesh.x, axis=0)
    left, low = mesh.x.min(axis=0)
    kind = f"{mesh.kind.name}s of order {mesh.order}"
    extent = f"{width:g} by {height:g} from ({left:g}, {low:g})"
    head = f"{name}: {len(mesh.cells)} {kind}, {len(mesh.x)} nodes, {extent}"
    cells = {name: np.isin(mesh.bodies, tags) for name, tags in mesh.cell_sets.items()}
    bodies = Table("cell set", "cells", "area", "parts", left=1)
    for name, inside in cells.items():
        n_parts = parts(mesh.kind, mesh.cells[inside]).max(initial=-1) + 1
        bodies.add(name, inside.sum(), f"{area[inside].sum():.6g}", n_parts)
    facets = Table("facet set", "of", "circle", "facets", "length", "shortest", "longest", left=3)
    for name, tags in mesh.facet_sets.items():
        facets.add(name, *_facet_row(mesh, mesh.facets[np.isin(mesh.tags, tags)], cells))
    points = Table("point set", "nodes", left=1)
    for name, nodes in mesh.point_sets.items():
        points.add(name, len(nodes))
    doubts = [*mesh.notes, *distorted(mesh)]
    for name, inside in cells.items():
        doubts += cracks(mesh, name, inside)
    parts_of_text = [head]
    parts_of_text += [str(table) for table in (bodies, facets, points) if table.rows]
    if doubts:
        parts_of_text.append("\n".join(f"warning: {said}" for said in doubts))
    return "\n\n".join(parts_of_text)


def _facet_row(
    mesh: MeshArrays, edges: np.ndarray, cells: Mapping[str, np.ndarray]
) -> list[object]:
    """Owners, circle, number, length, shortest and longest of the ``edges`` of a set."""
    nodes, count = np.unique(edges[:, :2], return_counts=True)
    behind = sides_between(mesh.kind, mesh.cells, edges[:, :2]) // n_sides(mesh.kind)
    owners = ", ".join(name for name, inside in cells.items() if inside[behind].any())
    ends = Curve(mesh.x, edges.shape[1] - 1, along(edges)).arc_length(np.array([0.0, 1.0]))
    length = np.diff(ends)[:, 0]
    said = []
    circle = circle_through(mesh.x[nodes]) if len(nodes) else None
    if circle is not None:
        centre, radius = circle
        x, y = centre.round(9) + 0.0
        said.append(f"({x:.5g}, {y:.5g}) R {radius:.8g}")
        if edges.shape[1] == 2:
            said.append(f"sagitta {length.max() ** 2 / (8 * radius):.2g}")
    if len(nodes) and (count == 2).all():
        said.append("closed")
    sizes = [length.sum(), length.min(initial=np.inf), length.max(initial=0.0)]
    return [owners, ", ".join(said), len(edges), *(f"{value:.5g}" for value in sizes)]


def draw_mesh(mesh: MeshArrays, target: Path) -> Path:
    """The cells, facets and points of named sets, each set in a colour, small ones over large;
    returns ``target``. Raises `InputError`."""
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection, PolyCollection

    size = np.ptp(mesh.x, axis=0)
    figure = new_figure(9.0, float(np.clip(9.0 * size[1] / size[0], 3.0, 12.0)))
    axes, colours, faint = figure.add_subplot(), colormaps["tab10"], colormaps["Pastel2"]
    sides = mesh.x[along(sides_of(mesh.kind, mesh.cells))]
    around = [0, 1, 2] if mesh.kind == TRIANGLE else [0, 1, 3, 2]
    for k, (name, tags) in enumerate(mesh.cell_sets.items()):
        inside = mesh.x[mesh.cells[np.isin(mesh.bodies, tags)]][:, around]
        axes.add_collection(
            PolyCollection(inside, facecolors=[faint(k % 8)], label=name, zorder=-len(inside))
        )
    axes.add_collection(LineCollection(sides, colors="0.5", linewidths=0.3, zorder=1))
    for k, (name, tags) in enumerate(mesh.facet_sets.items()):
        edges = mesh.x[along(mesh.facets[np.isin(mesh.tags, tags)])]
        above = 3 - len(edges) / len(mesh.facets)
        axes.add_collection(
            LineCollection(
                edges, colors=[colours(k % 10)], linewidths=2.0, label=name, zorder=above
            )
        )
    for k, (name, nodes) in enumerate(mesh.point_sets.items()):
        axes.plot(*mesh.x[nodes].T, ".", color=colours((k + len(mesh.facet_sets)) % 10), label=name)
    axes.autoscale_view()
    axes.set_aspect("equal")
    figure.legend(loc="outside right upper")
    return save_figure(figure, target)

"""fields.h5 and fields.xdmf: the fields of all bodies over the steps.

fields.h5 holds the arrays. fields.xdmf describes them to ParaView and pyvista, and holds none;
`archord export --vtk` makes VTKHDF files of the same arrays. Cells are curved and of second order,
whatever the degree of the elements. The nodes of mirrored cells are in the order that gives these a
positive determinant, as VTK wants it. Arrays are in the order of the mesh generator, whatever the
number of ranks.

Displacements are nodal. The others are the rows of `output.cell_fields`: means over cells, and what
is recovered at the nodes by superconvergent patches.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from pathlib import Path

import numpy as np

from archord.geometry.basis import dimension_of
from archord.geometry.meshes.cells import are_mirrored, turned
from archord.geometry.meshes.second_order import SecondOrder
from archord.geometry.patch_recovery import PatchRecovery
from archord.materials.kinematics import Ints
from archord.output.cell_fields import CELL_FIELDS, CellField, cell_means
from archord.output.files.disk import replace_file
from archord.output.files.step_file import StepFile, times
from archord.output.files.vtkhdf import in_space
from archord.output.files.xdmf import CELLS, step_grid, steps_text
from archord.solver.path.mesh_order import Arrays, MeshOrder


def collect_mesh(order: MeshOrder, at_points: bool = True) -> Arrays:
    """What does not change, on rank 0; nothing elsewhere. Collective.

    "mesh/body" ``(m,)`` of the cells; "edges/NAME" ``(k, v)`` of every named set of facets, their
    vertices as nodes of the mesh; "points/coordinates" ``(m, q, d)`` of the integration points.
    """
    found = {"mesh/body": order.bodies()}
    for name, ends in order.facet_sets().items():
        found[f"edges/{name}"] = ends
    if at_points:
        parts = order.system.bulk.at_points(order.system.equilibrium.displacement())
        found["points/coordinates"] = order.at_points(attrgetter("coordinates"), parts)
    return found


def collect_fields(
    order: MeshOrder, at_points: bool = True, own: Sequence[CellField] = ()
) -> Arrays:
    """The last accepted state of the whole mesh by name, on rank 0; nothing elsewhere. Collective.

    "displacement" ``(n, d)`` of the nodes. Means of the cells by the rows of `CELL_FIELDS` and the
    user's ``own``: scalars ``(m,)``, and tensors "cells/NAME" ``(m, 4)``, in space ``(m, 6)``. With
    ``at_points`` also those values at the integration points that are recovered at nodes,
    "points/NAME" ``(m, q, ...)``.
    """
    system = order.system
    u = system.equilibrium.displacement()
    parts = list(system.bulk.at_points(u))
    found = {"displacement": order.collect(u)}
    written = [row for row in CELL_FIELDS if system.bulk.plastic or not row.of_yielding]
    for name, values in cell_means(system, parts, [*written, *own]).items():
        found[name if values.ndim == 1 else f"cells/{name}"] = order.cells(values)
    for row in written:
        if row.nodal and at_points:
            found[f"points/{row.name}"] = order.at_points(row.values, parts)
    return found


class FieldWriter:
    """Writes ``folder``/fields.h5 (a `StepFile`) and fields.xdmf on rank 0; goes on ``after`` some
    steps that are there.

    ``mesh`` is what `collect_mesh` returned. Integration points, if it has them, give nodal fields,
    and are themselves kept with ``points``. Raises `OSError`, and `InputError` if the files that
    should go on are not this run's.
    """

    def __init__(
        self,
        folder: Path,
        order: MeshOrder,
        mesh: Arrays,
        after: int = 0,
        *,
        points: bool = False,
    ) -> None:
        self.path = folder / "fields.xdmf"
        self._keeps_points = points
        self._components = order.system.problem.kinematics.names
        self._second = second = SecondOrder(order.kind, order.nodes_of_cell)
        _, in_vtk_order = CELLS[second.cells.shape[1]]
        x = second(order.coordinates)
        corners = second.cells[:, : second.corners]
        d = dimension_of(order.kind)
        are_inside_out = are_mirrored(order.kind, x[corners, :d])
        cells = turned(order.kind, 2, second.cells, are_inside_out)[:, in_vtk_order]
        self._n_nodes = len(x)
        self._cells_shape = (len(cells), cells.shape[1])
        self._grids: list[str] = []  # of the steps so far, as fields.xdmf has them
        self._recovery = None
        if "points/coordinates" in mesh:
            places = mesh["points/coordinates"]
            degree = order.system.problem.degree
            nodes = x[:, : places.shape[-1]]
            self._recovery = PatchRecovery(
                order.kind, nodes, corners, second.between, places, degree
            )
        fixed = {"mesh/coordinates": x, "mesh/cells": cells}
        for name, values in mesh.items():
            if name.startswith("edges/"):
                fixed[name] = self._in_vtk_order(second.sides(values))
            elif points or not name.startswith("points/"):
                fixed[name] = values
        self._file = StepFile(folder / "fields.h5", fixed, after, apart=True)

    def write(self, load: float, fields: Arrays) -> None:
        """Add a step, reached at ``load``, with what `collect_fields` returned. Raises
        `OSError`."""
        displacement = self._second(fields["displacement"])
        arrays = {"displacement": in_space(displacement)}
        at_points = {name: v for name, v in fields.items() if name.startswith("points/")}
        of_nodes = self._at_nodes(at_points)
        arrays |= of_nodes
        for name, values in fields.items():
            if name != "displacement" and (self._keeps_points or name not in at_points):
                arrays[name] = values
        self._file.write(load, arrays)
        of_cells = [name for name in fields if "/" not in name and name != "displacement"]
        self._write_xdmf(list(of_nodes), of_cells)

    def _in_vtk_order(self, sides: Ints) -> Ints:
        """Nodes ``(k, b)`` of faces in VTK's order, from basix'; edges as they are."""
        if sides.shape[1] not in CELLS:
            return sides
        return sides[:, CELLS[sides.shape[1]][1]]

    def _at_nodes(self, at_points: Arrays) -> Arrays:
        """Nodal ``(n,)`` components of tensors, as "stress_xx", and scalars, as "peeq_nodal", from
        values ``(m, q, ...)`` at the integration points."""
        if self._recovery is None:
            return {}
        values = [v.reshape(*v.shape[:2], -1) for v in at_points.values()]
        recovered = self._recovery(np.concatenate(values, axis=2))
        found = {}
        column = 0
        for row in CELL_FIELDS:
            of_points = at_points.get(f"points/{row.name}")
            if of_points is None:
                continue
            endings = ["nodal"] if of_points.ndim == 2 else self._components
            for ending in endings:
                found[f"{row.name}_{ending}"] = np.maximum(recovered[:, column], row.least)
                column += 1
        return found

    def _write_xdmf(self, of_nodes: list[str], of_cells: list[str]) -> None:
        """Describe the fields of nodes and cells of all steps, steps of an earlier process
        included."""
        for there in self._file.names[len(self._grids) :]:
            nodal = [name for name in of_nodes if name in there]
            means = [name for name in of_cells if name in there]
            step = len(self._grids) + 1
            self._grids.append(step_grid(self._n_nodes, self._cells_shape, step, nodal, means))
        replace_file(self.path, steps_text(times(self._file.loads), self._grids))

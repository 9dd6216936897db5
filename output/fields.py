"""fields.vtkhdf, fields.xdmf and fields.h5: the fields of all bodies over the steps, for ParaView
and pyvista.

Displacements are nodal; so are the components of stress and plastic strain, and PEEQ, by
superconvergent patch recovery. Stress measures, PEEQ and the contact are means over cells. XDMF and
fields.h5 have curved second-order cells, whatever the degree of the elements. The arrays are in the
order of the mesh generator, whatever the number of ranks.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.meshes.second_order import SecondOrder
from archord.geometry.patch_recovery import PatchRecovery
from archord.materials.material import COMPONENTS
from archord.output.files.disk import replace_file
from archord.output.files.step_file import StepFile, step_name
from archord.output.files.vtkhdf import VtkHdf, times
from archord.output.vtk_grid import BodyGrid
from archord.solver.contact.pair import Pair
from archord.solver.path.mesh_order import Arrays, MeshOrder

# By nodes: XDMF's name of second-order cells, and VTK's order of nodes, which counts both corners
# and edges all around
_IN_FILES = {
    6: ("Triangle_6", [0, 1, 2, 5, 3, 4]),
    9: ("Quadrilateral_9", [0, 1, 3, 2, 4, 6, 7, 5, 8]),
}


def collect_mesh(order: MeshOrder, at_points: bool = True) -> Arrays:
    """What does not change: "mesh/body" ``(m,)`` of the cells; "edges/NAME" ``(k, 2)`` of every
    named set of facets, their vertices as nodes of the mesh; "facets/nodes", the
    `MeshOrder.contact_facets`; and "points/coordinates" ``(m, q, 2)`` of the integration points. On
    rank 0, nothing elsewhere. Collective."""
    found = {"mesh/body": order.bodies(), "facets/nodes": order.contact_facets()}
    found |= {f"edges/{name}": ends for name, ends in order.facet_sets().items()}
    if at_points:
        parts = order.system.bulk.at_points(order.system.equilibrium.displacement())
        found["points/coordinates"] = order.at_points("coordinates", parts)
    return found


def collect_fields(order: MeshOrder, at_points: bool = True) -> Arrays:
    """Displacements of the nodes ``(n, 2)`` and means of the cells ``(m,)`` at the last accepted
    state, by name: of the whole mesh on rank 0, nothing elsewhere. Of tensors they are "cells/NAME"
    ``(m, 4)``; "facets/pressure" ``(k, a, 2)`` are force and length of the nodes of contact facets.
    With ``at_points`` also "points/stress" ``(m, q, 4)`` of integration points and, where a body
    can yield, "points/plastic_strain" and "points/peeq" ``(m, q)``. Collective."""
    system = order.system
    u = system.equilibrium.displacement()
    parts = list(system.bulk.at_points(u))
    values = system.bulk.cell_fields(parts)
    width, share, pressure = np.zeros((3, order.n_cells))
    for pair in system.contact.pairs:
        w, cells = pair.surface.weight, pair.surface.cells
        for whole, of_points in (
            (width, w),
            (share, w * (pair.pressure > 0)),
            (pressure, w * pair.pressure),
        ):
            np.add.at(whole, cells, of_points.sum(axis=1))
    width[width == 0] = 1.0
    values |= {"contact_state": share / width, "contact_pressure": pressure / width}
    found = {
        "displacement": order.collect(u),
        "facets/pressure": order.on_facets(_force_and_length),
    }
    found |= {
        name if v.ndim == 1 else f"cells/{name}": order.cells(v) for name, v in values.items()
    }
    names = (
        ("stress", *(("plastic_strain", "peeq") if system.bulk.plastic else ()))
        if at_points
        else ()
    )
    return found | {f"points/{name}": order.at_points(name, parts) for name in names}


def _force_and_length(pair: Pair) -> Array:
    weights = pair.surface.weight * np.stack([pair.pressure, np.ones_like(pair.pressure)])
    return np.einsum("knq,nqa->nak", weights, pair.surface.trace_shape)


class FieldWriter:
    """Writes ``folder``/fields.vtkhdf (`VtkHdf`), .h5 (`StepFile`) and .xdmf on rank 0, with room
    for ``total`` steps; goes on ``after`` some that are there. Runs of older versions have no
    fields.vtkhdf, and get none.

    ``mesh`` is what `collect_mesh` returned; the integration points, if it has them, give nodal
    fields, and are themselves kept with ``points``. Raises `OSError`, and `InputError` if the files
    that should go on are not this run's.
    """

    def __init__(
        self,
        folder: Path,
        order: MeshOrder,
        mesh: Arrays,
        total: int,
        after: int = 0,
        *,
        points: bool = False,
    ) -> None:
        self.path, self._points = folder / "fields.xdmf", points
        nodes, self._recovery = SecondOrder(order.kind, order.nodes_of_cell), None
        self._nodes, x = nodes, nodes(order.coordinates)
        self._topology, vtk = _IN_FILES[nodes.cells.shape[1]]
        cells = nodes.cells[:, vtk]
        self._sizes, self._grids = (len(x), *cells.shape), list[str]()
        shown, self._vtk = BodyGrid(order, mesh, nodes.cells, points), None
        if after == 0 or (folder / "fields.vtkhdf").exists():
            self._vtk = VtkHdf(folder / "fields.vtkhdf", shown.grid, total)
        self._vtk_values = shown.values
        fixed = {
            name: nodes.along(values) if name.startswith("edges/") else values
            for name, values in mesh.items()
        }
        del fixed["facets/nodes"]
        if "points/coordinates" in mesh:
            places, degree = mesh["points/coordinates"], order.system.problem.degree
            self._recovery = PatchRecovery(
                x[:, :2], cells[:, : nodes.corners], nodes.between, places, degree
            )
            if not points:
                del fixed["points/coordinates"]
        fixed |= {"mesh/coordinates": x, "mesh/cells": cells}
        self._file = StepFile(folder / "fields.h5", fixed, after, apart=True)

    def write(self, load: float, fields: Arrays) -> None:
        """Add a step, reached at ``load``, with what `collect_fields` returned. Raises
        `OSError`."""
        nodal = self._recovered(
            {name: values for name, values in fields.items() if name.startswith("points/")}
        )
        cells = {
            name: values
            for name, values in fields.items()
            if "/" not in name and name != "displacement"
        }
        kept = {
            name: values
            for name, values in fields.items()
            if self._points and name.startswith("points/")
        }
        of_nodes = {
            f"{name}_{c}": v[:, k]
            for name, v in nodal.items()
            if v.ndim == 2
            for k, c in enumerate(COMPONENTS)
        }
        of_nodes |= {"peeq_nodal": nodal["peeq"]} if "peeq" in nodal else {}
        displacement = {
            "displacement": np.pad(self._nodes(fields["displacement"]), ((0, 0), (0, 1)))
        }
        self._file.write(load, cells | of_nodes | displacement | kept)
        now = times(self._file.loads)
        if self._vtk:
            self._vtk.write(now, self._vtk_values(fields, nodal))
        self._write_xdmf(now, list(of_nodes), list(cells))

    def _write_xdmf(self, now: list[float], of_nodes: list[str], of_cells: list[str]) -> None:
        """Name the fields of nodes and cells of all steps, whose times are ``now`` these."""
        for there in self._file.names[len(self._grids) :]:
            shown = ([name for name in names if name in there] for names in (of_nodes, of_cells))
            self._grids.append(self._grid(len(self._grids) + 1, *shown))
        text = '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
        text += '<Grid Name="joint" GridType="Collection" CollectionType="Temporal">\n'
        for step, (time, grid) in enumerate(zip(now, self._grids, strict=True), 1):
            text += (
                f'<Grid Name="step {step}" GridType="Uniform">\n<Time Value="{time!r}"/>\n{grid}'
            )
        replace_file(self.path, f"{text}</Grid>\n</Domain>\n</Xdmf>\n")

    def end(self) -> None:
        """Give up the room of steps that never came."""
        if self._vtk:
            self._vtk.end()

    def _recovered(self, at_points: Arrays) -> Arrays:
        """Nodal "stress" and "plastic_strain" ``(n, 4)`` and "peeq" ``(n,)`` from values ``(m, q,
        ...)`` at the integration points."""
        if self._recovery is None:
            return {}
        values = list(at_points.values())
        whole = self._recovery(
            np.concatenate([v.reshape(*v.shape[:2], -1) for v in values], axis=2)
        )
        names = [name.removeprefix("points/") for name in at_points]
        nodal = dict(zip(names, np.split(whole, [4, 8], axis=1), strict=False))
        if "peeq" in nodal:
            nodal["peeq"] = np.maximum(
                nodal["peeq"][:, 0], 0.0
            )  # the polynomials swing below where none yields
        return nodal

    def _grid(self, step: int, of_nodes: list[str], of_cells: list[str]) -> str:
        n_nodes, n_cells, of_cell = self._sizes
        nodal, body = (
            _data(f"{n_nodes} 3", step, "displacement"),
            _data(f"{n_cells}", 0, "mesh/body", "Int", 4),
        )
        cells = _data(f"{n_cells} {of_cell}", 0, "mesh/cells", "Int")
        shown = [("displacement", "Vector", "Node", nodal)]
        shown += [(name, "Scalar", "Node", _data(f"{n_nodes}", step, name)) for name in of_nodes]
        shown += [(name, "Scalar", "Cell", _data(f"{n_cells}", step, name)) for name in of_cells]
        lines = [
            f'<Topology TopologyType="{self._topology}" NumberOfElements="{n_cells}">{cells}</Topology>',
            f'<Geometry GeometryType="XYZ">{_data(f"{n_nodes} 3", 0, "mesh/coordinates")}</Geometry>',
        ]
        for name, kind, centre, data in [*shown, ("body", "Scalar", "Cell", body)]:
            lines.append(
                f'<Attribute Name="{name}" AttributeType="{kind}" Center="{centre}">{data}</Attribute>'
            )
        return "\n".join([*lines, "</Grid>\n"])


def _data(shape: str, step: int, name: str, kind: str = "Float", precision: int = 8) -> str:
    attributes = f'Dimensions="{shape}" NumberType="{kind}" Precision="{precision}" Format="HDF"'
    return f"<DataItem {attributes}>fields/{step_name(step)}.h5:/{name}</DataItem>"

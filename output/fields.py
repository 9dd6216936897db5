"""fields.xdmf and fields.h5: the fields of all bodies over the steps, for ParaView and pyvista.

Displacements are nodal on curved second-order cells, whatever the degree of the elements; stress measures, PEEQ and
the contact are means over cells. The arrays are in the order of the mesh generator, whatever the number of ranks.
"""

from __future__ import annotations

from pathlib import Path

import basix
import numpy as np

from archord.geometry.basis import TRIANGLE, Array, cell_kind, tabulate
from archord.geometry.curve import lagrange
from archord.geometry.meshes.plane_mesh import distinct_edges
from archord.output.disk import replace_file
from archord.output.step_file import StepFile, step_name
from archord.solver.mesh_order import MeshOrder

# By nodes: XDMF's name of second-order cells, and VTK's order of nodes, which counts both corners and edges all around
_IN_FILES = {6: ("Triangle_6", [0, 1, 2, 5, 3, 4]), 9: ("Quadrilateral_9", [0, 1, 3, 2, 4, 6, 7, 5, 8])}


def collect_fields(order: MeshOrder) -> dict[str, Array]:
    """Displacements of the nodes ``(n, 2)`` and values ``(m,)`` of the cells at the last accepted state, by name: of
    the whole mesh on rank 0, nothing elsewhere. Collective."""
    system = order.system
    u = system.equilibrium.displacement()
    values = system.bulk.cell_fields(u)
    width, share, pressure = np.zeros((3, order.n_cells))
    for pair in system.contact.pairs:
        w, cells = pair.surface.weight, pair.surface.cells
        for whole, at_points in (width, w), (share, w * (pair.pressure > 0)), (pressure, w * pair.pressure):
            np.add.at(whole, cells, at_points.sum(axis=1))
    width[width == 0] = 1.0
    values |= {"contact_state": share / width, "contact_pressure": pressure / width}
    return {"displacement": order.collect(u)} | {name: order.cells(value) for name, value in values.items()}


class FieldWriter:
    """Writes ``folder``/fields.xdmf and .h5 (see `StepFile`) on rank 0; goes on ``after`` some steps that are there.

    ``bodies`` are as `MeshOrder.bodies` returns them. Times are the steps' loads, or with ``numbered`` their numbers.
    Raises `OSError`, and `InputError` if the files that should go on are not this run's.
    """

    def __init__(self, folder: Path, order: MeshOrder, bodies: np.ndarray, after: int, numbered: bool) -> None:
        self.path, self._numbered = folder / "fields.xdmf", numbered
        self._nodes = SecondOrder(order.nodes_of_cell)
        self._topology, vtk = _IN_FILES[self._nodes.cells.shape[1]]
        cells, points = self._nodes.cells[:, vtk], self._nodes(order.coordinates)
        self._sizes, self._grids = (len(points), *cells.shape), list[str]()
        fixed = {"mesh/coordinates": points, "mesh/cells": cells, "mesh/body": bodies}
        self._file = StepFile(folder / "fields.h5", fixed, after, apart=True)

    def write(self, load: float, fields: dict[str, Array]) -> None:
        """Add a step, reached at ``load``, with what `collect_fields` returned. Raises `OSError`."""
        displacement = np.pad(self._nodes(fields["displacement"]), ((0, 0), (0, 1)))
        self._file.write(load, fields | {"displacement": displacement})
        of_cells = [name for name in fields if name != "displacement"]
        for step, load in enumerate(self._file.loads[len(self._grids) :], start=len(self._grids) + 1):
            self._grids.append(self._grid(step, float(step if self._numbered else load), of_cells))
        head = '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
        collection = '<Grid Name="joint" GridType="Collection" CollectionType="Temporal">\n'
        replace_file(self.path, head + collection + "".join(self._grids) + "</Grid>\n</Domain>\n</Xdmf>\n")

    def _grid(self, step: int, time: float, of_cells: list[str]) -> str:
        n_nodes, n_cells, of_cell = self._sizes
        nodal, body = _data(f"{n_nodes} 3", step, "displacement"), _data(f"{n_cells}", 0, "mesh/body", "Char", 1)
        cells = _data(f"{n_cells} {of_cell}", 0, "mesh/cells", "Int")
        lines = [
            f'<Grid Name="step {step}" GridType="Uniform">\n<Time Value="{time!r}"/>',
            f'<Topology TopologyType="{self._topology}" NumberOfElements="{n_cells}">{cells}</Topology>',
            f'<Geometry GeometryType="XYZ">{_data(f"{n_nodes} 3", 0, "mesh/coordinates")}</Geometry>',
            f'<Attribute Name="displacement" AttributeType="Vector" Center="Node">{nodal}</Attribute>',
        ]
        for name, data in [*((name, _data(f"{n_cells}", step, name)) for name in of_cells), ("body", body)]:
            lines.append(f'<Attribute Name="{name}" AttributeType="Scalar" Center="Cell">{data}</Attribute>')
        return "\n".join([*lines, "</Grid>\n"])


def _data(shape: str, step: int, name: str, kind: str = "Float", precision: int = 8) -> str:
    attributes = f'Dimensions="{shape}" NumberType="{kind}" Precision="{precision}" Format="HDF"'
    return f"<DataItem {attributes}>fields/{step_name(step)}.h5:/{name}</DataItem>"


class SecondOrder:
    """Second-order cells, the highest that XDMF and its readers know, in the place of cells with nodes
    ``nodes_of_cell`` ``(n, a)``.

    ``cells`` ``(n, 6)`` or ``(n, 9)`` are their nodes: vertices, then the middles of the edges, and of quadrilaterals,
    in basix' order.
    """

    def __init__(self, nodes_of_cell: np.ndarray) -> None:
        kind, degree = cell_kind(nodes_of_cell.shape[1])
        n, k = len(nodes_of_cell), len(basix.topology(kind)[0])  # as many vertices as edges
        self._vertices, index = np.unique(nodes_of_cell[:, :k], return_inverse=True)
        inner = np.split(nodes_of_cell[:, k : k * degree], k, axis=1)  # nodes within the edges
        ends = [nodes_of_cell[:, edge] for edge in basix.topology(kind)[1]]
        edges = np.concatenate([np.hstack(pair) for pair in zip(ends, inner, strict=True)])
        first, of_edge = distinct_edges(edges[:, :2])
        self._edges, before = edges[first], len(self._vertices)
        self.cells = np.hstack([index.reshape(-1, k), before + of_edge.reshape(k, -1).T])
        self._whole = nodes_of_cell[: 0 if kind == TRIANGLE else n]  # of cells with a middle
        if len(self._whole):
            self.cells = np.column_stack([self.cells, before + len(first) + np.arange(n)])
        self._at_middle = tabulate(kind, degree, np.array([[0.5, 0.5]]))[0, 0]
        weights = lagrange(degree) @ 0.5 ** np.arange(degree + 1)  # of equispaced nodes, at the middle
        self._weights = weights[[0, degree, *range(1, degree)]]

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order cells, from those at the nodes of the cells."""
        middles = np.einsum("a,eak->ek", self._weights, values[self._edges])
        within = np.einsum("a,nak->nk", self._at_middle, values[self._whole])
        return np.concatenate([values[self._vertices], middles, within])

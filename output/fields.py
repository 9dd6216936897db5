"""fields.xdmf and fields.h5: the fields of all bodies over the steps, for ParaView and pyvista.

Displacements are nodal on curved second-order triangles, whatever the degree of the elements; stress measures, PEEQ and
the contact are means over cells. The arrays are in the order of the mesh generator, whatever the number of ranks.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import lagrange
from archord.geometry.meshes.plane_mesh import distinct_edges
from archord.output.disk import replace_file
from archord.output.step_file import StepFile, step_name
from archord.solver.mesh_order import MeshOrder

_EDGES = [(1, 2), (0, 2), (0, 1)]  # vertices of a cell's edges, in basix' order of its nodes
_VTK_ORDER = [0, 1, 2, 5, 3, 4]  # VTK counts edge nodes from the edge between the first two vertices


def collect_fields(order: MeshOrder) -> dict[str, Array]:
    """Displacements of the nodes ``(n, 2)`` and values ``(m,)`` of the cells at the last accepted state, by name: of
    the whole mesh on rank 0, nothing elsewhere. Collective."""
    system = order.system
    u = system.equilibrium.displacement()
    values = system.bulk.cell_fields(u)
    share, pressure = np.zeros(order.n_cells), np.zeros(order.n_cells)
    for pair in system.contact.pairs:
        side = pair.surface
        w = side.weight / side.weight.sum(axis=1, keepdims=True)
        share[side.cells] = (w * (pair.pressure > 0)).sum(axis=1)
        pressure[side.cells] = (w * pair.pressure).sum(axis=1)
    values |= {"contact_state": share, "contact_pressure": pressure}
    return {"displacement": order.collect(u)} | {name: order.cells(value) for name, value in values.items()}


class FieldWriter:
    """Writes ``folder``/fields.xdmf and .h5 (see `StepFile`) on rank 0; goes on ``after`` some steps that are there.

    ``bodies`` are as `MeshOrder.bodies` returns them. Times are the steps' loads, or with ``numbered`` their numbers.
    Raises `OSError`, and `InputError` if the files that should go on are not this run's.
    """

    def __init__(self, folder: Path, order: MeshOrder, bodies: np.ndarray, after: int, numbered: bool) -> None:
        self.path, self._numbered = folder / "fields.xdmf", numbered
        self._nodes = SecondOrder(order.nodes_of_cell, order.system.problem.degree)
        cells, points = self._nodes.cells[:, _VTK_ORDER], self._nodes(order.coordinates)
        self._sizes, self._grids = (len(points), len(cells)), list[str]()
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
        n_nodes, n_cells = self._sizes
        nodal, body = _data(f"{n_nodes} 3", step, "displacement"), _data(f"{n_cells}", 0, "mesh/body", "Char", 1)
        cells = _data(f"{n_cells} 6", 0, "mesh/cells", "Int")
        lines = [
            f'<Grid Name="step {step}" GridType="Uniform">\n<Time Value="{time!r}"/>',
            f'<Topology TopologyType="Triangle_6" NumberOfElements="{n_cells}">{cells}</Topology>',
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
    """Second-order triangles, the highest that XDMF and its readers know, in the place of cells with nodes
    ``nodes_of_cell`` ``(n, a)`` of the given ``degree``.

    ``cells`` ``(n, 6)`` are their nodes: vertices, then the middles of the edges in basix' order.
    """

    def __init__(self, nodes_of_cell: np.ndarray, degree: int) -> None:
        self._vertices, index = np.unique(nodes_of_cell[:, :3], return_inverse=True)
        inner = np.split(nodes_of_cell[:, 3 : 3 * degree], 3, axis=1)  # nodes within the edges
        ends = [nodes_of_cell[:, edge] for edge in _EDGES]
        edges = np.concatenate([np.hstack(pair) for pair in zip(ends, inner, strict=True)])
        first, of_edge = distinct_edges(edges[:, :2])
        self._edges = edges[first]
        self.cells = np.hstack([index.reshape(-1, 3), len(self._vertices) + of_edge.reshape(3, -1).T])
        weights = lagrange(degree) @ 0.5 ** np.arange(degree + 1)  # of equispaced nodes, at the middle
        self._weights = weights[[0, degree, *range(1, degree)]]

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order triangles, from those at the nodes of the cells."""
        middles = np.einsum("a,eak->ek", self._weights, values[self._edges])
        return np.concatenate([values[self._vertices], middles])

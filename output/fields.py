"""fields.xdmf and fields.h5: the fields of all bodies over the steps, for ParaView and pyvista. debug.xdmf and .h5:
the last state that a solve without success tried, with its residual forces and increments of PEEQ.

Displacements are nodal on curved second-order triangles, whatever the degree of the elements; stress measures, PEEQ and
the contact are means over cells. The arrays are in the order of the mesh generator, whatever the number of ranks. Rank
0 writes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import lagrange
from archord.geometry.plane_mesh import distinct_edges
from archord.output.disk import replace_file
from archord.output.ranks import agreed
from archord.output.step_file import StepFile
from archord.solver.mesh_order import MeshOrder

_EDGES = [(1, 2), (0, 2), (0, 1)]  # vertices of a cell's edges, in basix' order of its nodes
_VTK_ORDER = [0, 1, 2, 5, 3, 4]  # VTK counts edge nodes from the edge between the first two vertices


class FieldWriter:
    """Writes ``folder``/fields.xdmf and .h5 (see `StepFile`); goes on ``after`` some steps that are there.

    Times are the steps' loads, or with ``numbered`` their numbers. With ``debug`` the files are debug.xdmf and .h5, and
    hold what tells why a solve fails. Collective. Raises `WriteError`, and `InputError` if the files that should go on
    are not this run's.
    """

    def __init__(
        self, folder: Path, order: MeshOrder, *, after: int = 0, numbered: bool = False, debug: bool = False
    ) -> None:
        system = order.system
        self.order, self._numbered = order, numbered
        self.path = folder / ("debug.xdmf" if debug else "fields.xdmf")
        self.nodal = ["displacement", "residual"] if debug else ["displacement"]
        body_of = order.bodies()
        self.names = ["von_mises", "mean_stress", "contact_state", "contact_pressure"]
        if system.bulk.plastic:
            self.names[1:1] = ["peeq", "peeq_increment"] if debug else ["peeq"]

        def make() -> None:
            self._nodes = SecondOrder(order.nodes_of_cell, system.problem.degree)
            cells, points = self._nodes.cells[:, _VTK_ORDER], self._nodes(order.coordinates)
            self._n_nodes, self._n_cells = len(points), len(cells)
            fixed = {"mesh/coordinates": points, "mesh/cells": cells, "mesh/body": body_of}
            names = [*self.names, *self.nodal]
            self._file = StepFile(self.path.with_suffix(".h5"), fixed, names, after=after, apart=not debug)
            if not after:
                self._write_xdmf()

        agreed(system.comm, make, asleep=False)

    def write(self, load: float) -> None:
        """Add the last accepted state as a step, reached at ``load``. Collective. Raises `WriteError`."""
        system = self.order.system
        u = system.equilibrium.displacement()
        values = system.bulk.cell_fields(u)
        values["contact_state"], values["contact_pressure"] = self._contact_on_cells()
        arrays = {name: self.order.cells(values[name]) for name in self.names}
        on_nodes = {"displacement": u, "residual": system.equilibrium.residual()}
        nodal = {name: self.order.collect(on_nodes[name]) for name in self.nodal}

        def write() -> None:
            vectors = {k: np.pad(self._nodes(v), ((0, 0), (0, 1))) for k, v in nodal.items()}
            self._file.write(load, arrays | vectors)
            self._write_xdmf()

        agreed(system.comm, write, asleep=False)

    def _contact_on_cells(self) -> tuple[Array, Array]:
        """Share of each cell's contact facet in contact, and the mean pressure on it; zero elsewhere."""
        share, pressure = np.zeros(self.order.n_cells), np.zeros(self.order.n_cells)
        contact = self.order.system.contact
        for pair in contact.pairs if contact else ():
            side = pair.surface
            w = side.weight / side.weight.sum(axis=1, keepdims=True)
            share[side.cells] = (w * (pair.pressure > 0)).sum(axis=1)
            pressure[side.cells] = (w * pair.pressure).sum(axis=1)
        return share, pressure

    def _write_xdmf(self) -> None:
        loads = enumerate(self._file.loads, start=1)
        grids = [self._grid(k, float(k if self._numbered else load)) for k, load in loads]
        text = (
            '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
            '<Grid Name="joint" GridType="Collection" CollectionType="Temporal">\n'
            + "".join(grids)
            + "</Grid>\n</Domain>\n</Xdmf>\n"
        )
        replace_file(self.path, text)

    def _grid(self, step: int, time: float) -> str:
        file, nodes, cells = self._file, f"{self._n_nodes} 3", f"{self._n_cells}"
        nodal = "".join(_attribute(n, "Vector", "Node", _data(nodes, file.place(n, step))) for n in self.nodal)
        cell = "".join(_attribute(n, "Scalar", "Cell", _data(cells, file.place(n, step))) for n in self.names)
        return (
            f'<Grid Name="step {step}" GridType="Uniform">\n<Time Value="{time!r}"/>\n'
            f'<Topology TopologyType="Triangle_6" NumberOfElements="{cells}">'
            f"{_data(f'{cells} 6', file.place('mesh/cells'), 'Int')}</Topology>\n"
            f'<Geometry GeometryType="XYZ">{_data(nodes, file.place("mesh/coordinates"))}</Geometry>\n'
            + nodal
            + cell
            + _attribute("body", "Scalar", "Cell", _data(cells, file.place("mesh/body"), "Char", 1))
            + "</Grid>\n"
        )


def _attribute(name: str, rank: str, centre: str, data: str) -> str:
    return f'<Attribute Name="{name}" AttributeType="{rank}" Center="{centre}">{data}</Attribute>\n'


def _data(dimensions: str, place: str, kind: str = "Float", precision: int = 8) -> str:
    return (
        f'<DataItem Dimensions="{dimensions}" NumberType="{kind}" Precision="{precision}" Format="HDF">'
        f"{place}</DataItem>"
    )


class SecondOrder:
    """Second-order triangles, the highest that XDMF and its readers know, in the place of cells with nodes
    ``nodes_of_cell`` ``(n, a)`` of the given ``degree``.

    ``cells`` ``(n, 6)`` are their nodes: vertices, then the middles of the edges in basix' order.
    """

    def __init__(self, nodes_of_cell: np.ndarray, degree: int) -> None:
        vertices, index = np.unique(nodes_of_cell[:, :3], return_inverse=True)
        corners = index.reshape(-1, 3)
        along = degree - 1
        edges = np.concatenate(
            [
                np.column_stack([nodes_of_cell[:, list(ends)], nodes_of_cell[:, 3 + k * along : 3 + (k + 1) * along]])
                for k, ends in enumerate(_EDGES)
            ]
        )
        first, of_edge = distinct_edges(edges[:, :2])
        middles = len(vertices) + of_edge.reshape(3, -1).T
        self.cells = np.concatenate([corners, middles], axis=1)
        self._vertices, self._edges = vertices, edges[first]
        weights = lagrange(degree) @ 0.5 ** np.arange(degree + 1)  # of equispaced nodes, at the middle
        self._weights = weights[[0, degree, *range(1, degree)]]

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order triangles, from those at the nodes of the cells."""
        middles = np.einsum("a,eak->ek", self._weights, values[self._edges])
        return np.concatenate([values[self._vertices], middles])

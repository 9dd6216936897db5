"""fields.xdmf and fields.h5: the fields of all bodies over the steps, for ParaView and pyvista.

Displacements are nodal on curved second-order cells, whatever the degree of the elements; so are the components of
stress and plastic strain, and "peeq_nodal", by superconvergent patch recovery. Stress measures, PEEQ and the contact
are means over cells. The arrays are in the order of the mesh generator, whatever the number of ranks.
"""

from __future__ import annotations

from pathlib import Path

import basix
import numpy as np

from archord.geometry.basis import TRIANGLE, Array, cell_kind, tabulate
from archord.geometry.curve import lagrange
from archord.geometry.meshes.plane_mesh import distinct_edges
from archord.geometry.patch_recovery import PatchRecovery
from archord.materials.material import COMPONENTS
from archord.output.disk import replace_file
from archord.output.step_file import StepFile, step_name
from archord.solver.mesh_order import Arrays, MeshOrder

# By nodes: XDMF's name of second-order cells, and VTK's order of nodes, which counts both corners and edges all around
_IN_FILES = {6: ("Triangle_6", [0, 1, 2, 5, 3, 4]), 9: ("Quadrilateral_9", [0, 1, 3, 2, 4, 6, 7, 5, 8])}
_NODAL = (*(f"{name}_{c}" for name in ("stress", "plastic_strain") for c in COMPONENTS), "peeq_nodal")


def collect_mesh(order: MeshOrder, at_points: bool = True) -> Arrays:
    """What does not change: "mesh/body" ``(m,)`` of the cells; "edges/NAME" ``(k, 2)`` of every named set of facets,
    their vertices as nodes of the mesh; and "points/coordinates" ``(m, q, 2)`` of the integration points. On rank 0,
    nothing elsewhere. Collective."""
    found = {"mesh/body": order.bodies()} | {f"edges/{name}": ends for name, ends in order.facet_sets().items()}
    if at_points:
        parts = order.system.bulk.at_points(order.system.equilibrium.displacement())
        found["points/coordinates"] = order.at_points("coordinates", parts)
    return found


def collect_fields(order: MeshOrder, at_points: bool = True) -> Arrays:
    """Displacements of the nodes ``(n, 2)`` and values ``(m,)`` of the cells at the last accepted state, by name: of
    the whole mesh on rank 0, nothing elsewhere. With ``at_points`` also "points/stress" ``(m, q, 4)`` of integration
    points and, where a body can yield, "points/plastic_strain" and "points/peeq" ``(m, q)``. Collective."""
    system = order.system
    u = system.equilibrium.displacement()
    parts = list(system.bulk.at_points(u))
    values = system.bulk.cell_fields(parts)
    width, share, pressure = np.zeros((3, order.n_cells))
    for pair in system.contact.pairs:
        w, cells = pair.surface.weight, pair.surface.cells
        for whole, of_points in (width, w), (share, w * (pair.pressure > 0)), (pressure, w * pair.pressure):
            np.add.at(whole, cells, of_points.sum(axis=1))
    width[width == 0] = 1.0
    values |= {"contact_state": share / width, "contact_pressure": pressure / width}
    found = {"displacement": order.collect(u)} | {name: order.cells(value) for name, value in values.items()}
    names = ("stress", *(("plastic_strain", "peeq") if system.bulk.plastic else ())) if at_points else ()
    return found | {f"points/{name}": order.at_points(name, parts) for name in names}


class FieldWriter:
    """Writes ``folder``/fields.xdmf and .h5 (see `StepFile`) on rank 0; goes on ``after`` some steps that are there.

    ``mesh`` is what `collect_mesh` returned; the integration points, if it has them, give nodal fields, and are
    themselves kept with ``points``. Times are the steps' loads, or with ``numbered`` their numbers. Raises `OSError`,
    and `InputError` if the files that should go on are not this run's.
    """

    def __init__(
        self, folder: Path, order: MeshOrder, mesh: Arrays, after: int, numbered: bool, points: bool = False
    ) -> None:
        self.path, self._numbered, self._points = folder / "fields.xdmf", numbered, points
        nodes, self._recovery = SecondOrder(order.nodes_of_cell), None
        self._nodes, x = nodes, nodes(order.coordinates)
        self._topology, vtk = _IN_FILES[nodes.cells.shape[1]]
        cells = nodes.cells[:, vtk]
        self._sizes, self._grids = (len(x), *cells.shape), list[str]()
        fixed = {name: nodes.along(values) if name.startswith("edges/") else values for name, values in mesh.items()}
        if "points/coordinates" in mesh:
            places, degree = mesh["points/coordinates"], order.system.problem.degree
            self._recovery = PatchRecovery(x[:, :2], cells[:, : nodes.corners], nodes.between, places, degree)
            if not points:
                del fixed["points/coordinates"]
        fixed |= {"mesh/coordinates": x, "mesh/cells": cells}
        self._file = StepFile(folder / "fields.h5", fixed, after, apart=True)

    def write(self, load: float, fields: Arrays) -> None:
        """Add a step, reached at ``load``, with what `collect_fields` returned. Raises `OSError`."""
        displacement = np.pad(self._nodes(fields["displacement"]), ((0, 0), (0, 1)))
        at_points = {name: values for name, values in fields.items() if name.startswith("points/")}
        cells = {name: values for name, values in fields.items() if name not in at_points and name != "displacement"}
        nodal = self._recovered(at_points)
        arrays = cells | nodal | {"displacement": displacement} | (at_points if self._points else {})
        self._file.write(load, arrays)
        for step in range(len(self._grids), len(self._file.loads)):
            there, time = self._file.names[step], step + 1 if self._numbered else self._file.loads[step]
            shown = ([name for name in names if name in there] for names in (nodal, cells))
            self._grids.append(self._grid(step + 1, float(time), *shown))
        head = '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
        collection = '<Grid Name="joint" GridType="Collection" CollectionType="Temporal">\n'
        replace_file(self.path, head + collection + "".join(self._grids) + "</Grid>\n</Domain>\n</Xdmf>\n")

    def _recovered(self, at_points: Arrays) -> Arrays:
        """Nodal fields by name from values ``(m, q, ...)`` at the integration points."""
        if self._recovery is None:
            return {}
        values = list(at_points.values())
        whole = self._recovery(np.concatenate([v.reshape(*v.shape[:2], -1) for v in values], axis=2))
        nodal = dict(zip(_NODAL, whole.T, strict=False))
        if "peeq_nodal" in nodal:
            nodal["peeq_nodal"] = np.maximum(nodal["peeq_nodal"], 0.0)  # the polynomials swing below where none yields
        return nodal

    def _grid(self, step: int, time: float, of_nodes: list[str], of_cells: list[str]) -> str:
        n_nodes, n_cells, of_cell = self._sizes
        nodal, body = _data(f"{n_nodes} 3", step, "displacement"), _data(f"{n_cells}", 0, "mesh/body", "Int", 4)
        cells = _data(f"{n_cells} {of_cell}", 0, "mesh/cells", "Int")
        shown = [("displacement", "Vector", "Node", nodal)]
        shown += [(name, "Scalar", "Node", _data(f"{n_nodes}", step, name)) for name in of_nodes]
        shown += [(name, "Scalar", "Cell", _data(f"{n_cells}", step, name)) for name in of_cells]
        lines = [
            f'<Grid Name="step {step}" GridType="Uniform">\n<Time Value="{time!r}"/>',
            f'<Topology TopologyType="{self._topology}" NumberOfElements="{n_cells}">{cells}</Topology>',
            f'<Geometry GeometryType="XYZ">{_data(f"{n_nodes} 3", 0, "mesh/coordinates")}</Geometry>',
        ]
        for name, kind, centre, data in [*shown, ("body", "Scalar", "Cell", body)]:
            lines.append(f'<Attribute Name="{name}" AttributeType="{kind}" Center="{centre}">{data}</Attribute>')
        return "\n".join([*lines, "</Grid>\n"])


def _data(shape: str, step: int, name: str, kind: str = "Float", precision: int = 8) -> str:
    attributes = f'Dimensions="{shape}" NumberType="{kind}" Precision="{precision}" Format="HDF"'
    return f"<DataItem {attributes}>fields/{step_name(step)}.h5:/{name}</DataItem>"


class SecondOrder:
    """Second-order cells, the highest that XDMF and its readers know, in the place of cells with nodes
    ``nodes_of_cell`` ``(n, a)``.

    ``cells`` ``(n, 6)`` or ``(n, 9)`` are their nodes: ``corners`` vertices, then the middles of the edges, and of
    quadrilaterals, in basix' order. The nodes behind the vertices lie between those of ``between``.
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
        self.corners, within = k, np.searchsorted(self._vertices, self._whole[:, :k])
        self.between = [np.searchsorted(self._vertices, self._edges[:, :2]), within]
        weights = lagrange(degree) @ 0.5 ** np.arange(degree + 1)  # of equispaced nodes, at the middle
        self._weights = weights[[0, degree, *range(1, degree)]]

    def __call__(self, values: Array) -> Array:
        """Values ``(m, k)`` at the nodes of the second-order cells, from those at the nodes of the cells."""
        middles = np.einsum("a,eak->ek", self._weights, values[self._edges])
        within = np.einsum("a,nak->nk", self._at_middle, values[self._whole])
        return np.concatenate([values[self._vertices], middles, within])

    def along(self, ends: np.ndarray) -> np.ndarray:
        """Nodes ``(k, 3)`` of edges with the vertices ``ends`` ``(k, 2)``: the first one, the middle, the last one."""
        n, vertices = len(self._vertices), np.searchsorted(self._vertices, ends)
        numbers, wanted = (np.sort(pair, axis=1) @ [n, 1] for pair in (self.between[0], vertices))
        order = np.argsort(numbers)
        middle = n + order[np.searchsorted(numbers, wanted, sorter=order)]
        return np.column_stack([vertices[:, 0], middle, vertices[:, 1]])

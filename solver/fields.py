"""fields.xdmf and fields.h5: the joint's fields over the steps, for ParaView and pyvista.

Displacements are nodal on the curved second-order mesh; stress measures, PEEQ and the contact are means over cells. The
arrays are in the order of the mesh generator, whatever the number of ranks. Rank 0 writes. The time is delta where a
displacement only grows, else the number of the step.
"""

from __future__ import annotations

import os
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.solver.joint import Joint
from archord.solver.step_file import StepFile, step_name

_VTK_ORDER = [0, 1, 2, 5, 3, 4]  # VTK counts edge nodes from the edge between the first two vertices


class _Gather:
    """Brings values of owned entities to rank 0, in the order of their input indices."""

    def __init__(self, comm: MPI.Comm, index: np.ndarray) -> None:
        self.comm = comm
        parts = comm.gather(index)
        if parts is not None:
            self.unique, self._slot = np.unique(np.concatenate(parts), return_inverse=True)

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """The values of all ranks on rank 0, nothing elsewhere."""
        parts = self.comm.gather(values)
        if parts is None:
            return np.zeros(0)
        whole = np.concatenate(parts)
        ordered = np.empty((len(self.unique), *whole.shape[1:]), dtype=whole.dtype)
        ordered[self._slot] = whole
        return ordered


class FieldWriter:
    """Writes ``folder``/fields.xdmf and .h5, with room for ``steps`` steps. Collective."""

    def __init__(self, folder: Path, joint: Joint, steps: int) -> None:
        self.joint, self.path = joint, folder / "fields.xdmf"
        mesh, V = joint.model.mesh, joint.V
        self._n_cells = mesh.topology.index_map(2).size_local
        # displacement dof of every mesh node of this rank: both number the six nodes of a cell alike
        dof = np.zeros(len(mesh.geometry.x), dtype=np.int64)
        dof[mesh.geometry.dofmap.ravel()] = V.dofmap.list.ravel()
        n_owned = mesh.geometry.index_map().size_local
        index = np.asarray(mesh.geometry.input_global_indices)
        self._dof = dof[:n_owned]
        self._nodes = _Gather(joint.comm, index[:n_owned])
        self._cells = _Gather(joint.comm, np.asarray(mesh.topology.original_cell_index)[: self._n_cells])
        coordinates = self._nodes(mesh.geometry.x[:n_owned])
        cells = self._cells(index[mesh.geometry.dofmap[: self._n_cells]])
        body = np.zeros(self._n_cells, dtype=np.int8)
        own = joint.model.cells.indices < self._n_cells
        body[joint.model.cells.indices[own]] = joint.model.cells.values[own]
        body_of = self._cells(body)
        self.names = ["von_mises", "mean_stress", "contact_state", "contact_pressure"]
        if joint.bulk.plastic:
            self.names.insert(1, "peeq")
        if joint.comm.rank == 0:
            self._times: list[float] = []
            cells = np.searchsorted(self._nodes.unique, cells)[:, _VTK_ORDER]
            self._shape = len(coordinates), len(cells)
            shapes: dict[str, tuple[tuple[int, ...], str]] = {name: ((len(cells),), "f8") for name in self.names}
            shapes["displacement"] = ((len(coordinates), 3), "f8")
            fixed = {"mesh/coordinates": coordinates, "mesh/cells": cells, "mesh/body": body_of}
            self._file = StepFile(folder / "fields.h5", steps, shapes, fixed)
            self._write_xdmf()

    def write(self, step: int, load: float) -> None:
        """Add the last accepted state as ``step``. Collective."""
        joint = self.joint
        u = joint.equilibrium.displacement()
        means = joint.bulk.cell_fields(u)
        values: dict[str, Array | None] = {"von_mises": means.von_mises, "mean_stress": means.mean_stress}
        if means.peeq is not None:
            values["peeq"] = means.peeq
        values["contact_state"], values["contact_pressure"] = self._contact_on_cells()
        arrays = {name: self._cells(np.asarray(values[name])) for name in self.names}
        nodal = self._nodes(u[self._dof])
        if joint.comm.rank == 0:
            arrays["displacement"] = np.pad(nodal, ((0, 0), (0, 1)))
            self._file.write(step, load, arrays)
            self._times.append(load if joint.scene.monotonic and not joint.scene.force_controlled else float(step))
            self._write_xdmf()

    def _contact_on_cells(self) -> tuple[Array, Array]:
        """Share of each cell's contact facet in contact, and the mean pressure on it; zero elsewhere."""
        share, pressure = np.zeros(self._n_cells), np.zeros(self._n_cells)
        for side in self.joint.sides.values():
            state = self.joint.contact.state(side)
            if state is not None and len(side.cells):
                w = side.weight / side.weight.sum(axis=1, keepdims=True)
                share[side.cells] = (w * (state.pressure > 0)).sum(axis=1)
                pressure[side.cells] = (w * state.pressure).sum(axis=1)
        return share, pressure

    def _write_xdmf(self) -> None:
        grids = [self._grid(k, time) for k, time in enumerate(self._times, start=1)]
        text = (
            '<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>\n'
            '<Grid Name="joint" GridType="Collection" CollectionType="Temporal">\n'
            + "".join(grids)
            + "</Grid>\n</Domain>\n</Xdmf>\n"
        )
        new = self.path.with_suffix(".xdmf.new")
        new.write_text(text, encoding="utf-8")
        os.replace(new, self.path)

    def _grid(self, step: int, time: float) -> str:
        n_nodes, n_cells = self._shape
        at = step_name(step)
        cell = "".join(_attribute(n, "Scalar", "Cell", f"{n_cells}", f"{n}/{at}") for n in self.names)
        return (
            f'<Grid Name="{escape(f"step {step}")}" GridType="Uniform">\n<Time Value="{time!r}"/>\n'
            f'<Topology TopologyType="Triangle_6" NumberOfElements="{n_cells}">'
            f"{_data(f'{n_cells} 6', 'mesh/cells', 'Int', 8)}</Topology>\n"
            f'<Geometry GeometryType="XYZ">{_data(f"{n_nodes} 3", "mesh/coordinates")}</Geometry>\n'
            + _attribute("displacement", "Vector", "Node", f"{n_nodes} 3", f"displacement/{at}")
            + cell
            + _attribute("body", "Scalar", "Cell", f"{n_cells}", "mesh/body", "Char", 1)
            + "</Grid>\n"
        )


def _attribute(
    name: str, rank: str, centre: str, dimensions: str, path: str, kind: str = "Float", precision: int = 8
) -> str:
    data = _data(dimensions, path, kind, precision)
    return f'<Attribute Name="{name}" AttributeType="{rank}" Center="{centre}">{data}</Attribute>\n'


def _data(dimensions: str, path: str, kind: str = "Float", precision: int = 8) -> str:
    return (
        f'<DataItem Dimensions="{dimensions}" NumberType="{kind}" Precision="{precision}" Format="HDF">'
        f"fields.h5:/{path}</DataItem>"
    )

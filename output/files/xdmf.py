"""XDMF files: what the arrays of fields.h5 are to ParaView and pyvista. They hold no numbers."""

from __future__ import annotations

from collections.abc import Sequence

from archord.output.files.step_file import step_name

# By nodes of second-order cells: XDMF's name, and VTK's order of basix' nodes, which counts both
# corners and edges all around; of hexahedra below, above, and between, then the faces
_CORNERS = [0, 1, 3, 2, 4, 5, 7, 6]
_MIDDLES = [8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 15, 14]
_FACES = [22, 23, 21, 24, 20, 25]
CELLS = {
    6: ("Triangle_6", [0, 1, 2, 5, 3, 4]),
    9: ("Quadrilateral_9", [0, 1, 3, 2, 4, 6, 7, 5, 8]),
    10: ("Tetrahedron_10", [0, 1, 2, 3, 9, 6, 8, 7, 5, 4]),
    27: ("Hexahedron_27", [*_CORNERS, *_MIDDLES, *_FACES, 26]),
}


def step_grid(
    n_nodes: int,
    cells: tuple[int, int],
    step: int,
    of_nodes: Sequence[str],
    of_cells: Sequence[str],
) -> str:
    """The mesh of a ``step``, with ``cells`` and nodes a cell, and its fields: the displacement,
    and the scalars of nodes and cells with these names."""
    n_cells, per_cell = cells
    in_space = f"{n_nodes} 3"
    at_cells = f"{n_cells}"
    topology, _ = CELLS[per_cell]
    connectivity = _data(f"{n_cells} {per_cell}", 0, "mesh/cells", "Int")
    points = _data(in_space, 0, "mesh/coordinates")
    displacement = _data(in_space, step, "displacement")
    attributes = f'TopologyType="{topology}" NumberOfElements="{n_cells}"'
    lines = [
        f"<Topology {attributes}>{connectivity}</Topology>",
        f'<Geometry GeometryType="XYZ">{points}</Geometry>',
        _attribute("displacement", "Vector", "Node", displacement),
    ]
    for name in of_nodes:
        values = _data(f"{n_nodes}", step, name)
        lines.append(_attribute(name, "Scalar", "Node", values))
    for name in of_cells:
        values = _data(at_cells, step, name)
        lines.append(_attribute(name, "Scalar", "Cell", values))
    body = _data(at_cells, 0, "mesh/body", "Int", 4)
    lines.append(_attribute("body", "Scalar", "Cell", body))
    return "\n".join(lines)


def steps_text(times: Sequence[float], grids: Sequence[str]) -> str:
    """The file of all steps: `step_grid` of each, at its time."""
    lines = ['<?xml version="1.0"?>\n<Xdmf Version="3.0">\n<Domain>']
    lines.append('<Grid Name="joint" GridType="Collection" CollectionType="Temporal">')
    for step, (time, grid) in enumerate(zip(times, grids, strict=True), 1):
        lines.append(f'<Grid Name="step {step}" GridType="Uniform">')
        lines.append(f'<Time Value="{time!r}"/>\n{grid}\n</Grid>')
    lines.append("</Grid>\n</Domain>\n</Xdmf>\n")
    return "\n".join(lines)


def _attribute(name: str, kind: str, centre: str, data: str) -> str:
    return f'<Attribute Name="{name}" AttributeType="{kind}" Center="{centre}">{data}</Attribute>'


def _data(shape: str, step: int, name: str, kind: str = "Float", precision: int = 8) -> str:
    """Where an array lies, and what it is; ``step`` is 0 for what does not change."""
    attributes = f'Dimensions="{shape}" NumberType="{kind}" Precision="{precision}" Format="HDF"'
    return f"<DataItem {attributes}>fields/{step_name(step)}.h5:/{name}</DataItem>"

"""The fields of a run at a step, as fields.h5 holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from archord.materials.elasticity import principal_stresses, von_mises
from archord.materials.kinematics import PLANE_STRAIN, Ints, kinematics
from archord.materials.material import Array, Arrays
from archord.output.files.step_file import all_arrays, step_name
from archord.postprocess.arrays.arc import opened
from archord.report.by_name import Names
from archord.report.errors import InputError
from archord.scene.sections.errors import toml_value

BODIES = {"pin": 1, "block": 2}
_NO_FIELDS = ("mesh", "edges", "points", "cells")  # groups of the file
# Of VTK's second-order cells by their nodes: straight triangles to draw them by, and the edges,
# each along it; of the faces of cells in space, too
_SUBTRIANGLES = {
    6: [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    9: [[a, b, 8] for a, b in pairwise([0, 4, 1, 5, 2, 6, 3, 7, 0])],
}
EDGES = {6: [[0, 3, 1], [1, 4, 2], [2, 5, 0]], 9: [[0, 4, 1], [1, 5, 2], [2, 6, 3], [3, 7, 0]]}


def _known(kind: str, name: str, doc: str) -> property:
    """The field ``name`` of a kind, None where the run has none."""
    return property(lambda fields: getattr(fields, kind).get(name), doc=doc)


@dataclass(frozen=True)
class Fields:
    """The bodies of a run at one step: ``n`` nodes and ``m`` curved cells of second order.

    Of the paper's joint this is the half x >= 0. All is in the scene's units. Stress is positive in
    tension, contact pressure in compression. `archord.Run.fields` reads it.

    A named field, as ``von_mises``, is None where the run has no such field. PEEQ and plastic
    strain are missing where no body can yield. Fields of the nodes are missing where
    ``output.fields`` is "cells".

    Attributes
    ----------
    step : int
        The step, from 1.
    delta : float
        The displacement of a joint, or the load factor.
    coordinates : array (n, 2)
        The undeformed nodes.
    cells : array (m, 6), or (m, 9) of quadrilaterals
        The nodes of each cell in VTK's order: the corners, then the nodes between the first two,
        the next two, ..., the last and the first, and the node in the middle of four corners.
    body : array (m,)
        The tag of the cell's body.
    displacement : array (n, 2)
        The displacement of the nodes.
    cell : dict
        Means of cells by name, also a user's own: scalars ``(m,)``, tensors ``(m, 4)``.
    nodal : dict
        What is recovered at the nodes by name: scalars ``(n,)``, tensors ``(n, 4)``.
    components : tuple of str
        The components of tensors.
    bodies : dict
        The tags of bodies by name.
    edges : dict
        The nodes ``(k, 3)`` along named sets of facets.

    Examples
    --------
    >>> import archord
    >>> joint = {"radius": 10.0, "clearance": 0.1, "relative_element_size": 0.2}
    >>> steel = {"E": 210e3, "nu": 0.3}
    >>> load = {"displacement": 0.5, "steps": 1}
    >>> scene = archord.Scene(joint=joint, pin=steel, block=steel, load=load)
    >>> fields = archord.solve(scene, "runs/doctest", force=True).fields()
    >>> list(fields.bodies)
    ['pin', 'block']
    >>> fields.von_mises.shape == (len(fields.cells),)
    True
    >>> fields.stress is None
    True
    """

    step: int
    delta: float  # or the load factor
    coordinates: Array  # (n, 2) undeformed
    cells: Ints  # (m, 6), or (m, 9) of quadrilaterals
    body: Ints  # (m,) the tag of the cell's body
    displacement: Array  # (n, 2)
    cell: Arrays  # means of cells by name: scalars (m,), tensors (m, 4)
    nodal: Arrays  # recovered at the nodes: scalars (n,), tensors (n, 4)
    components: Names = PLANE_STRAIN.names  # of tensors (., 4)
    bodies: Mapping[str, int] = field(default_factory=lambda: BODIES)  # their tags by name
    edges: Mapping[str, Ints] = field(default_factory=dict)  # (k, 3) nodes along named sets

    von_mises = _known("cell", "von_mises", "``(m,)``")
    mean_stress = _known("cell", "mean_stress", "``(m,)`` third of the trace")
    peeq = _known("cell", "peeq", "``(m,)`` equivalent plastic strain")
    contact_state = _known(
        "cell", "contact_state", "``(m,)`` share of the cell's contact edge that is in contact"
    )
    contact_pressure = _known("cell", "contact_pressure", "``(m,)`` mean over that edge")
    stress = _known("nodal", "stress", "``(n, 4)``")
    plastic_strain = _known("nodal", "plastic_strain", "``(n, 4)``")
    peeq_nodal = _known("nodal", "peeq", "``(n,)``")

    @property
    def deformed(self) -> Array:
        """Coordinates ``(n, 2)`` of the deformed nodes."""
        return self.coordinates + self.displacement

    @cached_property
    def body_of_node(self) -> Ints:
        """Body ``(n,)`` that every node belongs to; bodies share none."""
        found = np.zeros(len(self.coordinates), dtype=self.body.dtype)
        found[self.cells] = self.body[:, None]
        return found

    def nodal_fields(self) -> Arrays:
        """The recovered fields of the nodes by name ``(n,)``, tensors by components, with the
        principal stresses "p1" to "p3" (the largest first), "principal_angle" (of the larger one in
        the plane, from the x axis) and "von_mises" of the stress."""
        found = {}
        for name, values in self.nodal.items():
            if values.ndim == 1:
                found[name] = values
                continue
            for k, component in enumerate(self.components):
                found[f"{name}_{component}"] = values[:, k]
        if self.stress is not None:
            principal, angle = principal_stresses(self.stress)
            for k in range(3):
                found[f"p{k + 1}"] = principal[:, k]
            found["principal_angle"] = angle
            found["von_mises"] = von_mises(self.stress)
        return found

    @property
    def triangles(self) -> Ints:
        """Nodes ``(m, k, 3)`` of the straight triangles that every cell is drawn by."""
        return self.cells[:, _SUBTRIANGLES[self.cells.shape[1]]]

    def facets(self) -> Ints:
        """Edges ``(k, 3)`` of all cells, which lie on the left: first node, the one between, last
        node."""
        edges = self.cells[:, EDGES[self.cells.shape[1]]]
        a, b, c = np.moveaxis(self.coordinates[self.cells[:, :3]], 1, 0)
        clockwise = np.linalg.det(np.stack([b - a, c - a], axis=1)) < 0
        edges[clockwise] = edges[clockwise, :, ::-1]
        return edges.reshape(-1, 3)

    def outline(self) -> Ints:
        """The `facets` that are on the boundary of the bodies."""
        edges = self.facets()
        ends = np.sort(edges[:, [0, 2]], axis=1)
        _, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
        return edges[first[count == 1]]


def read_fields(
    folder: str | Path, scene: Any, step: int, bodies: Mapping[str, int] = BODIES
) -> Fields:
    """The fields at ``step`` (from 1) of the run of ``scene`` in ``folder``, whose ``bodies`` have
    these tags.

    Raises `InputError` if the run wrote none, or the file is missing, damaged or does not hold the
    step.
    """
    _require(bool(scene.output.fields), folder, scene, "fields")
    with opened(folder, "fields", step) as file:
        kind = kinematics(scene.analysis.plane)
        components = kind.names
        body = file["mesh/body"][()]
        arrays = _arrays_at(file, step)
        displacement = arrays.pop("displacement")[:, : kind.dimension]
        cell = {name: values for name, values in arrays.items() if len(values) == len(body)}
        if "cells" in file:
            cell |= _arrays_at(file["cells"], step)
        nodal = {name: values for name, values in arrays.items() if name not in cell}
        return Fields(
            step=step,
            delta=float(file["load"][step - 1]),
            coordinates=file["mesh/coordinates"][:, : kind.dimension],
            cells=file["mesh/cells"][()],
            body=body,
            displacement=displacement,
            cell=cell,
            nodal=_with_tensors(nodal, components),
            components=components,
            bodies=bodies,
            edges=dict(all_arrays(file["edges"])) if "edges" in file else {},
        )


def _arrays_at(group: Any, step: int) -> Arrays:
    """The arrays of a ``step`` in a group by name."""
    at = step_name(step)
    places = {name: f"{name}/{at}" for name in group if name not in _NO_FIELDS}
    return {name: group[place][()] for name, place in places.items() if place in group}


def _with_tensors(arrays: Arrays, components: Sequence[str]) -> Arrays:
    """Nodal ``arrays`` ``(n,)`` by name, those that are the ``components`` of a tensor as one array
    ``(n, 4)``."""
    found = dict(arrays)
    first = f"_{components[0]}"
    for name in [name.removesuffix(first) for name in arrays if name.endswith(first)]:
        columns = [f"{name}_{component}" for component in components]
        if found.keys() >= set(columns):
            found[name] = np.stack([found.pop(column) for column in columns], axis=1)
    return {name.removesuffix("_nodal"): values for name, values in found.items()}


def read_points(folder: str | Path, scene: Any, step: int) -> Arrays:
    """What ``output.fields = "points"`` writes at ``step``: "coordinates" ``(m, q, 2)`` of the
    integration points, "stress" ``(m, q, 4)`` and, where a body can yield, "plastic_strain" and
    "peeq" ``(m, q)``. Raises `InputError`."""
    _require(scene.output.fields == "points", folder, scene, "integration points")
    with opened(folder, "fields", step) as file:
        at = step_name(step)
        found = {"coordinates": file["points/coordinates"][()]}
        for name in set(file["points"]) - set(found):
            found[name] = file[f"points/{name}/{at}"][()]
        return found


def _require(written: bool, folder: str | Path, scene: Any, what: str) -> None:
    if not written:
        asked = toml_value(scene.output.fields)
        raise InputError(folder, f"has no {what}: it was solved with output.fields = {asked}.")

"""The fields of a run at a step, as fields.h5 holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from archord.materials.elasticity import principal_stresses, von_mises
from archord.materials.kinematics import AXISYMMETRIC, PLANE_STRAIN
from archord.materials.material import Array
from archord.output.files.step_file import all_arrays, step_name
from archord.postprocess.arc import opened
from archord.report.errors import InputError
from archord.scene.sections.errors import toml_value

BODIES = {"pin": 1, "block": 2}
CELL_FIELDS = ("von_mises", "mean_stress", "peeq", "contact_state", "contact_pressure")
TENSORS = ("stress", "plastic_strain")
# Of VTK's second-order cells by their nodes: straight triangles to draw them by, and the edges,
# each along it
_SUBTRIANGLES = {
    6: [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    9: [[a, b, 8] for a, b in pairwise([0, 4, 1, 5, 2, 6, 3, 7, 0])],
}
_EDGES = {6: [[0, 3, 1], [1, 4, 2], [2, 5, 0]], 9: [[0, 4, 1], [1, 5, 2], [2, 6, 3], [3, 7, 0]]}


@dataclass(frozen=True)
class Fields:
    """Bodies (of the paper's joint the half x >= 0) at one step: ``n`` nodes and ``m`` curved cells
    of second order.

    ``cells`` has VTK's order: corners, then the nodes between the first two, the next two, ..., and
    the last and the first, and the node in the middle of four corners. Stress is positive in
    tension, contact pressure in compression. PEEQ and plastic strain are None where no body can
    yield, and all that is recovered at nodes where `output.fields` is "cells". All in the scene's
    units.
    """

    step: int
    delta: float  # or the load factor
    coordinates: Array  # (n, 2) undeformed
    cells: np.ndarray  # (m, 6), or (m, 9) of quadrilaterals
    body: np.ndarray  # (m,) the tag of the cell's body
    displacement: Array  # (n, 2)
    von_mises: Array  # (m,) means of cells, like the following
    mean_stress: Array  # (m,) third of the trace
    peeq: Array | None  # (m,) equivalent plastic strain
    contact_state: Array  # (m,) share of the cell's contact edge that is in contact, 0 elsewhere
    contact_pressure: Array  # (m,) mean over that edge
    stress: Array | None = None  # (n, 4) recovered at the nodes, like the following
    plastic_strain: Array | None = None  # (n, 4)
    peeq_nodal: Array | None = None  # (n,)
    components: tuple[str, ...] = PLANE_STRAIN.names  # of tensors (., 4)
    cell_tensors: dict[str, Array] = field(default_factory=dict)  # (m, 4) means, by TENSORS
    bodies: Mapping[str, int] = field(default_factory=lambda: BODIES)  # their tags by name
    edges: Mapping[str, np.ndarray] = field(default_factory=dict)  # (k, 3) nodes along named sets

    @property
    def deformed(self) -> Array:
        """Coordinates ``(n, 2)`` of the deformed nodes."""
        return self.coordinates + self.displacement

    @cached_property
    def body_of_node(self) -> np.ndarray:
        """Body ``(n,)`` that every node belongs to; bodies share none."""
        found = np.zeros(len(self.coordinates), dtype=self.body.dtype)
        found[self.cells] = self.body[:, None]
        return found

    def nodal_tensors(self) -> dict[str, Array]:
        """The recovered tensors ``(n, 4)`` by name."""
        known = {name: getattr(self, name) for name in TENSORS}
        return {name: tensor for name, tensor in known.items() if tensor is not None}

    def nodal_fields(self) -> dict[str, Array]:
        """The recovered fields of the nodes by name ``(n,)``, with the principal stresses "p1" to
        "p3" (the largest first), "principal_angle" (of the larger one in the plane, from the x
        axis) and "von_mises" of their tensor."""
        found: dict[str, Array] = {}
        for name, tensor in self.nodal_tensors().items():
            for k, component in enumerate(self.components):
                found[f"{name}_{component}"] = tensor[:, k]
        if self.stress is not None:
            principal, angle = principal_stresses(self.stress)
            for k in range(3):
                found[f"p{k + 1}"] = principal[:, k]
            found["principal_angle"] = angle
            found["von_mises"] = von_mises(self.stress)
        if self.peeq_nodal is not None:
            found["peeq"] = self.peeq_nodal
        return found

    def cell_fields(self) -> dict[str, Array]:
        """The fields of the cells by name; `peeq` only where a body can yield."""
        known = {name: getattr(self, name) for name in CELL_FIELDS}
        return {name: values for name, values in known.items() if values is not None}

    @property
    def triangles(self) -> np.ndarray:
        """Nodes ``(m, k, 3)`` of the straight triangles that every cell is drawn by."""
        return self.cells[:, _SUBTRIANGLES[self.cells.shape[1]]]

    def facets(self) -> np.ndarray:
        """Edges ``(k, 3)`` of all cells, which lie on the left: first node, the one between, last
        node."""
        edges = self.cells[:, _EDGES[self.cells.shape[1]]]
        a, b, c = np.moveaxis(self.coordinates[self.cells[:, :3]], 1, 0)
        clockwise = np.linalg.det(np.stack([b - a, c - a], axis=1)) < 0
        edges[clockwise] = edges[clockwise, :, ::-1]
        return edges.reshape(-1, 3)

    def outline(self) -> np.ndarray:
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
    at = step_name(step)
    _require(bool(scene.output.fields), folder, scene, "fields")
    with opened(folder, "fields", step) as file:
        components = AXISYMMETRIC.names if "stress_rr" in file else PLANE_STRAIN.names

        def array(name: str) -> Any:
            return file[f"{name}/{at}"][()] if f"{name}/{at}" in file else None

        found = {name: array(name) for name in (*CELL_FIELDS, "peeq_nodal")}
        for name in TENSORS:
            columns = [array(f"{name}_{component}") for component in components]
            known = all(values is not None for values in columns)
            found[name] = np.stack(columns, axis=1) if known else None
        means = {name: array(f"cells/{name}") for name in TENSORS}
        return Fields(
            step=step,
            delta=float(file["load"][step - 1]),
            coordinates=file["mesh/coordinates"][:, :2],
            cells=file["mesh/cells"][()],
            body=file["mesh/body"][()],
            displacement=file[f"displacement/{at}"][:, :2],
            components=components,
            cell_tensors={name: values for name, values in means.items() if values is not None},
            bodies=bodies,
            edges=dict(all_arrays(file["edges"])) if "edges" in file else {},
            **found,
        )


def read_points(folder: str | Path, scene: Any, step: int) -> dict[str, Array]:
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
        raise InputError(f"{folder}: has no {what}: it was solved with output.fields = {asked}.")

"""The fields of a run at a step, as fields.h5 holds them, and the deformed joint with its clearance
magnified."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from archord.materials.elasticity import principal_stresses, von_mises
from archord.materials.material import COMPONENTS, Array
from archord.output.files.step_file import all_arrays, step_name
from archord.postprocess.arc import opened
from archord.scene.errors import InputError, toml_value
from archord.scene.scene import Scene

BODIES = {"pin": 1, "block": 2}
CELL_FIELDS = ("von_mises", "mean_stress", "peeq", "contact_state", "contact_pressure")
# Of VTK's second-order cells by their nodes: straight triangles to draw them by, and the edges,
# each along it
_SUBTRIANGLES = {
    6: [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
    9: [[a, b, 8] for a, b in pairwise([0, 4, 1, 5, 2, 6, 3, 7, 0])],
}
_EDGES = {6: [[0, 3, 1], [1, 4, 2], [2, 5, 0]], 9: [[0, 4, 1], [1, 5, 2], [2, 6, 3], [3, 7, 0]]}
_VISIBLE = 0.1  # clearance over R, as drawn
_FARTHEST = 0.2  # displacement and clearance over R, as drawn
_NEAR = 3.0  # radii within which displacements count


@dataclass(frozen=True)
class Fields:
    """Bodies (of the paper's joint the half x >= 0) at one step: ``n`` nodes and ``m`` curved cells
    of second order.

    ``cells`` has VTK's order: corners, then the nodes between the first two, the next two, ..., and
    the last and the first, and that in the middle of four corners. Stress is positive in tension,
    contact pressure in compression; PEEQ and plastic strain are None where no body can yield, and
    all that is recovered at nodes where `output.fields` is "cells". All in the scene's units.
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
    stress: Array | None = None  # (n, 4) xx, yy, zz, xy: recovered at the nodes, like the following
    plastic_strain: Array | None = None  # (n, 4)
    peeq_nodal: Array | None = None  # (n,)
    bodies: Mapping[str, int] = field(default_factory=lambda: BODIES)  # their tags by name
    edges: Mapping[str, np.ndarray] = field(
        default_factory=dict
    )  # (k, 3) nodes along each edge of a named set

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

    def nodal_fields(self) -> dict[str, Array]:
        """The recovered fields of the nodes by name ``(n,)``, with the principal stresses "p1" to
        "p3" (the largest first), "principal_angle" (of the larger one in the plane, from the x
        axis) and "von_mises" of their tensor."""
        found: dict[str, Array] = {}
        for name, tensor in (("stress", self.stress), ("plastic_strain", self.plastic_strain)):
            if tensor is not None:
                found |= {f"{name}_{c}": tensor[:, k] for k, c in enumerate(COMPONENTS)}
        if self.stress is not None:
            values, angle = principal_stresses(self.stress)
            found |= {f"p{k + 1}": values[:, k] for k in range(3)}
            found |= {"principal_angle": angle, "von_mises": von_mises(self.stress)}
        return found if self.peeq_nodal is None else found | {"peeq": self.peeq_nodal}

    def cell_fields(self) -> dict[str, Array]:
        """The fields of the cells by name; `peeq` only where a body can yield."""
        return {
            name: getattr(self, name) for name in CELL_FIELDS if getattr(self, name) is not None
        }

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
        """Those of the `facets` that are on the boundary of the bodies."""
        edges = self.facets()
        _, first, count = np.unique(
            np.sort(edges[:, [0, 2]], axis=1), axis=0, return_index=True, return_counts=True
        )
        return edges[first[count == 1]]


def read_fields(
    folder: str | Path, scene: Scene, step: int, bodies: Mapping[str, int] = BODIES
) -> Fields:
    """The fields at ``step`` (from 1) of the run of ``scene`` in ``folder``, whose ``bodies`` have
    these tags.

    Raises `InputError` if the run wrote none, or the file is missing, damaged or does not hold the
    step.
    """
    at = step_name(step)
    _require(bool(scene.output.fields), folder, scene, "fields")
    with opened(folder, "fields", step) as file:
        mesh = file["mesh"]
        found: dict[str, Any] = {
            name: file[f"{name}/{at}"][()] if name in file else None for name in CELL_FIELDS
        }
        for name in ("stress", "plastic_strain"):
            if f"{name}_xx/{at}" in file:
                found[name] = np.stack([file[f"{name}_{c}/{at}"][()] for c in COMPONENTS], axis=1)
        if f"peeq_nodal/{at}" in file:
            found["peeq_nodal"] = file[f"peeq_nodal/{at}"][()]
        x, u, cells, body = (
            mesh["coordinates"],
            file[f"displacement/{at}"],
            mesh["cells"][()],
            mesh["body"][()],
        )
        edges = dict(all_arrays(file["edges"])) if "edges" in file else {}
        load = float(file["load"][step - 1])
        return Fields(
            step, load, x[:, :2], cells, body, u[:, :2], **found, bodies=bodies, edges=edges
        )


def read_points(folder: str | Path, scene: Scene, step: int) -> dict[str, Array]:
    """What ``output.fields = "points"`` writes at ``step``: "coordinates" ``(m, q, 2)`` of the
    integration points, "stress" ``(m, q, 4)`` and, where a body can yield, "plastic_strain" and
    "peeq" ``(m, q)``. Raises `InputError`."""
    _require(scene.output.fields == "points", folder, scene, "integration points")
    with opened(folder, "fields", step) as file:
        points, at = file["points"], step_name(step)
        return {
            name: points[name if name == "coordinates" else f"{name}/{at}"][()] for name in points
        }


def _require(written: bool, folder: str | Path, scene: Scene, what: str) -> None:
    if not written:
        raise InputError(
            f"{folder}: has no {what}: it was solved with output.fields = {toml_value(scene.output.fields)}."
        )


def magnification(scene: Scene, fields: Fields) -> float:
    """Factor 1, 2, 3, 5, 10, ... that makes the clearance of ``scene`` visible and leaves the shape
    recognisable."""
    R, dR = scene.joint.radius, abs(scene.joint.dR)
    near = np.hypot(*fields.coordinates.T) < _NEAR * R
    farthest = dR + max(float(np.abs(fields.displacement[near]).max()), abs(fields.delta))
    wanted = max(1.0, min(_VISIBLE * R / dR, _FARTHEST * R / farthest))
    decade = 10.0 ** math.floor(math.log10(wanted))
    return max(step * decade for step in (1, 2, 3, 5) if step * decade <= wanted * (1 + 1e-9))


def magnified(scene: Scene, fields: Fields, factor: float, displaced: bool = True) -> Array:
    """Points ``(n, 2)`` at which the nodes are drawn; of the joint before it is loaded, if not
    ``displaced``.

    Bodies that touch would overlap if displacements alone were magnified. So ``factor`` times the
    displacement is that from the joint without clearance, in which both arcs are the circle of
    radius R around the origin: a gap is as many times as wide, and what touches touches, but for
    ``(factor s)^2/(2 R)`` where one body slid by s along the other.
    """
    X, pin = fields.coordinates, fields.body_of_node == BODIES["pin"]
    start = X * (1 - scene.joint.dR / np.maximum(np.hypot(*X.T), scene.joint.radius / 2))[:, None]
    start[pin] = X[pin] + [0.0, scene.joint.pin_depth]
    return start + factor * ((fields.deformed if displaced else X) - start)

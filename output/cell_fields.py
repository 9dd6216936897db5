"""The fields that a run writes of its cells: a row each, and how their values are computed.

A row is written to fields.h5 and fields.xdmf, read as `Fields.cell`, drawn and exported; none of
these knows the names.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.materials.elasticity import mean_stress, von_mises
from archord.materials.kinematics import AXISYMMETRIC, SPACE
from archord.materials.material import Array, Arrays
from archord.report.by_name import ByName
from archord.report.errors import InputError

if TYPE_CHECKING:
    from archord.solver.bulk.body_points import PointFields
    from archord.solver.path.system import System

# what else fields.h5 and exports have
_TAKEN = ("accepted", "load", "mesh", "edges", "points", "cells", "body", "displacement")
# what probes and pictures make of fields, and call so
_MADE = ("ux", "uy", "uz", "p1", "p2", "p3", "principal_angle", "hoop", "along", "normal", "shear")
_OF_CONTACT = ("pressure", "facet_pressure", "gap", "contact_shear")
_COMPONENTS = ("nodal", *SPACE.names, *AXISYMMETRIC.names)  # of a plane, too
_NAME = re.compile(r"\w[\w .()-]*")
_ALLOWED = "it may have letters, digits, spaces and any of _ . ( ) -"


@dataclass(frozen=True)
class CellField:
    """A field: a run writes its mean in each cell.

    - ``name``: in files, in Python and for ``--field``
    - ``label``, ``unit``: in pictures; the unit may be "{stress}" or "{length}", the scene's, and
      "%" makes percents of fractions
    - ``values``: a function of a body's `PointFields` that returns values ``(n, q)`` or tensors
      ``(n, q, 4)``, in space ``(n, q, 6)``; where it is ``on_contact``, of a `Pair`, values
      ``(f, q)`` on its surface
    - ``on_contact``: whether it is the mean over the cell's facets in contact surfaces, 0 without
    - ``of_yielding``: whether only problems in which a body can yield have it
    - ``nodal``: whether it is recovered at the nodes, too (``output.fields = "nodes"``), and kept
      at the integration points (``"points"``)
    - ``least``: nodal values below it are cut off, as recovered polynomials swing
    """

    name: str
    label: str
    unit: str
    values: Callable[[Any], Array]
    on_contact: bool = False
    of_yielding: bool = False
    nodal: bool = False
    least: float = -np.inf


CELL_FIELDS = [
    CellField("von_mises", "von Mises stress", "{stress}", lambda at: von_mises(at.stress)),
    CellField("mean_stress", "mean stress", "{stress}", lambda at: mean_stress(at.stress)),
    CellField("stress", "stress", "{stress}", lambda at: at.stress, nodal=True),
    CellField(
        "plastic_strain",
        "plastic strain",
        "%",
        lambda at: at.plastic_strain,
        of_yielding=True,
        nodal=True,
    ),
    CellField(
        "peeq",
        "equivalent plastic strain",
        "%",
        lambda at: at.peeq,
        of_yielding=True,
        nodal=True,
        least=0.0,
    ),
    CellField(
        "contact_state",
        "share of the edge in contact",
        "-",
        lambda pair: pair.pressure > 0,
        on_contact=True,
    ),
    CellField(
        "contact_pressure",
        "contact pressure",
        "{stress}",
        lambda pair: pair.pressure,
        on_contact=True,
    ),
]


def row_of(name: str) -> CellField | None:
    """The row of a field, or of a component of a tensor, by its ``name``."""
    rows = {row.name: row for row in CELL_FIELDS}
    of_tensor, _, component = name.rpartition("_")
    return rows.get(of_tensor if component in _COMPONENTS else name)


def own_rows(own: Mapping[str, Callable[[Any], Array]]) -> list[CellField]:
    """The rows of fields that are given as functions of `PointFields` by name. Raises
    `InputError`."""
    for name in own:
        if name in (*_TAKEN, *_MADE, *_OF_CONTACT) or row_of(name):
            raise InputError(f"archord.solve: own_fields: {name!r} is the name of another field.")
        if not _NAME.fullmatch(name):
            raise InputError(f"archord.solve: own_fields: {name!r} is no name: {_ALLOWED}.")
    return [CellField(name, name, "", _of_copies(values)) for name, values in own.items()]


def _of_copies(values: Callable[[Any], Array]) -> Callable[[Any], Array]:
    """A user's function of `PointFields`, which may write into what it gets: the arrays themselves
    are the history, the weights and the stresses of other fields."""

    def of_copies(at: PointFields) -> Array:
        given = at._asdict()
        own: ByName = {k: v.copy() for k, v in given.items() if isinstance(v, np.ndarray)}
        return values(at._replace(state=deepcopy(at.state), **own))

    return of_copies


def cell_means(system: System, parts: Sequence[PointFields], rows: Sequence[CellField]) -> Arrays:
    """The means ``(n_cells,)``, or ``(n_cells, 4)`` and in space ``(n_cells, 6)``, of this rank's
    cells by name, from the ``parts`` at the integration points."""
    found = {}
    for row in rows:
        if row.on_contact:
            found[row.name] = _mean_on_contact(system, row)
        else:
            found[row.name] = _mean_in_bodies(system, parts, row)
    return found


def _mean_in_bodies(system: System, parts: Sequence[PointFields], row: CellField) -> Array:
    means: Array = np.zeros(0)
    for part in parts:
        found = row.values(part)
        values = np.asarray(found)
        if np.ma.is_masked(found) or values.dtype.kind not in "fiub":
            said = f"must have real numbers at all points, not {values.dtype} or masked ones"
            raise InputError(f"field {row.name!r}: {said}.")
        if values.shape[:2] != part.weight.shape:
            shape = part.weight.shape
            raise InputError(f"field {row.name!r}: has values {values.shape} at points {shape}.")
        if not means.size:
            means = np.zeros((system.bulk.n_cells, *values.shape[2:]))
        if means.shape[1:] != values.shape[2:]:
            said = f"has values {means.shape[1:]} in one body and {values.shape[2:]} in another"
            raise InputError(f"field {row.name!r}: {said}.")
        share = part.weight / part.weight.sum(axis=1, keepdims=True)
        means[part.cells] = np.einsum("nq,nq...->n...", share, values)
    return means


def _mean_on_contact(system: System, row: CellField) -> Array:
    """The means ``(cells,)``. A facet in two interactions, each with another body, has the sum of
    their values over its one area."""
    whole = np.zeros(system.bulk.n_cells)
    found = []
    for pair in system.contact.pairs:
        surface = pair.surface
        np.add.at(whole, surface.cells, (surface.weight * row.values(pair)).sum(axis=1))
        facet = np.column_stack([surface.cells, surface.trace])
        facets, number = np.unique(facet, axis=0, return_inverse=True)
        found.append((facets, np.bincount(number.ravel(), surface.weight.sum(axis=1))))
    if not found:
        return whole
    together = np.concatenate([facets for facets, _ in found])
    facets, number = np.unique(together, axis=0, return_inverse=True)
    area = np.zeros(len(facets))
    np.maximum.at(area, number.ravel(), np.concatenate([areas for _, areas in found]))
    length = np.bincount(facets[:, 0], area, minlength=len(whole))
    length[length == 0] = 1.0
    return whole / length

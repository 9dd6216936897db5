"""The fields of a run at a step, as fields.h5 holds them: displacement at nodes, stress and plastic strain of cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import h5py
import numpy as np

from archord.geometry.basis import Array
from archord.output.step_file import step_name
from archord.scene.errors import InputError
from archord.scene.scene import Scene

BODIES = {"pin": 1, "block": 2}
CELL_FIELDS = ("von_mises", "mean_stress", "peeq", "contact_state", "contact_pressure")
SUBTRIANGLES = [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]  # of a VTK second-order triangle
_EDGES = [[0, 3, 1], [1, 4, 2], [2, 5, 0]]  # of a VTK second-order triangle, along it


@dataclass(frozen=True)
class Fields:
    """Half of the joint (x >= 0) at one step: ``n`` nodes and ``m`` curved triangles of second order.

    ``cells`` has VTK's order: three corners, then the nodes between the first two, the next two, and the last and the
    first. Stress is positive in tension, contact pressure in compression; `peeq` is None where no body can yield. All
    in the scene's units.
    """

    step: int
    delta: float
    coordinates: Array  # (n, 2) undeformed
    cells: np.ndarray  # (m, 6)
    body: np.ndarray  # (m,) 1 pin, 2 block
    displacement: Array  # (n, 2)
    von_mises: Array  # (m,) means of cells, like the following
    mean_stress: Array  # (m,) third of the trace
    peeq: Array | None  # (m,) equivalent plastic strain
    contact_state: Array  # (m,) share of the cell's contact edge that is in contact, 0 elsewhere
    contact_pressure: Array  # (m,) mean over that edge

    @property
    def deformed(self) -> Array:
        """Coordinates ``(n, 2)`` of the deformed nodes."""
        return self.coordinates + self.displacement

    @cached_property
    def body_of_node(self) -> np.ndarray:
        """Body ``(n,)`` that every node belongs to; pin and block share none."""
        found = np.zeros(len(self.coordinates), dtype=self.body.dtype)
        found[self.cells] = self.body[:, None]
        return found

    def cell_fields(self) -> dict[str, Array]:
        """The fields of the cells by name; `peeq` only where a body can yield."""
        values = {name: getattr(self, name) for name in CELL_FIELDS}
        return {name: value for name, value in values.items() if value is not None}

    def outline(self) -> np.ndarray:
        """Edges ``(k, 3)`` on the boundary of the bodies: first node, the one between, last node."""
        edges = self.cells[:, _EDGES].reshape(-1, 3)
        _, first, count = np.unique(np.sort(edges[:, [0, 2]], axis=1), axis=0, return_index=True, return_counts=True)
        return edges[first[count == 1]]


def read_fields(folder: str | Path, scene: Scene, step: int) -> Fields:
    """The fields at ``step`` (from 1) of the run of ``scene`` in ``folder``.

    Raises `InputError` if the run wrote none, or the file is missing, damaged or does not hold the step.
    """
    path = Path(folder) / "fields.h5"
    if not scene.output.fields:
        raise InputError(f"{folder}: has no fields: it was solved with output.fields = false.")
    if not path.is_file():
        raise InputError(f"{folder}: is not a complete run folder: fields.h5 is missing.")
    at = step_name(step)
    try:
        with h5py.File(path) as file:
            accepted = int(file["accepted"][()])
            if not 1 <= step <= accepted:
                raise InputError(f"{path}: has no step {step}; it holds {_counted(accepted)}.")
            values = {name: file[f"{name}/{at}"][()] if name in file else None for name in CELL_FIELDS}
            return Fields(
                step=step,
                delta=float(file["load"][step - 1]),
                coordinates=file["mesh/coordinates"][:, :2],
                cells=file["mesh/cells"][()],
                body=file["mesh/body"][()],
                displacement=file[f"displacement/{at}"][:, :2],
                **values,
            )
    except InputError:
        raise
    except (OSError, KeyError, RuntimeError, TypeError, ValueError, IndexError):
        raise InputError(f"{path}: cannot be read as the fields of a run: it is damaged.") from None


def _counted(steps: int) -> str:
    return f"steps 1 to {steps}" if steps > 1 else "step 1 alone" if steps else "none"

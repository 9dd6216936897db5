"""Where the mesh of a problem comes from: a file, or a mesh that Python has; and how it is changed
before it is used."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from archord.report.errors import InputError, in_sentences, require_between, require_of

if TYPE_CHECKING:
    from mpi4py import MPI

    from archord.geometry.meshes.mesh_arrays import MeshArrays
    from archord.geometry.meshes.tagged_mesh import TaggedMesh

_KINDS = "a mesh or CAD file, gmsh with a model, (mesh, cells, facets) of dolfinx, or a Mesh"
_MOST_TIMES = 6  # that cells are cut
_LONGEST = 40  # characters of a value in a message
CHANGES = ("scale", "order", "refine", "size", "sizes", "sets")  # but for the circles
# centre and radius, and the axis of a cylinder
Disc = tuple[tuple[float, ...], float] | tuple[tuple[float, ...], float, tuple[float, ...]]


def _is_circle(given: Any) -> bool:
    """Whether it is a centre and a positive radius, or the same with a direction."""
    try:
        centre, radius, *axis = given
        vectors = [np.asarray(vector, dtype=float) for vector in (centre, *axis)]
        sizes = [vector.shape for vector in vectors]
        known = np.isfinite(np.concatenate(vectors)).all() and 0 < radius < math.inf
    except (TypeError, ValueError):
        return False
    has_direction = all(np.any(vector) for vector in vectors[1:])
    return known and has_direction and sizes in ([(2,)], [(3,)], [(3,), (3,)])


@in_sentences
@dataclass(frozen=True)
class Mesh:
    """A mesh for a problem.

    Parameters
    ----------
    source : str, Path, module, tuple or TaggedMesh
        A file (.msh of gmsh, .inp of Abaqus and CalculiX, .xdmf of dolfinx, .npz of archord, .step,
        .stp and .brep of CAD); the
        module gmsh with a model, meshed or not; a dolfinx mesh with its tags, as (mesh, cells,
        facets); or what `gmsh_to_mesh` returns.
    scale : float
        The factor on the coordinates: 1000 takes metres to millimetres.
    order : {1, 2, 3}
        The order of the geometry, by default the order of the source.
    refine : int
        How often every cell is cut in four.
    circles : dict
        The circles ((x, y), radius) on which the nodes of facet sets are put, by the sets. In space
        cylinders ((x, y, z), radius, direction of the axis), or spheres ((x, y, z), radius).
    size : float
        Of CAD: the largest size of elements, a tenth of the largest extent by default.
    sizes : dict
        Of CAD: the size of elements on faces by the names of these; it grows away from them.
    sets : dict
        New facet sets, each made of others: ``{"hole": ["face 7", "face 8"]}``.

    Raises
    ------
    InputError
        For a source that is none of these, and for values out of range.

    Examples
    --------
    >>> from archord import Mesh
    >>> Mesh("lug.msh", scale=1000.0, circles={"hole": ((0.0, 0.0), 10.0)}).file
    'lug.msh'
    """

    source: Any
    scale: float = 1.0
    order: int | None = None
    refine: int = 0
    circles: dict[str, Disc] | None = None
    size: float | None = None
    sizes: Mapping[str, float] = field(default_factory=dict)
    sets: Mapping[str, Sequence[str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the source and what changes it; raise `InputError`."""
        source = self.source
        known = isinstance(source, (str, Path, tuple, ModuleType))
        if not known and not hasattr(source, "facet_sets"):
            text = json.dumps(source, default=repr)[:_LONGEST]
            raise InputError(f"archord.Mesh: the source must be {_KINDS}, not {text}.")
        require_between(self, "scale", 0, math.inf, "must be positive and finite")
        require_of(self, self.order in (None, 1, 2, 3), "order", "must be 1, 2 or 3")
        is_number_of_times = self.refine in range(_MOST_TIMES + 1)
        said = f"must be a whole number from 0 to {_MOST_TIMES}"
        require_of(self, is_number_of_times, "refine", said)
        for key in ("circles", "sizes", "sets"):
            by_name = getattr(self, key) is None or isinstance(getattr(self, key), Mapping)
            require_of(self, by_name, key, "must be a dictionary by names of sets")
        are_circles = all(map(_is_circle, (self.circles or {}).values()))
        said = (
            "must have ((x, y), radius), in space ((x, y, z), radius) with the axis of a cylinder"
        )
        require_of(self, are_circles, "circles", said)

    @classmethod
    def of(cls, given: Any) -> Mesh:
        """The mesh ``given`` as a source, or as a `Mesh` already."""
        return given if isinstance(given, cls) else cls(given)

    @property
    def file(self) -> str:
        """The file, "" where there is none."""
        return str(self.source) if isinstance(self.source, (str, Path)) else ""

    @property
    def dimension(self) -> int:
        """Dimension of the cells. A file is looked into; 2 where it cannot be read."""
        from archord.geometry.meshes.formats.read import dimension_of_source

        return dimension_of_source(self.source)

    @property
    def n_ranks(self) -> int:
        """How many ranks the mesh is on already; 1 if it is still to be read."""
        source = self.source
        if hasattr(source, "facet_sets"):
            return source.mesh.comm.size
        if isinstance(source, tuple):
            return source[0].comm.size
        return 1

    @property
    def name(self) -> str:
        """What messages call the mesh."""
        return self.file or "the mesh"

    def on(self, comm: MPI.Comm) -> TaggedMesh:
        """The mesh on the ranks of ``comm``. Collective; raises ValueError."""
        from archord.geometry.meshes.formats.read import read_mesh
        from archord.geometry.meshes.refine import Circle

        circles = [
            Circle(facets, tuple(centre), radius, *map(tuple, axis))
            for facets, (centre, radius, *axis) in (self.circles or {}).items()
        ]
        return read_mesh(
            self._tagged(),
            comm,
            circles=circles,
            scale=self.scale,
            order=self.order,
            refine=self.refine,
            sizes=self._sizes,
            sets=self.sets,
        )

    def plain(self, comm: MPI.Comm) -> MeshArrays | None:
        """The mesh before it is scaled and refined: on rank 0, None elsewhere. Collective."""
        from archord.geometry.meshes.formats.read import arrays_of

        return arrays_of(self._tagged(), comm, self.order, self._sizes)

    @property
    def _sizes(self) -> Any:
        from archord.geometry.meshes.formats.step import Sizes

        on_faces = {name: size / self.scale for name, size in self.sizes.items()}
        return Sizes(self.size and self.size / self.scale, on_faces)

    def _tagged(self) -> Any:
        from archord.geometry.meshes.formats.read import tagged

        return tagged(*self.source) if isinstance(self.source, tuple) else self.source


def circles_in(sections: Sequence[Any]) -> dict[str, Disc]:
    """The circles of the sections of a scene, by the facet sets that lie on them."""
    circles: dict[str, Disc] = {}
    for section in sections:
        centre = tuple(section.centre)
        circles[section.facets] = (centre, section.radius)
        if section.axis is not None:
            circles[section.facets] = (centre, section.radius, tuple(section.axis))
    return circles

"""Joints in space: the faces of a sketch, each extruded along z, meshed by gmsh with curved
tetrahedra of second order.

gmsh gets lengths over the radius of the pin in `_DIGITS` decimals, so that meshes do not depend on
units: a last bit may decide which tetrahedra it makes.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.meshes.fenicsx import (
    gmsh_to_mesh,
    set_mesh_options,
    size_field,
    size_within,
    slices,
    use_smallest,
)
from archord.geometry.meshes.jacobian import smallest_determinants
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.quality import is_folded
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.shapes.mirrored import mirrored
from archord.geometry.shapes.sketch import Sketch, around

MIDDLE = "mid-plane"  # the set of facets at z = 0
FACES = "faces"  # the set of the other flat facets across z
RIM = "rim"  # the set of the chamfers and fillets
_SAME = 1e-6  # distance of places that are one, in radii of the pin
_DIGITS = 12
_NUMBER = re.compile(r"\d+\.?\d*(e[-+]?\d+)?")
_OF_FILLET = 0.75  # largest element at a fillet over its radius
_OPTIONS = {"ElementOrder": 2, "HighOrderOptimize": 0}


class Rims(NamedTuple):
    """The rims of the holes that the pin lies in; lengths are in radii of the pin.

    - ``chamfer``: leg of a chamfer of 45 degrees
    - ``fillet``: radius of a rounding, instead
    - ``ratio``: element size there over the size on the arcs
    """

    chamfer: float
    fillet: float
    ratio: float

    @classmethod
    def of(cls, space: Mapping[str, float], radius: float) -> Rims:
        """The rims that the section ``space`` of a scene tells."""
        return cls(space["chamfer"] / radius, space["fillet"] / radius, space["rim_ratio"])


@dataclass(frozen=True)
class Slab:
    """A part of a ``body``: the faces of a ``profile`` of the sketch, from ``bottom`` to ``top``.

    - ``names``: names of facet sets by their names in the sketch, where they differ
    - ``rims``: heights at which its bore ends
    """

    body: str
    profile: str
    bottom: float
    top: float
    names: Mapping[str, str] = field(default_factory=dict)
    rims: tuple[float, ...] = ()


class _Line(NamedTuple):
    """A line of a sketch by its middle ``(2,)``, and the sets that have it."""

    middle: Array
    sets: Sequence[str]


def slabs_of(sketch: Sketch, thickness: float, pin_length: float) -> list[Slab]:
    """The bodies of a ``sketch``, each extruded once from the mid-plane: half of it."""
    half = thickness / 2
    slabs = []
    for body in filter(sketch.faces.get, sketch.faces):
        top = pin_length / 2 if body == "pin" else half
        rims = (half,) if bore_of(sketch, body) else ()
        slabs.append(Slab(body, body, 0.0, top, rims=rims))
    return slabs


def mesh_solids(
    comm: MPI.Comm,
    sketch: Sketch,
    slabs: Sequence[Slab],
    rims: Rims,
    *,
    radius: float,
    half: bool = True,
    partitioner=None,
) -> TaggedMesh:
    """Mesh the ``slabs`` of a ``sketch``, times ``radius``, with all nodes of cylinders on them;
    with their images below z = 0, if not ``half`` is wanted alone (see `mirrored`).

    Facets over the lines of a set are the set, with a name of the slab's own where it has one.
    Further sets are "mid-plane" (z = 0), "faces" (the other flat ends), and "rim", the chamfers or
    fillets, which belong to their bore's set, too. Collective; rank 0 meshes. Raises ValueError
    where elements are so large that some are folded.
    """
    build = partial(draw_solids, sketch, slabs, rims)
    key = (*vars(sketch).items(), tuple(slabs), rims)
    finish = partial(_finished, radius, half)
    return gmsh_to_mesh(comm, build, partitioner=partitioner, key=key, cut=slices, finish=finish)


def _finished(radius: float, half: bool, drawn: MeshArrays) -> MeshArrays:
    """The half mesh that was ``drawn``, times ``radius``, or the whole one. Raises ValueError for
    folded elements."""
    n_folded = is_folded(drawn, *smallest_determinants(drawn)).sum()
    if n_folded:
        raise ValueError(
            f"{n_folded} of the elements that were drawn are folded; choose a smaller element size"
        )
    made = replace(drawn, x=radius * drawn.x)
    return made if half else mirrored(made)


def lines_of(sketch: Sketch, profile: str) -> list[_Line]:
    """The lines around the faces of a ``profile``."""
    place_of = {number: np.array(place) for (_, place), number in sketch.points.items()}
    numbers = {line for face in sketch.faces[profile] for line in sketch.loops[face - 1]}
    lines = []
    for number in sorted(numbers):
        start, stop, *centre = (place_of[point] for point in sketch.curves[number - 1])
        middle = (start + stop) / 2
        if centre:
            out = middle - centre[0]
            radius = np.linalg.norm(start - centre[0])
            middle = centre[0] + out * radius / np.linalg.norm(out)
        sets = [name for name, members in sketch.lines.items() if number in members]
        lines.append(_Line(middle, sets))
    return lines


def bore_of(sketch: Sketch, profile: str) -> str:
    """The set of the hole in a ``profile`` that the pin lies in, "" where there is none."""
    sets = {name for line in lines_of(sketch, profile) for name in line.sets}
    return next((bore.facets for bore in sketch.bores if bore.facets in sets), "")


def _is_among(height: float, heights: Sequence[float]) -> bool:
    return any(abs(height - other) < _SAME for other in heights)


def draw_solids(sketch: Sketch, slabs: Sequence[Slab], rims: Rims, gmsh: Any) -> None:
    """Draw the ``slabs`` of a ``sketch`` in ``gmsh``: bodies, sets and element sizes."""
    drawing = _Drawing(gmsh, sketch, rims)
    bodies: dict[str, dict[int, Slab]] = defaultdict(dict)
    for slab in slabs:
        for volume in drawing.extruded(slab):
            bodies[slab.body][drawing.blunted(volume, slab)] = slab
    sets: dict[str, list[int]] = defaultdict(list)
    fields = drawing.rim_sizes(slabs)
    for body, apart in bodies.items():
        parts = drawing.joined(apart)
        gmsh.model.addPhysicalGroup(3, list(parts), name=body)
        for name, surface in drawing.named_surfaces(parts):
            if surface not in sets[name]:
                sets[name].append(surface)
        for volume, slab in parts.items():
            whole = drawing.size(sketch.sizes[slab.profile])
            fields.append(size_within(gmsh, whole, [volume], 3))
    for name, surfaces in sets.items():
        gmsh.model.addPhysicalGroup(2, surfaces, name=name)
    use_smallest(gmsh, fields)
    set_mesh_options(gmsh, _OPTIONS)


def _rounded(length: float) -> float:
    return round(length, _DIGITS)


class _Drawing:
    """A model of gmsh in which profiles of a ``sketch`` are extruded."""

    def __init__(self, gmsh: Any, sketch: Sketch, rims: Rims) -> None:
        self.gmsh = gmsh
        self.model = gmsh.model
        self.occ = gmsh.model.occ
        self.sketch = sketch
        self.rims = rims
        self.lines = {name: lines_of(sketch, name) for name, faces in sketch.faces.items() if faces}

    def extruded(self, slab: Slab) -> list[int]:
        """The volumes of a ``slab``, one over each face."""
        places = self.sketch.points.items()
        point = {
            number: self.occ.addPoint(*map(_rounded, (*place, slab.bottom)))
            for (profile, place), number in places
            if profile == slab.profile
        }
        surfaces = []
        for face in self.sketch.faces[slab.profile]:
            curves = []
            for line in self.sketch.around_face(face):
                start, stop, *centre = (point[k] for k in self.sketch.curves[line - 1])
                add = self.occ.addCircleArc if centre else self.occ.addLine
                curves.append(add(start, *centre, stop))
            surfaces.append((2, self.occ.addPlaneSurface([self.occ.addCurveLoop(curves)])))
        height = _rounded(slab.top - slab.bottom)
        made = self.occ.extrude(surfaces, 0, 0, height)
        self.occ.synchronize()
        return [tag for dim, tag in made if dim == 3]

    def blunted(self, volume: int, slab: Slab) -> int:
        """The ``volume`` with a chamfer or a fillet where its bore ends."""
        rims = self.rims
        length = _rounded(rims.chamfer or rims.fillet)
        if not (length and slab.rims):
            return volume
        bore = bore_of(self.sketch, slab.profile)
        walls = []
        curves = []
        for wall in self._boundary(3, volume):
            if bore not in (self._sets_over(wall, slab) or ()):
                continue
            for curve in self._boundary(2, wall):
                if _is_among(self._middle(1, curve)[2], slab.rims):
                    walls.append(wall)
                    curves.append(curve)
        if rims.chamfer:
            made = self.occ.chamfer([volume], curves, walls, [length])
        else:
            made = self.occ.fillet([volume], curves, [length])
        self.occ.synchronize()
        return made[0][1]

    def joined(self, parts: Mapping[int, Slab]) -> dict[int, Slab]:
        """The volumes of a body, with common surfaces where they meet."""
        first, *others = ((3, volume) for volume in parts)
        if not others:
            return dict(parts)
        _, made = self.occ.fragment([first], others)
        self.occ.synchronize()
        return {volume: slab for [(_, volume)], slab in zip(made, parts.values(), strict=True)}

    def named_surfaces(self, parts: Mapping[int, Slab]) -> Iterator[tuple[str, int]]:
        """The surfaces of a body, each with the name of a set that it belongs to."""
        around_each = {volume: self._boundary(3, volume) for volume in parts}
        n_sides = Counter(surface for found in around_each.values() for surface in found)
        for volume, slab in parts.items():
            for surface in around_each[volume]:
                sets = self._sets_over(surface, slab)
                if sets is None and n_sides[surface] == 1:
                    sets = self._sets_across(surface, slab)
                for name in sets or ():
                    yield slab.names.get(name, name), surface

    def _boundary(self, dim: int, tag: int) -> list[int]:
        """The surfaces of a volume, or the curves of a surface."""
        found = self.model.getBoundary([(dim, tag)], oriented=False)
        return [tag for _, tag in found]

    def _middle(self, dim: int, tag: int) -> Array:
        """The point ``(3,)`` of a curve or a surface in the middle of its parameters."""
        low, high = self.model.getParametrizationBounds(dim, tag)
        return np.array(self.model.getValue(dim, tag, (low + high) / 2))

    def _sets_over(self, surface: int, slab: Slab) -> Sequence[str] | None:
        """The sets of the line that a ``surface`` stands over; None where it stands over none."""
        middle = self._middle(2, surface)[:2]
        for line in self.lines[slab.profile]:
            if np.abs(line.middle - middle).max() < _SAME and not self._is_flat(surface):
                return line.sets
        return None

    def _is_flat(self, surface: int) -> bool:
        """Whether a ``surface`` lies across z."""
        low, high = self.model.getParametrizationBounds(2, surface)
        normal = self.model.getNormal(surface, (low + high) / 2)
        return abs(normal[2]) > 1 - _SAME

    def _sets_across(self, surface: int, slab: Slab) -> list[str]:
        """The sets of a flat end, a chamfer or a fillet."""
        if self._is_flat(surface):
            return [MIDDLE if abs(self._middle(2, surface)[2]) < _SAME else FACES]
        return [RIM, bore_of(self.sketch, slab.profile)]

    def rim_sizes(self, slabs: Sequence[Slab]) -> list[int]:
        """Fields of element sizes that grow from where bores end."""
        if self.rims.ratio == 1 and not self.rims.fillet:
            return []
        largest = _OF_FILLET * self.rims.fillet or np.inf  # coarser cells are folded
        fields = []
        for bore, slab in product(self.sketch.bores, slabs):
            if bore.facets != bore_of(self.sketch, slab.profile):
                continue
            circle = self.sketch.circles[bore.facets]
            smallest = min(self.rims.ratio * bore.size, largest)
            for height in slab.rims:
                off = (
                    f"Sqrt(({around(circle.centre[0])} - {circle.radius!r})^2 + (z - {height!r})^2)"
                )
                fields.append(self.size(f"{smallest!r} + {bore.growth!r} * {off}"))
        return fields

    def size(self, expression: str) -> int:
        """A field of the element size by an ``expression``, whose numbers are rounded."""
        size = _NUMBER.sub(lambda number: repr(_rounded(float(number[0]))), expression)
        return size_field(self.gmsh, size)

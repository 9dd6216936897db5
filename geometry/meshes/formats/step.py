"""Solids of CAD in STEP and BREP files, meshed by gmsh, with the names of solids and faces."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from archord.geometry.meshes.fenicsx import size_field, use_smallest

SUFFIXES = (".step", ".stp", ".brep")
# a complex entity, as a rational spline, has several kinds within its brackets and none before them
_ENTITY = re.compile(r"#(\d+)\s*=\s*(\w*)\s*\((.*?)\)\s*;", re.DOTALL)
_REFERENCE = re.compile(r"#(\d+)")
_NAME = re.compile(r"\s*'((?:[^']|'')*)'")
_SURFACES = {"PLANE": "Plane", "CYLINDRICAL_SURFACE": "Cylinder", "CONICAL_SURFACE": "Cone"}
_NAMELESS = "Open CASCADE STEP translator"  # the label of solids that nobody has named
_ACROSS = 10  # elements along the largest extent
_AROUND = 24  # elements around a circle, at least
_GROWTH = 0.3  # of elements away from a face with a size of its own, per unit of distance


class Sizes(NamedTuple):
    """Element sizes for solids of CAD: the largest one, a tenth of the extent if absent, and sizes
    ``on`` faces by their names, from which elements grow."""

    size: float | None = None
    on: Mapping[str, float] = MappingProxyType({})


def mesh_step(gmsh: Any, path: Path, order: int, sizes: Sizes) -> None:
    """Mesh the solids of a file with tetrahedra of this ``order`` and these ``sizes``. Raises
    ValueError.

    Solids are the sets "solid 1", "solid 2", ..., faces "face 1", "face 2", ...; both are also sets
    by their names in a STEP file, all of one name together.
    """
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    if not solids:
        raise ValueError("has no solid, only faces or curves")
    paths = {tag: gmsh.model.getEntityName(3, tag) for tag in solids}
    labels = {tag: path.split("/")[-1] for tag, path in paths.items()}
    labels = {tag: name for tag, name in labels.items() if not name.startswith(_NAMELESS)}
    bodies = _sets("solid", solids, labels)
    surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
    face_names = _face_names(gmsh, path, solids)
    faces = _sets("face", surfaces, face_names)
    for dim, sets in ((3, bodies), (2, faces)):
        for name, tags in sets.items():
            gmsh.model.addPhysicalGroup(dim, tags, name=name)
    _set_sizes(gmsh, faces, sizes)
    gmsh.model.mesh.generate(3)
    gmsh.model.mesh.setOrder(order)


def _sets(what: str, tags: list[int], names: Mapping[int, str]) -> dict[str, list[int]]:
    """Sets of each of the ``tags`` by ``what`` it is and its number, and of all with one name."""
    sets = {f"{what} {tag}": [tag] for tag in tags}
    for tag, name in names.items():
        if name:
            sets.setdefault(name, []).append(tag)
    return sets


def _set_sizes(gmsh: Any, faces: Mapping[str, list[int]], sizes: Sizes) -> None:
    lowest, highest = np.reshape(gmsh.model.getBoundingBox(-1, -1), (2, 3))
    largest = sizes.size or np.max(highest - lowest) / _ACROSS
    gmsh.option.setNumber("Mesh.MeshSizeMax", largest)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", _AROUND)
    field = gmsh.model.mesh.field
    grown = []
    for name, on_face in sizes.on.items():
        if name not in faces:
            known = ", ".join(faces)
            raise ValueError(f"mesh.sizes: there is no face {name!r} for a size; there are {known}")
        away = field.add("Distance")
        field.setNumbers(away, "SurfacesList", faces[name])
        grown.append(size_field(gmsh, f"{on_face} + {_GROWTH} * F{away}"))
    if grown:
        use_smallest(gmsh, grown)


def _face_names(gmsh: Any, path: Path, solids: list[int]) -> dict[int, str]:
    """The names that a STEP file gives to faces, which gmsh does not read, by gmsh's numbers.

    Solids and their faces have the same order in the file and in gmsh. There are no names where
    they differ in number or kind, as in a file that places one part twice.
    """
    text = path.read_text(encoding="utf-8", errors="replace")
    entities = {number: (kind, parts) for number, kind, parts in _ENTITY.findall(text)}

    def last_of(parts: str) -> tuple[str, str]:
        return entities[_REFERENCE.findall(parts)[-1]]

    listed = []
    for kind, parts in entities.values():
        if kind == "MANIFOLD_SOLID_BREP":
            _, shell = last_of(parts)
            listed.append([entities[number][1] for number in _REFERENCE.findall(shell)])
    numbers = [
        [tag for _, tag in gmsh.model.getBoundary([(3, solid)], oriented=False)] for solid in solids
    ]
    if [len(faces) for faces in listed] != [len(tags) for tags in numbers]:
        return {}
    names = {}
    for faces, tags in zip(listed, numbers, strict=True):
        for parts, tag in zip(faces, tags, strict=True):
            surface = gmsh.model.getType(2, tag)
            if _SURFACES.get(last_of(parts)[0], surface) != surface:
                return {}
            name = _NAME.match(parts)
            names[tag] = name[1].strip() if name else ""
    return names

"""The lines of a deck for nodes, elements, sets and surfaces."""

from __future__ import annotations

import numpy as np

from archord.geometry.basis import Array
from archord.materials.kinematics import Ints
from archord.postprocess.decks.mesh import label, surface_name
from archord.postprocess.decks.model import DeckModel
from archord.postprocess.decks.rows import continued, joined, number

_FAMILIES = {"strain": "CPE", "stress": "CPS", "axisymmetric": "CAX", "space": "C3D"}
_MODELS = {"axisymmetric": "axisymmetric, printed forces", "space": "in space, forces"}
ALL_NODES = "ALL_NODES"  # the deck's own node sets, beside the sets of the problem
DRIVES = "DRIVES"
_REDUCED = 20  # nodes of elements with reduced integration, as archord has but for contact


def mesh_lines(model: DeckModel, heading: str) -> list[str]:
    """Nodes, elements, sets and surfaces."""
    mesh = model.mesh
    whole = number(model.problem.whole / model.thick)
    words = _MODELS.get(model.problem.kinematics.name, f"thickness {number(model.thick)}, forces")
    lines = ["*HEADING", f"archord: {heading}; {words} times {whole} are of the whole"]
    lines.append(f"*NODE, NSET={ALL_NODES}")
    x = _drawn(model)
    for i in range(len(x)):
        place = [number(x[i, axis]) for axis in range(x.shape[1])]
        lines.append(", ".join([str(i + 1), *place]))
    if model.own:
        lines.append(f"*NODE, NSET={DRIVES}")
        lines += [f"{node}, 0., 0." for node in model.own.values()]
    first = 1
    for name, nodes in mesh.elements.items():
        lines.append(f"*ELEMENT, TYPE={_type(model, nodes)}, ELSET={label(name)}")
        numbers = first + np.arange(len(nodes))
        for element in np.column_stack([numbers, nodes + 1]):
            lines += continued(element)
        first += len(nodes)
    of_surfaces = {name: surface.nodes for name, surface in mesh.surfaces.items()}
    sets = of_surfaces | mesh.node_sets
    for name, nodes in sets.items():
        lines.append(f"*NSET, NSET={label(name)}")
        listed = np.unique(nodes) + 1
        lines += joined(np.split(listed, range(10, len(listed), 10)))
    for name, surface in mesh.surfaces.items():
        lines.append(f"*SURFACE, NAME={label(name)}_SURFACE, TYPE=ELEMENT")
        for element, side in zip(surface.elements, surface.sides, strict=True):
            lines.append(f"{element + 1}, S{side + 1}")
    return lines


def _type(model: DeckModel, nodes: Ints) -> str:
    """The type of elements with these ``nodes`` ``(m, k)``."""
    n = nodes.shape[1]
    kind = f"{_FAMILIES[model.problem.kinematics.name]}{n}"
    return f"{kind}R" if n == _REDUCED else kind


def _drawn(model: DeckModel) -> Array:
    """Nodes ``(n, d)`` that overlap by the interferences."""
    x = model.mesh.x.copy()
    for i in model.problem.interactions:
        nodes = model.mesh.surfaces[surface_name(i, 0)].nodes
        normals = np.zeros_like(x)
        of_sides = _outward(model.mesh.x[nodes])
        np.add.at(normals, nodes, of_sides[:, None])
        at = np.unique(nodes)
        normal = normals[at]
        length = np.linalg.norm(normal, axis=1)
        x[at] += i.interference * normal / length[:, None]
    return x


def _outward(x: Array) -> Array:
    """Normals ``(n, d)`` of sides by their nodes ``x`` ``(n, k, d)``, as long as the sides are
    large."""
    start = x[:, 0]
    if x.shape[2] == 2:
        along = x[:, 1] - start
        return along[:, ::-1] * [1.0, -1.0]
    last = x.shape[1] // 2 - 1
    return np.cross(x[:, last] - start, x[:, 1] - start)

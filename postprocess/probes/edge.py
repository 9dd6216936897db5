"""Stresses and other quantities at the nodes of an edge, in a plane and in space."""

from __future__ import annotations

import numpy as np

from archord.geometry.vectors import unit
from archord.materials.kinematics import Bools, Ints
from archord.materials.material import Array, Arrays
from archord.postprocess.arrays.fields import Fields
from archord.postprocess.probes.angles import angles_about, rising
from archord.postprocess.probes.meeting import meeting
from archord.postprocess.probes.probed import Along, Probed, nodal
from archord.report.errors import InputError

_SMOOTH = 0.9  # cosine of the angle between facets without a corner
_NODES = np.array([0.0, 0.5, 1.0])  # of a facet, along it


def along_edge(run: Probed, edge: str, quantity: str, step: int) -> Along:
    """Values at the nodes of an edge, with the stress along it and across."""
    fields = run.fields(step)
    if run.kinematics.dimension == 3:
        return _at_meeting(run, fields, edge, quantity)
    edges = [name for name, facets in fields.edges.items() if len(facets)]
    if edge not in edges:
        known = ", ".join(edges) or "none"
        raise InputError(run.folder, f"has no edge {edge!r}; its edges are {known}.")
    nodes, s, radius = _along(fields, edge)
    tangent, joined = _tangents(run, fields, nodes)
    stresses = {}
    if fields.stress is not None:
        stress = fields.stress[nodes]
        stresses = _stresses(stress, tangent)
        if run.kinematics.has_hoop:
            stresses["along"] = stresses["hoop"]
            stresses["hoop"] = stress[..., 2]
    values = nodal(run, fields, quantity, nodes, **stresses)
    found = _once(fields, nodes, joined, s, values)
    if not radius:
        return found
    return found._replace(angle=np.degrees(found.s / radius))


def _stresses(stress: Array, tangent: Array) -> Arrays:
    """The stress along an edge, across it, and their shear ``(k, 3)``, of the ``stress`` ``(k, 3,
    4)`` in axes."""
    xx, yy, _, xy = np.moveaxis(stress, -1, 0)
    c, d = np.moveaxis(tangent, -1, 0)
    along = xx * c**2 + yy * d**2 + 2 * xy * c * d
    across = xx + yy - along
    shear = (yy - xx) * c * d + xy * (c**2 - d**2)
    return {"hoop": along, "normal": across, "shear": shear}


def _at_meeting(run: Probed, fields: Fields, edge: str, quantity: str) -> Along:
    """Values at the nodes where two surfaces in space meet, with the stress along the edge."""
    from archord.geometry.curve import Curve

    nodes = meeting(fields, edge)
    s = Curve(fields.coordinates, 2, nodes).arc_length(_NODES)
    tangent, joined = _tangents(run, fields, nodes)
    stresses = {}
    if fields.stress is not None:
        xx, yy, zz, xy, yz, zx = np.moveaxis(fields.stress[nodes], -1, 0)
        a, b, c = np.moveaxis(tangent, -1, 0)
        normal = xx * a**2 + yy * b**2 + zz * c**2
        shear = xy * a * b + yz * b * c + zx * c * a
        stresses["hoop"] = normal + 2 * shear
    values = nodal(run, fields, quantity, nodes, **stresses)
    return _once(fields, nodes, joined, s, values)


def _once(fields: Fields, nodes: Ints, joined: Bools, s: Array, values: Array) -> Along:
    """``values`` and ``s`` ``(k, 3)`` at the ``nodes`` ``(k, 3)`` of facets, each node once: the
    last node of a facet that is ``joined`` to the next one is the first node there."""
    shown = np.ones(nodes.shape, dtype=bool)
    shown[:, 2] = ~joined
    x = fields.coordinates[nodes[shown]]
    return Along(x, s[shown], values[shown])


def _along(fields: Fields, edge: str) -> tuple[Ints, Array, float]:
    """Nodes ``(k, 3)`` along the facets of an ``edge``, piece by piece, with the body on the left,
    but on arcs counterclockwise; ``s`` ``(k, 3)`` of a `Probe` there, and the radius of an arc
    (else 0)."""
    from archord.geometry.curve import Curve, circle_through, in_pieces

    x = fields.coordinates
    all_facets = fields.facets()
    on_edge = np.isin(all_facets[:, 1], fields.edges[edge][:, 1])
    nodes = all_facets[on_edge]
    _, once = np.unique(nodes[:, 1], return_index=True)
    nodes = nodes[once]
    starts = x[nodes[:, 0]]
    height: Array = starts @ [1.0, 1e-3]
    radius = 0.0
    circle = circle_through(x[np.unique(nodes)])
    if circle is not None:
        centre, radius = circle
        begin = angles_about(starts, centre)
        end = angles_about(x[nodes[:, 2]], centre)
        turned = (end - begin + 180) % 360 - 180
        if turned.sum() < 0:
            nodes = nodes[:, ::-1]
            begin, end = end, begin
        height = rising(begin, begin, end)
    if len(np.unique(nodes[:, 0])) < len(nodes):
        raise InputError(
            f"edge {edge!r}: branches, or lies within a body, so that nothing can be said along it."
        )
    order = in_pieces(nodes[:, 0], nodes[:, 2], height)
    nodes = nodes[order]
    s = Curve(x, 2, nodes).arc_length(_NODES)
    if radius:
        begin_of_facets = radius * np.radians(height[order])
        s += begin_of_facets[:, None] - s[:, :1]
    return nodes, s, radius


def _tangents(run: Probed, fields: Fields, nodes: Ints) -> tuple[Array, Bools]:
    """Unit tangents ``(k, 3, d)`` at the ``nodes`` ``(k, 3)`` of facets, where two meet without a
    corner their mean; and which facets ``(k,)`` are so followed by the next. At large strain they
    are tangents of the deformed edge, on which true stresses act."""
    undeformed = _slopes(fields.coordinates[nodes])
    here, after = np.nonzero(nodes[:, 2:] == nodes[:, 0])
    cosine = (undeformed[here, 2] * undeformed[after, 0]).sum(axis=1)
    smooth = cosine > _SMOOTH
    here = here[smooth]
    after = after[smooth]
    tangent = undeformed
    if run.scene.analysis.strain == "large":
        tangent = _slopes(fields.deformed[nodes])
    mean = unit(tangent[here, 2] + tangent[after, 0])
    tangent[here, 2] = mean
    tangent[after, 0] = mean
    followed = here[after == here + 1]
    return tangent, np.isin(np.arange(len(nodes)), followed)


def _slopes(x: Array) -> Array:
    """Unit tangents ``(k, 3, d)`` at the nodes ``x`` ``(k, 3, d)`` of each facet alone."""
    by_ends = [[-3, 4, -1], [-1, 0, 1], [1, -4, 3]]  # of the parabola, at its nodes
    return unit(np.einsum("qa,fai->fqi", by_ends, x))

"""What acts in contact, along a surface of a plane problem."""

from __future__ import annotations

import numpy as np

from archord.postprocess.arrays.arc import undeformed
from archord.postprocess.probes.angles import angles_about, rising
from archord.postprocess.probes.probed import Along, Probed
from archord.report.errors import InputError

CONTACT = {
    "pressure": "pressure",
    "facet_pressure": "pressure",
    "gap": "gap",
    "contact_shear": "shear",
}


def along_surface(run: Probed, edge: str, quantity: str, step: int) -> Along:
    """Values at the integration points of a surface, or means of its facets."""
    # with bases, which most readers of runs do without
    from archord.geometry.curve import circle_through

    if run.kinematics.dimension == 3:
        raise InputError(
            run.folder,
            f"the {quantity} of a surface in space is no curve; Run.unrolled and "
            "Run.contact have it, and archord export --csv.",
        )
    arc = run.arc(step, edge)
    at_points = getattr(arc, CONTACT[quantity])
    if at_points is None:
        raise InputError(run.folder, f"has no {quantity}, as its contacts have no friction.")
    x = undeformed(arc, edge, run.scene)
    circle = circle_through(x.reshape(-1, 2))
    share = arc.weight / arc.width[:, None]
    means = Along(*(np.einsum("fq,fq...->f...", share, v) for v in (x, arc.s, at_points)))
    if quantity == "facet_pressure":
        found = means
    else:
        found = Along(x.reshape(-1, 2), arc.s.ravel(), at_points.ravel())
    if circle is None:
        return found
    centre, radius = circle
    lengths = arc.weight / run.kinematics.measure(x)  # the weights of areas
    length = lengths.sum(axis=1)
    middle = angles_about(np.einsum("fq,fqi->fi", lengths / length[:, None], x), centre)
    half = np.degrees(length / (2 * radius))
    angle = rising(angles_about(found.x, centre), middle - half, middle + half)
    angle -= 360 * np.floor(angle.min() / 360)
    order = np.argsort(angle)
    angle = angle[order]
    return Along(found.x[order], np.radians(angle) * radius, found.values[order], angle)

"""Contact of two surfaces that may not match: which of them are integrated, and with what gamma.

The unbiased form gives like bodies one half each; of unlike bodies the softer takes more, in proportion to the
compliances (Annavarapu, Hautefeuille and Dolbow 2012), or a stiff body's gamma would swamp the other's. The one-sided
form integrates one side only.

gamma is ``gamma_factor`` times the share times the trace constant ``c`` of each contact cell,
``|sigma_n(v)|^2 <= c a(v, v)``. The form is coercive where ``gamma > share c / 4``: Cauchy-Schwarz and ``c`` bound
``share * integral of sigma_n v_n`` by ``sqrt(a(v, v)) * share sqrt(c) |v_n|``, which ``a(v, v) + share gamma |v_n|^2``
exceeds.

Each side's quadrature respects the facets of the opposite one where the undeformed surfaces touch (`segment_rule`), so
that meshes that match nowhere pass the patch tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError
from archord.solver.contact.law import LAWS, ContactLaw
from archord.solver.contact.pair import Pair
from archord.solver.contact.quadrature import segment_rule
from archord.solver.contact.surface import RigidSurface, Surface

GAMMA_FACTOR = 0.5  # twice the bound of coercivity; larger values stiffen the edge of the contact and cost iterations
Kinematics = Literal["current", "reference"]


class Interaction:
    """Contact of two ``surfaces``, of which the first may be rigid, by a ``law``.

    Under current ``kinematics`` the closest points are those of the deformed surfaces, under reference kinematics those
    of the undeformed ones, with the normal of the first surface for both, and the gap is linear in the displacement; a
    law whose points do not slide has no other. ``integrated`` is the number of the one surface that is integrated, both
    are without. ``slide`` is how far pairs are expected to slide, for which the matrix gets room from the start.
    Collective; raises `ProjectionError` on every rank if a point on any of them finds no partner.
    """

    def __init__(
        self,
        name: str,
        surfaces: Sequence[Surface | RigidSurface],
        *,
        law: ContactLaw = LAWS["frictionless"],
        kinematics: Kinematics = "current",
        gamma_factor: float = GAMMA_FACTOR,
        integrated: int | None = None,
        slide: float = 0.0,
    ) -> None:
        self.name, self.surfaces, self.gamma_factor = name, list(surfaces), gamma_factor
        self.bodies = [surface for surface in surfaces if isinstance(surface, Surface)]
        self.rigid = [surface for surface in surfaces if isinstance(surface, RigidSurface)]
        moves = law.slides and kinematics == "current"
        self.slide = slide if moves else 0.0
        chosen = [own for own in self.bodies if integrated is None or own is surfaces[integrated]]
        compliance = np.array([1 / own.material.elastic_tangent[0, 0] for own in chosen])
        self.pairs: list[Pair] = []
        failure = None
        for own, share in zip(chosen, compliance / compliance.sum(), strict=True):
            opposite = surfaces[1] if own is surfaces[0] else surfaces[0]
            try:
                if isinstance(opposite, Surface):
                    own.place_points(*segment_rule(own.curve, opposite.curve))
                self.pairs.append(Pair(own, opposite, law, float(share), moves=moves))
            except ProjectionError as error:
                failure = str(error)
        if failure := first_failure(self.bodies[0].comm, failure):
            raise ProjectionError(failure)
        if not moves and not self.rigid and chosen[0] is surfaces[0]:
            self.pairs[0].use_own_normals()
        self.limit_gamma(gamma_factor)

    def limit_gamma(self, factor: float) -> None:
        """Use the own gamma factor, or ``factor`` where that is less."""
        for pair in self.pairs:
            pair.use_gamma(min(self.gamma_factor, factor))

    def resultant(self) -> Array:
        """Contact force ``(2,)`` on the second surface, over all ranks."""
        total = np.zeros(2)
        for pair in self.pairs:
            total += pair.forces.sum(0) * (1 if pair.surface is self.surfaces[1] else -1)
        return self.bodies[0].sum_over_ranks(total)


def first_failure(comm: MPI.Comm, failure: str | None) -> str | None:
    """The first of what the ranks report, on all of them."""
    return next((f for f in comm.allgather(failure) if f), None)

"""Contact of two surfaces that may not match: which of them are integrated, and with what gamma.

The unbiased form gives bodies shares in proportion to their compliances (Annavarapu, Hautefeuille
and Dolbow 2012), or a stiff body's gamma would swamp the other's. The one-sided form integrates one
side only.

gamma is ``gamma_factor`` times the share times the trace constant ``c`` of each contact cell,
``|sigma_n(v)|^2 <= c a(v, v)``. The form is coercive where ``gamma > share c / 4``: Cauchy-Schwarz
and ``c`` bound ``share * integral of sigma_n v_n`` by ``sqrt(a(v, v)) * share sqrt(c) |v_n|``,
which ``a(v, v) + share gamma |v_n|^2`` exceeds.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.curve import ProjectionError, RigidCircle
from archord.solver.contact.law import ContactLaw, contact_law
from archord.solver.contact.pair import Pair
from archord.solver.contact.quadrature import segment_rule
from archord.solver.contact.surface import RigidSurface, Surface

Vector = tuple[float, float]
# twice the bound of coercivity; larger values stiffen the edge of the contact and cost iterations
GAMMA_FACTOR = 0.5


@dataclass(frozen=True)
class Rigid:
    """A rigid disc displaced by ``rate`` times the displacement of the ``drive``, or by rates of
    drives by name."""

    circle: RigidCircle
    rate: Vector | Mapping[str, Vector] = (0.0, 0.0)
    drive: str = ""

    def moved_by(self) -> dict[str, Vector]:
        """Its rates by the names of the drives that move it."""
        rates = self.rate if isinstance(self.rate, Mapping) else {self.drive: self.rate}
        return {name: rate for name, rate in rates.items() if any(rate)}


@dataclass(frozen=True)
class Interaction:
    """Contact of two ``surfaces``, facet sets of one body each, of which the first may be a rigid
    disc.

    ``law`` is "frictionless", "tied" or a `ContactLaw`; ``friction`` is Coulomb's coefficient.
    Under ``kinematics`` "current" the closest points are those of the deformed curves, under
    "reference" those of the undeformed ones, with the normal of the first surface for both, and the
    gap is linear in the displacement; a law whose points do not slide has no other.
    ``gamma_factor`` is Nitsche's gamma over the trace constant of each contact cell. ``integrated``
    names the one facet set whose points carry the contact, both do if empty. The matrix gets room
    from the start for pairs that ``slide`` as far as this.

    The gap of the law is that between the surfaces, less ``interference``, which their mesh does
    not show; ``overlap`` is what it shows. Both grow in a stage of the fit, to ``s``: the gap gets
    ``overlap (1 - s) - interference s``.
    """

    name: str
    surfaces: tuple[str | Rigid, str]
    law: str | ContactLaw = "frictionless"
    friction: float = 0.0
    kinematics: Literal["current", "reference"] = "current"
    gamma_factor: float = GAMMA_FACTOR
    integrated: str = ""
    slide: float = 0.0
    interference: float = 0.0
    overlap: float = 0.0


class Interface:
    """The ``interaction`` of two ``surfaces`` as pairs of them. Collective; raises ValueError if
    none is integrated, or an interference is tied, and `ProjectionError` on every rank if a point
    on any finds no partner."""

    def __init__(
        self, interaction: Interaction, surfaces: Sequence[Surface | RigidSurface]
    ) -> None:
        self.interaction, self.surfaces = interaction, list(surfaces)
        law = contact_law(interaction.law, interaction.friction)
        moves = law.slides and interaction.kinematics == "current"
        self.slide = interaction.slide if moves else 0.0
        given = zip(surfaces, interaction.surfaces, strict=True)
        chosen = [
            own
            for own, name in given
            if isinstance(own, Surface) and interaction.integrated in ("", name)
        ]
        if not law.slides and (interaction.interference or interaction.overlap):
            raise ValueError(
                f"{interaction.name!r} is tied: it keeps its gaps, and knows no interference or overlap"
            )
        if not chosen:
            raise ValueError(
                f"{interaction.name!r} does not have the surface {interaction.integrated!r}"
            )
        compliance = np.array([1 / own.material.elastic_tangent[0, 0] for own in chosen])
        self.pairs: list[Pair] = []
        with on_every_rank(chosen[0].comm):
            for own, share in zip(chosen, compliance / compliance.sum(), strict=True):
                opposite = surfaces[1] if own is surfaces[0] else surfaces[0]
                if isinstance(opposite, Surface):
                    own.place_points(*segment_rule(own.curve, opposite.curve))
                self.pairs.append(Pair(own, opposite, law, float(share), moves=moves))
        if not moves and isinstance(surfaces[1], Surface) and chosen[0] is surfaces[0]:
            self.pairs[0].use_own_normals()
        self.fit(1.0)

    def fit(self, part: float) -> None:
        """Let interferences be there by this ``part``."""
        for pair in self.pairs:
            pair.offset = (
                self.interaction.overlap * (1 - part) - self.interaction.interference * part
            )

    def resultant(self) -> Array:
        """Contact force ``(2,)`` on the second surface, over all ranks."""
        return self._summed([pair.forces for pair in self.pairs])

    def moment(self, point: Array) -> float:
        """Moment of that force about ``point`` ``(2,)``, anticlockwise, over all ranks."""
        arms = [pair.place - point for pair in self.pairs]
        forces = [pair.forces for pair in self.pairs]
        crossed = [
            a[:, :1] * f[:, 1:] - a[:, 1:] * f[:, :1] for a, f in zip(arms, forces, strict=True)
        ]
        return float(self._summed(crossed)[0])

    def pressed(self) -> float:
        """Sum of the sizes of the contact forces of all points, over all ranks: what a fit presses
        with, too, of which the resultant is zero."""
        sizes = [np.linalg.norm(pair.forces, axis=1).sum() for pair in self.pairs]
        return self.pairs[0].surface.comm.allreduce(float(sum(sizes)))

    def _summed(self, on_own: Sequence[Array]) -> Array:
        """What the points of each pair get from the other surface ``(m, k)``, summed over those of
        the second."""
        signs = [1 if pair.surface is self.surfaces[1] else -1 for pair in self.pairs]
        total = sum(sign * values.sum(0) for sign, values in zip(signs, on_own, strict=True))
        return self.pairs[0].surface.sum_over_ranks(np.asarray(total))


@contextmanager
def on_every_rank(comm: MPI.Comm) -> Iterator[None]:
    """Let a `ProjectionError` that any rank raises within the context be raised on all of them.
    Collective."""
    failure = None
    try:
        yield
    except ProjectionError as error:
        failure = str(error)
    if said := next((f for f in comm.allgather(failure) if f), None):
        raise ProjectionError(said)

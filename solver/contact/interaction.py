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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.curve import RigidCircle, RigidRound
from archord.geometry.rigid_in_space import RigidBall
from archord.report.errors import InputError, in_sentences, require_between, require_of
from archord.solver.contact.laws.law import ContactLaw, fault_of
from archord.solver.contact.laws.named import NAMES, contact_law
from archord.solver.contact.pair import Pair
from archord.solver.contact.surface import RigidSurface, Surface, on_every_rank

Vector = tuple[float, ...]
Within = Callable[[Array], np.ndarray]  # whether points (m, d) are in a part
# twice the bound of coercivity; larger values stiffen the edge of the contact and cost iterations
GAMMA_FACTOR = 0.5


@in_sentences
@dataclass(frozen=True)
class Rigid:
    """A rigid disc displaced by ``rate`` times the displacement of the ``drive``, or by rates of
    drives by name; in an axisymmetric problem a sphere on the axis, in space a ball or a
    cylinder."""

    circle: RigidCircle | RigidBall
    rate: Vector | Mapping[str, Vector] = (0.0, 0.0)
    drive: str = ""

    def moved_by(self) -> dict[str, Vector]:
        """Its rates by the names of the drives that move it."""
        rates = self.rate if isinstance(self.rate, Mapping) else {self.drive: self.rate}
        return {name: rate for name, rate in rates.items() if any(rate)}


@in_sentences
@dataclass(frozen=True)
class Interaction:
    """Contact of two surfaces, or of a rigid disc and a surface.

    Parameters
    ----------
    name : str
        The name of the interaction.
    surfaces : tuple of str
        Two facet sets, of one body each. The first may be a rigid disc, a `RigidCircle`, or in
        space a `RigidBall` or a `RigidCylinder`.
    law : str or ContactLaw
        The contact law: a name, "frictionless", "tied" or "coulomb", or an object that keeps the
        protocol of `archord.solver.contact.laws.law.ContactLaw`.
    friction : float
        Coulomb's coefficient of friction, of the laws "frictionless" and "coulomb".
    kinematics : {"current", "reference"}
        The kinematics of contact: closest points on the deformed curves; or on the undeformed ones,
        with the normal of the first surface for both, and a gap that is linear in the displacement.
        A law whose points do not slide has the second. The kinematics of a `Problem` are of strain.
    gamma_factor : float
        Nitsche's gamma over the trace constant of each contact cell.
    integrated : str
        The one facet set whose points carry the contact. By default both do, or the one on
        which no support, coupling or load acts.
    slide : float
        How far pairs slide that the matrix gets room for from the start.
    interference : float
        Of a press fit that the mesh does not show: how far the surfaces, drawn in touch, are pushed
        together. The gap gets ``-interference s``, and ``s`` grows to 1 in a stage of its own.
    overlap : float
        Of a press fit that the mesh shows: how deep the surfaces are drawn into each other. The gap
        gets ``overlap (1 - s)`` in the same stage.

    Raises
    ------
    InputError
        For surfaces that are not two, a law that is none, and values out of range.

    Examples
    --------
    >>> from archord import Interaction
    >>> Interaction("contact", ("bolt", "hole"), law="coulomb", friction=0.1).friction
    0.1
    """

    name: str
    surfaces: tuple[Any, str]
    law: str | ContactLaw = "frictionless"
    friction: float = 0.0
    kinematics: Literal["current", "reference"] = "current"
    gamma_factor: float = GAMMA_FACTOR
    integrated: str = ""
    slide: float = 0.0
    interference: float = 0.0
    overlap: float = 0.0

    def __post_init__(self) -> None:
        """Check the parts; raise `InputError`."""
        require_of(self, isinstance(self.name, str) and self.name != "", "name", "must be a name")
        kinds = (str, Rigid, RigidRound)
        two = not isinstance(self.surfaces, str) and len(self.surfaces) == 2
        known = two and isinstance(self.surfaces[0], kinds) and isinstance(self.surfaces[1], str)
        said = "must be two facet sets, or a rigid disc and one"
        require_of(self, known, "surfaces", said)
        require_of(self, self.surfaces[0] != self.surfaces[1], "surfaces", "must be different")
        named = isinstance(self.law, str) and self.law in NAMES
        is_law = ContactLaw in type(self.law).__mro__
        said = f"must be a contact law, or one of {', '.join(map(repr, NAMES))}"
        require_of(self, named or is_law, "law", said)
        said = 'must be "current" or "reference"'
        require_of(self, self.kinematics in ("current", "reference"), "kinematics", said)
        require_between(self, "gamma_factor", 0, np.inf, "must be positive and finite")
        for key in ("friction", "slide", "interference", "overlap"):
            said = "must not be negative, and be finite"
            require_between(self, key, 0, np.inf, said, least=True)
        try:
            contact_law(self.law, self.friction)
        except ValueError as error:
            raise InputError(f'archord.Interaction: interaction "{self.name}": {error}.') from None

    @property
    def disc(self) -> RigidCircle | RigidBall | None:
        """The rigid disc, in space a ball or a cylinder; None where both surfaces are of bodies."""
        first = self.surfaces[0]
        if isinstance(first, Rigid):
            return first.circle
        return None if isinstance(first, str) else first

    def lacking(self, dimension: int) -> str:
        """What problems of this ``dimension`` do not know of this interaction; empty if there is
        nothing."""
        disc = self.disc
        if disc is not None and disc.dimension != dimension:
            if dimension == 3:
                return "a rigid disc: in space there are a RigidBall and a RigidCylinder"
            return f"a {type(disc).__name__}: in a plane there is a RigidCircle"
        if dimension == 3 and contact_law(self.law, self.friction).in_space() is None:
            return "a law of slip for planes: space does not know it yet"
        return ""


class Interface:
    """The ``interaction`` of two ``surfaces`` as ``pairs`` of them, one for each surface that is
    integrated.

    ``slide`` is how far its points are expected to slide. Collective; raises ValueError if no
    surface is integrated, or an interference is tied, and `ProjectionError` on every rank if a
    point on any finds no partner.
    """

    def __init__(
        self, interaction: Interaction, surfaces: Sequence[Surface | RigidSurface]
    ) -> None:
        self.interaction = interaction
        self.surfaces = list(surfaces)
        law = contact_law(interaction.law, interaction.friction)
        if any(isinstance(surface, Surface) and surface.in_space for surface in surfaces):
            law = law.in_space() or law
        moves = law.slides and interaction.kinematics == "current"
        self.slide = interaction.slide if moves else 0.0
        if not law.slides and (interaction.interference or interaction.overlap):
            raise ValueError(
                f"{interaction.name!r} is tied: "
                "it keeps its gaps, and knows no interference or overlap"
            )
        integrated = self._integrated()
        if fault := fault_of(law, integrated[0].kinematics.dimension):
            raise ValueError(f"the contact law of {interaction.name!r} {fault}")
        if integrated[0].kinematics.has_hoop:
            self._require_on_axis()
        self._told = {*law.quantities(law.state(1))}
        self.pairs: list[Pair] = []
        with on_every_rank(integrated[0].comm):
            for own, share in zip(integrated, _shares(integrated), strict=True):
                opposite = surfaces[1] if own is surfaces[0] else surfaces[0]
                if isinstance(opposite, Surface):
                    own.face(opposite)
                self.pairs.append(Pair(own, opposite, law, share, moves=moves))
        if not moves and isinstance(surfaces[1], Surface) and integrated[0] is surfaces[0]:
            self.pairs[0].use_own_normals()
        self.fit(1.0)

    def _integrated(self) -> list[Surface]:
        """The surfaces whose points carry the contact."""
        interaction = self.interaction
        found = []
        for surface, given in zip(self.surfaces, interaction.surfaces, strict=True):
            is_chosen = interaction.integrated in ("", given)
            if isinstance(surface, Surface) and is_chosen:
                found.append(surface)
        if not found:
            raise ValueError(
                f"{interaction.name!r} does not have the surface {interaction.integrated!r}"
            )
        return found

    def _require_on_axis(self) -> None:
        """Raise ValueError for a rigid sphere that does not stay on the axis."""
        sphere = f"the rigid sphere of {self.interaction.name!r}"
        for given in self.interaction.surfaces:
            if not isinstance(given, Rigid):
                continue
            if given.circle.centre[0] != 0:
                raise ValueError(f"{sphere} must have its centre on the axis")
            if any(rate[0] for rate in given.moved_by().values()):
                raise ValueError(f"{sphere} must move along the axis")

    def fit(self, part: float) -> None:
        """Let interferences be there by this ``part``."""
        overlap_left = self.interaction.overlap * (1 - part)
        for pair in self.pairs:
            pair.offset = overlap_left - self.interaction.interference * part

    def resultant(self) -> Array:
        """Contact force ``(d,)`` on the second surface, over all ranks."""
        return self._summed([pair.forces for pair in self.pairs])

    def moments(self, point: Array, *, deformed: bool, within: Within | None = None) -> Array:
        """Moments ``(t,)`` of this force about ``point`` ``(d,)``, over all ranks, in the turns of
        the kinematics: anticlockwise in a plane. They are of the ``deformed`` surface, or as it
        was; of its places ``x`` ``(m, d)`` for which ``within(x)`` is true."""
        kinematics = self.pairs[0].surface.kinematics
        moments = []
        for pair in self.pairs:
            of_points = np.zeros((len(pair.forces), len(kinematics.turns)))
            place = pair.place(on_opposite=pair.surface is self.surfaces[0], deformed=deformed)
            forces = pair.forces
            if within is not None:
                forces = forces * within(place)[:, None]
            of_turns = kinematics.moments(place - point, forces)
            for turn, moment in enumerate(of_turns):
                of_points[:, turn] = moment
            moments.append(of_points)
        return self._summed(moments)

    def pressed(self) -> float:
        """Sum of the sizes of the contact forces of all points, over all ranks: what a fit presses
        with, too, whose resultant is zero."""
        sizes = [np.linalg.norm(pair.forces, axis=1).sum() for pair in self.pairs]
        return self.pairs[0].surface.comm.allreduce(float(sum(sizes)))

    def quantities(self) -> dict[str, tuple[float, str]]:
        """Integrals of the law's quantities over the surface, over all ranks, with their units, by
        name: at the last evaluation. Collective."""
        found: dict[str, tuple[float, str]] = {}
        for pair in self.pairs:
            for name, quantity in pair.law.quantities(pair.points.told()).items():
                before, _ = found.get(name, (0.0, ""))
                found[name] = before + pair.integral(quantity.density), quantity.unit
        comm = self.pairs[0].surface.comm
        return {name: (comm.allreduce(value), unit) for name, (value, unit) in found.items()}

    def fault_of_quantities(self) -> str:
        """What is wrong with the names of the law's quantities at the last evaluation: they make
        the columns of a history, and are the same on all ranks; empty if nothing is. Collective."""
        odd = set()
        for pair in self.pairs:
            odd |= self._told ^ {*pair.law.quantities(pair.points.told())}
        everywhere = set().union(*self.pairs[0].surface.comm.allgather(odd))
        if not everywhere:
            return ""
        names = ", ".join(map(repr, sorted(everywhere)))
        return (
            f"the contact law of {self.interaction.name!r} has the quantities {names} in some "
            "states alone; it must give them from the beginning, 0 where there is nothing yet"
        )

    def _summed(self, on_own: Sequence[Array]) -> Array:
        """What the points of each pair get from the other surface ``(m, k)``, summed over the
        points of the second."""
        total = 0.0
        for pair, values in zip(self.pairs, on_own, strict=True):
            sign = 1 if pair.surface is self.surfaces[1] else -1
            total = total + sign * values.sum(0)
        return self.pairs[0].surface.sum_over_ranks(np.asarray(total))


def _shares(integrated: Sequence[Surface]) -> list[float]:
    """Shares of the virtual work, in proportion to the compliances of the bodies."""
    compliance = np.array([1 / own.material.elastic_tangent[0, 0] for own in integrated])
    return [float(share) for share in compliance / compliance.sum()]

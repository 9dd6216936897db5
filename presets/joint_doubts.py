"""What to warn of before and after the steps of a joint, and when its run does not count as
done."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from archord.measures.doubts import (
    LARGE,
    Check,
    balance_doubts,
    contrast_doubts,
    distortion_doubts,
    few_facets,
    hardening_doubts,
    round_off_doubts,
    told_of_facets,
)
from archord.measures.measure import Accepted
from archord.measures.record import Record
from archord.report.doubts import Doubt
from archord.scene.presets.joint import Scene
from archord.scene.sections.analysis import friction_doubts
from archord.solver.path.system import System

_FEWEST_FACETS = 5
_ROUGH = 0.01  # of the clearance
APART = (
    "the bodies never touched: P is 0 in every step, as the load never presses the pin into the "
    "hole; give a displacement or a force above 0 if it should"
)
AWAY = (
    "the bodies touch, but not on the contact axis, where p0 is measured and from where eps is: "
    "their columns say nothing of this step"
)
UNSEEN = (
    "no contact point was ever pressed, though delta was positive: the contact is smaller than the "
    "mesh can see; reduce joint.element_size or increase the load"
)
_AT_END = (
    "the contact reaches the end of the modelled quarter arc, beyond which it cannot spread; load "
    "less far"
)
_UNBALANCED = "forces at pin, contact and block differ by {:.1e} of P"


def before_steps(scene: Scene, system: System) -> list[str]:
    """The scene's doubts, and a warning if the parabolic facets depart too much from their circles
    for the clearance.

    A parabola through ends and middle of an arc of half-angle ``a`` is off by
    ``R (1 - cos a)^2/8``. Equal facets that face each other are off alike, which leaves the gap as
    it is.
    """
    joint = scene.joint
    doubts = [*scene.doubts, *friction_doubts({"analysis.friction": scene.analysis.friction})]
    doubts += contrast_doubts(system.problem.bodies)
    if joint.size_ratio == 1 and not scene.pin.rigid:
        return doubts
    longest = max(side.facet_lengths().max(initial=0.0) for side in system.sides.values())
    half_angle = longest / joint.radius / 2
    off = (1 - np.cos(half_angle)) ** 2 / 8 * joint.radius / abs(joint.dR)
    if off > _ROUGH:
        doubts.append(
            "the elements on the arcs are too long for the clearance, they depart from the "
            f"circles by {off:.1g} dR; reduce joint.element_size"
        )
    return doubts


def step_checks(scene: Scene, system: System) -> list[Check]:
    """What to warn of after every step, in this order."""
    small = scene.analysis.strain == "small"

    def contact(state: Accepted, m: Record) -> Iterator[str]:
        closed = [profile.in_contact > 0 for profile in state.profiles.values()]
        if scene.joint.arc_end < np.pi and any(facets[-1] for facets in closed):
            yield _AT_END
        on_axis = any(facets[0] for facets in closed)
        if scene.joint.is_ring and m.contact_area and not on_axis:
            yield AWAY
        before = [earlier["p0"] for earlier in state.before]
        if m.contact_area > 0 and told_of_facets(m["p0"], before):
            touching = max(1, min(int(facets.sum()) for facets in closed))
            yield from few_facets(touching, _FEWEST_FACETS, "", "a smaller element_size")

    def core(state: Accepted, m: Record) -> Iterator[str]:
        peeq = core_peeq(scene, system)
        if peeq > 0:
            text = (
                f"the pin yields where the force is applied, with PEEQ up to {peeq:.1e} in its "
                "core, and delta, the mean displacement of the core, contains by how much it is "
                "squashed there; a larger load.core_radius would spread the force"
            )
            yield Doubt(text, peeq)

    def strains(state: Accepted, m: Record) -> Iterator[str]:
        delta = abs(m["delta"])
        far = delta > scene.small * scene.joint.radius
        if far and not scene.doubts_of_strain:
            text = (
                f"delta exceeds {scene.small:.2g} R: small-strain theory makes P too low, "
                f"relatively by about {scene.too_low:g} delta/R; {LARGE}"
            )
            yield Doubt(text, delta)
        yield from distortion_doubts(system, m["peeq_max"], small=small and not far)
        yield from hardening_doubts(state)

    def balances(state: Accepted, m: Record) -> Iterator[str]:
        if m.contact_area:
            yield from round_off_doubts(state, scene.analysis.tolerance)
        yield from balance_doubts(m, _UNBALANCED, scene.analysis.tolerance)

    return [contact, core, strains, balances]


def ending(steps: Sequence[Record]) -> tuple[str, list[str]]:
    """Why a run that came to its end does not count as done, as no contact point noticed that the
    bodies are pressed together, or nothing; and a warning where they never were."""
    if any(m.contact_area for m in steps):
        return "", []
    if any(m["delta"] > 0 for m in steps):
        return UNSEEN, []
    return "", [APART]


def core_peeq(scene: Scene, system: System) -> float:
    """Largest PEEQ within the core of a ring's pin, whose mean displacement is delta; 0 for a
    block. Collective."""
    if not scene.joint.is_ring:
        return 0.0
    radius = scene.load.core_radius * scene.joint.radius
    bodies = system.problem.bodies
    pin = [body for body in bodies if body.name == "pin" and body.material.yields]
    return system.largest_peeq(*pin, within=lambda x: np.linalg.norm(x, axis=1) < radius)[0]

"""The account of a joint: its steps, what run.json says of its mesh and model, and what its user is
warned of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from operator import attrgetter
from typing import Any, ClassVar

import numpy as np

from archord.materials.material import Array
from archord.presets.arc import SYMMETRY, ArcProfile, arc_profiles, peak_pressure, semi_angle
from archord.presets.edge import per_step
from archord.presets.joint import Joint
from archord.presets.measures import (
    ENERGIES,
    LARGE,
    Measures,
    contrast_doubts,
    costs,
    distortion_doubts,
    energy_balance,
    headed,
    told_of_facets,
    work_doubts,
)
from archord.report.doubts import Doubt
from archord.scene.sections import friction_doubts
from archord.solver.path.stepping import Step
from archord.solver.path.system import System

_FEW_FACETS = 5
_ROUGH = 0.01  # of the clearance
_NOTHING = 1e-9  # of the forces on nodes: a P that is round-off
APART = (
    "the bodies never touched: P is 0 in every step, as the load never presses the pin into the hole; give a "
    "displacement or a force above 0 if it should"
)
AWAY = (
    "the bodies touch, but not on the contact axis, where p0 is measured and from where eps is: their columns say "
    "nothing of this step"
)
UNSEEN = (
    "no contact point was ever pressed, though delta was positive: the contact is smaller than the mesh can see; "
    "reduce joint.element_size or increase the load"
)


class JointAccount:
    """The account of a ``system`` that is a joint: records of its steps, and of contact.h5 the
    arrays that are ``fixed`` and those that change ``per_step``."""

    record: ClassVar[type] = Measures
    fixed: ClassVar[tuple[str, ...]] = ("s", "angle", "weight")

    def __init__(self, system: Joint) -> None:
        self.system, self.scene = system, system.scene
        self.per_step = per_step(system)
        self._yielding = [body for body in system.problem.bodies if body.material.yields]

    def columns(self) -> list[tuple[str, Callable[[Any], float | int]]]:
        """Headings of history.csv and their values: every measure in the scene's units, and
        dimensionless beside it."""
        scene, R, dR, E = (
            self.scene,
            self.scene.joint.radius,
            self.scene.joint.dR,
            self.scene.E_star,
        )
        length, t, thickness = scene.units.length, scene.thickness, scene.analysis.thickness
        force, energy = scene.units.force_of(thickness), scene.units.energy_of(thickness)
        scales = {
            "delta": ("dR", dR, length),
            "P": ("(E* R)", E * R * t, force),
            "p0": ("E*", E, scene.units.stress),
            "eps": ("", 1.0, "rad"),
            "contact_area": ("R", R, length),
            "peeq_integral": ("R2", R * R * t, f"{length}{3 if thickness else 2}"),
            **dict.fromkeys((*ENERGIES, "work"), ("(E* R2)", E * R * R * t, energy)),
            "seconds": ("", 1.0, "s"),
        }
        columns: list[tuple[str, Callable[[Any], float | int]]] = []
        left_out = {
            "peeq",
            *(() if self.system.contact.has_friction else ("friction_dissipation",)),
        }
        for name in [field.name for field in fields(Measures) if field.name not in left_out]:
            scale, divisor, unit = scales.get(name, ("", 1.0, ""))
            columns.append((headed(name, unit), attrgetter(name)))
            if scale:
                columns.append((f"{name}/{scale}", partial(_over, name, divisor)))
            if name == "peeq_max" and self._yielding:
                for place in (*(body.name for body in self._yielding), "contact"):
                    headings = (
                        f"{place} peeq_max",
                        headed(f"{place} at x", length),
                        headed(f"{place} at y", length),
                    )
                    columns += [
                        (heading, partial(_largest, place, k)) for k, heading in enumerate(headings)
                    ]
        return columns

    def driven(self) -> tuple[float, float]:
        """Displacement and force whose work is that of the load: delta and P. Collective."""
        return self.system.delta(), self.system.drive_force("")

    def profiles(self) -> dict[str, ArcProfile]:
        """The contact along the arcs at the last evaluation, by side. Collective."""
        return arc_profiles(self.system)

    def step(
        self,
        before: Sequence[Measures],
        step: Step,
        profiles: Mapping[str, Any],
        work: float,
        seconds: float,
    ) -> Measures:
        """The measures of the last accepted state, which follows the steps ``before``.
        Collective."""
        joint, arcs = self.system, list(profiles.values())
        peeq, peeq_integral = joint.peeq()
        forces, delta = joint.forces(), joint.delta()
        P = forces["pin"]
        area = SYMMETRY * float(np.mean([(p.in_contact * p.width).sum() for p in arcs]))
        at_rest = 0.0 if area else self.scene.E_star * self.scene.thickness * abs(delta)
        scale = max(abs(P), *(abs(m.P) for m in before), at_rest)
        at = joint.equilibrium
        nodal = joint.problem.whole * max(at.evaluation.reaction_norm, at.largest_reaction)
        if scale <= _NOTHING * nodal:  # all that acts is a press fit, which balances by itself
            scale = nodal
        eps = float(np.mean([semi_angle(p) for p in arcs]))
        return Measures(
            delta=delta,
            P=P,
            p0=peak_pressure(arcs, eps),
            eps=eps,
            contact_area=area,
            peeq_max=peeq,
            peeq_integral=peeq_integral,
            force_balance=max(abs(f - P) for f in forces.values()) / scale if scale else 0.0,
            peeq=self._peeq(max([eps, *(m.eps for m in before)])),
            **costs(before, step, joint, work, seconds),
        )

    def _peeq(self, eps: float) -> dict[str, Sequence[float]]:
        """Largest PEEQ, x and y of every body that can yield, and near the "contact": within the
        angle ``eps`` from its axis, no farther than R/2 from the arc. That leaves out the pressed
        diameter and the held corner. Collective."""
        R, found = (
            self.scene.joint.radius,
            {body.name: self.system.largest_peeq(body) for body in self._yielding},
        )

        def near(x: Array) -> np.ndarray:
            return (np.arctan2(np.abs(x[:, 0]), -x[:, 1]) <= eps) & (
                np.abs(np.hypot(*x.T) - R) <= R / 2
            )

        near_contact = self.system.largest_peeq(*self._yielding, within=near)
        return {**found, "contact": near_contact} if found else {}

    def facts(self) -> dict[str, dict[str, Any]]:
        """Sizes of the mesh and what was made of the scene, for run.json."""
        shares = [pair.share for pair in self.system.contact.pairs]
        model = {"E_star": self.scene.E_star, "contact_shares": shares}
        return {"mesh": sizes(self.system), "model": model, "materials": self.scene.materials}

    def warnings(self) -> list[str]:
        """The scene's doubts, and a warning if the parabolic facets depart too much from their
        circles for the clearance.

        A parabola through ends and middle of an arc of half-angle ``a`` is off by ``R (1 - cos
        a)^2/8``. Equal facets that face each other are off alike, which leaves the gap as it is.
        """
        g, friction = self.scene.joint, self.scene.analysis.friction
        doubts = [*self.scene.doubts, *friction_doubts({"analysis.friction": friction})]
        doubts += contrast_doubts(self.system.problem.bodies)
        if g.size_ratio == 1 and not self.scene.pin.rigid:
            return doubts
        longest = max(side.facet_lengths().max() for side in self.system.sides.values())
        off = (1 - np.cos(longest / g.radius / 2)) ** 2 / 8 * g.radius / abs(g.dR)
        said = (
            f"the elements on the arcs are too long for the clearance, they depart from the circles by {off:.1g} dR; "
            "reduce joint.element_size"
        )
        return [*doubts, *([said] if off > _ROUGH else [])]

    def step_warnings(
        self,
        m: Measures,
        profiles: Mapping[str, Any],
        residual: float,
        before: Sequence[Measures] = (),
    ) -> list[str]:
        """What to warn of after the step ``m``, which Newton's method left with a ``residual``.
        Collective."""
        said, squashed = list[str](), core_peeq(self.system)
        if self.scene.joint.arc_end < np.pi and any(
            p.in_contact[-1] > 0 for p in profiles.values()
        ):
            said.append(
                "the contact reaches the end of the modelled quarter arc, beyond which it cannot spread; load less far"
            )
        on_axis = any(p.in_contact[0] > 0 for p in profiles.values())
        if self.scene.joint.is_ring and m.contact_area and not on_axis:
            said.append(AWAY)
        touching = max(1, min(int((p.in_contact > 0).sum()) for p in profiles.values()))
        pressed = m.contact_area > 0 and told_of_facets(m.p0, [earlier.p0 for earlier in before])
        if pressed and touching < _FEW_FACETS:
            facets = "facet" if touching == 1 else "facets"
            text = f"only {touching} {facets} in contact; a smaller element_size would resolve it"
            said.append(Doubt(text, -touching))
        if squashed > 0:
            text = (
                f"the pin yields where the force is applied, with PEEQ up to {squashed:.1e} in its core, and delta, "
                "the mean displacement of the core, contains by how much it is squashed there; a larger "
                "load.core_radius would spread the force"
            )
            said.append(Doubt(text, squashed))
        scene = self.scene
        small = scene.analysis.strain == "small"
        far = abs(m.delta) > scene.small * scene.joint.radius
        if far and not scene.doubts_of_strain:
            text = (
                f"delta exceeds {scene.small:.2g} R: small-strain theory makes P too low, relatively by about "
                f"{scene.too_low:g} delta/R; {LARGE}"
            )
            said.append(Doubt(text, abs(m.delta)))
        said += distortion_doubts(self.system, m.peeq_max, small=small and not far)
        if residual > max(1e-8, scene.analysis.tolerance) and m.contact_area:
            said.append(
                Doubt(f"round-off limits the residual to {residual:.1e} of the reaction", residual)
            )
        if m.force_balance > 1e-8:
            text = f"forces at pin, contact and block differ by {m.force_balance:.1e} of P"
            said.append(Doubt(text, m.force_balance))
        return said

    def refusal(self, steps: Sequence[Measures]) -> str:
        """Why the run must not go on: never, as supports and the load hold both bodies."""
        return ""

    def ending(self, steps: Sequence[Measures]) -> tuple[str, list[str]]:
        """Why a run that came to its end does not count as done, as no contact point noticed that
        the bodies are pressed together, or nothing; and a warning where they never were."""
        if any(m.contact_area for m in steps):
            return "", []
        return (UNSEEN, []) if any(m.delta > 0 for m in steps) else ("", [APART])

    def energy_balance(self, steps: Sequence[Measures]) -> float | None:
        """See `energy_balance`; a pin too large for its hole is pressed in by the first step."""
        return energy_balance(steps, fit=int(self.scene.joint.dR < 0))

    def work_doubts(self, steps: Sequence[Measures]) -> list[str]:
        """See `work_doubts`, with the same steps."""
        return work_doubts(
            steps, fit=int(self.scene.joint.dR < 0), round_off=self.system.energy_noise()
        )


def _largest(place: str, k: int, m: Measures) -> float:
    return m.peeq.get(place, 3 * [np.nan])[k]


def _over(name: str, divisor: float, m: Measures) -> float:
    return getattr(m, name) / divisor


def sizes(system: System) -> dict[str, Any]:
    """Sizes of the mesh for run.json."""
    lengths = {name: side.facet_lengths() for name, side in system.sides.items()}
    return {
        "cells": system.n_cells,
        "kind": system.cell_kind,
        "dofs": system.n_dofs,
        "contact_facets": {name: len(length) for name, length in lengths.items()},
        "element_size_on_arc": {
            name: [float(length.min()), float(length.max())] for name, length in lengths.items()
        },
    }


def core_peeq(joint: Joint) -> float:
    """Largest PEEQ within the core of a ring's pin, whose mean displacement is delta; 0 for a
    block. Collective."""
    radius = joint.scene.load.core_radius * joint.scene.joint.radius
    pin = [
        body
        for body in joint.problem.bodies
        if joint.problem.loads and body.name == "pin" and body.material.yields
    ]
    return joint.largest_peeq(*pin, within=lambda x: np.linalg.norm(x, axis=1) < radius)[0]

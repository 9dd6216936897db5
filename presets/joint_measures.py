"""The joint, ready to be solved, with the account of its steps: delta, P, p0, eps and PEEQ, in the
scene's units and dimensionless."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from mpi4py import MPI

from archord.materials.kinematics import Bools
from archord.materials.material import Array
from archord.measures.account import Account, Driven, Values, sizes
from archord.measures.edge import per_step
from archord.measures.energies import ENERGIES
from archord.measures.measure import Accepted, Column, Measure, Place, column
from archord.measures.record import WORST, Record
from archord.presets.arc import SYMMETRY, ArcProfile, arc_profiles, peak_pressure, semi_angle
from archord.presets.joint import joint_problem
from archord.presets.joint_doubts import before_steps, ending, step_checks
from archord.report.by_name import Amounts, ByName
from archord.report.timer import Timer
from archord.scene.presets.joint import Scene
from archord.solver.path.system import System

_N_OF_CONTACT = 4  # delta, P, p0, eps
_NOTHING = 1e-9  # of the forces on nodes: a P that is round-off


def joint_account(
    scene: Scene, comm: MPI.Comm, timer: Timer | None = None, partitioner: Any = None
) -> Account:
    """The joint of ``scene``, ready to be solved, and its account; ``partitioner`` as for
    `joint_problem`. Collective over ``comm``; raises `InputError`."""
    timer = timer or Timer()
    with timer("mesh"):
        problem = joint_problem(scene, comm, partitioner)
    system = System(problem, timer=timer)
    joint = JointMeasures(scene, system)
    return Account(
        scene,
        system,
        list(joint.measures()),
        list(joint.columns()),
        driven=joint.driven,
        profiles=partial(arc_profiles, scene.joint, system),
        fixed=("s", "angle", "weight"),
        per_step=per_step(system),
        balance=joint.force_balance,
        facts=joint.facts,
        warnings=before_steps(scene, system),
        checks=step_checks(scene, system),
        refusal=lambda steps: "",  # supports and the load hold both bodies
        ending=ending,
        fit=int(scene.fits),
        at="delta",
        copies=SYMMETRY,
    )


class JointMeasures:
    """The measures that the joint of ``scene`` derives from the measures of its parts in
    ``system``."""

    def __init__(self, scene: Scene, system: System) -> None:
        self.scene = scene
        self.system = system
        self._yielding = [body for body in system.problem.bodies if body.material.yields]

    def measures(self) -> Iterator[Measure]:
        """The measures of the joint, in the scene's units. Lengths and forces are of the whole.

        PEEQ is the largest value at a quadrature point, which grows without bound under mesh
        refinement where perfect plasticity localises, as beside the held corner of the block.
        """
        units = self.scene.units
        length = units.length
        thickness = self.scene.analysis.thickness
        yield Measure("delta", length, lambda state: self.delta())
        yield Measure("P", units.force_of(thickness), lambda state: self.system.drive_force(""))
        yield Measure("p0", units.stress, lambda state: peak_pressure(_arcs(state), _eps(state)))
        yield Measure("eps", "rad", _eps)
        yield Measure("peeq_max", "", lambda state: state.peeq[0])
        places = [body.name for body in self._yielding]
        for place in [*places, "contact"] if places else []:
            for k, (what, unit) in enumerate(zip(WORST, ("", length, length), strict=True)):
                yield Measure(f"{place} {what}", unit, partial(self._worst, place, k))
        volume = f"{length}{3 if thickness else 2}"
        yield Measure("peeq_integral", volume, lambda state: state.peeq[1])

    def columns(self) -> Iterator[Column]:
        """The columns of history.csv: every number, and beside it its dimensionless form."""
        scene = self.scene
        R = scene.joint.radius
        E = scene.E_star
        t = scene.thickness
        scales = {
            "delta": ("dR", scene.joint.dR),
            "P": ("(E* R)", E * R * t),
            "p0": ("E*", E),
            "contact_area": ("R", R),
            "peeq_integral": ("R2", R * R * t),
            **dict.fromkeys((*ENERGIES, "work"), ("(E* R2)", E * R * R * t)),
        }
        energy = scene.units.energy_of(scene.analysis.thickness)
        units = {measure.name: measure.unit for measure in self.measures()}
        first = list(units)[:_N_OF_CONTACT]
        rest = list(units)[_N_OF_CONTACT:]
        units |= dict.fromkeys((*ENERGIES, "work"), energy)
        units |= {"contact_area": scene.units.length, "seconds": "s"}
        friction = ENERGIES[2:] if self.system.contact.has_friction else ()
        names = ["step", *first, "contact_area", *rest, *ENERGIES[:2], "work", "force_balance"]
        for name in [*names, "iterations", "cutbacks", "seconds", *friction]:
            heading, value = column(name, units.get(name, ""))
            of_body = " " in name  # runs of version 0.1 lack it
            yield heading, partial(_known, name) if of_body else value
            if name in scales:
                scale, divisor = scales[name]
                yield f"{name}/{scale}", partial(_over, name, divisor)

    def delta(self) -> float:
        """Displacement of the pin from first touch: of its diameter, or in a ring the mean over the
        core."""
        moved = self.system.drive_displacement("")
        return moved - max(self.scene.joint.dR, 0.0) if self.scene.joint.is_ring else moved

    def driven(self) -> Driven:
        """Displacement and force that do the load's work: delta and P. Collective."""
        return np.array(self.delta()), np.array(self.system.drive_force(""))

    def forces(self) -> Amounts:
        """Downward force of the whole joint at pin, contact and block's support. Collective."""
        contact = -self.system.contact_force("contact")[1]
        block = self.system.reaction("block")[1]
        return {"pin": self.system.drive_force(""), "contact": contact, "block": block}

    def force_balance(self, state: Accepted, values: Values) -> float:
        """The largest difference between these forces, over the largest ``P`` so far, or where
        nothing touches over ``E* delta``, about what it would be in contact. Collective."""
        forces = self.forces()
        P = forces["pin"]
        scale = max(abs(P), *(abs(m["P"]) for m in state.before), 0.0)
        if not state.contact_area:
            scale = max(scale, self.scene.E_star * self.scene.thickness * abs(values["delta"]))
        solved = self.system.equilibrium
        nodal = max(solved.evaluation.reaction_norm, solved.largest_reaction)
        nodal *= self.system.problem.whole
        if scale <= _NOTHING * nodal:  # all that acts is a press fit, which balances by itself
            scale = nodal
        return max(abs(force - P) for force in forces.values()) / scale if scale else 0.0

    def facts(self) -> dict[str, ByName]:
        """Sizes of the mesh and what was made of the scene, for run.json."""
        shares = [pair.share for pair in self.system.contact.pairs]
        model = {"E_star": self.scene.E_star, "contact_shares": shares}
        return {"mesh": sizes(self.system), "model": model, "materials": self.scene.materials}

    def _worst(self, place: str, k: int, state: Accepted) -> float:
        """The largest PEEQ of a body or near the contact (0), or its x or y (1, 2). Collective."""
        if place != "contact":
            return state.largest_peeq(place)[k]
        return state.once("near contact", lambda: self._near_contact(state))[k]

    def _near_contact(self, state: Accepted) -> Place:
        """The largest PEEQ within the largest angle of contact so far, no farther than R/2 from the
        arc. That leaves out the pressed diameter and the held corner. Collective."""
        R = self.scene.joint.radius
        eps = max([_eps(state), *(m["eps"] for m in state.before)])

        def near(x: Array) -> Bools:
            angle = np.arctan2(np.abs(x[:, 0]), -x[:, 1])
            return (angle <= eps) & (np.abs(np.hypot(*x.T) - R) <= R / 2)

        return self.system.largest_peeq(*self._yielding, within=near)


def _arcs(state: Accepted) -> list[ArcProfile]:
    return list(state.profiles.values())


def _eps(state: Accepted) -> float:
    """Semi-angle of the contact, the mean of both sides."""
    angles = (semi_angle(profile) for profile in _arcs(state))
    return state.once("eps", lambda: float(np.mean(list(angles))))


def _known(name: str, m: Record) -> float:
    return m.values.get(name, np.nan)


def _over(name: str, divisor: float, m: Record) -> float:
    return m[name] / divisor

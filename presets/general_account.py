"""The account of a general problem: loads, supports, interactions and bodies, step by step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from hashlib import sha256
from operator import attrgetter, itemgetter
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from mpi4py import MPI

from archord.materials.material import Array
from archord.presets.edge import SurfaceProfile, per_step, surface_profiles
from archord.presets.joint_account import sizes
from archord.presets.measures import (
    ENERGIES,
    LARGE,
    LARGE_STRAIN,
    Record,
    contrast_doubts,
    costs,
    dissipated,
    distortion_doubts,
    energy_balance,
    headed,
    told_of_facets,
    work_doubts,
)
from archord.presets.problem import (
    as_input_error,
    general_problem,
    mesh_name,
    require_mirrored,
)
from archord.report.doubts import Doubt
from archord.report.timer import Timer
from archord.scene.columns import part_columns, supporting
from archord.scene.problem import ProblemScene
from archord.scene.sections import friction_doubts
from archord.solver.path.stepping import Step
from archord.solver.path.system import System
from archord.solver.problem import Problem

_FEW_FACETS = 3
_FAR_TURN = 0.02  # angle at which linear rotations stretch radii by 0.02 %
_SPURIOUS = 1e-4  # of the work or the energy, in the springs that hold floating bodies
_CARRYING = 0.01  # of the same, where the springs carry what contact should
_ALONE = 0.1  # of the same at the end, where no force pushes the bodies that springs hold
_LOST = "nothing holds what the loads move"
_CHECK = "let more of the loads press it against others, or look whether its E has the unit of the others"
NEVER = "no surfaces ever touched: no load presses any of them together"
PARTED = (
    "no surfaces touch from step {} on, though the loads displace farther: look which way they move"
)


class GeneralAccount:
    """As `JointAccount`, of the problem that ``scene`` states. Collective; raises `InputError`."""

    record: ClassVar[type] = Record
    fixed: ClassVar[tuple[str, ...]] = ("s", "weight", "X")

    def __init__(
        self,
        scene: ProblemScene,
        comm: MPI.Comm,
        timer: Timer | None = None,
        given: Problem | None = None,
    ) -> None:
        timer = timer or Timer()
        source = mesh_name(scene) if given is None else given.mesh_name
        with timer("mesh"), as_input_error(source):
            problem = general_problem(scene, comm) if given is None else given.on(comm)
        self.scene, self._warnings = scene, scene.doubts
        self._file = scene.mesh.file if given is None else given.mesh_file
        with as_input_error(source):
            if scene.mesh.shape is None:
                from archord.presets.held import (
                    check,
                )  # with scipy, which solves of presets do without

                with timer("mesh"):
                    self._warnings += check(problem)
            require_mirrored(problem)
            self.system = System(problem, timer=timer)
            self.per_step = (*per_step(self.system), "slip")
            self._warnings += self.system.warnings
            if scene.mesh.shape is None or any(part.interference for part in scene.interaction):
                from archord.presets.held import require_facing

                self._warnings += require_facing(self.system)
        frictions = {f'the friction of "{part.name}"': part.friction for part in scene.interaction}
        self._warnings += friction_doubts(frictions)
        turning = {f"{coupling.name} rotation" for coupling in scene.coupling}
        turning |= {load.name for load in scene.load if load.direction == "rotation"}
        self._turning = [n for n, name in enumerate(self.system.drive_names) if name in turning]
        self._supports = supporting(scene)
        self._units = part_columns(scene)

    def columns(self) -> list[tuple[str, Callable[[Any], float | int]]]:
        """Headings of history.csv and their values: loads, supports, interactions, bodies,
        energies, what the step cost."""
        energies = ENERGIES if self.system.contact.has_friction else ENERGIES[:2]
        last = dict.fromkeys(
            (*energies, "work"), self.scene.units.energy_of(self.scene.analysis.thickness)
        )
        last |= {"force_balance": "", "iterations": "", "cutbacks": "", "seconds": "s"}
        first = ("step", attrgetter("step")), ("load_factor", attrgetter("at"))
        values = [(headed(name, unit), itemgetter(name)) for name, unit in self._units.items()]
        return [
            *first,
            *values,
            *((headed(name, unit), attrgetter(name)) for name, unit in last.items()),
        ]

    def driven(self) -> tuple[Array, Array]:
        """Displacements and forces of all loads. Collective."""
        q, force = self.system.driven()
        loads = [self.system.drive_names.index(load.name) for load in self.scene.load]
        return q[loads], force[loads]

    def profiles(self) -> dict[str, SurfaceProfile]:
        """The contact along the surfaces, by name. Collective."""
        return surface_profiles(self.system)

    def step(
        self,
        before: Sequence[Record],
        step: Step,
        profiles: Mapping[str, Any],
        work: float,
        seconds: float,
    ) -> Record:
        """The record of the last accepted state. Collective."""
        system, values = self.system, list[float]()
        for q, force in zip(*self.driven(), strict=True):
            values += [float(q), float(force)]
        for name in self._supports:
            values += [*system.reaction(name), system.reaction_moment(name, (0.0, 0.0))]
        area = 0.0
        for part in self.scene.interaction:
            met = [profile for name, profile in profiles.items() if name in part.surfaces]
            pressure, at = max((p.largest for p in met), key=lambda found: found[0])
            lengths = [p.contact_length for p in met]
            slip = max(p.largest_slip for p in met)
            values += [
                *system.contact_force(part.name),
                pressure,
                *at,
                float(np.mean(lengths)),
                slip,
                met[-1].n_arcs,
            ]
            if part.has_friction:
                shear = max(float(np.abs(p.shear).max()) for p in met if p.shear is not None)
                values += [system.contact_moment(part.name, (0.0, 0.0)), shear]
            told = system.contact.interface(part.name).quantities()
            values += [told[name][0] for name in part.quantities]
            area += float(np.mean(lengths))
        for body in system.problem.bodies:
            if body.material.yields:
                values += system.largest_peeq(body)
        return Record(
            at=system.equilibrium.load,
            values=dict(zip(self._units, map(float, values), strict=True)),
            contact_area=area,
            force_balance=system.force_balance(self._largest_force(before)),
            **costs(before, step, system, work, seconds),
        )

    def facts(self) -> dict[str, Any]:
        """Sizes of the mesh, and what was made of the scene."""
        mesh, problem = self.scene.mesh, self.system.problem
        source = {"file": mesh.file} if mesh.file else {}
        if self._file:
            source["sha256"] = sha256(Path(self._file).read_bytes()).hexdigest()
        shares = {
            i.interaction.name: [pair.share for pair in i.pairs]
            for i in self.system.contact.interfaces
        }
        bodies = {
            body.name: list(problem.mesh.cell_sets[body.cells or body.name])
            for body in problem.bodies
        }
        found = {
            "mesh": sizes(self.system) | source,
            "model": {"contact_shares": shares},
            "bodies": bodies,
        }
        return found | {"materials": self.scene.materials}

    def warnings(self) -> list[str]:
        """What to warn of before the first step."""
        return [*self._warnings, *contrast_doubts(self.system.problem.bodies)]

    def step_warnings(
        self, m: Record, profiles: Mapping[str, Any], residual: float, before: Sequence[Record] = ()
    ) -> list[str]:
        """What to warn of after the step ``m``, which follows the steps ``before``. Collective."""
        said, system = list[str](), self.system
        tied = {
            name for part in self.scene.interaction if part.law == "tied" for name in part.surfaces
        }
        for name, profile in profiles.items():
            if name in tied:
                continue
            touching = int((profile.in_contact > 0).sum())
            pressed = told_of_facets(*self._pressures(name, m, before))
            if pressed and 0 < touching < _FEW_FACETS:
                facets = "facet" if touching == 1 else "facets"
                text = f"only {touching} {facets} of {name!r} in contact; smaller elements would resolve it"
                said.append(Doubt(text, -touching))
            far_slip = profile.largest_slip > profile.width.max()
            if self.scene.analysis.kinematics == "reference" and far_slip:
                text = (
                    f"{name!r} slides by {profile.largest_slip:.3g}, more than a facet, but keeps the partners that it "
                    'had at first; analysis.kinematics = "current" is for that'
                )
                said.append(Doubt(text, profile.largest_slip))
        largest = max((v for k, v in m.values.items() if k.endswith(" peeq_max")), default=0.0)
        small = self.scene.analysis.strain == "small"
        if largest > LARGE_STRAIN and small:
            said.append(
                Doubt(
                    f"PEEQ reaches {largest:.2g}, too much for small-strain theory; {LARGE}",
                    largest,
                )
            )
        said += distortion_doubts(system, largest, small=small)
        angle = np.abs(system.driven()[0][self._turning]).max(initial=0.0)
        if angle > _FAR_TURN:
            far = f"a coupling turns by {angle:.2g} rad; it turns linearly, which stretches radii by {angle**2 / 2:.1g}"
            said.append(Doubt(far, angle))
        if residual > max(1e-8, self.scene.analysis.tolerance) and m.force_balance:
            said.append(
                Doubt(f"round-off limits the residual to {residual:.1e} of the reaction", residual)
            )
        if m.force_balance > 1e-8:
            left = f"the forces on the whole do not balance: {m.force_balance:.1e} of the largest is left"
            said.append(Doubt(left, m.force_balance))
        total, by_springs = _largest_work([*before, m])[1], system.stabilisation_energy
        if by_springs > _SPURIOUS * total:
            text = f"springs that hold floating bodies do {by_springs:.1e} of the work {total:.1e}"
            said.append(Doubt(text, by_springs / total if total else 0.0))
        return said

    def refusal(self, steps: Sequence[Record]) -> str:
        """Why the run must not go on after the last of the ``steps``: springs carry what something
        else should. Where no force is prescribed, they may carry alone: bodies may be pushed until
        they touch. Collective."""
        system = self.system
        by_springs = system.stabilisation_energy
        stored, total = _largest_work(steps)
        pushed = system.equilibrium.drives.pushes(system.equilibrium.load)
        if by_springs <= _CARRYING * total or (by_springs > stored and not pushed):
            return ""
        name = system.hardest_held
        share = f"weak springs that keep it from floating do {100 * by_springs / total:.2g} % of the work"
        return f"{_LOST}: no contact carries {name!r}, {share}, more than 1 %; hold it by a support, {_CHECK}"

    def ending(self, steps: Sequence[Record]) -> tuple[str, list[str]]:
        """A warning where nothing ever touched; that springs alone hold a body is no end."""
        touching = [part for part in self.scene.interaction if part.law != "tied"]
        if self.system.stabilisation_energy > _ALONE * _largest_work(steps)[1]:
            return (
                f"{_LOST}: no contact carries {self.system.hardest_held!r}; hold it by a support, {_CHECK}",
                [],
            )
        if not touching:
            return "", []
        met = [m.step for m in steps if m.contact_area]
        if not met:
            return "", [NEVER]
        parted = met[-1] < steps[-1].step and self._farther(steps, met[-1])
        return "", [PARTED.format(met[-1] + 1)] if parted else []

    def _farther(self, steps: Sequence[Record], last: int) -> bool:
        """Whether a load displaces farther after the step number ``last`` than up to it."""
        names = [
            f"{load.name} displacement" for load in self.scene.load if load.displacement is not None
        ]
        for name in names:
            before = max(abs(m[name]) for m in steps if m.step <= last)
            after = max(abs(m[name]) for m in steps if m.step > last)
            if after > before:
                return True
        return False

    def energy_balance(self, steps: Sequence[Record]) -> float | None:
        """See `energy_balance`; where interferences arise first, from the end of their stage on."""
        fit = self.scene.path.fit_steps if self.scene.fits else 0
        return energy_balance(steps, fit, contact=bool(self.scene.interaction))

    def work_doubts(self, steps: Sequence[Record]) -> list[str]:
        """See `work_doubts`, with the same steps."""
        fit = self.scene.path.fit_steps if self.scene.fits else 0
        contact = bool(self.scene.interaction)
        return work_doubts(steps, fit, contact=contact, round_off=self.system.energy_noise())

    def _pressures(
        self, surface: str, m: Record, before: Sequence[Record]
    ) -> tuple[float, list[float]]:
        """The largest pressure of the interaction of this ``surface`` in the step ``m``, and
        ``before``."""
        part = next(part for part in self.scene.interaction if surface in part.surfaces)
        column = f"{part.name} largest pressure"
        return m[column], [earlier[column] for earlier in before]

    def _largest_force(self, steps: Sequence[Record]) -> float:
        """The largest force of a support or an interaction in these ``steps``."""
        pairs = [(f"{name} x", f"{name} y") for name in self._supports]
        pairs += [
            (f"{part.name} force x", f"{part.name} force y") for part in self.scene.interaction
        ]
        return max((float(np.hypot(m[x], m[y])) for m in steps for x, y in pairs), default=0.0)


def _largest_work(steps: Sequence[Record]) -> tuple[float, float]:
    """The largest energy stored and dissipated in one of the ``steps``, and the largest of it and
    the work."""
    stored = max((m.elastic_energy + dissipated(m) for m in steps), default=0.0)
    return stored, max([stored, *(abs(m.work) for m in steps)])

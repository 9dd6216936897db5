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
from archord.presets.measures import ENERGIES, Record, costs, dissipated, energy_balance, headed
from archord.presets.problem import as_input_error, general_problem, require_mirrored
from archord.report.timer import Timer
from archord.scene.columns import part_columns, supporting
from archord.scene.problem import LIVE, ProblemScene
from archord.scene.sections import friction_doubts
from archord.solver.stepping import Step
from archord.solver.system import System

_FEW_FACETS = 3
_FAR_TURN = 0.02  # angle at which linear rotations stretch radii by 0.02 %
_LARGE_STRAIN = 0.05  # PEEQ
_SPURIOUS = 1e-4  # of the work or the energy, in the springs that hold floating bodies
_ALONE = 0.1  # of the same, where the springs alone hold a body
NEVER = "no surfaces ever touched: no load presses any of them together"


class GeneralAccount:
    """As `JointAccount`, of the problem that ``scene`` states. Collective; raises `InputError`."""

    record: ClassVar[type] = Record
    fixed: ClassVar[tuple[str, ...]] = ("s", "weight", "X")

    def __init__(self, scene: ProblemScene, comm: MPI.Comm, timer: Timer | None = None) -> None:
        timer = timer or Timer()
        with timer("mesh"):
            problem = general_problem(scene, comm)
        self.scene = scene
        self._warnings: list[str] = []
        with as_input_error(scene):
            if scene.mesh.shape is None:
                from archord.presets.held import check  # with scipy, which solves of presets do without

                with timer("mesh"):
                    self._warnings = check(scene, problem)
            require_mirrored(scene, problem)
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
        """Headings of history.csv and their values: loads, supports, interactions, bodies, energies, what the step
        cost."""
        energies = ENERGIES if self.system.contact.has_friction else ENERGIES[:2]
        last = dict.fromkeys((*energies, "work"), self.scene.units.energy_of(self.scene.analysis.thickness))
        last |= {"force_balance": "", "iterations": "", "cutbacks": "", "seconds": "s"}
        first = ("step", attrgetter("step")), ("load_factor", attrgetter("at"))
        values = [(headed(name, unit), itemgetter(name)) for name, unit in self._units.items()]
        return [*first, *values, *((headed(name, unit), attrgetter(name)) for name, unit in last.items())]

    def driven(self) -> tuple[Array, Array]:
        """Displacements and forces of all loads. Collective."""
        q, force = self.system.driven()
        loads = [self.system.drive_names.index(load.name) for load in self.scene.load]
        return q[loads], force[loads]

    def profiles(self) -> dict[str, SurfaceProfile]:
        """The contact along the surfaces, by name. Collective."""
        return surface_profiles(self.system)

    def step(
        self, before: Sequence[Record], step: Step, profiles: Mapping[str, Any], work: float, seconds: float
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
            values += [*system.contact_force(part.name), pressure, *at, float(np.mean(lengths)), slip, met[-1].n_arcs]
            if part.friction:
                shear = max(float(np.abs(p.shear).max()) for p in met if p.shear is not None)
                values += [system.contact_moment(part.name, (0.0, 0.0)), shear]
            area += float(np.mean(lengths))
        for body in system.problem.bodies:
            if body.material.yields:
                values += system.largest_peeq(body)
        return Record(
            at=system.equilibrium.load,
            values=dict(zip(self._units, map(float, values), strict=True)),
            contact_area=area,
            force_balance=system.force_balance(),
            **costs(before, step, system, work, seconds),
        )

    def facts(self) -> dict[str, Any]:
        """Sizes of the mesh, and what was made of the scene."""
        mesh, problem = self.scene.mesh, self.system.problem
        source = {"file": mesh.file} if mesh.file else {}
        if mesh.file and mesh.file not in LIVE:
            source["sha256"] = sha256(Path(mesh.file).read_bytes()).hexdigest()
        shares = {i.interaction.name: [pair.share for pair in i.pairs] for i in self.system.contact.interfaces}
        bodies = {body.name: list(problem.mesh.cell_sets[body.cells or body.name]) for body in problem.bodies}
        return {"mesh": sizes(self.system) | source, "model": {"contact_shares": shares}, "bodies": bodies}

    def warnings(self) -> list[str]:
        """What to warn of before the first step."""
        return self._warnings

    def step_warnings(self, m: Record, profiles: Mapping[str, Any], residual: float) -> list[str]:
        """What to warn of after the step ``m``. Collective."""
        said, system = list[str](), self.system
        for name, profile in profiles.items():
            touching = int((profile.in_contact > 0).sum())
            if 0 < touching < _FEW_FACETS:
                said.append(f"only {touching} facets of {name!r} in contact; smaller elements would resolve it")
        largest = max((v for k, v in m.values.items() if k.endswith(" peeq_max")), default=0.0)
        if largest > _LARGE_STRAIN and self.scene.analysis.strain == "small":
            said.append(
                f'PEEQ reaches {largest:.2g}, too much for small-strain theory; analysis.strain = "large" is for that'
            )
        angle = np.abs(system.driven()[0][self._turning]).max(initial=0.0)
        if angle > _FAR_TURN:
            said.append(
                f"a coupling turns by {angle:.2g} rad; it turns linearly, which stretches radii by {angle**2 / 2:.1g}"
            )
        if residual > 1e-8 and m.force_balance:
            said.append(f"round-off limits the residual to {residual:.1e} of the reaction")
        if m.force_balance > 1e-8:
            said.append(f"the forces on the whole do not balance: {m.force_balance:.1e} of the largest is left")
        total = max(abs(m.work), m.elastic_energy + dissipated(m))
        if (spurious := system.stabilisation_energy) > _SPURIOUS * total:
            said.append(f"springs that hold floating bodies do {spurious:.1e} of the work {total:.1e}")
        return said

    def ending(self, steps: Sequence[Record]) -> tuple[str, list[str]]:
        """A warning where nothing ever touched; that springs alone hold a body is no end."""
        total = max((max(abs(m.work), m.elastic_energy + dissipated(m)) for m in steps), default=0.0)
        if self.system.stabilisation_energy > _ALONE * total:
            return "nothing holds what the loads move: no contact carries them", []
        return "", [NEVER] if self.scene.interaction and not any(m.contact_area for m in steps) else []

    def energy_balance(self, steps: Sequence[Record]) -> float | None:
        """See `energy_balance`; where interferences arise first, from the end of their stage on."""
        fit = self.scene.path.fit_steps if self.scene.fits else 0
        return energy_balance(steps, fit, contact=bool(self.scene.interaction))

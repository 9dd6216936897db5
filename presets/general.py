"""A general problem, ready to be solved, with the account of its steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import product
from pathlib import Path

from mpi4py import MPI

from archord.measures.account import Account, Driven, Values, sizes
from archord.measures.doubts import (
    contrast_doubts,
    plane_doubts,
    point_doubts,
    stiff_quadrilaterals,
    volume_doubts,
)
from archord.measures.edge import fixed, per_step, surface_profiles
from archord.measures.energies import ENERGIES
from archord.measures.measure import Accepted, Column, column
from archord.measures.mirror_doubts import mirror_doubts
from archord.measures.parts import part_measures
from archord.presets.general_doubts import ending, refusal, step_checks
from archord.presets.problem import (
    as_input_error,
    general_problem,
    mesh_name,
    placed,
    require_mirrored,
    require_no_lever,
)
from archord.presets.solid_measures import solid_measures
from archord.report.by_name import ByName
from archord.report.timer import Timer
from archord.scene.columns import supporting
from archord.scene.mesh_digests import digests
from archord.scene.problem import ProblemScene
from archord.scene.sections.analysis import friction_doubts
from archord.solver.contact.laws.law import ContactLaw
from archord.solver.contact.laws.named import contact_law
from archord.solver.expansion import expanded
from archord.solver.path.mirrors import Mirror
from archord.solver.path.system import System
from archord.solver.problem import Problem


def general_account(
    scene: ProblemScene, comm: MPI.Comm, timer: Timer, given: Problem | None = None
) -> Account:
    """The problem of ``scene``, ready to be solved, and its account; or the problem that was
    ``given`` from Python, which the scene tells about. Its parts tell the measures.

    Collective over ``comm``; raises `InputError`.
    """
    name = given.mesh_name if given else mesh_name(scene)
    file = given.mesh_file if given else scene.mesh.file
    unsaid = given.kinematics is None if given else "plane" not in scene.analysis.model_fields_set
    with timer("mesh"), as_input_error(name):
        problem = given.on(comm) if given else general_problem(scene, comm)
        scene = placed(scene, problem.mesh)
    warnings = scene.doubts
    with as_input_error(name):
        # what contradicts itself is refused before its mesh is looked at
        conditions = expanded(problem)
        if scene.mesh.shape is None:
            # with scipy, which solves of presets do without
            from archord.presets.held import check

            with timer("mesh"):
                warnings += check(problem)
        require_mirrored(problem)
        system = System(conditions, timer=timer)
        require_no_lever(problem, system)
        warnings += system.warnings
        if scene.mesh.shape is None or any(part.interference for part in scene.interaction):
            from archord.presets.held import require_facing

            warnings += require_facing(system)
        if system.clean_sides.fault:
            raise ValueError(system.clean_sides.fault)
        if scene.mesh.shape is None:
            warnings += mirror_doubts(system)
    frictions = {f'the friction of "{part.name}"': part.friction for part in scene.interaction}
    warnings += friction_doubts(frictions)
    warnings += contrast_doubts(problem.bodies)
    if unsaid:
        warnings += plane_doubts(problem)
    warnings += point_doubts(problem)
    warnings += volume_doubts(system)
    warnings += stiff_quadrilaterals(system)
    return _account(scene, system, warnings, file)


def _account(scene: ProblemScene, system: System, warnings: list[str], file: str | None) -> Account:
    """The account of a general problem, whose mesh is in a ``file``, if any."""
    measures = [*part_measures(scene), *solid_measures(scene)]
    by_factor = [column("step"), column("load_factor", of="at")]
    # found by all ranks, as one alone tells the facts
    mirrors = system.mirrors if scene.in_space else []
    if scene.in_space and 2 ** len(mirrors) < system.problem.symmetry:
        warnings = [*warnings, *_without_images(scene)]
    return Account(
        scene,
        system,
        measures,
        [*by_factor, *(measure.column for measure in measures), *_last_columns(scene, system)],
        driven=partial(_driven, system, [load.name for load in scene.load]),
        profiles=partial(surface_profiles, system),
        fixed=fixed(system),
        per_step=(*per_step(system), "slip"),
        balance=_balance_of(scene, system.problem.kinematics.axes),
        facts=partial(_facts, scene, system, mirrors, file),
        warnings=warnings,
        checks=step_checks(scene, system),
        refusal=partial(refusal, system),
        ending=partial(ending, scene, system),
        fit=_steps_without_work(scene, system),
        copies=system.problem.symmetry,
    )


def _without_images(scene: ProblemScene) -> Iterator[str]:
    """What to warn of where not all mirrors of a part are known."""
    spread = [part.name for part in scene.coupling if part.kind == "distributing"]
    if spread:
        names = ", ".join(map(repr, spread))
        yield (
            "not all mirrors of the modelled part are known: mean motions of facets that meet one "
            f"of the others ({names}) are of the modelled facets, without their images"
        )


def _steps_without_work(scene: ProblemScene, system: System) -> int:
    """The first steps, in which energy is stored that loads do not bring: bodies are pressed into
    each other, or touch softly from the start."""
    if scene.fits:
        return scene.path.fit_steps
    parts = system.problem.interactions
    laws = [contact_law(part.law, part.friction) for part in parts]
    return int(any(type(law).stored is not ContactLaw.stored for law in laws))


def _last_columns(scene: ProblemScene, system: System) -> list[Column]:
    """The energies of the whole, and what a step cost."""
    energies = ENERGIES if system.contact.has_friction else ENERGIES[:2]
    unit = scene.units.energy_of(scene.analysis.depth)
    of_whole = [column(name, unit) for name in (*energies, "work")]
    cost = [column("iterations"), column("cutbacks"), column("seconds", "s")]
    return [*of_whole, column("force_balance"), *cost]


def _driven(system: System, names: Sequence[str]) -> Driven:
    """Displacements and forces of the loads of these ``names``. Collective."""
    q, force = system.driven()
    loads = [system.drive_names.index(name) for name in names]
    return q[loads], force[loads]


def _balance_of(scene: ProblemScene, axes: Sequence[str]) -> Callable[[Accepted, Values], float]:
    """How far forces are from balance, over the largest force of the run so far."""
    names = [f"{name} " for name in supporting(scene)]
    names += [f"{part.name} force " for part in scene.interaction]
    forces = [[name + axis for axis in axes] for name in names]

    def balance(state: Accepted, values: Values) -> float:
        steps = product(state.before, forces)
        before = [math.hypot(*(m[component] for component in force)) for m, force in steps]
        return state.system.force_balance(float(max(before, default=0.0)))

    return balance


def _facts(
    scene: ProblemScene, system: System, mirrors: Sequence[Mirror], file: str | None
) -> ByName:
    """Sizes of the mesh, which is in a ``file``, if any, and what was made of the scene."""
    source: ByName = {"file": scene.mesh.file} if scene.mesh.file else {}
    if file:
        beside = digests(Path(file))
        source["sha256"] = beside.pop("")
        if beside:
            source["beside"] = beside
    mesh = system.problem.mesh
    shares = {
        interface.interaction.name: [pair.share for pair in interface.pairs]
        for interface in system.contact.interfaces
    }
    model: ByName = {"contact_shares": shares}
    if mirrors:
        model["mirrors"] = [(mirror.axis, mirror.at) for mirror in mirrors]
    return {
        "mesh": sizes(system) | source,
        "model": model,
        "bodies": {
            body.name: list(mesh.cell_sets[body.cells or body.name])
            for body in system.problem.bodies
        },
        "materials": scene.materials,
    }

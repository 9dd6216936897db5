"""What to warn of after the steps of a general problem, and why its run ends early."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

from mpi4py import MPI

from archord.measures.coupling_doubts import lever_doubts
from archord.measures.doubts import (
    LARGE,
    LARGE_STRAIN,
    Check,
    balance_doubts,
    distortion_doubts,
    few_facets,
    gamma_doubts,
    hardening_doubts,
    round_off_doubts,
    told_of_facets,
)
from archord.measures.edge import AnyProfile
from archord.measures.energies import largest_energies
from archord.measures.measure import Accepted
from archord.measures.record import Record
from archord.measures.unmet_bodies import UnmetBodies
from archord.report.doubts import Doubt
from archord.scene.parts import IN_PLANE, IN_SPACE, turns
from archord.scene.problem import ProblemScene
from archord.solver.path.system import System

_FEWEST_FACETS = 3
_FAR_TURN = 0.02  # angle at which linear rotations stretch radii by 0.02 %
_FOLLOWING = 0.02  # change of area vectors, over their size
_FALSE = 0.05  # gap of fixed partners that is none, over what the contact presses together
_SPURIOUS = 1e-4  # of the work or the energy, in the springs that hold floating bodies
_CARRYING = 0.01  # of the same, where the springs carry what contact should
_ALONE = 0.1  # of the same at the end, where no force pushes the bodies that springs hold
_LOST = "nothing holds what the loads move"
_CHECK = (
    "let more of the loads press it against others, or look whether its E has the unit of the "
    "others"
)
_UNBALANCED = "the forces on the whole do not balance: {:.1e} of the largest is left"
NEVER = "no surfaces ever touched: no load presses any of them together"
PARTED = (
    "no surfaces touch from step {} on, though the loads displace farther: look which way they move"
)


def step_checks(scene: ProblemScene, system: System) -> list[Check]:
    """What to warn of after every step, in this order."""
    motions = product(scene.coupling, IN_SPACE if scene.in_space else IN_PLANE)
    turning = {f"{coupling.name} {freedom}" for coupling, freedom in motions if turns(freedom)}
    turning |= {load.name for load in scene.load if turns(load.direction)}
    turning &= set(system.drive_names)
    turning -= {drive for turn in system.problem.turns for drive in turn.drives}
    small = scene.analysis.strain == "small"
    fixed_partners = scene.analysis.kinematics == "reference"

    def surfaces(state: Accepted, m: Record) -> Iterator[str]:
        for name, profile in state.profiles.items():
            part = next(part for part in scene.interaction if name in part.surfaces)
            if part.law == "tied":
                continue
            yield from _facet_doubts(state, m, name, f"{part.name} largest pressure")
            if fixed_partners:
                longest = system.sides[name].facet_lengths().max()
                yield from _slip_doubts(name, profile.largest_slip, longest)
                yield from _gap_doubts(system, name, profile)

    def strains(state: Accepted, m: Record) -> Iterator[str]:
        peeq = [value for name, value in m.values.items() if name.endswith(" peeq_max")]
        largest = max(peeq, default=0.0)
        if largest > LARGE_STRAIN and small:
            text = f"PEEQ reaches {largest:.2g}, too much for small-strain theory; {LARGE}"
            yield Doubt(text, largest)
        yield from distortion_doubts(system, largest, small=small)
        yield from hardening_doubts(state)

    def pressures(state: Accepted, m: Record) -> Iterator[str]:
        if small:
            return
        u = system.equilibrium.displacement()
        for load in system.problem.loads:
            _, pressure = state.driven[load.drive]
            if not load.pressure * pressure:
                continue
            off = system.equilibrium.drives.loads.dead_error(load.facets, u)
            if off > _FOLLOWING:
                text = f"the pressure {load.drive!r} acts on undeformed areas along undeformed"
                by = f"a pressure that follows the surface would differ by {100 * off:.2g} %"
                yield Doubt(f"{text} normals: {by}", off)

    def angles(state: Accepted, m: Record) -> Iterator[str]:
        angle = max((abs(state.driven[name][0]) for name in turning), default=0.0)
        if angle > _FAR_TURN:
            stretch = f"it turns linearly, which stretches radii by {angle**2 / 2:.1g}"
            yield Doubt(f"a coupling turns by {angle:.2g} rad; {stretch}", angle)
        if len(system.problem.kinematics.turns) == 1 and not small:
            yield from lever_doubts(scene, state)

    def balances(state: Accepted, m: Record) -> Iterator[str]:
        if m.force_balance:
            yield from round_off_doubts(state, scene.analysis.tolerance)
        yield from balance_doubts(m, _UNBALANCED, scene.analysis.tolerance)

    unmet = UnmetBodies(system) if scene.mesh.shape is None else None

    def passing(state: Accepted, m: Record) -> Iterator[str]:
        if unmet is not None:
            yield from unmet.doubts()

    def stiffness(state: Accepted, m: Record) -> Iterator[str]:
        yield from gamma_doubts(system)

    return [surfaces, strains, pressures, angles, balances, passing, stiffness, _spring_doubts]


def _facet_doubts(state: Accepted, m: Record, surface: str, pressure: str) -> list[str]:
    """A warning where few facets of a ``surface`` touch; ``pressure`` names the measure."""
    touching = int((state.profiles[surface].in_contact > 0).sum())
    before = [earlier[pressure] for earlier in state.before]
    if not touching or not told_of_facets(m[pressure], before):
        return []
    return few_facets(touching, _FEWEST_FACETS, f"of {surface!r} ", "smaller elements")


def _slip_doubts(surface: str, slip: float, longest: float) -> Iterator[str]:
    """A warning where a ``surface`` slides by more than its ``longest`` facet and keeps its
    partners."""
    if slip > longest:
        text = (
            f"{surface!r} slides by {slip:.3g}, more than a facet, but keeps the partners that it "
            'had at first; analysis.kinematics = "current" is for that'
        )
        yield Doubt(text, slip)


def _gap_doubts(system: System, surface: str, profile: AnyProfile) -> Iterator[str]:
    """A warning where a ``surface`` keeps its partners, and slip along normals that do not turn is
    taken for a gap that is not small beside what the contact presses together. Collective."""
    here = [pair.false_gap() for pair in system.contact.pairs if pair.surface.name == surface]
    gap = system.comm.allreduce(max(here, default=0.0), op=MPI.MAX)
    pressure, _ = profile.largest
    size = profile.contact_length ** (1 / (system.problem.kinematics.dimension - 1))
    approach = pressure * size / system.sides[surface].material.elastic_tangent[0, 0]
    if gap > _FALSE * approach:
        part = f"where about {approach:.2g} is pressed together"
        text = f"{surface!r} keeps the partners and normals that it had at first, so that gaps are"
        cure = 'analysis.kinematics = "current" is for that'
        yield Doubt(f"{text} wrong by up to {gap:.2g}, {part}; {cure}", gap)


def _spring_doubts(state: Accepted, m: Record) -> Iterator[str]:
    """A warning where springs that hold floating bodies do a part of the work."""
    by_springs = state.system.stabilisation_energy
    _, total = largest_energies([*state.before, m])
    if by_springs > _SPURIOUS * total:
        text = f"springs that hold floating bodies do {by_springs:.1e} of the work {total:.1e}"
        yield Doubt(text, by_springs / total if total else 0.0)


def refusal(system: System, steps: Sequence[Record]) -> str:
    """Why a run must not go on after the last of the ``steps``: springs carry what something else
    should. Where no force is prescribed, they may carry alone: bodies may be pushed until they
    touch. Collective."""
    by_springs = system.stabilisation_energy
    stored, total = largest_energies(steps)
    if by_springs <= _CARRYING * total:
        return ""
    pushed = system.equilibrium.drives.pushes(system.equilibrium.load)
    if by_springs > stored and not pushed:
        return ""
    name = system.hardest_held
    by = f"{100 * by_springs / total:.2g} % of the work, more than 1 %"
    share = f"weak springs that keep it from floating do {by}"
    return f"{_LOST}: no contact carries {name!r}, {share}; hold it by a support, {_CHECK}"


def ending(scene: ProblemScene, system: System, steps: Sequence[Record]) -> tuple[str, list[str]]:
    """Why a run that came to its end does not count as done: springs alone hold a body. And a
    warning where nothing ever touched, or parted."""
    if system.stabilisation_energy > _ALONE * largest_energies(steps)[1]:
        held = f"no contact carries {system.hardest_held!r}; hold it by a support, {_CHECK}"
        return f"{_LOST}: {held}", []
    if all(part.law == "tied" for part in scene.interaction):
        return "", []
    met = [m.step for m in steps if m.contact_area]
    if not met:
        return "", [NEVER]
    parted = met[-1] < steps[-1].step and _farther(scene, steps, met[-1])
    return "", [PARTED.format(met[-1] + 1)] if parted else []


def _farther(scene: ProblemScene, steps: Sequence[Record], last: int) -> bool:
    """Whether a load displaces farther after the step number ``last`` than up to it."""
    for load in scene.load:
        if load.displacement is None:
            continue
        name = f"{load.name} displacement"
        before = max(abs(m[name]) for m in steps if m.step <= last)
        after = max(abs(m[name]) for m in steps if m.step > last)
        if after > before:
            return True
    return False

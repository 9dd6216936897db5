"""What to warn of after a step of any problem."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from archord.materials.elasticity import Elastic
from archord.materials.hardening import TabularHardening
from archord.materials.material import of_small_strain
from archord.measures.measure import Accepted
from archord.measures.record import Record
from archord.report.doubts import Doubt
from archord.solver.contact.laws.named import Tied
from archord.solver.parts import Load

if TYPE_CHECKING:
    from archord.solver.path.system import System
    from archord.solver.problem import Body, Problem

Check = Callable[[Accepted, Record], Iterable[str]]  # what to warn of after a step; collective

LARGE_STRAIN = 0.05
LARGE = 'analysis.strain = "large" is for that'
_PLASTIC = 0.5  # PEEQ over the strain, from which on bodies strain by yielding
_OTHER_UNIT = 3e5  # ratio of moduli: MPa for Pa is a million, steel on soft rubber 2e5
_INCOMPRESSIBLE = 100.0  # modulus of uniaxial strain over shear modulus: nu = 0.495
_COERCIVE = 0.25  # gamma_factor over the stiffness, below which contact may be too soft
_FLAT = 0.01  # rise of the yield stress that a table leaves out, over its last stress
_LEFT = 1e-3  # of the largest pressure of a run, what is left of it after unloading
_FAR_TURN = 0.2  # angle at which linear rotations stretch lengths by 2 %
_MIXED_TURN = 0.02  # angle at which 2 % of a gap is seen as slip
_BALANCED = 1e-8  # force that is left, or residual, over the largest force


def contrast_doubts(bodies: Sequence[Body]) -> list[str]:
    """A warning where the moduli of two ``bodies`` are so far apart that they may be given in
    different units."""
    moduli = {body.name: float(body.material.elastic_tangent[2, 2]) for body in bodies}
    softest = min(moduli, key=lambda name: moduli[name])
    stiffest = max(moduli, key=lambda name: moduli[name])
    ratio = moduli[stiffest] / moduli[softest]
    if ratio < _OTHER_UNIT:
        return []
    return [
        f"{stiffest!r} is {ratio:.1e} times as stiff as {softest!r}: look whether their E have the "
        "same unit"
    ]


def plane_doubts(problem: Problem) -> list[str]:
    """A warning of a deck whose elements are named for other kinematics than the ``problem``
    has by default."""
    named = problem.mesh.plane
    solved = problem.kinematics.name
    if named in ("", solved):
        return []
    return [
        f'the elements of the mesh are named for "{named}", but "{solved}" is solved: give one of '
        "them as analysis.plane, or the kinematics of the Problem"
    ]


def volume_doubts(system: System) -> list[str]:
    """A warning of bodies in contact that hardly change their volume, whose stress scatters between
    points."""
    problem = system.problem
    surfaces = [name for part in problem.interactions for name in part.surfaces]
    touching = [problem.body_of(name) for name in surfaces if isinstance(name, str)]
    for body in touching:
        tangent = body.material.elastic_tangent
        ratio = float(tangent[0, 0] / tangent[-1, -1])
        if ratio > _INCOMPRESSIBLE:
            return [
                f"{body.name!r} hardly changes its volume: its pressure scatters between points, "
                "so that contact lengths and areas, contact angles and largest pressures may be "
                "far off on coarse meshes; forces and displacements are not; smaller elements help"
            ]
    return []


def point_doubts(problem: Problem) -> list[str]:
    """Warnings of loads on single points, where displacements have no limit as elements get
    smaller."""
    places = problem.mesh.point_sets
    elsewhere = {*problem.mesh.facet_sets, *(coupling.name for coupling in problem.couplings)}
    said = []
    for load in problem.loads:
        if not isinstance(load, Load) or load.on in elsewhere or load.on not in places:
            continue
        points = places[load.on]
        is_one = len(points) > 0 and np.ptp(points, axis=0).max() == 0
        if is_one and load.kind != "pressure" and np.any(getattr(load, load.kind)):
            said.append(
                f"{load.name!r} loads the single point {load.on!r}, whose displacement over the "
                "force grows without a limit as elements get smaller; a facet set, a coupling or "
                "the cells of a body spread a load"
            )
    return said


def stiff_quadrilaterals(system: System) -> list[str]:
    """A warning of displacements of second order on quadrilaterals around an axis, whose plastic
    flow is held back: see `geometry.basis.bulk_quadrature_degree`."""
    problem = system.problem
    quadrilaterals = "quadrilateral" in system.cell_kind
    yielding = [body.name for body in problem.bodies if body.material.yields]
    if not (problem.kinematics.has_hoop and quadrilaterals and problem.degree == 2 and yielding):
        return []
    return [
        f"second-order quadrilaterals around an axis are too stiff where all of {yielding[0]!r} "
        "yields: they carry 31 % and more too much with two cells across a wall, 2 % to 9 % with "
        "four, 0.2 % to 0.6 % with eight; with four, triangles or analysis.degree = 3 carry 0.1 % "
        "too much at most"
    ]


def told_of_facets(pressure: float, before: Sequence[float]) -> bool:
    """Whether a warning of few facets in contact is worth a word under this largest ``pressure``,
    after those ``before``: what unloading leaves of a contact decides on nothing."""
    return pressure > _LEFT * max(before, default=0.0)


def few_facets(touching: int, least: int, where: str, cure: str) -> list[str]:
    """A warning where fewer facets than the ``least`` are in contact."""
    if touching >= least:
        return []
    facets = "facet" if touching == 1 else "facets"
    return [
        Doubt(f"only {touching} {facets} {where}in contact; {cure} would resolve it", -touching)
    ]


def distortion_doubts(system: System, peeq: float, *, small: bool) -> list[str]:
    """What to warn of where cells are strained or turned far in the last accepted state, by
    ``small`` strain, or turned over, by any; ``peeq``, which has a warning of its own, is the
    largest. Collective."""
    strain, tag, angle, inside_out = system.distortion()
    said = list[str]()
    if inside_out:
        cells = "1 element is" if inside_out == 1 else f"{inside_out} elements are"
        text = f"{cells} turned inside out: stresses and forces mean nothing"
        said.append(Doubt(text, inside_out))
    if not small:
        return said + _turning_pairs(system, angle) + _kept_normals(system, angle)
    if strain > LARGE_STRAIN and peeq < _PLASTIC * strain:
        name = next(body.name for body in system.problem.bodies if system.problem.tag(body) == tag)
        off = f"which makes stresses and forces wrong by about {100 * strain:.2g} %"
        text = f"the strain reaches {strain:.2g} in {name!r}, too much for small-strain theory"
        said.append(Doubt(f"{text}, {off}; {LARGE}", strain))
    if angle > _FAR_TURN:
        false_strain = f"small-strain theory takes for a strain of {angle**2 / 2:.2g}"
        text = f"elements turn by {angle:.2g} rad, which {false_strain}; {LARGE}"
        said.append(Doubt(text, angle))
    return said


def hardening_doubts(state: Accepted) -> Iterator[str]:
    """A warning of each body whose PEEQ is so far beyond its last point of hardening that a
    straight line on would raise the yield stress. Collective."""
    for body in state.system.problem.bodies:
        law = getattr(of_small_strain(body.material), "hardening", None)
        if not isinstance(law, TabularHardening) or len(law.points) == 1:
            continue
        (before, lower), (last, stress) = law.points[-2:]
        peeq, *_ = state.largest_peeq(body.name)
        rise = (stress - lower) / (last - before) * (peeq - last) / stress
        if rise > _FLAT:
            text = f"PEEQ reaches {peeq:.2g} in {body.name!r}, whose hardening ends at {last:.2g}"
            yield Doubt(
                f"{text}: its yield stress stays at {stress:g}, where a straight line on would be "
                f"{100 * rise:.3g} % higher",
                rise,
            )


def _turning_pairs(system: System, angle: float) -> list[str]:
    """A warning where bodies in space that are tied or rub turn far: see docs/theory.md, turning
    pairs."""
    is_in_space = system.problem.kinematics.dimension == 3
    pairs = system.contact.pairs
    has_shear = any(pair.counts_slip or isinstance(pair.law, Tied) for pair in pairs)
    if not (is_in_space and has_shear and angle > _FAR_TURN):
        return []
    text = f"elements turn by {angle:.2g} rad in space, where bodies are tied or rub"
    inexact = "forces of surfaces that press while both bodies turn are not exact then"
    return [Doubt(f"{text}: {inexact}", angle)]


def _kept_normals(system: System, angle: float) -> list[str]:
    """A warning where cells turn by an ``angle`` and a law that keeps its partners, as a glue of
    one's own does, keeps the undeformed normals, too."""
    keeps = [
        interface.interaction.name
        for interface in system.contact.interfaces
        for pair in interface.pairs
        if not (pair.law.slides or isinstance(pair.law, Tied))
    ]
    if not keeps or angle <= _MIXED_TURN:
        return []
    text = f"elements turn by {angle:.2g} rad, but the law of {keeps[0]!r} keeps the normals of the"
    return [Doubt(f"{text} undeformed surfaces: where these turn, it takes gaps for slips", angle)]


def gamma_doubts(system: System) -> list[str]:
    """A warning of a material of one's own that got so stiff in contact that gamma, which is made
    of its elastic tangent, no longer keeps the contact's form coercive: see
    `solver.contact.interaction`. Collective."""
    for interface in system.contact.interfaces:
        factor = interface.interaction.gamma_factor
        for pair in interface.pairs:
            material = pair.surface.material
            inner = of_small_strain(material)
            is_known = isinstance(inner, Elastic) or inner.finite
            if is_known or not material.yields:
                continue
            ratio = system.comm.allreduce(pair.stiffening(), MPI.MAX)
            if ratio > factor / _COERCIVE:
                body = system.problem.body_of(pair.surface.name).name
                text = f"{body!r} is {ratio:.2g} times as stiff in contact as its elastic_tangent"
                cure = f"gamma_factor = {ratio:.0f} of the interactions is for that"
                return [Doubt(f"{text}, so that forces may be far too small; {cure}", ratio)]
    return []


def round_off_doubts(state: Accepted, tolerance: float) -> list[str]:
    """A warning where round-off keeps the residual of a loaded state above the ``tolerance``."""
    residual = state.residual
    if residual <= max(_BALANCED, tolerance):
        return []
    return [Doubt(f"round-off limits the residual to {residual:.1e} of the reaction", residual)]


def balance_doubts(m: Record, sentence: str, tolerance: float) -> list[str]:
    """A warning, the ``sentence`` with the number, where forces do not balance, to the
    ``tolerance`` of the solver."""
    left = m.force_balance
    return [Doubt(sentence.format(left), left)] if left > max(_BALANCED, tolerance) else []

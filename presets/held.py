"""Checks of a problem on its mesh: what the mesh lacks, and whether something holds every
body."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, combinations, product

import numpy as np
from mpi4py import MPI

from archord.geometry.meshes.check import check_mesh, facets_within, gaps
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.motions import AXISYMMETRIC, PLANE, SPACE, free_motions
from archord.geometry.meshes.quality import beyond_axis, place
from archord.materials.kinematics import Ints
from archord.materials.material import Array
from archord.report.by_name import Words
from archord.solver.conditions import Dirichlet
from archord.solver.contact.interaction import Interaction
from archord.solver.contact.pair import Pair
from archord.solver.parts import Load, Support
from archord.solver.path.system import System
from archord.solver.problem import Problem

_FAR = 0.1  # of the size of a surface: drawn farther behind another one, it does not face that
_APART = 0.01  # of the same: a gap between tied surfaces that is told of
_ALIKE = 2.0  # ratio of a drawn overlap and an interference, up to which they mean the same fit
_ADDS = 0.1  # of a fit: a drawn gap or overlap by which it is another one
_ON_AXIS = 1e-9  # of the size of the mesh: a radius that is none
# what is said of facets within a body, along which a load is spread, or which are moved
_NOT_LOADED = ", where nothing can load them: give it the facets of the boundary alone"
_HALF_HELD = ": look whether its elements are numbered as the set takes them"
_BENT = 0.01  # of the length of an edge: how far it may depart from a line and be straight


def check(problem: Problem) -> list[str]:
    """Warnings about the mesh of the ``problem`` as it is stated. Collective; raises ValueError on
    all ranks for a mesh that is at fault and a body that nothing holds."""
    mesh = problem.mesh
    cells = {body.name: body.cells for body in problem.bodies}
    surfaces = [name for part in problem.interactions for name in _surfaces(part)]
    owner = {name: problem.body_of(name).name for name in surfaces}
    fits = [part.overlap + part.interference for part in problem.interactions]
    in_mm = tuple(problem.units) == ("mm", "MPa")
    warnings = check_mesh(mesh, cells, _pairs(problem), max(fits, default=0.0), in_mm)
    whole = gathered(mesh)
    failure = ""
    doubts = list[str]()
    if whole is not None:
        around_axis = problem.kinematics.has_hoop
        in_space = whole.dimension == 3
        moves = _free(problem, whole, cells, owner)
        touching = set(owner.values())
        excused = SPACE if in_space else ("rotation",)
        faults = chain(
            beyond_axis(whole.x) if around_axis else [],
            _pressed_axis(problem, whole) if around_axis else [],
            _shared(problem, whole, owner),
            _within(whole, _spread(problem), _NOT_LOADED),
            _loose(moves, touching, excused),
        )
        failure = next(faults, "")
        doubts += _within(whole, _moved(problem), _HALF_HELD)
        doubts += _sliding(problem, owner, moves) if in_space else []
        doubts += _moved_in_contact(problem, whole)
        doubts += _stiffened(problem, whole)
        for name in sorted({*owner, *_moved(problem), *_spread(problem)}):
            doubts += gaps(whole, name)
    failure, doubts = mesh.mesh.comm.bcast((failure, doubts))
    if failure:
        raise ValueError(failure)
    return warnings + doubts


def _surfaces(part: Interaction) -> list[str]:
    """The facet sets of an interaction."""
    return [name for name in part.surfaces if isinstance(name, str)]


def _is_tied(part: Interaction) -> bool:
    """Whether the points of an interaction keep their partners."""
    return part.law == "tied" or not getattr(part.law, "slides", True)


def _pairs(problem: Problem) -> list[list[str | float]]:
    """What meets, as `check_mesh` takes it: each surface of a tie alone, both of a contact, or one
    and the radius of the disc beside it."""
    pairs: list[list[str | float]] = []
    for part in problem.interactions:
        names = _surfaces(part)
        if _is_tied(part):
            pairs += [[name] for name in names]
    for part in problem.interactions:
        if not _is_tied(part):
            beside = [part.disc.radius] if part.disc else []
            pairs.append([*_surfaces(part), *beside])
    return pairs


def _supports(problem: Problem) -> list[Support]:
    return [part for part in problem.supports if isinstance(part, Support)]


def _loads(problem: Problem) -> list[Load]:
    return [part for part in problem.loads if isinstance(part, Load)]


def _spread(problem: Problem) -> set[str]:
    """The facet sets along which something is spread: a pressure, or the force of a distributing
    coupling."""
    pressed = {load.on for load in _loads(problem) if load.kind == "pressure"}
    distributing = [c for c in problem.couplings if c.kind == "distributing"]
    return pressed | {coupling.facets for coupling in distributing}


def _moved(problem: Problem) -> Words:
    """The sets whose nodes move as is prescribed, and what prescribes it."""
    found = {c.facets: c.name for c in problem.couplings if c.kind == "rigid"}
    found |= {load.on: load.name for load in _loads(problem) if load.kind != "pressure"}
    return found | {support.on: support.name for support in _supports(problem)}


def _within(whole: MeshArrays, names: Iterable[str], then: str) -> Iterator[str]:
    """What is said of facets inside a body in the sets of these ``names``, and ``then``."""
    for name in sorted(names):
        for said in facets_within(whole, name):
            yield f"{said}{then}"


def _pressed_axis(problem: Problem, whole: MeshArrays) -> Iterator[str]:
    """What is said of pressures around an axis on facets of the axis itself."""
    size = np.ptp(whole.x, axis=0).max(initial=0.0)
    for load in _loads(problem):
        if load.kind != "pressure":
            continue
        corners = _corners(whole, load.on)
        if np.abs(whole.x[corners, 0]).max(initial=0.0) <= _ON_AXIS * size:
            yield (
                f"the pressure {load.name!r} is on {load.on!r}, which lies on the axis x = 0 and "
                "has no area there, so that it would load nothing: give it a surface off the axis"
            )


def _stiffened(problem: Problem, whole: MeshArrays) -> Iterator[str]:
    """Warnings of forces on edges that are not straight: an edge under a force moves by one
    displacement, which keeps its shape along the force."""
    for load in _loads(problem):
        if load.kind != "force" or load.on not in whole.facet_sets:
            continue
        corners = _corners(whole, load.on)
        x = whole.x[np.unique(corners)]
        extents = np.linalg.svd(x - x.mean(axis=0), compute_uv=False)
        if extents[-1] > _BENT * extents[0]:
            shape = "face is not flat" if whole.dimension == 3 else "edge is not straight"
            yield (
                f"the force {load.name!r} moves all of {load.on!r} by one displacement in "
                f"{load.direction}, and that {shape}: it keeps its shape as if it "
                "were stiff; a pressure, a distributing coupling, or the force on the body's "
                "cells leaves it free"
            )


def _moved_in_contact(problem: Problem, whole: MeshArrays) -> Iterator[str]:
    """Warnings of sets with a prescribed motion that have some facets of a surface in contact, and
    others."""
    smooth = [part for part in problem.interactions if not _is_tied(part)]
    surfaces = [(part.name, name) for part in smooth for name in _surfaces(part)]
    for (on, by), (part, surface) in product(_moved(problem).items(), surfaces):
        there = whole.within(on)
        touching = whole.within(surface)
        both = there & touching
        only_moved = there & ~touching
        only_touching = touching & ~there
        if both.any() and only_moved.any() and only_touching.any():
            at = _middle(whole, whole.facets[both][0])
            yield (
                f"the set {on!r} of {by!r} has {both.sum()} facets of the surface {surface!r} of "
                f"{part!r}, as at {at}, which it moves whatever they touch: look "
                "whether they belong to both"
            )


def _shared(problem: Problem, whole: MeshArrays, owner: Words) -> Iterator[str]:
    """What is said of facets that two interactions have, facing the same body in both: what is
    between them would be counted twice."""
    surfaces = [
        (part.name, name, _faced(part, name, owner))
        for part in problem.interactions
        for name in _surfaces(part)
    ]
    for (first, one, faced), (second, other, also) in combinations(surfaces, 2):
        if first == second or faced != also:
            continue
        common = whole.facets[whole.within(one) & whole.within(other)]
        if len(common):
            at = _middle(whole, common[0])
            yield (
                f"the surfaces {one!r} of the interaction {first!r} and {other!r} of {second!r} "
                f"have {len(common)} facets in common, the first at {at}, whose "
                "contact would count twice: a facet meets a body in one interaction"
            )


def _middle(whole: MeshArrays, facet: Ints) -> str:
    """The middle of the corners of a ``facet``, in words."""
    corners = whole.x[facet[: whole.dimension]]
    return place(corners.mean(axis=0))


def _faced(part: Interaction, name: str, owner: Words) -> str:
    """The body that the surface ``name`` of an interaction meets, "" for a rigid disc."""
    return next((owner[other] for other in _surfaces(part) if other != name), "")


def _free(problem: Problem, whole: MeshArrays, cells: Words, owner: Words) -> dict[str, list[str]]:
    """The rigid motions of each body that neither supports nor contact without friction prevent;
    but a turn of a body in contact in a plane."""
    held = _held_places(problem, whole, cells)
    links = []
    for part in problem.interactions:
        names = _surfaces(part)
        corners = whole.x[_corners(whole, names[-1])]
        middle = corners.mean(axis=1)
        sides = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
        frames = np.linalg.qr(sides, mode="complete")[0]  # the tangents, then the normal
        directions = np.moveaxis(frames, 2, 0)
        if not _is_tied(part):
            directions = directions[-1:]
        bodies = [owner[name] for name in names]
        for direction in directions:
            if len(bodies) == 1:
                held[bodies[0]].append((middle, direction))
            else:
                links.append((bodies[0], bodies[1], middle, direction))
    possible = SPACE if whole.dimension == 3 else PLANE
    if problem.kinematics.has_hoop:
        possible = AXISYMMETRIC
    return free_motions(held, links, possible)


def _loose(
    moves: dict[str, list[str]], touching: set[str], excused: Sequence[str]
) -> Iterator[str]:
    """What is said of bodies that neither supports nor contact hold; ``excused`` motions of bodies
    in contact are no fault."""
    for body, motions in moves.items():
        free = [motion for motion in motions if motion not in excused or body not in touching]
        if not free:
            continue
        others = [name for name, its in moves.items() if name != body and set(free) & set(its)]
        where = ""
        if others:
            said = ", ".join(map(repr, others))
            where = f" to it, or to a body that it touches: {said}"
        yield (
            f"nothing holds the body {body!r}: it is free in {' and '.join(free)}; add a "
            f"[[support]]{where}"
        )


def _sliding(problem: Problem, owner: Words, moves: dict[str, list[str]]) -> Iterator[str]:
    """Warnings of bodies in contact without friction that nothing keeps from sliding."""
    smooth = [part for part in problem.interactions if not (part.friction or _is_tied(part))]
    bodies = {owner[name] for part in smooth for name in _surfaces(part)}
    for body in sorted(bodies):
        axes = [motion for motion in moves[body] if motion in ("x", "y", "z")]
        if axes:
            yield (
                f"only weak springs keep the body {body!r} from sliding along "
                f"{' and '.join(axes)}, as nothing pushes it there: a [[support]] of one of its "
                "sets holds it"
            )


def _held_places(
    problem: Problem, whole: MeshArrays, cells: Words
) -> dict[str, list[tuple[Array, Array]]]:
    """Where supports and displacements hold each body, and along what: places ``(k, d)`` and
    directions ``(k, d)``, or motions ``(1, 6)`` about the point of a coupling in space."""
    d = whole.dimension
    facets = {c.name: c.facets for c in problem.couplings}
    given = [(s.on, f) for s in _supports(problem) for f in s.held(d)]
    displaced = [load for load in _loads(problem) if load.kind == "displacement"]
    given += [(load.on, str(load.direction)) for load in displaced]
    fixed = [support for support in problem.supports if isinstance(support, Dirichlet)]
    given += [(support.facets, "xyz"[support.axis]) for support in fixed]
    hinged = [c for c in problem.couplings if d == 3 or (c.name, "rotation") not in given]
    hinges = {coupling.name: np.array([coupling.point]) for coupling in hinged}
    units = {freedom: np.eye(d)[axis] for axis, freedom in enumerate("xyz"[:d])}
    if d == 3:
        units |= {SPACE[turn]: np.eye(6)[turn] for turn in (3, 4, 5)}
    inside = {body: _nodes(whole, name, of_cells=True) for body, name in cells.items()}
    held: dict[str, list[tuple[Array, Array]]] = {body: [] for body in cells}
    for on, freedom in given:
        nodes = _nodes(whole, facets.get(on, on))
        for body, of_body in inside.items():
            here = np.intersect1d(nodes, of_body)
            if len(here) and freedom in units:
                places = hinges.get(on, whole.x[here])
                directions = np.tile(units[freedom], (len(places), 1))
                held[body].append((places, directions))
    return held


def require_facing(system: System) -> list[str]:
    """Warnings of fits that are not as drawn. Collective; raises ValueError where surfaces of an
    interaction as drawn do not face each other, a tie has nothing to tie, or a fit is drawn and
    given as an interference, too."""
    warnings = []
    for interface in system.contact.interfaces:
        part = interface.interaction
        closest = np.inf
        apart = ""
        for pair in interface.pairs:
            lowest, nearest, farthest = _drawn_gap(pair, system.comm)
            size = np.ptp(pair.surface.curve.X, axis=0).max()
            allowed = part.overlap + _FAR * size
            said = f"the surface {pair.surface.name!r} of {part.name!r}"
            is_tied = not pair.law.slides
            is_near = nearest <= allowed
            if is_tied and is_near and farthest > _APART * size:
                drawn = f"the surfaces that {part.name!r} ties are drawn up to {farthest:.3g} apart"
                apart = f"{drawn}: what is carried along them loses its moment about that gap"
            if lowest < -allowed:
                raise ValueError(
                    f"{said} lies up to {-lowest:g} behind the opposite one: they must face each "
                    "other"
                )
            if is_tied and not is_near:
                raise ValueError(f"{said} is nowhere near the one that it is tied to")
            closest = min(closest, lowest)
        if apart:
            warnings.append(apart)
        if np.isfinite(closest):
            warnings += _fit_as_drawn(part, closest)
    return warnings


def drawn_gaps(pair: Pair) -> Array:
    """The gaps ``(k,)`` of the points of a ``pair`` that face the other surface, as drawn."""
    along_normal = (pair.separation * pair.projection.normal).sum(axis=1)
    return along_normal[pair.projection.found]


def _drawn_gap(pair: Pair, comm: MPI.Comm) -> tuple[float, float, float]:
    """The lowest gap of the points of a ``pair`` as drawn, and the smallest and the largest size of
    a gap. Collective."""
    gap = drawn_gaps(pair)
    size = np.abs(gap)
    lowest = gap.min(initial=np.inf)
    nearest = size.min(initial=np.inf)
    farthest = size.max(initial=0.0)
    smallest = np.array([lowest, nearest, -farthest])
    comm.Allreduce(MPI.IN_PLACE, smallest, op=MPI.MIN)
    lowest, nearest, farthest = smallest
    return float(lowest), float(nearest), -float(farthest)


def _fit_as_drawn(part: Interaction, gap: float) -> Iterator[str]:
    """Warnings of the fit of ``part``, whose surfaces are drawn with this smallest ``gap``,
    negative where they lie in each other. Raises ValueError for a fit that is drawn and given as an
    interference, too."""
    deep = -gap
    how = "apart" if gap >= 0 else "deep in each other"
    said = f"the surfaces of {part.name!r} are drawn {abs(gap):.3g} {how}"
    wanted = part.interference
    if part.overlap and deep < (1 - _ADDS) * part.overlap:
        yield f"{said}, but its overlap is {part.overlap:g}"
    is_alike = deep > wanted / _ALIKE and (deep < wanted * _ALIKE or not part.overlap)
    if wanted and is_alike:
        raise ValueError(
            f"{said}, and its interference of {wanted:g} would push them together by as much "
            f"again: for a fit that the mesh shows give overlap = {deep:.3g} alone, for one that "
            "it does not show draw them in touch"
        )
    if wanted and not part.overlap and deep > _ADDS * wanted:
        yield f"{said}, which adds to its interference of {wanted:g}"
    if wanted and gap > _ADDS * wanted:
        left = max(wanted - gap, 0.0)
        yield f"{said}: of its interference of {wanted:g} only {left:.3g} presses them together"


def _corners(whole: MeshArrays, name: str) -> Ints:
    """The first corners ``(k, d)``, as many as span a facet, of the facets of a set."""
    return whole.facets_of(name)[:, : whole.dimension]


def _nodes(whole: MeshArrays, name: str, of_cells: bool = False) -> Ints:
    """Nodes of a facet and point set, of a cell set where it is neither, or of the cell set alone;
    none of another name."""
    if not of_cells and (name in whole.facet_sets or name in whole.point_sets):
        points = whole.point_sets.get(name, ())
        return np.union1d(whole.facets_of(name), points).astype(np.int64)
    in_set = np.isin(whole.bodies, whole.cell_sets.get(name, ()))
    return np.unique(whole.cells[in_set])

"""A general scene as a problem to solve: its words as live parts."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import numpy as np
from mpi4py import MPI

from archord.geometry.curve import ProjectionError, RigidCircle
from archord.geometry.meshes.formats.source import CHANGES, Mesh, circles_in
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.geometry.rigid_in_space import RigidBall, RigidCylinder
from archord.materials.kinematics import kinematics
from archord.presets.mesh_family import coarser
from archord.report.errors import InputError
from archord.scene import parts
from archord.scene.problem import ProblemScene
from archord.scene.sections.keys import plain
from archord.solver.contact.laws.named import LAWS
from archord.solver.parts import Body, Coupling, Load, Support, freedoms
from archord.solver.path.system import System, displacement_space
from archord.solver.problem import Interaction, Problem

_SHARES = (1.0, 0.8, 0.65)  # of the size of elements for guesses, one after the other
_LEVER = 1e-6  # of a mean motion: round-off of its point


def general_problem(scene: ProblemScene, comm: MPI.Comm) -> Problem:
    """The problem that ``scene`` states, on a mesh on the ranks of ``comm``. Collective; raises
    `InputError` for a file that is no mesh, and for parts that were given from Python."""
    with as_input_error(mesh_name(scene)):
        mesh = scene_mesh(scene, comm)
        in_place = placed(scene, mesh)
        problem = problem_of(in_place, mesh)
    if not in_place.in_space or coarser(in_place) is None:
        return problem
    return replace(problem, coarser=partial(_coarser_problem, in_place, comm))


def _coarser_problem(
    scene: ProblemScene, comm: MPI.Comm, shares: Sequence[float] = _SHARES
) -> Problem:
    """The problem of a ``scene`` on larger elements, for guesses, and on less large ones where some
    of them are folded. Collective; raises `InputError` where no size will do."""
    share, *smaller = shares
    larger = coarser(scene, share)
    if larger is None:
        raise InputError(mesh_name(scene), "no larger elements can be drawn.")
    try:
        return general_problem(larger, comm)
    except InputError:
        if not smaller:
            raise
    return _coarser_problem(scene, comm, smaller)


def placed(scene: ProblemScene, mesh: TaggedMesh) -> ProblemScene:
    """The ``scene`` in a plane or in space, as its ``mesh`` is where it does not say. Raises
    `InputError` for a scene that does not fit the mesh."""
    plane = scene.analysis.plane
    in_space = mesh.dimension == 3
    if "plane" in scene.analysis.model_fields_set:
        if in_space == (plane == "space"):
            return scene
        drawn = "a plane mesh"
        allowed = '"strain", "stress" or "axisymmetric"'
        if in_space:
            drawn = "a mesh of solids"
            allowed = '"space"'
        said = f"must be {allowed} for {drawn}"
        raise InputError(mesh_name(scene), f'analysis.plane = "{plane}" {said}.')
    if not in_space and not scene.in_space:
        return scene
    data = plain(scene)
    analysis = data.get("analysis", {})
    data["analysis"] = analysis | {"plane": "space" if in_space else "strain"}
    return ProblemScene(mesh_name(scene), None, **data)


@contextmanager
def as_input_error(source: str) -> Iterator[None]:
    """Raise the ValueError of a mesh or a problem, and the ProjectionError of its surfaces, as
    `InputError` that names the ``source`` of the mesh."""
    try:
        yield
    except InputError:
        raise
    except (ValueError, ProjectionError) as error:
        said = str(error)
        if not said.startswith(source):
            said = f"{source}: {said}"
        raise InputError(said if said.endswith(".") else f"{said}.") from None


def mesh_name(scene: ProblemScene) -> str:
    """What messages call the mesh of ``scene``."""
    return scene.mesh.file or "mesh.shape"


def scene_mesh(scene: Any, comm: MPI.Comm) -> TaggedMesh:
    """The mesh of a general ``scene``, or of a scene that has a mesh alone. Collective; raises
    ValueError, and `InputError` for a file that is not there."""
    mesh = scene.mesh
    where = scene.where("mesh.file")
    lacks = mesh.shape is None and where != mesh.file and not os.path.exists(mesh.file)
    if comm.bcast(lacks):
        raise InputError(where, f'mesh.file = "{mesh.file}" must be a file that is there.')
    if mesh.shape is not None:
        shape = mesh.shape.arguments()
        del shape["kind"]
        draw = resolve_name(mesh.shape.drawing)
        return draw(comm, degree=scene.analysis.degree, **shape)
    circles = circles_in(mesh.circle)
    changes = {name: getattr(mesh, name) for name in CHANGES}
    return Mesh(mesh.file, circles=circles, **changes).on(comm)


def problem_of(scene: ProblemScene, mesh: TaggedMesh) -> Problem:
    """The problem that ``scene`` states, on its ``mesh``. Raises `InputError` for parts that were
    given from Python."""
    _require_words(scene)
    analysis = scene.analysis
    return Problem(
        mesh,
        [_body(body, analysis.plane, analysis.strain) for body in scene.body],
        [_interaction(part, analysis) for part in scene.interaction],
        [Support(part.name, part.on, part.fixed) for part in scene.support],
        [_load(load) for load in scene.load],
        [Coupling(part.name, part.facets, tuple(part.point), part.kind) for part in scene.coupling],
        steps=scene.path.steps,
        fit_steps=scene.path.fit_steps,
        kinematics=kinematics(analysis.plane),
        thickness=analysis.thickness,
        symmetry=analysis.symmetry,
        units=(scene.units.length, scene.units.stress),
        degree=analysis.degree,
        tolerance=analysis.tolerance,
        max_iterations=analysis.max_iterations,
    )


def _require_words(scene: ProblemScene) -> None:
    """Raise `InputError` for a body or an interaction whose material or law is no word."""
    kinds: list[tuple[str, str, Any]] = [
        ("body", "material", scene.body),
        ("interaction", "law", scene.interaction),
    ]
    for section, what, given in kinds:
        for part in given:
            if part.own is not None:
                folder = Path(scene.mesh.file or "").parent
                raise InputError(
                    f'{section} "{part.name}": has a {what} given from Python, {part.own.text}, '
                    "which no scene file "
                    f"can state; go on by archord.solve(problem, {str(folder)!r}, restart=True), "
                    "with the same problem."
                )


def _body(body: parts.BodySection, plane: Any, strain: str) -> Body:
    return Body(body.name, body.constitutive(plane, strain), body.cells or "")


def _interaction(part: parts.InteractionSection, analysis: Any) -> Interaction:
    first: Any = part.surfaces[0]
    if part.rigid is not None:
        first = _disc(part.rigid)
    law: Any = part.law
    if part.parameters:
        make: Any = LAWS[part.law]
        law = make(**part.parameters)
    return Interaction(
        part.name,
        (first, part.surfaces[-1]),
        law=law,
        friction=part.friction,
        kinematics=analysis.kinematics,
        gamma_factor=analysis.gamma_factor,
        integrated=part.integrated or "",
        interference=part.interference,
        overlap=part.overlap,
    )


def _disc(disc: parts.DiscSection) -> RigidCircle | RigidBall:
    if disc.axis is not None:
        return RigidCylinder(disc.centre, disc.radius, disc.axis)
    kind = RigidCircle if len(disc.centre) == 2 else RigidBall
    return kind(disc.centre, disc.radius)


def _load(load: parts.LoadSection) -> Load:
    core = None
    if load.core is not None:
        core = (tuple(load.core.centre), load.core.radius)
    values = {load.kind: load.stages}
    return Load(load.name, load.on, load.direction, core=core, **values)


def require_mirrored(problem: Problem) -> None:
    """Raise ValueError where a rigid coupling of a part with mirror images shares nodes with an
    edge or a face that is held in one direction, as a mirror line or plane is, and could leave it
    or turn out of it. Collective."""
    fixed: dict[str, set[str]] = {}
    for support in problem.supports:
        if isinstance(support, Support):
            axes = support.held(problem.mesh.dimension)
            fixed.setdefault(support.on, set()).update(axes)
    held = {coupling.name: fixed.pop(coupling.name, set()) for coupling in problem.couplings}
    lines = [(on, *axes) for on, axes in fixed.items() if len(axes) == 1]
    rigid = [coupling for coupling in problem.couplings if coupling.kind == "rigid"]
    if problem.symmetry <= 1 or not lines or not rigid:
        return
    mesh = problem.mesh
    V = displacement_space(mesh.mesh, problem.degree)
    turns = [freedom for freedom in freedoms(mesh.dimension) if freedom.startswith("rotation")]
    for coupling, (on, axis) in product(rigid, lines):
        leaving = [axis, *(turn for turn in turns if turn != f"rotation {axis}")]
        free = [freedom for freedom in leaving if freedom not in held[coupling.name]]
        shared = np.intersect1d(mesh.dofs_in(V, coupling.facets), mesh.dofs_in(V, on))
        if mesh.mesh.comm.allreduce(len(shared)) and free:
            raise ValueError(
                f"the rigid coupling {coupling.name!r} of a part with mirror images meets {on!r}, "
                f"which is held in {axis}: hold its {' and '.join(free)}, too, in a [[support]]"
            )


def require_no_lever(problem: Problem, system: System) -> None:
    """Raise ValueError where a force on a distributing coupling of a ``problem`` with mirror images
    would turn its facets: its point is beside them, and not the point of the images, too.
    Collective."""
    points = {coupling.name: coupling.point for coupling in problem.couplings}
    for mean in system.problem.means:
        if mean.name not in points:
            continue
        point = points[mean.name]
        beside = system.mirrors_beside(mean.facets, point)
        if not beside:
            continue
        motion = system.mean_rates(mean.facets, point)[mean.axis]
        amid = system.mean_rates(mean.facets, None)[mean.axis]
        by_lever = system.comm.allreduce(float(np.abs(motion - amid).sum()))
        if by_lever > _LEVER * system.comm.allreduce(float(np.abs(amid).sum())):
            along = system.problem.kinematics.axes[beside[0].axis]
            raise ValueError(
                f"the distributing coupling {mean.name!r} of a part with mirror images has its "
                f"point beside its facets, where {mean.drive!r} would turn them: move the point "
                f"along {along} to the middle of the facets, or take the whole"
            )

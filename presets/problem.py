"""A general scene as a problem to solve."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import product
from typing import Literal

import numpy as np
from mpi4py import MPI

from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.plane_mesh import PlaneMesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh, unknown
from archord.geometry.shapes.bushing import bushing
from archord.geometry.shapes.clevis import clevis
from archord.geometry.shapes.lug import lug
from archord.materials.kinematics import kinematics
from archord.materials.material import Array
from archord.presets.joint import core_density, joint_mesh, require_core
from archord.scene import parts
from archord.scene.errors import InputError
from archord.scene.problem import GIVEN, LIVE, ProblemScene
from archord.solver.path.system import displacement_space
from archord.solver.problem import (
    Body,
    Drive,
    Guess,
    Interaction,
    Load,
    Mean,
    Problem,
    Rigid,
    Support,
)

_SHAPES: dict[str, Callable[..., TaggedMesh]] = {
    "lug": lug,
    "clevis": clevis,
    "bushing": bushing,
    "joint": joint_mesh,
}
_STRETCHED = 10.0  # sizes of the mesh that large strain may displace by
_AXES = {"x": 0, "y": 1, "rotation": 2}


def general_problem(scene: ProblemScene, comm: MPI.Comm) -> Problem:
    """The problem that ``scene`` states. Collective over ``comm``; raises `InputError` for a file
    that is no mesh, a set that it does not have, a problem that contradicts itself."""
    with as_input_error(scene):
        return _Builder(scene, scene_mesh(scene, comm)).problem()


@contextmanager
def as_input_error(scene: ProblemScene) -> Iterator[None]:
    """Raise the ValueError of a mesh or a problem as `InputError` that names the mesh of
    ``scene``."""
    try:
        yield
    except ValueError as error:
        source, said = scene.mesh.file or "mesh.shape", str(error)
        said = said if said.startswith(source) else f"{source}: {said}"
        raise InputError(said if said.endswith(".") else f"{said}.") from None


def scene_mesh(scene: ProblemScene, comm: MPI.Comm) -> TaggedMesh:
    """The mesh of ``scene``. Collective; raises ValueError."""
    mesh = scene.mesh
    if mesh.shape is not None:
        shape = mesh.shape.arguments()
        return _SHAPES[shape.pop("kind")](comm, degree=scene.analysis.degree, **shape)
    from archord.geometry.meshes.formats.read import (
        read_mesh,
        tagged,
    )  # with scipy, which solves of presets do without

    source = LIVE.get(mesh.file or "", mesh.file)
    if source == mesh.file and mesh.file.endswith(GIVEN):
        raise ValueError(
            f"{mesh.file}: is gone with the process that gave it; the run folder has it as mesh.npz"
        )
    circles = [
        Circle(circle.facets, (circle.centre[0], circle.centre[1]), circle.radius)
        for circle in mesh.circle
    ]
    given = tagged(*source) if isinstance(source, tuple) else source
    return read_mesh(
        given, comm, circles=circles, scale=mesh.scale, order=mesh.order, refine=mesh.refine
    )


def given_mesh(scene: ProblemScene, comm: MPI.Comm) -> PlaneMesh | None:
    """The mesh given from Python, as `scene_mesh` takes it before it scales and refines it: on rank
    0, None elsewhere. Collective."""
    from archord.geometry.meshes.formats.read import plane_mesh_of, tagged

    source = LIVE[scene.mesh.file or ""]
    given = tagged(*source) if isinstance(source, tuple) else source
    return plane_mesh_of(given, comm, scene.mesh.order)


def require_mirrored(scene: ProblemScene, problem: Problem) -> None:
    """Raise ValueError where a rigid coupling of a part with mirror images shares nodes with an
    edge that is held in one direction, as a mirror line is, and could leave that line or turn.
    Collective."""
    fixed: dict[str, set[str]] = {}
    for support in scene.support:
        fixed.setdefault(support.on, set()).update(support.fixed)
    held = {c.name: fixed.pop(c.name, set()) for c in scene.coupling}
    lines = [
        (on, *axes) for on, axes in fixed.items() if len(axes) == 1 and scene.analysis.symmetry > 1
    ]
    rigid = [coupling for coupling in scene.coupling if coupling.kind == "rigid"]
    if not (lines and rigid):
        return
    mesh = problem.mesh
    V = displacement_space(mesh.mesh, problem.degree)
    for coupling, (on, axis) in product(rigid, lines):
        free = [freedom for freedom in (axis, "rotation") if freedom not in held[coupling.name]]
        shared = np.intersect1d(mesh.dofs_in(V, coupling.facets), mesh.dofs_in(V, on))
        if mesh.mesh.comm.allreduce(len(shared)) and free:
            raise ValueError(
                f"the rigid coupling {coupling.name!r} of a part with mirror images meets {on!r}, which is held in "
                f"{axis}: hold its {' and '.join(free)}, too, in a [[support]]"
            )


class _Builder:
    """The parts of a `Problem` from those of ``scene``, by the names of sets of ``mesh``, of
    couplings and of discs."""

    def __init__(self, scene: ProblemScene, mesh: TaggedMesh) -> None:
        self.scene, self.mesh = scene, mesh
        self.edges = [*mesh.facet_sets, *mesh.point_sets]
        self.couplings = [coupling.name for coupling in scene.coupling]
        self.discs = [part.name for part in scene.interaction if part.rigid]
        self.loaded = {(load.on, str(load.direction)): load.name for load in scene.load}
        self.held = {
            (support.on, freedom) for support in scene.support for freedom in support.fixed
        }
        self.drives: list[Drive] = []
        self.supports: list[Support] = []
        self.means: list[Mean] = []
        self.loads: list[Load] = []

    def problem(self) -> Problem:
        """All of them together. Raises ValueError."""
        scene, analysis = self.scene, self.scene.analysis
        known = [*self.edges, *self.mesh.cell_sets, *self.couplings, *self.discs]
        for on in [*(s.on for s in scene.support), *(q.on for q in scene.load)]:
            if on not in known:
                raise ValueError(unknown("set or coupling", on, known))
        self._require_near()
        for support in scene.support:
            if support.on not in self.couplings:
                self.supports += [
                    Support(support.name, support.on, _AXES[freedom]) for freedom in support.fixed
                ]
        for load in scene.load:
            self._load(load)
        for coupling in scene.coupling:
            (self._rigid_point if coupling.kind == "rigid" else self._mean_point)(coupling)
        given: dict[tuple[str, int], str] = {}
        for s in self.supports:
            if (other := given.setdefault((s.facets, s.axis), s.name)) != s.name:
                raise ValueError(
                    f"{other!r} and {s.name!r} both prescribe how {s.facets!r} moves in {'xy'[s.axis]}"
                )
        lengths = [
            abs(v) for load in scene.load if load.kind == "displacement" for v in load.stages
        ]
        travel = sum(lengths) + max(
            (i.interference + i.overlap for i in scene.interaction), default=0.0
        )
        by_force = any(load.kind != "displacement" for load in scene.load)
        problem = Problem(
            self.mesh,
            [
                Body(
                    body.name,
                    body.constitutive(analysis.plane, analysis.strain),
                    body.cells or body.name,
                )
                for body in scene.body
            ],
            [self._interaction(part, 0.0 if by_force else travel) for part in scene.interaction],
            self.supports,
            self.loads,
            self.means,
            self.drives,
            fit=scene.fits,
            stabilise=True,
            degree=analysis.degree,
            symmetry=analysis.symmetry * scene.thickness,
            travel=np.inf if by_force else travel,
            tolerance=analysis.tolerance,
            max_iterations=analysis.max_iterations,
            guess=self._guess,
            kinematics=kinematics(analysis.plane),
        )
        displaced = [
            load
            for load in scene.load
            if load.kind == "displacement" and load.on in self.mesh.facet_sets
        ]
        self._driven = [(load, problem.body_of(load.on).name) for load in displaced]
        return problem

    def _require_near(self) -> None:
        """Raise ValueError for a displacement beyond the size of the mesh, as if in other units.
        Large strain is stretched some times as far. Collective."""
        comm = self.mesh.mesh.comm
        x = self.mesh.mesh.geometry.x[:, :2]
        discs = [part.rigid.centre for part in self.scene.interaction if part.rigid]
        x = np.concatenate([x, np.reshape(discs, (-1, 2))])
        ends = np.concatenate([x.max(axis=0, initial=-np.inf), -x.min(axis=0, initial=np.inf)])
        comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
        size = float((ends[:2] + ends[2:]).max())
        most = size if self.scene.analysis.strain == "small" else _STRETCHED * size
        for load in self.scene.load:
            if load.kind != "displacement" or load.direction == "rotation":
                continue
            farthest = max(load.stages, key=abs)
            if abs(farthest) > most:
                raise ValueError(
                    f"the load {load.name!r} moves {load.on!r} by {farthest:g}, but the whole mesh is {size:.4g} "
                    f"large: a displacement of at most {most:.4g} is solved; look whether both have the same unit"
                )
        self._require_near_turns(ends, most)

    def _require_near_turns(self, ends: Array, most: float) -> None:
        """Raise ValueError for a coupling that turns about a held point so far away that all the
        mesh within ``ends``, the largest x and y and the smallest with the other sign, moves by
        more than ``most``."""
        points = {coupling.name: np.array(coupling.point) for coupling in self.scene.coupling}
        held = {(s.on, str(freedom)) for s in self.scene.support for freedom in s.fixed}
        held |= {
            (load.on, str(load.direction))
            for load in self.scene.load
            if load.kind == "displacement"
        }
        for load in self.scene.load:
            if load.kind != "displacement" or load.direction != "rotation":
                continue
            beside = np.maximum(points[load.on] - ends[:2], -ends[2:] - points[load.on])
            x, y = np.maximum(beside, 0.0)
            arms = [arm for axis, arm in (("x", y), ("y", x)) if (load.on, axis) in held]
            moved = max(map(abs, load.stages)) * max(arms, default=0.0)
            if moved > most:
                raise ValueError(
                    f"the load {load.name!r} turns {load.on!r} about a point so far away that it moves by {moved:.4g}, "
                    f"but a displacement of at most {most:.4g} is solved; are they in the same unit?"
                )

    def _load(self, load: parts.Load) -> None:
        """A pressure; a force spread over cells; or what moves a set, a reference point or a
        disc."""
        on_cells = load.kind == "force" and load.on not in [
            *self.edges,
            *self.couplings,
            *self.discs,
        ]
        spread = on_cells or load.core is not None
        control: Literal["displacement", "force"] = (
            "force" if load.kind == "force" and not spread else "displacement"
        )
        self.drives.append(Drive(load.name, self.scene.values(load), control))
        if load.kind == "pressure":
            self.loads.append(Load(facets=load.on, pressure=1.0, drive=load.name))
        elif spread:
            force = (1.0, 0.0) if load.direction == "x" else (0.0, 1.0)
            density = None
            if load.core is not None:
                centre, radius = load.core.centre, load.core.radius
                require_core(self.mesh, load.on, centre, radius, f"load {load.name!r}: core.radius")
                density = core_density(centre, radius)
            self.loads.append(Load(cells=load.on, force=force, density=density, drive=load.name))
        elif load.on not in [*self.couplings, *self.discs]:
            self.supports.append(
                Support(load.name, load.on, _AXES[str(load.direction)], 1.0, load.name)
            )

    def _drive(self, coupling: str, freedom: str, control: Literal["displacement", "force"]) -> str:
        """The load of a reference point in one of its freedoms, or a drive of its own whose
        ``control`` is 0."""
        if (coupling, freedom) in self.loaded:
            return self.loaded[coupling, freedom]
        self.drives.append(Drive(f"{coupling} {freedom}", (0.0, 0.0), control))
        return self.drives[-1].name

    def _rigid_point(self, coupling: parts.Coupling) -> None:
        X, Y = coupling.point
        rates: dict[str, list[tuple[int, float | Callable[[Array], Array]]]] = {
            "x": [(0, 1.0)],
            "y": [(1, 1.0)],
            "rotation": [(0, lambda x: Y - x[:, 1]), (1, lambda x: x[:, 0] - X)],
        }
        self.supports += [Support(coupling.name, coupling.facets, axis) for axis in (0, 1)]
        for freedom in [f for f in _AXES if (coupling.name, f) not in self.held]:
            drive = self._drive(coupling.name, freedom, "force")
            self.supports += [
                Support(coupling.name, coupling.facets, axis, r, drive)
                for axis, r in rates[freedom]
            ]

    def _mean_point(self, coupling: parts.Coupling) -> None:
        mirrored = (
            self.scene.analysis.symmetry > 1
        )  # with its mirror image an edge moves along the symmetry line alone
        point = None if mirrored else (coupling.point[0], coupling.point[1])
        for freedom in [f for f in _AXES if (coupling.name, f) in self.held | self.loaded.keys()]:
            if mirrored and freedom == "rotation":
                raise ValueError(
                    f"the coupling {coupling.name!r} of a part with mirror images cannot turn"
                )
            drive = self._drive(coupling.name, freedom, "displacement")
            self.means.append(Mean(coupling.name, coupling.facets, _AXES[freedom], point, drive))

    def _interaction(self, part: parts.Interaction, slide: float) -> Interaction:
        surfaces: tuple[str | Rigid, str] = (part.surfaces[0], part.surfaces[-1])
        if part.rigid is not None:
            loads = [load for load in self.scene.load if load.on == part.name]
            rates = {
                load.name: (1.0, 0.0) if load.direction == "x" else (0.0, 1.0) for load in loads
            }
            surfaces = (
                Rigid(RigidCircle(np.array(part.rigid.centre), part.rigid.radius), rates),
                part.surfaces[0],
            )
        return Interaction(
            part.name,
            surfaces,
            law=part.law,
            friction=part.friction,
            kinematics=self.scene.analysis.kinematics,
            gamma_factor=self.scene.analysis.gamma_factor,
            integrated=part.integrated or "",
            slide=slide,
            interference=part.interference,
            overlap=part.overlap,
        )

    def _guess(self, factor: float) -> Guess:
        """Bodies moved rigidly as their edges are displaced."""
        moved: dict[str, tuple[float, float]] = {}
        for load, body in self._driven:
            value = float(np.interp(factor, range(len(values := self.scene.values(load))), values))
            x, y = moved.get(body, (0.0, 0.0))
            moved[body] = (x + value, y) if load.direction == "x" else (x, y + value)
        return Guess(factor, moved)

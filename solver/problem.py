"""A problem of solid mechanics to be solved: bodies on a mesh, what they touch, what holds them,
what loads them.

Sets of cells, facets and points are named in the mesh. One number, the load factor, runs along the
path: 1, 2, ... are the ends of its stages. Units are any consistent ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from mpi4py import MPI

from archord.geometry.meshes.formats.source import Mesh
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.faults import fault_of
from archord.materials.kinematics import PLANE_STRAIN, Ints, Kinematics, kinematics
from archord.materials.named import named_material
from archord.report.errors import (
    InputError,
    in_sentences,
    is_number,
    require_between,
    require_of,
)
from archord.report.units import scale_lacks
from archord.solver.conditions import DeadLoad, Dirichlet, Drive, Guess, Mean, Turn
from archord.solver.contact.interaction import Interaction, Rigid
from archord.solver.parts import Body, Coupling, Load, Support

__all__ = ["Body", "Coupling", "DeadLoad", "Dirichlet", "Drive", "Guess", "Interaction", "Load"]
__all__ += ["Mean", "Problem", "Rigid", "Support"]

Parts = Sequence[Any]
_KINEMATICS = ("plane strain", "plane stress", "axisymmetric", "space")
_PARTS = {
    "bodies": (Body,),
    "interactions": (Interaction,),
    "supports": (Support, Dirichlet),
    "loads": (Load, DeadLoad),
    "couplings": (Coupling,),
    "means": (Mean,),
    "turns": (Turn,),
    "drives": (Drive,),
}
_DIFFERENT = ("bodies", "interactions", "drives", "couplings")


@in_sentences
@dataclass(frozen=True)
class Problem:
    """Bodies in contact on a mesh, and what holds and loads them: what is solved.

    Parameters
    ----------
    mesh : str, Path, module, tuple, TaggedMesh or Mesh
        A mesh file, gmsh with a model, (mesh, cells, facets) of dolfinx, or a `Mesh` of one of
        these.
    bodies : sequence of Body
        The deformable bodies.
    interactions : sequence of Interaction
        The contact of surfaces.
    supports : sequence of Support
        What is held. `Dirichlet` conditions may stand beside them.
    loads : sequence of Load
        What moves or presses. `DeadLoad` may stand beside them.
    couplings : sequence of Coupling
        Reference points.
    means, turns, drives : sequence of Mean, sequence of Turn, sequence of Drive
        Mean motions, finite rotations, and the drives of conditions that are stated one by one.
    steps : int or sequence of int
        Output steps of each stage of the path: one number for all stages, or a number for each.
    fit_steps : int
        Output steps of the stage before, in which interferences arise.
    kinematics : {"plane strain", "plane stress", "axisymmetric", "space"}
        The kinematics of strain: how displacement becomes strain, in all bodies. By default, as the
        mesh is: space for tetrahedra and hexahedra, plane strain for triangles and quadrilaterals.
        Axisymmetric problems have the coordinates x = r and y = z, and forces of the whole ring.
        The kinematics of an `Interaction` are of
        contact.
    thickness : float
        The thickness, by default of the kinematics; forces and energies are per unit thickness
        without it.
    strain : {"small", "large"}
        Small strain, or large strain by logarithms, of all bodies.
    symmetry : float
        How many times the part on the mesh makes up the whole, of forces and energies, too.
    units : tuple of str
        Names of the units of length and stress.
    degree : int
        The polynomial degree of displacements, 2 or 3, whatever the order of the mesh.
    tolerance : float
        Residual over reaction at which Newton's method stops.
    max_iterations : int
        Newton iterations before a step is cut.
    stepping : dict
        The control of steps between outputs, by the keys of a scene's section stepping.
    fit, stabilise : bool
        Whether the path begins with a stage of its own, between the load factors 0 and 1, in which
        interferences arise; and whether weak springs hold bodies that supports do not. Both are
        true of problems that are stated by `Load` where they are needed.
    load_name : str
        What messages call the load.
    travel : float
        The size of displacements to be expected, which limits what counts as round-off.
    guess : callable
        The `Guess` for the first step at a load factor.
    from_rest : bool
        Whether the bodies are in equilibrium before the first step. They are not in a press fit
        without a stage of its own.
    coarser : callable
        Makes the same problem on a coarser mesh, for guesses.

    Raises
    ------
    InputError
        For arguments of a wrong kind.
    ValueError
        For names that are not different, and drives that contradict each other.

    Examples
    --------
    >>> from archord import Body, Elastic, Interaction, Load, Problem, Support
    >>> problem = Problem(
    ...     "lug.msh",
    ...     bodies=[Body("lug", material="S355"), Body("pin", Elastic(210e3, 0.3))],
    ...     interactions=[Interaction("contact", ("bolt", "hole"), friction=0.1)],
    ...     supports=[Support("clamp", fixed="xy")],
    ...     loads=[Load("pull", on="flat", direction="x", displacement=[0.3, 0.0])],
    ...     steps=[15, 5],
    ... )
    >>> problem.n_stages
    2
    """

    mesh: Any
    bodies: Sequence[Body]
    interactions: Sequence[Interaction] = ()
    supports: Sequence[Any] = ()
    loads: Sequence[Any] = ()
    couplings: Sequence[Coupling] = ()
    means: Sequence[Mean] = ()
    turns: Sequence[Turn] = ()
    drives: Sequence[Drive] = ()
    steps: int | Sequence[int] = 20
    fit_steps: int = 1
    kinematics: Any = None
    thickness: float | None = None
    strain: Literal["small", "large"] = "small"
    symmetry: float = 1.0
    units: tuple[str, str] = ("mm", "MPa")
    degree: int = 2
    tolerance: float = 1e-10
    max_iterations: int = 25
    stepping: Mapping[str, Any] = field(default_factory=dict)
    fit: bool = False
    stabilise: bool = False
    load_name: str = "load factor"
    travel: float = np.inf
    guess: Callable[[float], Guess] = Guess
    from_rest: bool = True
    coarser: Callable[[], Problem] | None = None

    def __post_init__(self) -> None:
        """Check the parts, their names, which must be unique, and the drives."""
        if not isinstance(self.mesh, TaggedMesh):
            object.__setattr__(self, "mesh", Mesh.of(self.mesh))
        self._require_numbers()
        for kind, classes in _PARTS.items():
            _require_parts(kind, getattr(self, kind), classes)
        if self.strain not in ("small", "large"):
            said = f'must be "small" or "large", not {self.strain!r}'
            raise InputError(f"archord.Problem: strain {said}.")
        given = self.kinematics
        if given is None and isinstance(self.mesh, TaggedMesh):
            given = "space" if self.mesh.dimension == 3 else PLANE_STRAIN
        if given is not None:
            self._take(_kinematics(given, self.thickness))
        bodies = [body.with_live(self._live(body)) for body in self.bodies]
        object.__setattr__(self, "bodies", bodies)
        for kind in _DIFFERENT:
            names = [part.name for part in getattr(self, kind)]
            if len(set(names)) < len(names):
                raise ValueError(f"{kind} must have different names, these are {', '.join(names)}")
        self._require_pairs_once()
        for load in self.loads:
            if isinstance(load, DeadLoad):
                load.check()
        if not self.is_stated:
            self._require_drives()

    def _take(self, kinematics: Kinematics) -> None:
        """Take these ``kinematics``. Raises `InputError` for a mesh of others."""
        object.__setattr__(self, "kinematics", kinematics)
        origin = (0.0,) * kinematics.dimension
        couplings = [replace(part, point=part.point or origin) for part in self.couplings]
        object.__setattr__(self, "couplings", couplings)
        if kinematics.thickness != 1:
            object.__setattr__(self, "thickness", kinematics.thickness)
        self._require_fitting_mesh()

    def _require_pairs_once(self) -> None:
        """Raise `InputError` where two interactions let the same surfaces carry twice."""
        found: dict[frozenset, str] = {}
        for part in self.interactions:
            if not isinstance(part.surfaces[0], str):
                continue
            other = found.setdefault(frozenset(part.surfaces), part.name)
            if other != part.name:
                said = f'interactions "{other}" and "{part.name}" are of the same surfaces'
                raise InputError(f"archord.Problem: {said}.")

    def _require_numbers(self) -> None:
        """Raise `InputError` for numbers and units with which no problem can be solved."""
        said = "must be a number, and 1 at least"
        require_between(self, "symmetry", 1, np.inf, said, least=True)
        require_between(self, "tolerance", 0, 1, "must be a number between 0 and 1")
        locks = "displacements of first order lock where cells bend or yield"
        require_of(self, self.degree in (2, 3), "degree", f"must be 2 or 3: {locks}")
        object.__setattr__(self, "degree", int(self.degree))
        iterations = self.max_iterations
        is_whole = is_number(iterations) and iterations == int(iterations) and iterations >= 1
        require_of(self, is_whole, "max_iterations", "must be a whole number, and 1 at least")
        names = self.units if isinstance(self.units, (tuple, list)) else ()
        are_names = len(names) == 2 and all(isinstance(name, str) for name in names)
        require_of(self, are_names, "units", "must be two names, of a length and of a stress")
        if isinstance(self.mesh, Mesh):
            lacking = scale_lacks(self.mesh.file, self.mesh.scale, self.units[0])
            require_of(self.mesh, not lacking, "scale", lacking)

    def _require_fitting_mesh(self) -> None:
        """Raise `InputError` for a mesh of other kinematics, and for contact that these lack."""
        d = self.kinematics.dimension
        for interaction in self.interactions:
            if lacking := interaction.lacking(d):
                said = f'interaction "{interaction.name}" has {lacking}'
                raise InputError(f"archord.Problem: {said}.")
        if isinstance(self.mesh, TaggedMesh) and self.mesh.dimension != d:
            cells = self.mesh.mesh.basix_cell().name
            words = next(word for word in _KINEMATICS if self.kinematics.name in word.split())
            said = f'kinematics = "{words}" do not fit a mesh whose cells are of the kind {cells}'
            raise InputError(f"archord.Problem: {said}.")

    def _require_drives(self) -> None:
        """Raise ValueError for drives that are missing, idle, or used in two ways."""
        moves = self.moving_drives()
        loads = {load.drive for load in self.loads if isinstance(load, DeadLoad)}
        means = [mean.drive for mean in self.means]
        known = [drive.name for drive in self.all_drives]
        for name in (*moves, *loads, *means):
            if name not in known:
                names = ", ".join(map(repr, known))
                raise ValueError(f"there is no drive {name!r}; there are {names}")
            uses = (name in moves) + (name in loads) + means.count(name)
            if uses > 1:
                raise ValueError(
                    f"the drive {name!r} must move supports and discs, multiply loads, or have one "
                    "mean"
                )
        for name in known:
            if name and name not in (*moves, *loads, *means):
                raise ValueError(f"the drive {name!r} moves nothing and multiplies no load")

    @property
    def is_stated(self) -> bool:
        """Whether parts are stated that `archord.solver.expansion` makes conditions of."""
        stated = (Support, Load)
        return bool(self.couplings) or any(
            isinstance(part, stated) for part in (*self.supports, *self.loads)
        )

    def on(self, comm: MPI.Comm = MPI.COMM_WORLD) -> Problem:
        """The problem with its mesh on the ranks of ``comm``, unless it is on ranks already.
        Collective; raises ValueError for what is no mesh."""
        if not isinstance(self.mesh, Mesh):
            return self
        return replace(self, mesh=self.mesh.on(comm))

    def _live(self, body: Body) -> Any:
        """The material of the ``body`` under the problem's kinematics, or as it is while these wait
        for the mesh."""
        material = body.stated
        if not isinstance(material, str) and (fault := fault_of(material)):
            raise InputError(f'archord.Problem: body "{body.name}".{fault}.')
        if isinstance(material, str):
            try:
                material = named_material(material, self.units[1])
            except ValueError as error:
                said = f'body "{body.name}".material = "{body.stated}" {error}'
                raise InputError(f"archord.Problem: {said}.") from None
        if self.kinematics is None:
            return material
        if self.strain == "large" and not material.finite:
            from archord.materials.finite import LargeStrain

            material = LargeStrain(material)
        try:
            return material.under(self.kinematics)
        except ValueError as error:
            raise InputError(f'archord.Problem: body "{body.name}": {error}.') from None

    @property
    def mesh_file(self) -> str:
        """The file of the mesh, "" for a mesh from Python."""
        return self.mesh.file if isinstance(self.mesh, Mesh) else ""

    @property
    def mesh_name(self) -> str:
        """What messages call the mesh."""
        return self.mesh.name if isinstance(self.mesh, Mesh) else "the mesh"

    @property
    def n_stages(self) -> int:
        """How many stages the loads have."""
        stages = [len(load.stages) for load in self.loads if isinstance(load, Load)]
        return max(stages, default=1)

    @property
    def fits(self) -> bool:
        """Whether a stage comes before them in which interferences arise."""
        return self.fit or any(i.interference or i.overlap for i in self.interactions)

    @property
    def targets(self) -> list[float]:
        """The load factor at every output step. Raises ValueError for steps of other stages."""
        steps = self.steps
        counts = list(steps) if isinstance(steps, Sequence) else [steps] * self.n_stages
        if len(counts) != self.n_stages:
            raise ValueError(f"steps must have one number for each of the {self.n_stages} stages")
        if self.fits:
            counts = [self.fit_steps, *counts]
        return [stage + k / n for stage, n in enumerate(counts) for k in range(1, n + 1)]

    def values(self, load: Load) -> tuple[float, ...]:
        """The values of ``load`` at the load factors 0, 1, 2, ..., the ends of all stages."""
        stages = load.stages
        last = (stages[-1],) * (self.n_stages - len(stages))
        return (0.0,) * (1 + self.fits) + stages + last

    def moving_drives(self) -> set[str]:
        """Names of the drives that move supports or rigid discs."""
        surfaces = [given for i in self.interactions for given in i.surfaces]
        discs = [given for given in surfaces if isinstance(given, Rigid)]
        by_discs = {name for disc in discs for name in disc.moved_by()}
        moving = [s for s in self.supports if isinstance(s, Dirichlet) and s.moves]
        return {s.drive for s in moving} | by_discs

    @property
    def whole(self) -> float:
        """What takes forces and energies of the part on the mesh to those reported: how many times
        it makes up the whole, and the thickness."""
        return self.symmetry * self.kinematics.thickness

    @property
    def all_drives(self) -> list[Drive]:
        """The ``drives``, and the drive of the load factor where it is used and not given, or
        alone."""
        loads = {load.drive for load in self.loads if isinstance(load, DeadLoad)}
        used = self.moving_drives() | loads | {mean.drive for mean in self.means}
        has_names = all(drive.name for drive in self.drives)
        alone = not self.drives or ("" in used and has_names)
        return [*self.drives, *([Drive("")] if alone else [])]

    @property
    def by_force(self) -> bool:
        """Whether any load is a force."""
        return bool(self.loads) or any(drive.control == "force" for drive in self.drives)

    def fitted(self, factor: float) -> float:
        """The part of interferences that is there at the load ``factor``."""
        return min(max(factor, 0.0), 1.0) if self.fit else 1.0

    def cells_of(self, body: Body) -> Ints:
        """Cells ``(n,)`` of the body on this rank, ghosts included."""
        return self.mesh.cells_in(body.cells)

    def tag(self, body: Body) -> int:
        """The body's number: the lowest tag of its cells."""
        return min(self.mesh.cell_tags(body.cells))

    def body_of(self, facets: str) -> Body:
        """The body that a facet set belongs to. Collective; raises ValueError if it is not one."""
        behind = self.mesh.tags_behind(facets)
        tags = {body.name: set(self.mesh.cell_tags(body.cells)) for body in self.bodies}
        found = [body for body in self.bodies if behind & tags[body.name]]
        if not found:
            raise ValueError(f"the facet set {facets!r} is of no body: give that body, too")
        if len(found) > 1 and len(behind) == 1:
            names = " and ".join(repr(body.name) for body in found)
            raise ValueError(f"the facet set {facets!r} is of {names}, which share their cells")
        if len(found) > 1 or not behind <= tags[found[0].name]:
            raise ValueError(
                f"the facet set {facets!r} belongs to {len(behind)} cell sets, a surface to one "
                "body"
            )
        return found[0]


def _require_parts(kind: str, given: Any, classes: tuple[type, ...]) -> None:
    """Raise `InputError` unless ``given`` is a list of parts of these ``classes``."""
    names = " or ".join(cls.__name__ for cls in classes)
    if not isinstance(given, Sequence) or isinstance(given, str):
        raise InputError(f"archord.Problem: {kind} must be a list of {names}, not {given!r}.")
    for part in given:
        if not isinstance(part, classes):
            raise InputError(f"archord.Problem: {kind} must be of the class {names}, not {part!r}.")


def _kinematics(given: str | Kinematics, thickness: float | None) -> Kinematics:
    """The kinematics of this name, with the ``thickness``. Raises `InputError`."""
    if not isinstance(given, Kinematics):
        if given not in _KINEMATICS:
            known = ", ".join(f'"{name}"' for name in _KINEMATICS)
            raise InputError(f"archord.Problem: kinematics must be one of {known}, not {given!r}.")
        given = kinematics(given.removeprefix("plane "))
    stated = 1.0 if given.is_of_problem else given.thickness
    if thickness is None:
        thickness = stated
    if not (is_number(thickness) and thickness > 0):
        raise InputError(f"archord.Problem: thickness must be positive, not {thickness!r}.")
    if stated not in (1, thickness):
        said = f"thickness = {thickness:g}, but its kinematics have the thickness {stated:g}"
        raise InputError(f"archord.Problem: {said}.")
    try:
        return given.with_thickness(thickness)
    except ValueError as error:
        raise InputError(f"archord.Problem: thickness = {thickness:g}: {error}.") from None

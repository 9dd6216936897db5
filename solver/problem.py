"""A problem of solid mechanics to be solved: bodies on a mesh, what they touch, what holds them,
what loads them.

Sets of cells, facets and points are named in the mesh. One number, the load factor, runs along the
path; drives turn it into displacements of supports and rigid circles, and into forces (per unit
thickness), in any consistent units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.kinematics import PLANE_STRAIN, Kinematics
from archord.solver.contact.interaction import Interaction, Rigid

__all__ = ["Body", "Drive", "Guess", "Interaction", "Load", "Mean", "Problem", "Rigid", "Support"]
Vector = tuple[float, float]


@dataclass(frozen=True)
class Body:
    """The cells of the set ``cells`` (that of the body's ``name`` if empty), of one
    ``material``."""

    name: str
    material: Any
    cells: str = ""


@dataclass(frozen=True)
class Drive:
    """What moves supports, rigid circles and means, or multiplies loads: by a displacement or a
    force on the ``path``.

    ``path`` holds the values at the load factors 0, 1, 2, ..., with straight lines between,
    constant behind; without one the value is the load factor itself. Under ``control`` "force" the
    value is the force that works on the drive's displacement, over all symmetric parts of the
    problem, and the displacement is unknown. Loads always take a force.
    """

    name: str
    path: Sequence[float] = ()
    control: Literal["displacement", "force"] = "displacement"

    def value(self, factor: float) -> float:
        """The value at the load ``factor``."""
        return float(self.values(np.array(factor)))

    def values(self, factors: Array) -> Array:
        """The values at the load ``factors``."""
        return (
            np.interp(factors, np.arange(len(self.path)), self.path) if len(self.path) else factors
        )


@dataclass(frozen=True)
class Support:
    """Component ``axis`` of the displacement of a facet set is ``rate`` times that of the
    ``drive``.

    ``rate`` is a number, or a function of the nodes' positions ``(n, 2)`` that returns ``(n,)``.
    Supports of one ``name`` have one reaction, and those of one set their drives add up. Drives
    "x", "y", "turn" of one name, at rates 1, 1, ``(Y - y, x - X)``, are a rigid reference point (X,
    Y).

    Where sets share a node, a support without a rate wins over a displacement, with a warning. It
    must not meet a set that moves as one, under a force or along both axes, unless that keeps the
    node at rest. All other supports of a node must move it alike. Those that hold a node together
    have equal parts of its reaction.
    """

    name: str
    facets: str
    axis: int
    rate: float | Callable[[Array], Array] = 0.0
    drive: str = ""

    @property
    def moves(self) -> bool:
        """Whether it depends on its drive."""
        return callable(self.rate) or self.rate != 0


@dataclass(frozen=True)
class Load:
    """Dead loads on the cells or the facets of a set, times the value of the ``drive``.

    ``force`` is that over all symmetric parts of the problem, spread as ``density(x)``, a UFL
    expression of the position, says, evenly without. ``pressure`` acts on facets, along the
    undeformed normal into the body.
    """

    cells: str = ""
    force: Vector = (0.0, 0.0)
    density: Callable[[Any], Any] | None = None
    facets: str = ""
    pressure: float = 0.0
    drive: str = ""


@dataclass(frozen=True)
class Mean:
    """The mean motion of a facet set, as that of a reference ``point`` along ``axis`` 0, 1 or 2,
    its rotation.

    With mean displacement ``w`` and mean rotation ``t = integral of (x - c) x u / integral of |x -
    c|^2`` about the centroid ``c``, the point moves by ``w + t x (point - c)``. The ``drive``
    prescribes that motion, or the force (moment) on the point, which the facets get spread as the
    motion's derivative says: statically equivalent. Without a point it is the centroid, as also of
    facets that a symmetric half shows of an edge across its axis: the mirrored facets take up the
    moment. Means of one ``name`` have one reaction. A drive has one mean at most.
    """

    name: str
    facets: str
    axis: int
    point: Vector | None = None
    drive: str = ""


@dataclass(frozen=True)
class Guess:
    """Where the first solve starts: the displacement of the drive "", and by how much each body has
    moved rigidly."""

    factor: float
    moved: Mapping[str, Vector] = field(default_factory=dict)


@dataclass(frozen=True)
class Problem:
    """What is to be solved.

    The ``kinematics`` (plane strain, plane stress, axisymmetric) are given to the materials of all
    bodies.

    A load on the path is the load factor, which each of the ``drives`` turns into its value. The
    drive "" is there without being given, with the load factor for its displacement. ``load_name``
    names the load in messages.

    With ``fit`` the path begins with a stage of its own: between the load factors 0 and 1
    interferences grow from nothing. With ``stabilise`` weak springs hold bodies that supports do
    not, which so may begin without contact.

    ``symmetry`` is how many times the modelled part makes up the whole, whose forces and energies
    are reported. ``travel`` is the size of displacements to be expected, which limits what counts
    as round-off. Newton's method stops at a residual of ``tolerance`` over the reaction. ``guess``
    starts the first step at a load; ``from_rest`` tells whether the bodies are in equilibrium
    before it (they are not in a press fit without a stage of its own). ``coarser`` makes the same
    problem on a coarser mesh, for guesses.
    """

    mesh: TaggedMesh
    bodies: Sequence[Body]
    interactions: Sequence[Interaction] = ()
    supports: Sequence[Support] = ()
    loads: Sequence[Load] = ()
    means: Sequence[Mean] = ()
    drives: Sequence[Drive] = ()
    fit: bool = False
    stabilise: bool = False
    degree: int = 2
    symmetry: float = 1.0
    load_name: str = "load factor"
    travel: float = np.inf
    tolerance: float = 1e-10
    max_iterations: int = 25
    guess: Callable[[float], Guess] = Guess
    from_rest: bool = True
    coarser: Callable[[], Problem] | None = None
    kinematics: Kinematics = PLANE_STRAIN

    def __post_init__(self) -> None:
        """Give the materials the kinematics; check names, which must be unique, and drives. Raises
        ValueError."""
        bodies = [replace(b, material=b.material.under(self.kinematics)) for b in self.bodies]
        object.__setattr__(self, "bodies", bodies)
        for kind in ("bodies", "interactions", "drives"):
            names = [part.name for part in getattr(self, kind)]
            if len(set(names)) < len(names):
                raise ValueError(f"{kind} must have different names, these are {', '.join(names)}")
        for load in self.loads:
            if bool(load.cells) == bool(load.facets) or (
                load.pressure and (load.cells or any(load.force))
            ):
                raise ValueError(
                    "a load is a force on the cells of a set or on its facets, or a pressure on facets"
                )
        moves, loads, means = (
            self.moving_drives(),
            {x.drive for x in self.loads},
            [x.drive for x in self.means],
        )
        known = [drive.name for drive in self.all_drives]
        for name in (*moves, *loads, *means):
            if name not in known:
                raise ValueError(
                    f"there is no drive {name!r}; there are {', '.join(map(repr, known))}"
                )
            if (name in moves) + (name in loads) + means.count(name) > 1:
                raise ValueError(
                    f"the drive {name!r} must move supports and discs, multiply loads, or have one mean"
                )
        for name in known:
            if name and name not in (*moves, *loads, *means):
                raise ValueError(f"the drive {name!r} moves nothing and multiplies no load")

    def moving_drives(self) -> set[str]:
        """Names of the drives that move supports or rigid discs."""
        discs = [
            given for i in self.interactions for given in i.surfaces if isinstance(given, Rigid)
        ]
        return {s.drive for s in self.supports if s.moves} | {
            name for disc in discs for name in disc.moved_by()
        }

    @property
    def all_drives(self) -> list[Drive]:
        """The ``drives``, and the one of the load factor where it is used and not given, or
        alone."""
        used = (
            self.moving_drives()
            | {load.drive for load in self.loads}
            | {mean.drive for mean in self.means}
        )
        alone = not self.drives or ("" in used and all(drive.name for drive in self.drives))
        return [*self.drives, *([Drive("")] if alone else [])]

    @property
    def by_force(self) -> bool:
        """Whether any load is a force."""
        return bool(self.loads) or any(drive.control == "force" for drive in self.drives)

    def fitted(self, factor: float) -> float:
        """The part of interferences that is there at the load ``factor``."""
        return min(max(factor, 0.0), 1.0) if self.fit else 1.0

    def cells_of(self, body: Body) -> np.ndarray:
        """Cells ``(n,)`` of the body on this rank, ghosts included."""
        return self.mesh.cells_in(body.cells or body.name)

    def tag(self, body: Body) -> int:
        """The body's number: the lowest tag of its cells."""
        return min(self.mesh.cell_tags(body.cells or body.name))

    def body_of(self, facets: str) -> Body:
        """The body that a facet set belongs to. Collective; raises ValueError if it is not one."""
        tags = self.mesh.tags_behind(facets)
        found = [
            body for body in self.bodies if tags & set(self.mesh.cell_tags(body.cells or body.name))
        ]
        if not found:
            raise ValueError(f"the facet set {facets!r} is of no body: give that body, too")
        if len(found) > 1 or not tags <= set(self.mesh.cell_tags(found[0].cells or found[0].name)):
            raise ValueError(
                f"the facet set {facets!r} belongs to {len(tags)} cell sets, a surface to one body"
            )
        return found[0]

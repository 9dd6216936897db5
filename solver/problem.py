"""A problem of solid mechanics to be solved: bodies on a mesh, what they touch, what holds them, what loads them.

Sets of cells and facets are named in the mesh. One number, the load factor, moves supports and rigid circles by their
rates and multiplies the loads. Lengths, stresses and forces (per unit thickness) are in any consistent units.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from archord.geometry.basis import Array
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.solver.contact.interaction import Interaction, Rigid

__all__ = ["Body", "Guess", "Interaction", "Load", "Problem", "Rigid", "Support"]
Vector = tuple[float, float]


@dataclass(frozen=True)
class Body:
    """The cells of the set ``cells`` (that of the body's ``name`` if empty), of one ``material``."""

    name: str
    material: Any
    cells: str = ""


@dataclass(frozen=True)
class Support:
    """Component ``axis`` of the displacement of a facet set is ``rate`` times the load factor.

    ``rate`` is a number, or a function of the nodes' positions ``(n, 2)`` that returns ``(n,)``. Supports of one
    ``name`` have one reaction. Where supports share nodes, the last one counts.
    """

    name: str
    facets: str
    axis: int
    rate: float | Callable[[Array], Array] = 0.0


@dataclass(frozen=True)
class Load:
    """The ``force`` on the cells of a set, per unit of the load factor and over all symmetric parts of the problem.

    It is spread as ``density(x)``, a UFL expression of the position, says, evenly without.
    """

    cells: str
    force: Vector
    density: Callable[[Any], Any] | None = None


@dataclass(frozen=True)
class Guess:
    """Where the first solve starts: the load factor, and by how much each body has moved rigidly."""

    factor: float
    moved: Mapping[str, Vector] = field(default_factory=dict)


@dataclass(frozen=True)
class Problem:
    """What is to be solved.

    Under ``control`` "factor" a load on the path is the load factor itself (displacement control, dead loads); under
    "force" it is the force that works on the load factor, along the rates of supports and rigid discs, and the factor
    is one more unknown (force control). ``load_name`` names it in messages.

    ``symmetry`` is how many times the modelled part makes up the whole, whose forces and energies are reported.
    ``travel`` is the size of displacements to be expected, which limits what counts as round-off. Newton's method stops
    at a residual of ``tolerance`` over the reaction. ``guess`` starts the first step at a load; ``from_rest`` tells
    whether the bodies are in equilibrium before it (they are not in a press fit). ``coarser`` makes the same problem
    on a coarser mesh, for guesses.
    """

    mesh: TaggedMesh
    bodies: Sequence[Body]
    interactions: Sequence[Interaction] = ()
    supports: Sequence[Support] = ()
    loads: Sequence[Load] = ()
    control: Literal["factor", "force"] = "factor"
    degree: int = 2
    symmetry: float = 1.0
    load_name: str = "load factor"
    travel: float = np.inf
    tolerance: float = 1e-10
    max_iterations: int = 25
    guess: Callable[[float], Guess] = Guess
    from_rest: bool = True
    coarser: Callable[[], Problem] | None = None

    def __post_init__(self) -> None:
        """Check names, which must be unique. Raises ValueError."""
        for kind in ("bodies", "interactions"):
            names = [part.name for part in getattr(self, kind)]
            if len(set(names)) < len(names):
                raise ValueError(f"{kind} must have different names, these are {', '.join(names)}")
        if self.control == "force" and self.loads:
            raise ValueError('loads follow the load factor, which control = "force" does not know: use "factor"')

    def cells_of(self, body: Body) -> np.ndarray:
        """Cells ``(n,)`` of the body on this rank, ghosts included."""
        return self.mesh.cells_in(body.cells or body.name)

    def tag(self, body: Body) -> int:
        """The body's number: the lowest tag of its cells."""
        return min(self.mesh.cell_tags(body.cells or body.name))

    def body_of(self, facets: str) -> Body:
        """The body that a facet set belongs to. Collective; raises ValueError if it is not one."""
        tags = self.mesh.tags_behind(facets)
        found = [body for body in self.bodies if tags & set(self.mesh.cell_tags(body.cells or body.name))]
        if len(found) != 1 or not tags <= set(self.mesh.cell_tags(found[0].cells or found[0].name)):
            raise ValueError(f"the facet set {facets!r} belongs to {len(tags)} cell sets, a surface to one body")
        return found[0]

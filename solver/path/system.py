"""A problem, assembled: displacement space, bulk, contact, equilibrium, Newton's method, and the
path of its loads."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, cached_property

import basix.ufl
import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI

from archord.geometry.basis import Array, displacement_element, lagrange_element
from archord.geometry.curve import ProjectionError
from archord.kernels.compat import cell_degree, cell_nodes
from archord.report.timer import Timer
from archord.solver.bulk.bulk import Bulk
from archord.solver.clean_sides import CleanSides
from archord.solver.conditions import Mean
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Interaction, Interface, Rigid
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.equilibrium.equilibrium import Equilibrium
from archord.solver.expansion import expanded
from archord.solver.path.load_path import Companion, LoadPath, Position
from archord.solver.path.mirrors import Mirror, mirrors_of
from archord.solver.path.newton import NewtonSolver
from archord.solver.path.recovery import Recovery
from archord.solver.path.stepping import StepRules, march
from archord.solver.path.totals import Totals
from archord.solver.problem import Body, Problem

_NO_CELLS = np.zeros(0, dtype=np.int32)


def displacement_space(mesh: Mesh, degree: int) -> fem.FunctionSpace:
    """Displacements of ``degree`` on ``mesh``, by their values at evenly spaced nodes.
    Collective.

    Where displacements have no nodes within faces and cells, the mesh's nodes there are moved to
    where its nodes on edges want them: else no displacement would turn a curved cell rigidly.
    """
    element = displacement_element(mesh.basix_cell(), degree)
    nodes = cell_nodes(mesh)
    if cell_degree(mesh) == degree and element.dim < nodes.shape[1]:
        settled = element.tabulate(0, lagrange_element(mesh.basix_cell(), degree).points)[0, ..., 0]
        on_edges = mesh.geometry.x[nodes[:, : element.dim]]
        inner = slice(element.dim, None)
        mesh.geometry.x[nodes[:, inner]] = np.einsum("ba,nai->nbi", settled[inner], on_edges)
    of_axis = basix.ufl.wrap_element(element)
    blocked = basix.ufl.blocked_element(of_axis, shape=(mesh.topology.dim,))
    return fem.functionspace(mesh, blocked)


class System(Totals):
    """A problem made ready to be solved, without a run folder. Collective.

    `archord.solve` warns of the mesh and of surfaces that do not face each other; this does not.

    Parameters
    ----------
    problem : Problem
        The problem, whose ``steps`` are the default path of `solve`.
    timer : Timer
        Where times are counted, by default a new one.

    Attributes
    ----------
    sides : dict of Surface
        The surfaces of bodies in contact by the name of their facet set.
    n_dofs : int
        Degrees of freedom, with the prescribed ones.
    n_cells : int
        Cells of the mesh, on all ranks.
    drive_names : list of str
        Names of the drives, as of `driven`.

    Raises
    ------
    ValueError
        For contradictions in the problem, or with its mesh.
    ProjectionError
        For surfaces that miss each other.

    Examples
    --------
    >>> from archord import Body, Elastic, Load, Problem, Support, System, rectangles
    >>> system = System(
    ...     Problem(
    ...         rectangles({"block": (0.0, 0.0, 2.0, 1.0)}, size=0.5),
    ...         bodies=[Body("block", Elastic(210e3, 0.3))],
    ...         supports=[Support("block bottom")],
    ...         loads=[Load("pull", on="block top", direction="y", displacement=0.01)],
    ...         steps=1,
    ...     )
    ... )
    >>> system.solve([1.0])
    >>> round(system.drive_displacement("pull"), 6)
    0.01
    >>> system.drive_force("pull") > 0
    True
    """

    def __init__(self, problem: Problem, *, timer: Timer | None = None) -> None:
        self.stated = problem.on()
        problem = expanded(self.stated)
        self.problem = problem
        self.timer = timer or Timer()
        mesh = problem.mesh.mesh
        self.comm = mesh.comm
        with self.timer("setup"):
            self.V = displacement_space(mesh, problem.degree)
            self.bulk = self._bulk()
            self.sides: dict[str, Surface] = {}
            self.clean_sides = CleanSides(problem, self.V)
            self.contact = Contact(self.V, [self._interface(i) for i in problem.interactions])
            self.equilibrium = Equilibrium(problem, self.bulk, self.contact, self.timer)
            self.solver = Recovery(NewtonSolver(self.equilibrium))
        self.n_dofs = self.V.dofmap.index_map_bs * self.V.dofmap.index_map.size_global
        self.n_cells = mesh.topology.index_map(mesh.topology.dim).size_global
        shape = "curved" if cell_degree(mesh) > 1 else "straight"
        self.cell_kind = f"{shape} {mesh.basix_cell().name}s"
        self.drive_names = self.equilibrium.drives.names
        self.mean_rates = cache(self._mean_rates)
        self._path: LoadPath | None = None

    @cached_property
    def mirrors(self) -> list[Mirror]:
        """The lines or planes in which the part on the mesh is mirrored. Collective at first."""
        return mirrors_of(self.problem, self.V)

    def _mean_rates(self, facets: str, point: tuple[float, ...] | None) -> Array:
        """Derivatives ``(d + t, n_owned, d)`` of `mean_motion` by the displacements."""
        kinematics = self.problem.kinematics
        n = kinematics.dimension + len(kinematics.turns)
        nodes = self.problem.mesh.dofs_in(self.V, facets)
        met = [mirror for mirror in self.mirrors if self._meets(mirror, nodes)]
        mirrors = [(mirror.axis, mirror.at) for mirror in met]
        means = [Mean("", facets, axis, point, mirrors=mirrors) for axis in range(n)]
        return np.stack([self.equilibrium.drives.loads.mean_motion(mean) for mean in means])

    def _meets(self, mirror: Mirror, nodes: np.ndarray) -> bool:
        """Whether any of these ``nodes`` ``(n,)`` lies in a ``mirror``."""
        here = bool(np.isin(nodes, mirror.nodes).any())
        return self.comm.allreduce(here, op=MPI.LOR)

    def mirrors_beside(self, facets: str, point: Sequence[float]) -> list[Mirror]:
        """The mirrors that a set of ``facets`` does not meet, and that a ``point`` is not in: it
        and its image are two. Collective."""
        nodes = self.problem.mesh.dofs_in(self.V, facets)
        apart = [mirror for mirror in self.mirrors if not self._meets(mirror, nodes)]
        return [mirror for mirror in apart if abs(point[mirror.axis] - mirror.at) > mirror.near]

    def _bulk(self) -> Bulk:
        problem = self.problem
        cells = {problem.tag(body): problem.cells_of(body) for body in problem.bodies}
        materials = {problem.tag(body): body.material for body in problem.bodies}
        surfaces = [given for i in problem.interactions for given in i.surfaces]
        names = [given for given in surfaces if not isinstance(given, Rigid)]
        behind = [problem.mesh.cells_behind(name) for name in names]
        in_contact = np.unique(np.concatenate([_NO_CELLS, *behind]))
        return Bulk(self.V, cells, materials, problem.kinematics, in_contact)

    def _interface(self, interaction: Interaction) -> Interface:
        surfaces = [self._surface(given, interaction.name) for given in interaction.surfaces]
        try:
            return Interface(self.clean_sides.integrated(interaction, surfaces), surfaces)
        except ProjectionError as error:
            said = f'interaction "{interaction.name}": its surfaces do not lie opposite each other'
            raise ProjectionError(f"{said}: {error}") from None

    def _surface(self, given: str | Rigid, interaction: str) -> Surface | RigidSurface:
        if isinstance(given, Rigid):
            return RigidSurface(given.circle)
        name = given if given not in self.sides else f"{given} ({interaction})"
        material = self.problem.body_of(given).material
        facets = self.problem.mesh.facets_in(given)
        self.sides[name] = Surface(self.V, facets, material, name, self.problem.kinematics)
        return self.sides[name]

    def nodes_of(self, body: Body) -> np.ndarray:
        """Nodes ``(n,)`` of the ``body`` on this rank, ghosts included."""
        return self.equilibrium.drives.nodes_of(body)

    def solve(self, loads: Sequence[float] | None = None, rules: StepRules | None = None) -> None:
        """Follow the path of the ``loads``, from where the last call has ended; by default through
        the problem's steps. Raises `StepFailure`."""
        loads = self.stated.targets if loads is None else loads
        self._path = self._path or self.load_path()
        self._path.at.targets_done = 0
        self._path.at.size = None
        march(self._path, loads, rules=rules)

    def load_path(self, at: Position | None = None, coarse: Companion | None = None) -> LoadPath:
        """The path of the problem's loads, from the position ``at`` or the beginning. Raises
        ValueError where both sides of a contact have other loads, too."""
        if self.clean_sides.fault:
            raise ValueError(self.clean_sides.fault)
        return LoadPath(self.solver, self.first_guess, at, coarse)

    def first_guess(self, load: float) -> Array:
        """A state of the equilibrium, with every body moved rigidly as the problem's guess says."""
        guess = self.problem.guess(load)
        u = np.zeros_like(self.equilibrium.displacement())
        for body in self.problem.bodies:
            u[self.nodes_of(body)] = guess.moved.get(body.name, 0.0)
        levels = np.zeros_like(self.equilibrium.unknowns.levels)
        for level, name in enumerate(self.drive_names):
            levels[level] = 0.0 if name else guess.factor
        return np.append(u, levels)

"""A problem, assembled: displacement space, bulk, contact, equilibrium, Newton's method, and the
path of its loads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce

import basix.ufl
import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.kernels.compat import cell_degree
from archord.report.timer import Timer
from archord.solver.bulk import Bulk, Distortion
from archord.solver.contact.contact import Contact
from archord.solver.contact.interaction import Interface, Rigid
from archord.solver.contact.surface import RigidSurface, Surface
from archord.solver.equilibrium import Equilibrium
from archord.solver.expansion import expanded
from archord.solver.path.load_path import Companion, LoadPath, Position
from archord.solver.path.newton import NewtonSolver
from archord.solver.path.recovery import Recovery
from archord.solver.path.stepping import StepRules, march
from archord.solver.problem import Body, Problem

_AT_REST = 10.0  # times the round-off: forces that are none


def displacement_space(mesh: Mesh, degree: int) -> fem.FunctionSpace:
    """Displacements of ``degree`` on ``mesh``, by their values at evenly spaced nodes.
    Collective."""
    variant = basix.LagrangeVariant.equispaced
    element = basix.ufl.element(
        "P", mesh.basix_cell(), degree, shape=(2,), lagrange_variant=variant
    )
    return fem.functionspace(mesh, element)


class System:
    """``problem`` ready to be solved; forces and energies are those of the whole, its symmetric
    parts included.

    ``sides`` holds the surfaces of bodies in contact by the name of their facet set; ``n_dofs``
    counts prescribed displacements, too. Collective; raises ValueError for contradictions,
    `ProjectionError` for surfaces that miss.
    """

    def __init__(self, problem: Problem, *, timer: Timer | None = None) -> None:
        problem = expanded(problem.on())
        self.problem, self.timer, self.comm = problem, timer or Timer(), problem.mesh.mesh.comm
        with self.timer("setup"):
            mesh = problem.mesh.mesh
            self.V = displacement_space(mesh, problem.degree)
            materials = {problem.tag(body): body.material for body in problem.bodies}
            cells = {problem.tag(body): problem.cells_of(body) for body in problem.bodies}
            self.bulk = Bulk(self.V, cells, materials)
            self.sides: dict[str, Surface] = {}
            surfaces = [
                [self._surface(given, i.name) for given in i.surfaces] for i in problem.interactions
            ]
            self.contact = Contact(self.V, list(map(Interface, problem.interactions, surfaces)))
            self.equilibrium = Equilibrium(problem, self.bulk, self.contact, self.timer)
            self.solver = Recovery(NewtonSolver(self.equilibrium))
        self.n_dofs, self.n_cells = (
            2 * self.V.dofmap.index_map.size_global,
            mesh.topology.index_map(2).size_global,
        )
        self.cell_kind = (
            f"{'curved' if cell_degree(mesh) > 1 else 'straight'} {mesh.basix_cell().name}s"
        )
        self.drive_names = self.equilibrium.drives.names
        self._path: LoadPath | None = None

    def _surface(self, given: str | Rigid, interaction: str) -> Surface | RigidSurface:
        if isinstance(given, Rigid):
            return RigidSurface(given.circle)
        name = given if given not in self.sides else f"{given} ({interaction})"
        mesh, material = self.problem.mesh, self.problem.body_of(given).material
        self.sides[name] = Surface(self.V, mesh.facets_in(given), material, name)
        return self.sides[name]

    def nodes_of(self, body: Body) -> np.ndarray:
        """Nodes ``(n,)`` of the ``body`` on this rank, ghosts included."""
        return np.unique(self.V.dofmap.list[self.problem.cells_of(body)])

    def solve(self, loads: Sequence[float], rules: StepRules | None = None) -> None:
        """Follow the path of the ``loads``, from where the last call has ended. Raises
        `StepFailure`."""
        self._path = self._path or self.load_path()
        self._path.at.targets_done, self._path.at.size = 0, None
        march(self._path, loads, rules=rules)

    def load_path(self, at: Position | None = None, coarse: Companion | None = None) -> LoadPath:
        """The path of the problem's loads, from the position ``at`` or the beginning."""
        return LoadPath(self.solver, self.first_guess, at, coarse)

    def first_guess(self, load: float) -> Array:
        """A state of the equilibrium, with every body moved rigidly as the problem's guess says."""
        guess = self.problem.guess(load)
        u = np.zeros((self.equilibrium.n_local, 2))
        for body in self.problem.bodies:
            u[self.nodes_of(body)] = guess.moved.get(body.name, 0.0)
        levels = np.zeros(len(self.equilibrium.levels))
        levels[: len(self.drive_names)] = [
            0.0 if name else guess.factor for name in self.drive_names
        ]
        return np.append(u, levels)

    def reaction(self, name: str) -> Array:
        """Force ``(2,)`` of the supports and means ``name`` on the whole."""
        return self.problem.symmetry * self.comm.allreduce(
            self.equilibrium.reaction(name).sum(axis=0)
        )

    def reaction_moment(self, name: str, point: Sequence[float]) -> float:
        """Moment of these forces about ``point``, anticlockwise, on the whole."""
        force = self.equilibrium.reaction(name)
        arm = self.V.tabulate_dof_coordinates()[: len(force), :2] - np.asarray(point)
        moment = float((arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]).sum())
        return self.problem.symmetry * self.comm.allreduce(moment)

    def contact_force(self, name: str = "") -> Array:
        """Force ``(2,)`` of the interaction ``name``, the first without, on its second surface."""
        return self.problem.symmetry * self.contact.resultant(name)

    def contact_moment(self, name: str, point: Sequence[float]) -> float:
        """Moment of that force about ``point``, anticlockwise, on the deformed whole."""
        return self.problem.symmetry * self.contact.moment(name, point)

    def driven(self) -> tuple[Array, Array]:
        """Displacements and forces ``(d,)`` of the ``drive_names`` on the whole, which do the work:
        of what a drive moves, or the mean displacement along its loads and their force."""
        at, moving = self.equilibrium, self.equilibrium.drives.moving
        conjugates, n = self.problem.symmetry * at.conjugates(), len(self.drive_names)
        return np.where(moving, at.levels, conjugates)[:n], np.where(moving, conjugates, at.levels)[
            :n
        ]

    def drive_force(self, name: str) -> float:
        """Force of the drive ``name``."""
        return float(self.driven()[1][self.drive_names.index(name)])

    def drive_displacement(self, name: str) -> float:
        """Displacement of the drive ``name``."""
        return float(self.driven()[0][self.drive_names.index(name)])

    @property
    def warnings(self) -> list[str]:
        """Displacements that nodes do not follow, as supports fix them."""
        return self.equilibrium.drives.warnings

    @property
    def stabilisation_energy(self) -> float:
        """Energy that the springs of `Problem.stabilise` took up so far, of the whole."""
        springs = self.equilibrium.springs
        return self.problem.symmetry * springs.energy if springs else 0.0

    @property
    def hardest_held(self) -> str:
        """The body, or the interaction with a disc, on which these springs did most work in the
        last accepted step."""
        springs = self.equilibrium.springs
        works = springs.works if springs else {}
        return max(works, key=lambda name: works[name], default="")

    def energies(self) -> tuple[float, float]:
        """Elastic energy and plastic dissipation of the whole."""
        parts = np.array(self.bulk.energies(self.equilibrium.displacement()))
        stored, dissipated = self.problem.symmetry * self.comm.allreduce(parts)
        return float(stored), float(dissipated)

    def energy_noise(self) -> float:
        """Energy of the whole that is round-off: noise of forces along the largest displacement.
        Collective."""
        u = np.abs(self.equilibrium.u.x.array).max(initial=0.0)
        largest = self.comm.allreduce(u, op=MPI.MAX)
        return float(self.problem.symmetry * self.equilibrium.noise * largest)

    def friction_dissipation(self) -> float:
        """Work done against friction so far, on the whole."""
        return self.problem.symmetry * self.comm.allreduce(self.contact.dissipated())

    def peeq(self) -> tuple[float, float]:
        """Largest PEEQ at a quadrature point, and the integral of PEEQ over the whole."""
        largest, integral = self.bulk.peeq()
        return self.comm.allreduce(
            largest, op=MPI.MAX
        ), self.problem.symmetry * self.comm.allreduce(integral)

    def largest_peeq(
        self, *bodies: Body, within: Callable[[Array], np.ndarray] | None = None
    ) -> tuple[float, float, float]:
        """Largest PEEQ at a quadrature point of the ``bodies``, of those at ``x`` ``(n, 2)`` for
        which ``within(x)`` is true; and its place x, y. Zeros without any."""
        found = [(0.0, 0.0, 0.0)]
        for peeq, x in (self.bulk.peeq_of(self.problem.tag(body)) for body in bodies):
            peeq = peeq if within is None else np.where(within(x), peeq, 0.0)
            if peeq.any():
                at = int(np.argmax(peeq))
                found.append((float(peeq[at]), float(x[at, 0]), float(x[at, 1])))
        return max(self.comm.allgather(max(found)))

    def distortion(self) -> Distortion:
        """How far cells are strained, turned and turned over, in the last evaluation."""
        found = self.comm.allgather(self.bulk.distortion(self.equilibrium.displacement()))
        return reduce(Distortion.joined, found)

    def force_balance(self, before: float = 0.0) -> float:
        """Largest resultant on a body over the largest force: of a support, of an interaction, as
        the sum of the sizes of its points' forces, the norm of nodal ones, as of a pure moment, or
        the force ``before``; 0 if all are round-off."""
        left = [self.equilibrium.residual_on(self.nodes_of(body)) for body in self.problem.bodies]
        forces: list[Array] = [np.zeros(2)]
        forces += [
            self.reaction(name) for name in dict.fromkeys(s.name for s in self.problem.supports)
        ]
        of_supports = np.linalg.norm(forces, axis=1).max()
        nodal = max(self.equilibrium.reaction_norm, self.equilibrium.largest_reaction)
        on_part = max(nodal, self.contact.largest_pressed())
        largest = max(of_supports, self.problem.symmetry * on_part, before)
        if largest <= _AT_REST * self.problem.symmetry * self.equilibrium.noise:
            return 0.0
        return float(self.problem.symmetry * np.linalg.norm(left, axis=1).max() / largest)

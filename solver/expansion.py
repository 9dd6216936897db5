"""What a user states of a problem, as the boundary conditions that the solver applies: supports,
loads, couplings and moved discs become Dirichlet conditions, dead loads, means and drives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.meshes.tagged_mesh import unknown
from archord.materials.kinematics import PLANE_STRAIN, SPACE, Arrays
from archord.report.by_name import ByName
from archord.solver.conditions import Control, DeadLoad, Dirichlet, Drive, Guess, Mean, Turn
from archord.solver.contact.interaction import Interaction, Rigid
from archord.solver.core_load import core_density, require_core
from archord.solver.parts import Coupling, Load, Support, freedoms
from archord.solver.problem import Problem

_ALONG_AXIS = "y"  # the direction along the axis of rings
_TWO_MIRRORS = 4  # parts of a whole in space, from which on nothing turns
_STRETCHED = 10.0  # sizes of the mesh that large strain may displace by
_TURNS = {2: PLANE_STRAIN.turns, 3: SPACE.turns}  # of a coupling, which turns a ring like a plane
Rate = float | Callable[[Array], Array]


def expanded(problem: Problem) -> Problem:
    """The ``problem``, whose mesh is on ranks, with boundary conditions alone. Collective; raises
    ValueError for sets that the mesh lacks, and for a problem that contradicts itself."""
    expansion = _Expansion(problem)
    return expansion.problem() if problem.is_stated else expansion.bounded()


class _Expansion:
    """The conditions of a ``problem``, by the names of sets of its mesh, of couplings and of discs.

    freedoms: the directions by their names, and their numbers
    loaded: the name of the load of each place and direction
    held: the places and directions that supports fix
    drives, supports, means, turns, loads: the conditions, those first that the problem states
    """

    def __init__(self, problem: Problem) -> None:
        self.stated = problem
        self.mesh = problem.mesh
        self.dimension = problem.kinematics.dimension
        self.freedoms = freedoms(self.dimension)
        self.edges = [*self.mesh.facet_sets, *self.mesh.point_sets]
        self.couplings = [coupling.name for coupling in problem.couplings]
        self.discs = [i.name for i in problem.interactions if i.disc is not None]
        self.given_supports = [part for part in problem.supports if isinstance(part, Support)]
        self.given_loads = [part for part in problem.loads if isinstance(part, Load)]
        self.loaded = {_place(load): load.name for load in self.given_loads}
        self.held = {
            (part.on, freedom)
            for part in self.given_supports
            for freedom in part.held(self.dimension)
        }
        self.drives = list(problem.drives)
        self.supports = [part for part in problem.supports if isinstance(part, Dirichlet)]
        self.loads = [part for part in problem.loads if isinstance(part, DeadLoad)]
        self.means = list(problem.means)
        self.turns: list[Turn] = list(problem.turns)

    def problem(self) -> Problem:
        """The problem with all conditions. Raises ValueError."""
        stated = self.stated
        self._require_known()
        self._require_near()
        for support in self.given_supports:
            self._support(support)
        for load in self.given_loads:
            self._load(load)
        for coupling in stated.couplings:
            if coupling.kind == "rigid":
                self._rigid_point(coupling)
            else:
                self._mean_point(coupling)
        self._require_one_support()
        changes: ByName = {
            "travel": self._farthest(),
            "supports": self.supports,
            "loads": self.loads,
            "couplings": (),
            "means": self.means,
            "turns": self.turns,
            "drives": self.drives,
        }
        slide = 0.0
        if self.given_loads:
            travel = self._travel()
            slide = travel if np.isfinite(travel) else 0.0
            travel = min(travel, changes["travel"])
            changes |= {"fit": stated.fits, "stabilise": True, "travel": travel}
            changes["guess"] = self._guess()
        interactions = [self._interaction(part, slide) for part in stated.interactions]
        return replace(stated, interactions=interactions, **changes)

    def _require_known(self) -> None:
        """Raise ValueError for a name that is no set of the mesh, coupling or disc."""
        facets = [*self.mesh.facet_sets]
        cells = [*self.mesh.cell_sets]
        places = [*self.edges, *cells, *self.couplings, *self.discs]
        stated = self.stated
        named: list[tuple[str, str, str, list[str]]] = []
        for body in stated.bodies:
            named.append((f'body "{body.name}".cells', "cell set", body.cells, cells))
        for part in stated.interactions:
            key = f'interaction "{part.name}".surfaces'
            sides = [side for side in part.surfaces if isinstance(side, str)]
            named += [(key, "facet set", side, facets) for side in sides]
        for coupling in stated.couplings:
            key = f'coupling "{coupling.name}".facets'
            named.append((key, "set", coupling.facets, [*self.edges, *cells]))
        for support in self.given_supports:
            named.append((f'support "{support.name}".on', "set or coupling", support.on, places))
        for load in self.given_loads:
            named.append((f'load "{load.name}".on', "set or coupling", load.on, places))
        for key, kind, name, known in named:
            if name not in known:
                raise ValueError(f"{key}: {unknown(kind, name, known)}")
        self._require_directions()

    def _require_directions(self) -> None:
        """Raise ValueError for a direction that the problem lacks, and a point of another
        dimension."""
        used: list[tuple[str, str | None]] = []
        used += [(f"support {s.name!r}", f) for s in self.given_supports for f in s.fixed or ()]
        used += [(f"load {load.name!r}", load.direction) for load in self.given_loads]
        for part, freedom in used:
            if freedom is not None and freedom not in self.freedoms:
                known = ", ".join(self.freedoms)
                raise ValueError(f"the {part} has the direction {freedom!r}, but here are {known}")
        rigid = {c.name for c in self.stated.couplings if c.kind == "rigid"}.union(self.discs)
        others = {*self.freedoms}.difference(self._rigid_motions())
        for load in self.given_loads:
            if load.on in rigid and load.direction in others:
                raise ValueError(
                    f"the load {load.name!r} has the direction {load.direction!r}, in which no "
                    f"rigid ring such as {load.on!r} moves: it moves along its axis, "
                    f"{_ALONG_AXIS!r}; a set of facets can be widened"
                )
        points = [(f"coupling {c.name!r}", "point", c.point) for c in self.stated.couplings]
        for load in self.given_loads:
            if load.core is not None:
                centre, _ = load.core
                points.append((f"load {load.name!r}", "core.centre", centre))
        for part, key, point in points:
            if len(point) != self.dimension:
                said = f"{key} = {point} must be {self.dimension} numbers here"
                raise ValueError(f"the {part} does not fit: {said}")

    def _require_one_support(self) -> None:
        """Raise ValueError where two names prescribe how one set moves along one axis."""
        given: dict[tuple[str, int], str] = {}
        for s in self.supports:
            other = given.setdefault((s.facets, s.axis), s.name)
            if other != s.name:
                raise ValueError(
                    f"{other!r} and {s.name!r} both prescribe how {s.facets!r} moves in "
                    f"{'xyz'[s.axis]}"
                )

    def _travel(self) -> float:
        """The largest displacement that loads and fits prescribe, infinite under a force."""
        by_force = any(load.kind != "displacement" for load in self.given_loads)
        if by_force or self.stated.drives:
            return np.inf
        lengths = [abs(value) for load in self.given_loads for value in load.stages]
        fits = [i.interference + i.overlap for i in self.stated.interactions]
        return sum(lengths) + max(fits, default=0.0)

    def bounded(self) -> Problem:
        """The problem as it is, its travel no larger than what no body reaches. Collective."""
        return replace(self.stated, travel=self._farthest())

    def _farthest(self) -> float:
        """A displacement that no body reaches, under a force neither, and no larger than the travel
        that the problem states. Collective."""
        return min(self.stated.travel, _STRETCHED * _largest_side(*self._box()))

    def _require_near(self) -> None:
        """Raise ValueError for a displacement beyond the size of the mesh, as if in other units.
        Large strain is stretched some times as far. Collective."""
        lowest, highest = self._box()
        size = _largest_side(lowest, highest)
        most = _STRETCHED * size if self._is_large() else size
        for load in self.given_loads:
            if load.kind != "displacement" or _turns(load.direction):
                continue
            farthest = max(load.stages, key=abs)
            if abs(farthest) > most:
                raise ValueError(
                    f"the load {load.name!r} moves {load.on!r} by {farthest:g}, but the whole mesh "
                    f"is {size:.4g} large: a displacement of at most {most:.4g} is solved; look "
                    "whether both have the same unit"
                )
        self._require_near_turns(lowest, highest, most)

    def _is_large(self) -> bool:
        return any(getattr(body.material, "finite", False) for body in self.stated.bodies)

    def _box(self) -> tuple[Array, Array]:
        """The lowest and the highest coordinates of mesh and discs' centres. Collective."""
        comm = self.mesh.mesh.comm
        discs = [part.disc for part in self.stated.interactions]
        centres = [disc.centre for disc in discs if disc is not None]
        d = self.dimension
        nodes = self.mesh.mesh.geometry.x[:, :d]
        x = np.concatenate([nodes, np.reshape(centres, (-1, d))])
        highest = x.max(axis=0, initial=-np.inf)
        lowest = x.min(axis=0, initial=np.inf)
        ends = np.concatenate([highest, -lowest])
        comm.Allreduce(MPI.IN_PLACE, ends, op=MPI.MAX)
        return -ends[d:], ends[:d]

    def _require_near_turns(self, lowest: Array, highest: Array, most: float) -> None:
        """Raise ValueError for a coupling that turns about a held point so far away that all the
        mesh, in the box from ``lowest`` to ``highest``, moves by more than ``most``."""
        points = {coupling.name: np.array(coupling.point) for coupling in self.stated.couplings}
        displaced = [load for load in self.given_loads if load.kind == "displacement"]
        held = self.held.union(map(_place, displaced))
        for load in displaced:
            if not _turns(load.direction) or load.on not in points:
                continue
            point = points[load.on]
            beside = np.maximum(point - highest, lowest - point)
            beside = np.maximum(beside, 0.0)
            i, j = self._turn(str(load.direction))
            crossed = {"xyz"[i]: beside[j], "xyz"[j]: beside[i]}
            arms = [arm for axis, arm in crossed.items() if (load.on, axis) in held]
            farthest = max(map(abs, load.stages))
            moved = farthest * max(arms, default=0.0)
            if moved > most:
                raise ValueError(
                    f"the load {load.name!r} turns {load.on!r} about a point so far away that it "
                    f"moves by {moved:.4g}, but a displacement of at most {most:.4g} is solved; "
                    "are they in the same unit?"
                )

    def _support(self, support: Support) -> None:
        """What holds a set; couplings take their supports themselves."""
        if support.on in self.couplings:
            return
        for freedom in support.held(self.dimension):
            if _turns(freedom):
                axes = " and ".join(f'"{axis}"' for axis in "xyz"[: self.dimension])
                raise ValueError(
                    f"the support {support.name!r} fixes the {freedom} of {support.on!r}, which is "
                    f"no coupling: a set is held in {axes}"
                )
            self.supports.append(Dirichlet(support.name, support.on, self.freedoms[freedom]))

    def _load(self, load: Load) -> None:
        """A pressure; a force spread over cells; or what moves a set, a reference point or a
        disc."""
        places = [*self.edges, *self.couplings, *self.discs]
        is_force = load.kind == "force"
        on_cells = is_force and load.on not in places
        spread = on_cells or load.core is not None
        control: Control = "force" if is_force and not spread else "displacement"
        self.drives.append(Drive(load.name, self.stated.values(load), control))
        if load.kind == "pressure":
            if load.on in self.discs:
                raise ValueError(f"the load {load.name!r} is a pressure: {load.on!r} has no facets")
            self.loads.append(DeadLoad(facets=load.on, pressure=1.0, drive=load.name))
            return
        if _turns(load.direction) and load.on not in self.couplings:
            raise ValueError(
                f"the load {load.name!r} turns {load.on!r}, which is no coupling: only couplings "
                "have a rotation"
            )
        if spread:
            self._spread(load)
        elif load.on not in [*self.couplings, *self.discs]:
            axis = self.freedoms[str(load.direction)]
            self.supports.append(Dirichlet(load.name, load.on, axis, 1.0, load.name))

    def _spread(self, load: Load) -> None:
        """A force on cells, evenly or in a core."""
        force = self._along(load)
        density = None
        if load.core is not None:
            centre, radius = load.core
            require_core(self.mesh, load.on, centre, radius, f"load {load.name!r}: core.radius")
            density = core_density(centre, radius)
        self.loads.append(DeadLoad(cells=load.on, force=force, density=density, drive=load.name))

    def _along(self, load: Load) -> tuple[float, ...]:
        """The unit vector along the axis of the ``load``."""
        axis = self.freedoms[str(load.direction)]
        return tuple(np.eye(self.dimension)[axis])

    def _turn(self, freedom: str) -> tuple[int, int]:
        """The axes from the first to the second of which a rotation turns."""
        number = self.freedoms[freedom] - self.dimension
        return _TURNS[self.dimension][number]

    def _drive(self, coupling: str, freedom: str, control: Control) -> str:
        """The load of a reference point in one of its freedoms, or a drive of its own whose
        ``control`` is 0."""
        if (coupling, freedom) in self.loaded:
            return self.loaded[coupling, freedom]
        drive = Drive(f"{coupling} {freedom}", (0.0, 0.0), control)
        self.drives.append(drive)
        return drive.name

    def _rigid_point(self, coupling: Coupling) -> None:
        for axis in range(self.dimension):
            self.supports.append(Dirichlet(coupling.name, coupling.facets, axis))
        for freedom in self._rigid_motions():
            if (coupling.name, freedom) in self.held:
                continue
            drive = self._drive(coupling.name, freedom, "force")
            for axis, rate in self._rates(freedom, coupling.point):
                self.supports.append(Dirichlet(coupling.name, coupling.facets, axis, rate, drive))
        if self._is_large() and not self.stated.kinematics.has_hoop:
            self._turn_finitely(coupling)

    def _rigid_motions(self) -> list[str]:
        """The directions in which rigid couplings and discs can move: a ring along its axis."""
        return [_ALONG_AXIS] if self.stated.kinematics.has_hoop else [*self.freedoms]

    def _turn_finitely(self, coupling: Coupling) -> None:
        """Let the rotations of a ``coupling`` be finite, where all of them are prescribed."""
        displaced = {load.name for load in self.given_loads if load.kind == "displacement"}
        places = {(coupling.name, freedom) for freedom in self.freedoms if _turns(freedom)}
        drives = [self.loaded.get(place, "") for place in sorted(places - self.held)]
        if drives and displaced.issuperset(drives):
            drives = [self.loaded.get(place, "") for place in sorted(places)]
            self.turns.append(Turn(coupling.name, coupling.point, drives))

    def _rates(self, freedom: str, point: Sequence[float]) -> list[tuple[int, Rate]]:
        """What a motion of a reference ``point`` displaces along the axes."""
        if not _turns(freedom):
            return [(self.freedoms[freedom], 1.0)]
        i, j = self._turn(freedom)
        return [(i, lambda x: point[j] - x[:, j]), (j, lambda x: x[:, i] - point[i])]

    def _mean_point(self, coupling: Coupling) -> None:
        # with its mirror image an edge moves along the symmetry line alone
        mirrored = self.stated.symmetry > 1
        if mirrored and self.dimension == 3 and self.stated.symmetry < _TWO_MIRRORS:
            raise ValueError(
                f"the distributing coupling {coupling.name!r} is of a half in space, which may "
                "turn in its mirror: take a rigid coupling, a pressure, or the whole"
            )
        point = None if mirrored else coupling.point
        for freedom, axis in self.freedoms.items():
            if (coupling.name, freedom) not in self.held | self.loaded.keys():
                continue
            if mirrored and _turns(freedom):
                raise ValueError(
                    f"the coupling {coupling.name!r} of a part with mirror images cannot turn"
                )
            drive = self._drive(coupling.name, freedom, "displacement")
            self.means.append(Mean(coupling.name, coupling.facets, axis, point, drive))

    def _interaction(self, part: Interaction, slide: float) -> Interaction:
        disc = part.disc
        if disc is part.surfaces[0]:
            loads = [load for load in self.given_loads if load.on == part.name]
            rates: ByName = {load.name: self._along(load) for load in loads}
            part = replace(part, surfaces=(Rigid(disc, rates), part.surfaces[1]))
        return replace(part, slide=part.slide or slide)

    def _guess(self) -> Callable[[float], Guess]:
        """Bodies moved rigidly as their edges are displaced. Collective."""
        stated = self.stated
        driven: list[tuple[Load, str]] = []
        for load in self.given_loads:
            if load.kind == "displacement" and load.on in self.mesh.facet_sets:
                driven.append((load, stated.body_of(load.on).name))

        def guess(factor: float) -> Guess:
            moved: Arrays = {}
            for load, body in driven:
                values = stated.values(load)
                value = float(np.interp(factor, range(len(values)), values))
                so_far = moved.get(body, np.zeros(self.dimension))
                moved[body] = so_far + value * np.array(self._along(load))
            return Guess(factor, moved)

        return guess


def _place(load: Load) -> tuple[str, str]:
    """What a load acts on, and in which direction."""
    return load.on, str(load.direction)


def _largest_side(lowest: Array, highest: Array) -> float:
    """The largest side of the box from ``lowest`` to ``highest`` ``(d,)``."""
    return float((highest - lowest).max())


def _turns(freedom: str | None) -> bool:
    """Whether a direction is a rotation."""
    return freedom is not None and freedom.startswith("rotation")

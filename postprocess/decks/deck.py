"""A problem as an input deck for CalculiX, and but for lines that say so for Abaqus: ``archord
export-deck``.

The deck is the modelled part, in unit thickness or, in plane stress, a thin slice: plane elements,
small strains, contact on the deformed curves by a stiff linear penalty, one ``*STEP`` per load on
the path. A rigid disc is a ring of elements that moves as a whole. What a force drives hangs on a
node of its own, which the force pulls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.materials.elasticity import Elastic, contact_modulus
from archord.materials.j2 import J2Material
from archord.postprocess.decks.mesh import DeckMesh, Ints, label, surface_name
from archord.presets.account import account_of
from archord.scene.file import AnyScene
from archord.solver.contact.coulomb import Coulomb
from archord.solver.contact.named import Frictionless, Tied, contact_law
from archord.solver.path.system import System
from archord.solver.problem import Interaction, Problem, Rigid

PENETRATION = 4e-4  # over the size of the surfaces, under a pressure of the contact modulus
SLICE = 0.1  # thickness of a slice in plane stress, in the shortest edge
_WEAK = 1e-7  # stiffness of the springs that hold floating bodies, over Young's modulus


def system_of(scene: AnyScene) -> System:
    """The problem of ``scene`` with nodes of quadratic elements, on this rank alone. Raises
    `InputError`."""
    analysis = scene.analysis.model_copy(update={"degree": 2})
    return account_of(scene.model_copy(update={"analysis": analysis}), MPI.COMM_SELF).system


def contact_stiffness(problem: Problem, mesh: DeckMesh, interaction: Interaction) -> float:
    """Slope of pressure over penetration, in stress per length: the pressure of a conformal joint,
    about ``E* dR/R``, goes 4e-4 dR deep. With stiffer contact CalculiX ends steps before the
    contact stands still, and P scatters."""
    names = [name for name in interaction.surfaces if not isinstance(name, Rigid)]
    size = min(np.ptp(mesh.x[mesh.surfaces[name].nodes.ravel()], axis=0).max() for name in names)
    materials = [problem.body_of(name).material for name in names]
    return (
        1 / sum(1 / contact_modulus(m.E, m.nu, m.plane) for m in materials) / (PENETRATION * size)
    )


def thickness(problem: Problem, mesh: DeckMesh) -> float:
    """Thickness of the deck's model, by which its forces are to be divided: one in plane strain.

    In plane stress CalculiX's bricks must be thin against the elements: thick ones resist, by
    shear, a thickness strain that varies in the plane.
    """
    if problem.bodies[0].material.plane == "strain":
        return 1.0
    ends = [mesh.x[nodes[:, :2]] for nodes in mesh.elements.values()]
    return SLICE * min(float(np.linalg.norm(np.diff(x, axis=1), axis=2).min()) for x in ends)


@dataclass(frozen=True)
class Moved:
    """The component ``axis`` of the ``nodes`` ``(k,)`` of ``node_set``: the sum over drives of
    ``rates`` ``(k,)`` times their values; ``whole`` if these are all nodes of the set."""

    node_set: str
    axis: int
    nodes: Ints
    rates: dict[str, Array]
    whole: bool

    def boundary(self, values: dict[str, float]) -> Iterator[str]:
        """Rows of ``*BOUNDARY`` at these values of the drives."""
        moved = sum(
            (values[drive] * rate for drive, rate in self.rates.items()), np.zeros(len(self.nodes))
        )
        names = (
            [label(self.node_set)]
            if self.whole and np.ptp(moved) == 0
            else list(map(str, self.nodes + 1))
        )
        for name, value in zip(names, moved, strict=False):
            yield f"{name}, {self.axis + 1}, {self.axis + 1}, {number(value)}"


def moved_sets(system: System, mesh: DeckMesh) -> list[Moved]:
    """What supports and rigid discs move or hold."""
    out: dict[tuple[str, int], Moved] = {}
    drives = system.equilibrium.drives
    for s in system.problem.supports:
        nodes = mesh.node_sets[s.facets]
        own = drives.held_by(s.name)[mesh.dofs[nodes], s.axis]
        per_drive = [
            rate[mesh.dofs[nodes[own]], s.axis] for rate in drives.rate[: len(drives.names)]
        ]
        rates = {
            drive: rate for drive, rate in zip(drives.names, per_drive, strict=True) if rate.any()
        }
        if own.any():
            out[s.facets, s.axis] = Moved(s.facets, s.axis, nodes[own], rates, bool(own.all()))
    for i in system.problem.interactions:
        if isinstance(disc := i.surfaces[0], Rigid):
            name, moved = surface_name(i, 0), disc.moved_by()
            nodes = mesh.node_sets[name]
            for axis in (0, 1):
                rates = {
                    drive: np.full(len(nodes), rate[axis])
                    for drive, rate in moved.items()
                    if rate[axis]
                }
                out[name, axis] = Moved(name, axis, nodes, rates, True)
    return list(out.values())


def deck(system: System, mesh: DeckMesh, targets: Sequence[float], heading: str = "") -> str:
    """The input deck of the problem of ``system`` on ``mesh`` with a step to each of the
    ``targets`` on the path. Raises ValueError for what a deck cannot say."""
    names = {*mesh.elements, *mesh.node_sets, *mesh.surfaces}
    if len({label(name) for name in names}) < len(names):
        raise ValueError(
            f"names must differ in more than case and signs for a deck: {', '.join(sorted(names))}"
        )
    writer = _Writer(system, mesh)
    lines = [*writer.mesh_lines(heading), *writer.model_lines(), *writer.step_lines(targets)]
    return "\n".join(lines) + "\n"


class _Writer:
    """What the parts of a deck share: sets that are moved, nodal forces, and drives that have a
    node of their own."""

    def __init__(self, system: System, mesh: DeckMesh) -> None:
        self.system, self.problem, self.mesh = system, system.problem, mesh
        self.thick = thick = thickness(self.problem, mesh)
        drives, self.moved = system.equilibrium.drives, moved_sets(system, mesh)
        by_force = {drive.name for drive in self.problem.all_drives if drive.control == "force"}
        applied = {
            name: mesh.forces(forces)
            for name, forces in zip(drives.names, drives.applied, strict=False)
        }
        self.loads = {name: thick * f for name, f in applied.items() if f.any()}
        if means := [mean.name for mean in self.problem.means if mean.drive not in by_force]:
            raise ValueError(
                f"the mean displacement of {means[0]!r} cannot be exported; a force on it can"
            )
        self.hung = [m for m in self.moved if by_force & set(m.rates)]
        self.held = [m for m in self.moved if not by_force & set(m.rates)]
        own = dict.fromkeys(drive for m in self.hung for drive in m.rates)
        self.own = {
            drive: len(mesh.x) + k for k, drive in enumerate(own, 1)
        }  # labels of their nodes
        self.pulled = by_force & set(own)

    def mesh_lines(self, heading: str) -> Iterator[str]:
        """Nodes, elements, sets and surfaces."""
        problem, mesh = self.problem, self.mesh
        yield "*HEADING"
        whole = number(problem.whole / self.thick)
        yield f"archord: {heading}; thickness {number(self.thick)}, forces times {whole} are those of the whole"
        yield "*NODE, NSET=ALL_NODES"
        x = self._drawn()
        yield from (
            f"{i}, {number(a)}, {number(b)}" for i, (a, b) in enumerate(zip(*x.T, strict=True), 1)
        )
        if self.own:
            yield "*NODE, NSET=DRIVES"
            yield from (f"{node}, 0., 0." for node in self.own.values())
        first, family = 1, "CPE" if problem.bodies[0].material.plane == "strain" else "CPS"
        for name, nodes in mesh.elements.items():
            yield f"*ELEMENT, TYPE={family}{nodes.shape[1]}, ELSET={label(name)}"
            numbered = np.column_stack([first + np.arange(len(nodes)), nodes + 1])
            yield from (", ".join(map(str, row)) for row in numbered)
            first += len(nodes)
        sets = {name: s.nodes for name, s in mesh.surfaces.items()} | mesh.node_sets
        for name, nodes in sets.items():
            yield f"*NSET, NSET={label(name)}"
            listed = np.unique(nodes) + 1
            yield from (", ".join(map(str, listed[i : i + 10])) for i in range(0, len(listed), 10))
        for name, s in mesh.surfaces.items():
            yield f"*SURFACE, NAME={label(name)}_SURFACE, TYPE=ELEMENT"
            yield from (
                f"{e + 1}, S{edge + 1}" for e, edge in zip(s.elements, s.edges, strict=True)
            )

    def _drawn(self) -> Array:
        """Nodes ``(n, 2)`` that overlap by the interferences."""
        x = self.mesh.x.copy()
        for i in self.problem.interactions:
            surface = self.mesh.surfaces[surface_name(i, 0)]
            along = np.diff(self.mesh.x[surface.nodes[:, :2]], axis=1)
            normal = np.zeros_like(x)
            np.add.at(normal, surface.nodes, along[..., ::-1] * [1.0, -1.0])
            at = np.unique(surface.nodes)
            x[at] += i.interference * normal[at] / np.linalg.norm(normal[at], axis=1)[:, None]
        return x

    def model_lines(self) -> Iterator[str]:
        """Materials, sections, interactions, and what is held in all steps."""
        problem = self.problem
        materials = {body.name: body.material for body in problem.bodies}
        for i in (i for i in problem.interactions if isinstance(i.surfaces[0], Rigid)):
            m = problem.body_of(i.surfaces[1]).material
            materials[surface_name(i, 0)] = Elastic(m.E, m.nu, m.plane)
        for name, material in materials.items():
            yield from _material(name, material)
            yield from (
                f"*SOLID SECTION, ELSET={label(name)}, MATERIAL={label(name)}",
                number(self.thick),
            )
        for i in problem.interactions:
            law, name = contact_law(i.law, i.friction), label(i.name)
            if isinstance(law, Tied):
                yield from (f"*TIE, NAME={name}, ADJUST=NO", _pair(i))
            elif isinstance(law, Frictionless | Coulomb):
                yield from (
                    f"*SURFACE INTERACTION, NAME={name}_LAW",
                    "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
                )
                stiffness = number(contact_stiffness(problem, self.mesh, i))
                yield stiffness
                if isinstance(
                    law, Coulomb
                ):  # with the stiffness of sticking, which Abaqus does not ask for
                    yield from ("*FRICTION", f"{number(law.friction)}, {stiffness}")
                yield from (
                    f"*CONTACT PAIR, INTERACTION={name}_LAW, TYPE=SURFACE TO SURFACE",
                    _pair(i),
                )
            else:
                raise ValueError(
                    f"the law of {i.name!r} cannot be exported; contact with and without friction, and tied, can"
                )
        yield from self._spring_lines()
        for m in self.hung:
            for k, node in enumerate(m.nodes):
                terms = [
                    (self.own[drive], 1, -rate[k]) for drive, rate in m.rates.items() if rate[k]
                ]
                words = [
                    f"{n}, {axis}, {number(factor)}"
                    for n, axis, factor in [(node + 1, m.axis + 1, 1), *terms]
                ]
                yield from ("*EQUATION", str(len(words)))
                yield from (", ".join(words[i : i + 4]) for i in range(0, len(words), 4))
        held = [row for m in self.held if not m.rates for row in m.boundary({})]
        yield from ["*BOUNDARY", *held] if held else []

    def _spring_lines(self) -> Iterator[str]:
        """Weak springs at the ends of bodies that nothing holds before they touch."""
        first = 1 + sum(map(len, self.mesh.elements.values()))
        springs = self.system.equilibrium.springs
        for body in springs.rigid.loose if springs else ():
            nodes = np.unique(self.mesh.elements[body.name])
            along = self.mesh.x[nodes].sum(axis=1)
            for axis in (1, 2):
                name = f"{label(body.name)}_SPRINGS_{axis}"
                yield f"*ELEMENT, TYPE=SPRING1, ELSET={name}"
                yield from (
                    f"{first + k}, {nodes[n] + 1}"
                    for k, n in enumerate((along.argmin(), along.argmax()))
                )
                yield from (
                    f"*SPRING, ELSET={name}",
                    str(axis),
                    number(_WEAK * body.material.E * self.thick),
                )
                first += 2

    def step_lines(self, targets: Sequence[float]) -> Iterator[str]:
        """A step to each of the ``targets``: displacements, forces, and what is to be printed."""
        printed = dict.fromkeys(label(m.node_set) for m in self.moved)
        plastic = any(body.material.yields for body in self.problem.bodies)
        for k, target in enumerate(targets, 1):
            values = {drive.name: drive.value(target) for drive in self.problem.all_drives}
            large = any(body.material.finite for body in self.problem.bodies)
            if large and k == 1:
                yield "** NLGEOM is elastic by St. Venant and Kirchhoff in CalculiX; archord has Hencky's elasticity"
            yield from (f"*STEP, INC=1000{', NLGEOM' if large else ''}", "*STATIC", "1., 1.")
            for i in self.problem.interactions if k == 1 and self.problem.fit else ():
                yield from (
                    "** Abaqus alone, without the stars: *CONTACT INTERFERENCE, SHRINK",
                    f"** {_pair(i)}",
                )
            rows = [row for m in self.held if m.rates for row in m.boundary(values)]
            rows += [
                f"{n}, 1, 1, {number(values[d])}"
                for d, n in self.own.items()
                if d not in self.pulled
            ]
            yield from ["*BOUNDARY", *rows] if rows else []
            forces = sum(
                (values[drive] * f for drive, f in self.loads.items()), np.zeros_like(self.mesh.x)
            )
            loaded = np.argwhere(sum(np.abs(f) for f in self.loads.values())) if self.loads else ()
            rows = [f"{n + 1}, {axis + 1}, {number(forces[n, axis])}" for n, axis in loaded]
            share = self.thick / self.problem.whole
            rows += [
                f"{n}, 1, {number(values[d] * share)}"
                for d, n in self.own.items()
                if d in self.pulled
            ]
            yield from ["*CLOAD", *rows] if rows else []
            for name in printed:
                yield from (f"*NODE PRINT, NSET={name}, TOTALS=ONLY", "RF")
            if self.own:
                yield from ("*NODE PRINT, NSET=DRIVES", "U")
            if k == len(targets):
                yield from (
                    "*NODE FILE, OUTPUT=2D",
                    "U",
                    "*EL FILE, OUTPUT=2D",
                    "S",
                    "*CONTACT FILE",
                    "CSTR",
                )
                for body in self.problem.bodies if plastic else ():
                    yield from (f"*EL PRINT, ELSET={label(body.name)}", "PEEQ")
            yield "*END STEP"


def _pair(interaction: Interaction) -> str:
    return ", ".join(f"{label(surface_name(interaction, side))}_SURFACE" for side in (0, 1))


def _material(name: str, material: Any) -> Iterator[str]:
    material = material.inner if material.finite else material
    if type(material) not in (Elastic, J2Material):
        raise ValueError(
            f"the material of {name!r} cannot be exported: decks know no such law (back stresses are one)"
        )
    yield from (f"*MATERIAL, NAME={label(name)}", "*ELASTIC", f"{material.E!r}, {material.nu!r}")
    if isinstance(material, J2Material):
        yield "*PLASTIC"
        peeq = material.hardening.knots()
        for stress, at in zip(material.hardening.stress(peeq), peeq, strict=True):
            yield f"{number(stress)}, {number(at)}"


def number(value: Any) -> str:
    """As many digits as fit into the 20 characters that CalculiX reads."""
    text = repr(float(value))
    return text if len(text) <= 20 else f"{value:.13e}"

"""A problem as an input deck for CalculiX, and but for lines that say so for Abaqus: ``archord
export-deck`` and `archord.export_deck`.

The deck is the modelled part: plane elements in unit thickness or, in plane stress, a thin slice;
or axisymmetric elements. Contact acts on the deformed curves by a stiff linear penalty, and there
is one ``*STEP`` per load on the path. A rigid disc is a ring of elements that moves as a whole.
What a force drives hangs on a node of its own, which the force pulls.

CalculiX makes a wedge of two degrees of axisymmetric elements. Its ``*CLOAD`` are forces on the
whole ring, but the forces that it prints, and the stiffness of its springs, are of the wedge: a
180th. (CalculiX CrunchiX 2.20, found with a tube under tension; src/cloads.f divides ``*CLOAD``
by 180. Forces of Abaqus are all of the whole ring.)
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from archord.geometry.basis import Array
from archord.geometry.meshes.formats.source import Mesh
from archord.materials.elasticity import Elastic, contact_modulus
from archord.materials.j2 import J2Material
from archord.output.user_file import writing
from archord.postprocess.decks.mesh import DeckMesh, deck_mesh, label, surface_name
from archord.postprocess.decks.numbering import Ints
from archord.presets.account import account_of
from archord.report.errors import InputError
from archord.scene.file import AnyScene
from archord.solver.contact.laws.coulomb import Coulomb
from archord.solver.contact.laws.named import Frictionless, Tied, contact_law
from archord.solver.path.system import System
from archord.solver.problem import Interaction, Problem, Rigid

PENETRATION = 4e-4  # over the size of the surfaces, under a pressure of the contact modulus
SLICE = 0.1  # thickness of a slice in plane stress, in the shortest edge
WEDGES = 180  # wedges of CalculiX in a ring
_WEAK = 1e-7  # stiffness of the springs that hold floating bodies, over Young's modulus
_FAMILIES = {"strain": "CPE", "stress": "CPS", "axisymmetric": "CAX", "space": "C3D"}
_MODELS = {"axisymmetric": "axisymmetric, printed forces", "space": "in space, forces"}
_REDUCED = 20  # nodes of elements with reduced integration, as archord has but for contact
_LONGEST = 15  # entries of a row
_LARGE = (
    "NLGEOM is elastic by St. Venant and Kirchhoff in CalculiX; archord has Hencky's elasticity"
)
_RESULTS = ["*NODE FILE{}", "U", "*EL FILE{}", "S", "*CONTACT FILE", "CSTR"]
_AS_DRAWN = ", OUTPUT=2D"  # not of the bricks that CalculiX makes of plane elements


def system_of(scene: AnyScene, given: Problem | None = None) -> System:
    """The problem of ``scene`` with nodes of quadratic elements, on this rank alone; or the problem
    that was ``given`` from Python, which the scene tells about. Raises `InputError`."""
    analysis = scene.analysis.model_copy(update={"degree": 2})
    scene = scene.model_copy(update={"analysis": analysis})
    if given is not None:
        n_ranks = Mesh.of(given.mesh).n_ranks
        if n_ranks > 1:
            raise InputError(
                f"archord.export_deck: the mesh is on {n_ranks} ranks, and a deck is made from the "
                "whole mesh on one rank: make the mesh on MPI.COMM_SELF, or write the deck without "
                "mpirun."
            )
        given = replace(given, degree=2)
    return account_of(scene, MPI.COMM_SELF, given=given).system


def write_deck(scene: AnyScene, path: Path, name: str, given: Problem | None = None) -> None:
    """Write the deck of ``scene``, or of the problem that was ``given`` from Python, to ``path``;
    messages call it by this ``name``. Raises `InputError`."""
    system = system_of(scene, given)
    heading = f"{Path(name).stem} in {scene.units.length}"
    try:
        text = deck(system, deck_mesh(system), scene.targets, heading)
    except ValueError as error:
        raise InputError(f"{name}: {error}.") from error
    with writing(path) as new:
        new.write_text(text, encoding="utf-8")


def contact_stiffness(problem: Problem, mesh: DeckMesh, interaction: Interaction) -> float:
    """Slope of pressure over penetration, in stress per length: the pressure of a conformal joint,
    about ``E* dR/R``, goes 4e-4 dR deep. With stiffer contact CalculiX ends steps before the
    contact stands still, and P scatters."""
    names = [name for name in interaction.surfaces if not isinstance(name, Rigid)]
    sizes = [np.ptp(mesh.x[mesh.surfaces[name].nodes.ravel()], axis=0).max() for name in names]
    materials = [problem.body_of(name).material for name in names]
    compliance = sum(1 / contact_modulus(m.E, m.nu, m.plane) for m in materials)
    return 1 / compliance / (PENETRATION * min(sizes))


def thickness(problem: Problem, mesh: DeckMesh) -> float:
    """Thickness of the deck's model, by which the forces are to be divided that CalculiX prints:
    one in plane strain, a wedge's part of the ring around an axis.

    In plane stress CalculiX's bricks must be thin against the elements: thick ones resist, by
    shear, a thickness strain that varies in the plane.
    """
    if problem.kinematics.has_hoop:
        return 1 / WEDGES
    if not problem.kinematics.is_thin:
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

    def boundary(self, values: dict[str, float]) -> list[str]:
        """Rows of ``*BOUNDARY`` at these values of the drives."""
        moved = np.zeros(len(self.nodes))
        for drive, rate in self.rates.items():
            moved += values[drive] * rate
        names = list(map(str, self.nodes + 1))
        if self.whole and np.ptp(moved) == 0:
            names = [label(self.node_set)]
        axis = self.axis + 1
        return [
            f"{name}, {axis}, {axis}, {number(value)}"
            for name, value in zip(names, moved, strict=False)
        ]


def moved_sets(system: System, mesh: DeckMesh) -> list[Moved]:
    """What supports and rigid discs move or hold."""
    found: dict[tuple[str, int], Moved] = {}
    drives = system.equilibrium.drives
    for support in system.problem.supports:
        name = support.facets
        axis = support.axis
        nodes = mesh.node_sets[name]
        own = drives.held_by(support.name)[mesh.dofs[nodes], axis]
        dofs = mesh.dofs[nodes[own]]
        rates = {
            drive: rate[dofs, axis]
            for drive, rate in zip(drives.names, drives.rate, strict=False)
            if rate[dofs, axis].any()
        }
        if own.any():
            found[name, axis] = Moved(name, axis, nodes[own], rates, bool(own.all()))
    for interaction in system.problem.interactions:
        disc = interaction.surfaces[0]
        if isinstance(disc, Rigid):
            name = surface_name(interaction, 0)
            nodes = mesh.node_sets[name]
            for axis in (0, 1):
                rates = {
                    drive: np.full(len(nodes), rate[axis])
                    for drive, rate in disc.moved_by().items()
                    if rate[axis]
                }
                found[name, axis] = Moved(name, axis, nodes, rates, True)
    return list(found.values())


def deck(system: System, mesh: DeckMesh, targets: Sequence[float], heading: str = "") -> str:
    """The input deck of the problem of ``system`` on ``mesh`` with a step to each of the
    ``targets`` on the path. Raises ValueError for what a deck cannot say."""
    names = {*mesh.elements, *mesh.node_sets, *mesh.surfaces}
    if len({label(name) for name in names}) < len(names):
        listed = ", ".join(sorted(names))
        raise ValueError(f"names must differ in more than case and signs for a deck: {listed}")
    writer = _Writer(system, mesh)
    lines = [*writer.mesh_lines(heading), *writer.model_lines()]
    for k, target in enumerate(targets, 1):
        lines += writer.step_lines(target, first=k == 1, last=k == len(targets))
    return "\n".join(lines) + "\n"


class _Writer:
    """What the parts of a deck share.

    Attributes
    ----------
    thick : float
        What forces of the deck's springs and prints are multiplied by, see `thickness`.
    slice : float
        What nodal forces are multiplied by: the thickness, or 1 of a whole ring.
    moved : list of Moved
        All sets that are held or moved: ``hung`` on nodes of drives, or ``held``.
    loads : dict
        Nodal forces ``(n, 2)`` by the names of their drives, per unit of the drive's value.
    own : dict
        The labels of nodes of their own, by the names of drives; forces pull the ``pulled`` ones.
    """

    def __init__(self, system: System, mesh: DeckMesh) -> None:
        self.system = system
        self.problem = problem = system.problem
        self.mesh = mesh
        self.thick = thickness(problem, mesh)
        has_hoop = problem.kinematics.has_hoop
        self.slice = 1.0 if has_hoop else self.thick
        if has_hoop and any(isinstance(i.surfaces[0], Rigid) for i in problem.interactions):
            raise ValueError("a rigid disc cannot be exported around an axis; a body can")
        if problem.turns:
            raise ValueError(
                f"the finite rotation of {problem.turns[0].name!r} cannot be exported; a rotation "
                "at small strain can"
            )
        drives = system.equilibrium.drives
        by_force = {drive.name for drive in problem.all_drives if drive.control == "force"}
        means = [mean.name for mean in problem.means if mean.drive not in by_force]
        if means:
            raise ValueError(
                f"the mean displacement of {means[0]!r} cannot be exported; a force on it can"
            )
        self.loads = {}
        for name, of_dofs in zip(drives.names, drives.applied, strict=False):
            forces = self.slice * mesh.forces(of_dofs)
            if forces.any():
                self.loads[name] = forces
        self.moved = moved_sets(system, mesh)
        self.hung = [m for m in self.moved if by_force & set(m.rates)]
        self.held = [m for m in self.moved if not by_force & set(m.rates)]
        own = dict.fromkeys(drive for m in self.hung for drive in m.rates)
        self.own = {drive: len(mesh.x) + k for k, drive in enumerate(own, 1)}
        self.pulled = by_force & set(own)

    def mesh_lines(self, heading: str) -> list[str]:
        """Nodes, elements, sets and surfaces."""
        mesh = self.mesh
        whole = number(self.problem.whole / self.thick)
        model = _MODELS.get(self.problem.kinematics.name, f"thickness {number(self.thick)}, forces")
        lines = ["*HEADING", f"archord: {heading}; {model} times {whole} are of the whole"]
        lines.append("*NODE, NSET=ALL_NODES")
        x = self._drawn()
        for i in range(len(x)):
            place = [number(x[i, axis]) for axis in range(x.shape[1])]
            lines.append(", ".join([str(i + 1), *place]))
        if self.own:
            lines.append("*NODE, NSET=DRIVES")
            lines += [f"{node}, 0., 0." for node in self.own.values()]
        first = 1
        for name, nodes in mesh.elements.items():
            lines.append(f"*ELEMENT, TYPE={self._type(nodes)}, ELSET={label(name)}")
            numbers = first + np.arange(len(nodes))
            for element in np.column_stack([numbers, nodes + 1]):
                lines += _continued(element)
            first += len(nodes)
        sets = {name: surface.nodes for name, surface in mesh.surfaces.items()} | mesh.node_sets
        for name, nodes in sets.items():
            lines.append(f"*NSET, NSET={label(name)}")
            listed = np.unique(nodes) + 1
            lines += _rows(np.split(listed, range(10, len(listed), 10)))
        for name, surface in mesh.surfaces.items():
            lines.append(f"*SURFACE, NAME={label(name)}_SURFACE, TYPE=ELEMENT")
            for element, side in zip(surface.elements, surface.sides, strict=True):
                lines.append(f"{element + 1}, S{side + 1}")
        return lines

    def _type(self, nodes: Ints) -> str:
        """The type of elements with these ``nodes`` ``(m, k)``."""
        n = nodes.shape[1]
        kind = f"{_FAMILIES[self.problem.kinematics.name]}{n}"
        return f"{kind}R" if n == _REDUCED else kind

    def _drawn(self) -> Array:
        """Nodes ``(n, d)`` that overlap by the interferences."""
        x = self.mesh.x.copy()
        for i in self.problem.interactions:
            nodes = self.mesh.surfaces[surface_name(i, 0)].nodes
            normal = np.zeros_like(x)
            np.add.at(normal, nodes, _outward(self.mesh.x[nodes])[:, None])
            at = np.unique(nodes)
            length = np.linalg.norm(normal[at], axis=1)
            x[at] += i.interference * normal[at] / length[:, None]
        return x

    def model_lines(self) -> list[str]:
        """Materials, sections, interactions, and what is held in all steps."""
        problem = self.problem
        materials = {body.name: body.material for body in problem.bodies}
        for interaction in problem.interactions:
            if isinstance(interaction.surfaces[0], Rigid):
                opposite = problem.body_of(interaction.surfaces[1]).material
                elastic = Elastic(opposite.E, opposite.nu, opposite.plane)
                materials[surface_name(interaction, 0)] = elastic
        lines = []
        for name, material in materials.items():
            lines += _material(name, material)
            lines.append(f"*SOLID SECTION, ELSET={label(name)}, MATERIAL={label(name)}")
            if problem.kinematics.is_plane:
                lines.append(number(self.thick))
        for interaction in problem.interactions:
            lines += self._contact_lines(interaction)
        lines += self._spring_lines()
        for m in self.hung:
            for k, node in enumerate(m.nodes):
                words = [f"{node + 1}, {m.axis + 1}, {number(1)}"]
                for drive, rate in m.rates.items():
                    if rate[k]:
                        words.append(f"{self.own[drive]}, 1, {number(-rate[k])}")
                lines += ["*EQUATION", str(len(words))]
                lines += [", ".join(words[i : i + 4]) for i in range(0, len(words), 4)]
        held = [row for m in self.held if not m.rates for row in m.boundary({})]
        return lines + _block("*BOUNDARY", held)

    def _contact_lines(self, interaction: Interaction) -> list[str]:
        """How the surfaces of an ``interaction`` act on each other."""
        law = contact_law(interaction.law, interaction.friction)
        name = label(interaction.name)
        if isinstance(law, Tied):
            return [f"*TIE, NAME={name}, ADJUST=NO", _pair(interaction)]
        if not isinstance(law, Frictionless | Coulomb):
            raise ValueError(
                f"the law of {interaction.name!r} cannot be exported; contact with and without "
                "friction, and tied, can"
            )
        stiffness = number(contact_stiffness(self.problem, self.mesh, interaction))
        lines = [
            f"*SURFACE INTERACTION, NAME={name}_LAW",
            "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
            stiffness,
        ]
        if isinstance(law, Coulomb):
            # with the stiffness of sticking, which Abaqus does not ask for
            lines += ["*FRICTION", f"{number(law.friction)}, {stiffness}"]
        pair = f"*CONTACT PAIR, INTERACTION={name}_LAW, TYPE=SURFACE TO SURFACE"
        return [*lines, pair, _pair(interaction)]

    def _spring_lines(self) -> list[str]:
        """Weak springs at the ends of bodies that nothing holds before they touch."""
        springs = self.system.equilibrium.springs
        if not springs:
            return []
        lines = []
        element = 1 + sum(map(len, self.mesh.elements.values()))
        for body in springs.rigid.loose:
            nodes = np.unique(self.mesh.elements[body.name])
            ends = nodes[_apart(self.mesh.x[nodes])]
            stiffness = number(_WEAK * body.material.E * self.thick)
            for axis in range(1, 1 + self.mesh.x.shape[1]):
                name = f"{label(body.name)}_SPRINGS_{axis}"
                lines.append(f"*ELEMENT, TYPE=SPRING1, ELSET={name}")
                for end in ends:
                    lines.append(f"{element}, {end + 1}")
                    element += 1
                lines += [f"*SPRING, ELSET={name}", str(axis), stiffness]
        return lines

    def step_lines(self, target: float, *, first: bool, last: bool) -> list[str]:
        """The step to the ``target``: displacements, forces, and what is to be printed."""
        problem = self.problem
        values = {drive.name: drive.value(target) for drive in problem.all_drives}
        large = any(body.material.finite for body in problem.bodies)
        lines = [f"** {_LARGE}"] if large and first else []
        lines += [f"*STEP, INC=1000{', NLGEOM' if large else ''}", "*STATIC", "1., 1."]
        if first and problem.fit:
            for interaction in problem.interactions:
                lines.append("** Abaqus alone, without the stars: *CONTACT INTERFERENCE, SHRINK")
                lines.append(f"** {_pair(interaction)}")
        moved = [row for m in self.held if m.rates for row in m.boundary(values)]
        pulled = []
        share = self.slice / problem.whole
        for drive, node in self.own.items():
            if drive in self.pulled:
                pulled.append(f"{node}, 1, {number(values[drive] * share)}")
            else:
                moved.append(f"{node}, 1, 1, {number(values[drive])}")
        lines += _block("*BOUNDARY", moved)
        lines += _block("*CLOAD", self._nodal_forces(values) + pulled)
        for name in dict.fromkeys(label(m.node_set) for m in self.moved):
            lines += [f"*NODE PRINT, NSET={name}, TOTALS=ONLY", "RF"]
        if self.own:
            lines += ["*NODE PRINT, NSET=DRIVES", "U"]
        if last:
            as_drawn = "" if self.mesh.x.shape[1] == 3 else _AS_DRAWN
            lines += [line.format(as_drawn) for line in _RESULTS]
            if any(body.material.yields for body in problem.bodies):
                for body in problem.bodies:
                    lines += [f"*EL PRINT, ELSET={label(body.name)}", "PEEQ"]
        return [*lines, "*END STEP"]

    def _nodal_forces(self, values: dict[str, float]) -> list[str]:
        """Rows of ``*CLOAD`` at these values of the drives, at all nodes that are ever loaded."""
        total = np.zeros_like(self.mesh.x)
        ever = np.zeros_like(total)
        for drive, forces in self.loads.items():
            total += values[drive] * forces
            ever += np.abs(forces)
        loaded = np.argwhere(ever)
        return [f"{n + 1}, {axis + 1}, {number(total[n, axis])}" for n, axis in loaded]


def _continued(entries: Iterable[Any]) -> list[str]:
    """The ``entries`` as one row, which goes on in the next line where it is too long."""
    words = list(map(str, entries))
    parts = [words[k : k + _LONGEST] for k in range(0, len(words), _LONGEST)]
    lines = [", ".join(part) for part in parts]
    return [f"{line}," for line in lines[:-1]] + lines[-1:]


def _outward(x: Array) -> Array:
    """Normals ``(n, d)`` of sides by their nodes ``x`` ``(n, k, d)``, as long as the sides are
    large."""
    start = x[:, 0]
    if x.shape[2] == 2:
        along = x[:, 1] - start
        return along[:, ::-1] * [1.0, -1.0]
    last = x.shape[1] // 2 - 1
    return np.cross(x[:, last] - start, x[:, 1] - start)


def _apart(x: Array) -> list[int]:
    """Nodes of a body, by their places ``x`` ``(n, d)``, whose springs hold all its rigid motions:
    two in a plane, and in space another one aside of their line."""
    along = x.sum(axis=1)
    ends = [int(along.argmin()), int(along.argmax())]
    if x.shape[1] == 2:
        return ends
    first, last = x[ends]
    aside = np.linalg.norm(np.cross(x - first, last - first), axis=1)
    return [*ends, int(aside.argmax())]


def _rows(table: Iterable[Iterable[Any]]) -> list[str]:
    return [", ".join(map(str, row)) for row in table]


def _block(keyword: str, rows: list[str]) -> list[str]:
    """The ``rows`` below their ``keyword``; nothing where there are none."""
    return [keyword, *rows] if rows else []


def _pair(interaction: Interaction) -> str:
    return ", ".join(f"{label(surface_name(interaction, side))}_SURFACE" for side in (0, 1))


def _material(name: str, material: Any) -> list[str]:
    material = material.inner if material.finite else material
    if type(material) not in (Elastic, J2Material):
        raise ValueError(
            f"the material of {name!r} cannot be exported: decks know no such law (back stresses "
            "are one)"
        )
    lines = [f"*MATERIAL, NAME={label(name)}", "*ELASTIC", f"{material.E!r}, {material.nu!r}"]
    if isinstance(material, J2Material):
        lines.append("*PLASTIC")
        peeq = material.hardening.knots()
        for stress, at in zip(material.hardening.stress(peeq), peeq, strict=True):
            lines.append(f"{number(stress)}, {number(at)}")
    return lines


def number(value: Any) -> str:
    """As many digits as fit into the 20 characters that CalculiX reads."""
    text = repr(float(value))
    return text if len(text) <= 20 else f"{value:.13e}"

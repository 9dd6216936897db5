"""The lines of a deck for materials, contact, springs, and what is held in all steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from archord.geometry.basis import Array
from archord.materials.elasticity import Elastic, contact_modulus
from archord.materials.j2 import J2Material
from archord.materials.material import of_small_strain
from archord.postprocess.decks.mesh import DeckMesh, label, surface_name
from archord.postprocess.decks.model import DeckModel
from archord.postprocess.decks.rows import block, number, pair
from archord.postprocess.decks.ties import Ties
from archord.solver.contact.laws.coulomb import Coulomb
from archord.solver.contact.laws.named import Frictionless, Tied, contact_law
from archord.solver.problem import Interaction, Problem, Rigid

PENETRATION = 4e-4  # over the size of the surfaces, under a pressure of the contact modulus
_WEAK = 1e-7  # stiffness of the springs that hold floating bodies, over Young's modulus


def model_lines(model: DeckModel) -> list[str]:
    """Materials, sections, interactions, and what is held in all steps."""
    problem = model.problem
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
            lines.append(number(model.thick))
    ties = Ties(model)
    for interaction in problem.interactions:
        lines += _contact_lines(model, interaction, ties)
    lines += _spring_lines(model)
    for m in model.hung:
        for k, node in enumerate(m.nodes):
            words = [f"{node + 1}, {m.axis + 1}, {number(1)}"]
            for drive, rate in m.rates.items():
                if rate[k]:
                    words.append(f"{model.own[drive]}, 1, {number(-rate[k])}")
            lines += ["*EQUATION", str(len(words))]
            lines += [", ".join(words[i : i + 4]) for i in range(0, len(words), 4)]
    held = [row for m in model.held if not m.rates for row in m.boundary({})]
    return lines + block("*BOUNDARY", held)


def _contact_lines(model: DeckModel, interaction: Interaction, ties: Ties) -> list[str]:
    """How the surfaces of an ``interaction`` act on each other."""
    law = contact_law(interaction.law, interaction.friction)
    name = label(interaction.name)
    if isinstance(law, Tied):
        return ties.lines(interaction)
    if not isinstance(law, Frictionless | Coulomb):
        raise ValueError(
            f"the law of {interaction.name!r} cannot be exported; contact with and without "
            "friction, and tied, can"
        )
    stiffness = number(contact_stiffness(model.problem, model.mesh, interaction))
    lines = [
        f"*SURFACE INTERACTION, NAME={name}_LAW",
        "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        stiffness,
    ]
    if isinstance(law, Coulomb):
        # with the stiffness of sticking, which Abaqus does not ask for
        lines += ["*FRICTION", f"{number(law.friction)}, {stiffness}"]
    heading = f"*CONTACT PAIR, INTERACTION={name}_LAW, TYPE=SURFACE TO SURFACE"
    return [*lines, heading, pair(interaction)]


def _spring_lines(model: DeckModel) -> list[str]:
    """Weak springs at the ends of bodies that nothing holds before they touch."""
    springs = model.system.equilibrium.springs
    if not springs:
        return []
    lines = []
    element = 1 + sum(map(len, model.mesh.elements.values()))
    # a modulus is a stiffness per unit thickness; of a ring and in space it takes a length
    length = 1.0
    if not model.problem.kinematics.is_plane:
        length = float(np.ptp(model.mesh.x, axis=0).max())
    for body in springs.rigid.loose:
        nodes = np.unique(model.mesh.elements[body.name])
        ends = nodes[_apart(model.mesh.x[nodes])]
        stiffness = number(_WEAK * body.material.E * model.thick * length)
        for axis in range(1, 1 + model.mesh.x.shape[1]):
            name = f"{label(body.name)}_SPRINGS_{axis}"
            lines.append(f"*ELEMENT, TYPE=SPRING1, ELSET={name}")
            for end in ends:
                lines.append(f"{element}, {end + 1}")
                element += 1
            lines += [f"*SPRING, ELSET={name}", str(axis), stiffness]
    return lines


def contact_stiffness(problem: Problem, mesh: DeckMesh, interaction: Interaction) -> float:
    """Slope of pressure over penetration, in stress per length: the pressure of a conformal joint,
    about ``E* dR/R``, goes 4e-4 dR deep. With stiffer contact CalculiX ends steps before the
    contact stands still, and P scatters."""
    names = [name for name in interaction.surfaces if not isinstance(name, Rigid)]
    sizes = [np.ptp(mesh.x[mesh.surfaces[name].nodes.ravel()], axis=0).max() for name in names]
    materials = [problem.body_of(name).material for name in names]
    compliance = sum(1 / contact_modulus(m.E, m.nu, m.plane) for m in materials)
    return 1 / compliance / (PENETRATION * min(sizes))


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


def _material(name: str, material: Any) -> list[str]:
    material = of_small_strain(material)
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

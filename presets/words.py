"""A problem from Python in the words of a general scene: what a run folder tells of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from archord.geometry.meshes.formats.source import CHANGES, Mesh
from archord.materials.elasticity import Elastic
from archord.materials.finite import LargeStrain
from archord.materials.hardening import Hardening, LinearHardening, TabularHardening
from archord.materials.j2 import J2Material
from archord.materials.kinematic import KinematicMaterial
from archord.materials.material import Material
from archord.report.attributes import attributes_of, described
from archord.report.by_name import Amounts, ByName
from archord.report.errors import InputError
from archord.scene.problem import ProblemScene
from archord.scene.sections.contact import CONTACT_LAWS
from archord.scene.sections.plasticity import parameters_of
from archord.solver.contact.interaction import Interaction
from archord.solver.contact.laws.coulomb import Coulomb
from archord.solver.contact.laws.named import LAWS
from archord.solver.parts import Body, Coupling, Load, Support
from archord.solver.problem import Problem

_LARGEST_NU = 0.499999


def words_of(problem: Problem, mesh_file: str, fields: str | bool = "nodes") -> ProblemScene:
    """The scene that tells of ``problem``, whose mesh is, or will be, the file ``mesh_file``.

    Materials and laws of one's own classes are told by class, representation and attributes. Raises
    `InputError` for what a scene refuses, and for conditions that it has no words for.
    """
    return ProblemScene("archord.Problem", None, **_sections(problem, mesh_file, fields))


def _sections(problem: Problem, mesh_file: str, fields: str | bool) -> ByName:
    for part in (*problem.supports, *problem.loads, *problem.means, *problem.drives):
        if not isinstance(part, (Support, Load)):
            kind = type(part).__name__
            raise InputError(
                f"archord.solve: a problem with a {kind} has no run folder; state it by Support, "
                "Load and Coupling, or solve it by System."
            )
    if fields:
        _require_true_stresses(problem)
    dimension = 3 if _plane(problem) == "space" else 2
    return {
        "units": dict(zip(("length", "stress"), problem.units, strict=True)),
        "mesh": _mesh(problem.mesh, mesh_file),
        "body": [_body(body, _plane(problem)) for body in problem.bodies],
        "interaction": [_interaction(part) for part in problem.interactions],
        "coupling": [_coupling(coupling, dimension) for coupling in problem.couplings],
        "support": [_support(support, dimension) for support in problem.supports],
        "load": [_load(load) for load in problem.loads if isinstance(load, Load)],
        "path": {"steps": problem.steps, "fit_steps": problem.fit_steps},
        "analysis": _analysis(problem),
        "stepping": dict(problem.stepping),
        "output": {"fields": fields},
    }


def _require_true_stresses(problem: Problem) -> None:
    """Raise `InputError` for a material of one's own at large strain that tells nominal stresses
    alone: their components are others."""
    for body in problem.bodies:
        material = body.material
        if material.finite and type(material).true_stress is Material.true_stress:
            raise InputError(
                f'archord.solve: body "{body.name}".material must define true_stress, as fields '
                "have Cauchy's stress, and its update gives nominal ones; or give fields=False."
            )


def _mesh(mesh: Any, file: str) -> ByName:
    if not isinstance(mesh, Mesh):
        return {"file": file}
    circles = [
        {"facets": facets, "centre": list(centre), "radius": radius, "axis": next(iter(axis), None)}
        for facets, (centre, radius, *axis) in (mesh.circles or {}).items()
    ]
    changes = {name: getattr(mesh, name) for name in CHANGES}
    if mesh.file:
        file = str(Path(mesh.file).absolute())
    return {"file": file, "circle": circles} | changes


def _body(body: Body, plane: str) -> ByName:
    return {"name": body.name, "cells": body.cells} | material_words(body.material, plane)


def material_words(material: Any, plane: str) -> ByName:
    """The keys of a body's section for ``material`` in a problem of these kinematics: a scene's, or
    a description of a class of one's own, with E and nu of its elastic moduli."""
    kind = type(material)
    if kind is LargeStrain:
        return material_words(material.inner, plane)
    elastic = {"E": getattr(material, "E", 0.0), "nu": getattr(material, "nu", 0.0)}
    if kind is Elastic:
        return elastic
    if kind in (J2Material, KinematicMaterial):
        hardening = _hardening(material.hardening)
        if hardening is not None:
            back = getattr(material, "back_stresses", None)
            return elastic | hardening | {"back_stresses": back and [list(pair) for pair in back]}
    return _moduli(material, plane) | {"own": _own(material) | {"plastic": bool(material.yields)}}


def _hardening(law: Hardening) -> ByName | None:
    """The keys of a body's section for a hardening law, None for a class of one's own."""
    if type(law) is LinearHardening:
        return {"yield_stress": law.yield_stress, "hardening": law.modulus}
    if type(law) is TabularHardening:
        return {"hardening": [list(point) for point in law.points]}
    parameters = parameters_of(law)
    if parameters is None:
        return None
    yield_stress = getattr(law, "yield_stress", None)
    if yield_stress is None:
        yield_stress = float(law.stress(np.zeros(1))[0])
    return {"yield_stress": yield_stress, "hardening": parameters}


def _moduli(material: Any, plane: str) -> Amounts:
    """E and nu of the elastic moduli of ``material`` in a ``plane``, as if it were isotropic."""
    tangent = material.elastic_tangent
    along = float(tangent[0, 0])
    across = float(tangent[0, 1])
    is_thin = plane == "stress"
    nu = across / along if is_thin else across / (along + across)
    nu = min(max(nu, 0.0), _LARGEST_NU)
    if is_thin:
        return {"E": along * (1 - nu**2), "nu": nu}
    return {"E": along * (1 + nu) * (1 - 2 * nu) / (1 - nu), "nu": nu}


def _own(part: Any) -> ByName:
    """An object of a class of one's own in words, the same ones in every process."""
    return {
        "kind": type(part).__qualname__,
        "text": described(part),
        "attributes": attributes_of(part),
    }


def _interaction(part: Interaction) -> ByName:
    disc = part.disc
    words = {
        "name": part.name,
        "surfaces": [name for name in part.surfaces if isinstance(name, str)],
        "friction": part.friction,
        "integrated": part.integrated or None,
        "interference": part.interference,
        "overlap": part.overlap,
    }
    if disc is not None:
        words["rigid"] = {"centre": disc.centre, "radius": disc.radius, "axis": disc.axis}
    return words | _law(part.law)


def _law(law: Any) -> ByName:
    """The keys of an interaction's section for a contact law."""
    if isinstance(law, str):
        return {"law": law}
    if type(law) is Coulomb and law == Coulomb(law.friction):
        return {"law": "coulomb", "friction": law.friction}
    names = {kind: name for name, kind in LAWS.items() if CONTACT_LAWS[name]}
    if type(law) in names:
        return {"law": names[type(law)], "parameters": vars(law)}
    units = {name: quantity.unit for name, quantity in law.quantities(law.state(1)).items()}
    return {"own": _own(law) | {"friction": bool(law.has_friction), "quantities": units}}


def _support(support: Support, dimension: int) -> ByName:
    return {"name": support.name, "on": support.on, "fixed": support.held(dimension)}


def _coupling(coupling: Coupling, dimension: int) -> ByName:
    return vars(coupling) | {"point": coupling.point or (0.0,) * dimension}


def _load(load: Load) -> ByName:
    words: ByName = {"name": load.name, "on": load.on, "direction": load.direction}
    words[load.kind] = getattr(load, load.kind)
    if load.core is not None:
        centre, radius = load.core
        words["core"] = {"centre": list(centre), "radius": radius}
    return words


def _plane(problem: Problem) -> str:
    """The name of the problem's kinematics, by its mesh where they wait for it."""
    if problem.kinematics is not None:
        return problem.kinematics.name
    return "space" if problem.mesh.dimension == 3 else "strain"


def _analysis(problem: Problem) -> ByName:
    are_large = {getattr(body.material, "finite", False) for body in problem.bodies}
    if len(are_large) > 1:
        said = 'bodies are at small and at large strain; strain = "large" takes all to large strain'
        raise InputError(f"archord.Problem: {said}.")
    symmetry = int(problem.symmetry) if problem.symmetry % 1 == 0 else problem.symmetry
    words = {
        "plane": _plane(problem),
        "strain": "large" if True in are_large else problem.strain,
        "degree": problem.degree,
        "thickness": problem.thickness,
        "tolerance": problem.tolerance,
        "max_iterations": problem.max_iterations,
        "symmetry": symmetry,
    }
    for key in ("kinematics", "gamma_factor"):
        given = {getattr(part, key) for part in problem.interactions}
        if len(given) > 1:
            raise InputError(f"archord.Problem: interactions must have one {key}, not {given}.")
        if given:
            words[key] = given.pop()
    return words

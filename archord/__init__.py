"""archord: conformal contact of pins in holes, elastic and plastic, on FEniCSx.

    import archord

    run = archord.solve(archord.load_scene("scenes/steel_pin.toml"), "runs/thin")
    run.history["P"], run.pressure(step=20), run.fields().peeq

Everything is imported when it is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from archord.report.version import VERSION

__version__ = VERSION

if TYPE_CHECKING:
    from archord.api import InputError, Run, Sweep, export_deck, load, load_scene, solve
    from archord.geometry.curve import RigidCircle
    from archord.geometry.meshes.fenicsx import gmsh_to_mesh
    from archord.geometry.meshes.formats.source import Mesh
    from archord.geometry.rigid_in_space import RigidBall, RigidCylinder
    from archord.geometry.shapes.boxes import boxes
    from archord.geometry.shapes.rectangles import rectangles
    from archord.materials.elasticity import Elastic
    from archord.materials.finite import LargeStrain
    from archord.materials.hardening import (
        LinearHardening,
        SwiftHardening,
        TabularHardening,
        VoceHardening,
    )
    from archord.materials.j2 import J2Material
    from archord.materials.kinematic import KinematicMaterial
    from archord.materials.material import Material
    from archord.postprocess.pictures.pictures import draw_run
    from archord.scene.presets.joint import Scene
    from archord.scene.problem import ProblemScene
    from archord.solver.contact.laws.coulomb import Coulomb
    from archord.solver.contact.laws.exponential import Exponential
    from archord.solver.contact.laws.law import ContactLaw, Quantity, Response
    from archord.solver.path.system import System
    from archord.solver.problem import Body, Coupling, Interaction, Load, Problem, Support

__all__ = [
    "Body",
    "ContactLaw",
    "Coulomb",
    "Coupling",
    "Elastic",
    "Exponential",
    "InputError",
    "Interaction",
    "J2Material",
    "KinematicMaterial",
    "LargeStrain",
    "LinearHardening",
    "Load",
    "Material",
    "Mesh",
    "Problem",
    "ProblemScene",
    "Quantity",
    "Response",
    "RigidBall",
    "RigidCircle",
    "RigidCylinder",
    "Run",
    "Scene",
    "Support",
    "Sweep",
    "SwiftHardening",
    "System",
    "TabularHardening",
    "VoceHardening",
    "boxes",
    "draw_run",
    "export_deck",
    "gmsh_to_mesh",
    "load",
    "load_scene",
    "rectangles",
    "solve",
]
_HOME = {
    "archord.api": ["InputError", "Run", "Sweep", "export_deck", "load", "load_scene", "solve"],
    "archord.geometry.curve": ["RigidCircle"],
    "archord.geometry.meshes.fenicsx": ["gmsh_to_mesh"],
    "archord.geometry.meshes.formats.source": ["Mesh"],
    "archord.geometry.rigid_in_space": ["RigidBall", "RigidCylinder"],
    "archord.geometry.shapes.boxes": ["boxes"],
    "archord.geometry.shapes.rectangles": ["rectangles"],
    "archord.materials.elasticity": ["Elastic"],
    "archord.materials.finite": ["LargeStrain"],
    "archord.materials.hardening": [
        "LinearHardening",
        "SwiftHardening",
        "TabularHardening",
        "VoceHardening",
    ],
    "archord.materials.j2": ["J2Material"],
    "archord.materials.kinematic": ["KinematicMaterial"],
    "archord.materials.material": ["Material"],
    "archord.postprocess.pictures.pictures": ["draw_run"],
    "archord.scene.problem": ["ProblemScene"],
    "archord.scene.presets.joint": ["Scene"],
    "archord.solver.contact.laws.coulomb": ["Coulomb"],
    "archord.solver.contact.laws.exponential": ["Exponential"],
    "archord.solver.contact.laws.law": ["ContactLaw", "Quantity", "Response"],
    "archord.solver.path.system": ["System"],
    "archord.solver.problem": ["Body", "Coupling", "Interaction", "Load", "Problem", "Support"],
}


def __getattr__(name: str) -> Any:
    """Import what is asked for (PEP 562)."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    module = next(module for module, names in _HOME.items() if name in names)
    value = getattr(importlib.import_module(module), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """What is there, imported already or not."""
    return sorted({*globals(), *__all__})

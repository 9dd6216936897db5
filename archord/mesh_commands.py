"""`archord mesh`: what is in a mesh, printed and drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from archord.options import argument, output, overrides, pictures


@click.command()
@argument("file", "FILE", "mesh (.msh, .inp, .xdmf), or scene (.toml)")
@output("picture to draw [<name>.png]")
@overrides()
@pictures("the mesh with its named sets")
def mesh(file: Path, output: Path | None, overrides: tuple[str, ...], pictures: bool) -> int:
    """Print what is in a mesh: kind and order of its cells, named sets, circles and warnings; and draw it.

    Keys of [mesh] may be set of a mesh file, too: --set mesh.scale=1000.
    """
    from mpi4py import MPI

    from archord.geometry.meshes.fenicsx import gathered
    from archord.output.user_file import check_target
    from archord.postprocess.pictures.mesh import draw_mesh, mesh_text
    from archord.presets.joint import joint_problem
    from archord.presets.problem import as_input_error, scene_mesh
    from archord.scene.file import load_scene, override_key
    from archord.scene.problem import MeshScene
    from archord.scene.scene import Scene

    if file.suffix == ".toml":
        scene: Any = load_scene(file, overrides)
    else:
        given: Any = {"mesh": {"file": str(file)}}
        make: Any = MeshScene
        scene = make(str(file), {override_key(given, o): f"--set {o}" for o in overrides}, **given)
    if isinstance(scene, Scene):
        whole = gathered(joint_problem(scene, MPI.COMM_SELF).mesh)
    else:
        with as_input_error(scene):
            whole = gathered(scene_mesh(scene, MPI.COMM_SELF))
    assert whole is not None  # this is rank 0
    print(mesh_text(str(file), whole))
    if pictures:
        target = output or Path(f"{file.stem}.png")
        check_target(target, [file])
        print(f"\n{draw_mesh(whole, target)}")
    return 0

"""Where contact ends: at the borders of surfaces, and at the edges of bodies."""

from dataclasses import replace

import pytest

import archord
from archord import Body, Elastic, Interaction, Load, Problem, Support

STEEL = Elastic(E=210e3, nu=0.3)
SIDES = {
    2: ("bottom", "right", "top", "left"),
    3: ("left", "right", "bottom", "top", "back", "front"),
}
WIDER = 1e-4  # of its area, by which a block that is pressed widens


def pressed(mesh, folder, surfaces=("block bottom", "base top")):
    """Columns of a block that is pressed on a larger base."""
    bodies = [Body("base", STEEL), Body("block", STEEL)]
    dimension = mesh.mesh.geometry.dim
    held = [Support("base bottom"), Support("block top", fixed="xz"[: dimension - 1])]
    press = Load("press", on="block top", direction="y", displacement=-0.01)
    contact = Interaction("contact", surfaces)
    problem = Problem(mesh, bodies, [contact], held, [press], steps=1)
    return archord.solve(problem, folder, fields=False).columns


@pytest.mark.parametrize("size", [3.0, 2.0])
def test_an_edge_ends_contact_in_a_plane(tmp_path, size):
    """Also where the base's elements go on beside the block."""
    mesh = archord.rectangles({"base": (-15, -8, 30, 8), "block": (-12, 0, 10, 6)}, size)
    columns = pressed(mesh, tmp_path)
    assert columns["contact contact length"][-1] == pytest.approx(10, rel=WIDER)


@pytest.mark.parametrize("size", [6.0, 5.0])
def test_an_edge_ends_contact_in_space(tmp_path, size):
    boxes = {"base": (-15, -10, -12, 30, 10, 24), "block": (-7.5, 0, -6, 15, 8, 12)}
    columns = pressed(archord.boxes(boxes, size), tmp_path)
    assert columns["contact contact area"][-1] == pytest.approx(15 * 12, rel=WIDER)


# cells of hexahedra with a facet of a contact surface have more integration points
@pytest.mark.parametrize(("kind", "near"), [("tetrahedra", 1e-9), ("hexahedra", 3e-3)])
def test_whole_skins_of_boxes_meet_as_their_faces(tmp_path, kind, near):
    boxes = {"base": (0, 0, 0, 2, 1, 2), "block": (0.5, 1, 0.5, 1, 1, 1)}
    mesh = archord.boxes(boxes, 0.5, kind)
    skins = {}
    for name in boxes:
        faces = [mesh.facet_sets[f"{name} {side}"] for side in SIDES[3]]
        skins[f"{name} skin"] = sum(map(tuple, faces), ())
    whole = replace(mesh, facet_sets=mesh.facet_sets | skins)
    of_faces = pressed(mesh, tmp_path / "faces")
    of_skins = pressed(whole, tmp_path / "skins", ("block skin", "base skin"))
    for name, within in {"contact contact area": 1e-9, "press force": near}.items():
        assert of_skins[name][-1] == pytest.approx(of_faces[name][-1], rel=within)

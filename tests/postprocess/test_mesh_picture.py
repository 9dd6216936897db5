"""A mesh described: its sets with their measures, circles and warnings, and drawn."""

import numpy as np
import pytest
from mpi4py import MPI

from archord import boxes
from archord.geometry.basis import HEXAHEDRON, QUADRILATERAL
from archord.geometry.meshes.fenicsx import gathered
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.refine import Circle, refined
from archord.postprocess.pictures.mesh import draw_mesh, mesh_text
from archord.report.errors import InputError


def ring(n=12, order=1):
    """Two rings of radii 1 to 2 and 2 to 3 in one mesh that share no node; the middle one closed,
    "seam" on a line."""
    angle = np.arange(n) * 2 * np.pi / n
    x = np.concatenate([r * np.stack([np.cos(angle), np.sin(angle)], axis=1) for r in (1, 2, 2, 3)])
    k = np.arange(n)
    after = (np.arange(n) + 1) % n
    cells = np.concatenate(
        [np.stack([k, after, k + n, after + n], axis=1) + shift for shift in (0, 2 * n)]
    )
    sets = {"inner": np.arange(n), "outer": n + np.arange(n), "all": np.arange(2 * n)}
    facets = {"bore": cells[:n, :2], "half": cells[: n // 2, :2], "seam": cells[:1, [0, 2]]}
    made = MeshArrays.of_sets(QUADRILATERAL, x, cells, sets, facets, {"east": np.array([0])})
    return refined(made, order=order, circles=[Circle("bore", (0, 0), 1.0)])


def rows(text):
    return {line.split("  ")[0]: line for line in text.splitlines()}


def test_what_is_said_of_a_mesh():
    head, *tables, warnings = mesh_text("ring.msh", ring()).split("\n\n")
    assert head == "ring.msh: 24 quadrilaterals of order 1, 48 nodes, 6 by 6 from (-3, -3)"
    said = rows("\n".join(tables))
    area = 12 / 2 * np.sin(np.pi / 6)
    chord = 2 * np.sin(np.pi / 12)
    # the determinant grows with the radius, from 1 to 2 and from 2 to 3
    inner = ["0.5", f"{3 * area / 12 / (2 * chord) ** 2:.2g}"]
    everything = ["0.5", f"{5 * area / 12 / (3 * chord) ** 2:.2g}"]
    assert said["inner"].split() == ["inner", "12", f"{3 * area:.6g}", "1", *inner]
    assert said["all"].split() == ["all", "24", f"{8 * area:.6g}", "2", *everything]
    assert "inner, all  (0, 0) R 1, sagitta 0.033, closed  " in said["bore"]
    assert said["bore"].split()[-3:] == [f"{12 * chord:.5g}", *2 * [f"{chord:.5g}"]]
    assert "inner, all  (0, 0) R 1, sagitta 0.033  " in said["half"]
    assert said["seam"].split() == ["seam", "inner,", "all", "1", *3 * ["1"]]
    assert said["east"].split() == ["east", "1"]
    assert warnings.startswith("warning: the body 'all' has 12 pairs of nodes at the same place")


def test_curved_sides_have_the_length_of_their_curve():
    bore = rows(mesh_text("ring", ring(order=2)))["bore"]
    assert "R 1, closed" in bore
    assert float(bore.split()[-3]) == pytest.approx(2 * np.pi, rel=1e-4)


def test_a_mesh_is_drawn(tmp_path):
    assert draw_mesh(ring(), tmp_path / "ring.png").stat().st_size > 10_000
    with pytest.raises(InputError, match="must end in one of"):
        draw_mesh(ring(), tmp_path / "ring.xyz")


def test_a_mesh_in_space_is_told_of_and_drawn(tmp_path):
    """The faces of solids, with middles and radii, by which a user finds those of a STEP file."""
    mesh = gathered(boxes({"bar": (0, 0, 0, 3, 1, 2)}, 1.0, "hexahedra", MPI.COMM_SELF))
    head, *tables = mesh_text("bar.msh", mesh).split("\n\n")
    assert head == "bar.msh: 6 hexahedra of order 2, 105 nodes, 3 by 1 by 2 from (0, 0, 0)"
    said = rows("\n".join(tables))
    assert said["bar"].split() == ["bar", "6", "6", "1", "1", "1"]
    columns = ["bar", "right", "bar", "(3,", "0.5,", "1)", "2", "2", "1", "1"]
    assert said["bar right"].split() == columns
    assert draw_mesh(mesh, tmp_path / "bar.png").stat().st_size > 10_000


def test_cylinders_of_a_mesh_in_space_are_told():
    turned = np.linspace(0, np.pi / 2, 7)
    x = [[r * np.cos(a), r * np.sin(a), z] for z in (0, 1) for a in turned for r in (1, 2)]
    first = np.arange(0, 12, 2)[:, None]
    cells = first + np.array([0, 1, 2, 3, 14, 15, 16, 17])
    facets = {"bore": cells[:, [0, 2, 4, 6]]}
    made = MeshArrays.of_sets(HEXAHEDRON, np.array(x), cells, {"tube": np.arange(6)}, facets, {})
    assert "  R 1  " in rows(mesh_text("tube", made))["bore"]

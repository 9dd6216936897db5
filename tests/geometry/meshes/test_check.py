"""What is said of meshes that nothing can be computed on, one sentence for each fault."""

from dataclasses import replace

import numpy as np
import pytest
from basix import CellType
from mpi4py import MPI

from archord.geometry.basis import QUADRILATERAL, TRIANGLE, lagrange_element, tabulate
from archord.geometry.curve import circle_through
from archord.geometry.meshes.check import check_mesh
from archord.geometry.meshes.fenicsx import distribute, gathered, gmsh_to_mesh
from archord.geometry.meshes.jacobian import smallest_determinants
from archord.geometry.meshes.mesh_arrays import MeshArrays
from archord.geometry.meshes.motions import AXISYMMETRIC, free_motions
from archord.geometry.meshes.quality import (
    beyond_axis,
    faults,
    poor_cells,
    quality,
)
from archord.geometry.meshes.refine import Circle, refined
from archord.geometry.shapes.boxes import boxes


def grid(n, m, corner=(0.0, 0.0), size=(1.0, 1.0)):
    """Nodes and counterclockwise quadrilaterals, in basix' order, of a rectangle."""
    x = np.stack(np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, m + 1)), axis=-1).reshape(
        -1, 2
    )
    first = (np.arange(n) + (n + 1) * np.arange(m)[:, None]).ravel()
    return x * size + corner, first[:, None] + [0, 1, n + 1, n + 2]


def joined(*grids):
    """One mesh of several, none of whose nodes are merged; sets "0", "1", ... and the facet sets "0
    top", ..."""
    x = []
    cells = []
    cell_sets = {}
    facet_sets = {}
    n = 0
    m = 0
    for k, (nodes, found) in enumerate(grids):
        cell_sets[str(k)] = m + np.arange(len(found))
        for name, row, ends in (
            ("bottom", nodes[:, 1].min(), [0, 1]),
            ("top", nodes[:, 1].max(), [2, 3]),
        ):
            at = (np.abs(nodes[found[:, ends], 1] - row) < 1e-9).all(axis=1)
            facet_sets[f"{k} {name}"] = n + found[at][:, ends]
        x.append(nodes)
        cells.append(n + found)
        n = n + len(nodes)
        m = m + len(found)
    return np.concatenate(x), np.concatenate(cells), cell_sets, facet_sets


def check(comm, made, bodies, **options):
    mesh = MeshArrays.of_sets(QUADRILATERAL, *made, {}) if comm.rank == 0 else None
    return check_mesh(distribute(comm, mesh), bodies, **options)


BOTH = {"lower": "0", "upper": "1"}
TWO = joined(grid(2, 2), grid(3, 2, (0, 1.01)))


@pytest.mark.mpi
def test_a_sound_mesh_has_nothing_said_of_it(comm):
    assert check(comm, TWO, BOTH, pairs=[("0 top", "1 bottom")]) == []


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("made", "bodies", "options", "said"),
    [
        (TWO, {"lower": "0", "upper": "2"}, {}, r"no cell set '2'"),
        (
            TWO,
            BOTH,
            {"pairs": [("0 top", "1 bottm")]},
            r"no facet set '1 bottm' \(did you mean '1 bottom'\?\)",
        ),
        (TWO, {"lower": "0"}, {}, r"6 cells belong to no body, the first at \(0.166667, 1.26\)"),
        (
            TWO,
            {"lower": "0", "upper": "1", "again": "1"},
            {},
            "'upper' and 'again' share 12 nodes, as at .0, 1.01.",
        ),
        (
            TWO,
            {"one": "both"},
            {},
            r"'one' has 2 unconnected parts, the smallest of 4 cells at \(0.25, 0.25\)",
        ),
        (
            TWO,
            BOTH,
            {"pairs": [("seam",)]},
            "set 'seam' is of the bodies 'lower' and 'upper'; a surface is of one",
        ),
        (
            TWO,
            BOTH,
            {"pairs": [("middle",)]},
            "set 'middle' lies inside the body 'lower'; a surface is on a boundary",
        ),
        (
            TWO,
            BOTH,
            {"millimetres": True, "scale": 0.01},
            "the mesh is 0.0201 mm large; is it in metres?",
        ),
        (
            joined(grid(2, 2), grid(3, 2, (0.2, 0.9))),
            BOTH,
            {},
            r"'lower' lies 0.1 deep in the body 'upper' at \(0.5, 1\)",
        ),
        (
            joined(grid(2, 2), grid(1, 1, (0.2, 0.3), (0.1, 0.1))),
            BOTH,
            {},
            "'upper' lies 0.3 deep in the body 'lower'",
        ),
        (joined(grid(2, 2), grid(2, 2)), BOTH, {}, "'lower' lies 0.25 deep in the body 'upper'"),
    ],
)
def test_each_fault_has_its_sentence(comm, made, bodies, options, said):
    x, cells, cell_sets, facet_sets = made
    options = dict(options)
    both = np.arange(len(cells))
    seam = np.concatenate([facet_sets["0 top"], facet_sets["1 bottom"]])
    facet_sets = facet_sets | {"seam": seam, "middle": np.array([[3, 4], [4, 5]])}
    with pytest.raises(ValueError, match=said):
        check(
            comm,
            (x * options.pop("scale", 1.0), cells, {**cell_sets, "both": both}, facet_sets),
            bodies,
            **options,
        )


def test_large_sides_elsewhere_hide_no_overlap():
    x, cells, sets, facets = joined(grid(2, 2), grid(9, 2, (0.0, 0.99)))
    x[-1] = [50.0, 40.0]
    with pytest.raises(ValueError, match=r"lies 0\.01 deep in the body"):
        check(MPI.COMM_SELF, (x, cells, sets, facets), BOTH)


def test_bodies_may_lie_in_each_other_as_far_as_is_said():
    made = joined(grid(2, 2), grid(3, 2, (0.0, 0.9)))
    assert check(MPI.COMM_SELF, made, BOTH, overlap=0.1) == []


def test_a_crack_is_warned_of():
    """Two halves that share one side, and have two nodes each where one was meant."""
    x, cells = grid(2, 2)
    x = np.concatenate([x, x[[1]]])
    cells = cells.copy()
    cells[1, 0] = 9
    (said,) = check(MPI.COMM_SELF, (x, cells, {"0": np.arange(4)}, {}), {"body": "0"})
    assert said.startswith("the body 'body' has 1 pairs of nodes at the same place, as at (0.5, 0)")


@pytest.mark.parametrize(("n", "warned"), [(3, 1), (4, 0)])
def test_a_hole_of_one_cell_is_warned_of(n, warned):
    """One of the cells in the middle is missing, or two are."""
    x, cells = grid(n, 3)
    cells = np.delete(cells, [n + 1, 2 * n - 2], axis=0)
    said = check(MPI.COMM_SELF, (x, cells, {"0": np.arange(len(cells))}, {}), {"body": "0"})
    assert len(said) == warned
    assert all(
        "'body' has 1 holes of the size of one cell, as at (0.5, 0.5)" in text for text in said
    )


def test_a_boundary_that_meets_itself_is_warned_of():
    """A cell at the corner is missing, and one in the middle."""
    x, cells = grid(3, 3)
    cells = np.delete(cells, [0, 4], axis=0)
    (said,) = check(MPI.COMM_SELF, (x, cells, {"0": np.arange(len(cells))}, {}), {"body": "0"})
    assert said.startswith(
        "the boundary of the body 'body' meets itself in 1 nodes, as at (0.333333, 0.333333)"
    )


def test_a_body_of_one_cell_has_no_hole():
    x, cells = grid(1, 1)
    assert check(MPI.COMM_SELF, (x, cells, {"0": np.arange(1)}, {}), {"body": "0"}) == []


def disc(n, radius, m=2):
    """Quadrilaterals of a ring of straight sides inside the ``radius``, or outside if ``m`` is
    negative."""
    x, cells = grid(n, abs(m))
    r = radius * (0.5 + 0.5 * x[:, 1] if m > 0 else 2 - x[:, 1])
    angle = -np.pi * x[:, 0]
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1), cells


def arcs(clearance):
    x, cells, cell_sets, _ = joined(disc(20, 1.0), disc(20, 1.0 + clearance, -2))
    tops = {f"{k} top": cells[found][-20:][:, [2, 3]] for k, found in cell_sets.items()}
    return x, cells, cell_sets, tops


PAIR = {"pairs": [("0 top", "1 top")]}


def test_straight_sides_of_arcs_are_told_with_their_sagitta():
    """pi/20 squared over 8 is 0.0031, with middle nodes on straight sides, too; on the circles
    there is none. Tied arcs may be as they are."""
    bodies = {"pin": "0", "plate": "1"}
    with pytest.raises(
        ValueError, match=r"a sagitta of 0.0031, too much for their clearance of 0.01"
    ):
        check(MPI.COMM_SELF, arcs(0.01), bodies, **PAIR)
    (said,) = check(MPI.COMM_SELF, arcs(0.1), bodies, **PAIR)
    assert "a sagitta of 0.0034: their corners make the largest pressure too high" in said
    rigid = [(name, 0.99) for name in ("0 top", "1 top")]
    with pytest.raises(
        ValueError, match=r"arcs '0 top' have .* a sagitta of 0.0031, too much for .* of 0.01"
    ):
        check(MPI.COMM_SELF, arcs(0.1), bodies, pairs=rigid[:1])
    (said,) = check(MPI.COMM_SELF, arcs(0.1), bodies, pairs=rigid[1:])
    assert "their corners" in said
    straight = refined(MeshArrays.of_sets(QUADRILATERAL, *arcs(0.01), {}), order=2)
    with pytest.raises(ValueError, match=r"a sagitta of 0.0031"):
        check_mesh(distribute(MPI.COMM_SELF, straight), bodies, **PAIR)
    assert (
        check_mesh(
            distribute(MPI.COMM_SELF, straight),
            bodies,
            pairs=[(name,) for name in PAIR["pairs"][0]],
        )
        == []
    )
    circles = [Circle("0 top", (0.0, 0.0), 1.0), Circle("1 top", (0.0, 0.0), 1.01)]
    curved = refined(MeshArrays.of_sets(QUADRILATERAL, *arcs(0.01), {}), order=2, circles=circles)
    assert check_mesh(distribute(MPI.COMM_SELF, curved), bodies, **PAIR) == []


@pytest.mark.parametrize(
    ("radius", "x", "warned"), [(1.0, 0.0, 0), (1.00005, 0.0, 0), (1.005, 0.0, 1), (1.0, 0.003, 1)]
)
def test_a_circle_that_is_not_the_drawn_one_is_told(radius, x, warned):
    """It changes the clearance: nodes were moved by up to a twentieth of the radius without a
    word."""
    given = [Circle("0 top", (x, 0.0), radius), Circle("1 top", (0.0, 0.0), 1.1)]
    made = refined(MeshArrays.of_sets(QUADRILATERAL, *arcs(0.1), {}), order=2, circles=given)
    for mesh in (made, gathered(distribute(MPI.COMM_SELF, made))):
        assert len(mesh.notes) == warned
        assert all(
            "'0 top' is drawn on the circle of radius 1 about (0, 0), but" in said
            for said in mesh.notes
        )
    assert (
        len(check_mesh(distribute(MPI.COMM_SELF, made), {"pin": "0", "plate": "1"}, **PAIR))
        == warned
    )


def test_the_circle_of_points():
    angle = np.linspace(0.2, 0.5, 7)
    x = np.array([30.0, -4.0]) + 2.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    centre, radius = circle_through(x)
    np.testing.assert_allclose([*centre, radius], [30, -4, 2], rtol=1e-9)
    assert circle_through(x * [1, 2] + 0.1 * x**2) is None
    assert circle_through(np.column_stack([angle, angle])) is None
    assert circle_through(x[:3]) is None


def bent(kind, order, amount, mirrored=False):
    """One cell, the middle of whose side on y = 0 goes up by ``amount``."""
    nodes = lagrange_element(kind, order).points
    middle = np.isclose(nodes[:, 1], 0) & (nodes[:, 0] > 0) & (nodes[:, 0] < 1)
    x = nodes.copy()
    x[middle, 1] += 4 * amount * x[middle, 0] * (1 - x[middle, 0])
    x[:, 0] *= -1 if mirrored else 1
    return MeshArrays.of_sets(kind, x, np.arange(len(x))[None], {}, {}, {})


def test_a_corner_of_two_sides_on_one_arc_is_a_warning():
    """It is flat, and comes out on either side of zero; quadrature never comes there."""
    for amount, warned in ((0.24, False), (0.248, True), (0.2502, True)):
        mesh = bent(TRIANGLE, 2, amount)
        assert faults(mesh) == []
        said = " ".join(poor_cells(mesh, quality(mesh)))
        assert ("1 cells are distorted, the worst at" in said) == warned
        assert ("not to be trusted" in said) == warned


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("order", [2, 3])
@pytest.mark.parametrize("kind", [TRIANGLE, QUADRILATERAL])
def test_a_side_may_bend_until_the_jacobian_vanishes_at_a_point(kind, order, mirrored):
    """The smallest determinant against a grid of 200 by 200 points, in and beyond the bend that
    turns a cell over."""
    X = (np.stack(np.meshgrid(*[np.linspace(0, 1, 201)] * 2), axis=-1)).reshape(-1, 2)
    X = X[X.sum(axis=1) <= 1 + 1e-12] if kind == TRIANGLE else X
    verdicts = set()
    for amount in np.linspace(-1.23, 1.23, 25):
        mesh = bent(kind, order, amount, mirrored)
        J = np.einsum("jqa,ai->qij", tabulate(kind, order, X)[1:], mesh.x[mesh.cells[0]])
        sampled = np.linalg.det(J) * (-1 if mirrored else 1)
        smallest, largest = smallest_determinants(mesh)
        verdicts.add(sampled.min() > 0)
        assert (smallest[0] > 0) == (sampled.min() > 0)
        assert bool(faults(mesh)) == (sampled.min() < -0.02 * sampled.max())
        if sampled.min() > 0:
            assert largest[0] <= sampled.max() * (1 + 1e-9)
            assert abs(smallest[0] - sampled.min()) < 2e-3 * largest[0]
    assert verdicts == {True, False}


def test_a_fold_between_corners_and_nodes_is_found():
    """Random cells: those with a negative determinant anywhere on a fine grid are refused, and no
    others."""
    rng = np.random.default_rng(1)
    X = (np.stack(np.meshgrid(*[np.linspace(0, 1, 101)] * 2), axis=-1)).reshape(-1, 2)
    hidden = 0
    for kind, order in ((TRIANGLE, 2), (TRIANGLE, 3), (QUADRILATERAL, 2), (QUADRILATERAL, 3)):
        inside = X[X.sum(axis=1) <= 1 + 1e-12] if kind == TRIANGLE else X
        nodes = lagrange_element(kind, order).points
        x = nodes + rng.uniform(-0.35, 0.35, (150, *nodes.shape)) / order
        made = MeshArrays.of_sets(
            kind, x.reshape(-1, 2), np.arange(x.size // 2).reshape(150, -1), {}, {}, {}
        )
        table = tabulate(kind, order, inside)[1:]
        sampled = np.linalg.det(np.einsum("jqa,nai->nqij", table, x)).min(axis=1)
        at_nodes = np.linalg.det(
            np.einsum("jqa,nai->nqij", tabulate(kind, order, nodes)[1:], x)
        ).min(axis=1)
        smallest, largest = smallest_determinants(made)
        assert (np.abs(smallest - sampled) < 2e-3 * largest).all()
        hidden += ((at_nodes > 0) & (smallest <= 0)).sum()
    assert hidden > 20


def test_a_straight_cell_may_not_fold_at_all():
    """However little: no arc excuses it."""
    x = np.array([[0.0, 0], [1, 0], [0, 1], [1, 1]])
    for inward, refused in ((0.505, False), (0.495, True)):
        x[3] = inward
        mesh = MeshArrays.of_sets(QUADRILATERAL, x[[0, 1, 2, 3]], np.arange(4)[None], {}, {}, {})
        assert bool(faults(mesh)) == refused


def test_collapsed_cells_say_so():
    x, cells = grid(2, 1)
    cells[1, 3] = cells[1, 1]
    said = faults(MeshArrays.of_sets(QUADRILATERAL, x, cells, {"plate": np.arange(2)}, {}, {}))[0]
    assert said.startswith(
        "1 cells have a node twice, the first at (0.75, 0.25) in 'plate': a quadrilateral must not"
    )


@pytest.mark.parametrize("mirrored", [False, True])
def test_cells_that_cannot_be_used(mirrored):
    """Folded, flat or there twice; clockwise ones can be."""
    x, cells = grid(2, 2)
    x = x * [-1, 1] if mirrored else x
    made = MeshArrays.of_sets(QUADRILATERAL, x, cells, {}, {}, {})
    assert faults(made) == []
    x[4] = [0.9 * np.sign(x[5, 0]), -0.6]
    assert faults(MeshArrays.of_sets(QUADRILATERAL, x, cells, {}, {}, {}))[0].startswith(
        "2 cells are folded or have no area"
    )
    x, cells = grid(2, 1)
    twice = MeshArrays.of_sets(QUADRILATERAL, x, np.concatenate([cells, cells[:1]]), {}, {}, {})
    assert faults(twice)[0] == "1 cells are there twice, the first at (0.25, 0.5) in 'all'"
    curved = refined(MeshArrays.of_sets(QUADRILATERAL, x, cells, {}, {}, {}), order=2)
    apart = curved.cells.copy()
    bound = curved.cells.copy()
    apart[1, 5] = apart[1, 6]
    bound[0, 4] = bound[1, 1]
    for wrong in (apart, bound):
        assert "do not have all nodes of their common sides in common" in " ".join(
            faults(replace(curved, cells=wrong))
        )
    third = np.concatenate([cells, [[1, 6, 4, 7]]])
    crowded = MeshArrays.of_sets(
        QUADRILATERAL, np.concatenate([x, [[2.0, 0], [2, 1]]]), third, {}, {}, {}
    )
    assert (
        faults(crowded)[0]
        == "1 edges belong to more than two cells, the first at (0.5, 0.5): cells overlap"
    )


X = np.array([1.0, 0.0])
Y = np.array([0.0, 1.0])


def along(direction, *points):
    return np.array(points, dtype=float), np.tile(direction, (len(points), 1))


@pytest.mark.parametrize(
    ("held", "free"),
    [
        ([], ["x", "y", "rotation"]),
        ([along(X, (0, 5))], ["y", "rotation"]),
        ([along(X, (7, 5), (7, 8))], ["y"]),
        ([along(X, (7, 5)), along(Y, (7, 5))], ["rotation"]),
        ([along(X, (7, 5)), along(Y, (7, 5), (8, 5))], []),
        ([along(X, (1e6, 5)), along(Y, (1e6, 5), (1e6 + 1, 5))], []),
    ],
)
def test_motions_that_nothing_holds(held, free):
    assert free_motions({"body": held}) == {"body": free}


def test_a_body_of_revolution_moves_along_its_axis_alone():
    """A radial support holds nothing: the hoop strain does."""
    radial = along(X, (1, 0), (1, 5))
    axial = along(Y, (0, 0))
    assert free_motions({"ring": []}, (), AXISYMMETRIC) == {"ring": ["y"]}
    assert free_motions({"ring": [radial]}, (), AXISYMMETRIC) == {"ring": ["y"]}
    assert free_motions({"ring": [axial]}, (), AXISYMMETRIC) == {"ring": []}
    pressed = [("punch", "block", np.array([[1.0, 0.0]]), Y[None])]
    held = {"punch": [], "block": [axial]}
    assert free_motions(held, pressed, AXISYMMETRIC) == {"punch": [], "block": []}


def test_nodes_beyond_the_axis_are_told():
    """Rounding is not: nodes on the axis may come out a little below zero."""
    x, _ = grid(2, 2, corner=(0.0, 0.0))
    assert beyond_axis(x) == []
    assert beyond_axis(x - [1e-12, 0]) == []
    (said,) = beyond_axis(x - [0.7, 0])
    assert said.startswith("6 nodes have a negative radius, the farthest at (-0.7, 0)")


def test_a_short_clamp_beside_a_long_one_holds():
    long = np.random.default_rng(1).uniform(-500, 500, (3000, 2))
    wide = [(long, np.tile(d, (3000, 1))) for d in (X, Y)]
    narrow = [along(X, (1000, 0)), along(Y, (1000, 0), (1000.1, 0))]
    assert free_motions({"a": wide, "b": narrow}) == {"a": [], "b": []}


def test_bodies_that_hold_each_other():
    """A pin in a bushing may turn, a tied one not; what a chain hangs on holds all of it."""
    angle = np.linspace(0, 6, 9)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    clamp = [along(X, (5, 0), (5, 1)), along(Y, (5, 0))]
    held = {"pin": [], "bushing": [], "plate": clamp}
    smooth = [("pin", "bushing", circle, circle), ("bushing", "plate", 2 * circle, circle)]
    assert free_motions(held, smooth) == {"pin": ["rotation"], "bushing": ["rotation"], "plate": []}
    tie = [("pin", "bushing", circle, np.tile(d, (9, 1))) for d in (X, Y)]
    assert free_motions(held, [*smooth, *tie])["pin"] == ["rotation"]
    assert (
        free_motions(held | {"pin": [along(Y, (0, 0), (1, 0))]}, [*smooth, *tie])["bushing"] == []
    )
    loose = free_motions({"pin": [], "plate": clamp}, smooth[:0])
    assert loose["pin"] == ["x", "y", "rotation"]


@pytest.mark.mpi
def test_checks_see_the_mesh_of_all_ranks(comm):
    mesh = distribute(comm, MeshArrays.of_sets(QUADRILATERAL, *TWO, {}) if comm.rank == 0 else None)
    whole = gathered(mesh)
    assert (whole is None) or len(whole.cells) == 10


REGULAR = {
    TRIANGLE: [[0, 0], [1, 0], [0.5, 0.75**0.5]],
    QUADRILATERAL: [[0, 0], [1, 0], [0, 1], [1, 1]],
    CellType.tetrahedron: [[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]],
    CellType.hexahedron: [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)],
}


def of_one_cell(kind, x):
    none = np.zeros(0, dtype=np.int64)
    cells = np.arange(len(x))[None]
    return MeshArrays(np.array(x, dtype=float), kind, cells, np.zeros(1), none, none)


@pytest.mark.parametrize("kind", REGULAR)
def test_regular_cells_of_any_size_are_the_best_and_flat_ones_are_less_round(kind):
    x = np.array(REGULAR[kind])
    for size in (1.0, 1e-6):
        np.testing.assert_allclose(quality(of_one_cell(kind, size * x)), 1.0)
    flat = quality(of_one_cell(kind, x * np.append(np.ones(x.shape[1] - 1), 0.01)))
    assert flat.roundness[0] < 0.15
    assert flat.jacobian[0] == pytest.approx(1.0)


def test_a_bent_side_lowers_the_jacobian_as_far_as_a_closed_form_says():
    """The middle of the side y = 0 of a right triangle is moved into it by h: the determinant of
    the map is 1 - 4 h X."""
    h = 0.1
    x = [[0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0.5], [0.5, h]]
    assert quality(of_one_cell(TRIANGLE, x)).jacobian[0] == pytest.approx(1 - 4 * h)


def _quarter_sleeves(gmsh) -> None:
    """Two quarters of tubes, one in the other, whose surfaces lie on one cylinder along z."""
    cad = gmsh.model.occ
    for name, inner, outer in (("sleeve", 4.0, 10.0), ("hub", 10.0, 20.0)):
        tube = [(3, cad.addCylinder(0, 0, 0, 0, 0, 3, outer, angle=np.pi / 2))]
        bore = [(3, cad.addCylinder(0, 0, 0, 0, 0, 3, inner, angle=np.pi / 2))]
        tube, _ = cad.cut(tube, bore)
        cad.synchronize()
        gmsh.model.addPhysicalGroup(3, [tag for _, tag in tube], name=name)
        sides = [tag for _, tag in gmsh.model.getBoundary(tube, oriented=False)]
        round_ones = [tag for tag in sides if gmsh.model.getType(2, tag) == "Cylinder"]
        round_ones.sort(key=lambda tag: gmsh.model.occ.getMass(2, tag))
        for at, tag in zip(("inside", "outside"), round_ones, strict=True):
            gmsh.model.addPhysicalGroup(2, [tag], name=f"{name} {at}")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 3.0)
    gmsh.model.mesh.generate(3)


def test_straight_sides_along_a_cylinder_have_no_sagitta():
    """Curved cells of two tubes without clearance, as for a press fit: sides along the axis are
    straight."""
    along_z = {"centre": (0.0, 0.0, 0.0), "radius": 10.0, "axis": (0.0, 0.0, 1.0)}
    circles = [Circle(facets=name, **along_z) for name in ("sleeve outside", "hub inside")]
    mesh = gmsh_to_mesh(MPI.COMM_SELF, _quarter_sleeves, circles)
    bodies = {"sleeve": "sleeve", "hub": "hub"}
    assert not check_mesh(mesh, bodies, pairs=[("sleeve outside", "hub inside")])


def test_a_strip_of_flat_facets_is_no_arc():
    """Its corners, on two lines, lie on any cylinder along it, of which its sides were straight."""
    made = boxes(
        {"low": (0, 0, 0, 2, 1, 0.5), "high": (0, 1, 0, 2, 1, 0.5)}, 0.5, "hexahedra", MPI.COMM_SELF
    )
    bodies = {"low": "low", "high": "high"}
    assert not check_mesh(made, bodies, pairs=[("low top", "high bottom")])

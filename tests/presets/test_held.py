"""What is said of a general scene on a mesh file that cannot be right."""

import re
from pathlib import Path

import gmsh
import pytest
from mpi4py import MPI

from archord.geometry.curve import ProjectionError
from archord.measures.account import Account
from archord.presets.account import account_of
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_any
from archord.solver.path import system

LUG = Path(__file__).parents[2] / "scenes" / "lug.toml"
BALL = LUG.with_name("ball.toml")
STEEL = {"E": 210000.0, "nu": 0.3}


@pytest.fixture(scope="module")
def squares(tmp_path_factory):
    """Two squares of 10 mm, one on the other, their sides named by bottom, right, top and left."""
    path = str(tmp_path_factory.mktemp("mesh") / "squares.msh")
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    for k, name in enumerate(("lower", "upper")):
        face = gmsh.model.occ.addRectangle(0, 10 * k, 0, 10, 10)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name=name)
        for side, (_, line) in zip(
            "brtl", gmsh.model.getBoundary([(2, face)], oriented=False), strict=True
        ):
            gmsh.model.addPhysicalGroup(1, [line], name=f"{name} {side}")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 5)
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)  # as archord's own meshes
    gmsh.write(path)
    gmsh.finalize()
    return path


def account(file: str, **changes) -> Account:
    data = {
        "mesh": {},
        "body": [{"name": "lower"} | STEEL, {"name": "upper"} | STEEL],
        "interaction": [{"name": "contact", "surfaces": ["lower t", "upper b"]}],
        "support": [
            {"name": "base", "on": "lower b", "fixed": ["x", "y"]},
            {"name": "wall", "on": "upper l", "fixed": ["x"]},
        ],
        "load": [{"name": "press", "on": "upper t", "direction": "y", "displacement": -0.01}],
    }
    data["mesh"] = {"file": file, **changes.pop("mesh", {})}
    return account_of(parse_any(data | changes), MPI.COMM_SELF)


def test_two_squares_are_no_fault(squares):
    assert account(squares).warnings == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"support": []},
            "'lower': it is free in x; add a ..support.. to it, or to a body that it touches: "
            "'upper'",
        ),
        (
            {"support": [{"name": "base", "on": "lower b", "fixed": ["y"]}]},
            "nothing holds the body 'lower': it is free in x",
        ),
        (
            {"support": [{"name": "base", "on": "lower b", "fixed": ["x", "y"]}]},
            "nothing holds the body 'upper': it is free in x; add a ..support...$",
        ),
        (
            {"body": [{"name": "lower"} | STEEL]},
            "the facet set .upper .. is of no body: give that body, too[.]$",
        ),
        (
            {"interaction": [{"name": "c", "surfaces": ["lower t", "upper bb"]}]},
            "'upper bb' .did you mean 'upper b'",
        ),
        ({"units": {"length": "mm"}, "mesh": {"scale": 0.001}}, "large; is it in metres"),
        (
            {
                "analysis": {"plane": "axisymmetric"},
                "load": [{"name": "p", "on": "lower l", "pressure": 1.0}],
            },
            "the pressure 'p' is on 'lower l', which lies on the axis x = 0 and has no area there",
        ),
        (
            {"load": [{"name": "p", "on": "top", "direction": "y", "displacement": 1.0}]},
            "there is no .* 'top'",
        ),
    ],
)
def test_a_fault_is_said(squares, changes, said):
    with pytest.raises(InputError, match=said) as fault:
        account(squares, **changes)
    assert len(str(fault.value).splitlines()) == 1


def test_surfaces_that_find_no_partners_are_refused(squares, monkeypatch):
    """Two sides of a quarter of a ball, say: it was a traceback."""

    def lost(*_):
        raise ProjectionError("1 contact point found no closest point, the first at (0, 10)")

    monkeypatch.setattr(system, "Interface", lost)
    said = 'interaction "contact": its surfaces do not lie opposite each other: 1 contact point'
    with pytest.raises(InputError, match=said):
        account(squares)


def test_a_coupling_may_take_a_point():
    """Here the centre of a pin, which is a set of points."""
    data = load_scene(LUG).general()
    data["coupling"] = [{"name": "grip", "facets": "centre", "point": [0.1, 0.0]}]
    data["support"] += [{"name": "turn", "on": "grip", "fixed": ["y", "rotation"]}]
    data["load"] = [{"name": "pull", "on": "grip", "direction": "x", "displacement": 0.1}]
    assert account_of(parse_any(data), MPI.COMM_SELF).warnings == []


@pytest.mark.parametrize("turned", [False, True])
def test_a_hinge_does_not_hold_a_rotation(squares, turned):
    """A reference point that is held turns its body, unless something else keeps it, or it is
    itself turned."""
    hinge = {"name": "hinge", "facets": "lower b", "point": [5.0, 0.0]}
    supports = [
        {"name": "h", "on": "hinge", "fixed": ["x", "y"]},
        {"name": "u", "on": "upper b", "fixed": ["x", "y"]},
    ]
    turn = {"displacement": 0.01} if turned else {"force": 10.0}
    load = [{"name": "turn", "on": "hinge", "direction": "rotation"} | turn]
    given = {"interaction": [], "coupling": [hinge], "support": supports, "load": load}
    if turned:
        assert account(squares, **given).warnings == []
    else:
        with pytest.raises(
            InputError, match="nothing holds the body 'lower': it is free in rotation"
        ):
            account(squares, **given)


def test_an_overlap_that_is_not_drawn_is_told(squares):
    """Here with a disc above the upper square; drawn as it says, it is not."""
    disc = {
        "name": "disc",
        "surfaces": ["upper t"],
        "rigid": {"centre": [5.0, 20020.05], "radius": 20000.0},
    }
    load = [{"name": "press", "on": "disc", "direction": "y", "displacement": -0.1}]
    tie = {"name": "contact", "surfaces": ["lower t", "upper b"], "law": "tied"}
    (said,) = account(squares, interaction=[tie, disc | {"overlap": 0.01}], load=load).warnings
    assert said == "the surfaces of 'disc' are drawn 0.05 apart, but its overlap is 0.01"
    disc["rigid"]["centre"][1] = 20019.99
    assert account(squares, interaction=[tie, disc | {"overlap": 0.01}], load=load).warnings == []


@pytest.mark.parametrize(("at", "single"), [("centre", True), ("diameter", False)])
def test_a_load_on_a_single_point_is_told(at, single):
    """Without a word the displacement of a pin's centre was a third larger than its diameter's, and
    grew with every mesh: from 0.1308 on elements of 2 mm to 0.1351 on elements of 0.25 mm."""
    scene = {
        "lug": {"radius": 10.0, "clearance": 0.1, "width": 40.0, "element_size": 5.0},
        "pin": STEEL,
        "plate": STEEL,
        "load": {"force": 1e3, "at": at},
    }
    warnings = account_of(parse_any(scene), MPI.COMM_SELF).warnings
    assert ["'pull' loads the single point 'centre'" in said for said in warnings] == [
        True
    ] * single


def test_a_file_that_is_not_there(tmp_path):
    """The scene, the key and where the file was looked for."""
    with pytest.raises(InputError, match=r'^scene: mesh\.file = "nowhere.msh" must be a file that'):
        account("nowhere.msh")
    scene = tmp_path / "scene.toml"
    scene.write_text(BALL.read_text(encoding="utf-8"), encoding="utf-8")
    said = f'{scene}: mesh.file = "{tmp_path / "ball.msh"}" must be a file that is there.'
    with pytest.raises(InputError, match=re.escape(said)):
        account_of(load_scene(scene), MPI.COMM_SELF)


def test_a_tie_holds_in_both_directions(squares):
    tie = [{"name": "tie", "surfaces": ["lower t", "upper b"], "law": "tied"}]
    support = [{"name": "base", "on": "lower b", "fixed": ["x", "y"]}]
    assert account(squares, interaction=tie, support=support).warnings == []


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Makes two squares of 10 mm, of which the upper one is drawn this far above the lower one."""
    folder = tmp_path_factory.mktemp("drawn")

    def mesh(gap: float) -> str:
        path = str(folder / f"{gap}.msh")
        gmsh.initialize()
        gmsh.option.setNumber("General.Terminal", 0)
        for k, name in enumerate(("lower", "upper")):
            face = gmsh.model.occ.addRectangle(0, k * (10 + gap), 0, 10, 10)
            gmsh.model.occ.synchronize()
            gmsh.model.addPhysicalGroup(2, [face], name=name)
            for side, (_, line) in zip(
                "brtl", gmsh.model.getBoundary([(2, face)], oriented=False), strict=True
            ):
                gmsh.model.addPhysicalGroup(1, [line], name=f"{name} {side}")
        gmsh.option.setNumber("Mesh.MeshSizeMax", 5)
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.model.mesh.generate(2)
        gmsh.write(path)
        gmsh.finalize()
        return path

    return mesh


def fit(file: str, **fits) -> Account:
    return account(file, interaction=[{"name": "fit", "surfaces": ["lower t", "upper b"]} | fits])


@pytest.mark.parametrize(
    ("gap", "fits", "said"),
    [
        (
            -0.1,
            {"interference": 0.1},
            "'fit' are drawn 0.1 deep in each other, and its interference of 0.1 would push",
        ),
        (-0.1, {"interference": 0.1, "overlap": 0.1}, "give overlap = 0.1 alone"),
        (-0.1, {"interference": 0.06, "overlap": 0.1}, "give overlap = 0.1 alone"),
        (
            -0.1,
            {},
            "'lower' lies 0.1 deep in the body 'upper' .* give their interaction overlap = 0.1",
        ),
    ],
)
def test_a_fit_is_not_counted_twice(drawn, gap, fits, said):
    with pytest.raises(InputError, match=said):
        fit(drawn(gap), **fits)


@pytest.mark.parametrize(
    ("gap", "fits", "said"),
    [
        (-0.1, {"overlap": 0.1}, []),
        (0.0, {"interference": 0.1}, []),
        (-0.1, {"overlap": 0.1, "interference": 0.02}, []),
        (-0.06, {"overlap": 0.1}, ["drawn 0.06 deep in each other, but its overlap is 0.1"]),
        (
            -0.02,
            {"interference": 0.1},
            ["drawn 0.02 deep in each other, which adds to its interference of 0.1"],
        ),
        (
            0.04,
            {"interference": 0.1},
            ["drawn 0.04 apart: of its interference of 0.1 only 0.06 presses"],
        ),
    ],
)
def test_a_fit_that_is_not_as_drawn_is_said(drawn, gap, fits, said):
    warnings = fit(drawn(gap), **fits).warnings
    assert len(warnings) == len(said)
    assert all(part in warning for part, warning in zip(said, warnings, strict=True))


def by_force_on_an_edge(order):
    parts = [
        {"name": "base", "on": "lower b", "fixed": ["x", "y"]},
        {"name": "wall", "on": "upper l", "fixed": ["x"]},
    ]
    pull = {"name": "pull", "on": "upper b", "direction": "x", "force": 1.0}
    press = {"name": "press", "on": "upper t", "direction": "y", "displacement": -0.01}
    return {"support": parts[::order], "load": [pull, press][::order]}


@pytest.mark.parametrize("order", [1, -1])
def test_a_force_on_an_edge_that_a_support_ends_is_refused(squares, order):
    said = (
        r"'wall' .on 'upper l'. fixes the node at .0, 10. in x, which 'pull' .on 'upper b'. "
        r"moves together with"
    )
    with pytest.raises(InputError, match=said):
        account(squares, **by_force_on_an_edge(order))


@pytest.mark.parametrize("order", [1, -1])
def test_a_displacement_of_a_body_leaves_its_support_at_rest(squares, order):
    loads = [{"name": "all", "on": "upper", "direction": "x", "displacement": 0.1}]
    loads += [{"name": "press", "on": "upper t", "direction": "y", "displacement": -0.01}]
    (said,) = account(squares, load=loads[::order]).warnings
    assert said.startswith(
        "'wall' (on 'upper l') fixes nodes that 'all' (on 'upper') would move in x, as at (0, 10)"
    )


def test_a_displacement_beyond_the_mesh_is_refused_before_the_solve(squares):
    far = [{"name": "press", "on": "upper t", "direction": "y", "displacement": [-0.01, -20.5]}]
    said = "the load 'press' moves 'upper t' by -20.5, but the whole mesh is 20 large"
    with pytest.raises(InputError, match=said):
        account(squares, load=far)
    assert account(squares, load=far, analysis={"strain": "large"})


@pytest.mark.parametrize(
    ("friction", "asked"), [(0.3, False), (1.5, False), (15.0, True), (1e3, False)]
)
def test_friction_in_per_cent_is_asked_about(squares, friction, asked):
    warnings = fit(squares, friction=friction).warnings
    assert [warning.endswith("is it in per cent? Then give 0.15") for warning in warnings] == [
        True
    ][:asked]


def test_a_turn_about_a_held_point_moves_no_farther_than_the_mesh_is_large(squares):
    """A turn about a point that may move turns about the facets, wherever the point lies."""
    far = {
        "coupling": [{"name": "arm", "facets": "upper t", "point": [1005.0, 20.0]}],
        "load": [{"name": "turn", "on": "arm", "direction": "rotation", "displacement": 0.05}],
    }
    held = {"name": "pivot", "on": "arm", "fixed": ["x", "y"]}
    base = {"name": "base", "on": "lower b", "fixed": ["x", "y"]}
    free = {"name": "pivot", "on": "arm", "fixed": ["x"]}
    account(squares, support=[base, free], **far)
    with pytest.raises(
        InputError,
        match="the load 'turn' turns 'arm' about a point so far away that it moves by 49",
    ):
        account(squares, support=[base, held], **far)


def test_a_force_on_a_bent_edge_is_told_to_stiffen_it(tmp_path):
    """It moves by one displacement. A force on a straight edge changes nothing that it does not
    say."""
    path = str(tmp_path / "disc.msh")
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    ring, _ = gmsh.model.occ.cut(
        [(2, gmsh.model.occ.addRectangle(-20, -20, 0, 40, 40))],
        [(2, gmsh.model.occ.addDisk(0, 0, 0, 10, 10))],
    )
    gmsh.model.occ.synchronize()
    edges = {
        line: gmsh.model.occ.getCenterOfMass(1, line)
        for _, line in gmsh.model.getBoundary(ring, oriented=False)
    }
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in ring], name="plate")
    for name, (x, y) in {"bore": (0, 0), "left": (-20, 0), "right": (20, 0)}.items():
        line = next(line for line, at in edges.items() if abs(at[0] - x) + abs(at[1] - y) < 1e-6)
        gmsh.model.addPhysicalGroup(1, [line], name=name)
    gmsh.model.mesh.generate(2)
    gmsh.write(path)
    gmsh.finalize()
    parts = {
        "body": [{"name": "plate"} | STEEL],
        "interaction": [],
        "support": [{"name": "clamp", "on": "left", "fixed": ["x", "y"]}],
    }
    said = {
        on: account(
            path, **parts, load=[{"name": "pull", "on": on, "direction": "x", "force": 1.0}]
        ).warnings
        for on in ("right", "bore")
    }
    assert said["right"] == []
    assert said["bore"][0].startswith(
        "the force 'pull' moves all of 'bore' by one displacement in x, and that edge is"
    )

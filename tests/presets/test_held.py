"""What is said of a general scene on a mesh file that cannot be right."""

import gmsh
import pytest
from mpi4py import MPI

from archord.presets.general_account import GeneralAccount
from archord.scene.errors import InputError
from archord.scene.file import parse_any

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
        for side, (_, line) in zip("brtl", gmsh.model.getBoundary([(2, face)], oriented=False), strict=True):
            gmsh.model.addPhysicalGroup(1, [line], name=f"{name} {side}")
    gmsh.option.setNumber("Mesh.MeshSizeMax", 5)
    gmsh.model.mesh.generate(2)
    gmsh.write(path)
    gmsh.finalize()
    return path


def account(file: str, **changes) -> GeneralAccount:
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
    return GeneralAccount(parse_any(data | changes), MPI.COMM_SELF)


def test_two_squares_are_no_fault(squares):
    assert account(squares).warnings() == []


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"support": []},
            "'lower': it is free in x; add a ..support.. to it, or to a body that it touches: 'upper'",
        ),
        (
            {"support": [{"name": "base", "on": "lower b", "fixed": ["y"]}]},
            "nothing holds the body 'lower': it is free in x",
        ),
        (
            {"support": [{"name": "base", "on": "lower b", "fixed": ["x", "y"]}]},
            "nothing holds the body 'upper': it is free in x; add a ..support...$",
        ),
        ({"body": [{"name": "lower"} | STEEL]}, "the facet set .upper .. is of no body; is one missing.$"),
        ({"interaction": [{"name": "c", "surfaces": ["lower t", "upper bb"]}]}, "'upper bb' .did you mean 'upper b'"),
        ({"units": {"length": "mm"}, "mesh": {"scale": 0.001}}, "large; is it in metres"),
        ({"load": [{"name": "p", "on": "top", "direction": "y", "displacement": 1.0}]}, "there is no .* 'top'"),
    ],
)
def test_a_fault_is_said(squares, changes, said):
    with pytest.raises(InputError, match=said) as fault:
        account(squares, **changes)
    assert len(str(fault.value).splitlines()) == 1


@pytest.mark.parametrize("turned", [False, True])
def test_a_hinge_does_not_hold_a_rotation(squares, turned):
    """A reference point that is held turns its body, unless something else keeps it, or it is itself turned."""
    hinge = {"name": "hinge", "facets": "lower b", "point": [5.0, 0.0]}
    supports = [{"name": "h", "on": "hinge", "fixed": ["x", "y"]}, {"name": "u", "on": "upper b", "fixed": ["x", "y"]}]
    turn = {"displacement": 0.01} if turned else {"force": 10.0}
    load = [{"name": "turn", "on": "hinge", "direction": "rotation"} | turn]
    given = {"interaction": [], "coupling": [hinge], "support": supports, "load": load}
    if turned:
        assert account(squares, **given).warnings() == []
    else:
        with pytest.raises(InputError, match="nothing holds the body 'lower': it is free in rotation"):
            account(squares, **given)


def test_an_overlap_that_is_not_drawn_is_told(squares):
    """Here with a disc above the upper square; drawn as it says, it is not."""
    disc = {"name": "disc", "surfaces": ["upper t"], "rigid": {"centre": [5.0, 20020.05], "radius": 20000.0}}
    load = [{"name": "press", "on": "disc", "direction": "y", "displacement": -0.1}]
    tie = {"name": "contact", "surfaces": ["lower t", "upper b"], "law": "tied"}
    (said,) = account(squares, interaction=[tie, disc | {"overlap": 0.01}], load=load).warnings()
    assert said == "the surfaces of 'disc' are drawn 0.05 apart, but its overlap is 0.01"
    disc["rigid"]["centre"][1] = 20019.99
    assert account(squares, interaction=[tie, disc | {"overlap": 0.01}], load=load).warnings() == []


def test_a_file_that_is_not_there():
    with pytest.raises(InputError, match=r"nowhere.msh: No such file"):
        account("nowhere.msh")


def test_a_tie_holds_in_both_directions(squares):
    tie = [{"name": "tie", "surfaces": ["lower t", "upper b"], "law": "tied"}]
    support = [{"name": "base", "on": "lower b", "fixed": ["x", "y"]}]
    assert account(squares, interaction=tie, support=support).warnings() == []

"""General scenes in space: what each word does, on two blocks of tetrahedra in a file."""

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.presets.account import account_of
from archord.presets.mesh_family import coarser
from archord.presets.problem import general_problem
from archord.report.errors import InputError
from archord.scene.file import parse_any

E = 1000.0
SOLID = {"E": E, "nu": 0.0}
SIDES = {"left": (0, 0.0), "front": (1, 0.0), "base": (2, 0.0), "lid": (2, 2.0)}
ON_EACH_OTHER = {"name": "joint", "surfaces": ["upper bottom", "lower top"]}
AXES = [
    {"name": side, "on": side, "fixed": [axis]}
    for side, axis in (("left", "x"), ("front", "y"), ("base", "z"))
]
CLAMP = {"name": "clamp", "on": "base", "fixed": ["x", "y", "z"]}
PRESS = {"name": "press", "on": "lid", "direction": "z", "displacement": -0.002}
BALL = {"centre": [0.4, 0.5, 5.0], "radius": 3.0}
ROLLER = {"name": "roller", "surfaces": ["lid"], "rigid": BALL | {"axis": [1.0, 0.1, 0.0]}}
ROLLED = {"support": [CLAMP], "load": [PRESS | {"on": "roller", "displacement": -0.02}]}


def boxes(sizes) -> None:
    """Two cubes "lower" and "upper" of edge 1, one on the other, with elements of these sizes."""
    occ = gmsh.model.occ
    volumes = [occ.addBox(0, 0, k, 1, 1, 1) for k in (0, 1)]
    occ.synchronize()
    walls: dict[str, list[int]] = {name: [] for name in SIDES}
    for name, volume, size in zip(("lower", "upper"), volumes, sizes, strict=True):
        gmsh.model.addPhysicalGroup(3, [volume], name=name)
        of_volume = gmsh.model.getBoundary([(3, volume)], oriented=False)
        gmsh.model.mesh.setSize(gmsh.model.getBoundary([(3, volume)], recursive=True), size)
        for dim, face in of_volume:
            middle = gmsh.model.occ.getCenterOfMass(dim, face)
            for wall, (axis, at) in SIDES.items():
                if abs(middle[axis] - at) < 1e-9:
                    walls[wall].append(face)
            if abs(middle[2] - 1.0) < 1e-9:
                end = "top" if name == "lower" else "bottom"
                gmsh.model.addPhysicalGroup(2, [face], name=f"{name} {end}")
    for wall, faces in walls.items():
        gmsh.model.addPhysicalGroup(2, faces, name=wall)


@pytest.fixture(scope="module")
def mesh(tmp_path_factory) -> str:
    """The file of the blocks' mesh."""
    path = str(tmp_path_factory.mktemp("mesh") / "blocks.msh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        boxes((0.5, 0.4))
        gmsh.model.mesh.generate(3)
        gmsh.write(path)
    finally:
        gmsh.finalize()
    return path


def table(mesh, **changes):
    """The table of a scene, with ``changes``."""
    return {
        "mesh": {"file": mesh},
        "body": [{"name": "lower"} | SOLID, {"name": "upper"} | SOLID],
        "interaction": [ON_EACH_OTHER],
        "support": AXES,
        "load": [PRESS],
        "path": {"steps": 1},
    } | changes


def solved(given):
    """The account of a scene, at the end of its path."""
    account = account_of(parse_any(given), MPI.COMM_SELF)
    account.system.solve(account.scene.targets)
    return account


@pytest.mark.parametrize("analysis", [{}, {"plane": "space"}])
def test_a_mesh_of_solids_makes_a_scene_of_space(mesh, analysis):
    account = solved(table(mesh, analysis=analysis))
    assert account.scene.analysis.plane == "space"
    assert account.system.reaction("base")[2] == pytest.approx(0.001 * E, rel=1e-3)
    assert account.system.drive_force("press") == pytest.approx(-0.001 * E, rel=1e-3)
    assert account.warnings == []


def test_one_rank_alone_tells_the_facts(mesh, monkeypatch):
    """Of a part with mirrors, too, for which all ranks look before."""
    account = account_of(parse_any(table(mesh, analysis={"symmetry": 8})), MPI.COMM_SELF)
    monkeypatch.setattr("archord.solver.path.mirrors._ends", None)
    mirrors = account.facts()["model"]["mirrors"]
    assert [axis for axis, _ in mirrors] == [0, 1, 2]


POINT = {"name": "crank", "facets": "lid", "point": [0.5, 0.5, 2.0]}
TURN = {"name": "turn", "on": "crank", "direction": "rotation y", "displacement": 1e-4}
HELD = {"name": "held", "on": "crank", "fixed": ["x", "y", "z", "rotation x", "rotation z"]}
TIED = ON_EACH_OTHER | {"law": "tied"}


@pytest.mark.parametrize("kind", ["rigid", "distributing"])
def test_a_coupling_turns_about_an_axis(mesh, kind):
    """A tied column with its end turned and held: M = 4 E I theta / L, less what shear takes."""
    given = table(
        mesh,
        interaction=[TIED],
        coupling=[POINT | {"kind": kind}],
        support=[CLAMP, HELD],
        load=[TURN],
    )
    account = solved(given)
    stiffness = 4 * E / 12 / 2
    shear = 12 * E / 12 / (5 / 6 * E / 2 * 4)
    moment = stiffness * (4 + shear) / (4 * (1 + shear)) * 1e-4
    assert account.system.drive_force("turn") == pytest.approx(moment, rel=0.1)
    again = parse_any(account.scene.general())
    assert again == account.scene


FLAT = {
    "support": [{"name": "wall", "on": "left", "fixed": ["x", "y"]}],
    "load": [PRESS | {"direction": "y"}],
}
FAULTS = {
    'analysis.plane = "strain" must be "space" for a mesh of solids': FLAT
    | {"analysis": {"plane": "strain"}},
    'analysis.plane = "axisymmetric" must be "space"': FLAT
    | {"analysis": {"plane": "axisymmetric"}},
    'support "base".fixed = ..z.. must be among x, y, rotation in a plane': {
        "analysis": {"plane": "stress"}
    },
    "analysis.thickness = 2.0 is for planes: bodies in space are drawn whole": {
        "analysis": {"thickness": 2.0}
    },
    'load "turn".direction = "rotation" must be among x, y, z, rotation x': {
        "coupling": [POINT],
        "load": [TURN | {"direction": "rotation"}],
    },
    'coupling "crank".point = .* must have 3 numbers in space': {
        "coupling": [POINT | {"point": [0.0, 0.0]}],
        "load": [TURN],
    },
    'interaction "roller".rigid.centre = .* must have 3 numbers in space': {
        "interaction": [ON_EACH_OTHER, ROLLER | {"rigid": {"centre": [0.0, 3.0], "radius": 1.0}}]
    },
    'interaction "roller".rigid.axis = .* must not be zero': {
        "interaction": [ON_EACH_OTHER, ROLLER | {"rigid": BALL | {"axis": [0.0, 0.0, 0.0]}}]
    },
    'load "press".direction = "rotation x" must be "x", "y" or "z": .roller. is no coupling': {
        "interaction": [ON_EACH_OTHER, ROLLER],
        "load": [PRESS | {"on": "roller", "direction": "rotation x"}],
    },
    'load "weight".core.centre = .* must have 3 numbers in space': {
        "load": [
            {"name": "weight", "on": "upper", "direction": "z", "force": 1.0}
            | {"core": {"centre": [0.0, 0.0], "radius": 1.0}}
        ]
    },
    'support "z".fixed = .* must be "x", "y" or "z": .lid. is no coupling': {
        "support": [*AXES, {"name": "z", "on": "lid", "fixed": ["rotation z"]}]
    },
    'load "press".on = "lid" must not be held in x and y and z: a pressure moves nothing there': {
        "support": [CLAMP, {"name": "z", "on": "lid", "fixed": ["x", "y", "z"]}],
        "load": [{"name": "press", "on": "lid", "pressure": 1.0}],
    },
    "nothing holds the body 'upper': it is free in z": {
        "interaction": [],
        "load": [{"name": "press", "on": "lid", "pressure": 1.0}],
    },
}


@pytest.mark.parametrize("said", FAULTS)
def test_what_does_not_go_in_space_is_said_in_a_sentence(mesh, said):
    with pytest.raises(InputError, match=said):
        account_of(parse_any(table(mesh, **FAULTS[said])), MPI.COMM_SELF)


def test_only_springs_keep_a_smooth_block_from_sliding(mesh):
    """What is warned of; friction keeps it, too."""
    base = {"support": [CLAMP], "load": [PRESS]}
    warned = account_of(parse_any(table(mesh, **base)), MPI.COMM_SELF).warnings
    assert any("body 'upper' from sliding along x and y" in said for said in warned)
    rough = [ON_EACH_OTHER | {"friction": 0.3}]
    account = account_of(parse_any(table(mesh, interaction=rough, **base)), MPI.COMM_SELF)
    assert not any("sliding" in said for said in account.warnings)


RUNS = {
    "large strain": {"analysis": {"strain": "large"}},
    "a metal": {"body": [{"name": "lower", "material": "S355"}, {"name": "upper"} | SOLID]},
    "back stresses": {
        "body": [
            {"name": "lower"} | SOLID,
            {"name": "upper"} | SOLID | {"yield_stress": 1.0, "back_stresses": [[10.0, 0.0]]},
        ]
    },
    "one side": {"interaction": [ON_EACH_OTHER | {"integrated": "lower top"}]},
    "reference": {"analysis": {"kinematics": "reference"}},
    "a cylinder": ROLLED | {"interaction": [TIED, ROLLER | {"friction": 0.1}]},
    "a ball": ROLLED | {"interaction": [TIED, ROLLER | {"rigid": BALL}]},
    "a coupling": {
        "coupling": [POINT],
        "load": [TURN, PRESS | {"on": "crank"}],
        "support": [CLAMP],
    },
}


@pytest.mark.parametrize("words", RUNS)
def test_a_run_in_space_goes_on_from_its_folder(mesh, words, tmp_path):
    """Its scene, in words, is the scene that was solved."""
    given = table(mesh, path={"steps": 2}, **RUNS[words])
    run = archord.solve(given, tmp_path / "run")
    assert run.status == "done"
    assert run.scene.analysis.plane == "space"
    again = archord.solve(run.scene, tmp_path / "again")
    np.testing.assert_allclose(again.history["press force"], run.history["press force"], rtol=1e-9)


def test_a_problem_from_python_is_told_in_words(tmp_path):
    """Which solve to the same forces; a support holds all axes by default."""
    problem = archord.Problem(
        archord.boxes({"block": (0.0, 0.0, 0.0, 2.0, 1.0, 1.0)}, size=0.5),
        [archord.Body("block", archord.Elastic(E, 0.3))],
        supports=[archord.Support("block left")],
        couplings=[archord.Coupling("end", "block right", (2.0, 0.5, 0.5), "distributing")],
        loads=[
            archord.Load("bend", on="end", direction="rotation y", displacement=0.01),
            archord.Load("weight", "block", "z", force=-1.0, core=((1.0, 0.5, 0.5), 0.6)),
        ],
        steps=1,
    )
    run = archord.solve(problem, tmp_path / "run")
    assert run.scene.support[0].fixed == ["x", "y", "z"]
    again = archord.solve(run.scene, tmp_path / "again")
    for column in ("bend force", "block left z", "block left moment y", "weight displacement"):
        assert again.columns[column] == pytest.approx(run.columns[column], rel=1e-9)


def test_guesses_come_from_smaller_elements_where_the_largest_are_folded():
    """A clevis lost its coarse start without a word, and took three times as many iterations."""
    keys = {"clevis.element_size": 0.85, "clevis.growth": 0.3}
    scene = archord.load_scene("scenes/clevis_in_space.toml", keys)
    with pytest.raises(InputError, match="folded"):
        general_problem(coarser(scene), MPI.COMM_SELF)
    problem = general_problem(scene, MPI.COMM_SELF)
    fine, coarse = (len(p.mesh.cells.values) for p in (problem, problem.coarser()))
    assert 0 < 4 * coarse < fine

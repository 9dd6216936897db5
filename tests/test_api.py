"""archord from Python: scenes, runs, and an import that costs nothing."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import archord
from archord.commands.progress import Progress
from archord.report.errors import InputError

SCENE = str(Path(__file__).parents[1] / "scenes" / "elastic_pin.toml")
COARSE = {"joint.relative_element_size": 0.2, "load.steps": 2}
SECTIONS = {
    "joint": {"radius": 1.0, "clearance": 0.005, "element_size": 0.2},
    "pin": {"rigid": True},
    "block": {"E": 1.82, "nu": 0.3},
    "load": {"displacement": 2.0, "steps": 2},
}


def test_importing_archord_imports_nothing():
    """Names are there, but what they need is loaded when they are used."""
    code = (
        "import sys, archord; print({'load', 'solve', 'Scene', 'InputError', 'load_scene'} <= "
        "{*dir(archord)}, {'numpy', 'pydantic', 'mpi4py', 'pandas', 'h5py'} & {*sys.modules}); "
        "archord.load; print({'pandas', 'mpi4py', 'dolfinx', 'scipy', 'matplotlib'} & "
        "{*sys.modules})"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60
    )
    assert result.stdout == "True set()\nset()\n", result.stderr
    with pytest.raises(AttributeError, match="has no attribute 'slove'"):
        archord.slove  # noqa: B018


def test_a_scene_from_python_is_that_of_the_file():
    """Tables, classes of other scenes, numbers and arrays of numpy."""
    scene = archord.load_scene(
        SCENE, {"load.displacement": np.linspace(0.5, 2, 4), "load.steps": None}
    )
    made = archord.Scene(
        units={"length": "R", "stress": "E*"},
        joint={"radius": np.float64(1.0), "clearance": 0.005, "relative_element_size": 0.04},
        pin=scene.pin,
        block={"E": 1.82, "nu": 0.3},
        load={"displacement": np.linspace(0.5, 2, 4)},
        output=None,
    )
    assert made == scene
    assert isinstance(made, archord.Scene)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"joint": 3}, "scene: joint = 3 must be a section, [joint]."),
        ({"blok": {}}, "scene: blok is not a known key; did you mean block? Sections are "),
        ({"block": None}, "scene: block is missing."),
        (
            {"load": {"displacement": (1.0, "x")}},
            'scene: load.displacement = [1.0, "x"]: entry 2 must be a number.',
        ),
        (
            {"load": {"path": "cycle.csv"}},
            'scene: load.path = "cycle.csv" is for scene files alone; give the list ',
        ),
    ],
)
def test_faults_are_the_sentences_of_scene_files(change, said):
    """One each, as a InputError."""
    with pytest.raises(archord.InputError) as caught:
        archord.Scene(**(SECTIONS | change))
    assert str(caught.value).startswith(said)
    assert "\n" not in str(caught.value)


@pytest.mark.mpi
def test_solve_gives_the_run_on_every_rank(tmp_path, comm):
    """The same object as load gives; an occupied folder is refused on all ranks, and so is one
    without results."""
    folder = comm.bcast(tmp_path / "run")
    run = archord.solve(archord.load_scene(SCENE, COARSE), folder)
    assert (run.status, run.steps) == ("done", 2)
    assert run.history.equals(archord.load(folder).history)
    assert run.fields().delta == pytest.approx(2 * 0.005, rel=1e-12)
    with pytest.raises(archord.InputError, match="is not empty; choose another folder"):
        archord.solve(SCENE, folder)
    with pytest.raises(
        archord.InputError, match=r"x: is not a folder; give the folder of a run or of a sweep\."
    ):
        archord.load(folder / "x")
    with pytest.raises(archord.InputError, match=r"is not a run folder: scene\.toml is missing\."):
        archord.load(folder.parent)


def test_solve_takes_the_table_of_a_scene_and_refuses_what_is_none(tmp_path):
    joint = {"radius": 10.0, "relative_clearance": 0.01, "relative_element_size": 0.2}
    metal = {"E": 210000.0, "nu": 0.3}
    table = {
        "joint": joint,
        "pin": metal,
        "block": metal,
        "load": {"displacement": 0.2, "steps": 1},
    }
    assert archord.solve(table, tmp_path / "run").status == "done"
    with pytest.raises(InputError, match=r"joint\.radius = -1"):
        archord.solve(table | {"joint": joint | {"radius": -1.0}}, tmp_path / "bad")
    with pytest.raises(
        InputError,
        match=r"archord.solve: problem must be a Problem, a scene, a scene file or its table, not "
        r"\[1\]",
    ):
        archord.solve([1], tmp_path / "bad")
    assert not (tmp_path / "bad").exists()


def test_a_run_that_stops_is_given_back_with_a_warning(tmp_path, caplog):
    """And is kept as it is."""
    scene = archord.Scene(**SECTIONS, analysis={"max_iterations": 2}, stepping={"minimum": 1.0})
    run = archord.solve(scene, tmp_path)
    assert (run.status, run.steps, len(run.history)) == ("stopped", 0, 0)
    assert "no equilibrium at delta" in run.message
    assert run.message in caplog.text
    with pytest.raises(archord.InputError, match="holds no accepted step"):
        run.pressure()


def test_ctrl_c_ends_the_program_too(tmp_path, monkeypatch):
    """A loop over scenes stops, with the accepted steps on disk."""
    monkeypatch.setattr(Progress, "step", lambda self, m: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt, match="interrupted by SIGINT after step 1"):
        archord.solve(archord.Scene(**SECTIONS), tmp_path)
    run = archord.load(tmp_path)
    assert (run.status, run.steps) == ("interrupted", 1)


PARTS = {
    archord.Body: {"name": "lug", "material": archord.Elastic(210e3, 0.3)},
    archord.Interaction: {"name": "contact", "surfaces": ("pin", "hole")},
    archord.Coupling: {"name": "point", "facets": "bore", "point": (0.0, 0.0)},
    archord.Support: {"name": "clamp", "on": "clamp", "fixed": ["x"]},
    archord.Load: {"name": "pull", "on": "flat", "direction": "x", "displacement": 0.1},
    archord.Mesh: {"source": "a.msh"},
}
PARTS[archord.Problem] = {
    "mesh": "a.msh",
    "bodies": [archord.Body(**PARTS[archord.Body])],
    "loads": [archord.Load(**PARTS[archord.Load])],
}
BODY = 'archord.Body: body "lug".'
LOAD = 'archord.Load: load "pull".'
FAULTS = [
    (archord.Body, {"name": ""}, 'archord.Body: body "".name = "" must be a name.'),
    (archord.Body, {"material": 3}, f"{BODY}material = 3 must be the name of a metal, or a "),
    (archord.Body, {"young": 1.0}, "archord.Body: got an unexpected keyword argument 'young'; "),
    (
        archord.Interaction,
        {"surfaces": ["pin"]},
        'archord.Interaction: interaction "contact".surfaces = ["pin"] must be two facet sets',
    ),
    (
        archord.Interaction,
        {"law": "glue"},
        'archord.Interaction: interaction "contact".law = "glue" must be a contact law, or one of ',
    ),
    (
        archord.Coupling,
        {"point": [0.0]},
        'archord.Coupling: coupling "point".point = [0.0] must be two numbers',
    ),
    (
        archord.Support,
        {"fixed": ["up"]},
        'archord.Support: support "clamp".fixed = ["up"] must be directions among "x", "y", "z", ',
    ),
    (archord.Load, {"displacement": None}, f"{LOAD}displacement is missing (or force, pressure)."),
    (archord.Load, {"force": 1.0}, f"{LOAD}displacement = 0.1 must not be given together with "),
    (archord.Load, {"displacement": "far"}, f'{LOAD}displacement = "far" must be a number, or '),
    (archord.Load, {"direction": None}, f'{LOAD}direction = null must be "x", "y", "z", "rot'),
    (
        archord.Mesh,
        {"source": None},
        "archord.Mesh: the source must be a mesh or CAD file, gmsh with a ",
    ),
    (archord.Mesh, {"scale": -1.0}, 'archord.Mesh: mesh "a.msh".scale = -1.0 must be positive and'),
    (
        archord.Mesh,
        {"circles": {"hole": (1, 2)}},
        'archord.Mesh: mesh "a.msh".circles = {"hole": [1, 2]} must have ((x, y), radius), in',
    ),
    (
        archord.Mesh,
        {"circles": {"hole": ((0, 0, 0), 1, (0, 0, 0))}},
        'archord.Mesh: mesh "a.msh".circles = {"hole": [[0, 0, 0], 1, [0, 0, 0]]} must have ((x, ',
    ),
    (
        archord.Mesh,
        {"scale": np.nan},
        'archord.Mesh: mesh "a.msh".scale = NaN must be positive and',
    ),
    (archord.Mesh, {"refine": -1}, 'archord.Mesh: mesh "a.msh".refine = -1 must be a whole number'),
    (archord.Mesh, {"order": 7}, 'archord.Mesh: mesh "a.msh".order = 7 must be 1, 2 or 3.'),
    (archord.Mesh, {"sets": ["a"]}, 'archord.Mesh: mesh "a.msh".sets = ["a"] must be a dictionary'),
    (archord.Problem, {"bodies": 3}, "archord.Problem: bodies must be a list of Body, not 3."),
    (archord.Problem, {"loads": [1]}, "archord.Problem: loads must be of the class Load or Dead"),
    (archord.Problem, {"bodis": []}, "archord.Problem: got an unexpected keyword argument 'bodis'"),
    (archord.Problem, {"kinematics": "3D"}, "archord.Problem: kinematics must be one of "),
    (
        archord.Problem,
        {"bodies": [archord.Body("lug", "S999")]},
        'archord.Problem: body "lug".material = "S999" is not a known material',
    ),
]


@pytest.mark.parametrize(("make", "change", "said"), FAULTS)
def test_a_part_from_python_is_refused_in_a_sentence(make, change, said):
    """When it is made; what is right makes one."""
    right = PARTS[make]
    assert make(**right)
    with pytest.raises(archord.InputError) as error:
        make(**(right | change))
    assert str(error.value).startswith(said)
    assert "\n" not in str(error.value)


def test_parts_have_names_for_sets_unless_they_say_otherwise():
    body = archord.Body("lug", material="S355")
    assert (body.cells, archord.Support("clamp").on) == ("lug", "clamp")
    assert archord.Support("clamp", fixed="y").fixed == ("y",)
    assert archord.Load("press", direction="x", force=np.array([1, 2])).stages == (1.0, 2.0)
    problem = archord.Problem("a.msh", [body], units=("m", "Pa"))
    assert pytest.approx(210) == problem.bodies[0].material.E / 1e9

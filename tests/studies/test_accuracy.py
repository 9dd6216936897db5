"""A scene solved to an accuracy: the error is below it, and what is left is an ordinary run."""

import json
import os
import signal
import tomllib
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.benchmarks.case import Case, paper_joint
from archord.benchmarks.cost.work_precision_codes import CASES
from archord.commands.progress import Progress
from archord.measures.record import Record
from archord.output.restart import plan_restart
from archord.output.run import Outcome, solve_scene
from archord.presets import mesh_family
from archord.presets.mesh_family import MeshFamily, ProblemFamily
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_any, parse_scene, resolved
from archord.scene.presets import joint_geometry as scene_geometry
from archord.studies import accuracy
from archord.studies.accuracy import Level, _Search, solve_to_accuracy
from tests.output.run_files import accepted_steps, same_run


def open_scene(asked, steps=2, yield_stress=None, **sections):
    """The paper's joint, its mesh left open."""
    sections["joint"] = {"element_size": None} | sections.get("joint", {})
    sections["analysis"] = {"accuracy": asked} | sections.get("analysis", {})
    return paper_joint(steps=steps, yield_stress=yield_stress, **sections)


def accurate(scene, folder, comm=MPI.COMM_SELF, **hooks):
    """The scene solved to its accuracy in ``folder``, which is made if it is not there."""
    if comm.rank == 0:
        folder.mkdir(exist_ok=True)
    comm.barrier()
    return solve_to_accuracy(scene, folder, comm, **hooks)


def known_force(case):
    """P at 2 dR in units of E* R, from meshes of up to 400 thousand dofs
    (docs/work_precision.md)."""
    return CASES[case]["current"]["P"][0]


@pytest.mark.parametrize(
    ("shape", "heading", "size"), [(True, "elements/R", 0.04), (False, "size/file", 1.0)]
)
def test_sizes_of_general_meshes_have_their_heading(capsys, shape, heading, size):
    """Those of shapes are over R as those of joints, those of files over the file's."""
    mesh = (
        {"shape": {"kind": "lug", "radius": 5.0, "clearance": 0.1, "width": 20.0}}
        if shape
        else {"file": "x.msh"}
    )
    press = {"name": "press", "on": "flat", "direction": "x", "displacement": 0.1}
    data = {"mesh": mesh, "body": [{"name": "lug", "E": 1.0, "nu": 0.3}], "load": [press]}
    scene = parse_any(data | {"analysis": {"accuracy": 0.01}})
    Progress(scene, silent=False)
    assert f" mesh  {heading:>10s}  growth" in capsys.readouterr().out
    assert ProblemFamily(scene).sizes(scene)[0] == pytest.approx(size)


def test_thin_solids_have_hardly_more_cells_of_a_smaller_size():
    """Errors are estimated by the cells that there are, from three meshes at least, and from four
    where these hardly refine."""
    mesh = {"shape": {"kind": "lug", "radius": 5.0, "clearance": 0.1, "width": 20.0}}
    press = {"name": "press", "on": "flat", "direction": "x", "displacement": 0.1}
    data = {"mesh": mesh, "body": [{"name": "lug", "E": 1.0, "nu": 0.3}], "load": [press]}
    plane = ProblemFamily(parse_any(data))
    mesh["shape"]["space"] = {"thickness": 4.0}
    solid = ProblemFamily(parse_any(data | {"analysis": {"plane": "space"}}))
    assert (plane.fewest, solid.fewest) == (2, 3)
    assert plane.ratio_of(4000, 5000) == solid.ratio_of(1000, 5000) == mesh_family.RATIO
    assert solid.ratio_of(4000, 5000) == pytest.approx(1.25 ** (1 / 3))
    assert solid.ratio_of(4000, 4000) > 1
    assert solid.are_enough([4000, 13000, 42000])
    assert not solid.are_enough([4000, 7000, 14000])
    assert solid.are_enough([4000, 7000, 14000, 24000])
    assert plane.are_enough([4000, 5000])


def test_a_general_scene_that_is_let_go_notices_its_contact():
    """What touches at any step is learnt from, though nothing touches at the end."""
    mesh = {"shape": {"kind": "lug", "radius": 5.0, "clearance": 0.1, "width": 20.0}}
    press = {"name": "press", "on": "flat", "direction": "x", "displacement": [0.3, 0.0]}
    contact = {"name": "contact", "surfaces": ["pin", "hole"]}
    bodies = [{"name": name, "E": 1.0, "nu": 0.3} for name in ("lug", "pin")]
    scene = parse_any({"mesh": mesh, "body": bodies, "load": [press], "interaction": [contact]})
    pressed, free = (SimpleNamespace(contact_area=area) for area in (3.0, 0.0))
    family = ProblemFamily(scene)
    assert family.resolved(scene, [pressed, free])
    assert not family.resolved(scene, [free, free])


@pytest.fixture(scope="module")
def elastic(tmp_path_factory):
    return accurate(open_scene(1e-3), tmp_path_factory.mktemp("elastic"))


def test_an_elastic_joint_is_as_accurate_as_asked(elastic):
    """The estimate is below what was asked, and the true error below the estimate."""
    found = elastic.accuracy
    true = abs(elastic.steps[-1]["P"] / known_force("elastic") - 1)
    assert elastic.status == "done"
    assert true < found.estimated <= found.asked == 1e-3
    assert found.substeps == 1
    assert found.step_error == 0
    sizes = [level.element_size for level in found.levels]
    assert np.divide(sizes[:-1], sizes[1:]) == pytest.approx(mesh_family.RATIO, rel=1e-3)
    assert [level.mesh_error is None for level in found.levels] == [True] + [False] * (
        len(sizes) - 1
    )


def test_the_run_says_how_accurate_it_is_and_can_be_solved_again(elastic, tmp_path):
    """run.json has what was asked, what came out, and every mesh, scene.toml the last one and no
    accuracy."""
    report = json.loads((elastic.folder / "run.json").read_text())
    block = report["accuracy"]
    last = report["accuracy"]["levels"][-1]
    assert (report["status"], block["asked"]) == ("done", 1e-3)
    assert report["error_estimates"]["mesh"] == block["mesh_error"] == block["estimated"]
    assert last["dofs"] == report["mesh"]["dofs"]
    assert last["last"] == report["steps"][-1]["P"]
    assert last["iterations"] == report["totals"]["newton_iterations"]
    assert sum(level["seconds"] for level in block["levels"]) <= block["seconds"]
    scene = load_scene(elastic.folder / "scene.toml")
    assert scene.analysis.accuracy is None
    assert scene.joint.h == pytest.approx(last["element_size"])
    solve_scene(scene, tmp_path, MPI.COMM_SELF)
    same_run(elastic.folder, tmp_path, 1e-10)


def test_a_plastic_joint_is_as_accurate_as_asked(tmp_path):
    """In 20 output steps, as the reference has them; its own error of the steps at 2 dR is below
    5e-4."""
    outcome = accurate(open_scene(6e-3, 20, 0.002, output={"fields": False}), tmp_path)
    found = outcome.accuracy
    assert outcome.status == "done"
    assert found.estimated == found.mesh_error + found.step_error <= 6e-3
    assert 0 < found.step_error <= 3e-3
    assert abs(outcome.steps[-1]["P"] / known_force("plastic") - 1) < 6e-3
    tried = {level.substeps for level in found.levels if level.mesh == 1}
    assert {found.substeps, 2 * found.substeps} <= tried or {
        found.substeps,
        found.substeps // 2,
    } <= tried


def test_under_a_force_the_displacement_is_accurate(tmp_path):
    """The force that belongs to 2 dR presses the pin by 2 dR."""
    load = {"displacement": None, "relative_force": known_force("elastic")}
    outcome = accurate(open_scene(3e-3, load=load), tmp_path)
    assert outcome.steps[-1]["delta"] == pytest.approx(0.01, rel=3e-3)
    assert outcome.accuracy.levels[-1].last == outcome.steps[-1]["delta"]


@pytest.mark.parametrize(
    ("kind", "order"), [({"yield_stress": 0.002}, 1.0), ({"analysis": {"friction": 0.3}}, 0.5)]
)
def test_the_error_of_steps_is_what_is_left_to_their_limit(tmp_path, monkeypatch, kind, order):
    """Of a P that comes near its limit with the step where a body yields, and with the root of the
    step where it rubs: by these orders nothing is over- or underestimated."""

    def converging(scene, folder, comm, *, interrupt, on_start):
        on_start(SimpleNamespace(n_dofs=round(1 / scene.joint.h**2)))
        P = 1 + 0.004 * scene.stepping.initial**order
        (folder / "run.json").write_text('{"error_estimates": {}}')
        values = {"P": P, "delta": 2.0}
        step = Record(1, 2.0, values, 2.0, *np.zeros(4), 1, 0, 0.0)
        return Outcome(folder, "done", "", [step], [])

    monkeypatch.setattr(accuracy, "solve_scene", converging)
    found = accurate(open_scene(1e-3, 1, **kind), tmp_path).accuracy
    assert found.step_error == pytest.approx(0.004 * found.substeps**-order, rel=5e-3)
    assert 2 * found.step_error <= found.asked


@pytest.mark.parametrize(("steps", "many_substeps"), [(1, 32), (4, 16)])
def test_steps_err_with_friction_too(tmp_path, steps, many_substeps):
    """An elastic joint that sticks and slides: the error of the steps is that of many steps, four
    times as many, where one step and two differ by a twentieth of it, too."""
    rough = {"friction": 0.5}
    outcome = accurate(open_scene(6e-3, steps, analysis=rough), tmp_path / "run")
    found = outcome.accuracy
    assert 0 < found.step_error <= 3e-3
    assert 1 < found.substeps <= many_substeps // 4
    short = {"initial": 1 / many_substeps, "maximum": 1 / many_substeps}
    own = load_scene(tmp_path / "run" / "scene.toml")
    many = own.model_copy(update={"stepping": own.stepping.model_copy(update=short)})
    known = Case("many", many).solve(tmp_path).steps[-1]["P"]
    assert abs(outcome.steps[-1]["P"] / known - 1) < found.step_error


def test_short_steps_are_chosen_where_long_ones_err(tmp_path):
    """A plastic joint in two output steps: more accuracy takes more substeps, and brings P closer
    to that of many."""
    plane = {"plane": "stress"}
    short = {"initial": 1 / 16, "maximum": 1 / 16}
    many = paper_joint(0.2, 2, 0.002, joint={"growth": 1.25}, analysis=plane, stepping=short)
    known = Case("many", many).solve(tmp_path).steps[-1]["P"]
    taken = []
    errors = []
    for asked in (0.1, 0.04):
        scene = open_scene(asked, 2, 0.002, analysis=plane, output={"fields": False})
        found = accurate(scene, tmp_path / f"{asked}").accuracy
        of_coarsest = {level.substeps: level.last for level in found.levels if level.mesh == 1}
        taken.append(found.substeps)
        errors.append(abs(of_coarsest[found.substeps] / known - 1))
        assert errors[-1] < asked / 2
    assert taken[1] > taken[0]
    assert errors[1] < errors[0]


def test_a_run_whose_steps_were_cut_tells_no_error_of_steps(tmp_path, monkeypatch):
    """Its steps may be the steps of the finer run: the error was told to be 7e-13, and was 7.6e-3.
    Here each curve is 1 less a twentieth of its longest step."""
    scene = parse_any(
        {
            "lug": {"radius": 10.0, "clearance": 0.1, "width": 40.0},
            "pin": {"E": 210e3, "nu": 0.3},
            "plate": {"material": "S355"},
            "load": {"displacement": 0.2, "steps": 1},
            "analysis": {"accuracy": 0.1},
        }
    )
    told = []

    def solved(search, mesh, substeps):
        length = min(1 / substeps, 0.5)  # the first run is cut in two
        curve = np.array([1 - 0.05 * length])
        level = Level(1, 0.1, 0.5, substeps, 99, curve[-1], 1.0, 9, cutbacks=int(substeps == 1))
        return curve, level

    monkeypatch.setattr(_Search, "_solve", solved)
    search = _Search(scene, tmp_path, MPI.COMM_SELF, None, None, told.append, {})
    _, level = search._choose_steps(1, *search._solve(1, 1))
    assert (level.substeps, search.substeps) == (2, 2)
    assert search.step_error == pytest.approx(0.025, rel=0.1)
    assert [one.step_error for one in told if one.substeps == 1] == [None]


def test_a_mesh_that_does_not_see_the_contact_is_no_evidence(tmp_path, monkeypatch):
    """Where the contact is smaller than expected, coarse meshes are passed over until a few facets
    touch."""
    monkeypatch.setattr(mesh_family, "expected_angle", lambda scene: 1.17)
    scene = open_scene(0.02, 1, load={"displacement": 0.05}, output={"fields": False})
    outcome = accurate(scene, tmp_path)
    levels = outcome.accuracy.levels
    facets = [outcome.steps[-1].contact_area / 2 / level.element_size for level in levels]
    assert facets[0] < 2
    assert all(level.mesh_error is None for level, n in zip(levels, facets, strict=True) if n < 2.5)
    assert outcome.accuracy.estimated <= 0.02


def test_a_pin_that_never_touches_has_no_error(tmp_path):
    """Drawn away from the hole it bears no force on any mesh."""
    outcome = accurate(open_scene(0.01, 1, load={"displacement": -0.5}), tmp_path)
    assert outcome.status == "done"
    assert outcome.accuracy.estimated == 0


def test_too_much_accuracy_ends_with_a_warning(tmp_path, monkeypatch):
    """The finest mesh allowed stays; the warning has the estimate and what to do."""
    scene = open_scene(1e-4)
    monkeypatch.setattr(scene_geometry, "_MOST_CELLS", 1000)
    outcome = accurate(scene, tmp_path)
    assert outcome.status == "done"
    assert outcome.accuracy.estimated > 1e-4
    (warning,) = (w for w in outcome.warnings if w.startswith("accuracy"))
    assert "not below analysis.accuracy = 0.0001" in warning
    assert f"{outcome.accuracy.estimated:.1e}" in warning
    assert json.loads((tmp_path / "run.json").read_text())["warnings"] == outcome.warnings
    monkeypatch.setattr(scene_geometry, "_MOST_CELLS", 5)
    with pytest.raises(InputError, match="no mesh within the limits"):
        accurate(scene, tmp_path)


@pytest.mark.parametrize(
    ("when", "number", "yield_stress", "steps", "meshes"),
    [("on_step", 6, None, 2, 1), ("on_level", 1, None, 4, 1), ("on_step", 4, 0.002, 4, 0)],
)
def test_ctrl_c_in_any_mesh_ends_the_run(tmp_path, when, number, yield_stress, steps, meshes):
    """In the second mesh after a step, between meshes, and while steps are chosen: what was
    accepted is there."""
    seen = []

    def interrupt(thing):
        seen.append(thing)
        if len(seen) == number:
            os.kill(os.getpid(), signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    scene = open_scene(1e-3, 4, yield_stress)
    outcome = accurate(scene, tmp_path, **{when: interrupt})
    assert (outcome.status, outcome.signal, len(outcome.steps)) == (
        "interrupted",
        signal.SIGINT,
        steps,
    )
    assert "interrupted by SIGINT" in outcome.message
    assert accepted_steps(tmp_path) == steps
    report = json.loads((tmp_path / "run.json").read_text())
    assert report["status"] == "interrupted"
    assert report["accuracy"]["estimated"] is None
    assert len(report["accuracy"]["levels"]) == meshes
    assert signal.getsignal(signal.SIGINT) is before
    plan = plan_restart(tmp_path)
    assert solve_scene(plan.scene, tmp_path, MPI.COMM_SELF, start=plan.start).status == "done"
    assert accepted_steps(tmp_path) == 4


def test_accurate_and_small_contacts_get_small_elements():
    """More accuracy is finer everywhere; a contact of a tenth of the angle has as many elements,
    which grow as fast."""
    third = [
        MeshFamily(open_scene(asked), asked).scene_of(2, 1).joint
        for asked in (0.01, 1e-3, 1e-4, 1e-5)
    ]
    assert all(a.h > b.h and a.growth > b.growth for a, b in pairwise(third))
    cubic = MeshFamily(open_scene(1e-4, analysis={"degree": 3}), 1e-4).scene_of(2, 1).joint
    assert cubic.h > third[2].h
    wide, small = (
        MeshFamily(open_scene(1e-3, load={"displacement": d}), 1e-3) for d in (2.0, 0.01)
    )
    a = wide.scene_of(1, 1).joint
    b = small.scene_of(1, 1).joint
    assert b.growth == a.growth
    angle = mesh_family.expected_angle(small.scene)
    assert np.cos(angle) == pytest.approx(1 / 1.01)
    assert b.h / a.h == pytest.approx(angle / 1.17, rel=1e-3)


def test_a_ring_is_as_accurate_as_estimated(tmp_path):
    """Although few cells lie in the core that is loaded. The displacement is the one of elements of
    0.025 R, and of R/120 in the core."""
    scene = load_scene(Path("scenes/press_fit.toml"), ["analysis.accuracy=0.01", "load.steps=1"])
    found = accurate(scene, tmp_path / "ring")
    true = abs(found.steps[-1]["delta"] / 0.0091614 - 1)
    assert true < found.accuracy.estimated <= 0.01


def test_units_do_not_matter():
    """Metres and pascals instead of millimetres and megapascals: the same meshes in units of R."""
    data, other = (
        tomllib.loads(resolved(open_scene(1e-3, load={"displacement": 0.3}))) for _ in range(2)
    )
    other["joint"] |= {"radius": 0.037, "clearance": 0.005 * 0.037, "block_size": 3.7}
    for body in ("pin", "block"):
        other[body]["E"] *= 1.3e9
    joints = [MeshFamily(s, 1e-3).scene_of(1, 1).joint for s in map(parse_scene, (data, other))]
    assert joints[0].relative_element_size == joints[1].relative_element_size
    assert joints[0].growth == joints[1].growth


def test_thickness_does_not_matter():
    """Under a force that is as many times as large: the same meshes."""
    sizes = []
    for t in (1.0, 10.0):
        load = {"displacement": None, "force": 1e-4 * t}
        scene = open_scene(1e-3, analysis={"thickness": t}, load=load)
        sizes.append(MeshFamily(scene, 1e-3).scene_of(1, 1).joint.relative_element_size)
    assert sizes[0] == sizes[1]


def test_meshes_are_bounded_by_the_keys():
    """Unlike elements on both arcs and a shrinking edge stay within what a scene allows; beyond it
    there is no mesh."""
    for keys in (
        {"size_ratio": 0.01},
        {"size_ratio": 10.0},
        {"edge_angle": 1.0, "edge_ratio": 0.01},
    ):
        family = MeshFamily(open_scene(1e-3, joint=keys), 1e-3)
        assert family.scene_of(0, 1) is not None
        assert family.scene_of(1, 1) is not None
    assert family.scene_of(20, 1) is None
    short = family.scene_of(0, 64).stepping
    assert short.initial == short.maximum == 1 / 64 >= short.minimum


def test_a_scene_without_a_mesh_is_not_solved_as_it_is(tmp_path):
    """By a function that needs one."""
    with pytest.raises(InputError, match=r"accuracy = 0\.001: leaves the mesh open"):
        solve_scene(open_scene(1e-3), tmp_path, MPI.COMM_SELF)
    assert not any(tmp_path.iterdir())


def test_an_override_takes_the_place_of_the_accuracy_or_of_the_mesh(tmp_path):
    """But both in one source exclude each other."""
    text = resolved(open_scene(1e-3))
    (tmp_path / "open.toml").write_text(text)
    assert load_scene(tmp_path / "open.toml") == parse_scene(tomllib.loads(text))
    for override in ("joint.growth=0.5", "joint.element_size=0.1", "stepping.initial=0.5"):
        assert load_scene(tmp_path / "open.toml", [override]).analysis.accuracy is None
        section, name, value = override.replace("=", ".", 1).split(".", 2)
        data = tomllib.loads(text)
        data[section][name] = float(value)
        with pytest.raises(
            InputError,
            match=rf"{section}\.{name} = {value} must not be given together with analysis",
        ):
            parse_scene(data)
    (tmp_path / "closed.toml").write_text(resolved(paper_joint()))
    assert (
        load_scene(tmp_path / "closed.toml", ["analysis.accuracy=0.01"]).analysis.accuracy == 0.01
    )


@pytest.mark.mpi
def test_ranks_choose_the_same_meshes(tmp_path, comm):
    """As one rank does, with the same estimates and forces."""
    scene = open_scene(0.03, 4, 0.002)
    folder = Path(comm.bcast(str(tmp_path)))
    together = accurate(scene, folder / "together", comm)
    alone = None
    if comm.rank == 0:
        alone = accurate(scene, folder / "alone")
        alone = [m["P"] for m in alone.steps], alone.accuracy
    forces, found = comm.bcast(alone)
    assert [m["P"] for m in together.steps] == pytest.approx(forces, rel=1e-8)
    assert together.accuracy.estimated == pytest.approx(found.estimated, rel=1e-4)
    for a, b in zip(together.accuracy.levels, found.levels, strict=True):
        assert (a.mesh, a.element_size, a.substeps, a.dofs) == (
            b.mesh,
            b.element_size,
            b.substeps,
            b.dofs,
        )


def test_a_file_in_space_is_refined_to_the_accuracy(tmp_path):
    """A box that is sheared: the cells are cut in eight, and the force falls with them."""
    comm = MPI.COMM_SELF
    mesh = archord.boxes({"box": (0.0, 0.0, 0.0, 2.0, 1.0, 1.0)}, size=0.7, comm=comm)
    problem = archord.Problem(
        mesh,
        [archord.Body("box", archord.Elastic(210e3, 0.3))],
        supports=[archord.Support("wall", on="box left", fixed="xyz")],
        loads=[archord.Load("bend", on="box right", direction="z", displacement=0.01)],
        steps=1,
    )
    archord.solve(problem, tmp_path / "given", comm=comm)
    scene = tomllib.loads((tmp_path / "given" / "scene.toml").read_text())
    del scene["stepping"]
    scene["mesh"]["file"] = str(tmp_path / "given" / "mesh.npz")
    scene["analysis"]["accuracy"] = 0.02
    run = archord.solve(scene, tmp_path / "run", comm=comm)
    found = run.summary["accuracy"]
    assert 0 < found["mesh_error"] < 0.02
    first, last = found["levels"][0]["last"], found["levels"][-1]["last"]
    assert first > last > 0.9 * first
    assert found["levels"][1]["dofs"] > 4 * found["levels"][0]["dofs"]


def test_a_joint_in_space_is_solved_to_the_accuracy(tmp_path):
    """Its run can be read and solved again."""
    steel = {"E": 210e3, "nu": 0.3}
    scene = {
        "joint": {"radius": 10.0, "clearance": 0.05, "block_size": 30.0},
        "pin": steel,
        "block": steel,
        "space": {"thickness": 5.0, "rim_ratio": 1.0},
        "load": {"displacement": 1.0, "steps": 1},
        "analysis": {"accuracy": 0.05},
    }
    run = archord.solve(scene, tmp_path / "run", comm=MPI.COMM_SELF)
    assert run.status == "done"
    assert 0 < run.summary["accuracy"]["estimated"] < 0.05
    assert len(run.summary["accuracy"]["levels"]) >= 3
    again = archord.solve(tmp_path / "run" / "scene.toml", tmp_path / "again", comm=MPI.COMM_SELF)
    assert again.columns["press force"] == run.columns["press force"]

"""A law as an FMU: the same numbers as in Python, in model exchange and in co-simulation, and no
fault in the C code."""

from __future__ import annotations

import re
import shutil
import subprocess
import warnings
import zipfile
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

from archord.cli import run
from archord.postprocess.laws.exports.contact import Contact
from archord.postprocess.laws.exports.fmu import export_fmu
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.joint_curve import JointCurve
from tests.postprocess.laws.test_element import CONTACT, elastic, motions, python, values, yielding
from tests.postprocess.laws.test_exports import curves, load, write

STEEL_PIN = str(Path(__file__).parents[3] / "scenes" / "steel_pin.toml")
OUTPUTS = ("P", "stiffness", "deepest", "residual", "expected_error")
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1"]
CAREFUL = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]

pytestmark = pytest.mark.filterwarnings("ignore:archord. beyond")


@pytest.fixture(params=["yielding", "elastic", "without touch"])
def curve(request: pytest.FixtureRequest) -> JointCurve:
    return curves()[request.param]


@pytest.fixture
def sources_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """No compiler, for tests that need no library."""
    monkeypatch.setenv("CC", "no-such-compiler")


needs_compiler = pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler is here")


def unpacked(law: JointCurve | FittedLaw, folder: Path, contact: Contact | None = None) -> Path:
    """The folder of the FMU ``lug_pin``."""
    (folder / "lug_pin.fmu").write_bytes(export_fmu(law, folder / "lug_pin.fmu", contact))
    zipfile.ZipFile(folder / "lug_pin.fmu").extractall(folder / "lug_pin")
    return folder / "lug_pin"


def drive(curve: JointCurve) -> np.ndarray:
    """Displacements that go deep and come back, up to 0.9 of the range."""
    time = np.linspace(0, 6 * np.pi, 400)
    return 0.9 * curve.limit * np.sin(time) * np.sqrt(time / time[-1])


def client(law: JointCurve, folder: Path, given: np.ndarray, *words: str) -> np.ndarray:
    """What a strict C99 program with sanitizers, ``fmu_client.c``, answers to the numbers."""
    sources = unpacked(law, folder, CONTACT) / "sources"
    shutil.copy(Path(__file__).with_name("fmu_client.c"), sources / "client.c")
    command = ["cc", *STRICT, *CAREFUL, "client.c", "-o", "client", "-lm"]
    subprocess.run(command, cwd=sources, check=True)
    done = subprocess.run(
        [sources / "client", *words], input=given.tobytes(), capture_output=True, check=True
    )
    return np.frombuffer(done.stdout)


@needs_compiler
@pytest.mark.usefixtures("sources_alone")
@pytest.mark.filterwarnings("ignore:.*sources alone")
@pytest.mark.parametrize("law", [yielding(), elastic()], ids=["yielding", "elastic"])
def test_the_joint_in_a_plane_is_the_python_exports(law: JointCurve, tmp_path: Path) -> None:
    """Force, torque and all their derivatives along a path with memory, to 1e-12 of the largest."""
    given = motions(law, 60, 1.5)
    found = client(law, tmp_path, given, "plane").reshape(-1, 18)
    export = python(law)
    memory = export.new_element()
    wanted = []
    for motion in given:
        wanted.append(values(export, memory, motion[None])[0])
        memory = export.advance_element(memory, *motion[:2])
    largest = np.abs(wanted).max(axis=0)
    assert np.all(np.abs(found - wanted) <= 1e-12 * largest)


@needs_compiler
@pytest.mark.usefixtures("sources_alone")
@pytest.mark.filterwarnings("ignore:.*sources alone")
def test_the_code_has_no_fault_and_says_what_the_table_says(curve, tmp_path: Path) -> None:
    """Strict C99 with sanitizers; steps that are taken back leave no trace; the pin is three times
    as long, and so is its force."""
    delta = drive(curve)
    found = client(curve, tmp_path, delta).reshape(-1, 5)
    deepest = np.maximum.accumulate(np.maximum(delta, 0))
    state = curve.at(delta, deepest)
    wanted = (
        3 * state.load,
        3 * state.stiffness,
        deepest,
        curve.residual(deepest),
        3 * state.error,
    )
    for name, ours, theirs in zip(OUTPUTS, found.T, wanted, strict=True):
        np.testing.assert_allclose(
            ours, theirs, rtol=1e-9, atol=1e-12 * np.max(theirs) + 1e-16, err_msg=name
        )


@pytest.mark.filterwarnings("ignore:.*sources alone")
def test_the_file_depends_on_the_law_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same bytes twice; another law has another GUID; every variable has the place that the C
    code knows."""
    law = yielding()
    folder = unpacked(law, tmp_path)
    target = tmp_path / "lug_pin.fmu"
    assert target.read_bytes() == export_fmu(law, target)
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    guid = root.get("guid")
    assert guid
    assert guid in (folder / "sources" / "fmu-model.h").read_text()
    monkeypatch.setenv("CC", "no-such-compiler")
    other = unpacked(replace(law, force=2 * law.force), tmp_path)
    assert guid not in (other / "modelDescription.xml").read_text()
    names = [variable.get("name") for variable in root.find("ModelVariables")]
    code = (folder / "sources" / "fmu.c").read_text()
    [block] = re.findall(r"enum {\n    DELTA.*?COUNT", code, re.S)
    listed = re.findall(r"[A-Z]\w*", re.sub("#.*", "", block))
    assert listed[:-1] == [name.upper() for name in names]


@pytest.mark.usefixtures("sources_alone")
@pytest.mark.filterwarnings("ignore:.*sources alone")
def test_the_force_is_total_and_the_units_are_known(tmp_path: Path) -> None:
    """In N, whether the scene has a thickness or not; inches and kips, too; a law without names of
    units has none."""
    law = replace(elastic(), length_unit="mm", force_unit="N/mm")
    for one in (law, replace(law, force_unit="N", pin_length=25.0)):
        root = ElementTree.parse(unpacked(one, tmp_path) / "modelDescription.xml").getroot()
        reals = {variable.get("name"): variable[0] for variable in root.find("ModelVariables")}
        units = {unit.get("name"): unit[0].attrib for unit in root.find("UnitDefinitions")}
        assert reals["P"].get("unit") == "N"
        assert float(reals["length"].get("start")) == one.pin_length
        assert units["N/mm"] == {"kg": "1", "s": "-2", "factor": "1000.0"}
    bare = unpacked(replace(law, length_unit="unit of R"), tmp_path) / "modelDescription.xml"
    assert "unit=" not in bare.read_text()


@pytest.mark.usefixtures("sources_alone")
def test_without_a_compiler_it_holds_sources(tmp_path: Path, capsys) -> None:
    """And says so, in one sentence."""
    target = tmp_path / "joint.fmu"
    assert run(["law", "--scene", STEEL_PIN, "--export", str(target)]) == 0
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert "joint.fmu: no C compiler is here, so the FMU holds sources alone" in said.err
    names = zipfile.ZipFile(target).namelist()
    assert "sources/fmu.c" in names
    assert not any(name.startswith("binaries") for name in names)


@pytest.mark.parametrize("name", ["while.fmu", "2nd.fmu", "a-b.fmu", "missing/joint.fmu", "x.FMU"])
def test_files_that_cannot_be(name: str, tmp_path: Path, capsys) -> None:
    """One sentence, and nothing written."""
    assert run(["law", "--scene", STEEL_PIN, "--export", str(tmp_path / name)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert Path(name).name in said
    assert not list(tmp_path.iterdir())


@needs_compiler
@pytest.mark.parametrize("name", ["model", "fmu", "fmi2Real", "State", "LAW", "P", "linux"])
def test_names_of_the_code_are_names_of_laws(name: str) -> None:
    """The sources compile under each of them; a warning would say so else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert export_fmu(elastic(), Path(f"{name}.fmu"))


@needs_compiler
def test_a_fitted_formula_is_an_fmu_without_error(tmp_path: Path) -> None:
    """Which it does not know, nor a residual clearance."""
    law = FittedLaw(k=0.85, E_star=1e5, R=10.0, dR=0.05, k_error=0.01, fitted_range=(0.0, 2.0))
    folder = unpacked(law, tmp_path)
    assert (folder / "binaries" / "linux64" / "lug_pin.so").is_file()
    description = (folder / "modelDescription.xml").read_text()
    assert "expected_error" not in description
    assert 'unit="N/mm"' in description


def impact(curve: JointCurve) -> SimpleNamespace:
    """A mass that hits the joint and comes back, in fixed steps."""
    mass = 0.2
    speed = 0.5 * np.sqrt(2 * curve.force * curve.limit / mass)
    steps = 800
    return SimpleNamespace(
        mass=mass, speed=speed, steps=steps, step=2.5 * curve.limit / speed / steps
    )


def motion(curve: JointCurve, force, accept) -> np.ndarray:
    """Displacements of the mass by Runge-Kutta's method, or by Euler's if ``force`` is known at
    accepted steps alone."""
    one = impact(curve)
    delta = 0.0
    v = one.speed
    path = []
    for _ in range(one.steps):
        half = one.step / 2
        a1 = -force(delta, v) / one.mass
        a2 = -force(delta + half * v, v + half * a1) / one.mass
        a3 = -force(delta + half * v + half**2 * a1, v + half * a2) / one.mass
        a4 = -force(delta + one.step * v + 2 * half**2 * a2, v + one.step * a3) / one.mass
        delta += one.step * (v + one.step * (a1 + a2 + a3) / 6)
        v += one.step * (a1 + 2 * a2 + 2 * a3 + a4) / 6
        accept(delta, v)
        path.append(delta)
    return np.array(path)


def in_python(curve: JointCurve, tmp_path: Path) -> np.ndarray:
    """The motion with the export in Python."""
    law = load(write(curve, tmp_path / "law.py"))
    memory = [0.0]

    def accept(delta: float, v: float) -> None:
        memory[0] = law.advance(memory[0], delta)

    return motion(curve, lambda delta, v: law.force(delta, memory[0])[0], accept)


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_an_impact_is_the_python_exports(curve, kind: str, tmp_path: Path) -> None:
    """fmpy finds no fault in the FMU; the motion is the same to 1e-9, the way back included. In
    co-simulation the force answers trial inputs at once, and a step of communication accepts
    one."""
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not here (pip install fmpy)")
    from fmpy.fmi2 import FMU2Model, FMU2Slave
    from fmpy.validation import validate_fmu

    folder = unpacked(curve, tmp_path)
    assert validate_fmu(tmp_path / "lug_pin.fmu") == []
    description = fmpy.read_model_description(folder)
    kinds = {"ModelExchange": FMU2Model, "CoSimulation": FMU2Slave}
    joint = kinds[kind](
        guid=description.guid,
        unzipDirectory=str(folder),
        modelIdentifier="lug_pin",
        instanceName="joint",
    )
    joint.instantiate()
    joint.setupExperiment()
    joint.enterInitializationMode()
    joint.exitInitializationMode()
    [P] = [one.valueReference for one in description.modelVariables if one.name == "P"]
    step = impact(curve).step
    taken = iter(range(10**6))

    def force(delta: float, v: float) -> float:
        joint.setReal([0, 1], [delta, v])
        return joint.getReal([P])[0]

    def accept(delta: float, v: float) -> None:
        joint.setReal([0, 1], [delta, v])
        if kind == "ModelExchange":
            assert joint.completedIntegratorStep() == (False, False)
        else:
            joint.doStep(next(taken) * step, step)

    found = motion(curve, force, accept)
    joint.terminate()
    joint.freeInstance()
    wanted = in_python(curve, tmp_path)
    assert wanted[-1] < 0.9 * wanted.max()
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9 * wanted.max())


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_fmpy_drives_it(kind: str, tmp_path: Path) -> None:
    """By its own solver and events, along a given displacement; the force is the table's."""
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not here (pip install fmpy)")
    law = curves()["yielding"]
    unpacked(law, tmp_path)
    delta = drive(law)
    time = np.linspace(0, 1, len(delta))
    columns = [("time", float), ("delta", float), ("delta_rate", float)]
    given = np.array([*zip(time, delta, np.gradient(delta, time), strict=True)], columns)
    found = fmpy.simulate_fmu(
        str(tmp_path / "lug_pin.fmu"),
        fmi_type=kind,
        input=given,
        output=["delta", "P", "deepest"],
        stop_time=1.0,
        output_interval=1e-3,
        start_values={"length": 3.0, "deepest_start": 0.2 * law.limit},
    )
    wanted = 3 * law.at(found["delta"], found["deepest"]).load
    np.testing.assert_allclose(found["P"], wanted, rtol=1e-9, atol=1e-9 * wanted.max())
    assert found["deepest"][0] == 0.2 * law.limit
    assert found["deepest"][-1] == pytest.approx(delta.max(), rel=1e-3)


@pytest.mark.parametrize("kind", ["ModelExchange", "CoSimulation"])
def test_fmpy_drives_the_joint_in_a_plane(kind: str, tmp_path: Path) -> None:
    """Round the hole with friction and damping: force and torque are the Python export's to
    1e-9."""
    fmpy = pytest.importorskip("fmpy", reason="fmpy is not here (pip install fmpy)")
    law = yielding()
    unpacked(law, tmp_path, CONTACT)
    time = np.linspace(0, 1, 101)
    distance = law.length * (1 + 1.2 * np.sin(6 * time) ** 2)
    ex = distance * np.cos(9 * time)
    ey = distance * np.sin(9 * time)
    motion = [ex, ey, np.gradient(ex, time), np.gradient(ey, time), 2 + time]
    names = ["ex", "ey", "vx", "vy", "omega"]
    columns = [(name, float) for name in ("time", *names)]
    found = fmpy.simulate_fmu(
        str(tmp_path / "lug_pin.fmu"),
        fmi_type=kind,
        input=np.array([*zip(time, *motion, strict=True)], columns),
        output=[*names, "Fx", "Fy", "T"],
        stop_time=1.0,
        output_interval=0.01,
    )
    export = python(law)
    memory = export.new_element()
    wanted = []
    for row in found:
        given = [float(row[name]) for name in names]
        memory = export.advance_element(memory, *given[:2])
        wanted.append(export.element(memory, given[:2], given[2:4], given[4])[0])
    for name, theirs in zip(("Fx", "Fy", "T"), np.transpose(wanted), strict=True):
        np.testing.assert_allclose(found[name], theirs, atol=1e-9 * np.abs(theirs).max())

"""The force element of an exported law: its Jacobian, its energy on any path, and one answer in all
languages."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from archord.cli import run
from archord.postprocess.laws.exports.contact import Contact
from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from tests.postprocess.laws.curves import yielding_curve
from tests.postprocess.laws.modelica import functions_of

CONTACT = Contact(damping=2e-3, mu_static=0.2, mu_dynamic=0.12, stick_speed=3.0)
RADIUS = 10.0
pytestmark = pytest.mark.filterwarnings("ignore:delta = .* beyond the tables")


def yielding() -> JointCurve:
    """A joint that yields, in mm and N."""
    curve = yielding_curve()
    return replace(curve, length=0.05, force=7e3, pressure=210.0, radius=RADIUS)


def elastic() -> JointCurve:
    """The same joint without yielding."""
    curve = yielding()
    one = np.ones_like(curve.x)
    same = {"back": curve.y, "dback": curve.dy, "ratio": one, "dratio": 0 * one}
    return replace(curve, **same, toe=0 * one, back_error=0 * one)


def solved(plane: str, stress: float | None = 250.0, **given: float | bool) -> JointCurve:
    """A joint of the general law, both of whose bodies yield at this ``stress``."""
    return general_law(LawJoint(RADIUS, 0.05, 115e3, stress, stress, plane=plane, nu=0.3, **given))


LAWS = {
    "yielding": yielding,
    "elastic": elastic,
    "without touch": lambda: replace(yielding(), touch=np.zeros(0)),
    "plane strain": lambda: solved("strain"),
    "plane stress": lambda: solved("stress"),
    "elastic, friction": lambda: solved("stress", None, friction=0.3),
    "elastic, large strain": lambda: solved("strain", None, large_strain=True),
    "yields late, friction": lambda: solved("stress", 700.0, friction=0.3),
}
FITTED = FittedLaw(k=0.85, E_star=115e3, R=RADIUS, dR=0.05, k_error=0.0, c=1.0, sigY=300.0)


def python(law: JointCurve | FittedLaw) -> ModuleType:
    """The export in Python."""
    module = ModuleType("law")
    exec(export_law(law, Path("law.py"), CONTACT), module.__dict__)
    return module


def positions(law: JointCurve, n: int, deepest: float, seed: int = 5) -> np.ndarray:
    """Accepted positions ``(n, 2)`` from within the clearance to ``deepest`` (over dR)."""
    rng = np.random.default_rng(seed)
    distance = law.length * (1 + deepest * rng.uniform(-0.2, 1.0, n))
    angle = rng.uniform(-np.pi, np.pi, n)
    return distance[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def motions(law: JointCurve, n: int, deepest: float) -> np.ndarray:
    """Motions ``(n, 5)`` at positions everywhere, with speeds that stick, slide and leave fast."""
    rng = np.random.default_rng(8)
    e = positions(law, n, deepest, seed=7)
    v = 10.0 ** rng.uniform(-1, 3, (n, 1)) * rng.normal(size=(n, 2))
    return np.hstack([e, v, rng.normal(size=(n, 1))])


def remembers(law: ModuleType, path: np.ndarray) -> tuple[float, ...]:
    """The memory after accepted steps along ``path``."""
    memory = law.new_element()
    for ex, ey in path.tolist():
        memory = law.advance_element(memory, ex, ey)
    return memory


def values(law: ModuleType, memory: tuple[float, ...], given: np.ndarray) -> np.ndarray:
    """Force, torque and Jacobian ``(n, 18)`` of the motions."""
    results = [law.element(memory, m[:2], m[2:4], m[4]) for m in given.tolist()]
    return np.array([[*force, *np.ravel(jacobian)] for force, jacobian in results])


@pytest.mark.parametrize("name", LAWS)
def test_the_jacobian_is_the_derivative_of_the_force(name: str) -> None:
    """By central differences, to 1e-6 of its largest entries in a column, but at the points whose
    difference steps over a node of a table or over first loading."""
    curve = LAWS[name]()
    law = python(curve)
    memory = remembers(law, positions(curve, 12, 1.5))
    given = motions(curve, 60, 2.0)
    steps = np.array([1e-6 * curve.length, 1e-6 * curve.length, 1e-4, 1e-4, 1e-5])
    jacobian = values(law, memory, given)[:, 3:].reshape(-1, 3, 5)
    miss = np.empty_like(jacobian)
    for k, step in enumerate(steps):
        move = step * np.eye(5)[k]
        rise = values(law, memory, given + move)[:, :3] - values(law, memory, given - move)[:, :3]
        miss[:, :, k] = rise / (2 * step) - jacobian[:, :, k]
    size = np.abs(jacobian).max(axis=0) + 1e-30
    assert np.quantile(np.abs(miss / size).max(axis=(1, 2)), 0.97) < 1e-6
    assert np.abs(miss / size).max() < 0.05


def test_the_jacobian_of_a_formula_is_right() -> None:
    """The law fitted to runs has an element, too, which knows no way back."""
    law = python(FITTED)
    e = (0.06, 0.05)
    (Fx, Fy, T), jacobian = law.element(law.new_element(), e, (1.0, 50.0), 0.4)
    move = 1e-8
    moved, _ = law.element(law.new_element(), (e[0] + move, e[1]), (1.0, 50.0), 0.4)
    np.testing.assert_allclose(
        (np.array(moved) - (Fx, Fy, T)) / move, [row[0] for row in jacobian], rtol=1e-5
    )


@pytest.mark.parametrize("name", LAWS)
def test_a_straight_way_is_the_law(name: str) -> None:
    """Into a new joint and back along one line the element has the law's force: on loading within
    0.3 % of the largest one, on the way back within 8 %, where the law opens with a toe."""
    curve = LAWS[name]()
    law = python(curve)
    deep = 0.8 * curve.limit
    memory = law.new_element()
    for delta in np.linspace(0.0, deep, 60):
        force = (
            -law.element(memory, (0.6 * (curve.length + delta), 0.8 * (curve.length + delta)))[0][0]
            / 0.6
        )
        assert force == pytest.approx(float(curve.at(delta).load), abs=3e-3 * curve.at(deep).load)
        memory = law.advance_element(
            memory, 0.6 * (curve.length + delta), 0.8 * (curve.length + delta)
        )
    for delta in np.linspace(deep, 0.0, 50):
        e = curve.length + delta
        (Fx, Fy, T), _ = law.element(memory, (0.6 * e, 0.8 * e))
        wanted = float(curve.at(delta, deep).load)
        assert -(0.6 * Fx + 0.8 * Fy) == pytest.approx(wanted, abs=0.08 * curve.at(deep).load)
        assert abs(0.8 * Fx - 0.6 * Fy) < 2e-4 * float(curve.at(deep).load)
        assert T == 0


def test_a_table_says_where_the_element_is_below_its_force() -> None:
    """Where first loading and the way back have other shapes, as in tables of runs of few steps."""
    curve = yielding()
    assert "below the force of the law" not in export_law(curve, Path("law.h"))
    plain = elastic()
    x = plain.x
    steep = np.exp(0.05 * x)
    ratio = np.exp(-0.6 * x)
    stiff = {"y": plain.y * steep, "dy": (plain.dy + 0.05 * plain.y) * steep}
    bent = replace(plain, **stiff, ratio=ratio, dratio=-0.6 * ratio)
    law = python(bent)
    worst = 0.0
    for delta in np.linspace(0.01, 1.0, 200) * curve.limit:
        force = -law.element(law.new_element(), (curve.length + delta, 0.0))[0][0]
        worst = max(worst, float(bent.at(delta).load) - force)
    told = worst / float(bent.at(bent.limit).load)
    assert told > 0.02
    assert f"below the force of the law by up to {told:.1%} of the" in " ".join(law.__doc__.split())


@pytest.mark.parametrize("name", sorted({*LAWS} - {"elastic", "without touch"}))
def test_memory_only_loses_energy(name: str) -> None:
    """The energy given back from any displacement falls, or stays, as the deepest one grows."""
    curve = LAWS[name]()
    law = python(curve)
    deepest = np.linspace(0.0, curve.limit, 100)
    unit = curve.force * curve.length
    for most in deepest.tolist():
        for delta in np.linspace(0.0, most, 10).tolist():
            assert law.elastic(delta, most)[1] <= 1e-12 * unit / curve.length


@pytest.mark.parametrize("name", ["plane strain", "plane stress"])
def test_no_orbit_gains_energy(name: str, tmp_path: Path) -> None:
    """Random closed orbits, slow, without friction: the work done on the joint is not negative. On
    the second round the joint remembers all of it, and the work is nil."""
    if not shutil.which("gcc"):
        pytest.skip("gcc is not here")
    curve = LAWS[name]()
    (tmp_path / "law.h").write_text(export_law(curve, tmp_path / "law.h"))
    shutil.copy(Path(__file__).with_name("orbits.c"), tmp_path)
    subprocess.run(["gcc", "-O2", "orbits.c", "-o", "orbits", "-lm"], cwd=tmp_path, check=True)
    rng = np.random.default_rng(4)
    orbits = rng.normal(size=(2, 2, 2, 4)) / np.arange(1, 5)
    largest = curve.length * rng.uniform(1.5, 3.5, 2)
    data = np.hstack([orbits.reshape(2, -1), largest[:, None]])
    done = subprocess.run(
        [tmp_path / "orbits"], input=data.tobytes(), capture_output=True, check=True
    )
    first, second = np.frombuffer(done.stdout).reshape(-1, 2).T / (curve.force * curve.length)
    assert (first > -1e-9).all()
    assert first.max() > 0.1
    assert (np.abs(second) < 1e-9).all()


C_CLIENT = """
#include <stdio.h>
#include "law.h"
int main(void) {
    law_element_state state = {{0.0}, 0};
    double e[2], motion[5], out[19], n;
    if (fread(&n, sizeof(double), 1, stdin) != 1) return 1;
    for (int i = 0; i < (int)n; i++) {
        if (fread(e, sizeof(double), 2, stdin) != 2) return 2;
        law_advance_element(&state, e[0], e[1]);
    }
    while (fread(motion, sizeof(double), 5, stdin) == 5) {
        law_element(&state, &law_CONTACT, motion, out, out + 3);
        out[18] = law_stored_energy(state.deepest, motion[0], motion[1]);
        fwrite(out, sizeof(double), 19, stdout);
    }
    return state.outside;
}
"""
JAVASCRIPT_CLIENT = """
import { readFileSync, writeFileSync } from 'node:fs';
import * as law from './law.mjs';
const file = readFileSync('in');
const given = [...new Float64Array(file.buffer, file.byteOffset, file.length / 8)];
let memory = law.new_element();
let k = 1;
for (; k < 1 + 2 * given[0]; k += 2) memory = law.advance_element(memory, given[k], given[k + 1]);
const out = [];
for (; k < given.length; k += 5) {
    const m = given.slice(k, k + 5);
    const [force, jacobian] = law.element(memory, m.slice(0, 2), m.slice(2, 4), m[4]);
    out.push(...force, ...jacobian.flat(), law.stored_energy(memory, m[0], m[1]));
}
writeFileSync('out', Buffer.from(new Float64Array(out).buffer));
"""
OCTAVE_CLIENT = """
addpath('.'); law = law();
file = fopen('in', 'r'); given = fread(file, Inf, 'double'); fclose(file);
memory = law.new_element(); last = 1 + 2 * given(1);
for k = 2:2:last
    memory = law.advance_element(memory, given(k), given(k + 1));
end
motions = reshape(given(last + 1:end), 5, []);
out = zeros(19, columns(motions));
for k = 1:columns(motions)
    m = motions(:, k);
    [F, J] = law.element(memory, m(1:2), m(3:4), m(5), law.contact);
    out(:, k) = [F(:); reshape(J', [], 1); law.stored_energy(memory, m(1), m(2))];
end
file = fopen('out', 'w'); fwrite(file, out, 'double'); fclose(file);
"""
COMMANDS = {
    ".h": ["./law"],
    ".mjs": ["node", "client.mjs"],
    ".m": ["octave-cli", "--quiet", "--norc", "--eval", OCTAVE_CLIENT],
}


def answers(suffix: str, law: JointCurve, path: np.ndarray, given: np.ndarray, folder: Path):
    """Force, torque, Jacobian and stored energy ``(n, 19)`` by the export with this ``suffix``."""
    target = folder / f"law{suffix}"
    target.write_text(export_law(law, target, CONTACT), encoding="utf-8")
    data = np.concatenate([[len(path)], path.ravel(), given.ravel()])
    if suffix == ".mo":
        return _modelica(target.read_text(), path, given)
    program = COMMANDS[suffix][0]
    if suffix == ".h":
        program = "gcc"
    if not shutil.which(program):
        pytest.skip(f"{program} is not here")
    if suffix == ".h":
        (folder / "main.c").write_text(C_CLIENT)
        strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2"]
        careful = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
        subprocess.run(
            ["gcc", *strict, *careful, "main.c", "-o", "law", "-lm"], cwd=folder, check=True
        )
        done = subprocess.run(
            ["./law"], cwd=folder, input=data.tobytes(), capture_output=True, check=True
        )
        return np.frombuffer(done.stdout).reshape(-1, 19)
    data.tofile(folder / "in")
    (folder / "client.mjs").write_text(JAVASCRIPT_CLIENT)
    subprocess.run(COMMANDS[suffix], cwd=folder, check=True, capture_output=True)
    return np.fromfile(folder / "out").reshape(-1, 19)


def _modelica(package: str, path: np.ndarray, given: np.ndarray) -> np.ndarray:
    """The functions of the package, read as Python's, whose arrays begin with 1."""
    law = functions_of(package)
    memory = [None] + law["SECTORS"] * [0.0]
    for e in path.tolist():
        for k in range(law["SECTORS"]):
            memory[k + 1] = law["sector_deeper"](memory[k + 1], k, *e)
    contact = vars(CONTACT).values()
    return np.array(
        [
            [*law["forces"](memory, *m, *contact), law["stored_energy"](memory, *m[:2])]
            for m in given.tolist()
        ]
    )


@pytest.mark.parametrize("name", ["yielding", "elastic", "plane stress"])
@pytest.mark.parametrize("suffix", [".h", ".mjs", ".m", ".mo"])
def test_all_languages_give_the_same_forces(suffix: str, name: str, tmp_path: Path) -> None:
    """Python's, to 1e-12 of the largest in each column; at rest, too, and at no eccentricity."""
    curve = LAWS[name]()
    path = positions(curve, 12, 1.5)
    given = np.vstack([motions(curve, 100, 2.0), np.zeros((1, 5)), [[0.06, 0.0, 0.0, 0.0, 0.0]]])
    law = python(curve)
    memory = remembers(law, path)
    energy = [law.stored_energy(memory, *e) for e in given[:, :2].tolist()]
    wanted = np.column_stack([values(law, memory, given), energy])
    found = answers(suffix, curve, path, given, tmp_path)
    size = np.abs(wanted).max(axis=0)
    assert (np.abs(found - wanted) <= 1e-12 * size).all()
    assert (wanted[-2] == 0).all()


MISSPELLED = """
import * as law from './law.mjs';
const e = [0.06, 0.05], v = [20, -35];
const friction = (contact) => law.element(law.new_element(), e, v, 3, contact)[0][2];
if (Math.abs(friction({ mu_static: 0, mu_dynamic: 0 })) !== 0) process.exit(1);
try {
    friction({ mu: 0.3 });
    process.exit(2);
} catch (fault) {
    if (!/no mu, but damping/.test(fault.message)) process.exit(3);
}
"""


def test_javascript_knows_the_parameters_of_a_contact(tmp_path: Path) -> None:
    """One of another name was passed over, and the friction was that of the export."""
    if not shutil.which("node"):
        pytest.skip("node is not here")
    law = tmp_path / "law.mjs"
    law.write_text(export_law(yielding(), law, CONTACT), encoding="utf-8")
    (tmp_path / "client.mjs").write_text(MISSPELLED)
    subprocess.run(["node", "client.mjs"], cwd=tmp_path, check=True)


HIT = """
model Hit "a pin that hits its hole along a line and crosses to the other side"
  Law.Element joint(interval = {interval});
  Real ex(start = {start}, fixed = true);
  Real ey(start = 0.0, fixed = true);
  Real vx(start = {speed}, fixed = true);
  Real vy(start = 0.0, fixed = true);
equation
  joint.ex = ex;
  joint.ey = ey;
  joint.omega = 0.0;
  der(ex) = vx;
  der(ey) = vy;
  {mass} * der(vx) = joint.Fx;
  {mass} * der(vy) = joint.Fy;
end Hit;
"""


def test_a_modelica_compiler_simulates_the_element() -> None:
    """Rumoca's motion is what scipy integrates with the export in Python, but for the moments at
    which the memory is updated."""
    rumoca = pytest.importorskip("rumoca", reason="rumoca is not here (pip install rumoca)")
    curve = yielding()
    law = python(curve)
    mass = 0.2
    speed = 0.5 * np.sqrt(2 * curve.force * curve.limit / mass)
    end = 2.5 * curve.limit / speed
    given = {"interval": end / 500, "start": curve.length, "speed": speed, "mass": mass}
    source = export_law(curve, Path("Law.mo"), CONTACT) + HIT.format(**given)
    model = rumoca.Session().loads(source=source, model="Hit")
    found = model.simulate(t=end, dt=end / 2000, config=rumoca.SimConfig(rtol=1e-9, atol=1e-12))

    def motion(t, state):
        e, v, deepest = state
        memory = law.advance_element(law.new_element(), max(deepest, e), 0.0)
        (Fx, _, _), _ = law.element(memory, (e, 0.0), (v, 0.0))
        return [v, Fx / mass, max(v, 0.0) * (e >= deepest)]

    wanted = solve_ivp(
        motion, (0, end), [curve.length, speed, curve.length], rtol=1e-8, max_step=end / 1000
    )
    assert wanted.y[1, -1] < 0
    assert found.to_dataframe()["vx"].iloc[-1] == pytest.approx(wanted.y[1, -1], rel=1e-4)


def test_within_the_clearance_nothing_acts() -> None:
    """Whatever the speed; and nan of anything that is no number."""
    law = python(yielding())
    memory = law.new_element()
    for e in ((0.0, 0.0), (0.03, -0.04), (0.0499, 0.0)):
        force, jacobian = law.element(memory, e, (100.0, 50.0), 3.0)
        assert not np.any(force)
        assert not np.any(jacobian)
    for bad in (np.nan, np.inf):
        for motion in (
            (bad, 0, 0, 0, 0),
            (0.06, 0, bad, 0, 0),
            (0.06, 0, 0, 0, bad),
            (0, 0, 0, bad, 0),
        ):
            force, jacobian = law.element(memory, motion[:2], motion[2:4], motion[4])
            assert np.isnan([*force, *np.ravel(jacobian)]).all()
        assert np.isnan(law.advance_element(memory, bad, 0.0)).all()
    nan = (np.nan,) * law.SECTORS
    assert np.isnan(law.element(nan, (0.06, 0.0))[0]).all()
    assert np.isnan(
        [law.stored_energy(nan, 0.06, 0.0), law.stored_energy(memory, np.inf, 0.0)]
    ).all()
    assert np.isnan(law.advance_element(nan, 0.06, 0.0)).all()


def test_friction_has_its_static_and_dynamic_values() -> None:
    """At the speed of sticking and from three times this speed on; it opposes the slip of the
    pin's surface, and its torque is about the pin's centre."""
    law = python(elastic())
    N = -law.element(law.new_element(), (0.08, 0.0))[0][0]
    for slip, mu in ((3.0, 0.2), (-3.0, -0.2), (9.0, 0.12), (1e3, 0.12)):
        for v, omega in ((slip, 0.0), (0.0, slip / RADIUS), (2 * slip, -slip / RADIUS)):
            (_, Fy, T), _ = law.element(law.new_element(), (0.08, 0.0), (0.0, v), omega)
            assert Fy == pytest.approx(-mu * N, rel=1e-12)
            assert pytest.approx(-mu * N * RADIUS, rel=1e-12) == T


def test_the_force_never_pulls() -> None:
    """However fast the pin leaves."""
    law = python(elastic())
    for speed in np.geomspace(1, 1e6, 30):
        assert law.element(law.new_element(), (0.08, 0.0), (-speed, 0.0))[0][0] < 0


@pytest.mark.parametrize("restitution", [0.9, 0.7])
def test_an_impact_comes_back_with_its_restitution(restitution: float) -> None:
    """The damping of either author, of a good bounce: within what both approximate. A factor
    1 + c v on any elastic force leaves ``c v - ln(1 + c v)`` as it was."""
    law = python(elastic())
    speed = 50.0
    for damping in (law.hunt_crossley, law.lankarani_nikravesh):
        c = damping(restitution, speed)
        mass, step = 0.01, 1e-7
        e, v = 0.05, speed
        while e >= 0.05:
            force = law.element(law.new_element(), (e, 0.0), (v, 0.0), damping=c)[0][0]
            v += step * force / mass
            e += step * v
        kept = c * speed - np.log(1 + c * speed)
        assert c * v - np.log(1 + c * v) == pytest.approx(kept, rel=1e-2)
        assert -v / speed == pytest.approx(restitution, abs=0.12)


def test_the_examples_of_the_documentation_run(tmp_path: Path) -> None:
    """Python's of the force element in docs/law_exports.md, and C's, which says the same."""
    page = (Path(__file__).parents[3] / "docs" / "law_exports.md").read_text(encoding="utf-8")
    section = page.split("## The force element")[1]
    code = {name: section.split(f"```{name}\n")[1].split("```")[0] for name in ("py", "cpp")}
    curve = yielding()
    law = python(curve)
    space = {"lug_pin": law}
    exec(code["py"].replace("import lug_pin\n", ""), space)
    assert max(space["memory"]) > 0
    if not shutil.which("gcc"):
        pytest.skip("gcc is not here")
    (tmp_path / "lug_pin.h").write_text(export_law(curve, tmp_path / "lug_pin.h"))
    body = code["cpp"] + 'printf("%.15g %.15g %.15g", force[0], force[1], force[2]);'
    (tmp_path / "main.c").write_text(
        '#include <stdio.h>\n#include "lug_pin.h"\nint main(void) {' + body + "}"
    )
    subprocess.run(["gcc", "main.c", "-o", "main", "-lm"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    memory = law.new_element()
    given = {"damping": 0.002, "mu_static": 0.15, "mu_dynamic": 0.1, "stick_speed": 1.0}
    wanted, _ = law.element(memory, space["e"], space["v"], space["omega"], **given)
    np.testing.assert_allclose([float(word) for word in done.stdout.split()], wanted, rtol=1e-12)


def test_options_set_the_contact_of_an_export(tmp_path: Path) -> None:
    """They stand in the file; without --export they are refused."""
    scene = str(Path(__file__).parents[3] / "scenes" / "steel_pin.toml")
    target = tmp_path / "pin.h"
    options = ["--mu-static", "0.2", "--stick-speed", "2", "--damping", "0.5"]
    assert run(["law", "--scene", scene, "--export", str(target), *options]) == 0
    assert "pin_CONTACT = {0.5, 0.2, 0.2, 2.0};" in target.read_text()
    assert run(["law", "--scene", scene, *options]) == 2


@pytest.mark.parametrize(
    ("suffix", "more", "told"),
    [(".h", [], True), (".h", ["--mu-static", "0.2"], False), (".json", [], False)],
)
def test_friction_of_the_scene_is_in_the_force_alone(suffix, more, told, tmp_path, capsys) -> None:
    """The element has none that is not asked for, which is said."""
    scene = str(Path(__file__).parents[3] / "scenes" / "steel_pin.toml")
    words = ["law", "--scene", scene, "--set", "analysis.friction=0.2", *more]
    assert run([*words, "--export", str(tmp_path / f"pin{suffix}")]) == 0
    said = capsys.readouterr().err
    assert ("the friction of 0.2 is in the force P; the force element has no" in said) == told


def test_contacts_that_cannot_be() -> None:
    """One sentence each."""
    for given, said in (
        ({"damping": -1.0}, "damping"),
        ({"mu_static": 0.1, "mu_dynamic": 0.2}, "dynamic one"),
        ({"stick_speed": 0.0}, "stick_speed"),
    ):
        with pytest.raises(ValueError, match=said):
            Contact(**given)

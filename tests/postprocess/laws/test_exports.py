"""Exports of a joint's law: what they say is what the table says, in every language that can be run
here."""

from __future__ import annotations

import ast
import importlib.util
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from archord.cli import run
from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.scene.file import load_scene
from tests.postprocess.laws.curves import yielding_curve
from tests.postprocess.laws.modelica import functions_of

COLUMNS = ("load", "stiffness", "error", "residual", "peak", "angle")
EXTREMES = (0.0, -0.0, -1.0, 0.7, 1.0, 1 + 1e-8, 1.2, -np.inf, np.inf, np.nan)  # over the range
FUNCTIONS = ("force", "expected_error", "residual", "peak_pressure", "contact_angle")
C_CLIENT = """
#include <stdio.h>
#include "law.h"
int main(void) {
    double in[2], out[6];
    while (fread(in, sizeof(double), 2, stdin) == 2) {
        out[0] = law_force(in[0], in[1], out + 1);
        out[2] = law_expected_error(in[0], in[1]);
        out[3] = law_residual(in[1]);
        out[4] = law_peak_pressure(in[0]);
        out[5] = law_contact_angle(in[0]);
        fwrite(out, sizeof(double), 6, stdout);
    }
    law_state state = {0.0, 0};
    law_advance(&state, 0.9 * law_RANGE);
    if (state.outside || state.deepest != 0.9 * law_RANGE) return 1;
    law_advance(&state, 1.1 * law_RANGE);
    law_advance(&state, 0.0);
    if (!state.outside || state.deepest != 1.1 * law_RANGE) return 2;
    law_advance(&state, NAN);
    law_advance(&state, 0.0);
    return isnan(state.deepest) ? 0 : 3;
}
"""
OCTAVE_CLIENT = """
addpath('.'); warning('off', 'archord:outside');
law = law(); about = jsondecode(law.about);
assert(law.advance(1, 2) == 2 && law.in_range(law.range));
assert(isnan(law.advance(0.1, NaN)) && isnan(law.advance(NaN, 0.1)) && ~law.in_range(NaN));
file = fopen('in', 'r'); in = fread(file, [2 Inf], 'double'); fclose(file);
out = zeros(6, columns(in));
for k = 1:columns(in)
    x = in(1, k); deepest = in(2, k);
    [P, stiffness] = law.force(x, deepest);
    out(:, k) = [P; stiffness; law.expected_error(x, deepest); law.residual(deepest); ...
        law.peak_pressure(x); law.contact_angle(x)];
end
file = fopen('out', 'w'); fwrite(file, out, 'double'); fclose(file);
"""


def curves() -> dict[str, JointCurve]:
    """Joints that yield, that do not, without a law of first touch, with a title that comments and
    strings dislike."""
    about = {"title": 'a "joint" of */ formulas \\', "units": ["mm", "N/mm"], "largest error": 0.01}
    yielding = replace(yielding_curve(), length=0.05, force=7e3, pressure=210.0, about=about)
    one = np.ones_like(yielding.x)
    none = np.zeros_like(yielding.x)
    same = {"back": yielding.y, "dback": yielding.dy, "ratio": one, "dratio": none}
    elastic = replace(yielding, **same, back_error=none)
    return {
        "yielding": yielding,
        "elastic": elastic,
        "without touch": replace(yielding, touch=np.zeros(0)),
    }


@pytest.fixture(params=["yielding", "elastic", "without touch"])
def curve(request: pytest.FixtureRequest) -> JointCurve:
    return curves()[request.param]


pytestmark = pytest.mark.filterwarnings("ignore:archord. beyond")


def inputs(curve: JointCurve, n: int = 3_000) -> np.ndarray:
    """Pairs of displacement and deepest displacement ``(n + 100, 2)``: open, first touch, through
    the table and beyond; and every pair of `EXTREMES`."""
    rng = np.random.default_rng(19)
    delta, deepest = curve.limit * rng.uniform([-0.05, -0.05], [1.3, 1.2], (n, 2)).T
    delta[: n // 10] = curve.limit * 10 ** rng.uniform(-12, -1, n // 10)
    deepest[n // 20 : n // 5] = 1.2 * np.abs(delta[n // 20 : n // 5])
    usual = np.stack([delta, deepest], axis=1)
    return np.concatenate([usual, curve.limit * np.array(list(product(EXTREMES, repeat=2)))])


def check(curve: JointCurve, pairs: np.ndarray, values: np.ndarray) -> None:
    """Force within 1e-12 of the largest, other columns likewise, stiffness within 1e-9, as the
    table says; but for the stiffness next to where the joint opens on its way back, which has a
    logarithm's singularity."""
    delta, deepest = pairs.T
    state = curve.at(delta, deepest)
    first = curve.at(delta)
    wanted = (
        state.load,
        state.stiffness,
        state.error,
        curve.residual(deepest),
        first.peak_pressure,
        first.angle,
    )
    for name, ours, theirs in zip(COLUMNS, values.T, wanted, strict=True):
        if name == "stiffness":
            near = np.abs(delta - curve.residual(deepest)) <= 1e-7 * curve.limit
            far = ~near | (delta >= deepest)
            np.testing.assert_allclose(ours[far], theirs[far], rtol=1e-9, err_msg=name)
        else:
            largest = np.nanmax(np.abs(theirs))
            np.testing.assert_allclose(
                ours, theirs, rtol=0, atol=1e-12 * largest + 1e-16, err_msg=name
            )


def evaluate(law: dict[str, Any], pairs: np.ndarray) -> np.ndarray:
    """What functions say at the pairs, in the order of ``COLUMNS``."""
    force, error, residual, peak, angle = (law[name] for name in FUNCTIONS)
    return np.array(
        [(*force(x, z), error(x, z), residual(z), peak(x), angle(x)) for x, z in pairs.tolist()]
    )


def load(path: Path):
    spec = importlib.util.spec_from_file_location("law", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def write(curve: JointCurve, target: Path) -> Path:
    target.write_text(export_law(curve, target), encoding="utf-8")
    return target


def test_python_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 3 000 random pairs; it imports math alone, but for the one warning beyond its
    tables."""
    path = write(curve, tmp_path / "law.py")
    law = load(path)
    tops = [
        node
        for node in ast.parse(path.read_text()).body
        if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    assert [ast.unparse(node) for node in tops] == ["import math"]
    pairs = inputs(curve)
    with pytest.warns(UserWarning, match="beyond the tables") as caught:
        values = evaluate(vars(law), pairs)
    assert len(caught) == 1
    check(curve, pairs, values)
    assert curve.about == law.ABOUT
    assert law.advance(0.1, 0.2) == 0.2
    delta = curve.limit * np.array([-0.1, 0.3, 0.8])
    P, stiffness = law.force(delta, 0.5 * curve.limit)
    state = curve.at(delta, 0.5 * curve.limit)
    np.testing.assert_allclose(P, state.load, rtol=1e-10)
    np.testing.assert_allclose(stiffness, state.stiffness, rtol=1e-7)
    assert law.force(delta.tolist(), 0.5 * curve.limit) == (P.tolist(), stiffness.tolist())
    assert law.in_range(curve.limit)
    assert not law.in_range(1.001 * curve.limit)
    assert np.isnan([law.advance(0.1, np.nan), law.advance(np.nan, 0.1)]).all()
    assert not law.in_range(np.nan)


def test_c_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 3 000 random pairs, as strict C99 without a warning; and its state
    remembers."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if not compiler:
        pytest.skip("no C compiler is here")
    write(curve, tmp_path / "law.h")
    (tmp_path / "main.c").write_text(C_CLIENT)
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2"]
    careful = ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
    subprocess.run(
        [compiler, *strict, *careful, "main.c", "-o", "law", "-lm"], cwd=tmp_path, check=True
    )
    pairs = inputs(curve)
    done = subprocess.run(
        [tmp_path / "law"], input=pairs.tobytes(), capture_output=True, check=True
    )
    check(curve, pairs, np.frombuffer(done.stdout).reshape(-1, 6))


def test_octave_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 1 000 random pairs (an interpreter takes a millisecond for each)."""
    if not shutil.which("octave-cli"):
        pytest.skip("octave-cli is not here")
    write(curve, tmp_path / "law.m")
    pairs = inputs(curve, 400)
    pairs.tofile(tmp_path / "in")
    subprocess.run(
        ["octave-cli", "--quiet", "--norc", "--eval", OCTAVE_CLIENT], cwd=tmp_path, check=True
    )
    check(curve, pairs, np.fromfile(tmp_path / "out").reshape(-1, 6))


JAVASCRIPT_CLIENT = """
import { readFileSync, writeFileSync } from 'node:fs';
import * as law from './law.mjs';
const file = readFileSync('in');
const given = new Float64Array(file.buffer, file.byteOffset, file.length / 8);
const out = [];
for (let k = 0; k < given.length; k += 2) {
    const [x, z] = [given[k], given[k + 1]];
    out.push(...law.force(x, z), law.expected_error(x, z), law.residual(z));
    out.push(law.peak_pressure(x), law.contact_angle(x));
}
writeFileSync('out', Buffer.from(new Float64Array(out).buffer));
const fine = law.advance(1, 2) === 2 && law.in_range(law.RANGE) && law.ABOUT.title;
process.exit(fine && !law.in_range(NaN) && Number.isNaN(law.advance(0.1, NaN)) ? 0 : 1);
"""


def test_javascript_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 3 000 random pairs."""
    if not shutil.which("node"):
        pytest.skip("node is not here")
    write(curve, tmp_path / "law.mjs")
    (tmp_path / "client.mjs").write_text(JAVASCRIPT_CLIENT)
    pairs = inputs(curve)
    pairs.tofile(tmp_path / "in")
    done = subprocess.run(["node", "client.mjs"], cwd=tmp_path, check=True, capture_output=True)
    assert done.stderr.count(b"beyond the tables") == 1
    check(curve, pairs, np.fromfile(tmp_path / "out").reshape(-1, 6))


ARRAYS = """
addpath('.'); law = law(); refused = 0;
x = law.range * [0.1 0.2; 0.3 0.5];
calls = {@() law.force(x, 0), @() law.force(0.1 * law.range, x), @() law.residual(x), ...
    @() law.peak_pressure(x), @() law.advance(0, x), @() law.expected_error(-x(1, :), 0)};
for k = 1:numel(calls)
    try
        calls{k}();
    catch fault
        refused += ! isempty(strfind(fault.message, 'numbers, not arrays'));
    end
end
[P, stiffness] = law.force(x(1), 0);
assert(refused == numel(calls) && P > 0 && stiffness > 0);
assert(arrayfun(@(x) law.force(x, 0), x)(1) == P);
"""


def test_octave_takes_no_arrays(curve: JointCurve, tmp_path: Path) -> None:
    """Of square ones it multiplied matrices: pressures of -5500 MPa for 335, without a word."""
    if not shutil.which("octave-cli"):
        pytest.skip("octave-cli is not here")
    write(curve, tmp_path / "law.m")
    command = ["octave-cli", "--quiet", "--norc", "--eval", ARRAYS]
    subprocess.run(command, cwd=tmp_path, check=True)


def test_every_line_is_a_statement_or_a_comment(curve: JointCurve, tmp_path: Path) -> None:
    """In Octave's functions, whatever the length of the docstrings that became comments; and
    Modelica's descriptions end on the line on which they begin."""
    functions = export_law(curve, tmp_path / "law.m").split("\nfunction [doubt] = beyond")[1]
    statement = re.compile(
        r"function .*\)|persistent T|(if|for) [^;]*|else|end|warn_outside\(.*\);"
        r"|[\[\]\w, ]+ = .*;|%.*|"
    )
    for line in functions.splitlines()[1:]:
        assert statement.fullmatch(line.strip()), line
    for line in export_law(curve, tmp_path / "law.mo").splitlines():
        if line.strip().startswith("function "):
            assert re.fullmatch(r'  function \w+ ".*"', line)


def test_modelica_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 3 000 random pairs, its statements read as Python's: no Modelica compiler is at
    hand. All blocks end, and no function is called that is not there."""
    package = export_law(curve, tmp_path / "Law.mo")
    assert package.startswith("package Law ")
    assert package.endswith("end Law;\n")
    pairs = inputs(curve)
    check(curve, pairs, evaluate(functions_of(package), pairs))


IMPACT = """
model Impact "a mass that hits the joint and comes back"
  Law.Law joint;
  Real delta(start = 0.0, fixed = true);
  Real v(start = {speed}, fixed = true);
equation
  joint.delta = delta;
  der(delta) = v;
  {mass} * der(v) = -joint.P;
end Impact;
"""


def test_a_modelica_compiler_simulates_an_impact(curve: JointCurve, tmp_path: Path) -> None:
    """Rumoca's motion is what scipy integrates with the export in Python, the way back included."""
    rumoca = pytest.importorskip("rumoca", reason="rumoca is not here (pip install rumoca)")
    law = load(write(curve, tmp_path / "law.py"))
    mass = 0.2
    speed = 0.5 * np.sqrt(2 * curve.force * curve.limit / mass)
    end = 2.5 * curve.limit / speed
    source = export_law(curve, tmp_path / "Law.mo") + IMPACT.format(mass=mass, speed=speed)
    model = rumoca.Session().loads(source=source, model="Impact")
    found = model.simulate(t=end, dt=end / 2000, config=rumoca.SimConfig(rtol=1e-9, atol=1e-12))
    found = found.to_dataframe()

    def motion(t, state):
        delta, v, deepest = state
        deeper = max(deepest, delta)
        return [v, -law.force(delta, deeper)[0] / mass, max(v, 0.0) * (delta >= deepest)]

    wanted = solve_ivp(
        motion, (0, end), [0.0, speed, 0.0], rtol=1e-9, atol=1e-12, max_step=end / 2e3
    )
    assert found["v"].iloc[-1] < 0
    assert found["v"].iloc[-1] == pytest.approx(wanted.y[1, -1], rel=1e-6)
    assert found["delta"].iloc[-1] == pytest.approx(wanted.y[0, -1], abs=1e-6 * curve.limit)


def test_beyond_its_range_a_law_is_a_force_alone(curve: JointCurve) -> None:
    """The force goes on along its tangent; what else is said there is nan, and so is everything of
    nan."""
    end = curve.limit
    step = 1e-6 * curve.limit
    beyond = np.array([1 + 1e-8, 1.2, 100.0]) * end
    state = curve.at(beyond)
    edge = curve.at([end])
    np.testing.assert_allclose(state.load, edge.load + edge.stiffness * (beyond - end), rtol=1e-9)
    assert np.isnan(state[1:]).all()
    assert np.isfinite(edge).all()
    assert np.isfinite(curve.at([end * (1 + 1e-12)])).all()
    for delta, deepest in ((np.nan, 0.0), (0.5 * end, np.nan), (-step, np.nan), (np.inf, 0.0)):
        assert np.isnan(curve.at([delta], [deepest])).all()
    assert np.isnan(curve.residual([np.nan])).all()
    assert np.isnan(curve.displacement([np.nan])).all()
    back = curve.at([0.5 * end, -step], [1.2 * end])
    assert np.isfinite(back.load).all()
    assert (
        np.isnan([back.stiffness[0], back.error[0], curve.residual([1.2 * end])[0]]).all()
        == curve.yields
    )
    np.testing.assert_array_equal([values[1] for values in back], 0.0)


def test_no_contact_is_wider_than_the_hole(tmp_path: Path) -> None:
    """A quarter of a circle, in the table and in what is exported of it; a ring's may be wider,
    where its nodes are."""
    joint = LawJoint(10.0, 0.05, 1e5, pin_share=0.748, plane="strain", nu=0.49, pin_nu=0.49)
    curve = general_law(joint)
    delta = np.linspace(0, curve.limit, 3000)
    law = load(write(curve, tmp_path / "law.py"))
    assert curve.at(delta).angle.max() == np.pi / 2
    assert max(map(law.contact_angle, delta.tolist())) == np.pi / 2
    wide = replace(curve, angle=2 * curve.angle, dangle=2 * curve.dangle)
    assert wide.at(delta).angle.max() == pytest.approx(np.pi, rel=1e-6)


def test_a_joint_that_does_not_yield_needs_no_way_back(tmp_path: Path) -> None:
    """Its exports leave it out, and it is loading whatever the deepest displacement."""
    curve = curves()["elastic"]
    for suffix in (".py", ".h", ".mo", ".m", ".mjs"):
        text = export_law(curve, tmp_path / f"law{suffix}")
        assert "way_back" not in text
        assert "RATIO" not in text
        assert len(text) < 0.7 * len(export_law(curves()["yielding"], tmp_path / f"law{suffix}"))
    assert curve.at([0.02], [0.1]) == curve.at([0.02])


def test_numbers_of_numpy_are_numbers_of_files(tmp_path: Path) -> None:
    """And whole numbers are no integers of C."""
    given = {"radius": 10, "clearance": 0.05, "E_star": 115e3, "pin_yield": 300.0, "nu": 0.3}
    plain = LawJoint(**given, plane="strain", large_strain=True)
    kinds = {"radius": np.int64, "clearance": np.float64, "pin_yield": np.float32}
    numbers = {name: kinds.get(name, np.float64)(value) for name, value in given.items()}
    other = LawJoint(**numbers, plane=np.str_("strain"), large_strain=np.True_)
    for suffix in (".py", ".h", ".mo", ".m", ".mjs", ".json"):
        target = tmp_path / f"law{suffix}"
        text = export_law(replace(general_law(other), pin_length=np.float64(2.0)), target)
        assert text == export_law(replace(general_law(plain), pin_length=2.0), target)
        assert "enum { law_RADIUS" not in text
        assert "Integer RADIUS" not in text
        assert "np." not in text


def test_what_is_unknown_is_left_out(tmp_path: Path) -> None:
    """No pressure and angle, no functions that say them; JSON has null for them, and gives the
    table back."""
    curve = replace(yielding_curve(), peak=np.full(61, np.nan), angle=np.full(61, np.nan))
    assert "peak_pressure" not in (text := export_law(curve, tmp_path / "law.h"))
    assert "contact_angle" not in text
    text = export_law(curve, tmp_path / "law.json")
    again = JointCurve.from_json(text)
    assert "NaN" not in text
    np.testing.assert_array_equal(again.at([0.5], [1.0]), curve.at([0.5], [1.0]))


def test_exports_that_cannot_be(tmp_path: Path) -> None:
    """One sentence each."""
    curve = yielding_curve()
    for name in ("law.for", "law"):
        with pytest.raises(ValueError, match=r"\.py, \.h, \.mo, \.mjs, \.m or \.json"):
            export_law(curve, tmp_path / name)
    names = (
        "lug-pin.h 2.py force.m class.py math.py print.py math.h time.h string.h namespace.h "
        "restrict.h Bolzen_ä.py"
    )
    names += (
        " model.mo end.mo Real.mo Modelica.mo sqrt.mo max.m function.m endif.m parfor.m plot.m "
        "the_law.m _x.h"
    )
    for name in [*names.split(), f"{'x' * 64}.m", "a b.h"]:
        with pytest.raises(
            ValueError, match=f"^{re.escape(name)}: .* cannot name a law: .*; choose another name"
        ):
            export_law(curve, tmp_path / name)
    for name in (
        "function.json",
        "model.h",
        "end.h",
        "int_.h",
        f"{'x' * 63}.m",
        "Class.py",
        "real.mo",
    ):
        assert export_law(curve, tmp_path / name)
    with pytest.raises(ValueError, match="gaps in its tables cannot be exported: LOAD"):
        export_law(replace(curve, y=np.full(61, np.nan)), tmp_path / "law.h")
    with pytest.raises(ValueError, match="does not rise"):
        export_law(replace(curve, back=0 * curve.back), tmp_path / "law.h")


def test_what_octave_has_cannot_name_a_law(tmp_path: Path) -> None:
    """Its keywords; and all functions that an export calls."""
    if not shutil.which("octave-cli"):
        pytest.skip("octave-cli is not here")
    keywords = "printf('%s ', iskeyword(){:});"
    done = subprocess.run(
        ["octave-cli", "--norc", "--eval", keywords], capture_output=True, text=True, check=True
    )
    program = re.sub("%.*", "", export_law(curves()["yielding"], tmp_path / "lug.m"))
    called = re.findall(r"[^@\w.]([a-z_]\w*)\(", program)
    assert {"sqrt", "min", "warning"} <= {*called}
    variables = {"f", "df", "lug", "table", "d"}
    for name in {*done.stdout.split(), *called} - variables:
        with pytest.raises(ValueError, match="cannot name a law"):
            export_law(curves()["yielding"], tmp_path / f"{name}.m")


def test_the_examples_of_the_documentation_run(tmp_path: Path) -> None:
    """Python's and C's of docs/law_exports.md say the same; so does Octave's where it is here."""
    page = (Path(__file__).parents[3] / "docs" / "law_exports.md").read_text(encoding="utf-8")
    examples = dict(re.findall(r"```(python|c|octave)\n(.*?)```", page, re.S))
    curve = curves()["yielding"]
    for suffix in (".py", ".h", ".m"):
        write(curve, tmp_path / f"lug_pin{suffix}")
    for name, text in zip(("main.py", "main.c", "main.m"), examples.values(), strict=True):
        (tmp_path / name).write_text(text)
    commands = {sys.executable: ["main.py"], "octave-cli": ["--quiet", "--norc", "main.m"]}
    if shutil.which("gcc"):
        subprocess.run(["gcc", "main.c", "-o", "main", "-lm"], cwd=tmp_path, check=True)
        commands["./main"] = []
    state = curve.at([0.03], [0.05])
    wanted = [state.load[0], state.stiffness[0], curve.residual([0.05])[0]]
    for program, arguments in commands.items():
        if program == "./main" or shutil.which(program):
            done = subprocess.run(
                [program, *arguments], cwd=tmp_path, capture_output=True, text=True, check=True
            )
            np.testing.assert_allclose(
                [float(word) for word in done.stdout.split()], wanted, rtol=1e-10
            )


@pytest.mark.parametrize(("thickness", "unit", "pin"), [(None, "N/mm", 1.0), (25.0, "N", 25.0)])
def test_every_export_tells_the_unit_of_force_and_the_length(
    thickness, unit, pin, tmp_path: Path
) -> None:
    """In its head and as constants, alike in all languages; a force over its length is that of the
    unit length."""
    sets = [] if thickness is None else ["--set", f"analysis.thickness={thickness}"]
    files = {suffix: tmp_path / f"law.{suffix}" for suffix in ("py", "h", "mo", "m", "json")}
    exports = [word for file in files.values() for word in ("--export", str(file))]
    scene = str(Path(__file__).parents[3] / "scenes" / "steel_pin.toml")
    assert run(["law", "--scene", scene, *sets, *exports]) == 0
    law = load(files["py"])
    told = json.loads(files["json"].read_text())
    assert ("mm", unit, pin) == (law.LENGTH_UNIT, law.FORCE_UNIT, law.PIN_LENGTH)
    assert (told["length_unit"], told["force_unit"], told["pin_length"]) == ("mm", unit, pin)
    constants = {
        "h": 'static const char law_{} = "{}";',
        "mo": '  constant String {} = "{}";',
        "m": "    T.{} = '{}';",
    }
    for suffix, form in constants.items():
        text = files[suffix].read_text()
        brackets = "[]" if suffix == "h" else ""
        assert form.format(f"FORCE_UNIT{brackets}", unit) in text
        assert form.format(f"LENGTH_UNIT{brackets}", "mm") in text
        assert re.search(rf"PIN_LENGTH = {pin}", text)
    rule = (
        "do not multiply them by the length" if thickness else "multiply them by the pin's length"
    )
    for file in files.values():
        words = " ".join(file.read_text().split())
        assert f"force P in {unit}, " in words
        assert rule in words
    curve = JointCurve.from_json(files["json"].read_text())
    scene_law = general_law(LawJoint.from_scene(load_scene(scene)))
    assert law.force(0.05)[0] / pin == pytest.approx(float(scene_law.at(0.05).load), rel=1e-12)
    assert float(curve.at(0.05).load) / curve.pin_length == pytest.approx(
        float(scene_law.at(0.05).load), rel=1e-12
    )


def test_files_of_earlier_versions_are_read() -> None:
    """They named no units."""
    curve = curves()["yielding"]
    data = json.loads(curve.to_json())
    for name in ("length_unit", "force_unit", "pin_length"):
        del data[name]
    assert JointCurve.from_json(json.dumps(data)).pin_length == 1

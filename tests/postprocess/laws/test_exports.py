"""Exports of a joint's law: what they say is what the table says, in every language that can be run here."""

from __future__ import annotations

import ast
import importlib.util
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from archord.postprocess.laws.exports.export import export_curve
from archord.postprocess.laws.joint_curve import JointCurve
from tests.postprocess.laws.curves import yielding_curve

COLUMNS = ("load", "stiffness", "error", "residual", "peak", "angle")
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
    return state.outside && state.deepest == 1.1 * law_RANGE ? 0 : 2;
}
"""
OCTAVE_CLIENT = """
addpath('.'); warning('off', 'archord:outside');
law = law(); about = jsondecode(law.about); assert(law.advance(1, 2) == 2 && law.in_range(law.range));
file = fopen('in', 'r'); in = fread(file, [2 Inf], 'double'); fclose(file);
out = zeros(6, columns(in));
for k = 1:columns(in)
    x = in(1, k); deepest = in(2, k);
    [P, stiffness] = law.force(x, deepest);
    out(:, k) = [P; stiffness; law.expected_error(x, deepest); law.residual(deepest); law.peak_pressure(x); ...
        law.contact_angle(x)];
end
file = fopen('out', 'w'); fwrite(file, out, 'double'); fclose(file);
"""


def curves() -> dict[str, JointCurve]:
    """Joints that yield, that do not, without a law of first touch, with a title that comments and strings dislike."""
    about = {"title": 'a "joint" of */ formulas \\', "units": ["mm", "N/mm"], "largest error": 0.01}
    yielding = replace(yielding_curve(), length=0.05, force=7e3, pressure=210.0, about=about)
    one, none = np.ones_like(yielding.x), np.zeros_like(yielding.x)
    elastic = replace(yielding, back=yielding.y, dback=yielding.dy, ratio=one, dratio=none)
    return {"yielding": yielding, "elastic": elastic, "without touch": replace(yielding, touch=np.zeros(0))}


@pytest.fixture(params=["yielding", "elastic", "without touch"])
def curve(request: pytest.FixtureRequest) -> JointCurve:
    return curves()[request.param]


def inputs(curve: JointCurve, n: int = 10_000) -> np.ndarray:
    """Pairs of displacement and deepest displacement ``(n, 2)``: open, first touch, through the table and beyond."""
    rng = np.random.default_rng(19)
    delta, deepest = curve.limit * rng.uniform([-0.05, -0.05], [1.3, 1.2], (n, 2)).T
    delta[: n // 10] = curve.limit * 10 ** rng.uniform(-12, -1, n // 10)
    deepest[n // 20 : n // 5] = 1.2 * np.abs(delta[n // 20 : n // 5])
    return np.stack([delta, deepest], axis=1)


def check(curve: JointCurve, pairs: np.ndarray, values: np.ndarray) -> None:
    """Force within 1e-12 of the largest, other columns likewise, stiffness within 1e-9, as the table says; but for the
    stiffness next to where the joint opens on its way back, which has a logarithm's singularity."""
    delta, deepest = pairs.T
    state, first = curve.at(delta, deepest), curve.at(delta)
    wanted = (state.load, state.stiffness, state.error, curve.residual(deepest), first.peak_pressure, first.angle)
    for name, ours, theirs in zip(COLUMNS, values.T, wanted, strict=True):
        if name == "stiffness":
            far = np.abs(delta - curve.residual(deepest)) > 1e-7 * curve.limit
            far |= delta >= deepest
            np.testing.assert_allclose(ours[far], theirs[far], rtol=1e-9, err_msg=name)
        else:
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12 * np.abs(theirs).max() + 1e-16, err_msg=name)


def load(path: Path):
    spec = importlib.util.spec_from_file_location("law", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def write(curve: JointCurve, target: Path) -> Path:
    target.write_text(export_curve(curve, target), encoding="utf-8")
    return target


def test_python_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 10 000 random pairs; it imports math alone, but for the one warning beyond its tables."""
    path = write(curve, tmp_path / "law.py")
    law = load(path)
    tops = [node for node in ast.parse(path.read_text()).body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert [ast.unparse(node) for node in tops] == ["import math"]
    pairs = inputs(curve)
    with pytest.warns(UserWarning, match="beyond the tables") as caught:
        rows = [
            (
                *law.force(x, most),
                law.expected_error(x, most),
                law.residual(most),
                law.peak_pressure(x),
                law.contact_angle(x),
            )
            for x, most in pairs.tolist()
        ]
    assert len(caught) == 1
    check(curve, pairs, np.array(rows))
    assert curve.about == law.ABOUT
    assert law.advance(0.1, 0.2) == 0.2
    assert law.in_range(curve.limit)
    assert not law.in_range(1.001 * curve.limit)
    assert np.isnan(law.force(float("nan"))[0])


def test_c_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 10 000 random pairs, as strict C99 without a warning; and its state remembers."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if not compiler:
        pytest.skip("no C compiler is here")
    write(curve, tmp_path / "law.h")
    (tmp_path / "main.c").write_text(C_CLIENT)
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2"]
    subprocess.run([compiler, *strict, "main.c", "-o", "law", "-lm"], cwd=tmp_path, check=True)
    pairs = inputs(curve)
    done = subprocess.run([tmp_path / "law"], input=pairs.tobytes(), capture_output=True, check=True)
    check(curve, pairs, np.frombuffer(done.stdout).reshape(-1, 6))


def test_octave_says_what_the_table_says(curve: JointCurve, tmp_path: Path) -> None:
    """To 1e-12, on 1 000 random pairs (an interpreter takes a millisecond for each)."""
    if not shutil.which("octave-cli"):
        pytest.skip("octave-cli is not here")
    write(curve, tmp_path / "law.m")
    pairs = inputs(curve, 1000)
    pairs.tofile(tmp_path / "in")
    subprocess.run(["octave-cli", "--quiet", "--norc", "--eval", OCTAVE_CLIENT], cwd=tmp_path, check=True)
    check(curve, pairs, np.fromfile(tmp_path / "out").reshape(-1, 6))

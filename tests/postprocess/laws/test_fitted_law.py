"""The exported law is the law."""

import ast
import json
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from archord.postprocess.laws.exports.export import export_law
from archord.postprocess.laws.fitted_law import FittedLaw
from archord.postprocess.laws.law import LawRangeWarning
from tests.postprocess.laws.modelica import functions_of

ELASTIC = FittedLaw(k=0.83, E_star=1.05e5, R=10.0, dR=0.05, k_error=0.001, fitted_range=(0.1, 2.0))
PLASTIC = FittedLaw(
    k=0.83 + 1e-16,
    E_star=1.05e5,
    R=10.0,
    dR=0.05,
    k_error=0.001,
    c=1 / 3,
    sigY=230.7,
    c_error=0.02,
    fitted_to=('a "quoted"\nrun """',),
    rms=0.1326,
    largest=-0.35,
)
DELTA = np.array([-0.1, 0.0, 1e-9, 0.003, 0.01, 0.02, 0.1, 1.0])


BOTH = pytest.mark.parametrize("law", [ELASTIC, PLASTIC], ids=["elastic", "plastic"])


@BOTH
def test_json_gives_the_law_back(law):
    """Every digit, also out of the file of ``archord fit --json``."""
    for data in (law.model_dump(), {"law": law.model_dump(), "fits": []}):
        assert FittedLaw.from_json(json.dumps(data)) == law


def test_a_file_of_version_0_1_is_read():
    text = """{"law": {"k": 0.8559703192031349, "E_star": 105000.0, "R": 10.0, "dR": 0.05,
    "k_error": 0.00815, "c": 0.9390129955486293, "sigY": 230.76923076923077, "c_error": 0.00247,
    "fitted_range": [0.1, 2.0], "plane": "stress", "length_unit": "mm", "force_unit": "N/mm",
    "fitted_to": ["runs/steel_stress"]}, "laws": []}"""
    assert FittedLaw.from_json(text).force(0.1) == pytest.approx(4674.72, rel=5e-3)  # P of the run


@BOTH
def test_the_python_module_needs_only_math_and_gives_the_same(law, tmp_path):
    """In an interpreter without site packages, to the last digits, whatever runs are called."""
    source = export_law(law, tmp_path / "joint.py")
    tops = [node for node in ast.parse(source).body if isinstance(node, ast.Import)]
    assert [alias.name for node in tops for alias in node.names] == ["math"]
    (tmp_path / "joint.py").write_text(source)
    inside = DELTA[:-1]
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from joint import force\n"
    code += f"print([force(d) for d in {inside.tolist()}])"
    command = [sys.executable, "-I", "-S", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    force, stiffness = np.transpose(ast.literal_eval(done.stdout))
    np.testing.assert_allclose(force, law.force(inside), rtol=1e-14, atol=0)
    np.testing.assert_allclose(stiffness, law.stiffness(inside), rtol=1e-13, atol=0)


@BOTH
def test_c_and_modelica_give_the_same(law, tmp_path):
    """Modelica's statements read as Python's; C as strict C99 without a warning."""
    inside = DELTA[:-1].tolist()
    force = functions_of(export_law(law, tmp_path / "Joint.mo"))["force"]
    np.testing.assert_allclose([force(d, 0.0)[0] for d in inside], law.force(inside), rtol=1e-14)
    if not (compiler := shutil.which("gcc")):
        pytest.skip("no C compiler is here")
    (tmp_path / "joint.h").write_text(export_law(law, tmp_path / "joint.h"))
    calls = "".join(f'printf("%.17g ", joint_force({d!r}, 0.0, &slope));' for d in inside)
    main = '#include <stdio.h>\n#include "joint.h"\nint main(void) { double slope; %s return 0; }'
    (tmp_path / "main.c").write_text(main % calls)
    strict = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([compiler, *strict, "main.c", "-o", "main", "-lm"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True)
    said = [float(word) for word in done.stdout.split()]
    np.testing.assert_allclose(said, law.force(inside), rtol=1e-14)


@BOTH
def test_stiffness_is_the_slope_and_displacement_the_inverse(law):
    """Central differences away from first touch; of any shape, the open joint and the unreachable
    included."""
    delta = DELTA[2:]
    h = 1e-5 * delta
    slope = (law.force(delta + h) - law.force(delta - h)) / (2 * h)
    np.testing.assert_allclose(law.stiffness(delta), slope, rtol=1e-7)
    np.testing.assert_allclose(
        law.displacement(law.force(delta).reshape(2, 3)), delta.reshape(2, 3), rtol=1e-12
    )
    np.testing.assert_array_equal(law.displacement([-1.0, 0.0]), 0)
    assert (law.stiffness(DELTA[:2]) == 0).all()


def test_beyond_what_it_was_fitted_to_it_warns():
    """The module has that displacement, and warns, too; nan gives nan in both."""
    module = {"__name__": "joint"}
    exec(export_law(ELASTIC, Path("joint.py")), module)
    assert module["RANGE"] == 2.0 * ELASTIC.dR
    said = r"delta = 3 dR is beyond the 2 dR that the law was fitted to"
    with pytest.warns(LawRangeWarning, match=said):
        beyond = ELASTIC.force([0.01, 0.15])[1]
    with pytest.warns(UserWarning, match="beyond"):
        P, stiffness = module["force"](0.15)
    assert pytest.approx(beyond, rel=1e-14) == P
    assert np.isnan(stiffness)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert (ELASTIC.force([0.0, 0.01, 0.1]) >= 0).all()
        assert ELASTIC.displacement(1e5) > 0
        for law in (ELASTIC, PLASTIC):
            exec(export_law(law, Path("joint.py")), module)
            said = [law.force(np.nan), law.stiffness(np.nan), law.displacement(np.nan)]
            assert np.isnan([*said, *module["force"](np.nan)]).all()


def test_octave_has_the_formula_too(tmp_path):
    """A function without tables knows where the range ends."""
    if not shutil.which("octave-cli"):
        pytest.skip("octave-cli is not here")
    (tmp_path / "joint.m").write_text(export_law(ELASTIC, Path("joint.m")))
    asked = "law = joint(); [P, S] = law.force(0.02, 0); [Q, T] = law.force(0.2, 0);"
    script = f"warning('off', 'archord:outside'); {asked} printf('%.17g ', P, S, Q, T);"
    command = ["octave-cli", "--quiet", "--norc", "--eval", script]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    found = [float(word) for word in done.stdout.split()]
    with pytest.warns(LawRangeWarning):
        wanted = [ELASTIC.force(0.02), ELASTIC.stiffness(0.02), ELASTIC.force(0.2), np.nan]
    np.testing.assert_allclose(found, wanted, rtol=1e-14)


def test_every_export_says_how_good_it_is():
    for suffix in ("py", "h", "mo", "m"):
        text = export_law(PLASTIC, Path(f"joint.{suffix}"))
        good = "error against the runs that it was fitted to: 13.26% rms, -35.00% at worst"
        assert good in " ".join(text.split())
        assert "fitted to: unknown" in export_law(ELASTIC, Path(f"joint.{suffix}"))
    assert FittedLaw.from_json(export_law(PLASTIC, Path("joint.json"))) == PLASTIC


def test_the_plastic_law_has_a_largest_force():
    """2 sqrt(2) c sigY R; just below it a large displacement, from it on none."""
    limit = 2 * np.sqrt(2) * PLASTIC.c * PLASTIC.sigY * PLASTIC.R
    assert PLASTIC.force(1e9) == pytest.approx(limit, rel=1e-9)
    assert PLASTIC.displacement(0.999 * limit) > 100 * PLASTIC.dR
    assert np.isnan(PLASTIC.displacement(1.001 * limit))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "Expecting property name"),
        ("[1]", "Input should be a valid dictionary"),
        ('{"k": 1}', "E_star\n  Field required"),
        (json.dumps(ELASTIC.model_dump() | {"k": -0.83}), "k\n  Input should be greater than 0"),
        (json.dumps(ELASTIC.model_dump() | {"c": 1.0}), "c and sigY belong together"),
    ],
)
def test_what_is_no_law(text, said):
    with pytest.raises(ValueError, match=said):
        FittedLaw.from_json(text)

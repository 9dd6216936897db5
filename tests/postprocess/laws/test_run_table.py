"""Any run as a table: through its steps, back along its own unloading, with errors that hold; what
is refused."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import archord
from archord.benchmarks.case import paper_joint
from archord.cli import run as command
from archord.postprocess.laws.exports.program import Program
from archord.postprocess.laws.general.general_law import general_law
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.joint_curve import JointCurve
from archord.postprocess.laws.run_table import _left_out, _steps_asked, run_table
from archord.postprocess.run import Run
from archord.report.errors import InputError
from archord.scene.file import load_scene, parse_any
from tests.output.run_files import solved

SCENES = Path(__file__).parents[3] / "scenes"
# of yielding, and of the range, in clearances
ONSET = 0.6
END = 2.0


def elastic(u):
    """A force that begins like a contact of lines."""
    return np.maximum(u, 0.0) ** 1.2 * (1 + 0.1 * np.maximum(u, 0.0))


def opens(x):
    """Where the joint opens after it was at ``x``."""
    return 0.3 * np.maximum(x - ONSET, 0.0) ** 1.5


def dissipated(x):
    """int P dz: what is lost as unloading shifts."""
    fine = np.linspace(0.0, END, 20001)
    z = opens(fine)
    P = elastic(fine - opens(fine))
    return np.interp(x, fine, np.append(0.0, np.cumsum(np.diff(z) * (P[1:] + P[:-1]) / 2)))


def path(*targets, n=20):
    """Displacements from target to target."""
    ends = [0.0, *targets]
    return np.concatenate(
        [np.linspace(a, b, n + 1)[1:] for a, b in zip(ends, targets, strict=False)]
    )


def synthetic(x, yields=True, keep=None, **changes):
    """A run over the clearances ``x`` of a joint whose unloading shifts by `opens` and is
    `elastic`."""
    scene = paper_joint(0.1, 6, 0.002 if yields else None)
    deepest = np.maximum.accumulate(x)
    P = elastic(x - yields * opens(deepest))
    lost = yields * dissipated(deepest)
    dR = scene.joint.dR
    unit = scene.E_star * scene.joint.dR
    columns = {"delta": x * dR, "P": P * unit, "p0": np.sqrt(P) * unit, "eps": np.sqrt(P)}
    columns["plastic_dissipation"] = lost * dR * unit
    columns = {name: list(np.asarray(values)[:keep]) for name, values in columns.items()} | changes
    return SimpleNamespace(
        folder=SCENES,
        scene=scene,
        columns=columns,
        units={"delta": "mm", "P": "N/mm"},
        has_contact=True,
        steps=len(columns["P"]),
        number=lambda step: step,
        summary={"versions": {}},
    )


CYCLES = path(0.4, 0.0, 1.0, 0.0, 1.5, 0.0, END, 0.0)
SHIFTED = synthetic(CYCLES)


def test_it_passes_through_the_steps_of_the_run() -> None:
    """Force, pressure and angle at the steps of first loading; the force at those of the last
    unloading."""
    curve = run_table(SHIFTED)
    run = SHIFTED.columns
    delta = np.array(run["delta"])
    P = np.array(run["P"])
    first = np.append(True, np.diff(np.maximum.accumulate(delta)) > 0)
    state = curve.at(delta[first])
    np.testing.assert_allclose(state.load, P[first], rtol=1e-12)
    np.testing.assert_allclose(state.peak_pressure, np.array(run["p0"])[first], rtol=1e-9)
    np.testing.assert_allclose(state.angle, np.array(run["eps"])[first], rtol=1e-9)
    np.testing.assert_allclose(
        curve.at(delta[-20:], delta.max()).load, P[-20:], rtol=1e-9, atol=1e-9 * P.max()
    )


def test_a_pin_that_is_lifted_first_has_the_table_of_one_that_is_not() -> None:
    lifted = run_table(synthetic(path(-0.3, END, 0.0)))
    pressed = run_table(synthetic(path(0.0, END, 0.0)))
    delta = np.linspace(0.2, 0.9, 5) * END * pressed.length
    np.testing.assert_allclose(lifted.at(delta).load, pressed.at(delta).load, rtol=1e-2)


def test_it_finds_every_way_back_from_one() -> None:
    """Unloading that shifts by dD/P: from any displacement it opens where it does, and loses what
    it dissipates."""
    curve = run_table(synthetic(path(END, 0.0, n=40)))
    deepest = np.array([0.1, 0.4, 0.8, 1.3, 1.8])
    np.testing.assert_allclose(
        curve.residual(deepest * curve.length) / curve.length, opens(deepest), atol=3e-3
    )
    assert (curve.residual(np.linspace(0.0, curve.limit, 400)) >= 0).all()
    for most in deepest:
        x = np.linspace(0.0, most, 2001)
        there = curve.at(x * curve.length).load
        back = curve.at(x * curve.length, most * curve.length).load
        assert (back <= there).all()
        lost = np.sum((there - back)[1:] + (there - back)[:-1]) / 2 * (x[1] / curve.force)
        work = np.sum(there[1:] + there[:-1]) / 2 * (x[1] / curve.force)
        assert lost == pytest.approx(dissipated(most), abs=4e-3 * work)


def test_errors_are_measured_where_they_can_be() -> None:
    """9 in 10 forces between steps lie within the cubic's; that of the way back is of the
    unloadings not used."""
    coarse = run_table(synthetic(path(END, 0.0, n=10)))
    x = np.linspace(0.0, END, 401)
    state = coarse.at(x * coarse.length)
    wrong = np.abs(state.load / coarse.force - elastic(x - opens(x)))
    assert np.mean(wrong <= state.error / coarse.force + 1e-12) > 0.9
    assert wrong.max() < 1e-3 * elastic(END)
    assert coarse.about["error of the way back"].startswith("not measured")
    cycles = run_table(SHIFTED)
    assert cycles.about["error of the way back"].endswith("in 3 others")
    assert cycles.back_error.max() < 0.01
    accurate = synthetic(CYCLES)
    accurate.summary["accuracy"] = {"estimated": 1e-2}
    np.testing.assert_allclose((run_table(accurate).error - cycles.error)[-1], 1e-2, rtol=1e-9)


@pytest.mark.parametrize("strength", [None, 150.0, 230.0])
def test_it_tells_how_many_steps_one_per_cent_asks_for(strength) -> None:
    """With a quarter more the error of equal steps is below 1 %, and it says that they are
    enough."""
    joint = LawJoint(10.0, 0.05, 115385.0, strength, strength, plane="strain", nu=0.3)

    def said(n: int) -> str:
        x = np.linspace(0, 2, n + 1)
        y = general_law(joint).at(x * joint.clearance).load
        return _steps_asked(x[1:], _left_out(x, y)[1:] / y[1:])

    assert "of this run are enough above 10%" in said(100)
    coarse = said(20 if strength else 6)
    wanted = int(re.findall(r"about (\d+) of equal length", coarse)[0])
    assert 6 < wanted < 50
    assert "are enough" in said(int(1.25 * wanted))
    assert re.search("about|enough", run_table(synthetic(path(END, 0.0))).about["steps for 1 %"])


def test_an_elastic_joint_comes_back_as_it_went() -> None:
    """Without dissipation the way back is first loading, whether the run unloads or not."""
    for targets in ((END,), (END, 0.0)):
        curve = run_table(synthetic(path(*targets), yields=False))
        x = np.linspace(0.0, END, 101) * curve.length
        np.testing.assert_allclose(
            curve.at(x, curve.limit).load, curve.at(x).load, atol=1e-10 * curve.force
        )
        assert abs(curve.residual(curve.limit)) < 1e-10


def test_friction_makes_the_way_back_of_an_elastic_joint_known_less_well() -> None:
    """Where it comes back by other forces than it went; the expected error says so."""
    x = path(1.0, 0.0, END, 0.0)
    back = np.append(0, np.diff(x)) < 0
    elastic_run = synthetic(x, yields=False)
    P = np.array(elastic_run.columns["P"]) * np.where(back, 0.95, 1.0)
    curve = run_table(synthetic(x, yields=False, P=list(P)))
    deepest = END * curve.length
    off = np.abs(curve.at(0.6 * deepest, deepest).load - 0.95 * curve.at(0.6 * deepest).load)
    assert off < curve.at(0.6 * deepest, deepest).error < 0.06 * P.max()
    assert curve.at(0.6 * deepest).error < 0.1 * off
    assert not run_table(elastic_run).yields
    assert not run_table(synthetic(x, yields=False, friction_dissipation=[0.1] * len(x))).yields
    almost = P / np.where(back, 0.9501, 1.0)
    assert not run_table(synthetic(x, yields=False, P=list(almost))).yields


def test_an_unloading_that_ends_early_is_extended() -> None:
    curve = run_table(synthetic(path(END, 1.2)))
    assert "extended from" in curve.about["way back"]
    assert curve.residual([curve.limit])[0] / curve.length == pytest.approx(opens(END), abs=0.05)


def general(**changes):
    """A run of a general scene whose pin is pushed along -x and touches at 0.13."""
    scene = load_scene(SCENES / "bushing.toml", ["load.displacement=-0.8"])
    run = synthetic(path(0.8), yields=False)
    q = path(0.8)
    run.scene = scene
    run.units = {"pull displacement": "mm", "pull force": "N/mm"}
    steps = np.append(0.0, q)  # the sleeve is pressed in first
    run.columns = {
        "pull displacement": -steps,
        "pull force": -elastic(steps - 0.13),
        "plastic_dissipation": 0 * steps,
    }
    run.columns |= changes
    run.steps = len(steps)
    return run


def test_a_load_of_a_general_scene_has_a_table_too() -> None:
    """In the units of the run, positive the way it goes, from where contact begins; of the load
    that is named."""
    run = general()
    curve = run_table(run, "pull")
    np.testing.assert_allclose(
        curve.at(path(0.8)).load, elastic(path(0.8) - 0.13), rtol=1e-12, atol=1e-12
    )
    assert curve.about["contact begins at"].startswith("0.13")
    assert curve.residual([0.8])[0] == pytest.approx(0.13, abs=0.002)
    assert run_table(run).about == curve.about
    assert np.isnan(curve.at([0.5]).peak_pressure)


@pytest.mark.parametrize(
    ("file", "load", "length"),
    [
        ("lug_in_space", "pull", 12.0),
        ("joint_in_space", "press", 10.0),
        ("clevis_in_space", "", 16.0),
    ],
)
def test_forces_in_space_are_total(file, load, length) -> None:
    """Of the thickness that the pin lies in; exports say that nothing is to be multiplied by it."""
    given = load_scene(SCENES / f"{file}.toml")
    run = general()
    run.scene = parse_any(given.general()) if file == "joint_in_space" else given
    name = load or run.scene.load[0].name
    run.columns |= {
        f"{name} {what}": run.columns[f"pull {what}"] for what in ("displacement", "force")
    }
    run.columns = {column: values[1:] for column, values in run.columns.items()}
    run.units = {f"{name} displacement": "mm", f"{name} force": "N"}
    run.columns |= {f"{part.name} largest pressure": [0.0] * 20 for part in run.scene.interaction}
    curve = run_table(run, name)
    assert curve.pin_length == length
    assert "do not multiply" in Program.of(curve).units
    of_own_mesh = Program.of(replace(curve, pin_length=1.0))
    assert "total: " in of_own_mesh.units
    assert "do not multiply" in of_own_mesh.units
    assert "multiply them by" in Program.of(replace(curve, pin_length=1.0, force_unit="N/mm")).units


falling = list(synthetic(path(END), yields=False).columns["P"])
falling[12] = falling[11]
after_a_fit = list(general().columns["pull force"])
after_a_fit[13] = after_a_fit[12]


@pytest.mark.parametrize(
    ("run", "of", "said"),
    [
        (
            synthetic(path(END, n=5)),
            None,
            "has 5 steps of first loading with contact, and a table needs 6",
        ),
        (synthetic(path(END), P=[0.0] * 20), None, "has 0 steps"),
        (synthetic(path(END)), None, "yields and never unloads"),
        (synthetic(path(0.3, 0.0, END)), None, "yields and never unloads"),
        # it comes back by forces that are lower, by 3 % of the largest with a coefficient of 0.3
        (
            synthetic(path(END), yields=False, friction_dissipation=[0.1] * 20),
            None,
            "has friction and never unloads",
        ),
        (synthetic(path(END, 1.8, n=20), keep=21), None, "unloads in 2 steps"),
        (
            synthetic(path(END), yields=False, P=falling),
            None,
            "does not rise from 0.006 mm (step 12) to 0.0065 mm",
        ),
        (synthetic(path(END)), "pull", "which has one load"),
        (general(), "press", "--of must name one of its loads: pull."),
        (general(**{"pull force": [-1.0] * 21}), None, "before the load moves"),
        # the step of the fit counts
        (general(**{"pull force": after_a_fit}), None, "(step 13) to 0.52 mm (step 14)"),
    ],
)
def test_what_makes_no_table_is_refused(run, of, said) -> None:
    with pytest.raises(InputError, match=said.replace("(", r"\(").replace(")", r"\)")):
        run_table(run, of)


def test_a_pressure_is_no_force_per_length(tmp_path) -> None:
    """Which exports would multiply by the length of a pin."""
    problem = archord.Problem(
        archord.rectangles({"low": (0, 0, 2, 1), "high": (0.5, 1, 1, 1)}, size=0.5),
        [archord.Body(name, archord.Elastic(1e3, 0.3)) for name in ("low", "high")],
        [archord.Interaction("contact", ("high bottom", "low top"))],
        supports=[archord.Support("low bottom"), archord.Support("high left", fixed="x")],
        loads=[archord.Load("press", on="high top", pressure=1.0)],
        steps=6,
    )
    run = archord.solve(problem, tmp_path / "run")
    with pytest.raises(InputError, match="'press' is a pressure over a volume"):
        run_table(run)


def test_a_moment_is_no_force_per_length(tmp_path) -> None:
    """A moment per unit length, in N, was called the total force of the whole pin."""
    problem = archord.Problem(
        archord.rectangles({"low": (0, 0, 2, 1), "high": (0.5, 1, 1, 1)}, size=0.5),
        [archord.Body(name, archord.Elastic(1e3, 0.3)) for name in ("low", "high")],
        [archord.Interaction("contact", ("high bottom", "low top"))],
        [archord.Support("low bottom"), archord.Support("axis", on="crank", fixed="xy")],
        [archord.Load("turn", on="crank", direction="rotation", displacement=0.01)],
        [archord.Coupling("crank", facets="high top", point=(1.0, 2.0))],
        steps=6,
    )
    run = archord.solve(problem, tmp_path / "run")
    with pytest.raises(InputError, match="'turn' is a moment over an angle"):
        run_table(run)


def test_runs_of_steel_that_hardens_become_laws(tmp_path, capsys, refused) -> None:
    """A joint and a lug: a table of every second step is right at the others within its error, on
    both ways; the command writes it."""
    keys = ["load.steps=[12,12]", "output.fields=false"]
    of_steel = ("yield_stress=355", "hardening=[[0,355],[0.1,500]]")
    steel = [f"{body}.{key}" for body in ("pin", "block") for key in of_steel]
    pressed = [*keys, *steel, "joint.relative_element_size=0.2", "load.displacement=[2,0]"]
    joint = load_scene(SCENES / "steel_pin.toml", pressed)
    lug = load_scene(
        SCENES / "lug.toml",
        [*keys, "lug.element_size=3", "lug.growth=1", "load.displacement=[0.2,0]"],
    )
    for name, folder in solved({"joint": joint, "lug": lug}, tmp_path).items():
        run = Run(folder)
        names = ("pull displacement", "pull force") if name == "lug" else ("delta", "P")
        delta, P = (np.array(run.columns[column]) for column in names)
        run.columns = {key: values[1::2] for key, values in run.columns.items()}
        run.steps //= 2
        curve = run_table(run)
        there = curve.at(delta[:12])
        back = curve.at(delta[12:], delta.max())
        assert (np.abs(there.load - P[:12]) <= there.error + 1e-9 * P.max()).all()
        assert (np.abs(back.load - P[12:]) <= back.error + 1e-9 * P.max()).all()
    file = tmp_path / "law.json"
    words = ["fit", str(tmp_path / "lug"), "--table", str(file)]
    assert command([*words, "--of", "pull", "--table", str(tmp_path / "law.py")]) == 0
    assert "error of first loading: rms" in capsys.readouterr().out
    written = JointCurve.from_json(file.read_text())
    np.testing.assert_allclose(written.at(delta, 0.0).load[:12], P[:12], rtol=1e-12)
    module: dict = {}
    exec((tmp_path / "law.py").read_text(), module)
    assert module["force"](0.15, 0.2)[0] == pytest.approx(written.at(0.15, 0.2).load, rel=1e-12)
    assert refused(words).startswith(f"{file}: is there already")
    assert "takes one run" in refused([*words, "--range", "0.1", "1"])
    assert "law.f90: must end in .py, .h" in refused([*words[:-1], str(tmp_path / "law.f90")])

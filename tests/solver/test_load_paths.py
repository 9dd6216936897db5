"""Load histories: force and displacement control, unloading, separation and new contact."""

import re

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.report.errors import InputError
from archord.scene.file import load_scene
from archord.solver.conditions import DeadLoad
from archord.solver.expansion import expanded
from archord.solver.path.stepping import StepFailure
from archord.solver.path.system import System
from tests.solver.solving import small_scene as scene
from tests.solver.solving import solve

H = 0.16
RIGID = {"rigid": True}
YIELDING = {"E": 1.82, "nu": 0.3, "yield_stress": 0.002}


def by_force(targets, steps=3, **sections):
    """The paper's joint loaded by forces in units of E* R."""
    return scene(H, steps, load={"displacement": None, "relative_force": targets}, **sections)


@pytest.mark.parametrize(
    "sections",
    [
        {},
        {"yield_stress": 0.002},
        {"pin": RIGID},
        {"pin": RIGID, "block": {"E": 1.82, "nu": 0.3, "yield_stress": 0.004}},
    ],
    ids=["elastic", "plastic", "rigid pin", "rigid pin, plastic block"],
)
@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_force_and_displacement_control_find_the_same_state(sections, kinematics):
    """One step to P finds the delta at which one step to delta finds P, with Newton's quadratic
    end."""
    analysis = {"analysis": {"kinematics": kinematics}}
    pressed = solve(scene(H, 1, **sections, **analysis)).steps[0]
    forced = by_force(0.01, 1, **sections, **analysis)
    forced = forced.model_copy(
        update={
            "load": forced.load.model_copy(
                update={"relative_force": pressed["P"] / (forced.E_star)}
            )
        }
    )
    found = solve(forced).steps[0]
    assert pytest.approx(pressed["P"], rel=1e-12) == found["P"]
    assert found["delta"] == pytest.approx(pressed["delta"], rel=1e-8)
    assert (found["eps"], found["p0"], found.plastic_dissipation) == pytest.approx(
        (pressed["eps"], pressed["p0"], pressed.plastic_dissipation), rel=1e-6
    )
    assert found.iterations <= max(6, 2 * pressed.iterations)


@pytest.mark.mpi
@pytest.mark.parametrize("pin", [{}, RIGID], ids=["pin", "rigid pin"])
def test_force_control_does_not_depend_on_the_ranks(comm, pin):
    """A force up and half-way back, plastic: the same displacements on one rank and on all."""
    problem = by_force(
        [0.005, 0.003],
        2,
        block={"E": 1.82, "nu": 0.3, "yield_stress": 0.002},
        **({"pin": pin} if pin else {}),
    )
    many = solve(problem, comm)
    one = solve(problem, MPI.COMM_SELF)
    np.testing.assert_allclose(
        [m["delta"] for m in many.steps], [m["delta"] for m in one.steps], rtol=1e-8
    )
    np.testing.assert_allclose(
        [m["peeq_integral"] for m in many.steps], [m["peeq_integral"] for m in one.steps], rtol=1e-7
    )


def test_an_elastic_joint_forgets_its_path():
    """Pressed, pulled away, pressed again: no force while apart, the same force at the same delta,
    no work lost."""
    steps = solve(scene(H, 4, load={"displacement": [2.0, -1.0, 2.0]})).steps
    P = {round(m["delta"] / 0.005, 6): [] for m in steps}
    for m in steps:
        P[round(m["delta"] / 0.005, 6)].append(m["P"])
    assert P[2.0] == pytest.approx([P[2.0][0]] * 2, rel=1e-9)
    assert P[0.5] == pytest.approx([P[0.5][0]] * 3, rel=1e-9)
    assert P[-1.0] == pytest.approx([0.0], abs=1e-12 * P[2.0][0])
    assert P[-0.25] == pytest.approx([0.0, 0.0], abs=1e-12 * P[2.0][0])
    assert max(m.force_balance for m in steps) < 1e-9
    assert steps[7].elastic_energy < 1e-12 * steps[3].elastic_energy
    assert steps[7]["eps"] == steps[7]["p0"] == steps[7].contact_area == 0.0


def test_unloading_from_a_plastic_state_is_elastic_and_leaves_a_dent():
    """The first step back is stiffer than the last one forth and dissipates next to nothing; a
    force of zero leaves a displacement and residual stress; pressed again to the old force, the
    joint is back where it was."""
    steps = solve(by_force([0.006, 0.0, 0.006], [3, 6, 6], yield_stress=0.002)).steps
    top = steps[2]
    first = steps[3]
    free = steps[8]
    again = steps[14]
    assert top.plastic_dissipation > 0
    assert first.plastic_dissipation == pytest.approx(top.plastic_dissipation, rel=1e-3)
    slope = (top["P"] - first["P"]) / (top["delta"] - first["delta"])
    assert slope > 1.5 * (steps[2]["P"] - steps[1]["P"]) / (steps[2]["delta"] - steps[1]["delta"])
    assert abs(free["P"]) < 1e-9 * top["P"]
    assert 0.1 * 0.005 < free["delta"] < top["delta"]
    assert free["eps"] == 0.0 or free.contact_area < 0.1 * top.contact_area
    assert free.elastic_energy > 0  # residual stress
    assert again["delta"] == pytest.approx(top["delta"], rel=5e-3)


def test_the_way_back_is_elastic():
    """A tenth of dR back changes the force as if no point could yield any more; what flows, flows
    at the contact's edge."""
    problem = scene(H, [4, 1], yield_stress=0.002, load={"displacement": [2.0, 1.9]})
    solution = solve(problem)
    top, back = solution.steps[-2:]
    assert back.plastic_dissipation == pytest.approx(top.plastic_dissipation, rel=1e-3)

    joint = solve(scene(H, 4, yield_stress=0.002)).joint
    equilibrium = joint.equilibrium
    points = joint.equilibrium.evaluation.plastic_points()
    for p in points:
        p.acting = p.material.elastic()
    assert joint.solver.newton.solve(
        equilibrium.state()
    ).converged  # the state itself needs no flow
    equilibrium.load = 1.9 * 0.005
    assert joint.solver.newton.solve(equilibrium.state()).converged
    assert pytest.approx(solution.forces()["pin"] - top["P"], rel=2e-3) == back["P"] - top["P"]


def test_a_pulled_pin_comes_free_and_says_so():
    """A force that pulls has no equilibrium; the message names the last force that held."""
    coarse = {"element_size": 0.2}
    pulled = by_force([0.006, -0.001], 2, joint=coarse, stepping={"minimum": 0.25})
    with pytest.raises(
        StepFailure, match=r"no equilibrium at P = -.*singular mode.*last load that held is P = "
    ):
        solve(pulled)


def test_a_force_beyond_the_limit_load_ends_at_it():
    """Perfectly plastic bodies carry no more than a limit load; more ends with the last force that
    held, close below the one that did not."""
    coarse = {"element_size": 0.2, "growth": 1.0}
    with pytest.raises(StepFailure) as failure:
        solve(by_force(0.04, 4, yield_stress=0.002, joint=coarse, stepping={"minimum": 0.02}))
    numbers = [float(n) for n in re.findall(r"P = ([0-9.e-]+[0-9])", str(failure.value))]
    assert 0.0067 < numbers[1] < numbers[0] < 1.02 * numbers[1] < 0.03


@pytest.mark.parametrize(
    "press",
    [
        archord.Load("pull", on="bar right", pressure=-300.0),
        DeadLoad(facets="bar right", pressure=-300.0),
    ],
)
def test_a_pressure_beyond_the_limit_load_ends_at_it(press):
    """What Newton's method throws far away is no equilibrium, however large its round-off is."""
    metal = archord.J2Material(200e3, 0.3, hardening=archord.LinearHardening(200.0))
    mesh = archord.rectangles({"bar": (0.0, 0.0, 2.0, 1.0)}, size=0.5)
    bar = archord.Problem(
        mesh,
        [archord.Body("bar", metal)],
        supports=[archord.Support("bar left", fixed="x"), archord.Support("bar bottom", fixed="y")],
        loads=[press],
        kinematics="plane stress",
        steps=6,
    )
    with pytest.raises(StepFailure, match=r"the last load that held is load factor = 0\.666"):
        System(expanded(bar.on(MPI.COMM_SELF))).solve(bar.targets)


def test_zero_load_is_no_load():
    """Steps at zero displacement or force converge to nothing, without nan, and the next step goes
    on from there."""
    for problem in (scene(H, 1, load={"displacement": [0.0, 1.0]}), by_force([0.0, 0.005], 1)):
        first, second = solve(problem).steps
        assert not any(first.values.values())
        assert all(
            value == 0
            for name, value in vars(first).items()
            if name not in ("step", "seconds", "values")
        )
        assert second["P"] > 0


def write(folder, load):
    path = folder / "joint.toml"
    path.write_text(
        "[joint]\nradius = 1.0\nrelative_clearance = 0.005\n[pin]\nrigid = true\n[block]\nE = "
        "1.0\nnu = 0.3\n[load]\n" + load,
        encoding="utf-8",
    )
    return path


def test_a_lug_that_has_shaken_down_turns_around_in_few_iterations(tmp_path):
    """Its steps are elastic then: the last increment, taken back, is the next one but for the edge
    of the contact."""
    data = {
        "lug": {
            "radius": 9.9,
            "clearance": 0.1,
            "width": 40.0,
            "edge_distance": 20.0,
            "length": 60.0,
            "element_size": 2.0,
        },
        "pin": {"E": 210e3, "nu": 0.3},
        "plate": {"E": 210e3, "nu": 0.3, "yield_stress": 300.0},
        "load": {"force": [3500.0, 500.0] * 6, "steps": 1},
    }
    run = archord.solve(data, tmp_path / "run")
    dissipated = run.columns["plastic_dissipation"]
    assert 0 < dissipated[1] == pytest.approx(dissipated[-1], rel=1e-3)
    assert sum(run.columns["iterations"][-8:]) <= 12


def test_paths_from_a_csv_file(tmp_path):
    """One step a row, or as many as steps says; the resolved scene holds the numbers."""
    (tmp_path / "cycle.csv").write_text("displacement\n1\n0.5\n2\n", encoding="utf-8")
    assert load_scene(write(tmp_path, 'path = "cycle.csv"\n')).targets == pytest.approx(
        [0.005, 0.0025, 0.01]
    )
    twice = load_scene(write(tmp_path, 'path = "cycle.csv"\nsteps = 2\n'))
    assert twice.targets == pytest.approx([0.0025, 0.005, 0.00375, 0.0025, 0.00625, 0.01])


CYCLE = 'path = "cycle.csv"'
IN_A_ROW = "cycle.csv: must have a decimal number like 0.5 .* in every row; row"


@pytest.mark.parametrize(
    ("load", "content", "said"),
    [
        (CYCLE, None, "cannot be read"),
        (CYCLE, "", "one column, headed by displacement, .*, not ''"),
        (CYCLE, "delta\n1\n", "one column, headed by displacement, .*, not 'delta'"),
        (
            CYCLE,
            "displacement,force\n1,2\n",
            "one column, headed by displacement, .*, not 'displacement,force'",
        ),
        (CYCLE, "displacement\n1\ntwo\n", f"{IN_A_ROW} 3 has 'two'"),
        (CYCLE, "displacement\n1\n0.5,5\n", f"{IN_A_ROW} 3 has '0.5,5'"),
        (CYCLE, "displacement\n0,5\n", f"{IN_A_ROW} 2 has '0,5'"),
        (CYCLE, "displacement\n1_0\n", f"{IN_A_ROW} 2 has '1_0'"),
        (CYCLE, "displacement\n1\n\n2\n", f"{IN_A_ROW} 3 has ''"),
        (CYCLE, "displacement\n", "cycle.csv: must have a number below the heading displacement"),
        (CYCLE, "displacement\n1\ninf\n", f"{IN_A_ROW} 3 has 'inf'"),
        (CYCLE, "displacement\n1\n1e9\n", "must not exceed .* half the radius"),
        ("displacement = []", None, "must not be empty"),
        ('displacement = "far"', None, "must be a number"),
        ('displacement = [1.0, "far"]', None, "entry 2 must be a number"),
        (
            "displacement = [1.0, 2.0]\nsteps = [1]",
            None,
            "must have one number for each of the 2 stages",
        ),
        ("displacement = 1.0\nsteps = 0", None, "must be at least 1"),
        ("displacement = 1.0\nsteps = 1.5", None, "must be a whole number"),
        (
            f"displacement = 1.0\n{CYCLE}",
            None,
            "load.displacement = 1.0 must not be given together with path",
        ),
        ("steps = 3", None, "load.displacement is missing"),
    ],
)
def test_a_bad_load_or_path_is_refused_with_one_sentence(tmp_path, load, content, said):
    """The file and what is wrong with it; one sentence, whatever number of types a key may have."""
    if content is not None:
        (tmp_path / "cycle.csv").write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=said) as refusal:
        load_scene(write(tmp_path, load + "\n"))
    assert len(str(refusal.value).splitlines()) == 1

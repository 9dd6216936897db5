"""General scenes as problems: what each word does, on a lug with and without its pin."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.benchmarks.case import paper_joint
from archord.presets.account import account_of
from archord.report.errors import InputError
from archord.scene.file import parse_any
from archord.solver.path.stepping import Step, march
from tests.solver.solving import solve

STEEL = {"E": 210000.0, "nu": 0.3}
SHAPE = {
    "kind": "lug",
    "radius": 9.9,
    "clearance": 0.1,
    "width": 40.0,
    "edge_distance": 20.0,
    "length": 60.0,
}
SHAPE |= {"element_size": 2.0, "growth": 0.8}
CLAMP = {"name": "clamp", "on": "clamp", "fixed": ["x", "y"]}
SYMMETRY = {"name": "symmetry", "on": "axis", "fixed": ["y"]}
CONTACT = {"name": "contact", "surfaces": ["pin", "hole"]}


def solved(
    loads,
    *,
    pin: str = "half",
    interactions=(),
    couplings=(),
    supports=(CLAMP, SYMMETRY),
    steps=1,
    half=True,
):
    """The account of the last step, and its record."""
    bodies = [{"name": "lug"} | STEEL] + ([{"name": "pin"} | STEEL] if pin != "none" else [])
    scene = parse_any(
        {
            "mesh": {"shape": SHAPE | {"pin": pin, "half": half}},
            "body": bodies,
            "interaction": list(interactions),
            "coupling": list(couplings),
            "support": list(supports),
            "load": loads,
            "path": {"steps": steps},
            "analysis": {"symmetry": 2 if half else 1},
        }
    )
    account = account_of(scene, MPI.COMM_SELF)
    records = []

    def done(step, position):
        records.append(account.step(records, step, account.profiles(), 0.0, 0.0))

    march(account.system.load_path(), scene.targets, target_done=done)
    return account, records[-1].values


def load(name="press", on="flat", direction="x", **value):
    return {"name": name, "on": on, "direction": direction} | value


@pytest.fixture(scope="module")
def pressed():
    return solved([load(displacement=0.1)], interactions=[CONTACT])[1]


def test_a_force_moves_a_straight_edge_as_far_as_it_takes(pressed):
    found = solved([load(force=pressed["press force"])], interactions=[CONTACT])[1]
    assert found["press displacement"] == pytest.approx(
        0.1, rel=1e-6
    )  # springs hold the pin by 1e-7 of its force
    assert found["clamp x"] == pytest.approx(-pressed["press force"], rel=1e-6)


def test_half_a_lug_tells_of_the_whole(pressed):
    """Forces and contact lengths are those of the lug that is drawn whole."""
    held = {"name": "held", "on": "flat", "fixed": ["y"]}
    whole = solved(
        [load(displacement=0.1)], interactions=[CONTACT], supports=[CLAMP, held], half=False
    )[1]
    for name in ("press force", "clamp x", "contact force x"):
        assert pressed[name] == pytest.approx(whole[name], rel=0.01), name
    length = "contact contact length"
    assert whole[length] > 10
    assert pressed[length] == pytest.approx(whole[length], rel=0.05)


def test_loads_in_turn_end_where_loads_together_do():
    """Of an elastic body without contact."""
    on = {"pin": "none", "supports": [CLAMP], "half": False}
    pull = load(on="hole", force=100.0)
    side = load("side", on="end", direction="y", displacement=0.01)
    together = solved([pull, side], **on)[1]
    in_turn = solved(
        [pull | {"force": [100.0, 100.0]}, side | {"displacement": [0.0, 0.01]}], **on
    )[1]
    for name, value in together.items():
        assert in_turn[name] == pytest.approx(value, rel=1e-8, abs=1e-8), name


@pytest.mark.parametrize("kind", ["rigid", "distributing"])
def test_a_reference_point_carries_force_and_moment(kind):
    """The hole's, with the force the clamp takes, and its moment about the origin."""
    point = {"name": "pin", "facets": "hole", "point": [0.0, 5.0], "kind": kind}
    loads = [
        load(on="pin", force=300.0),
        load("turn", on="pin", direction="rotation", force=2000.0),
    ]
    found = solved(loads, pin="none", couplings=[point], supports=[CLAMP], half=False)[1]
    assert found["clamp x"] == pytest.approx(-300, rel=1e-9)
    assert found["clamp y"] == pytest.approx(0, abs=1e-6)
    assert found["clamp moment"] == pytest.approx(5 * 300 - 2000, rel=1e-8)
    back = [load(on="pin", displacement=found["press displacement"])]
    back.append(
        load("turn", on="pin", direction="rotation", displacement=found["turn displacement"])
    )
    again = solved(back, pin="none", couplings=[point], supports=[CLAMP], half=False)[1]
    assert (again["press force"], again["turn force"]) == pytest.approx((300, 2000), rel=1e-7)


@pytest.mark.parametrize(
    ("angle", "told"), [(0.01, []), (0.04, ["it turns linearly, which stretches radii by 0.0008"])]
)
def test_a_reference_point_that_turns_far_is_told(angle, told):
    """Its rotation is linear, at large strain as well."""
    point = {"name": "pin", "facets": "hole", "point": [0.0, 0.0]}
    turn = [load("turn", on="pin", direction="rotation", displacement=angle)]
    held = {"name": "held", "on": "pin", "fixed": ["x", "y"]}
    account = solved(turn, pin="none", couplings=[point], supports=[CLAMP, held], half=False)[0]
    said = account.step_warnings(account.step([], Step(1.0), account.profiles(), 0.0, 0.0), {}, 0.0)
    assert [word.partition("; ")[2] for word in said if "turns" in word] == told


def test_a_held_reference_point_does_not_move():
    point = {"name": "bore", "facets": "hole", "point": [0.0, 0.0]}
    held = {"name": "held", "on": "bore", "fixed": ["x", "y", "rotation"]}
    account, found = solved(
        [load(on="end", force=50.0)], pin="none", couplings=[point], supports=[held], half=False
    )
    assert found["bore x"] == pytest.approx(-50, rel=1e-9)
    nodes = account.system.problem.mesh.dofs_in(account.system.V, "hole")
    assert np.abs(account.system.equilibrium.displacement()[nodes]).max() < 1e-12


@pytest.mark.parametrize(("line", "axis"), [("axis", "y"), ("clamp", "x")])
def test_a_rigid_coupling_keeps_to_the_line_of_symmetry_that_it_meets(line, axis):
    """The loaded end meets the axis, the sides the clamp, as they would another line of
    symmetry."""
    point = {"name": "end", "facets": "end" if axis == "y" else "sides", "point": [20.0, 0.0]}
    lines = [
        SYMMETRY | {"on": line, "fixed": [axis]},
        {"name": "hole", "on": "hole", "fixed": ["x", "y"]},
    ]
    pull = [load(on="end", direction="x" if axis == "y" else "y", force=100.0)]

    def held(*freedoms):
        return [*lines, {"name": "guide", "on": "end", "fixed": list(freedoms)}]

    for freedoms, missing in (([axis], "rotation"), (["rotation"], axis)):
        with pytest.raises(
            InputError, match=rf"meets '{line}', which is held in {axis}: hold its {missing}, too"
        ):
            solved(pull, pin="none", couplings=[point], supports=held(*freedoms))
    found = solved(pull, pin="none", couplings=[point], supports=held(axis, "rotation"))[1]
    assert found["hole x" if axis == "y" else "hole y"] == pytest.approx(-100, rel=1e-8)


def test_a_pressure_acts_along_the_normal():
    """On half a hole: twice the resultant of the modelled quarter circles, none along the axis."""
    pressure = {"name": "oil", "on": "hole", "pressure": 10.0}
    found = solved([pressure], pin="none")[1]
    assert found["clamp x"] == pytest.approx(0, abs=1e-2)
    assert found["clamp y"] + found["symmetry y"] == pytest.approx(-2 * 10 * 20, rel=1e-3)
    assert found["oil force"] == 10


def test_a_rigid_disc_presses_as_a_stiff_pin(pressed):
    disc = {"name": "contact", "surfaces": ["hole"], "rigid": {"centre": [0.1, 0.0], "radius": 9.9}}
    found = solved([load(on="contact", displacement=0.1)], pin="none", interactions=[disc])[1]
    assert found["press force"] == pytest.approx(found["contact force x"], rel=1e-8)
    assert found["press force"] == pytest.approx(-found["clamp x"], rel=1e-8)
    assert pressed["press force"] < found["press force"] < 2 * pressed["press force"]


def test_a_force_on_cells_is_spread_over_them():
    found = solved([load(on="lug", force=80.0)], pin="none")[1]
    assert found["clamp x"] == pytest.approx(-80, rel=1e-9)


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"pin": {"rigid": True}, "analysis": {"thickness": 5.0, "coarse_start": False}},
        {
            "load": {"displacement": None, "relative_force": [0.003, 0.001], "steps": 2},
            "analysis": {"thickness": 5.0},
        },
        {
            "joint": {
                "radius": 1.0,
                "clearance": -0.002,
                "block_size": 4.0,
                "model": "ring",
                "element_size": 0.2,
            }
        }
        | {"load": {"displacement": None, "relative_force": 0.003, "steps": 2}},
    ],
)
def test_a_joint_stands_for_a_general_scene(changes):
    """Which has the same force and displacement, step by step, after the stage in which an
    interference arises."""
    scene = paper_joint(0.2, 2, **changes)
    general = parse_any(scene.general())
    account = account_of(general, MPI.COMM_SELF)
    steps = []

    def done(step, position):
        q, force = account.driven()
        steps.append((-q[0], -force[0]))

    march(account.system.load_path(), general.targets, target_done=done)
    expected = [(m["delta"], m["P"]) for m in solve(scene).steps]
    assert np.array(steps)[general.fits :] == pytest.approx(np.array(expected), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    "core", [{"centre": [0.0, 0.0], "radius": 1e-3}, {"centre": [500.0, 0.0], "radius": 1.0}]
)
def test_a_core_without_integration_points_is_refused(core):
    """Its force has nowhere to act."""
    press = load(on="pin", force=100.0) | {"core": core}
    with pytest.raises(
        InputError, match=r"load 'press': core.radius = .* integration points of the cells 'pin'"
    ):
        solved([press], pin="whole", interactions=[CONTACT])

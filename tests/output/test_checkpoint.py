"""The state of a run on disk: whole on any number of ranks, and refused when it is not what was
written."""

import json
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.basis import TRIANGLE, bulk_quadrature, cell_basis
from archord.geometry.shapes.rectangles import rectangles
from archord.materials.elasticity import Elastic
from archord.measures.energies import Work
from archord.measures.record import Record
from archord.output import checkpoint
from archord.report.errors import InputError
from archord.solver.path.load_path import Position
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.path.stepping import Step, march
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Drive, Interaction, Problem
from tests.solver.contact.test_ranks import CUTS
from tests.solver.solving import joint_system, scene, solve
from tests.solver.test_stabilisation import sleeves

PROBLEM = scene(0.15, 3, yield_stress=0.002)


@pytest.fixture(scope="module")
def pressed():
    """The state that a joint pressed into the plastic range leaves, on this rank alone."""
    solution = solve(PROBLEM)
    joint = solution.joint
    position = Position(3, joint.equilibrium.load, 0.003, 0.1 * joint.equilibrium.state(), 0.7)
    at = solution.steps[-1], Step(joint.equilibrium.load), position, Work(0.01, 0.02, 0.03)
    return checkpoint.halt(MeshOrder(joint), "scene", *at)


def rubbing() -> Problem:
    """A block that is pressed on another and drawn along it by less than makes it slide, and one
    beside them that weak springs hold."""
    boxes = {"lower": (0, 0, 4, 1), "upper": (1, 1, 2, 1), "loose": (6, 0, 1, 1)}
    rub = Interaction("rub", ("upper bottom", "lower top"), friction=0.5)
    supports = [
        *(Dirichlet("base", "lower bottom", axis) for axis in (0, 1)),
        Dirichlet("top", "upper top", 1, 1.0, "press"),
        Dirichlet("top x", "upper top", 0, 1.0, "draw"),
    ]
    drives = [Drive("press", [0.0, -1e-3, -1e-3]), Drive("draw", [0.0, 0.0, 1e-4])]
    bodies = [Body(name, Elastic(1000.0, 0.0)) for name in boxes]
    mesh = rectangles(boxes, 1.0, MPI.COMM_SELF)
    return Problem(mesh, bodies, [rub], supports, drives=drives, stabilise=True)


@pytest.mark.parametrize(
    ("problem", "loads", "idle"),
    [(sleeves, [0.1, 0.12], False), (sleeves, [0.3, 0.31], True), (rubbing, [1.0, 1.5], False)],
    ids=["floating", "carried", "sticking"],
)
def test_a_system_goes_on_from_a_checkpoint_as_if_not_left(tmp_path, problem, loads, idle):
    """With springs that rest where they were, and points that know whether they touched."""
    systems = [System(problem()) for _ in range(2)]
    halted, going_on = systems
    halted.solve(loads[:1])
    position = Position(1, loads[0], loads[0], halted.equilibrium.state())
    record = Record(1, loads[0], {}, 0.0, *np.zeros(4), 1, 0, 0.0)
    saved = checkpoint.halt(MeshOrder(halted), "", record, Step(loads[0]), position, Work())
    checkpoint.resume(MeshOrder(going_on), tmp_path, saved)
    springs = [system.equilibrium.springs for system in systems]
    assert [each.idle for each in springs] == [idle, idle]
    for system in systems:
        march(system.load_path(replace(position)), [loads[0], loads[1]])
    energies = [each.energy for each in springs]
    assert energies[1] == pytest.approx(energies[0], rel=1e-9)
    states = [system.equilibrium.state() for system in systems]
    np.testing.assert_allclose(states[1], states[0], rtol=0, atol=1e-12)


def point_numbers(order: MeshOrder) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Numbers ``(n,)`` and coordinates ``(n, 2)`` of all points that may have a history, on every
    rank."""
    joint = order.system
    here = {}
    for place, _, number in order._points():
        kind, name = place.split()
        if kind == "contact":
            x = joint.sides[name].point
        else:
            cells = joint.bulk.histories()[name][0]
            x = cell_basis(joint.V.mesh, 2, cells, bulk_quadrature(TRIANGLE, 2)[0]).point
        here[place] = number, x.reshape(-1, 2)
    parts = joint.comm.allgather(here)
    together = {
        place: [np.concatenate([p[place][i] for p in parts]) for i in (0, 1)] for place in here
    }
    return {place: (n[np.argsort(n)], x[np.argsort(n)]) for place, (n, x) in together.items()}


@pytest.mark.mpi
@pytest.mark.parametrize("cut", ["sectors", "dealt round", "all on the last rank"])
def test_the_state_comes_back_on_any_ranks(comm, pressed, cut):
    """From one rank on all: every point has its number, also on facets that run against the curve,
    and collected again the state is the very same bytes, of the points that yielded alone."""
    one = point_numbers(MeshOrder(joint_system(PROBLEM, MPI.COMM_SELF)))
    joint = joint_system(PROBLEM, comm, partitioner=CUTS[cut])
    assert (
        comm.allreduce(
            sum(int((side.trace[:, 0] > side.trace[:, -1]).sum()) for side in joint.sides.values())
        )
        > 0
    )
    order = MeshOrder(joint)
    together = point_numbers(order)
    assert set(one) == set(together) == {"bulk 1", "bulk 2", "contact pin", "contact hole"}
    for place, (number, x) in one.items():
        assert len(number) > 50
        assert (np.diff(number) > 0).all()
        assert np.array_equal(together[place][0], number)
        assert together[place][1] == pytest.approx(x, abs=1e-12)
    known = checkpoint.resume(order, "path", pressed if comm.rank == 0 else None)
    again = checkpoint.halt(order, "scene", *known)
    if comm.rank == 0:
        assert (again.mesh, again.scalars, set(again.arrays)) == (
            pressed.mesh,
            pressed.scalars,
            set(pressed.arrays),
        )
        for name, values in pressed.arrays.items():
            assert len(values) > 0
            assert np.array_equal(again.arrays[name], values), name
        assert 0 < len(pressed.arrays["history/bulk 2/point"]) < len(one["bulk 2"][0])


def test_an_elastic_joint_stores_no_history():
    assert MeshOrder(solve(scene(0.2, 1)).joint).collect_history() == {}


def test_another_mesh_is_refused(pressed):
    """The same joint with other elements."""
    other = MeshOrder(joint_system(scene(0.16, 3, yield_stress=0.002), MPI.COMM_SELF))
    with pytest.raises(InputError, match=r"run/checkpoint.h5: belongs to another mesh"):
        checkpoint.resume(other, "run/checkpoint.h5", pressed)


def test_whatever_is_damaged_is_refused(pressed, tmp_path):
    """Any byte changed, the number of the format among them, any part missing: one sentence with
    the file's name."""
    path = tmp_path / "checkpoint.h5"
    with pytest.raises(InputError, match=r"checkpoint\.h5: cannot be read, .*: No such file"):
        checkpoint.read(path)
    checkpoint.write(path, pressed)
    whole = path.read_bytes()
    assert len(whole) > 10_000
    random = np.random.default_rng(0)
    of_format = whole.index(b"format 1") + 7
    places = [
        0,
        of_format,
        100,
        300,
        511,
        512,
        520,
        600,
        len(whole) - 1,
        *random.integers(len(whole), size=200),
    ]
    for at in places:
        changed = whole[:at] + bytes([whole[at] ^ 1 << random.integers(8)]) + whole[at + 1 :]
        for content in (changed, whole[:at]):
            path.write_bytes(content)
            with pytest.raises(
                InputError, match=r"checkpoint\.h5: is damaged or of a newer archord"
            ) as error:
                checkpoint.read(path)
            assert len(str(error.value).splitlines()) == 1
    path.write_bytes(whole)
    assert checkpoint.read(path).scalars == json.loads(json.dumps(pressed.scalars))


def test_files_hold_a_joint_s_record_as_format_1_does(pressed):
    """Side by side, as runs of version 0.2 have it, and PEEQ with its place by body."""
    told = pressed.scalars["measures"]
    numbers = {"delta", "P", "p0", "eps", "contact_area", "peeq_max", "peeq_integral", "work"}
    energies = {"elastic_energy", "plastic_dissipation", "friction_dissipation"}
    cost = {"step", "iterations", "cutbacks", "seconds"}
    assert told.keys() == numbers | energies | cost | {"force_balance", "peeq"}
    assert told["peeq"].keys() == {"pin", "block", "contact"}
    record = Record.read(told)
    assert record.at == record["delta"] == told["delta"]
    assert record["block at y"] == told["peeq"]["block"][2]
    assert record.plain() == told
    del told["peeq"]  # as version 0.1
    assert Record.read(told).plain() == told | {"peeq": {}}

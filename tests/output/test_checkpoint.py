"""The state of a run on disk: whole on any number of ranks, and refused when it is not what was written."""

import json
from dataclasses import fields

import numpy as np
import pytest
from mpi4py import MPI

from archord.output import checkpoint
from archord.presets.joint import Joint
from archord.scene.errors import InputError
from archord.solver.mesh_order import MeshOrder
from tests.solver.contact.test_ranks import CUTS
from tests.solver.solving import scene, solve


@pytest.fixture(scope="module")
def pressed():
    """A joint pressed into the plastic range, and the state that it leaves, on this rank alone."""
    joint = solve(scene(0.15, 3, yield_stress=0.002)).joint
    order = MeshOrder(joint)
    state = {"displacement": joint.equilibrium.displacement()}
    return joint, checkpoint.collect(order, 3, "scene", state, {"load": joint.equilibrium.load})


def point_numbers(order: MeshOrder) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Numbers ``(n,)`` and coordinates ``(n, 2)`` of all points that may have a history, on every rank."""
    joint, comm = order.system, order.system.comm
    here = {}
    for place, (_, number) in order._points().items():
        kind, name = place.split()
        if kind == "contact":
            x = joint.sides[name].point.reshape(-1, 2)
        else:
            from archord.geometry.basis import bulk_quadrature, cell_basis

            cells = joint.bulk.histories()[int(name)][0]
            x = cell_basis(joint.V.mesh, 2, cells, bulk_quadrature(2)[0]).point.reshape(-1, 2)
        here[place] = number, x
    parts = comm.allgather(here)
    together = {place: [np.concatenate([p[place][i] for p in parts]) for i in (0, 1)] for place in here}
    return {place: (n[np.argsort(n)], x[np.argsort(n)]) for place, (n, x) in together.items()}


@pytest.mark.mpi
@pytest.mark.parametrize("cut", ["sectors", "dealt round", "all on the last rank"])
def test_a_point_has_the_same_number_on_any_ranks(comm, cut):
    """Every number occurs once and belongs to the same place, also on facets that run against the curve."""
    problem = scene(0.15, 1, yield_stress=0.002)
    one = point_numbers(MeshOrder(Joint(problem, MPI.COMM_SELF)))
    joint = Joint(problem, comm, partitioner=CUTS[cut])
    assert comm.allreduce(sum(int((side.trace[:, 0] > side.trace[:, -1]).sum()) for side in joint.sides.values())) > 0
    together = point_numbers(MeshOrder(joint))
    assert set(one) == set(together) == {"bulk 1", "bulk 2", "contact pin", "contact hole"}
    for place, (number, x) in one.items():
        assert len(number) > 50
        assert (np.diff(number) > 0).all()
        assert np.array_equal(together[place][0], number)
        assert together[place][1] == pytest.approx(x, abs=1e-12)


@pytest.mark.mpi
@pytest.mark.parametrize("cut", ["sectors", "dealt round", "all on the last rank"])
def test_the_state_comes_back_on_any_ranks(comm, pressed, tmp_path_factory, cut):
    """Written by one rank, read by all: the same mesh and forces, and collected again the very same bytes."""
    _, state = pressed
    path = comm.bcast(tmp_path_factory.mktemp("state") / "checkpoint.h5" if comm.rank == 0 else None)
    if comm.rank == 0:
        checkpoint.write(path, state)
    comm.barrier()
    joint = Joint(scene(0.15, 3, yield_stress=0.002), comm, partitioner=CUTS[cut])
    order = MeshOrder(joint)
    found = checkpoint.read(path) if comm.rank == 0 else None
    nodal, scalars = checkpoint.restore(order, path, found)
    again = checkpoint.collect(order, 3, "scene", nodal, scalars)
    if comm.rank == 0:
        assert again.mesh == state.mesh
        assert again.scalars == state.scalars
        assert np.array_equal(again.fields["displacement"], state.fields["displacement"])
        assert set(again.history) == set(state.history)
        for place, arrays in state.history.items():
            assert len(arrays["point"]) > 0
            for name, values in arrays.items():
                assert np.array_equal(again.history[place][name], values), (place, name)


def test_history_comes_back_point_by_point(pressed):
    """Every array of every point's state is the one that was stored; also those that never yielded."""
    joint, state = pressed
    other = Joint(joint.scene, MPI.COMM_SELF)
    checkpoint.restore(MeshOrder(other), None, state)
    points = [j.bulk.plastic_points() + j.contact.plastic_points() for j in (joint, other)]
    yielded = 0
    for a, b in zip(*points, strict=True):
        yielded += (a.state.peeq > 0).sum()
        for field in fields(a.state):
            assert np.array_equal(getattr(a.state, field.name), getattr(b.state, field.name))
    assert 0 < yielded == sum(len(arrays["point"]) for arrays in state.history.values())


def test_an_elastic_joint_stores_no_history():
    """Displacements only."""
    joint = solve(scene(0.2, 1)).joint
    assert checkpoint.collect(MeshOrder(joint), 1, "", {}, {}).history == {}


def test_another_mesh_is_refused(pressed):
    """The same joint with other elements."""
    _, state = pressed
    other = MeshOrder(Joint(scene(0.16, 3, yield_stress=0.002), MPI.COMM_SELF))
    with pytest.raises(InputError, match=r"run/checkpoint.h5: belongs to another mesh"):
        checkpoint.restore(other, "run/checkpoint.h5", state)


def test_whatever_is_damaged_is_refused(pressed, tmp_path):
    """Any byte changed, any part missing: one sentence with the file's name, and never half a state."""
    path = tmp_path / "checkpoint.h5"
    checkpoint.write(path, pressed[1])
    whole = path.read_bytes()
    assert len(whole) > 10_000
    random = np.random.default_rng(0)
    places = [0, 20, 100, 300, 511, 512, 520, 600, len(whole) - 1, *random.integers(len(whole), size=200)]
    for at in places:
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1 << random.integers(8)]) + whole[at + 1 :])
        with pytest.raises(InputError, match=r"checkpoint\.h5: (is damaged|has format)") as error:
            checkpoint.read(path)
        assert len(str(error.value).splitlines()) == 1
        path.write_bytes(whole[:at])
        with pytest.raises(InputError, match=r"checkpoint\.h5: is damaged"):
            checkpoint.read(path)
    path.unlink()
    with pytest.raises(InputError, match=r"checkpoint\.h5: is missing"):
        checkpoint.read(path)
    path.write_bytes(whole)
    assert json.dumps(checkpoint.read(path).scalars) == json.dumps(pressed[1].scalars)


def test_a_newer_format_is_refused(pressed, tmp_path):
    """By its number, whatever else it holds."""
    path = tmp_path / "checkpoint.h5"
    checkpoint.write(path, pressed[1])
    newer = path.read_bytes().replace(b"format 1,", b"format 2,", 1)
    path.write_bytes(newer)
    with pytest.raises(InputError, match="has format 2, of a newer archord"):
        checkpoint.read(path)

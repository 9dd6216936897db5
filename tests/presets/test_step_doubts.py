"""What a run is warned of: strains that are not small, cells turned over, work that energies do not
bear out, and forces that balance after unloading."""

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from archord.measures.doubts import distortion_doubts, told_of_facets
from archord.measures.energies import work_doubts
from archord.measures.record import Record
from archord.presets.account import account_of
from archord.scene.file import parse_any
from archord.solver.path.stepping import Step, march

STEEL = {"E": 210000.0, "nu": 0.3}
SHAPE = {
    "kind": "lug",
    "radius": 9.9,
    "clearance": 0.1,
    "width": 40.0,
    "edge_distance": 20.0,
    "length": 60.0,
}

ZERO = Record(
    step=1,
    at=0.0,
    values={},
    contact_area=0.0,
    elastic_energy=0.0,
    plastic_dissipation=0.0,
    work=0.0,
    force_balance=0.0,
    iterations=0,
    cutbacks=0,
    seconds=0.0,
)


def lug(pull, E=210000.0, **analysis):
    """A lug without a pin, clamped at one end, whose hole is pulled along x by ``pull``, step by
    step."""
    data = {
        "mesh": {"shape": SHAPE | {"element_size": 4.0, "growth": 0.8, "pin": "none"}},
        "body": [{"name": "lug", "E": E, "nu": 0.3}],
        "support": [
            {"name": "clamp", "on": "clamp", "fixed": ["x", "y"]},
            {"name": "symmetry", "on": "axis", "fixed": ["y"]},
        ],
        "load": [{"name": "pull", "on": "hole", "direction": "x", "displacement": pull}],
        "path": {"steps": 1},
        "analysis": {"symmetry": 2} | analysis,
    }
    return account_of(parse_any(data), MPI.COMM_SELF)


def warnings_of(account):
    """Those of every step."""
    records = []
    said = []

    def done(step, position):
        profiles = account.profiles()
        m = account.step(records, step, profiles, 0.0, 0.0)
        said.append(account.step_warnings(m, profiles, step.residual, records))
        records.append(m)

    march(account.system.load_path(), account.scene.targets, target_done=done)
    return said


@pytest.mark.parametrize(
    ("nu", "plane", "told"), [(0.49, "strain", 0), (0.499, "strain", 1), (0.499, "stress", 0)]
)
def test_bodies_in_contact_that_hardly_change_their_volume_are_told(nu, plane, told):
    """Their pressure scatters between points: contact lengths are of a coarse mesh."""
    outline = {name: value for name, value in SHAPE.items() if name != "kind"}
    data = {
        "lug": outline | {"element_size": 4.0, "growth": 0.5},
        "pin": STEEL,
        "plate": STEEL | {"nu": nu},
        "load": {"displacement": 0.1},
        "analysis": {"plane": plane},
    }
    account = account_of(parse_any(data), MPI.COMM_SELF)
    found = [said for said in account.warnings if "'lug' hardly changes its volume" in said]
    assert len(found) == told


def test_elastic_strain_that_is_not_small_is_told_with_its_size():
    none, (first, *_) = warnings_of(lug([0.1, 10.0]))
    assert none == []
    assert (
        "too much for small-strain theory, which makes stresses and forces wrong by about" in first
    )
    assert "in 'lug'" in first
    assert first.size > 0.05
    assert warnings_of(lug([5.0], strain="large")) == [[]]


@pytest.mark.parametrize("strain", ["small", "large"])
def test_cells_turned_over_at_a_corner_are_told(strain):
    """Also where no integration point is turned over."""
    account = lug([0.1], strain=strain)
    system = account.system
    system.solve([0.001])
    assert system.distortion().inside_out == 0
    cell = system.V.dofmap.list[0]
    corners = system.V.tabulate_dof_coordinates()[cell[:3], :2]
    u = system.equilibrium.unknowns.u.x.array.reshape(-1, 2)
    u[cell[0]] += 0.6 * (corners[1:].mean(axis=0) - corners[0])
    assert system.distortion().inside_out >= 1
    (said,) = (s for s in distortion_doubts(system, 0.0, small=False) if "inside out" in s)
    assert "turned inside out: stresses and forces mean nothing" in said


def test_an_element_that_turns_is_told():
    """By 0.3 rad, which linear strain takes for a stretch of 4 %."""
    system = lug([0.1]).system
    x = system.V.tabulate_dof_coordinates()[:, :2]
    system.equilibrium.unknowns.u.x.array[:] = (0.3 * np.stack([-x[:, 1], x[:, 0]], axis=1)).ravel()
    (said,) = distortion_doubts(system, 0.0, small=True)
    assert "elements turn by 0.3 rad, which small-strain theory takes for a strain of 0.045" in said


def test_work_that_the_energies_do_not_bear_out_is_told():
    """Friction that reverses within a step, of which trapezoids count nothing. One per cent is
    borne."""
    slid = replace(ZERO, work=10.0, contact_area=1.0, friction_dissipation=10.0)
    assert work_doubts([replace(slid, friction_dissipation=10.09)]) == []
    (said,) = work_doubts([slid, replace(slid, friction_dissipation=12.0)])
    assert "differ by 20 % of the largest work" in said
    assert work_doubts([replace(slid, work=10.0, friction_dissipation=8.0)], fit=1) == []


def test_work_that_is_round_off_is_not_told():
    """Of loads that move nothing beside a press fit, and of a body that turns without a strain."""
    fit = replace(ZERO, elastic_energy=100.0, contact_area=1.0)
    loaded = replace(fit, elastic_energy=100.0 + 1e-7, work=1e-12)
    assert work_doubts([fit, loaded], fit=1) == []
    assert work_doubts([fit, replace(fit, elastic_energy=100.1, work=0.05)], fit=1) != []
    turned = replace(ZERO, elastic_energy=2e-12, work=1e-12)
    assert work_doubts([turned], contact=False) != []
    assert work_doubts([turned], contact=False, round_off=1e-10) == []


def test_facets_that_unloading_leaves_in_contact_are_not_told():
    """They carry nothing. The first step that touches on few facets is told, however little it
    carries."""
    assert told_of_facets(1e-9, [])
    assert told_of_facets(1.0, [100.0])
    assert not told_of_facets(1e-10, [100.0, 50.0])


def test_the_work_after_the_contact_opened_counts():
    """A fit that opened: only the work of its stage counted, which is none, and it differed by 1e24
    per cent."""
    fit = replace(ZERO, work=-1e-25, contact_area=1.0, elastic_energy=1.0)
    opened = replace(ZERO, work=-2.0)
    (said,) = work_doubts([fit, opened], fit=1)
    assert "differ by 50 % of the largest work" in said
    assert work_doubts([replace(fit, contact_area=0.0)]) == []


def test_forces_after_unloading_balance_to_the_largest_force_of_the_run():
    """What a solve leaves is a part of that force, not of the little that is left of it."""
    account = lug([0.1, 1e-6])
    system = account.system
    records = []
    for load in (1.0, 2.0):
        system.solve([load])
        records.append(account.step([], Step(load), account.profiles(), 0.0, 0.0))
    rng = np.random.default_rng(0)
    system.equilibrium.unknowns.u.x.array[:] += 1e-9 * rng.random(
        len(system.equilibrium.unknowns.u.x.array)
    )
    system.equilibrium.evaluate()
    largest, last = (abs(m["clamp x"]) for m in records)
    assert last < 1e-4 * largest
    system.equilibrium.largest_reaction = 0.0  # as of a run that begins here
    alone, of_run = (
        account.step(before, Step(2.0), account.profiles(), 0.0, 0.0)
        for before in ([], records[:1])
    )
    assert 0 < of_run.force_balance < 1e-3 * alone.force_balance

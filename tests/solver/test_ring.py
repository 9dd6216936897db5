"""Persson's joint: a pin in a ring under a force at its core, against Persson (1964), Ciavarella
and Decuzzi (2001)."""

import numpy as np
import pytest
from mpi4py import MPI

from archord.benchmarks.persson import DR, UNLIKE, persson_joint, theory, unlike
from archord.measures.energies import energy_balance
from archord.output.run import solve_scene
from archord.postprocess.laws.elastic_laws import persson_pressure
from archord.postprocess.laws.general.joint import LawJoint
from archord.presets.joint_doubts import core_peeq
from archord.scene.sections.loading import JointLoad
from tests.solver.solving import solve

LIKE = LawJoint(1.0, DR, 1.0)


def solved(load, alpha=0.0, **options):
    """The last step of a joint; peak pressure within 0.5 % of theory, angle within 0.5 degrees."""
    m = solve(persson_joint(load, **options)).steps[-1]
    (eps, peak) = theory(load, alpha)
    assert m["p0"] / m["P"] == pytest.approx(peak, rel=5e-3)
    assert np.degrees(m["eps"]) == pytest.approx(np.degrees(eps), abs=0.5)
    return m


@pytest.mark.parametrize("load", [10.0, 2.0, 0.5, 0.1])
def test_peak_pressure_and_angle_are_persson_s(load):
    """On elements of 4 %R."""
    m = solved(load)
    assert pytest.approx(DR / load, rel=1e-9) == m["P"]
    assert m.force_balance < 1e-8


def test_the_pressure_profile_is_persson_s():
    """Facet means over the whole contact at E* dR/P = 0.5, within 0.5 % of the peak but for the
    facet at the edge."""
    solution = solve(persson_joint(0.5, 0.02))
    m = solution.steps[-1]
    (eps, _) = theory(0.5)
    for arc in solution.profiles[-1].values():
        inside = np.flatnonzero(arc.angle.max(axis=1) < eps)[:-1]
        exact = persson_pressure(LIKE, np.array(m["P"]), np.array(eps), arc.angle)
        mean = (arc.weight * exact).sum(axis=1) / arc.weight.sum(axis=1)
        ours = arc.facet_force / arc.weight.sum(axis=1)
        np.testing.assert_allclose(ours[inside], mean[inside], rtol=0, atol=5e-3 * m["p0"])


def test_the_mesh_error_of_the_peak_falls_with_its_order():
    """At least the second order against the limit of the same ring; the small contact shows it
    best."""
    peaks = [solve(persson_joint(10.0, h)).steps[-1]["p0"] for h in (0.12, 0.06, 0.015)]
    assert abs(peaks[1] - peaks[2]) < abs(peaks[0] - peaks[2]) / 4


def test_the_ring_is_large_enough():
    """Held at 100 R instead of infinity, p0 is off by (R/100 R)^2 times a small number; a quarter
    of it at 200 R."""
    _, peak = theory(0.5)
    error = [
        abs(m["p0"] / m["P"] / peak - 1)
        for size in (10.0, 30.0)
        for m in [solve(persson_joint(0.5, joint={"block_size": size})).steps[-1]]
    ]
    assert error[0] < 50 / 10.0**2 * 0.02
    assert error[1] < error[0] / 4


@pytest.mark.parametrize("load", [-0.05, -0.2])
def test_an_interference_fit_opens_as_persson_s(load):
    """dR < 0: contact beyond 90 degrees."""
    solved(load, steps=4)


@pytest.mark.parametrize("wall", [0.3, 0.02])
def test_a_thin_bushing_is_pressed_as_lame_s(wall):
    """A ring held at its outer edge, b = 1 + wall, and an oversized pin: their pressure is that of
    Lame's equations in plane strain, with u = A (r - b^2/r) in the ring and u = -p r/(2 (lambda +
    mu)) in the pin."""
    m = solve(persson_joint(-1e4, joint={"block_size": 1 + wall}))
    solid = m.scene.block
    b = 1 + wall
    mu = solid.E / (2 + 2 * solid.nu)
    both = 2 * mu / (1 - 2 * solid.nu)  # 2 (lambda + mu)
    ring = (b**2 - 1) / (both + 2 * mu * b**2)
    pin = 1 / both
    for arc in m.profiles[-1].values():
        np.testing.assert_allclose(
            arc.facet_force / arc.weight.sum(axis=1), DR / (ring + pin), rtol=5e-3
        )


@pytest.mark.parametrize("bodies", [UNLIKE, UNLIKE[::-1]])
def test_unlike_bodies_follow_ciavarella_and_decuzzi(bodies):
    """Shear moduli 3 and 1 with Dundurs' beta = 0: the stiffer pin has the smaller angle."""
    (mu1, nu1), (mu2, nu2) = bodies
    assert mu1 * (1 - 2 * nu2) == pytest.approx(mu2 * (1 - 2 * nu1))
    sections, alpha = unlike(*bodies)
    solved(0.5, alpha, **sections)


def pressed_core(core_radius=0.1, yield_stress=None, of="pin"):
    """A ring whose loaded core yields before the contact does."""
    load = {"relative_force": 0.006, "steps": 4, "core_radius": core_radius}
    body = {of: {"yield_stress": yield_stress}} if yield_stress else {}
    return persson_joint(0.5, 0.1, joint={"clearance": 1e-3}, **body).model_copy(
        update={"load": JointLoad(**load)}
    )


def test_a_core_that_yields_is_named_from_the_step_in_which_delta_contains_it(tmp_path):
    """Up to there delta is that of a pin that does not yield, beyond it is larger; a larger core
    does not yield."""
    elastic = np.array([m["delta"] for m in solve(pressed_core()).steps])
    outcome = solve_scene(pressed_core(yield_stress=0.01), tmp_path, MPI.COMM_SELF)
    (named,) = (w for w in outcome.warnings if "where the force is applied" in w)
    first = next(k for k, m in enumerate(outcome.steps) if m["peeq_max"] > 0)
    assert named.startswith(f"step {first + 1}: the pin yields")
    assert named.endswith("(at its worst in step 4)")
    squashed = np.array([m["delta"] for m in outcome.steps]) / elastic - 1
    assert 0 < first < 4
    assert (abs(squashed[:first]) < 1e-9).all()
    assert (squashed[first:] > 1e-4).all()
    assert "a larger load.core_radius" in named
    wide = solve(pressed_core(0.3, 0.01))
    assert core_peeq(wide.scene, wide.joint) == wide.steps[-1]["peeq_max"] == 0


def test_yielding_beside_the_core_is_not_the_core_s(tmp_path):
    """A block that yields at its hole leaves the core alone, and what the run warns of."""
    outcome = solve_scene(pressed_core(0.1, 0.002, "block"), tmp_path, MPI.COMM_SELF)
    assert outcome.steps[-1]["peeq_max"] > 0
    assert not any("where the force is applied" in w for w in outcome.warnings)
    pin = solve(pressed_core(0.1, 0.01))
    assert core_peeq(pin.scene, pin.joint) == pin.steps[-1]["peeq_max"] > 0


@pytest.mark.mpi
def test_a_core_that_yields_is_known_on_every_rank(comm):
    """The largest PEEQ within the core, whoever has its cells."""
    scene = pressed_core(yield_stress=0.01)
    one, several = (core_peeq(scene, solve(scene, c).joint) for c in (MPI.COMM_SELF, comm))
    assert several == pytest.approx(one, rel=1e-6)
    assert one > 0


@pytest.mark.mpi
def test_a_ring_does_not_depend_on_the_ranks(comm):
    """Force control, core force and its displacement on several ranks as on one."""
    one, several = (solve(persson_joint(0.5, 0.08), c).steps[-1] for c in (MPI.COMM_SELF, comm))
    assert several.iterations == one.iterations
    for name in ("P", "p0", "eps", "delta", "elastic_energy"):
        assert several[name] == pytest.approx(one[name], rel=1e-9)


def test_the_force_does_the_work_that_is_stored():
    """Work of the force over the mean displacement of its core: the elastic energy, within the step
    error."""
    errors = []
    for steps in (8, 16):
        m = solve(persson_joint(0.5, 0.16, steps)).steps[-1]
        errors.append(abs(m.work / m.elastic_energy - 1))
    assert errors[1] < 0.6 * errors[0] < 0.05


def test_the_work_of_an_interference_fit_counts_from_its_first_step_on():
    """The fit stores energy before there is a force: without it the balance is that of the steps,
    alone it is none."""
    balances = []
    for steps in (8, 16):
        done = solve(persson_joint(-0.2, 0.16, steps)).steps
        balances.append(energy_balance(done, 1))
        assert energy_balance(done) > 0.2
    assert balances[1] < 0.6 * balances[0] < 0.05
    assert energy_balance(done[:1], 1) is None

"""The joint against independent solvers, closed forms, and the laws that hold on any mesh."""

import json
from pathlib import Path
from weakref import ref

import numpy as np
import pytest
from mpi4py import MPI

from archord.postprocess.run import Run
from archord.solver.path.newton import NewtonSolver
from tests.output.run_files import solved as solved_runs
from tests.solver.parts import partition
from tests.solver.solving import SEVERAL, E, scene, small_scene, solve

REFERENCE = json.loads((Path(__file__).parents[1] / "reference" / "quarter_joint.json").read_text())
AWAY = {"displacement": [2.0, 0.0], "steps": [2, 1]}
FRACTIONS = ("0.5", "1.0", "1.5", "2.0")


def reference_forces(table: str, start: str) -> list[float]:
    rows = REFERENCE[table]
    return [next(v for k, v in rows.items() if k.startswith(start))[f] for f in FRACTIONS]


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_elastic_force_agrees_with_independent_solvers(kinematics):
    """P(delta) of GetFEM (current) and NGSolve (reference) within 0.05 % on at most 6 000 dofs, up
    to 2 dR."""
    solution = solve(scene(analysis={"kinematics": kinematics}))
    assert solution.joint.n_dofs <= 6000
    P = [m["P"] for m in solution.steps]
    assert pytest.approx(reference_forces("elastic_P", kinematics), rel=5e-4) == P


def test_elastic_contact_angle_and_peak_pressure():
    """eps and p0 at 2 dR within 0.5 % of the concentric joint (NGSolve p4), which differs from ours
    by O(dR/R)."""
    profile = REFERENCE["elastic_profile_concentric_delta_2"]
    last = solve(scene(steps=1)).steps[-1]
    assert last["eps"] == pytest.approx(profile["eps_rad"], rel=5e-3)
    assert last["p0"] == pytest.approx(profile["p0_over_Estar"], rel=5e-3)


@pytest.mark.parametrize(("size", "steps"), [(0.02, 20), (0.01, 5)])
def test_plastic_force_agrees_with_independent_solvers(size, steps):
    """P(2 dR) within 0.2 % of GetFEM's and NGSolve's 0.006692, without cutback, on 2 %R in at most
    7 iterations a step; on a finer mesh, with its shear bands, as well."""
    solution = solve(scene(size, steps=steps, yield_stress=0.002, joint={"growth": 0.5}))
    assert len(solution.steps) == steps
    assert pytest.approx(0.006692, rel=2e-3) == solution.steps[-1]["P"]
    if size == 0.02:
        assert sum(m.iterations for m in solution.steps) <= 7 * 20
        assert sum(m.cutbacks for m in solution.steps) == 0


VARIANTS = {
    "elastic": {},
    "plastic": {"yield_stress": 0.002},
    "plane stress": {"yield_stress": 0.004, "analysis": {"plane": "stress"}},
    "reference": {"yield_stress": 0.002, "analysis": {"kinematics": "reference"}},
    "one-sided": {"analysis": {"integration": "block"}},
    "rigid pin": {"yield_stress": 0.002, "pin": {"rigid": True}},
    "stiff pin": {"yield_stress": 0.002, "pin": {"E": 100 * E}},
    "hardening": {"block": {"yield_stress": 0.001, "hardening": 0.05}},
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_forces_balance(variant):
    """Pin reaction, block reaction and the integral of the contact pressure agree to 1e-8 of P in
    each step."""
    solution = solve(small_scene(0.2, 2, **VARIANTS[variant]))
    for m, profiles in zip(solution.steps, solution.profiles, strict=True):
        assert m["P"] > 0
        assert m.force_balance < 1e-8
        for p in profiles.values():
            assert (p.pressure * p.weight).sum() == pytest.approx(
                (p.raw_pressure * p.weight).sum(), rel=1e-12
            )


def test_a_projected_pressure_has_no_more_than_its_force():
    """The vertical integral of both sides' pressure is P: within O(dR/R), as the arcs' normals are
    the undeformed ones."""
    solution = solve(scene())
    for p in solution.profiles[-1].values():
        assert 2 * (p.pressure * p.weight * np.cos(p.angle)).sum() == pytest.approx(
            solution.steps[-1]["P"], rel=1e-2
        )


@pytest.mark.parametrize(
    ("key", "values", "within"),
    [("integration", ("both", "pin", "block"), 2e-4), ("gamma_factor", (0.5, 2.0, 10.0), 1e-4)],
)
def test_what_the_form_leaves_open_does_not_matter(key, values, within):
    """Which sides are integrated, and gamma over a range of 20, move P by the discretisation error:
    the form is consistent."""
    forces = [solve(scene(steps=1, analysis={key: value})).steps[-1]["P"] for value in values]
    assert forces == pytest.approx([forces[0]] * 3, rel=within)


EXTREMES = {
    "tight fit": {"joint": {"clearance": 1e-6}},
    "tiny load": {"load": {"displacement": 1e-3}},
    "large gamma": {"analysis": {"gamma_factor": 100.0}},
    "nearly incompressible": {"pin": {"nu": 0.499}, "block": {"nu": 0.499}},
    "soft pin": {"pin": {"E": 1e-6 * E}},
}


@pytest.mark.parametrize("extreme", EXTREMES)
def test_extreme_joints_are_solved_to_round_off(extreme):
    """Where rounding of positions of size R, or of a stiff body's stresses, limits the residual, it
    is what remains, and the forces balance."""
    solution = solve(small_scene(0.08, steps=2, **EXTREMES[extreme]))
    noise = solution.joint.equilibrium.evaluation.noise
    limit = max(1e-10, 2 * noise / solution.steps[-1]["P"])
    assert all(m.force_balance < max(1e-8, limit) for m in solution.steps)
    assert sum(m.cutbacks for m in solution.steps) == 0


def test_the_force_is_proportional_to_the_clearance():
    """P(delta/dR) / dR tends to a limit as dR/R falls (concentric circles): 1e-6 R against 1e-4
    R."""
    tight, tighter = (
        solve(scene(joint={"clearance": c}, steps=1)).steps[-1]["P"] / c for c in (1e-4, 1e-6)
    )
    assert tight == pytest.approx(tighter, rel=1e-3)


def test_energy_is_kept_within_the_step_error():
    """Work = stored + dissipated; what is missing falls at least with the step, to below 0.1 %."""
    missing = []
    for steps in (5, 10, 20):
        m = solve(small_scene(0.2, steps, yield_stress=0.002)).steps[-1]
        missing.append(abs(m.work - m.elastic_energy - m.plastic_dissipation) / m.work)
    assert missing[1] < 0.6 * missing[0]
    assert missing[2] < 0.6 * missing[1]
    assert missing[2] < 1e-3


def test_a_very_stiff_pin_is_a_rigid_pin():
    """The force on a pin 1e6 times stiffer than the block is that on a rigid circle."""
    stiff = solve(scene(steps=1, pin={"E": 1e6 * E})).steps[-1]["P"]
    rigid = solve(scene(steps=1, pin={"rigid": True}))
    assert rigid.joint.bulk.cells.keys() == {2}
    assert pytest.approx(stiff, rel=1e-4) == rigid.steps[-1]["P"]


def test_a_whole_pin_is_a_little_stiffer_than_its_half():
    """What lies behind the pressed diameter, kept straight, only hinders it from widening; forces
    balance as before."""
    half, whole = (solve(scene(0.12, 2, pin=pin)).steps[-1] for pin in ({}, {"whole": True}))
    assert 1.0 < whole["P"] / half["P"] < 1.02
    assert whole.force_balance < 1e-8


def test_like_bodies_share_pin_and_hole_swapped():
    """An elastic body with a yield stress out of reach is elastic."""
    elastic = solve(small_scene(0.08, 2)).steps[-1]
    plastic = solve(small_scene(0.08, 2, yield_stress=1e3)).steps[-1]
    assert pytest.approx(elastic["P"], rel=1e-9) == plastic["P"]
    assert plastic.elastic_energy == pytest.approx(elastic.elastic_energy, rel=1e-9)
    assert plastic["peeq_max"] == 0


def test_hertz_is_the_limit_of_small_contacts():
    """Half-width and peak pressure of Hertz's line contact within 1 % where the contact is small
    (a/R = 0.05).

    Johnson (1985), eqs. 4.43 and 4.45, conforming: 1/R' = 1/R - 1/(R + dR).
    """
    small = {"clearance": 0.5, "element_size": 0.006, "growth": 0.5, "block_size": 6.0}
    m = solve(scene(steps=1, joint=small, load={"displacement": 0.006})).steps[-1]
    radius = 1 / (1 - 1 / 1.5)
    half_width = np.sqrt(4 * m["P"] * radius / np.pi)
    peak = np.sqrt(m["P"] / (np.pi * radius))
    assert 0.03 < half_width < 0.08
    assert m["p0"] == pytest.approx(peak, rel=1e-2)
    assert m.contact_area / 2 == pytest.approx(half_width, rel=1e-2)


@pytest.mark.parametrize("sigma_y", [None, 0.002])
def test_results_do_not_depend_on_the_units(sigma_y):
    """The same joint in mm and MPa and in m and Pa: dimensionless results to 1e-9."""
    rows = []
    for length, stress in ((10.0, 115384.0), (0.01, 115384.0e6)):
        solid = {"E": E * stress, "nu": 0.3} | (
            {"yield_stress": sigma_y * stress} if sigma_y else {}
        )
        sized = {"radius": length, "clearance": 0.005 * length, "element_size": 0.08 * length}
        solution = solve(small_scene(0.08, 4, joint=sized, pin=solid, block=solid))
        m = solution.steps[-1]
        force = stress * length
        energies = (m.elastic_energy, m.plastic_dissipation, m.work)
        rows.append(
            [
                m["P"] / force,
                m["p0"] / stress,
                m["eps"],
                m["peeq_max"],
                m.contact_area / length,
                m["peeq_integral"] / length**2,
            ]
            + [e / force / length for e in energies]
            + [s.iterations for s in solution.steps]
        )
    assert rows[0] == pytest.approx(rows[1], rel=1e-9)


CUT = [
    ("plastic", "dealt round"),
    ("rigid pin by force", "all on the last"),
    ("plastic", "sectors"),
    ("plastic", "all on the first"),
    ("rigid pin", "sectors"),
    ("rigid pin", "blocks of 700"),
    ("rigid pin", "all on the last"),
    ("plastic by force", "blocks of 700"),
]


@pytest.mark.mpi
@pytest.mark.parametrize(("variant", "cut"), CUT if SEVERAL else CUT[:2])
def test_results_do_not_depend_on_the_ranks(cut, variant):
    """P, p0, PEEQ, energies to 1e-9 and iteration counts, whichever way the mesh is cut, against
    one rank.

    Ranks may own no contact facet, no plastic cell or no cell at all.
    """
    partitioner = {
        "sectors": None,
        "dealt round": partition(lambda i, _: i),
        "blocks of 700": partition(lambda i, _: i // 700),
        "all on the first": partition(lambda i, _: 0 * i),
        "all on the last": partition(lambda i, _: 0 * i - 1),
    }[cut]
    load = (
        {"load": {"displacement": None, "relative_force": 0.006}}
        if variant.endswith("force")
        else {}
    )
    problem = small_scene(0.1, 4, **VARIANTS[variant.removesuffix(" by force")], **load)
    together = solve(problem, MPI.COMM_WORLD, partitioner)
    alone = solve(problem)
    assert together.joint.n_dofs == alone.joint.n_dofs
    for a, b in zip(together.steps, alone.steps, strict=True):
        assert (a.iterations, a.cutbacks) == (b.iterations, b.cutbacks)
        assert a.values == pytest.approx(b.values, rel=1e-9)
        for name in set(vars(a)) - {"work", "force_balance", "seconds", "values"}:
            assert a[name] == pytest.approx(b[name], rel=1e-9), name


def test_peeq_is_told_by_body_and_near_the_contact(tmp_path):
    """The largest at the integration points that the files hold, and where: of each body, and
    within R/2 of the arc up to the largest contact angle so far, also when the pin is gone. The
    peak at the held corner is no contact."""
    [folder] = solved_runs(
        {"run": small_scene(0.1, 3, 0.002, load=AWAY, output={"points": True})}, tmp_path
    ).values()
    run = Run(folder)
    for step in (1, 2, 3):
        points = run.points(step)
        fields = run.fields(step)
        row = {k: v[step - 1] for k, v in run.columns.items()}
        x = points["coordinates"]
        peeq = points["peeq"]
        angle = np.arctan2(x[..., 0], -x[..., 1])
        depth = np.abs(np.hypot(*np.moveaxis(x, -1, 0)) - 1)
        places = {
            name: np.broadcast_to((fields.body == tag)[:, None], peeq.shape)
            for name, tag in run.bodies.items()
        }
        places["contact"] = (angle <= max(run.columns["eps"][:step])) & (depth <= 0.5)
        for name, inside in places.items():
            at = np.argmax(np.where(inside, peeq, -1))
            assert row[f"{name} peeq_max"] == pytest.approx(peeq.flat[at], rel=1e-9)
            assert (row[f"{name} at x"], row[f"{name} at y"]) == pytest.approx(
                tuple(x.reshape(-1, 2)[at]), abs=1e-9
            )
        assert (
            row["peeq_max"]
            == max(row["pin peeq_max"], row["block peeq_max"])
            > row["contact peeq_max"]
            > 0
        )
    assert run.columns["eps"][2] == 0


@pytest.mark.parametrize("material", [{}, {"yield_stress": 0.002}])
def test_petsc_keeps_no_solver_that_is_used_no_more(material):
    """Without Python's collector: not every petsc4py shows it what PETSc refers to. MPICH has 2048
    communicators, a run needs 16, and sweeps solve thousands of runs in one process."""
    joint = solve(scene(steps=1, block=material)).joint
    newton = NewtonSolver(joint.equilibrium)
    still = ref(newton)
    del newton
    assert still() is None

"""Problems stated by hand: symmetry, controls, distributed loads, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from archord.materials.elasticity import Elastic
from archord.materials.finite import LargeStrain
from archord.materials.kinematics import PLANE_STRESS, Kinematics, kinematics
from archord.solver.path.load_path import LoadPath
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from archord.solver.problem import Body, DeadLoad, Dirichlet, Drive, Guess, Interaction, Problem
from tests.solver.parts import ELASTIC, HARDENING, NU, PERFECT, E, blocks, coordinates, solve

DEPTH = 0.02
ON_EACH_OTHER = Interaction("joint", ("upper bottom", "lower top"))


BETWEEN_WALLS = [
    Dirichlet("base", "base", 1),
    Dirichlet("lid", "lid", 1, -1.0),
    *(Dirichlet("walls", side, 0) for side in ("left", "right")),
]


def columns(width: float = 1.0, material=HARDENING, **options) -> Problem:
    """Two blocks of a ``width`` on top of each other, between walls."""
    bodies = [Body(name, material) for name in ("lower", "upper")]
    return Problem(
        blocks(MPI.COMM_SELF, 3, 4, width=width), bodies, [ON_EACH_OTHER], BETWEEN_WALLS, **options
    )


@pytest.mark.parametrize("control", ["displacement", "force"])
def test_half_a_problem_with_symmetry_two_is_the_whole(control):
    """Forces, energies and PEEQ under both controls: the load of the half is that of the whole."""
    halves = [
        columns(width, symmetry=2 / width, drives=[Drive("", control=control)])
        for width in (1.0, 2.0)
    ]
    systems = [solve(halves[0], [DEPTH if control == "displacement" else 0.06])]
    systems.append(solve(halves[1], [systems[0].equilibrium.load]))
    found = [
        [
            s.drive_displacement(""),
            s.drive_force(""),
            *s.reaction("base"),
            *s.contact_force(),
            *s.energies(),
            *s.peeq(),
        ]
        for s in systems
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-8, abs=1e-14)
    assert systems[0].peeq()[1] > 0


def test_a_second_call_goes_on_from_the_first(monkeypatch):
    """By its own rules, through loads between the two: a little unloading in four steps is
    elastic."""
    system = solve(columns(), [DEPTH])
    loads = []
    peeq = system.peeq()
    accept = LoadPath.accept
    assert peeq[0] > 0
    monkeypatch.setattr(
        LoadPath, "accept", lambda path, load: (loads.append(load), accept(path, load))
    )
    system.solve([0.99 * DEPTH], StepRules(initial=0.25, growth=1.0))
    assert loads == pytest.approx(
        [DEPTH * share for share in (0.9975, 0.995, 0.9925, 0.99)], rel=1e-12
    )
    assert system.peeq() == peeq
    assert system.equilibrium.load == 0.99 * DEPTH


def test_force_control_finds_the_load_factor_of_its_force():
    """The force that a displacement takes, prescribed, takes that displacement back."""
    moved = solve(columns(), [DEPTH])
    pushed = solve(columns(drives=[Drive("", control="force")]), [moved.drive_force("")])
    assert pushed.drive_displacement("") == pytest.approx(DEPTH, rel=1e-8)
    assert pushed.energies() == pytest.approx(moved.energies(), rel=1e-8)


@pytest.mark.parametrize("symmetry", [1.0, 2.0])
def test_a_column_under_its_weight_follows_the_closed_form(symmetry):
    """Between walls, with stress that grows linearly downward; the weight works on its mean
    displacement."""
    mesh = blocks(MPI.COMM_SELF, 3, 3)
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    supports = [
        Dirichlet(s, s, axis)
        for s, axis in (("base", 1), ("left", 0), ("right", 0), ("upper bottom", 1))
    ]
    problem = Problem(
        mesh, bodies, (), supports, [DeadLoad("lower", (0.0, -1.0))], symmetry=symmetry
    )
    system = solve(problem, [0.01])
    weight = 0.01
    modulus = E * (1 - NU) / ((1 + NU) * (1 - 2 * NU))
    y = coordinates(system.V)[:, 1]
    u = system.equilibrium.displacement()
    lower = system.nodes_of(bodies[0])
    exact = -weight / symmetry / modulus * (1 - y[lower] ** 2) / 2
    np.testing.assert_allclose(u[lower, 1], exact, rtol=0, atol=1e-9 * weight)
    assert system.reaction("base")[1] == pytest.approx(weight, rel=1e-9)
    assert system.drive_force("") == weight
    assert system.drive_displacement("") == pytest.approx(weight / symmetry / modulus / 3, rel=1e-9)
    assert system.energies()[0] == pytest.approx(
        system.drive_force("") * system.drive_displacement("") / 2, rel=1e-9
    )


def test_a_load_is_spread_as_its_density_says():
    """Its first moment is that of the density, its sum the force."""
    mesh = blocks(MPI.COMM_SELF, 3, 3)
    load = DeadLoad("upper", (3.0, 4.0), lambda x: x[0] * x[1])
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    equilibrium = System(
        Problem(mesh, bodies, (), [Dirichlet("base", "base", 1)], [load])
    ).equilibrium
    assert equilibrium.drives.applied[0].sum(axis=0) == pytest.approx([3.0, 4.0], rel=1e-12)
    x = coordinates(equilibrium.unknowns.V)
    assert equilibrium.drives.applied[0].T @ x == pytest.approx(
        np.outer([3, 4], [2 / 3, 2 / 3]), rel=1e-12
    )


def applied(density):
    """The forces of a load of this ``density``."""
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    load = DeadLoad("upper", (3.0, 4.0), density)
    mesh = blocks(MPI.COMM_SELF, 3, 3)
    problem = Problem(mesh, bodies, (), [Dirichlet("base", "base", 1)], [load])
    return System(problem).equilibrium.drives.applied[0]


def test_a_density_of_one_number_spreads_evenly():
    np.testing.assert_allclose(applied(lambda x: 2.0), applied(None), atol=1e-12)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_a_density_without_an_integral_is_refused(value):
    with pytest.raises(ValueError, match="the density of a load has the integral"):
        applied(lambda x: value * x[0])


def test_a_guess_moves_bodies_rigidly():
    mesh = blocks(MPI.COMM_SELF, 2, 3)
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    problem = Problem(mesh, bodies, guess=lambda load: Guess(2 * load, {"upper": (load, -load)}))
    system = System(replace(problem, supports=[Dirichlet("base", "base", 1)]))
    state = system.first_guess(0.5)
    y = coordinates(system.V)[:, 1]
    assert state[-1] == 1.0
    np.testing.assert_array_equal(
        state[:-1].reshape(-1, 2)[y > 0.01], 0.5 * np.array([[1, -1]] * (y > 0.01).sum())
    )
    assert not state[:-1].reshape(-1, 2)[y < -0.01].any()


class Grained(Elastic):
    """Twice as stiff upright."""

    @property
    def moduli(self):
        moduli = super().moduli
        moduli[1, 1] *= 2
        return moduli


class Lopsided(Elastic):
    """What pulls one way does not pull the other."""

    @property
    def elastic_tangent(self):
        return super().elastic_tangent * np.array([1.0, 2.0, 1.0])


def test_an_anisotropic_body_follows_the_closed_form():
    """Between walls: the pressure is the upright modulus times the strain."""
    grained = Grained(E, NU, "strain")
    assert solve(columns(material=grained), [DEPTH]).drive_force("") == pytest.approx(
        grained.elastic_tangent[1, 1] * DEPTH / 2, rel=1e-9
    )


class Stiffening(Elastic):
    """Nonlinear, though it says no word of it."""

    def update(self, strain, state):
        stress, tangent, state = super().update(strain, state)
        return stress * (1 + 100 * np.abs(stress).max() / E), tangent, state


REFUSED = {
    "must be symmetric": {"bodies": [Body("lower", Lopsided(E, NU, "strain"))]},
    "different names": {"bodies": [Body("lower", ELASTIC), Body("lower", ELASTIC, "upper")]},
    "no facet, point or cell set 'top'": {"supports": [Dirichlet("base", "top", 1)]},
    "no cell set 'middle'": {"bodies": [Body("middle", ELASTIC)]},
    "'left' belongs to 2 cell sets": {
        "interactions": [Interaction("joint", ("left", "lower top"))]
    },
    "does not have the surface 'lid'": {
        "interactions": [Interaction("joint", ("upper bottom", "lower top"), integrated="lid")]
    },
    "must move supports": {
        "supports": [Dirichlet("base", "base", 1, 1.0)],
        "loads": [DeadLoad("lower", (0.0, -1.0))],
    },
    "no drive 'up'": {"loads": [DeadLoad("lower", (0.0, -1.0), drive="up")]},
    "'up' moves nothing": {"drives": [Drive("up")]},
    "a force on the cells of a set or on its facets": {"loads": [DeadLoad("lower", pressure=1.0)]},
    "'joint' is tied": {
        "interactions": [Interaction("joint", ("upper bottom", "lower top"), "tied", overlap=0.1)]
    },
    "must say yields": {"bodies": [Body("lower", Stiffening(E, NU, "strain"))]},
    "must be at large strain, too": {
        "bodies": [Body("lower", LargeStrain(PERFECT)), Body("upper", PERFECT)]
    },
}


@pytest.mark.parametrize("said", REFUSED)
def test_a_problem_that_contradicts_itself_is_refused(said):
    bodies = [Body("lower", ELASTIC), Body("upper", Elastic(E, NU, "strain"))]
    parts = {"bodies": bodies, "supports": [Dirichlet("base", "base", 1)]} | REFUSED[said]
    with pytest.raises(ValueError, match=said):
        System(Problem(blocks(MPI.COMM_SELF, 2, 3), **parts))


class Rounded(Elastic):
    """Hooke's law, computed in another order."""

    def update(self, strain, state):
        stress, tangent, state = super().update(strain / 3, state)
        return 3 * stress, tangent, state


@pytest.mark.parametrize("nu", [0.2, 0.25, 1 / 3])
def test_round_off_is_no_reason_to_refuse_a_material(nu):
    """Where a stress of the check cancels, nothing but round-off is left of it."""
    for plane in ("strain", "stress"):
        materials = Elastic(E, nu, plane), Rounded(E, nu, plane)
        problems = [columns(material=m, kinematics=kinematics(plane)) for m in materials]
        forces = [solve(problem, [DEPTH]).drive_force("") for problem in problems]
        assert forces[0] == pytest.approx(forces[1], rel=1e-9)


def test_a_problem_gives_its_kinematics_to_its_materials():
    """Whose plane is "strain" by default; another one that does not fit is refused."""
    problem = columns(material=LargeStrain(Elastic(E, NU)), kinematics=PLANE_STRESS)
    assert {body.material.plane for body in problem.bodies} == {"stress"}
    with pytest.raises(
        ValueError, match="plane = 'stress' does not fit a problem whose kinematics"
    ):
        columns(material=Elastic(E, NU, "stress"))


@pytest.mark.parametrize(
    ("key", "first", "then"),
    [
        ("thickness", 2.5, None),
        ("strain", "large", "small"),
        ("units", ("mm", "MPa"), ("m", "Pa")),
    ],
)
def test_a_problem_that_is_replaced_keeps_nothing_of_the_one_before(key, first, then):
    """Its thickness, its strain, and the units of a metal given by its name."""
    bodies = [Body("lower", "S355"), Body("upper", HARDENING)]
    mesh = blocks(MPI.COMM_SELF, 1, 1)
    stated = Problem(mesh, bodies, kinematics="plane stress", **{key: first})
    changed = replace(stated, **{key: then})
    fresh = Problem(mesh, bodies, kinematics="plane stress", **{key: then})
    assert (changed.thickness, changed.kinematics) == (fresh.thickness, fresh.kinematics)
    for one, other in zip(changed.bodies, fresh.bodies, strict=True):
        assert type(one.material) is type(other.material)
        assert one.material.E == other.material.E


def test_a_body_that_is_replaced_keeps_nothing_of_its_problem():
    """Neither its strain nor the units of its metal; a new material takes the place of both."""
    mesh = blocks(MPI.COMM_SELF, 1, 1)
    bodies = [Body("lower", "S355"), Body("upper", HARDENING)]
    first, second = Problem(mesh, bodies, strain="large").bodies
    renamed = [replace(first, name="other", cells="lower"), second]
    there = Problem(mesh, renamed, units=("m", "Pa"))
    assert not any(body.material.finite for body in there.bodies)
    assert pytest.approx(210e9) == there.bodies[0].material.E
    assert replace(first, material=HARDENING).stated is HARDENING


def test_a_problem_takes_another_thickness_than_its_kinematics_brought():
    """Or none again."""
    problem = replace(columns(), kinematics=Kinematics("strain", 5.0))
    assert problem.whole == replace(problem, steps=3).whole == 5
    assert replace(problem, thickness=2.0).whole == 2
    assert replace(problem, thickness=None).whole == 1

"""Drives: displacements and forces at once and in turn, reference points, couplings, pressures, and
what they cost."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.curve import RigidCircle
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.meshes.tagged_mesh import TaggedMesh
from archord.materials.elasticity import Elastic
from archord.solver.path.stepping import StepFailure, StepRules
from archord.solver.path.system import System
from archord.solver.problem import (
    Body,
    DeadLoad,
    Dirichlet,
    Drive,
    Guess,
    Interaction,
    Mean,
    Problem,
    Rigid,
)
from tests.solver.parts import (
    ELASTIC,
    HARDENING,
    NU,
    E,
    blocks,
    coordinates,
    quarter_annulus,
    solve,
)

BAR = Elastic(E, 0.0, "strain")
LENGTH = 4.0
END = (LENGTH, -0.5)
WALL = [Dirichlet("wall", "left", axis) for axis in (0, 1)]
NAMES = ("x", "y", "turn")


def reference_point(name: str, facets: str, point=END) -> list[Dirichlet]:
    """A rigid reference point with the drives "x", "y" and "turn"."""
    x, y = point
    turns = (lambda p: y - p[:, 1], lambda p: p[:, 0] - x)
    moves = [Dirichlet(name, facets, axis, 1.0, NAMES[axis]) for axis in (0, 1)]
    return moves + [Dirichlet(name, facets, axis, turns[axis], "turn") for axis in (0, 1)]


def coupling(name: str, facets: str, point, drives=NAMES) -> list[Mean]:
    return [Mean(name, facets, axis, point, drive) for axis, drive in enumerate(drives)]


def bar(comm=MPI.COMM_SELF, supports=WALL, **options) -> Problem:
    """A bar from x = 0 to 4, of height 1 from y = -1."""

    def build(gmsh) -> None:
        face = gmsh.model.occ.addRectangle(0, -1, 0, LENGTH, 1)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [face], name="bar")
        sides = [line for _, line in gmsh.model.getBoundary([(2, face)], oriented=False)]
        for line, name in zip(sides, ("bottom", "right", "top", "left"), strict=True):
            gmsh.model.addPhysicalGroup(1, [line], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)

    return Problem(gmsh_to_mesh(comm, build), [Body("bar", BAR)], (), supports, **options)


def drives(control: str, **paths) -> list[Drive]:
    return [Drive(name, path, control) for name, path in paths.items()]


@pytest.mark.parametrize("control", ["displacement", "force"])
def test_a_moment_on_a_rigid_end_bends_a_bar_as_beams_bend(control):
    """M = E I kappa, exactly where nu = 0; the end goes aside by theta L / 2, and the wall holds
    against the moment."""
    theta = 1e-3
    moment = E / 12 * theta / LENGTH
    paths = {"x": (0, 0), "y": (0, theta * LENGTH / 2), "turn": (0, theta)}
    if control == "force":
        paths = {"x": (0, 0), "y": (0, 0), "turn": (0, moment)}
    supports = [*reference_point("end", "right"), *WALL]
    system = solve(bar(supports=supports, drives=drives(control, **paths)), [1.0])
    np.testing.assert_allclose(
        system.driven()[0], [0, theta * LENGTH / 2, theta], rtol=1e-8, atol=1e-11
    )
    np.testing.assert_allclose(system.driven()[1], [0, 0, moment], rtol=1e-8, atol=1e-10 * E)
    for name, sign in (("end", 1), ("wall", -1)):
        np.testing.assert_allclose(system.reaction(name), 0, atol=1e-10 * E)
        assert system.reaction_moments(name, (7.0, 3.0))[0] == pytest.approx(
            sign * moment, rel=1e-7
        )
    assert system.energies()[0] == pytest.approx(moment * theta / 2, rel=1e-7)


def test_forces_at_once_and_in_turn_add_up():
    """Of an elastic bar, whatever their order; displacement control finds the same forces."""
    force = np.array([2.0, -1.0, 0.3]) * 1e-3
    supports = [*WALL, *reference_point("end", "right")]

    def loaded(loads, control="force", **paths):
        return solve(bar(supports=supports, drives=drives(control, **paths)), loads)

    single = [
        loaded([1.0], **{n: (0, f * (n == name)) for n, f in zip(NAMES, force, strict=True)})
        for name in NAMES
    ]
    together = loaded([1.0], **{name: (0, f) for name, f in zip(NAMES, force, strict=True)})
    x, y, turn = force
    in_turn = loaded([0.4, 1.0, 2.0, 3.0], x=(0, x), y=(0, 0, y), turn=(0, 0, 0, turn))
    u = sum(system.equilibrium.displacement() for system in single)
    for system in (together, in_turn):
        np.testing.assert_allclose(
            system.equilibrium.displacement(), u, rtol=0, atol=1e-9 * np.abs(u).max()
        )
    q = together.driven()[0]
    moved = loaded(
        [1.0], "displacement", **{name: (0, level) for name, level in zip(NAMES, q, strict=True)}
    )
    np.testing.assert_allclose(moved.driven()[1], force, rtol=1e-8)
    np.testing.assert_allclose(moved.reaction("end"), force[:2], rtol=1e-8)
    assert moved.reaction_moments("end", END)[0] == pytest.approx(force[2], rel=1e-7)


def test_a_mean_displacement_takes_the_force_that_gives_it():
    """At a point off the edge: a Lagrange multiplier, against forces on the same coupling;
    statically equivalent."""
    point = (5.0, 0.3)
    q = np.array([1e-3, -2e-3, 1e-3])
    given = {name: (0, level) for name, level in zip(NAMES, q, strict=True)}
    means = coupling("tip", "right", point)
    prescribed = solve(bar(means=means, drives=drives("displacement", **given)), [1.0])
    np.testing.assert_allclose(prescribed.driven()[0], q, rtol=1e-9)
    force = prescribed.driven()[1]
    np.testing.assert_allclose(prescribed.reaction("tip"), force[:2], rtol=1e-9)
    assert prescribed.reaction_moments("tip", point)[0] == pytest.approx(force[2], rel=1e-8)
    np.testing.assert_allclose(prescribed.reaction("wall"), -force[:2], rtol=1e-7)
    assert prescribed.reaction_moments("wall", point)[0] == pytest.approx(-force[2], rel=1e-7)
    forced = {name: (0, level) for name, level in zip(NAMES, force, strict=True)}
    pushed = solve(bar(means=means, drives=drives("force", **forced)), [1.0])
    np.testing.assert_allclose(pushed.driven()[0], q, rtol=1e-7)
    u = pushed.equilibrium.displacement()
    np.testing.assert_allclose(
        u, prescribed.equilibrium.displacement(), rtol=0, atol=1e-8 * np.abs(u).max()
    )
    assert pushed.energies()[0] == pytest.approx(force @ q / 2, rel=1e-7)


@pytest.mark.mpi
def test_means_alone_hold_a_body_on_any_ranks(comm):
    """Pulled between two couplings, a bar is in uniform tension; no node of it is held."""
    held = ("left x", "left y", "left turn")
    means = [*coupling("left", "left", (0.0, -0.5), held), *coupling("tip", "right", END)]
    paths = dict.fromkeys(held, (0.0,)) | {"x": (0, 1e-3), "y": (0.0,), "turn": (0.0,)}
    problem = bar(comm, (), means=means, drives=drives("displacement", **paths))
    system = solve(problem, [1.0])
    force = E * 1e-3 / LENGTH
    expected = 1e-3 / LENGTH * coordinates(system.V) * [1, 0]
    np.testing.assert_allclose(system.equilibrium.displacement(), expected, rtol=0, atol=1e-11)
    np.testing.assert_allclose(system.reaction("tip"), [force, 0], atol=1e-9 * force)
    np.testing.assert_allclose(system.reaction("left"), [-force, 0], atol=1e-9 * force)
    assert system.drive_names == list(paths)
    assert len(system.equilibrium.unknowns.levels) == len(paths) + 3


def pressed(comm=MPI.COMM_SELF, **options) -> Problem:
    """Two blocks in contact: the lower one on a rigid reference point, which forces push and turn,
    the upper one under a disc and on a coupling that shifts its middle."""
    bodies = [Body("lower", HARDENING), Body("upper", ELASTIC)]
    disc = Rigid(
        RigidCircle(np.array([0.45, 3.0]), 2.0), {"disc x": (1.0, 0.0), "disc y": (0.5, -1.0)}
    )
    interactions = [
        Interaction("joint", ("upper bottom", "lower top")),
        Interaction("disc", (disc, "lid")),
    ]
    paths = [
        *drives("force", y=(0, 0.03), turn=(0, 1e-3)),
        *drives("displacement", x=(0, 0), mean=(0, 2e-3)),
    ]
    paths += [
        Drive("disc x", (0, 1e-3)),
        Drive("disc y", (0, 0.02), options.pop("disc", "displacement")),
    ]
    means = [Mean("shift", "upper bottom", 0, (0.5, 0.7), "mean")]
    supports = reference_point("base", "base", (0.4, -1.2))
    return Problem(
        blocks(comm, 3, 4), bodies, interactions, supports, means=means, drives=paths, **options
    )


def test_the_bordered_tangent_is_the_derivative_of_the_residual():
    """With plastic points, contact, a forced disc, a reference point and a multiplier, in random
    directions."""
    system = System(pressed(disc="force"))
    equilibrium = system.equilibrium
    rng = np.random.default_rng(0)
    equilibrium.load = 1.0
    state = 1e-3 * rng.normal(size=len(equilibrium.state()))
    state[1 : 2 * equilibrium.unknowns.n_local : 2] -= (
        0.03 * coordinates(system.V)[:, 1]
    )  # pressed into the plastic range
    state[2 * equilibrium.unknowns.n_local + system.drive_names.index("disc y")] = 0.06
    x = equilibrium.unknowns.vector()
    equilibrium.pack(state, x)
    f, at, product, direction = (x.duplicate() for _ in range(4))
    equilibrium.residual_of(x, f)
    equilibrium.linear.update()
    assert all(pair.active.any() for pair in system.contact.pairs)
    assert system.peeq()[0] > 0
    assert (
        len(equilibrium.drives.unknown) == 3 + 1 + 3
    )  # forces, a multiplier, and the anchors of its body
    n = x.local_size
    sides = []
    free = np.append(
        ~equilibrium.unknowns.fixed.ravel(),
        np.ones(n - equilibrium.unknowns.fixed.size, dtype=bool),
    )
    for _ in range(3):
        direction.array[:] = rng.normal(size=n) * free
        equilibrium.linear.border.last.mult(None, direction, product)
        sides = []
        for h in (1e-7, -1e-7):
            at.array[:] = x.array_r + h * direction.array_r
            equilibrium.residual_of(at, f)
            sides.append(f.array_r.copy())
        difference = (sides[0] - sides[1]) / 2e-7
        assert np.linalg.norm(product.array_r - difference) < 1e-6 * np.linalg.norm(difference)
        np.testing.assert_allclose(product.array_r[-7:], difference[-7:], rtol=1e-4, atol=1e-6 * E)


@pytest.mark.mpi
def test_drives_find_the_same_on_any_ranks(comm):
    """Forces and displacements of all drives, at every rank."""
    found = []
    for ranks in (MPI.COMM_SELF, comm):
        system = System(pressed(ranks))
        system.solve([0.5, 1.0])
        found.append(np.concatenate(system.driven()))
        forces = [system.contact_force(name) for name in ("joint", "disc")]
        np.testing.assert_allclose(forces[1], forces[0] - system.reaction("shift"), atol=1e-9)
        np.testing.assert_allclose(system.reaction("base"), -forces[0], atol=1e-9)
        assert system.reaction_moments("base", (0.4, -1.2))[0] == pytest.approx(1e-3, rel=1e-6)
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8, atol=1e-10)


def test_pressure_in_a_thick_cylinder_is_lames():
    """Plane strain, by a pressure inside, whose displacement is the volume that it sweeps."""
    a = 1.0
    b = 2.0
    p = 0.01
    mesh = quarter_annulus(MPI.COMM_SELF, a, b, 0.1)
    supports = [Dirichlet("x", "x", 1), Dirichlet("y", "y", 0)]
    loads = [DeadLoad(facets="inner", pressure=1.0, drive="pressure")]
    problem = Problem(
        mesh,
        [Body("ring", ELASTIC)],
        (),
        supports,
        loads,
        drives=[Drive("pressure", (0, p))],
        symmetry=4.0,
    )
    system = solve(problem, [1.0])
    A = p * a**2 / (b**2 - a**2)
    B = p * a**2 * b**2 / (b**2 - a**2)
    u = lambda r: (1 + NU) / E * ((1 - 2 * NU) * A * r + B / r)  # noqa: E731
    X = coordinates(system.V)
    r = np.linalg.norm(X, axis=1)
    found = (system.equilibrium.displacement() * X).sum(axis=1) / r
    np.testing.assert_allclose(found, u(r), rtol=2e-4)
    assert system.driven()[1] == p
    assert system.driven()[0][0] == pytest.approx(2 * np.pi * a * u(a), rel=1e-4)
    assert system.reaction("x")[1] == pytest.approx(-4 * p * a, rel=1e-4)


def test_a_force_on_facets_is_spread_evenly():
    """Along a straight edge of a bar without Poisson's ratio: uniform tension."""
    loads = [DeadLoad(facets="right", force=(1.0, 0.0))]
    system = solve(bar(loads=loads), [1e-3])
    assert system.drive_displacement("") == pytest.approx(1e-3 * LENGTH / E, rel=1e-9)
    np.testing.assert_allclose(system.equilibrium.displacement()[:, 1], 0, atol=1e-12)


def rings(a, b, c, d, size) -> TaggedMesh:
    """Quarters of two rings, "bush" between the radii ``a`` and ``b`` and "housing" between ``c``
    and ``d``."""
    radii = {1: a, 2: b, 3: c, 4: d}

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        centre = geo.addPoint(0, 0, 0)
        lines: dict[str, list[int]] = {"x": [], "y": []}
        for name, (inner, outer) in {"bush": (1, 2), "housing": (3, 4)}.items():
            ends = ((radii[inner], 0), (radii[outer], 0), (0, radii[outer]), (0, radii[inner]))
            p = [geo.addPoint(x, y, 0) for x, y in ends]
            edges = [geo.addLine(p[0], p[1]), geo.addCircleArc(p[1], centre, p[2])]
            edges += [geo.addLine(p[2], p[3]), geo.addCircleArc(p[3], centre, p[0])]
            face = geo.addPlaneSurface([geo.addCurveLoop(edges)])
            geo.synchronize()
            gmsh.model.addPhysicalGroup(2, [face], name=name)
            gmsh.model.addPhysicalGroup(1, [edges[3]], inner, f"{name} inner")
            gmsh.model.addPhysicalGroup(1, [edges[1]], outer, f"{name} outer")
            lines["x"].append(edges[0])
            lines["y"].append(edges[2])
        for name, edges in lines.items():
            gmsh.model.addPhysicalGroup(1, edges, name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)

    names = ("bush inner", "bush outer", "housing inner", "housing outer")
    circles = [Circle(name, (0.0, 0.0), r) for name, r in zip(names, radii.values(), strict=True)]
    return gmsh_to_mesh(MPI.COMM_SELF, build, circles)


def fitted(interference, overlap, **options) -> System:
    """A bush in a housing, of unlike materials, pressed in a stage of its own."""
    bodies = [
        Body("bush", Elastic(110.0, 0.34, "strain")),
        Body("housing", Elastic(70.0, 0.33, "strain")),
    ]
    fit = Interaction(
        "fit", ("bush outer", "housing inner"), interference=interference, overlap=overlap
    )
    supports = [Dirichlet("x", "x", 1), Dirichlet("y", "y", 0)]
    mesh = rings(10.05, 14.0, 14.0 - overlap, 30.0, 1.2)
    return solve(
        Problem(mesh, bodies, [fit], supports, fit=True, symmetry=4.0, **options), [0.5, 1.0]
    )


def test_forces_balance_to_the_forces_that_a_fit_presses_with():
    """They are the pressure on the whole circle, whatever their resultant: zero where nothing but
    the fit loads it."""
    system = fitted(0.02, 0.0)
    pair = system.contact.pair_of(system.sides["housing inner"])
    pressed = float(pair.pressure.mean()) * 2 * np.pi * 14.0
    assert 4 * system.contact.largest_pressed() == pytest.approx(pressed, rel=5e-3)
    rng = np.random.default_rng(0)
    system.equilibrium.unknowns.u.x.array[:] += 1e-7 * rng.random(
        len(system.equilibrium.unknowns.u.x.array)
    )
    system.equilibrium.evaluate()
    left = [
        4 * np.linalg.norm(system.equilibrium.diagnostics.residual_on(system.nodes_of(b)))
        for b in system.problem.bodies
    ]
    assert system.force_balance() == pytest.approx(max(left) / pressed, rel=5e-3)


def test_a_press_fit_is_lames():
    """Fit pressure and displacements of two rings, given as an interference and drawn as an
    overlap."""
    pressures = []
    for interference, overlap in ((0.02, 0.0), (0.0, 0.02)):
        system = fitted(interference, overlap)
        a = 10.05
        b = 14.0
        c = 14.0 - overlap
        d = 30.0

        def flexibility(
            r, other, modulus, nu
        ):  # radial displacement of a ring under a pressure at r, free at the other
            k = (1 + nu) / modulus
            C = r**2 / (other**2 - r**2)
            return k * C * ((1 - 2 * nu) * r + other**2 / r)

        give = flexibility(c, d, 70.0, 0.33) - flexibility(b, a, 110.0, 0.34)
        pressure = 0.02 / give
        mean = system.contact_force("fit") / (4 * c)
        assert mean == pytest.approx(pressure, rel=1e-4 if interference else 0.02 / 14)
        pair = system.contact.pair_of(system.sides["housing inner"])
        assert np.abs(pair.pressure / pressure - 1).max() < 0.01
        np.testing.assert_allclose(pair.distance, 0, atol=1e-5)
        X = coordinates(system.V)
        bore = np.isclose(np.linalg.norm(X, axis=1), c) & (
            system.equilibrium.displacement() @ [1, 1] > 0
        )
        moved = np.linalg.norm(system.equilibrium.displacement()[bore], axis=1)
        np.testing.assert_allclose(moved, pressure * flexibility(c, d, 70.0, 0.33), rtol=2e-3)
        pressures.append(mean)
    assert pressures[0] == pytest.approx(pressures[1], rel=2 * 0.02 / 14)


def test_half_a_fit_is_there_in_the_middle_of_its_stage():
    system = fitted(0.02, 0.0)
    whole = system.contact.pairs[0].pressure.mean()
    system.solve([0.5])
    assert system.contact.pairs[0].pressure.mean() == pytest.approx(whole / 2, rel=1e-3)


def test_every_disc_follows_its_own_drive():
    """One is pushed into a block by a force, one by the displacement that this takes: both indent
    alike."""
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    names = ("", "other")
    discs = [
        Rigid(RigidCircle(np.array([0.5, y + 2.0]), 2.0), (0.0, -1.0), names[y]) for y in (0, 1)
    ]
    interactions = [
        Interaction(f"{y}", (disc, f))
        for y, disc, f in zip((0, 1), discs, ("lower top", "lid"), strict=True)
    ]
    supports = [Dirichlet("base", f, axis) for f in ("base", "upper bottom") for axis in (0, 1)]
    mesh = blocks(MPI.COMM_SELF, 6, 6)
    paths = [Drive("", (0, 0.05), "force"), Drive("other", (0, 0.0))]
    start = Guess(1e-3)
    first = solve(
        Problem(mesh, bodies, interactions, supports, drives=paths, guess=lambda load: start),
        [0.5, 1.0],
    )
    depth = first.drive_displacement("")
    assert first.drive_force("other") == 0
    paths = [Drive("", (0, 0.0)), Drive("other", (0, depth))]
    second = solve(Problem(mesh, bodies, interactions, supports, drives=paths), [0.5, 1.0])
    assert second.drive_force("other") == pytest.approx(0.05, rel=3e-3)
    assert first.contact_force("0")[1] == pytest.approx(-0.05, rel=1e-9)


def test_a_force_that_nothing_resists_is_told_with_its_drive():
    """A block that two forces push, of which one finds no resistance."""
    supports = [
        *reference_point("lid", "lid", (0.5, 1.0)),
        Dirichlet("base", "base", 1),
        Dirichlet("base", "base", 0),
    ]
    bodies = [Body("lower", ELASTIC), Body("upper", ELASTIC)]
    paths = drives("force", x=(0, 0.01), y=(0, -0.02), turn=(0, 0))
    problem = Problem(
        blocks(MPI.COMM_SELF, 2, 3),
        bodies,
        [Interaction("joint", ("upper bottom", "lower top"))],
        supports,
        drives=paths,
    )
    with pytest.raises(StepFailure, match="'x'"):
        System(problem).solve([1.0], StepRules(minimum=1.0))

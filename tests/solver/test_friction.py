"""Coulomb friction against closed forms, and what it leaves alone."""

from __future__ import annotations

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.geometry.meshes.fenicsx import gmsh_to_mesh
from archord.geometry.meshes.refine import Circle
from archord.geometry.shapes.rectangles import rectangles
from archord.materials.elasticity import Elastic
from archord.presets.arc import arc_profiles
from archord.scene.presets.joint import Scene
from archord.solver.contact.laws.named import LAWS, contact_law
from archord.solver.path.system import System
from archord.solver.problem import Body, Dirichlet, Drive, Interaction, Load, Problem, Support
from tests.solver.parts import blocks, solve
from tests.solver.solving import joint_system

pytestmark = pytest.mark.mpi

E = 210000.0
NU = 0.3
STEEL = Elastic(E, NU, "strain")
MU = 0.3


def lid(*names: str, control: str = "force", **paths) -> tuple[list[Dirichlet], list[Drive]]:
    """The edge "lid", moved straight by drives of these ``names`` ("x", "y"): ``paths`` of forces
    or displacements."""
    supports = [Dirichlet(name, "lid", "xy".index(name), 1.0, name) for name in names]
    return supports, [Drive(name, paths[name], control) for name in names]


def held(name: str) -> list[Dirichlet]:
    return [Dirichlet(name, name, axis) for axis in (0, 1)]


def wedge(comm: MPI.Comm, slope: float, n: int):
    """A block on a longer one, with an interface of this ``slope``; sets as `blocks`."""

    def build(gmsh) -> None:
        for name, corners, edges in (
            (
                "lower",
                [(-1, -1), (3, -1), (3, 3 * slope), (-1, -slope)],
                {"base": 0, "lower top": 2},
            ),
            ("upper", [(0, 0), (1, slope), (1, 1.5), (0, 1.5)], {"upper bottom": 0, "lid": 2}),
        ):
            points = [gmsh.model.geo.addPoint(x, y, 0) for x, y in corners]
            lines = [
                gmsh.model.geo.addLine(a, b)
                for a, b in zip(points, [*points[1:], points[0]], strict=True)
            ]
            face = gmsh.model.geo.addPlaneSurface([gmsh.model.geo.addCurveLoop(lines)])
            gmsh.model.geo.synchronize()
            gmsh.model.addPhysicalGroup(2, [face], name=name)
            for edge, k in edges.items():
                gmsh.model.addPhysicalGroup(1, [lines[k]], name=edge)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 1 / n)

    return gmsh_to_mesh(comm, build)


@pytest.mark.parametrize("kinematics", ["current", "reference"])
@pytest.mark.parametrize("mu", [0.1, 0.5])
def test_a_block_is_pushed_up_a_wedge_by_the_force_of_the_cone(mu, kinematics):
    """F/G = (tan a + mu)/(1 - mu tan a) (NAFEMS CGS-4), on the whole face that slides, and nothing
    of it before."""
    slope = 0.2
    supports, drives = lid("x", control="displacement", x=[0, 0, 1e-6])
    up, weight = lid("y", y=[0, -0.01, -0.01])
    bodies = [Body(name, STEEL) for name in ("lower", "upper")]
    contact = Interaction(
        "contact", ("upper bottom", "lower top"), friction=mu, kinematics=kinematics
    )
    mesh = wedge(MPI.COMM_WORLD, slope, 4)
    system = System(
        Problem(mesh, bodies, [contact], [*held("base"), *supports, *up], drives=drives + weight)
    )
    ratio = (slope + mu) / (1 - mu * slope)
    found = []
    for load in (1.0, 1.01, 1.5, 2.0):
        system.solve([load])
        found.append(system.drive_force("x") / 0.01)
    assert found[0] < found[1] < 0.9 * ratio
    assert found[2:] == pytest.approx([ratio, ratio], rel=1e-6)


def rings(comm: MPI.Comm, radii: tuple[float, float, float], size: float):
    """Two rings that touch at the middle one of ``radii``: "inside" the inner's bore, "pin" and
    "hole", "outside"."""

    def build(gmsh) -> None:
        for name, a, b, edges in (
            ("inner", *radii[:2], ("inside", "pin")),
            ("outer", *radii[1:], ("hole", "outside")),
        ):
            disc, bore = (gmsh.model.occ.addDisk(0, 0, 0, r, r) for r in (b, a))
            (face, *_), _ = gmsh.model.occ.cut([(2, disc)], [(2, bore)])
            gmsh.model.occ.synchronize()
            gmsh.model.addPhysicalGroup(2, [face[1]], name=name)
            lines = [line for _, line in gmsh.model.getBoundary([face], oriented=False)]
            lines.sort(key=lambda line: gmsh.model.occ.getMass(1, line))
            for edge, line in zip(edges, lines, strict=True):
                gmsh.model.addPhysicalGroup(1, [line], name=edge)
        gmsh.option.setNumber("Mesh.MeshSizeMin", size)
        gmsh.option.setNumber("Mesh.MeshSizeMax", size)

    a, b, c = radii
    edges = {"inside": a, "pin": b, "hole": b, "outside": c}
    return gmsh_to_mesh(comm, build, [Circle(name, (0.0, 0.0), r) for name, r in edges.items()])


@pytest.mark.parametrize("kinematics", ["current", "reference"])
def test_a_pressed_ring_slips_at_the_torque_of_its_pressure(kinematics):
    """T = 2 pi mu p r^2, from p before it turns; sticking before, and no more beyond, all round and
    round again."""
    r = 10.0
    mu = 0.2
    mesh = rings(MPI.COMM_WORLD, (6.0, r, 18.0), 1.5)
    turn = [
        Dirichlet("bore", "inside", 0, lambda x: -x[:, 1], "turn"),
        Dirichlet("bore", "inside", 1, lambda x: x[:, 0], "turn"),
    ]
    fit = Interaction("fit", ("pin", "hole"), friction=mu, interference=0.01, kinematics=kinematics)
    bodies = [Body("inner", STEEL), Body("outer", STEEL)]
    path = [0, 0, 1e-4, 1e-3, 2e-3]
    problem = Problem(
        mesh, bodies, [fit], [*turn, *held("outside")], drives=[Drive("turn", path)], fit=True
    )
    system = System(problem)
    full = []
    torque = []
    on_contact = []
    for load in (1.0, 2.0, 3.0, 4.0):
        system.solve([load])
        pressed = sum(
            pair.share * (pair.surface.weight * pair.pressure).sum()
            for pair in system.contact.pairs
        )
        # normals of deformed curves turn with the hole, and pressures get an arm
        turned = system.mean_motion("hole", (0.0, 0.0))[2] * (kinematics == "current")
        full.append((mu + turned) * r * system.comm.allreduce(pressed))
        torque.append(system.drive_force("turn"))
        on_contact.append(system.contact_moments("fit", (0.0, 0.0))[0])
        at_rim = system.reaction_moments("outside", (0.0, 0.0))[0]
        assert on_contact[-1] == pytest.approx(-at_rim, abs=1e-8 * full[0])
    assert torque[1] < 0.9 * full[0]
    assert on_contact[2:] == pytest.approx(full[2:], rel=1e-5)
    if (
        kinematics == "reference"
    ):  # else those who hold feel the normals turn with the pin by an angle, over mu
        assert torque == pytest.approx(on_contact, rel=1e-6, abs=1e-6 * full[0])
    slipped = (path[-1] - on_contact[-1] / torque[1] * path[2]) * r
    assert system.friction_dissipation() == pytest.approx(full[-1] / r * slipped, rel=0.01)


@pytest.mark.parametrize("strain", ["small", "large"])
def test_the_moment_of_contact_is_that_of_the_supports(strain):
    """A punch is pressed on a foot and slides far: at small strain forces act where bodies were, at
    large strain where they are."""
    mesh = rectangles({"foot": (-3, -2, 6, 2), "punch": (-1, 0, 2, 1)}, size=0.6)
    problem = Problem(
        mesh,
        [Body("foot", STEEL), Body("punch", STEEL)],
        [Interaction("rub", ("punch bottom", "foot top"), friction=0.3)],
        [Support("foot bottom")],
        [
            Load("press", on="punch top", direction="y", displacement=[-0.05, -0.05]),
            Load("slide", on="punch top", direction="x", displacement=[0.0, 0.5]),
        ],
        strain=strain,
        steps=[1, 2],
    )
    system = System(problem)
    system.solve()
    moment = system.contact_moments("rub", (7.0, 3.0))
    at_foot = system.reaction_moments("foot bottom", (7.0, 3.0))
    assert moment == pytest.approx(-at_foot, rel=1e-8)


def test_boundless_friction_ties_what_is_pressed():
    """Two blocks pressed and then sheared."""
    found = []
    for law in ({"law": "tied"}, {"friction": 1e3, "kinematics": "reference"}):
        supports, drives = lid("x", "y", x=[0, 0, 200], y=[0, -1000, -1000])
        contact = Interaction("contact", ("upper bottom", "lower top"), **law)
        bodies = [Body(name, STEEL) for name in ("lower", "upper")]
        mesh = blocks(MPI.COMM_WORLD, 3, 4)
        system = solve(
            Problem(mesh, bodies, [contact], [*held("base"), *supports], drives=drives), [1.0, 2.0]
        )
        found.append(
            [system.drive_displacement("x"), system.drive_displacement("y"), *system.energies()]
        )
    assert found[1] == pytest.approx(found[0], rel=1e-6)


def test_sliding_forth_and_back_loses_what_the_loads_put_in():
    """A cycle of blocks: the loads' work is stored or dissipated; friction never gives back."""
    bodies = [Body(name, STEEL) for name in ("lower", "upper")]
    contact = Interaction("contact", ("upper bottom", "lower top"), friction=MU)
    supports, drives = lid("x", control="displacement", x=[0, 0, 1e-3, -1e-3, 1e-3])
    up, weight = lid("y", y=[0, *4 * [-10]])
    mesh = blocks(MPI.COMM_WORLD, 4, 3)
    system = System(
        Problem(mesh, bodies, [contact], [*held("base"), *supports, *up], drives=drives + weight)
    )
    work = 0.0
    last = (np.zeros(2), np.zeros(2))
    lost = [0.0]
    for load in np.linspace(0, 4, 161)[1:]:
        system.solve([load])
        q, f = system.driven()
        work += float(((q - last[0]) * (f + last[1])).sum() / 2)
        last = q, f
        lost.append(system.friction_dissipation())
    assert (np.diff(lost) >= 0).all()
    assert work == pytest.approx(system.energies()[0] + lost[-1], rel=2e-3)
    assert abs(system.drive_force("x")) == pytest.approx(MU * 10, rel=1e-3)


def cylinder_on_block(comm: MPI.Comm, R: float, size: float, near: float):
    """Half a cylinder on a block; elements of ``size`` within ``near`` of first touch, and larger
    with the distance."""

    def build(gmsh) -> None:
        geo = gmsh.model.geo
        points = [geo.addPoint(x, y, 0) for x, y in ((0, R), (-R, R), (0, 0), (R, R))]
        arcs = [
            geo.addCircleArc(a, points[0], b)
            for a, b in ((points[1], points[2]), (points[2], points[3]))
        ]
        top = geo.addLine(points[3], points[1])
        corners = [
            geo.addPoint(x, y, 0)
            for x, y in ((-4 * R, -4 * R), (4 * R, -4 * R), (4 * R, 0), (0, 0), (-4 * R, 0))
        ]
        lines = [
            geo.addLine(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
        ]
        sets = {"upper": [*arcs, top], "lower": lines}
        faces = {
            name: geo.addPlaneSurface([geo.addCurveLoop(edges)]) for name, edges in sets.items()
        }
        geo.synchronize()
        for name, face in faces.items():
            gmsh.model.addPhysicalGroup(2, [face], name=name)
        for name, edges in {
            "arc": arcs,
            "lid": [top],
            "lower top": lines[2:4],
            "base": [lines[0]],
        }.items():
            gmsh.model.addPhysicalGroup(1, edges, name=name)
        field = gmsh.model.mesh.field
        field.add("MathEval", 1)
        beyond = f"(sqrt(x*x + y*y) - {near})"
        field.setString(1, "F", f"{size} + 0.15*({beyond} + abs({beyond}))")
        field.setAsBackgroundMesh(1)
        for name in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints"):
            gmsh.option.setNumber(f"Mesh.{name}", 0)

    return gmsh_to_mesh(comm, build, [Circle("arc", (0.0, R), R)])


def test_a_tangential_force_leaves_the_stick_zone_of_cattaneo_and_mindlin():
    """c/a = sqrt(1 - Q/(mu P)) and the shear at the centre, mu p0 (1 - c/a) (Johnson 1985, section
    7.2)."""
    R = 10.0
    P = 1000.0
    modulus = E / (2 * (1 - NU**2))
    a = np.sqrt(4 * P * R / (np.pi * modulus))
    p0 = 2 * P / (np.pi * a)
    shares = [0.25, 0.5, 0.75]
    supports, drives = lid("x", "y", x=[0, 0, *(MU * P * q for q in shares)], y=[0, *4 * [-P]])
    contact = Interaction("contact", ("arc", "lower top"), friction=MU, slide=a)
    bodies = [Body(name, STEEL) for name in ("upper", "lower")]
    mesh = cylinder_on_block(MPI.COMM_WORLD, R, a / 12, 1.2 * a)
    problem = Problem(
        mesh, bodies, [contact], [*held("base"), *supports], drives=drives, stabilise=True
    )
    system = System(problem)
    system.solve([1.0])
    for n, share in enumerate(shares, 1):
        system.solve([n + 0.5, n + 1.0])
        stick = np.sqrt(1 - share)
        for pair in system.contact.pairs:
            width = system.comm.allreduce((pair.surface.weight.ravel() * pair.sticks).sum()) / 2
            assert width == pytest.approx(stick * a, rel=0.03)
            x = pair.surface.point.reshape(-1, 2)[:, 0]
            near = np.abs(x) < 0.2 * stick * a
            q = system.comm.allreduce(np.abs(pair.traction[near, 1]).sum()) / system.comm.allreduce(
                near.sum()
            )
            x2 = system.comm.allreduce((x[near] ** 2).sum()) / system.comm.allreduce(near.sum())
            flat = MU * p0 * (1 - stick - x2 / (2 * a**2) * (1 - 1 / stick))
            assert q == pytest.approx(flat, rel=0.02)


def test_what_cannot_rub_is_refused():
    """No friction is the law without; a tied surface has none, and a coefficient is not
    negative."""
    assert type(contact_law("frictionless", 0.0)) is LAWS["frictionless"]
    for law, friction in (("tied", 0.1), ("frictionless", -0.1)):
        with pytest.raises(ValueError, match="friction must be positive"):
            contact_law(law, friction)


def test_the_joint_of_the_paper_with_friction():
    """P, p0 and the energy lost, from GetFEM and a code of our own that agree to the digits given
    (P) and about; the dissipation closes the balance of energy."""
    scene = Scene(
        joint={"radius": 1.0, "relative_clearance": 0.005},
        pin={"E": 1.82, "nu": 0.3},
        block={"E": 1.82, "nu": 0.3},
        analysis={"friction": 0.1},
        load={"displacement": 2.0, "steps": 20},
    )
    joint = joint_system(scene, MPI.COMM_WORLD)
    work = 0.0
    last = (0.0, 0.0)
    for load in scene.targets:
        joint.solve([load])
        delta = joint.drive_displacement("")
        P = joint.drive_force("")
        work += (delta - last[0]) * (P + last[1]) / 2
        last = delta, P
        if load == pytest.approx(0.005):
            assert pytest.approx(5.6493e-3, rel=1e-3) == P
    assert last[1] == pytest.approx(1.32327e-2, rel=1e-3)
    assert joint.friction_dissipation() == pytest.approx(1.27e-6, rel=0.05)
    assert work - joint.energies()[0] == pytest.approx(joint.friction_dissipation(), rel=0.05)
    # what the pin's arc drags away from the axis, the hole's arc drags back
    arcs = arc_profiles(scene.joint, joint)
    pin, hole = (float((arc.weight * arc.shear).sum()) for arc in (arcs["pin"], arcs["hole"]))
    assert pin == pytest.approx(-hole, rel=0.02)


def test_a_point_below_the_corner_of_a_block_may_come_and_go(comm, tmp_path):
    """The corner moves out over a point of the lower block, and the force of this point moves it
    back."""
    boxes = {"lower": (0, 0, 2, 1), "upper": (0.3, 1, 1, 1)}
    mesh = archord.rectangles(boxes, size=0.3, comm=comm)
    problem = archord.Problem(
        mesh,
        bodies=[archord.Body(name, archord.Elastic(1000.0, 0.3)) for name in ("lower", "upper")],
        interactions=[archord.Interaction("joint", ("lower top", "upper bottom"), friction=0.3)],
        supports=[archord.Support("lower bottom"), archord.Support("guide", "upper top", "x")],
        loads=[archord.Load("press", "upper top", "y", displacement=-0.02)],
        steps=3,
    )
    run = archord.solve(problem, comm.bcast(tmp_path) / "run", comm=comm)
    assert sum(run.columns["iterations"]) < 30
    assert not any(run.columns["cutbacks"])
    comm.barrier()

"""Contact of surfaces that supports, couplings and loads act on, too: a warning, whose cure gives
the closed form."""

import pytest

from archord import (
    Body,
    Coupling,
    Elastic,
    Interaction,
    Load,
    Mesh,
    Problem,
    Support,
    System,
    boxes,
    rectangles,
    solve,
)
from archord.measures.laden_surfaces import laden_surfaces

E = 1000.0
PRESSURE = 30.0
BETWEEN = 10.0  # pressure on a surface in contact
DOWN = 0.01

MESHES = {
    "plane": lambda: rectangles({"lower": (0, 0, 1, 1), "upper": (0, 1, 1, 1)}, size=0.5),
    "space": lambda: boxes({"lower": (0, 0, 0, 1, 1, 1), "upper": (0, 1, 0, 1, 1, 1)}, size=0.5),
}
in_plane_and_space = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
PRESS = Load("press", on="upper top", pressure=PRESSURE)
SIDES = ["upper left", "upper back"]


def stated(
    mesh, *, loads, fixed=(), couplings=(), surfaces=("upper bottom", "lower top"), **contact
):
    """Two cubes without Poisson's ratio on each other; the upper one slides nowhere."""
    mesh = mesh()
    across = zip(SIDES[: mesh.dimension - 1], "xz", strict=False)
    supports = [Support("lower bottom"), *fixed]
    supports += [Support(side, fixed=[axis]) for side, axis in across]
    return Problem(
        mesh,
        bodies=[Body(name, Elastic(E, 0.0)) for name in ("lower", "upper")],
        interactions=[Interaction("contact", surfaces, **contact)],
        supports=supports,
        couplings=couplings,
        loads=loads,
        steps=1,
    )


def cured(mesh, laden, **parts):
    """The problem of these ``parts``, solved on the other side than the ``laden`` one, as the
    warning says."""
    (said,) = laden_surfaces(System(stated(mesh, **parts)))
    other = {"upper bottom": "lower top", "lower top": "upper bottom"}[laden]
    assert f"act on facets of {laden!r}, too, and 'contact' takes" in said
    assert f"give integrated = {other!r}" in said
    system = System(stated(mesh, integrated=other, **parts))
    assert not laden_surfaces(system)
    system.solve()
    return system


@pytest.mark.mpi
@in_plane_and_space
@pytest.mark.parametrize("on", ["upper", "upper bottom"])
@pytest.mark.parametrize("law", ["frictionless", "tied"])
def test_a_body_whose_motion_is_prescribed_is_a_rigid_one(mesh, on, law):
    """Its stress, which is zero, is averaged into the pressure: the force is 8.89."""
    push = Load("push", on=on, direction="y", displacement=-DOWN)
    system = cured(mesh, "upper bottom", loads=[push], law=law)
    assert system.drive_force("push") == pytest.approx(-E * DOWN)


@in_plane_and_space
@pytest.mark.parametrize("on", ["lower", "lower top"])
def test_a_held_surface_is_a_rigid_one(mesh, on):
    """The upper body sinks in, by an eighth of its own compression."""
    floor = Support("floor", on=on, fixed="xy")
    system = cured(mesh, "lower top", loads=[PRESS], fixed=[floor])
    assert system.drive_displacement("press") == pytest.approx(PRESSURE / E)


@in_plane_and_space
def test_a_surface_may_be_moved_by_a_force(mesh):
    push = Load("push", on="upper bottom", direction="y", force=-E * DOWN)
    system = cured(mesh, "upper bottom", loads=[push])
    assert system.drive_displacement("push") == pytest.approx(-DOWN)


@in_plane_and_space
def test_a_surface_may_have_a_distributing_coupling(mesh):
    point = (0.5, 1.0, 0.5)[: mesh().dimension]
    ram = Coupling("ram", facets="upper bottom", point=point, kind="distributing")
    push = Load("push", on="ram", direction="y", force=-E * DOWN)
    system = cured(mesh, "upper bottom", loads=[push], couplings=[ram])
    assert system.drive_displacement("push") == pytest.approx(-DOWN)


@pytest.mark.mpi
@in_plane_and_space
def test_a_pressure_between_bodies_lightens_the_contact(mesh):
    """The gap is as wide as that pressure over gamma: the displacement is 2.5 % too small."""
    between = Load("between", on="upper bottom", pressure=BETWEEN)
    system = cured(mesh, "upper bottom", loads=[PRESS, between])
    compressed = (PRESSURE - BETWEEN) / E + PRESSURE / E
    assert system.drive_displacement("press") == pytest.approx(compressed)


@in_plane_and_space
def test_what_acts_along_smooth_surfaces_is_no_load(mesh):
    guide = Support("guide", on="upper", fixed="x")
    assert not laden_surfaces(System(stated(mesh, loads=[PRESS], fixed=[guide])))


@pytest.mark.mpi
def test_what_acts_far_from_the_other_body_is_no_load():
    """The surfaces go on around a corner to the held and the pressed sides of their bodies."""
    tagged = MESHES["plane"]()
    sets = {
        f"{body} around": [f"{body} {side}" for side in ("bottom", "right", "top")]
        for body in ("lower", "upper")
    }
    made = Mesh(tagged, sets=sets).on(tagged.mesh.comm)
    system = System(stated(lambda: made, loads=[PRESS], surfaces=tuple(sets)))
    assert not laden_surfaces(system)


def test_where_no_side_is_left_the_sets_are_to_be_cut(tmp_path):
    between = [Load(f"on {name}", on=name, pressure=1.0) for name in ("upper bottom", "lower top")]
    run = solve(stated(MESHES["plane"], loads=[PRESS, *between]), tmp_path / "run")
    said = "'upper bottom' and 'lower top', too, and 'contact' takes"
    (warning,) = [one for one in run.warnings if said in one]
    assert warning.endswith("leave them out of one of the sets")

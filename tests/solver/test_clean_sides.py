"""Contact of surfaces that supports, couplings and loads act on, too, against closed forms."""

from dataclasses import replace

import pytest

from archord import (
    Body,
    Coupling,
    Elastic,
    InputError,
    Interaction,
    Load,
    Mesh,
    Problem,
    RigidCircle,
    Support,
    System,
    boxes,
    rectangles,
    solve,
)
from archord.solver.clean_sides import CleanSides

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


def solved(mesh, **parts):
    system = System(stated(mesh, **parts))
    system.solve()
    return system


@pytest.mark.mpi
@in_plane_and_space
@pytest.mark.parametrize("on", ["upper", "upper bottom"])
@pytest.mark.parametrize("law", ["frictionless", "tied"])
def test_a_body_whose_motion_is_prescribed_is_a_rigid_one(mesh, on, law):
    """Its stress, which is zero, was averaged into the pressure: the force was 8.89."""
    push = Load("push", on=on, direction="y", displacement=-DOWN)
    system = solved(mesh, loads=[push], law=law)
    assert system.drive_force("push") == pytest.approx(-E * DOWN)


@in_plane_and_space
@pytest.mark.parametrize("on", ["lower", "lower top"])
def test_a_held_surface_is_a_rigid_one(mesh, on):
    """The upper body sank in, by an eighth of its own compression."""
    system = solved(mesh, loads=[PRESS], fixed=[Support("floor", on=on, fixed="xy")])
    assert system.drive_displacement("press") == pytest.approx(PRESSURE / E)


@in_plane_and_space
def test_a_surface_may_be_moved_by_a_force(mesh):
    push = Load("push", on="upper bottom", direction="y", force=-E * DOWN)
    system = solved(mesh, loads=[push])
    assert system.drive_displacement("push") == pytest.approx(-DOWN)


@in_plane_and_space
def test_a_surface_may_have_a_distributing_coupling(mesh):
    point = (0.5, 1.0, 0.5)[: mesh().dimension]
    ram = Coupling("ram", facets="upper bottom", point=point, kind="distributing")
    push = Load("push", on="ram", direction="y", force=-E * DOWN)
    system = solved(mesh, loads=[push], couplings=[ram])
    assert system.drive_displacement("push") == pytest.approx(-DOWN)


@pytest.mark.mpi
@in_plane_and_space
def test_a_pressure_between_bodies_lightens_the_contact(mesh):
    """The gap was as wide as that pressure is over gamma: the displacement 2.5 % too small."""
    between = Load("between", on="upper bottom", pressure=BETWEEN)
    system = solved(mesh, loads=[PRESS, between])
    compressed = (PRESSURE - BETWEEN) / E + PRESSURE / E
    assert system.drive_displacement("press") == pytest.approx(compressed)


@in_plane_and_space
def test_what_acts_along_smooth_surfaces_changes_nothing(mesh):
    """Both sides are integrated, as they are without."""
    system = solved(mesh, loads=[PRESS], fixed=[Support("guide", on="upper", fixed="x")])
    assert len(system.contact.pairs) == 2


AROUND = ("lower around", "upper around")


def around(tagged):
    """The mesh with sets that go on around a corner to the held and the pressed sides of bodies."""
    sets = {
        f"{body} around": [f"{body} {side}" for side in ("bottom", "right", "top")]
        for body in ("lower", "upper")
    }
    return Mesh(tagged, sets=sets).on(tagged.mesh.comm)


@pytest.mark.mpi
def test_what_acts_far_from_the_other_body_changes_nothing():
    made = around(MESHES["plane"]())
    system = solved(lambda: made, loads=[PRESS], surfaces=AROUND)
    assert len(system.contact.pairs) == 2
    assert system.drive_displacement("press") == pytest.approx(2 * PRESSURE / E)


def test_what_acts_on_the_other_face_of_a_sheet_changes_nothing():
    """Though it is not farther from the other body than a facet is long."""
    sheets = {"lower": (0.0, 0.0, 1.0, 0.2), "upper": (0.0, 0.2, 1.0, 0.2)}
    made = around(rectangles(sheets, size=0.5))
    system = solved(lambda: made, loads=[PRESS], surfaces=AROUND)
    assert len(system.contact.pairs) == 2


def test_what_acts_on_the_far_side_of_a_disc_changes_nothing():
    made = around(MESHES["plane"]())
    held = Support("upper bottom")
    disc = RigidCircle((0.5, 3.0), 1.0)
    surfaces = (disc, "upper around")
    system = System(stated(lambda: made, loads=[], fixed=[held], surfaces=surfaces))
    assert len(system.contact.pairs) == 1


def test_no_side_left_is_refused(tmp_path):
    between = [Load(f"on {name}", on=name, pressure=1.0) for name in ("upper bottom", "lower top")]
    problem = stated(MESHES["plane"], loads=[PRESS, *between])
    said = "act on facets of 'upper bottom' and 'lower top', too, .* leave them out"
    with pytest.raises(InputError, match=said):
        solve(problem, tmp_path / "run")
    with pytest.raises(ValueError, match=said):
        System(problem).solve()


def test_the_other_side_is_the_cure(tmp_path):
    between = Load("between", on="lower top", pressure=1.0)
    problem = stated(MESHES["plane"], loads=[PRESS, between], integrated="lower top")
    with pytest.raises(InputError, match="give integrated = 'upper bottom'"):
        solve(problem, tmp_path / "run")


def test_a_run_with_both_sides_is_not_continued(tmp_path, monkeypatch):
    """Earlier versions integrated both: its history would have two forces of one path."""

    def push(to):
        loads = [Load("push", on="upper", direction="y", displacement=to)]
        return replace(stated(MESHES["plane"], loads=loads), steps=[1] * len(to))

    with monkeypatch.context() as earlier:
        earlier.setattr(CleanSides, "integrated", lambda self, interaction, surfaces: interaction)
        solve(push([-DOWN]), tmp_path / "run")
    with pytest.raises(InputError, match="'contact' integrated on 2 sides, which is 1"):
        solve(push([-DOWN, -2 * DOWN]), tmp_path / "run", restart=True)

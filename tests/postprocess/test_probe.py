"""Stress along edges and lines of a lug, and what is printed and drawn of a general run."""

import csv
import shutil
from dataclasses import replace

import numpy as np
import pytest

import archord
from archord.cli import run as command
from archord.postprocess.export import export_csv, export_vtk
from archord.postprocess.tables import run_text
from tests.postprocess.vtk_reader import VtkFile

# Hoop stress at the hole's edge over P/(40 - 20): at 90 degrees and the largest, of two codes, one
# of them CalculiX 2.20 (elements of order two), each refined until the digits stood.
REFERENCE = {0.1: (3.424, 3.78), 0.3: (3.072, 3.190)}
BAR_ENDS = [("left", 0.0), ("right", 10.0)]


def solved(folder, size, displacement, analysis=None, lug=None, **shape):
    """An elastic lug with a hole of radius 10, its half or whole, in as many steps as there are
    displacements."""
    lug_shape = {
        "kind": "lug",
        "radius": 9.9,
        "clearance": 0.1,
        "width": 40.0,
        "edge_distance": 20.0,
        "length": 60.0,
    }
    lug_shape |= {"element_size": size, "growth": 0.3, **shape}
    steel = {"E": 210000.0, "nu": 0.3}
    half = shape.get("half", True)
    scene = archord.ProblemScene(
        mesh={"shape": lug_shape},
        body=[{"name": "pin"} | steel, {"name": "lug"} | (lug or steel)],
        interaction=[{"name": "contact", "surfaces": ["pin", "hole"]}],
        support=[
            {"name": "axis", "on": "axis", "fixed": ["y"]},
            {"name": "clamp", "on": "clamp", "fixed": ["x", "y"]},
        ],
        load=[{"name": "pull", "on": "flat", "direction": "x", "displacement": displacement}],
        path={"steps": 1},
        analysis={"symmetry": 2 if half else 1} | (analysis or {}),
        output={"points": True},
    )
    return archord.solve(scene, folder)


@pytest.fixture(scope="module")
def lug(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("lug") / "run", 0.7, list(REFERENCE))


@pytest.mark.parametrize("step", [1, 2])
def test_hoop_stress_at_the_hole_is_that_of_other_codes(lug, step):
    """At 90 degrees within half a per cent, the largest within one, with 3 000 dofs."""
    at_right_angle, largest = REFERENCE[lug.columns["pull displacement"][step - 1]]
    hoop = lug.probe("hole", step=step)
    assert hoop.force == lug.columns["pull force"][step - 1]
    factor = hoop.over(20.0)
    assert factor.at(90) == pytest.approx(at_right_angle, rel=5e-3)
    assert factor.values[factor.largest] == pytest.approx(largest, rel=1e-2)
    assert 70 < factor.angle[factor.largest] < 85
    np.testing.assert_allclose(np.radians(hoop.angle) * 10, hoop.s, atol=1e-4)
    assert hoop.s[-1] == pytest.approx(10 * np.pi, rel=1e-6)


def test_the_shear_is_the_stress_in_axes_along_an_edge_and_to_its_left(lug):
    """On the straight clamp, which runs along y, and on the round hole."""
    stress = {name: lug.probe("clamp", f"stress_{name}").values for name in ("xx", "yy", "xy")}
    shear = lug.probe("clamp", "shear").values
    assert np.abs(shear).max() > 0
    np.testing.assert_allclose(shear, -stress["xy"], rtol=1e-12)
    hole = lug.probe("hole", "shear")
    xx, yy, xy = (lug.probe("hole", f"stress_{name}").values for name in ("xx", "yy", "xy"))
    x, y = hole.x.T / 10
    expected = (xx - yy) * x * y + xy * (y**2 - x**2)
    size = np.abs(expected).max()
    np.testing.assert_allclose(hole.values, expected, rtol=0, atol=0.02 * size)


def test_the_stress_normal_to_an_edge_is_its_traction(lug):
    """None beyond the contact and on the free end, but for the error of the recovery; the contact
    pressure within."""
    hoop, normal, pressure = (lug.probe("hole", name) for name in ("hoop", "normal", "pressure"))
    free = (normal.angle > 110) & (normal.angle < 170)
    assert np.abs(normal.values[free]).max() < 0.01 * hoop.values.max()
    for angle in (10, 40):
        assert -normal.at(angle) == pytest.approx(pressure.at(angle), rel=0.03)
    assert np.abs(lug.probe("end", "normal").values).max() < 0.03 * hoop.values.max()
    means = lug.probe("hole", "facet_pressure")
    assert 4 * len(means.s) <= len(pressure.s)
    assert means.at(40) == pytest.approx(pressure.at(40), rel=0.02)
    tensor = lug.fields().nodal_fields()
    assert lug.probe("hole", "stress_xx").at(90) == pytest.approx(hoop.at(90), rel=1e-3)
    assert set(lug.points()) == {"coordinates", "stress"}
    assert "peeq" not in tensor


def test_arc_length_on_a_circle_is_the_radius_times_the_angle(lug, runs):
    """Counterclockwise, of stresses and of the contact, of a lug and of a joint, from the body's
    free end."""
    for quantity in ("hoop", "pressure", "facet_pressure", "gap"):
        for edge, radius in (("hole", 10.0), ("pin", 9.9)):
            probe = lug.probe(edge, quantity)
            np.testing.assert_allclose(probe.s, radius * np.radians(probe.angle), rtol=1e-4)
            assert (np.diff(probe.s) > -1e-12).all()
            x = probe.x - [0.1 * (edge == "pin"), 0.0]
            np.testing.assert_allclose(np.degrees(np.arctan2(*x.T[::-1])), probe.angle, atol=1e-6)
    angle = archord.load(runs["coarse"]).probe("hole", "pressure").angle
    assert 270 < angle[0] < angle[-1] < 360


def test_before_the_first_touch_there_is_nothing_to_see_and_nothing_breaks(
    tmp_path, capsys, refused
):
    """No pressure, no stress, and no factor over a force that is round-off; afterwards all of
    it."""
    run = solved(tmp_path / "run", 2.0, [-0.02, 0.1])
    for quantity in ("hoop", "pressure", "facet_pressure"):
        asked = ["probe", str(run.folder), "--edge", "hole", "--quantity", quantity, "--step", "1"]
        assert command([*asked, "-o", str(tmp_path / f"{quantity}.png")]) == 0
        assert not run.probe("hole", quantity, step=1).values.any()
    assert "pull = 0 per unit thickness" in capsys.readouterr().out
    assert "has no factor over a section of 20 under a force of 0" in refused(
        [*asked, "--over", "20"]
    )
    with pytest.raises(archord.InputError, match="no factor over a section of inf under"):
        run.probe("hole").over(np.inf)
    assert command(["compare", *2 * [str(run.folder)], "-o", str(tmp_path / "compare.png")]) == 0
    assert command(["show", str(run.folder), "-o", str(tmp_path / "show.png")]) == 0


def test_a_line_crosses_bodies_and_leaves_gaps_out(lug):
    """From the hole's edge to the side of the lug, where it meets what the edges have; the void is
    not counted."""
    line = lug.probe(line=(-20.0, 0.0, 20.0, 0.0), quantity="stress_yy")
    np.testing.assert_allclose(line.s, line.x[:, 0] + 20)
    assert line.x[np.argmax(np.diff(line.x[:, 0])), 0] == pytest.approx(-10.0, abs=0.2)
    up = lug.probe(line=(0.0, 10.001, 0.0, 19.999), quantity="stress_xx")
    assert up.values[0] == pytest.approx(lug.probe("hole").at(90), rel=1e-2)
    assert np.trapezoid(up.values, up.s) < lug.columns["pull force"][-1]


def test_a_line_has_its_points_on_the_edges_of_bodies(lug):
    """A line that begins at the edge of the hole has the peak of the stress there; one along the
    straight axis of symmetry, whose nodes are off it by round-off, has all its points."""
    hoop = lug.probe("hole", "stress_xx")
    peak = hoop.at(90)
    up = lug.probe(line=(0.0, 10.0, 0.0, 20.0), quantity="stress_xx")
    assert (up.s[0], up.s[-1]) == (0.0, 10.0)
    assert up.values[0] == up.values.max() == pytest.approx(peak, rel=1e-2)
    along = lug.probe(line=(-10.0, 0.0, -60.0, 0.0), quantity="von_mises")
    assert len(along.s) == len(up.s) == 201
    assert len(lug.probe(line=(0.0, 10.0, 0.0, 20.0), quantity="mean_stress").s) == 201


def test_a_whole_hole_runs_round_once(tmp_path):
    """From 0 to 360 degrees, symmetric about the axis of the load. Of several arcs on it stresses
    and pressures begin at the same one, behind the largest gap, wherever the x axis is."""
    run = solved(tmp_path / "run", 2.0, 0.1, half=False)
    hoop = run.probe("hole")
    assert hoop.angle[[0, -1]] == pytest.approx([0, 360], abs=1e-3)
    assert hoop.s[-1] == pytest.approx(20 * np.pi, rel=1e-3)
    assert hoop.at(90) == pytest.approx(hoop.at(270), rel=0.05)
    fields = run.fields()
    arc = run.arc(side="hole")

    def kept(x):
        angle = np.degrees(np.arctan2(*x.T[::-1]))
        return (abs(angle) < 30) | ((angle > 50) & (angle < 100))

    edge = fields.edges["hole"]
    facets = kept(arc.X.mean(axis=1))
    edges = {"hole": edge[kept(fields.coordinates[edge[:, 1]])]}
    run.fields = lambda step: replace(fields, edges=edges)
    run.arc = lambda step, side: replace(
        arc, **{name: values[facets] for name, values in vars(arc).items() if values is not None}
    )
    for quantity in ("ux", "pressure", "facet_pressure"):
        probe = run.probe("hole", quantity)
        assert probe.angle[[0, -1]] == pytest.approx([330, 460], abs=15)
        np.testing.assert_allclose(probe.s, 10 * np.radians(probe.angle), rtol=1e-4)


def test_the_arc_of_a_ball_is_a_quarter_of_a_circle(tmp_path):
    """Of a body of revolution the weights of contact points are areas, and angles count along the
    arc: from the axis, at 270 degrees, outward."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize()
    try:
        draw = gmsh.model.geo
        places = [(0, 0, 0.2), (4, 4, 1), (0, 4, 1), (0, 0, 0.2), (4, 0, 1), (4, -4, 1), (0, -4, 1)]
        low, side, middle, *corners = [draw.addPoint(x, y, 0, size) for x, y, size in places]
        edge = draw.addCircleArc(low, middle, side)
        rest = [draw.addLine(side, middle), draw.addLine(middle, low)]
        lines = [draw.addLine(corners[k - 1], corners[k]) for k in range(4)]
        ball = draw.addPlaneSurface([draw.addCurveLoop([edge, *rest])])
        plate = draw.addPlaneSurface([draw.addCurveLoop(lines)])
        draw.synchronize()
        sets = {"edge": edge, "middle": rest[0], "top": lines[1], "bottom": lines[3]}
        for name, line in sets.items():
            gmsh.model.addPhysicalGroup(1, [line], name=name)
        gmsh.model.addPhysicalGroup(2, [ball], name="ball")
        gmsh.model.addPhysicalGroup(2, [plate], name="plate")
        steel = archord.Elastic(210e3, 0.3)
        problem = archord.Problem(
            gmsh,
            bodies=[archord.Body("ball", steel), archord.Body("plate", steel)],
            interactions=[archord.Interaction("contact", ("edge", "top"))],
            supports=[archord.Support("bottom")],
            loads=[archord.Load("press", on="middle", direction="y", force=-200.0)],
            kinematics="axisymmetric",
            steps=1,
        )
        run = archord.solve(problem, tmp_path / "run")
    finally:
        gmsh.finalize()
    for quantity in ("pressure", "facet_pressure"):
        probe = run.probe("edge", quantity)
        assert probe.angle[[0, -1]] == pytest.approx([270, 360], abs=8)
        assert (np.diff(probe.angle) > 0).all()
        assert probe.values.argmax() < len(probe.values) / 3
    with pytest.raises(archord.InputError, match="no factor over a length"):
        probe.over(4.0)
    angle = run.probe(line=(1.0, -1.0, 2.0, -1.0), quantity="principal_angle").values
    stress = {
        name: run.probe(line=(1.0, -1.0, 2.0, -1.0), quantity=f"stress_{name}").values
        for name in ("rr", "zz", "rz")
    }
    twice = np.arctan2(2 * stress["rz"], stress["rr"] - stress["zz"])
    assert angle == pytest.approx(twice / 2, rel=1e-12)
    points = run.pressure()
    assert points.attrs["units"]["weight"] == run.units["contact contact area"] == "mm2"
    touching = points[points["raw_pressure"] > 0]
    area = touching.groupby("side")["weight"].sum().mean()
    assert area == pytest.approx(run.columns["contact contact area"][0], rel=1e-9)


def test_a_force_in_space_makes_no_stress_over_a_length(tmp_path):
    """It is of the whole body: over a length it is no stress."""
    bar = archord.Problem(
        archord.boxes({"bar": (0.0, 0.0, 0.0, 4.0, 1.0, 2.0)}, size=1.0),
        bodies=[archord.Body("bar", archord.Elastic(1e3, 0.3))],
        supports=[archord.Support("bar left")],
        loads=[archord.Load("pull", on="bar right", direction="x", force=8.0)],
        steps=1,
    )
    run = archord.solve(bar, tmp_path / "run")
    probe = run.probe(line=(0.5, 0.5, 1.0, 3.5, 0.5, 1.0), quantity="stress_xx")
    assert probe.force == 8.0
    with pytest.raises(archord.InputError, match="in space is not per unit thickness"):
        probe.over(2.0)


def test_a_factor_is_of_the_force_of_one_load(tmp_path, capsys):
    """Of two bars under two forces the larger one was taken for both: of the other bar the factor
    was a fifth too small."""
    bars = {"thin": (0, 0, 4, 1), "thick": (0, 2, 4, 1)}
    problem = archord.Problem(
        archord.rectangles(bars, size=1.0),
        bodies=[archord.Body(name, archord.Elastic(1e3, 0.0)) for name in bars],
        supports=[archord.Support(f"{name} left") for name in bars],
        loads=[
            archord.Load(f"pull {name}", on=f"{name} right", direction="x", force=force)
            for name, force in (("thin", 8.0), ("thick", 10.0))
        ],
        steps=1,
    )
    run = archord.solve(problem, tmp_path / "run")
    probe = run.probe(line=(1.0, 0.5, 3.0, 0.5), quantity="stress_xx")
    assert (probe.force, probe.by) == pytest.approx((10.0, "pull thick"))
    with pytest.raises(archord.InputError, match="pull thin 8, pull thick 10; name one by --of"):
        probe.over(1.0)
    factor = probe.over(1.0, of="pull thin")
    np.testing.assert_allclose(factor.values, 1.0, rtol=1e-9)
    assert (factor.force, factor.by) == pytest.approx((8.0, "pull thin"))
    with pytest.raises(archord.InputError, match="--of push: must be a load with a force"):
        probe.over(1.0, of="push")
    asked = ["probe", str(run.folder), "--edge", "thin top", "--of", "pull thin"]
    assert command(asked) == 2
    assert "is the load of --over" in capsys.readouterr().err
    assert command([*asked, "--over", "1"]) == 0


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"edge": "bore"}, "has no edge 'bore'; its edges are"),
        ({"edge": "hole", "quantity": "temperature"}, "has no 'temperature' there, but stress_xx"),
        ({"line": (100.0, 0.0, 101.0, 0.0)}, "no body lies on the line"),
        ({"edge": "end", "quantity": "pressure"}, "has no side 'end'; its sides are"),
        ({"edge": "hole", "quantity": "contact_shear"}, "its contacts have no friction"),
        ({}, "give an edge or a line"),
        ({"edge": "hole", "step": 1.5}, "has no step 1.5; its accepted steps are"),
        ({"edge": "hole", "step": "1"}, "has no step '1'; its accepted steps are"),
        ({"line": np.array([100.0, 0.0, 101.0, 0.0])}, "no body lies on the line"),
    ],
)
def test_what_cannot_be_probed_is_said(lug, asked, said):
    with pytest.raises(archord.InputError, match=said):
        lug.probe(**asked)
    with pytest.raises(archord.InputError, match="has no point at 300 degrees"):
        lug.probe("hole").at(300)


def test_the_command_prints_and_draws(lug, tmp_path, capsys):
    """The table, the largest value and where, the factor at an angle; a CSV file or a picture."""
    asked = [
        "probe",
        str(lug.folder),
        "--edge",
        "hole",
        "--step",
        "2",
        "--over",
        "20",
        "--angle",
        "90",
        "-o",
    ]
    for name in ("probe.csv", "probe.png"):
        assert command([*asked, str(tmp_path / name)]) == 0
    out = capsys.readouterr().out
    factor = lug.probe("hole", step=2).over(20)
    assert f"at 90°: {factor.at(90):.6g}" in out
    assert f"largest: {factor.values[factor.largest]:.6g} at" in out
    with (tmp_path / "probe.csv").open(newline="") as file:
        heading, *rows = csv.reader(file)
    assert heading == ["s", "angle [°]", "x", "y", "hoop/(P/L)"]
    assert len(rows) == len(factor.s)
    assert (tmp_path / "probe.png").stat().st_size > 10_000


def test_residual_stress_is_told_where_it_is_compressive(tmp_path, capsys):
    """A hole that yielded in tension is pressed together when unloaded: the smallest value says
    so."""
    plastic = {"E": 210000.0, "nu": 0.3, "yield_stress": 355.0, "hardening": 1000.0}
    run = solved(tmp_path / "run", 2.0, [0.35, 0.0], lug=plastic)
    assert command(["probe", str(run.folder), "--edge", "hole"]) == 0
    printed = capsys.readouterr().out
    hoop = run.probe("hole")
    k = hoop.smallest
    assert hoop.values[k] == hoop.values.min() < -100 < hoop.values[hoop.largest]
    assert 60 < hoop.angle[k] < 95  # where the largest stress of the loaded hole was
    assert (
        f"smallest: {hoop.values[k]:.6g} MPa at {hoop.angle[k]:.4g}°, x = {hoop.x[k, 0]:.6g}, y = "
        in printed
    )
    line = run.probe(line=[0.0, 10.0, 0.0, 20.0], quantity="stress_xx")
    assert line.where(line.smallest).startswith(f"at s = {line.s[line.smallest]:.6g}, x = 0, y = 1")


def test_general_runs_are_shown_compared_and_exported(lug, tmp_path, capsys):
    """Every command that reads a run reads this one."""
    shutil.copytree(lug.folder, tmp_path / "other")
    for arguments in (
        ["show", str(lug.folder), "-o", str(tmp_path / "show.png")],
        ["picture", str(lug.folder), "-o", str(tmp_path / "picture.png")],
        ["compare", str(lug.folder), str(tmp_path / "other"), "-o", str(tmp_path / "compare.png")],
    ):
        assert command(arguments) == 0
        assert (tmp_path / f"{arguments[0]}.png").stat().st_size > 10_000
    out = capsys.readouterr().out
    assert "pull force [N/mm]" in out
    assert "largest difference" in out
    assert "compared step by step: all runs went through the same loads." in out
    assert " curved triangles of degree 2, " in out
    assert "plastic strain first" not in out
    assert len(export_csv(lug, tmp_path / "csv")) == 2
    files = export_vtk(lug, tmp_path / "vtk")
    bodies = VtkFile(tmp_path / "vtk" / "bodies.vtkhdf").at(2)
    assert {"stress_xx", "p1", "von_mises", "displacement"} <= set(bodies.point_data)
    assert set(np.unique(bodies.cell_data["body"])) == set(lug.bodies.values())
    assert [file.stem for file in files] == ["bodies", "contact", "points"]


def test_a_joint_is_probed_too_but_for_what_it_did_not_write(runs):
    """Pressure and displacement of a run without stress, which a sentence says."""
    joint = archord.load(runs["coarse"])
    pressure = joint.probe("hole", "pressure")
    assert pressure.force == joint.columns["P"][-1]
    assert pressure.at(-90) == pytest.approx(joint.columns["p0"][-1], rel=0.02)
    assert np.abs(joint.probe("hole", "ux").values).max() > 0
    with pytest.raises(
        archord.InputError, match=r"has no 'hoop' there, but ux, uy .*output.fields = \"cells\""
    ):
        joint.probe("hole")


def test_a_plate_without_contact_is_shown_and_exported_too(tmp_path, capsys):
    """Pulled by a uniform strain in plane stress: one stress everywhere, drawn magnified."""
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addRectangle(0, 0, 0, 20, 10)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [1], name="plate")
        for tag, name in enumerate(("bottom", "right", "top", "left"), 1):
            gmsh.model.addPhysicalGroup(1, [tag], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 4)
        problem = archord.Problem(
            gmsh,
            bodies=[archord.Body("plate", archord.Elastic(1000.0, 0.3))],
            supports=[archord.Support("left", fixed="x"), archord.Support("bottom", fixed="y")],
            loads=[archord.Load("pull", on="right", direction="x", displacement=0.02)],
            steps=1,
            kinematics="plane stress",
        )
        run = archord.solve(problem, tmp_path / "run")
    finally:
        gmsh.finalize()
    assert run.columns["pull force"] == pytest.approx([10.0], rel=1e-9)
    np.testing.assert_allclose(run.probe("top").over(10.0).values, 1.0, rtol=1e-9)
    np.testing.assert_allclose(
        run.fields().stress, np.outer(np.ones(len(run.fields().stress)), [1, 0, 0, 0]), atol=1e-9
    )
    for name in ("show", "picture"):
        assert command([name, str(run.folder), "-o", str(tmp_path / f"{name}.png")]) == 0
    assert (
        command(
            ["export", str(run.folder), "--csv", str(tmp_path / "c"), "--vtk", str(tmp_path / "v")]
        )
        == 0
    )
    assert [file.name for file in (tmp_path / "c").iterdir()] == ["history.csv"]
    with pytest.raises(archord.InputError, match="has no contact"):
        run.pressure()
    assert "pull force [N/mm]" in capsys.readouterr().out


def test_the_largest_force_is_that_of_the_largest_size(tmp_path):
    """Of a load in a negative direction, too."""
    run = solved(tmp_path / "run", 2.0, [0.02, 0.1])
    run.columns["pull force"] = [-force for force in run.columns["pull force"]]
    text = run_text(run)
    assert f"pull force = {run.columns['pull force'][1]:.6g} N/mm at step 2" in text


def test_the_angle_of_a_stress_does_not_swing_between_nodes(tmp_path):
    """A plate that is pulled along y between clamps: the angle is near 90 or -90 degrees,
    whichever way the shear is, and not between them where it jumps."""
    mesh = archord.rectangles({"plate": (-1, 0, 2, 2)}, size=0.5)
    plate = archord.Problem(
        mesh,
        bodies=[archord.Body("plate", archord.Elastic(1000.0, 0.3))],
        supports=[archord.Support("plate bottom"), archord.Support("plate top", fixed="x")],
        loads=[archord.Load("pull", on="plate top", direction="y", displacement=0.01)],
        steps=1,
    )
    run = archord.solve(plate, tmp_path / "run")
    angle = run.probe(line=(-0.9, 0.4, 0.9, 0.4), quantity="principal_angle").values
    assert angle.min() < -1.2
    assert angle.max() > 1.2
    assert np.abs(angle).min() > 1.2


def test_no_plastic_strain_below_none_between_nodes_in_space(tmp_path):
    """Parabolas between nodes of which one has yielded swing below 0."""
    mesh = archord.boxes({"bar": (0, 0, 0, 4, 1, 1)}, size=0.7)
    steel = archord.J2Material(1000.0, 0.3, hardening=archord.LinearHardening(2.0, 10.0))
    bar = archord.Problem(
        mesh,
        bodies=[archord.Body("bar", steel)],
        supports=[archord.Support("bar left")],
        loads=[archord.Load("bend", on="bar right", direction="y", displacement=0.05)],
        steps=1,
    )
    run = archord.solve(bar, tmp_path / "run")
    line = (0.0, 0.95, 0.5, 4.0, 0.95, 0.5)
    for quantity in ("peeq", "von_mises"):
        assert run.probe(line=line, quantity=quantity).values.min() >= 0


def test_a_closed_edge_in_space_runs_round_once(tmp_path):
    """Around the top of a box, wherever its nodes are in the mesh."""
    mesh = archord.boxes({"block": (0, 0, 0, 2, 1, 1)}, size=0.5)
    walls = [mesh.facet_sets[f"block {side}"] for side in ("left", "right", "back", "front")]
    around = {"around": tuple(tag for tags in walls for tag in tags)}
    block = archord.Problem(
        replace(mesh, facet_sets={**mesh.facet_sets, **around}),
        bodies=[archord.Body("block", archord.Elastic(1000.0, 0.0))],
        supports=[archord.Support("block bottom")],
        loads=[archord.Load("press", on="block top", direction="y", displacement=-0.01)],
        steps=1,
    )
    run = archord.solve(block, tmp_path / "run")
    edge = run.probe("around & block top", "uy")
    np.testing.assert_allclose(edge.x[:, 1], 1.0)
    np.testing.assert_allclose(edge.values, -0.01)
    assert edge.s[-1] == pytest.approx(6.0, rel=1e-9)
    assert len(np.unique(edge.x.round(6), axis=0)) == 24  # of 12 facets


def test_stress_along_an_edge_that_has_turned_is_along_it(tmp_path):
    """At large strain, of a bar that is stretched and turned by half a radian: the free sides carry
    no traction, and the stress along them is the principal one. By the undeformed tangent it was
    a quarter less."""
    angle = 0.5
    x, y = 10.5 * np.array([np.cos(angle), np.sin(angle)]) - [10.0, 0.0]
    ends = [archord.Coupling(end, f"bar {end}", (at, 0.5)) for end, at in BAR_ENDS]
    moved = {"left x": 0.0, "left y": 0.0, "right x": x, "right y": y}
    moved |= {"left rotation": angle, "right rotation": angle}
    loads = [archord.Load(name, *name.split(), displacement=value) for name, value in moved.items()]
    problem = archord.Problem(
        archord.rectangles({"bar": (0, 0, 10, 1)}, size=1.0),
        [archord.Body("bar", archord.Elastic(1000.0, 0.3))],
        loads=loads,
        couplings=ends,
        strain="large",
        steps=4,
    )
    run = archord.solve(problem, tmp_path / "run")
    along, normal, largest = (run.probe("bar top", name) for name in ("hoop", "normal", "p1"))
    middle = np.abs(along.x[:, 0] - 5) < 1
    assert along.values[middle] == pytest.approx(largest.values[middle], rel=1e-4)
    assert np.abs(normal.values[middle]).max() < 1e-3 * along.values[middle].max()

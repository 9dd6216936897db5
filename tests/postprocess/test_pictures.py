"""Pictures of chosen steps, fields and edges; reports; and what is drawn where there is nothing to
colour."""

import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import matplotlib.image
import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.cli import run as command
from archord.postprocess.pictures import solids
from archord.postprocess.pictures.abscissa import abscissa
from archord.postprocess.pictures.problems import contact_panel, draw_field, shown_step
from archord.postprocess.probes.probe import Probe
from archord.postprocess.run import Run
from archord.postprocess.tables import run_text
from archord.report.figure import new_figure
from tests.output.run_files import rewrite_report
from tests.output.test_user_file import full_disk
from tests.postprocess.test_probe import solved
from tests.solver.contact.blocks_in_space import bodies, tagged


@pytest.fixture(scope="module")
def unloaded(tmp_path_factory):
    """A lug that is pulled and let go again: no force at the last step."""
    return solved(tmp_path_factory.mktemp("unloaded") / "run", 2.5, [0.1, 0.2, 0.0])


def _drawn(run, fields=None, **asked):
    """The axes of a field and of its scale of colours."""
    figure = new_figure(5.0, 4.0)
    axes = figure.subplots()
    fields = fields or run.fields(shown_step(run))
    everywhere = np.ones(len(fields.cells), dtype=bool)
    draw_field(axes, run, fields, fields.deformed, everywhere, everywhere, **asked)
    figure.canvas.draw()
    return figure.axes


def test_the_largest_load_is_drawn_where_the_last_step_has_none(unloaded, runs):
    assert unloaded.columns["pull force"][-1] < 1e-6 * unloaded.columns["pull force"][1]
    assert shown_step(unloaded) == 2
    assert shown_step(Run(runs["plastic"])) == 8


@pytest.mark.parametrize(
    ("field", "label"),
    [
        ("", "von Mises stress [MPa]"),
        ("stress", "von Mises stress [MPa]"),
        ("displacement", "displacement [mm]"),
        ("pressure", "contact pressure [MPa]"),
        ("stress_xx", "stress xx [MPa]"),
        ("p1", "p1 [MPa]"),
    ],
)
def test_the_scale_of_colours_has_the_fields_name_unit_and_range(unloaded, field, label):
    """A field of both signs has 0 in its middle. It ends at the largest value of a node where nodes
    have the values, and not at the largest mean of a cell."""
    axes, bar = _drawn(unloaded, field=field)
    assert bar.get_ylabel() == label
    low, high = axes.collections[0].get_clim()
    assert low == pytest.approx(-high) if field in ("stress_xx", "p1") else low == 0
    fields = unloaded.fields(2)
    if field == "displacement":
        assert high == pytest.approx(np.hypot(*fields.displacement.T).max())
    if field in ("stress_xx", "p1"):
        assert high == pytest.approx(np.abs(fields.nodal_fields()[field]).max())


@pytest.mark.parametrize(
    ("stress", "said"),
    [(0.0, "0 everywhere"), (3.5, "3.5 everywhere"), (np.nan, "no finite number")],
)
def test_a_field_without_a_range_is_told_and_not_coloured(unloaded, stress, said):
    """A body that is held all over has no stress: no scale that would end at nothing."""
    fields = unloaded.fields(2)
    cell = {"von_mises": np.full(len(fields.cells), stress)}
    axes = _drawn(unloaded, replace(fields, cell=cell, nodal={}))
    assert len(axes) == 1
    assert axes[0].texts[0].get_text() == f"von Mises stress [MPa]: {said}"


def test_numbers_that_are_none_do_not_spoil_the_others(unloaded):
    """The scale ends at the largest finite one."""
    fields = unloaded.fields(2)
    values = fields.von_mises.copy()
    values[:3] = np.nan
    axes, _ = _drawn(unloaded, replace(fields, cell={"von_mises": values}, nodal={}))
    assert axes.collections[0].get_clim() == (0, pytest.approx(np.nanmax(values)))


def _probe(place, x, s, angle=None):
    values = np.zeros(len(s))
    x = np.array(x, float)
    return Probe(place, "pressure", "MPa", 1, 1.0, "pull", x, np.array(s), values, "mm", angle)


def test_surfaces_that_touch_are_drawn_over_one_scale():
    """Two that run against each other over their coordinate; a whole hole beside half a pin that
    presses it at 0 degrees from -180 to 180. One edge alone has its arc length."""
    low = _probe("low", [(4, 2), (2, 2), (0, 2)], [0.0, 2.0, 4.0])
    high = _probe("high", [(1, 2), (3, 2)], [0.0, 2.0])
    places, label = abscissa([low, high])
    assert label == "x [mm]"
    assert [place.tolist() for place in places] == [[4, 2, 0], [1, 3]]
    (place,), label = abscissa([low])
    assert label == "arc length [mm]"
    assert place.tolist() == low.s.tolist()

    half = np.arange(275.0, 450.0, 10.0)
    whole = np.arange(5.0, 360.0, 10.0)
    pin, hole = (
        _probe(name, np.zeros((len(angle), 2)), angle, angle)
        for name, angle in (("pin", half), ("hole", whole))
    )
    (of_pin, of_hole), label = abscissa([pin, hole])
    assert label == "angle [°]"
    assert of_pin.tolist() == (half - 360).tolist()
    np.testing.assert_allclose(np.sort(of_hole), np.arange(-175.0, 180.0, 10.0), atol=1e-12)
    np.testing.assert_allclose((of_hole - whole) % 360, 0, atol=1e-12)


def test_a_tie_in_tension_is_drawn(tmp_path):
    """Below zero, and not an empty panel."""
    problem = archord.Problem(
        archord.rectangles({"low": (0, 0, 1, 1), "high": (0, 1, 1, 1)}, size=0.5),
        [archord.Body(name, archord.Elastic(1e3, 0.3)) for name in ("low", "high")],
        [archord.Interaction("tie", ("high bottom", "low top"), law="tied")],
        supports=[archord.Support("low bottom")],
        loads=[archord.Load("pull", on="high top", direction="y", displacement=0.01)],
        steps=1,
    )
    axes = new_figure(5.0, 4.0).subplots()
    contact_panel(axes, archord.solve(problem, tmp_path / "run"))
    drawn = np.concatenate([line.get_ydata() for line in axes.lines])
    assert drawn.max() < 0
    assert axes.get_ylim()[0] < drawn.min()


def test_a_tie_in_tension_and_the_near_faces_are_drawn_in_space(tmp_path):
    """A column of uniform stress: its tie is in tension; faces that look away are hidden, and
    are not drawn over those before them."""
    E = 1e3
    mesh = tagged(bodies(MPI.COMM_SELF))
    problem = archord.Problem(
        mesh,
        [archord.Body(name, archord.Elastic(E, 0.0)) for name in ("lower", "upper")],
        [archord.Interaction("tie", ("upper", "lower"), law="tied")],
        supports=[archord.Support("base")],
        loads=[archord.Load("pull", on="lid", direction="z", displacement=0.02)],
        steps=1,
    )
    run = archord.solve(problem, tmp_path / "run")
    axes = new_figure(5.0, 4.0).subplots()
    solids.contact_panel(axes, run)
    (drawn,) = axes.collections
    np.testing.assert_allclose(drawn.get_array(), -0.02 / 2 * E, rtol=1e-6)
    assert drawn.get_clim() == pytest.approx((-0.02 / 2 * E, 0.0))

    axes = new_figure(5.0, 4.0).subplots()
    solids.field_panel(axes, run)
    (drawn,) = axes.collections
    x, y = np.moveaxis(np.array([path.vertices[:3] for path in drawn.get_paths()]), -1, 0)
    twice = (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0])
    assert twice.min() > 0


def test_the_shorter_cylinder_of_a_pair_is_unrolled():
    """A hole, whose facets end where contact ends, and not the longer pin; the other way round; the
    first of two that are alike but for round-off; and one that is pressed before one that is
    not."""

    def profile(length, pressure=1.0):
        angle = np.linspace(0, np.pi, 25)
        ends = np.array([[[np.cos(a), np.sin(a), z] for a in angle] for z in (0.0, length)])
        corners = np.stack([ends[0, :-1], ends[0, 1:], ends[1, 1:], ends[1, :-1]], axis=1)
        return SimpleNamespace(corners=corners, facet_pressure=np.full(len(corners), pressure))

    def drawn(**surfaces):
        name, places, words = solids._unrolled(surfaces, [["pin", "hole"]])
        assert np.ptp(places[..., 0]) == pytest.approx(180)
        assert words == ("angle [°]", "z [{length}]")
        return name

    assert drawn(hole=profile(2.0), pin=profile(3.0)) == "hole"
    assert drawn(hole=profile(3.0), pin=profile(2.0)) == "pin"
    assert drawn(hole=profile(3.0 - 1e-12), pin=profile(3.0)) == "pin"
    assert drawn(hole=profile(2.0, 0.0), pin=profile(3.0)) == "pin"
    assert drawn(hole=profile(2.0, 0.0), pin=profile(3.0, 0.0)) == "hole"


def test_picture_takes_steps_field_and_edges(unloaded, tmp_path, refused, runs, capsys):
    """Of a general run and of a joint; what is not there is a sentence."""
    asked = [
        ["--step", "1", "--field", "displacement"],
        ["--edge", "hole", "--edge", "pin"],
        ["--field", "hoop", "--edge", "hole"],
    ]
    for folder in (str(unloaded.folder), str(runs["plastic"])):
        for k, options in enumerate(asked[: 3 if folder == str(unloaded.folder) else 1]):
            target = tmp_path / f"{k}.png"
            assert command(["picture", folder, *options, "-o", str(target)]) == 0
            assert matplotlib.image.imread(target).std() > 0.05
    capsys.readouterr()
    target = ["-o", str(tmp_path / "no.png")]
    assert "has no field 'strain'; its fields are stress, " in refused(
        ["picture", str(unloaded.folder), "--field", "strain", *target]
    )
    assert "has no edge 'rim'" in refused(
        ["picture", str(unloaded.folder), "--edge", "rim", *target]
    )
    assert "has no step 9" in refused(["picture", str(unloaded.folder), "--step", "9", *target])
    assert not (tmp_path / "no.png").exists()


def test_show_cuts_no_word(unloaded):
    """In a terminal of 80 characters every line fits, and what is said is what is said without
    one."""
    wide = run_text(unloaded)
    narrow = run_text(unloaded, 80)
    assert " ... " not in wide
    assert max(map(len, narrow.splitlines())) <= 80
    assert set(wide.split()) <= set(narrow.split())


def test_a_report_is_a_pdf_of_two_or_three_pages(runs, tmp_path, refused, capsys):
    """With and without fields or warnings; one that is there is kept without --force."""
    bare = shutil.copytree(runs["coarse"], tmp_path / "bare")
    text = (bare / "scene.toml").read_text()
    (bare / "scene.toml").write_text(re.sub(r"fields = .*", "fields = false", text))
    rewrite_report(bare, files={}, warnings=[f"step 1: {'very ' * k}strange" for k in range(60)])
    target = tmp_path / "report.pdf"
    before = b""
    for folder, force in ((runs["plastic"], []), (bare, ["--force"])):
        assert command(["report", str(folder), "-o", str(target), *force]) == 0
        content = target.read_bytes()
        assert content.startswith(b"%PDF")
        assert content.rstrip().endswith(b"%%EOF")
        assert len(re.findall(rb"/Type /Page\b", content)) in (2, 3)
        assert content != before
        before = content
        capsys.readouterr()
        assert "is there already" in refused(["report", str(folder), "-o", str(target)])
        assert target.read_bytes() == before
    assert not list(tmp_path.glob("*.new"))
    capsys.readouterr()
    assert "cannot be written" in refused(
        ["report", str(bare), "-o", str(tmp_path / "no" / "x.pdf")]
    )


def test_a_report_that_fails_keeps_the_old_one(unloaded, tmp_path, refused):
    """On a full disk, wherever in the file that is."""
    target = tmp_path / "x.pdf"
    target.write_text("old")
    for room in (0, 20_000):
        with full_disk(room):
            said = refused(["report", str(unloaded.folder), "-o", str(target), "--force"])
        assert f"{target}: cannot be written: File too large." in said
        assert target.read_text() == "old"
        assert [path.name for path in tmp_path.iterdir()] == ["x.pdf"]


def test_the_command_is_a_public_function(unloaded, tmp_path):
    assert archord.draw_run(
        unloaded, tmp_path / "a.png", steps=[1, 2], field="stress", edges=["hole"]
    ).is_file()

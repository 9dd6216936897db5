"""Materials and contact laws of own classes: their runs have all that a scene's run has, and go on
with the objects alone."""

import re
import shutil
import signal
from dataclasses import dataclass, make_dataclass

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord import cli
from archord.commands.progress import Progress
from archord.materials.kinematics import Kinematics
from archord.materials.material import Points
from archord.output import run as run_module
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.run_steps import read_steps
from archord.presets.words import words_of
from archord.solver.conditions import DeadLoad, Drive, Mean, Turn
from archord.solver.contact.interaction import Rigid

Worn = make_dataclass("Worn", ["depth"])


class Soft(archord.Material):
    """Hooke's law, without a representation of its own."""

    hooke = archord.Elastic(1000.0, 0.3)
    elastic_tangent = hooke.elastic_tangent

    def update(self, strain, state):
        return self.hooke.update(strain, state)

    def energy(self, stress):
        return self.hooke.energy(stress)


@dataclass(frozen=True)
class Wear(archord.ContactLaw):
    """Archard's wear of what slides."""

    k: float
    counts_slip = True

    def state(self, n):
        return Worn(np.zeros(n))

    def respond(self, opening, trial, gamma, state, dt):
        pressure = np.maximum(trial[:, 0] - gamma[:, 0] * state.depth, 0.0)
        touches = (pressure > 0).astype(int)
        by_trial = touches[:, None, None] * np.diag([1.0, 0.0])
        worn = Worn(state.depth + self.k * pressure * np.abs(opening[:, 1]))
        return archord.Response(pressure[:, None] * [1, 0], by_trial, None, touches, worn)

    def quantities(self, state):
        return {"worn volume": archord.Quantity(state.depth, "mm2")}


class Untold(Wear):
    """The same, of whose parameters the representation tells nothing."""

    __repr__ = object.__repr__


class WrittenInPlace(Wear):
    """The same, whose history is written into what it gets."""

    def respond(self, opening, trial, gamma, state, dt):
        answer = super().respond(opening, trial, gamma, state, dt)
        state.depth[:] = answer.state.depth
        return answer._replace(state=state)


class Worsening(Soft):
    """A material whose history is exchanged in what it gets."""

    yields = True

    def state(self, n):
        return Worn(np.zeros(n))

    def update(self, strain, state):
        state.depth = state.depth + np.abs(strain).max(axis=1)
        stress, tangent, _ = self.hooke.update(strain, None)
        return stress, tangent, state


def sliding(comm, k=1e-3, law=Wear, **changes):
    """A block of `Soft` that is pressed on another one and slides on it."""
    mesh = archord.rectangles({"lower": (0, 0, 4, 1), "upper": (1, 1, 2, 1)}, 0.4, comm)
    return archord.Problem(
        mesh,
        bodies=[archord.Body("lower", Soft()), archord.Body("upper", archord.Elastic(500.0, 0.3))],
        interactions=[archord.Interaction("rub", ("upper bottom", "lower top"), law=law(k))],
        supports=[archord.Support("lower bottom")],
        loads=[
            archord.Load("press", on="upper top", direction="y", displacement=[-0.01, -0.01]),
            archord.Load("slide", on="upper top", direction="x", displacement=[0.0, 0.2]),
        ],
        **({"steps": [1, 3]} | changes),
    )


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return archord.solve(sliding(MPI.COMM_SELF), tmp_path_factory.mktemp("own") / "run")


@pytest.mark.mpi
def test_a_run_goes_on_with_its_objects_on_any_number_of_ranks(comm, tmp_path, monkeypatch):
    """To the numbers of one rank that was not interrupted, to 1e-9."""
    folder = comm.bcast(tmp_path)
    alone = archord.solve(sliding(MPI.COMM_SELF), folder / f"alone{comm.rank}", comm=MPI.COMM_SELF)

    def stop(self, m):
        if m.step == 2:
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(Progress, "step", stop)
        with pytest.raises(KeyboardInterrupt):
            archord.solve(sliding(comm), folder / "run", comm=comm)
    run = archord.solve(sliding(comm), folder / "run", restart=True, comm=comm)
    assert (run.status, run.steps) == ("done", 4)
    for name in ("press force", "slide force", "rub worn volume", "elastic_energy"):
        scale = np.abs(alone.columns[name]).max()
        np.testing.assert_allclose(run.columns[name], alone.columns[name], atol=1e-9 * scale)


def test_own_classes_may_write_into_the_history_that_they_get(run, tmp_path):
    """It counts once a step, not once an iteration."""
    same = archord.solve(sliding(MPI.COMM_SELF, law=WrittenInPlace), tmp_path / "run")
    for name in ("press force", "rub worn volume"):
        np.testing.assert_allclose(same.columns[name], run.columns[name], rtol=1e-9)
    points = Points(Worsening(), 2)
    strain = np.array([[0.1, 0.0, 0.0], [0.0, 0.2, 0.0]])
    for _ in range(2):  # iterations
        points.update(strain)
    assert points.trial.depth.tolist() == [0.1, 0.2]
    assert not points.state.depth.any()


@dataclass(frozen=True)
class Fibres(archord.Material):
    """Two families of fibres along x and y, stiffer the further they are stretched, twice at the
    ``limit``, whose ``E`` and ``nu`` are no isotropic solid's."""

    E: float = 10.0
    nu: float = 0.3
    limit: float = 1.0
    yields = True

    @property
    def elastic_tangent(self):
        return self.E * np.diag([1.0, 2.0, 0.5])

    def update(self, strain, state):
        growth = (strain / self.limit) ** 2 * [1, 1, 0]
        working = strain @ self.elastic_tangent * (1 + growth)
        tangent = self.elastic_tangent * (1 + 3 * growth)[:, None, :]
        return np.insert(working, 2, 0.0, axis=1), tangent, state

    def stored(self, strain, stress, state):
        growth = (strain / self.limit) ** 2 * [0.5, 0.5, 0]
        return (strain**2 @ self.elastic_tangent * (1 + growth)).sum(axis=1) / 2


def stretched(**given) -> archord.Problem:
    """A bar of `Fibres` that is stretched by 30 %."""
    parts = {
        "bodies": [archord.Body("bar", Fibres())],
        "supports": [
            archord.Support("bar left", fixed="x"),
            archord.Support("bar bottom", fixed="y"),
        ],
        "loads": [archord.Load("pull", on="bar right", direction="x", displacement=0.6)],
    }
    mesh = archord.rectangles({"bar": (0, 0, 2, 1)}, size=1.0)
    return archord.Problem(mesh, **parts | {"steps": 6, "strain": "large"} | given)


def test_own_materials_have_true_stresses_and_energies_at_large_strain(tmp_path):
    """Of the logarithmic strain ``e``: the stress that does work on it, over the stretched area,
    and what the material stores, whatever it calls E and nu."""
    run = archord.solve(stretched(), tmp_path / "run")
    e = np.log(1.3)
    working = 10 * e * (1 + e**2)
    assert run.columns["pull force"][-1] == pytest.approx(working / 1.3, rel=1e-9)
    np.testing.assert_allclose(run.fields().stress[:, 0], working / 1.3, rtol=1e-9)
    stored = 2 * 10 * e**2 * (1 + 0.5 * e**2) / 2
    assert run.columns["elastic_energy"][-1] == pytest.approx(stored, rel=1e-9)


class Nominal(archord.LargeStrain):
    """A material at large strain that tells nominal stresses alone."""

    true_stress = archord.Material.true_stress


def test_fields_need_true_stresses(tmp_path):
    """Nominal stresses have as many components in a plane, but others."""
    problem = stretched(bodies=[archord.Body("bar", Nominal(archord.Elastic(10.0, 0.3)))], steps=1)
    with pytest.raises(archord.InputError, match="must define true_stress, as fields"):
        archord.solve(problem, tmp_path / "run")
    run = archord.solve(problem, tmp_path / "run", fields=False)
    assert run.columns["pull force"][-1] > 0


def test_own_materials_in_plane_stress_do_not_tell_their_thickness():
    said = 'body "bar": true stresses at large strain need the thickness'
    with pytest.raises(archord.InputError, match=said):
        stretched(kinematics="plane stress")


@pytest.mark.parametrize(("factor", "strain"), [(0.5, "small"), (40.0, "small"), (0.5, "large")])
def test_a_material_that_stiffens_in_contact_is_warned_of(tmp_path, factor, strain):
    """Its force on a punch was a third too small with a gamma of its elastic tangent."""
    mesh = archord.rectangles({"low": (-2, -1, 4, 1), "up": (-1, 0, 2, 1)}, size=1.0)
    bodies = [
        archord.Body("low", Fibres(limit=0.005)),
        archord.Body("up", archord.Elastic(1e5, 0.3)),
    ]
    surfaces = ("up bottom", "low top")
    problem = archord.Problem(
        mesh,
        bodies,
        [archord.Interaction("contact", surfaces, gamma_factor=factor)],
        [archord.Support("low bottom"), archord.Support("up top", fixed="x")],
        [archord.Load("press", on="up top", direction="y", displacement=-0.02)],
        steps=1,
        strain=strain,
    )
    run = archord.solve(problem, tmp_path / "run")
    assert any("times as stiff in contact" in said for said in run.warnings) == (factor < 1)


class OwnFriction(archord.ContactLaw):
    """Coulomb's friction, in a class without its coefficient."""

    has_friction = counts_slip = unilateral = True

    def __init__(self, k):
        self.coulomb = archord.Coulomb(k)

    def state(self, n):
        return self.coulomb.state(n)

    def respond(self, opening, trial, gamma, state, dt):
        return self.coulomb.respond(opening, trial, gamma, state, dt)

    def dissipation(self, state):
        return self.coulomb.dissipation(state)


def test_what_sticks_is_told_of_own_friction_too(tmp_path):
    """By the branches of the law: without a coefficient nothing stuck in contact.h5."""
    runs = [
        archord.solve(sliding(MPI.COMM_SELF, k=0.3, law=law, steps=[1, 1]), tmp_path / law.__name__)
        for law in (archord.Coulomb, OwnFriction)
    ]
    for step in (1, 2):
        named, own = (run.contact(step)["lower top"].sticks for run in runs)
        np.testing.assert_array_equal(own, named)
    assert 0 < runs[0].contact(1)["lower top"].sticks.sum() < own.size


class Glue(archord.ContactLaw):
    """Springs between points of undeformed surfaces."""

    slides = False

    def respond(self, opening, trial, gamma, state, dt):
        stiffness = np.array([1e5, 200.0])
        by_opening = np.tile(-np.diag(stiffness), (len(trial), 1, 1))
        branch = np.full(len(trial), 2)
        return archord.Response(-stiffness * opening, 0 * by_opening, by_opening, branch, state)


@pytest.mark.parametrize("strain", ["small", "large"])
def test_a_glue_whose_surfaces_turn_is_warned_of(tmp_path, strain):
    """Its normals do not turn: a beam that is bent has slips where it has gaps."""
    rubber = archord.Elastic(1000.0, 0.0)
    problem = archord.Problem(
        archord.rectangles({"beam": (0, 0, 4, 1), "end": (4, 0, 1, 1)}, size=1.0),
        [archord.Body("beam", rubber), archord.Body("end", rubber)],
        [archord.Interaction("glue", ("end left", "beam right"), law=Glue())],
        [archord.Support("beam left")],
        [archord.Load("lift", on="end right", direction="y", displacement=0.4)],
        steps=1,
        strain=strain,
    )
    warnings = archord.solve(problem, tmp_path / "run").warnings
    assert any("'glue' keeps the normals" in said for said in warnings) == (strain == "large")


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_a_run_folder_tells_the_moduli_of_own_materials(plane):
    """As if they were isotropic, in plane stress, too, where E was 5 % too small."""

    class Steel(Soft):
        elastic_tangent = archord.Elastic(1000.0, 0.3, plane).elastic_tangent

    bodies = [archord.Body("slab", Steel())]
    words = words_of(slab(bodies=bodies, kinematics=f"plane {plane}"), "mesh.npz")
    assert (words.body[0].E, words.body[0].nu) == pytest.approx((1000.0, 0.3), rel=1e-12)


def test_arrays_of_parts_may_be_changed_after_their_use():
    """Parts that were made of them keep their numbers."""
    table = np.array([[0.0, 200.0], [0.1, 300.0]])
    back = np.array([[2e4, 50.0]])
    values = np.array([0.1, 0.2])
    hardening = archord.TabularHardening(table)
    metal = archord.KinematicMaterial(210e3, 0.3, hardening=hardening, back_stresses=back)
    load = archord.Load("pull", direction="x", displacement=values)
    for array in (table, back, values):
        array *= 2
    assert hardening.points == ((0.0, 200.0), (0.1, 300.0))
    assert metal.back_stresses == ((2e4, 50.0),)
    assert load.stages == (0.1, 0.2)


PARTS = {
    "load": lambda value: archord.Load("pull", direction="x", force=value[0]),
    "core": lambda value: archord.Load("pull", direction="x", force=1.0, core=(value[1], 1.0)),
    "support": lambda value: archord.Support("left", fixed=value[2]),
    "interaction": lambda value: archord.Interaction("contact", value[3]),
    "mesh": lambda value: archord.Mesh(
        "lug.msh", circles={"hole": [value[4]["hole"], 10.0]}, sets=value[4]
    ),
    "drive": lambda value: Drive("pull", path=value[1]),
    "dead load": lambda value: DeadLoad(cells="lug", force=value[1]),
    "mean": lambda value: Mean("mean", "flat", 0, point=value[1], mirrors=value[3]),
    "turn": lambda value: Turn("turn", value[1], value[3]),
    "disc": lambda value: Rigid(archord.RigidCircle((0.0, 0.0), 1.0), value[4]),
    "law": lambda value: LawJoint(10.0, clearance=value[0], E_star=1e5),
}


@pytest.mark.parametrize("kind", PARTS)
def test_what_a_part_is_made_of_may_be_changed_after_its_use(kind):
    """Arrays, lists and dictionaries: the path of a drive followed them."""
    values = np.array(0.1), np.array([0.0, 0.2]), ["x"], ["pin", "hole"], {"hole": [1.0, 2.0]}
    part = PARTS[kind](values)
    before = repr(part)
    single, pair, fixed, names, rates = values
    single *= 2
    pair *= 2
    for given in (fixed, names, rates["hole"]):
        given.clear()
    rates.clear()
    assert repr(part) == before


def test_a_problem_keeps_its_lists():
    """A load that was added to the list of one problem acted in the other, too."""
    loads = [archord.Load("press", on="slab top", direction="y", displacement=-1e-3)]
    steps = [2]
    stepping = {"first": 0.5}
    problem = slab(loads=loads, steps=steps, stepping=stepping)
    loads.append(archord.Load("shear", on="slab top", direction="x", force=1.0))
    steps[0] = 7
    stepping.clear()
    assert (len(problem.loads), problem.targets) == (1, [0.5, 1.0])
    assert problem.stepping == {"first": 0.5}


def test_a_quantity_of_a_law_is_of_the_whole(run, tmp_path):
    """As the forces are: k times force times slip is worn off, whatever part is modelled."""
    twice = archord.solve(sliding(MPI.COMM_SELF, symmetry=2), tmp_path / "run")
    for name in ("press force", "rub worn volume", "rub contact length"):
        np.testing.assert_allclose(twice.columns[name], 2 * np.array(run.columns[name]), rtol=1e-9)


def named(quantity):
    """A law of `Wear` that calls its depth so."""

    class Named(Wear):
        def quantities(self, state):
            return {quantity: archord.Quantity(state.depth, "mm2")}

    return Named


def test_a_quantity_of_a_law_has_its_own_column(run, tmp_path):
    """Or none: a name that archord has for an interaction told what archord tells of it."""
    area = archord.solve(sliding(MPI.COMM_SELF, law=named("contact area")), tmp_path / "run")
    np.testing.assert_array_equal(area.columns["rub contact area"], run.columns["rub worn volume"])
    for name, said in (
        ("largest pressure", "makes the column 'rub largest pressure' of history.csv"),
        ("worn [mm]", 'must not hold " \\["'),
    ):
        with pytest.raises(archord.InputError, match=said):
            archord.solve(sliding(MPI.COMM_SELF, law=named(name)), tmp_path / "refused")


class Late(Wear):
    """A law that tells of its depth as soon as there is one, and of a width until then."""

    def quantities(self, state):
        name = "depth" if (state.depth > 1e-4).any() else "width"
        return {name: archord.Quantity(state.depth, "mm2")}


@pytest.mark.mpi
def test_a_law_tells_the_same_quantities_in_all_states(comm, tmp_path):
    """A quantity that began later had no column, and one that ended was a traceback."""
    folder = comm.bcast(tmp_path) / "run"
    run = archord.solve(sliding(comm, law=Late), folder, comm=comm)
    said = "the contact law of 'rub' has the quantities 'depth', 'width' in some states alone"
    assert (run.status, run.steps) == ("stopped", 1)
    assert run.message.startswith(said)


def test_the_halted_step_keeps_its_contact(tmp_path, monkeypatch):
    """A law that takes its wear from the beginning of the step has another pressure where the
    accepted state is evaluated once more."""

    def stop(self, m):
        if m.step == 3:
            signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(Progress, "step", stop)
        with pytest.raises(KeyboardInterrupt):
            archord.solve(sliding(MPI.COMM_SELF), tmp_path / "run", comm=MPI.COMM_SELF)
    before = archord.load(tmp_path / "run")
    contact = before.contact(3)
    field = before.fields(3).cell["contact_pressure"]
    problem = sliding(MPI.COMM_SELF)
    after = archord.solve(problem, tmp_path / "run", restart=True, comm=MPI.COMM_SELF)
    for side, profile in contact.items():
        np.testing.assert_array_equal(after.contact(3)[side].pressure, profile.pressure)
    np.testing.assert_array_equal(after.fields(3).cell["contact_pressure"], field)


class Killed(BaseException):
    """What ends a run where a kill would."""


@pytest.mark.parametrize("behind", [True, False])
def test_a_kill_at_the_checkpoint_leaves_no_step_to_evaluate_once_more(
    run, tmp_path, monkeypatch, behind
):
    """The arrays of a step are on disk before the checkpoint counts it."""

    def kill(path, checkpoint):
        if behind or checkpoint.step < 3:
            write(path, checkpoint)
        if checkpoint.step == 3:
            raise Killed

    write = run_module.write_checkpoint
    with monkeypatch.context() as patch:
        patch.setattr(run_module, "write_checkpoint", kill)
        with pytest.raises(Killed):
            archord.solve(sliding(MPI.COMM_SELF), tmp_path / "run", comm=MPI.COMM_SELF)
    problem = sliding(MPI.COMM_SELF)
    after = archord.solve(problem, tmp_path / "run", restart=True, comm=MPI.COMM_SELF)
    for side, profile in run.contact(3).items():
        np.testing.assert_allclose(after.contact(3)[side].pressure, profile.pressure, atol=1e-9)
    field = run.fields(3).cell["contact_pressure"]
    np.testing.assert_allclose(after.fields(3).cell["contact_pressure"], field, atol=1e-9)


def test_the_folder_tells_of_the_objects(run):
    """By class and representation, without addresses, which differ in every process."""
    said = (run.folder / "scene.toml").read_text()
    assert 'kind = "Soft"' in said
    assert 'text = "Wear(k=0.001)"' in said
    assert "0x" not in said
    assert archord.load(run.folder).scene.body[0].own.text.endswith("Soft object>")


@pytest.mark.parametrize(
    "command",
    [
        ["show", "{run}"],
        ["report", "{run}", "-o", "{to}.pdf"],
        ["picture", "{run}", "-o", "{to}.png"],
        ["probe", "{run}", "--edge", "lower top"],
        ["export", "{run}", "--csv", "{to}"],
    ],
)
def test_a_run_of_own_objects_is_read_as_any_other(run, tmp_path, command, capsys):
    words = [word.format(run=run.folder, to=tmp_path / "out") for word in command]
    assert cli.run(words) == 0, capsys.readouterr().err


def test_an_object_is_shown_instead_of_the_keys_that_it_replaces(run, capsys):
    """No "law = frictionless" of a law of one's own, no "hardening = 0.0" of such a material."""
    assert cli.run(["show", str(run.folder)]) == 0
    shown = capsys.readouterr().out
    (rub,) = (line for line in shown.splitlines() if line.startswith("interaction rub"))
    (lower,) = (line for line in shown.splitlines() if line.startswith("body lower"))
    assert rub.endswith("Wear(k=0.001)")
    assert "frictionless" not in rub
    assert "hardening" not in lower


@pytest.mark.parametrize("words", [["{}/scene.toml", "-o", "{}/again"], ["{}", "--restart"]])
def test_no_scene_is_solved_with_the_description_of_an_object(run, tmp_path, words, capsys):
    """One sentence, exit code 2; what the run left stays."""
    folder = shutil.copytree(run.folder, tmp_path / "run")
    (folder / "history.csv").unlink()
    assert cli.run(["solve", *(word.format(folder) for word in words)]) == 2
    (said,) = capsys.readouterr().err.strip().splitlines()[-1:]
    assert re.search(r'body "lower": has a material given from Python, .*Soft object>, which', said)
    assert said.count("archord.solve(problem, ") == 1
    assert (folder / "checkpoint.h5").exists()


def test_another_object_does_not_continue_a_run(run):
    with pytest.raises(archord.InputError, match="only"):
        archord.solve(sliding(MPI.COMM_SELF, k=0.002), run.folder, restart=True)


def test_another_attribute_does_not_continue_a_run_whatever_the_representation_tells(tmp_path):
    """Continued with a wear of 2e-3 the run had the pressures of neither law."""
    archord.solve(sliding(MPI.COMM_SELF, law=Untold), tmp_path / "run")
    with pytest.raises(archord.InputError, match=r"\"k\": \"0.002\""):
        archord.solve(sliding(MPI.COMM_SELF, 0.002, Untold), tmp_path / "run", restart=True)
    same = archord.solve(sliding(MPI.COMM_SELF, law=Untold), tmp_path / "run", restart=True)
    assert same.status == "done"


def test_an_extended_path_goes_on(run, tmp_path):
    """More steps of further loads, after those of the run."""
    folder = shutil.copytree(run.folder, tmp_path / "run")
    problem = sliding(MPI.COMM_SELF)
    loads = [
        archord.Load(load.name, load.on, load.direction, displacement=[*load.stages, last])
        for load, last in zip(problem.loads, (-0.01, 0.0), strict=True)
    ]
    longer = sliding(MPI.COMM_SELF, steps=[1, 3, 3])
    longer = archord.Problem(
        longer.mesh,
        longer.bodies,
        longer.interactions,
        longer.supports,
        loads,
        steps=[1, 3, 3],
    )
    found = archord.solve(longer, folder, restart=True)
    assert (found.status, found.steps) == ("done", 7)
    assert found.columns["slide displacement"][-1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    "law", [{"law": "coulomb", "friction": 0.2}, {"law": archord.Coulomb(0.2)}]
)
def test_friction_is_said_by_name_by_an_object_and_by_its_coefficient(tmp_path, law):
    """The same run; a scene can state it, as its words say."""
    blocks = archord.rectangles({"low": (0, 0, 2, 1), "high": (0.5, 1, 1, 1)}, size=0.5)

    def forces(name, **given):
        steel = archord.Elastic(210e3, 0.3)
        contact = archord.Interaction("contact", ("high bottom", "low top"), **given)
        press = archord.Load("press", on="high top", direction="y", displacement=-1e-3)
        problem = archord.Problem(
            blocks,
            [archord.Body("low", steel), archord.Body("high", steel)],
            [contact],
            [archord.Support("low bottom"), archord.Support("high top", fixed="x")],
            [press],
            steps=2,
        )
        return archord.solve(problem, tmp_path / name, force=True)

    run = forces("named", **law)
    same = forces("by coefficient", friction=0.2)
    assert run.columns["press force"] == pytest.approx(same.columns["press force"], rel=1e-12)
    assert run.scene.interaction[0].friction == 0.2


def slab(**given) -> archord.Problem:
    """A square that is pressed by 0.001."""
    mesh = archord.rectangles({"slab": (0, 0, 1, 1)}, size=0.5)
    press = archord.Load("press", on="slab top", direction="y", displacement=-1e-3)
    parts = {
        "bodies": [archord.Body("slab", archord.Elastic(210e3, 0.3))],
        "supports": [
            archord.Support("slab bottom", fixed="y"),
            archord.Support("slab left", fixed="x"),
        ],
        "loads": [press],
        "steps": 1,
    }
    return archord.Problem(mesh, **parts | given)


def test_a_thickness_is_the_same_of_a_problem_and_of_its_kinematics(tmp_path):
    """Forces are of the thickness then, and so is their unit."""
    by_kinematics = archord.solve(slab(kinematics=Kinematics("strain", 5.0)), tmp_path / "a")
    by_itself = archord.solve(slab(thickness=5.0), tmp_path / "b")
    assert by_kinematics.columns["press force"] == pytest.approx(by_itself.columns["press force"])
    assert by_kinematics.units["press force"] == by_itself.units["press force"] == "N"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"thickness": 0.0}, "thickness must be positive, not 0.0"),
        ({"thickness": 2.0, "kinematics": "axisymmetric"}, "thickness = 2: only a plane has"),
        (
            {"thickness": 2.0, "kinematics": Kinematics("strain", 5.0)},
            "thickness = 2, but its kinematics have the thickness 5",
        ),
        ({"bodies": [archord.Body("slab", archord.Elastic(1.0, 0.3, "stress"))]}, 'body "slab": a'),
    ],
)
def test_what_does_not_fit_the_kinematics_is_a_sentence(given, said):
    with pytest.raises(archord.InputError, match=f"^archord.Problem: {said}"):
        slab(**given)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"kinematics": "curent"}, 'kinematics = "curent" must be "current" or "reference"'),
        ({"gamma_factor": 0.0}, "gamma_factor = 0.0 must be positive"),
        ({"gamma_factor": np.inf}, "gamma_factor = Infinity must be positive"),
        ({"gamma_factor": "1"}, 'gamma_factor = "1" must be positive'),
        ({"friction": -0.1}, "friction = -0.1 must not be negative"),
        ({"friction": "0.1"}, 'friction = "0.1" must not be negative'),
        ({"friction": 0.1, "law": "tied"}, 'interaction "contact": friction must be positive, of'),
        ({"slide": -1.0}, "slide = -1.0 must not be negative"),
        ({"interference": np.inf}, "interference = Infinity must not be negative, and be finite"),
    ],
)
def test_an_interaction_refuses_what_it_would_not_heed(given, said):
    with pytest.raises(archord.InputError, match=said):
        archord.Interaction("contact", ("bolt", "hole"), **given)


def hardened(hardening) -> dict:
    return {"bodies": [archord.Body("slab", archord.J2Material(210e3, 0.3, hardening=hardening))]}


def kinematic() -> dict:
    steel = archord.KinematicMaterial(210e3, 0.3, back_stresses=[(60e3, 400.0)])
    return {"bodies": [archord.Body("slab", steel)]}


def elastic(*numbers) -> dict:
    return {"bodies": [archord.Body("slab", archord.Elastic(*numbers))]}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (elastic(-210e3, 0.3), 'body "slab".E = -210000.0 must be a number between'),
        (elastic(np.nan, 0.3), 'body "slab".E = NaN must be a number between'),
        (elastic("210e3", 0.3), 'body "slab".E = "210e3" must be a number between'),
        (elastic(True, 0.3), 'body "slab".E = true must be a number between'),
        (elastic(210e3, 0.3, ["strain"]), r'body "slab".plane = \["strain"\] must be one of'),
        (elastic(210e3, 0.5), 'body "slab".nu = 0.5 must be a number between -1 and 0.5'),
        (hardened(300.0), 'body "slab".hardening = 300.0 must be a hardening law'),
        (hardened(archord.LinearHardening(-1.0)), 'body "slab".hardening: yield stresses must be'),
        (hardened(archord.LinearHardening(np.nan)), 'body "slab".hardening: yield stresses'),
        (hardened(archord.LinearHardening(300.0, np.nan)), 'body "slab".hardening: yield'),
        (hardened(archord.LinearHardening(300.0, -1e6)), 'body "slab".hardening: yield'),
        (hardened(archord.VoceHardening(300.0, 400.0, -10.0)), 'body "slab".hardening: yield'),
        (kinematic(), 'body "slab".back_stresses need a hardening'),
        ({"symmetry": 0}, "symmetry = 0 must be a number, and 1 at least"),
        ({"symmetry": np.nan}, "symmetry = NaN must be a number, and 1 at least"),
        ({"symmetry": "2"}, 'symmetry = "2" must be a number, and 1 at least'),
        ({"thickness": "5"}, "thickness must be positive, not '5'"),
        ({"thickness": np.inf}, "thickness must be positive, not inf"),
        ({"degree": 9}, "degree = 9 must be 2 or 3: displacements of first order lock"),
        ({"degree": 1}, "degree = 1 must be 2 or 3: displacements of first order lock"),
        ({"tolerance": 0.0}, "tolerance = 0.0 must be a number between 0 and 1"),
        ({"max_iterations": 0}, "max_iterations = 0 must be a whole number"),
        ({"units": "mm"}, 'units = "mm" must be two names'),
        ({"units": ("mm",)}, r'units = \["mm"\] must be two names'),
    ],
)
def test_numbers_that_no_problem_has_are_a_sentence(given, said):
    """With `System` alone, too, they would give a force without a word."""
    with pytest.raises(archord.InputError, match=f"^archord.Problem: {said}") as error:
        slab(**given)
    assert len(str(error.value).splitlines()) == 1


def test_a_pair_of_surfaces_carries_once():
    pairs = [("pin", "hole"), ("hole", "pin")]
    contacts = [archord.Interaction(name, pair) for name, pair in zip("ab", pairs, strict=True)]
    with pytest.raises(archord.InputError, match='interactions "a" and "b" are of the same'):
        slab(interactions=contacts)


@pytest.mark.parametrize(
    ("centre", "radius", "said"),
    [
        ((0.0, 1.0), -1.0, "radius = -1.0 must be positive and finite"),
        ((0.0, 1.0), np.nan, "radius = NaN must be positive and finite"),
        ((0.0, 1.0), "1", 'radius = "1" must be positive and finite'),
        ((0.0, np.nan), 1.0, "must be two numbers"),
        ((0.0, 1.0, 2.0), 1.0, "must be two numbers"),
    ],
)
def test_a_disc_is_round_and_somewhere(centre, radius, said):
    with pytest.raises(archord.InputError, match=f"^archord.RigidCircle: .*{said}"):
        archord.RigidCircle(centre, radius)


@pytest.mark.parametrize(
    ("centre", "axis", "said"),
    [
        ((0.0, 1.0), (0, 0, 1), "centre = .* must be three numbers"),
        ((0.0, 1.0, 2.0), (0, 1), "axis = .* must be three numbers, not all of them zero"),
        ((0.0, 1.0, 2.0), (0, 0, 0), "axis = .* must be three numbers, not all of them zero"),
    ],
)
def test_a_cylinder_has_an_axis_somewhere(centre, axis, said):
    with pytest.raises(archord.InputError, match=f"^archord.RigidCylinder: {said}"):
        archord.RigidCylinder(centre, 1.0, axis)


def test_stages_are_a_list_and_directions_are_words():
    with pytest.raises(archord.InputError, match="must be a number, or a list of numbers"):
        archord.Load("press", direction="y", displacement=[[0.0, 1.0], [2.0, 3.0]])
    with pytest.raises(archord.InputError, match="must be directions among"):
        archord.Support("base", fixed=3)


class Flat(archord.ContactLaw):
    """A law that answers arrays of this shape."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.shape = shape

    def respond(self, opening, trial, gamma, state, dt):
        none = np.zeros(len(trial), dtype=int)
        shears = np.zeros((len(trial), 2, 2))
        return archord.Response(np.zeros((len(trial), *self.shape)), shears, None, none, state)


class Narrow(archord.Elastic):
    """A material that forgets the stress out of the plane."""

    def update(self, strain, state):
        stress, tangent, state = super().update(strain, state)
        return stress[:, :3], tangent, state


@pytest.mark.parametrize("shape", [(), (1,), (3,)])
def test_a_law_answers_each_point(shape):
    blocks = archord.rectangles({"low": (0, 0, 1, 1), "high": (0, 1, 1, 1)}, size=0.5)
    steel = archord.Elastic(210e3, 0.3)
    problem = archord.Problem(
        blocks,
        [archord.Body("low", steel), archord.Body("high", steel)],
        [archord.Interaction("rub", ("high bottom", "low top"), law=Flat(shape))],
        [archord.Support("low bottom"), archord.Support("high top")],
    )
    with pytest.raises(ValueError, match="the contact law of 'rub' must answer a traction of"):
        archord.System(problem)


def test_a_material_answers_each_component():
    with pytest.raises(ValueError, match=r"stresses of the shape \(2, 4\) at 2 points, not"):
        archord.System(slab(bodies=[archord.Body("slab", Narrow(210e3, 0.3))]))


def test_own_fields_without_fields_are_refused(tmp_path):
    own = {"twice": lambda at: 2 * at.stress[..., 0]}
    with pytest.raises(archord.InputError, match="own_fields need fields"):
        archord.solve(slab(), tmp_path / "run", fields=False, own_fields=own)
    assert not (tmp_path / "run").exists()


def test_a_ring_has_no_law_per_length_of_a_pin(tmp_path):
    """Its forces are of the whole ring: a table would be multiplied by a length."""
    mesh = archord.rectangles({"low": (0, 0, 1, 1), "high": (0, 1, 1, 1)}, size=0.5)
    steel = archord.Elastic(210e3, 0.3)
    problem = archord.Problem(
        mesh,
        [archord.Body("low", steel), archord.Body("high", steel)],
        [archord.Interaction("contact", ("high bottom", "low top"))],
        [archord.Support("low bottom")],
        [archord.Load("press", on="high top", direction="y", displacement=-1e-3)],
        steps=2,
        kinematics="axisymmetric",
    )
    run = archord.solve(problem, tmp_path / "run")
    with pytest.raises(archord.InputError, match="forces are of the whole ring"):
        read_steps(run)


def test_numbers_of_numpy_are_taken_as_pythons(tmp_path):
    """Single precision among them, which no run.json could hold; and a degree of 2.0."""
    numbers = {"thickness": np.float32(2.0), "tolerance": np.float32(1e-9), "degree": 2.0}
    runs = {}
    for name, given in (("numpy", numbers), ("plain", {"thickness": 2.0, "tolerance": 1e-9})):
        problem = archord.Problem(
            archord.rectangles({"block": (0.0, 0.0, 1.0, 1.0)}, size=0.5),
            [archord.Body("block", archord.Elastic(np.float32(1000.0), 0.3))],
            supports=[archord.Support("block bottom")],
            loads=[archord.Load("pull", on="block top", direction="y", displacement=0.01)],
            steps=1,
            **given,
        )
        runs[name] = archord.solve(problem, tmp_path / name, fields=False)
    first, second = (run.columns["pull force"] for run in runs.values())
    assert first == pytest.approx(second, rel=1e-7)

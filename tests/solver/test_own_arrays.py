"""Arrays of own materials, contact laws and hardening laws: odd ones work right, or are refused."""

import signal
from dataclasses import dataclass, make_dataclass, replace

import numpy as np
import pytest
from mpi4py import MPI

import archord
from archord.commands.progress import Progress
from tests.test_own_parts import Fibres, Soft, Wear, Worn, slab, sliding

Twice = make_dataclass("Twice", ["depth", "path"])


class InColumns(Wear):
    """Wear whose density is a column, which would count each point with every other one."""

    def quantities(self, state):
        return {"worn volume": archord.Quantity(state.depth[:, None], "mm2")}


class StoredInColumns(Wear):
    """The same of an energy."""

    def stored(self, opening, state):
        return state.depth[:, None]


class Buffered(Wear):
    """Wear whose answers are all written into one history."""

    def state(self, n):
        object.__setattr__(self, "buffer", Worn(np.zeros(n)))
        return super().state(n)

    def respond(self, opening, trial, gamma, state, dt):
        answer = super().respond(opening, trial, gamma, state, dt)
        self.buffer.depth[:] = answer.state.depth
        return answer._replace(state=self.buffer)


class Single(Wear):
    """Wear in single precision."""

    def respond(self, opening, trial, gamma, state, dt):
        answer = super().respond(opening, trial, gamma, state, dt)
        return answer._replace(traction=answer.traction.astype(np.float32))


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (InColumns, r"a density of 'worn volume' of the shape \(2,\) at 2 points, not \(2, 1\)"),
        (StoredInColumns, "a density of 'stored energy' of the shape"),
        (Buffered, "must answer new arrays"),
        (Single, "a traction of float64, not float32"),
    ],
)
def test_arrays_of_a_law_are_told_of(law, said):
    """Columns made a worn volume 95 times too large."""
    with pytest.raises(ValueError, match=said):
        archord.System(sliding(MPI.COMM_SELF, law=law))


class WritesIntoAll(Wear):
    """Wear that writes into all arrays that it gets, with derivatives of integers."""

    def respond(self, opening, trial, gamma, state, dt):
        given = opening.copy(), trial.copy(), gamma.copy(), state, dt
        answer = super().respond(*given)
        for array in (opening, trial, gamma):
            array *= 0
        return answer._replace(by_trial=answer.by_trial.astype(int))

    def quantities(self, state):
        told = super().quantities(state)["worn volume"]
        volume = told.density.copy()
        told.density[:] *= 1000
        return {"worn volume": told._replace(density=volume)}

    def stored(self, opening, state):
        opening *= 0
        state.depth[:] *= 2
        return 0.0

    def dissipation(self, state):
        state.depth[:] *= 2
        return 0.0


def test_a_law_may_write_into_what_it_gets(tmp_path):
    """Written into Nitsche's gamma, all later forces were 0; a depth that became another unit for
    the history of the run was a thousand times as deep in the next step."""
    laws = (Wear, WritesIntoAll)
    runs = [archord.solve(sliding(MPI.COMM_SELF, law=law), tmp_path / law.__name__) for law in laws]
    for name in ("press force", "slide force", "rub worn volume"):
        np.testing.assert_allclose(runs[1].columns[name], runs[0].columns[name], rtol=1e-9)


@dataclass(frozen=True)
class Beginning(Wear):
    """Wear whose history begins as ``kind`` says."""

    kind: str = ""

    def state(self, n):
        if self.kind == "one array for all":
            zero = np.zeros(n)
            return Twice(zero, zero)
        if self.kind == "of integers":
            return Twice(np.zeros(n, int), np.zeros(n, int))
        if self.kind == "read-only":
            return Twice(np.broadcast_to(0.0, n), np.broadcast_to(0.0, n))
        if self.kind == "a list":
            return Twice([0.0] * n, [0.0] * n)
        return Twice(np.zeros(n), np.zeros(n))

    def respond(self, opening, trial, gamma, state, dt):
        answer = super().respond(opening, trial, gamma, state, dt)
        path = state.path + np.abs(opening[:, 1])
        return answer._replace(state=Twice(answer.state.depth, path))


@pytest.mark.parametrize("kind", ["one array for all", "of integers", "read-only"])
def test_a_run_goes_on_however_its_history_begins(tmp_path, monkeypatch, kind):
    """With one array for all the depth was the path, and with integers it was 0."""

    def stop(self, m):
        if m.step == 3:
            signal.raise_signal(signal.SIGINT)

    def problem():
        return sliding(MPI.COMM_SELF, law=lambda k: Beginning(k, kind))

    alone = archord.solve(problem(), tmp_path / "alone")
    with monkeypatch.context() as patch:
        patch.setattr(Progress, "step", stop)
        with pytest.raises(KeyboardInterrupt):
            archord.solve(problem(), tmp_path / "run")
    run = archord.solve(problem(), tmp_path / "run", restart=True)
    for name in ("press force", "rub worn volume"):
        np.testing.assert_allclose(run.columns[name], alone.columns[name], rtol=1e-9)


def test_a_history_is_of_arrays_of_the_points():
    with pytest.raises(ValueError, match="the state of a Beginning must be None or a dataclass of"):
        archord.System(sliding(MPI.COMM_SELF, law=lambda k: Beginning(k, "a list")))


def steel():
    """A metal that yields."""
    return archord.J2Material(1000.0, 0.3, hardening=archord.LinearHardening(5.0, 50.0))


class OfSteel(archord.Material):
    """`steel`, asked by a class of one's own."""

    yields = True

    def __init__(self):
        self.inner = steel()

    @property
    def elastic_tangent(self):
        return self.inner.elastic_tangent

    def state(self, n):
        return self.inner.state(n)

    def update(self, strain, state):
        return self.inner.update(strain, state)

    def flows(self, old, new):
        return self.inner.flows(old, new)

    def energy(self, stress):
        return self.inner.energy(stress)

    def peeq(self, state):
        return self.inner.peeq(state)


class BufferedSteel(OfSteel):
    """Its answers are all written into one history."""

    def state(self, n):
        self.buffer = self.inner.state(n)
        return super().state(n)

    def update(self, strain, state):
        stress, tangent, new = super().update(strain, state)
        self.buffer.peeq[:] = new.peeq
        self.buffer.plastic_strain[:] = new.plastic_strain
        return stress, tangent, self.buffer


class SingleSteel(OfSteel):
    """In single precision."""

    def update(self, strain, state):
        stress, tangent, new = super().update(strain, state)
        return stress.astype(np.float32), tangent, new


class FlatSteel(OfSteel):
    """With tangents that are flat."""

    def update(self, strain, state):
        stress, tangent, new = super().update(strain, state)
        return stress, tangent.reshape(len(tangent), -1), new


@pytest.mark.parametrize(
    ("material", "said"),
    [
        (BufferedSteel, "BufferedSteel.update must give new arrays"),
        (SingleSteel, "must give float64 stresses"),
        (FlatSteel, r"must give tangents of the shape \(2, 3, 3\) at 2 points, not \(2, 9\)"),
    ],
)
def test_arrays_of_a_material_are_told_of(material, said):
    """With one history for all answers PEEQ was half as large again."""
    with pytest.raises(ValueError, match=said):
        archord.System(slab(bodies=[archord.Body("slab", material())]))


@pytest.mark.parametrize("method", ["flows", "peeq", "dissipation", "energy", "stored"])
@pytest.mark.parametrize("strain", ["small", "large"])
@pytest.mark.parametrize("answer", [np.zeros((2, 1)), np.zeros(3), None])
def test_what_a_material_tells_is_of_each_point(tmp_path, method, strain, answer):
    """They ended in tracebacks, or counted each point with every other one."""
    material = type("Odd", (OfSteel,), {method: lambda *given: answer})()
    problem = slab(bodies=[archord.Body("slab", material)], strain=strain)
    told = "stored" if method == "energy" else method
    said = rf"Odd\.{told} must give numbers of the shape \(2,\) at 2 points, not .* of the shape"
    with pytest.raises(archord.InputError, match=said):
        archord.solve(problem, tmp_path / "run")


class ScalarStrain(OfSteel):
    """Its history has one plastic strain for all components."""

    def state(self, n):
        return replace(self.inner.state(n), plastic_strain=np.zeros(n))

    def update(self, strain, state):
        stress, tangent, _ = self.inner.update(strain, self.inner.state(len(strain)))
        return stress, tangent, state


def test_tensors_of_fields_have_all_components(tmp_path):
    problem = slab(bodies=[archord.Body("slab", ScalarStrain())], steps=1)
    said = r"ScalarStrain\.state\.plastic_strain must have the shape \(\d+, 4\), not \(\d+,\)"
    with pytest.raises(archord.InputError, match=said):
        archord.solve(problem, tmp_path / "run")
    problem = slab(bodies=[archord.Body("slab", ScalarStrain())], steps=1)
    assert archord.solve(problem, tmp_path / "run", fields=False).status == "done"


class InPercent(OfSteel):
    """It writes into all that it is asked about, as PEEQ becomes percent in place."""

    def update(self, strain, state):
        answer = super().update(strain.copy(), state)
        strain *= 2
        return answer

    def energy(self, stress):
        energy = super().energy(stress.copy())
        stress *= 2
        return energy

    def peeq(self, state):
        peeq = state.peeq
        peeq *= 100
        return peeq

    def true_stress(self, strain, stress, state):
        found = stress.copy()
        for array in (strain, stress, state.peeq, state.plastic_strain):
            array *= 2
        return found


def test_a_material_may_write_into_what_it_is_asked_about(tmp_path):
    """PEEQ became percent of percent, and the metal an elastic one."""
    press = archord.Load("press", on="slab top", direction="y", displacement=-0.02)
    runs = []
    for material in (OfSteel(), InPercent()):
        problem = slab(bodies=[archord.Body("slab", material)], loads=[press], steps=3)
        runs.append(archord.solve(problem, tmp_path / type(material).__name__))
    of_steel, in_percent = (run.columns for run in runs)
    for name in ("press force", "elastic_energy"):
        np.testing.assert_allclose(in_percent[name], of_steel[name], rtol=1e-12)
    peeq = np.array(of_steel["slab peeq_max"])
    np.testing.assert_allclose(in_percent["slab peeq_max"], 100 * peeq, rtol=1e-12)
    one, other = (run.fields().stress for run in runs)
    np.testing.assert_allclose(other, one, rtol=1e-12, atol=1e-12)


class InFortranOrder(OfSteel):
    """Its arrays lie the other way round."""

    def update(self, strain, state):
        stress, tangent, new = super().update(strain, state)
        new = replace(new, plastic_strain=np.asfortranarray(new.plastic_strain))
        return np.asfortranarray(stress), np.asfortranarray(tangent), new


def test_arrays_may_lie_in_any_order(tmp_path):
    press = archord.Load("press", on="slab top", direction="y", displacement=-0.02)
    runs = []
    for material in (OfSteel(), InFortranOrder()):
        problem = slab(bodies=[archord.Body("slab", material)], loads=[press], steps=2)
        runs.append(archord.solve(problem, tmp_path / type(material).__name__))
    for name in ("press force", "slab peeq_max"):
        np.testing.assert_allclose(runs[1].columns[name], runs[0].columns[name], rtol=1e-12)
    assert runs[0].columns["slab peeq_max"][-1] > 0


class Wrapped(Fibres):
    """Fibres that hold an elastic solid, and do not say that they stiffen."""

    inner = archord.Elastic(10.0, 0.3)
    yields = False


def test_the_attributes_of_a_material_do_not_hide_it():
    """A solid of the name that archord uses itself was checked in its place."""
    with pytest.raises(ValueError, match="must say yields = True"):
        archord.System(slab(bodies=[archord.Body("slab", Wrapped(limit=0.005))]))


class Listed(Soft):
    """Its moduli are lists."""

    elastic_tangent = Soft.elastic_tangent.tolist()


def test_moduli_are_an_array():
    with pytest.raises(archord.InputError, match=r"elastic_tangent = \[\[.* must be an array"):
        slab(bodies=[archord.Body("slab", Listed())])


class Line(archord.LinearHardening):
    """A line that is computed in the array of PEEQ."""

    linear = None

    def stress(self, peeq):
        peeq *= self.modulus
        peeq += self.yield_stress
        return peeq


class Constant(archord.LinearHardening):
    """A yield stress that is one number for all."""

    linear = None

    def stress(self, peeq):
        return self.yield_stress


@pytest.mark.parametrize(
    ("law", "said"),
    [(Line, "must not change the array of PEEQ"), (Constant, "one number for each PEEQ")],
)
def test_a_hardening_law_answers_each_point_in_another_array(law, said):
    """The PEEQ of a pin became 6e5, and its force an elastic pin's."""
    metal = archord.J2Material(1000.0, 0.3, hardening=law(5.0, 50.0))
    with pytest.raises(archord.InputError, match=said):
        slab(bodies=[archord.Body("slab", metal)])


def test_own_fields_may_write_into_what_they_get(tmp_path):
    """Written into stresses, plastic strains and weights, fields and later forces were others."""

    def first(at):
        return at.stress[..., 0]

    def written(at):
        for array in (at.stress, at.plastic_strain, at.weight, at.state.peeq):
            array *= 2
        return at.stress[..., 0] / 2

    press = archord.Load("press", on="slab top", direction="y", displacement=-0.02)
    runs = []
    for own in (first, written):
        problem = slab(bodies=[archord.Body("slab", steel())], loads=[press], steps=3)
        fields = {"one": own, "other": first}
        runs.append(archord.solve(problem, tmp_path / own.__name__, own_fields=fields))
    for name in ("press force", "slab peeq_max", "elastic_energy"):
        np.testing.assert_allclose(runs[1].columns[name], runs[0].columns[name], rtol=1e-12)
    one, other = (run.fields() for run in runs)
    np.testing.assert_allclose(other.stress, one.stress, rtol=1e-12, atol=1e-12)
    for name in ("one", "other"):
        np.testing.assert_allclose(other.cell[name], one.cell[name], rtol=1e-12)

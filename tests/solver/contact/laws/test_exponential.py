"""Soft contact: its derivative, its pressure on blocks by a closed form on any number of ranks, and
its words in scenes."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from scipy.optimize import brentq

import archord
from archord.cli import run as command
from archord.scene.sections.contact import CONTACT_LAWS
from archord.solver.contact.laws.exponential import Exponential
from archord.solver.contact.laws.named import LAWS

LAW = Exponential(pressure=50.0, clearance=0.01)
E = 1000.0  # without contraction: the strips are bars


def _pressure(gap):
    gap = np.atleast_1d(gap)
    opening = np.stack([gap, np.zeros_like(gap)], axis=1)
    return LAW.respond(opening, np.zeros_like(opening), np.ones_like(opening), None, 1.0)


def test_the_derivative_is_a_difference_and_the_ends_are_the_parameters():
    gap = np.linspace(-0.02, 0.02, 8)
    h = 1e-7
    slope = (_pressure(gap + h).traction - _pressure(gap - h).traction)[:, 0] / (2 * h)
    np.testing.assert_allclose(_pressure(gap).by_opening[:, 0, 0], slope, rtol=1e-6, atol=1e-6)
    assert _pressure(0.0).traction[0, 0] == pytest.approx(50.0)
    assert _pressure(0.01).traction[0, 0] == 0.0
    np.testing.assert_array_equal(_pressure(gap).branch > 0, gap < 0.01)


def test_the_stored_energy_is_the_work_of_the_pressure():
    gap = np.linspace(-0.02, 0.02, 8)
    opening = np.stack([gap, np.zeros_like(gap)], axis=1)
    h = np.array([1e-6, 0.0])
    slope = (LAW.stored(opening + h, None) - LAW.stored(opening - h, None)) / (2 * h[0])
    np.testing.assert_allclose(slope, -_pressure(gap).traction[:, 0], rtol=1e-7, atol=1e-7)
    assert LAW.stored(np.array([[0.01, 0.0]]), None) == pytest.approx(0.0)


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf])
def test_parameters_that_make_no_law_are_refused(value):
    for name in ("pressure", "clearance"):
        with pytest.raises(archord.InputError, match=f"{name}.* must be positive and finite"):
            Exponential(**{"pressure": 50.0, "clearance": 0.01} | {name: value})
    if value != 0:
        with pytest.raises(archord.InputError, match=r"friction.* must not be negative"):
            archord.Coulomb(value)


def strips(law, *, down=0.03, steps=3) -> archord.Problem:
    """Two strips 1 high, 0.02 apart; the upper one moves ``down``."""
    soft = archord.Elastic(E, 0.0)
    return archord.Problem(
        archord.rectangles({"low": (0, 0, 2, 1), "high": (0, 1.02, 2, 1)}, size=0.5),
        [archord.Body("low", soft), archord.Body("high", soft)],
        [archord.Interaction("contact", ("high bottom", "low top"), law=law)],
        [archord.Support("low bottom"), archord.Support("high top", fixed="x")],
        [archord.Load("press", on="high top", direction="y", displacement=-down)],
        steps=steps,
    )


@pytest.mark.mpi
def test_strips_follow_the_closed_form_and_the_folder_has_the_words(comm, tmp_path):
    """The pressure p of the law at the gap that is left: ``0.02 - down + 2 p/E``."""
    folder = comm.bcast(tmp_path) / "run"
    run = archord.solve(strips(LAW, steps=12), folder, comm=comm)

    def excess(p):
        return _pressure(0.02 - 0.03 + 2 * p / E).traction[0, 0] - p

    pressure = brentq(excess, 0.0, 100.0, xtol=1e-12)
    assert -run.columns["press force"][-1] == pytest.approx(2 * pressure, rel=1e-8)
    assert run.columns["contact force y"][-1] == pytest.approx(-2 * pressure, rel=1e-8)
    assert run.columns["elastic_energy"][-1] == pytest.approx(run.columns["work"][-1], rel=3e-3)
    assert not run.warnings
    section = run.scene.interaction[0]
    assert section.law == "exponential"
    assert section.parameters == {"pressure": 50.0, "clearance": 0.01}
    comm.barrier()


def test_the_command_line_goes_on_with_a_run_from_python(tmp_path):
    """By the words of the law in the run folder."""
    folder = tmp_path / "run"
    archord.solve(strips(LAW), folder)
    went = ["--set", "load.press.displacement=[-0.03,0.0]"]
    assert command(["solve", str(folder), "--extend", *went]) == 0
    run = archord.load(folder)
    assert run.steps == 6
    assert run.columns["press force"][-1] == pytest.approx(0.0, abs=1e-9)


def test_every_name_has_its_class_and_the_parameters_of_this_class():
    assert LAWS.keys() == CONTACT_LAWS.keys()
    for name, parameters in CONTACT_LAWS.items():
        if parameters:
            assert [*parameters] == [given.name for given in fields(LAWS[name])]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"law": "exponential"}, r"parameters must be \{pressure, clearance\}"),
        ({"parameters": {"pressure": 1.0}}, r"parameters.* are not for law = .frictionless"),
        (
            {"law": "exponential", "parameters": {"pressure": -1.0, "clearance": 1.0}},
            r"parameters\.pressure = -1\.0 must be greater than 0",
        ),
        (
            {
                "law": "exponential",
                "friction": 0.1,
                "parameters": {"pressure": 1.0, "clearance": 1.0},
            },
            r"friction = 0\.1 is not for law = .exponential",
        ),
    ],
)
def test_parameters_that_are_not_of_the_law_are_refused(given, said):
    from archord.scene.parts import InteractionSection

    with pytest.raises(archord.InputError, match=said):
        InteractionSection(name="contact", surfaces=["a", "b"], **given)

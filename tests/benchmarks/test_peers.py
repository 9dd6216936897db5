"""The peers of the benchmark "error against run time": their list, and the force of the joint that
each computes."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from archord.benchmarks.peers import installed
from archord.benchmarks.peers.installed import PEERS
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material

# Elastic: independent solvers of each kinematics, refined until the digits stood (README.md).
# Plastic: archord's for fixed pairs, GetFEM's and NGSolve's for closest points.
FORCE = {
    "elastic": {"reference": 0.0127596, "current": 0.0127785},
    "plastic": {"reference": 0.00668, "current": 0.006692},
}


def test_every_peer_has_a_series_of_growing_cost_for_each_case_that_it_solves():
    """Edges shrink within an order, orders grow; asimov-contact has no plasticity."""
    for peer in PEERS:
        elastic_alone = peer.label == "asimov-contact"
        assert set(peer.series) == ({"elastic"} if elastic_alone else set(FORCE))
        for meshes in peer.series.values():
            assert list(meshes) == sorted(set(meshes), key=lambda mesh: (mesh[1], -mesh[0]))
            assert len(meshes) >= 3


def test_only_what_answers_is_listed(tmp_path, monkeypatch):
    """Not an interpreter that is not there, nor one that has not the code."""
    answers = tmp_path / "python"
    answers.write_text("#!/bin/sh\necho 1.2\n")
    answers.chmod(0o755)
    pythons = [str(tmp_path / "none"), "/bin/false", str(answers)]
    monkeypatch.setattr(
        installed, "PEERS", [replace(PEERS[0], python=python) for python in pythons]
    )
    (found,) = installed.installed()
    assert (found.python, found.version) == (str(answers), "1.2")
    python, script, *words = found.command("plastic", 0.04, 2, 20, tmp_path / "r.json")
    assert python == found.python
    assert Path(script).is_file()
    assert (
        " ".join(words)
        == f"--case plastic --size 0.04 --order 2 --steps 20 --output {tmp_path / 'r.json'}"
    )


@pytest.mark.parametrize(
    ("peer", "case", "mesh", "steps", "tolerance"),
    [
        pytest.param(peer, case, mesh, *rest, id=f"{peer.label}-{case}-{mesh}")
        for peer in PEERS
        for case, mesh, *rest in (
            ("elastic", 0, 2, 1e-2),
            ("elastic", 1, 2, 4e-3 if peer.label == "Kratos" else 1e-3),
            ("plastic", 0, 20, 1e-2),
        )
        if case in peer.series
    ],
)
def test_the_force_is_that_of_its_kinematics(tmp_path, peer, case, mesh, steps, tolerance):
    """On its coarsest mesh within 1 %, on the next one within 0.1 %, with Kratos' elements of first
    order within 0.4 %."""
    if not peer.probe():
        pytest.skip(f"{peer.label} is not installed (docs/peers.md)")
    output = tmp_path / "result.json"
    command = peer.command(case, *peer.series[case][mesh], steps, output)
    subprocess.run(command, check=True, timeout=peer.time_limit)
    result = json.loads(output.read_text())
    assert result["failed"] is None
    assert result["P"] == pytest.approx(FORCE[case][result["kinematics"]], rel=tolerance)
    assert result["iterations"] >= 2
    if case == "elastic":
        assert result["dofs"] > 1000
        assert (result.get("p0") or 0.0082) == pytest.approx(0.0082, rel=0.02)


def test_return_map_of_scikit_fems_peer(monkeypatch):
    """Stress, tangent and plastic strain are those of archord's perfectly plastic material, below
    yield and beyond."""
    monkeypatch.syspath_prepend(
        str(Path(installed.__file__).parent)
    )  # scripts find each other there
    monkeypatch.setitem(sys.modules, "skfem", ModuleType("skfem"))
    script = import_module("joint_script")
    sigy = 0.02
    strain = np.random.default_rng(1).normal(size=(40, 2, 3)) * 0.01
    stress, tangent, history = import_module("skfem_joint").return_map(
        strain, np.zeros((40, 2, 4)), sigy
    )
    material = J2Material(script.E, script.NU, "strain", LinearHardening(sigy))
    expected, modulus, state = material.update(strain.reshape(80, 3), material.state(80))
    assert 10 < np.count_nonzero(state.peeq) < 75
    np.testing.assert_allclose(
        stress.reshape(80, 3), expected[:, [0, 1, 3]], rtol=0, atol=1e-12 * sigy
    )
    np.testing.assert_allclose(tangent.reshape(80, 3, 3), modulus, rtol=0, atol=1e-12 * script.E)
    np.testing.assert_allclose(history.reshape(80, 4), state.plastic_strain, rtol=0, atol=1e-14)

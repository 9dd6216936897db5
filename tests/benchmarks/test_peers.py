"""The peers of the benchmark "error against run time": their list, and the force of the joint that each computes."""

from __future__ import annotations

import functools
import json
import subprocess
import sys
from importlib import import_module
from types import ModuleType

import numpy as np
import pytest

from archord.benchmarks.peers.installed import PEERS, Peer, installed, probe
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material

# Elastic: independent solvers of each kinematics, refined until the digits stood (README.md). Plastic: archord's for
# fixed pairs, GetFEM's and NGSolve's for closest points.
FORCE = {
    "elastic": {"reference": 0.0127596, "current": 0.0127785},
    "plastic": {"reference": 0.00668, "current": 0.006692},
}


@functools.cache
def here() -> dict[str, Peer]:
    return {peer.label: peer for peer in installed()}


def test_every_peer_has_a_series_of_growing_cost_for_both_cases():
    """Edges shrink within an order, orders grow; scripts are there and no two are called alike."""
    assert len({peer.label for peer in PEERS}) == len({peer.script for peer in PEERS}) == len(PEERS)
    for peer in PEERS:
        assert peer.script.is_file()
        assert set(peer.series) == set(FORCE)
        for meshes in peer.series.values():
            assert list(meshes) == sorted(meshes, key=lambda mesh: (mesh[1], -mesh[0]))
            assert len(set(meshes)) == len(meshes) >= 3


def test_only_what_answers_is_listed(tmp_path):
    """An interpreter that is not there, or has not the code, lists nothing; of two the first that answers is taken."""
    assert installed([str(tmp_path / "python")]) == installed(["/bin/false"]) == []
    answers = tmp_path / "python"
    answers.write_text("#!/bin/sh\necho 1.2\n")
    answers.chmod(0o755)
    found = installed(["/bin/false", str(answers), sys.executable])
    assert [(peer.label, peer.python, peer.version) for peer in found] == [
        (peer.label, str(answers), "1.2") for peer in PEERS
    ]
    command = found[0].command("plastic", 0.04, 2, 20, tmp_path / "r.json")
    assert command[:2] == [str(answers), str(PEERS[0].script)]
    assert dict(zip(command[2::2], command[3::2], strict=True)) == {
        "--case": "plastic", "--size": "0.04", "--order": "2", "--steps": "20", "--output": str(tmp_path / "r.json"),
    }  # fmt: skip


@pytest.mark.parametrize("label", [peer.label for peer in PEERS])
@pytest.mark.parametrize(
    ("case", "mesh", "steps", "tolerance"), [("elastic", 0, 2, 1e-2), ("elastic", 1, 2, 1e-3), ("plastic", 0, 20, 1e-2)]
)
def test_the_force_is_that_of_its_kinematics(tmp_path, label, case, mesh, steps, tolerance):
    """On its coarsest mesh within 1 %, on the next one within 0.1 %."""
    peer = here().get(label) or pytest.skip(f"{label} is not installed (docs/peers.md)")
    assert probe(peer, peer.python) == peer.version != ""
    output = tmp_path / "result.json"
    command = peer.command(case, *peer.series[case][mesh], steps, output)
    subprocess.run(command, check=True, timeout=peer.time_limit)
    result = json.loads(output.read_text())
    assert result["failed"] is None
    assert result["P"] == pytest.approx(FORCE[case][result["kinematics"]], rel=tolerance)
    assert result["iterations"] >= 2
    if case == "elastic":
        assert result["p0"] is None or result["p0"] == pytest.approx(0.0082, rel=0.02)
        assert result["dofs"] > 1000


def test_return_map_of_scikit_fems_peer(monkeypatch):
    """Stress, tangent and plastic strain are those of archord's perfectly plastic material, below yield and beyond."""
    monkeypatch.syspath_prepend(str(PEERS[0].script.parent))  # scripts find each other there
    monkeypatch.setitem(sys.modules, "skfem", ModuleType("skfem"))
    script, sigy = import_module("joint_script"), 0.02
    strain = np.random.default_rng(1).normal(size=(40, 2, 3)) * 0.01
    stress, tangent, history = import_module("skfem_joint").return_map(strain, np.zeros((40, 2, 4)), sigy)
    material = J2Material(script.E, script.NU, "strain", LinearHardening(sigy))
    expected, modulus, state = material.update(strain.reshape(80, 3), material.state(80))
    assert 10 < np.count_nonzero(state.peeq) < 75
    np.testing.assert_allclose(stress.reshape(80, 3), expected[:, [0, 1, 3]], rtol=0, atol=1e-12 * sigy)
    np.testing.assert_allclose(tangent.reshape(80, 3, 3), modulus, rtol=0, atol=1e-12 * script.E)
    np.testing.assert_allclose(history.reshape(80, 4), state.plastic_strain, rtol=0, atol=1e-14)

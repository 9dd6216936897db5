"""Runs that follow the plastic-Winkler law exactly, with noise on request; no solver involved."""

from __future__ import annotations

import numpy as np

from archord.benchmarks.case import E, paper_joint
from archord.postprocess.curve import RunCurve
from archord.postprocess.laws.chord_laws import plastic_winkler
from archord.postprocess.laws.general.joint import LawJoint

LOADS = np.linspace(0.1, 2.0, 20)


def curve(
    k,
    c=None,
    *,
    dR=0.005,
    sigY=None,
    R=1.0,
    modulus=1.0,
    noise=0.0,
    seed=0,
    h=0.05,
    name="run",
    analysis=None,
):
    """Steps of a joint of radius ``R`` and E* = ``modulus``; ``dR`` and ``sigY`` are relative to
    these.

    ``noise`` is the standard deviation of P/(E* dR) and of p0 R/(E* dR).
    """
    material = {"E": E * modulus} | ({"yield_stress": sigY * modulus} if sigY else {})
    joint = {"radius": R, "clearance": dR * R, "element_size": h * R}
    scene = paper_joint(joint=joint, pin=material, block=material, analysis=analysis or {})
    E_star = scene.E_star
    gap = dR * R
    delta = LOADS * gap
    law = LawJoint(
        R, gap, E_star, block_yield=sigY * modulus if c and sigY else None, k=k, c=c or 1.0
    )
    state = plastic_winkler(law, delta)
    peeq = np.maximum(delta - law.first_yield, 0.0)
    random = np.random.default_rng(seed)
    P = state.load + noise * E_star * gap * random.standard_normal(len(delta))
    p0 = state.peak_pressure + noise * E_star * gap / R * random.standard_normal(len(delta))
    return RunCurve(name, scene, delta, P, p0, np.ones(len(P)), peeq)

"""The slider-crank with clearance balances its energy through impacts. It runs where Exudyn is
installed."""

import runpy
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("exudyn")


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(Path(__file__).parents[2] / "examples" / "slider_crank.py"))


@pytest.mark.parametrize("name", ["elastic", "yielding", "paper"])
def test_the_energies_of_a_mechanism_with_clearance_balance(example, name):
    """Within 1 % of what the joint stores at most, through the impacts after a quarter of a turn;
    an elastic joint loses nothing by its law, one that yields loses more and more; friction and
    film always lose."""
    columns, memory, energies, _ = example["study"](example["laws"]()[name], steps=20000, turns=0.3)
    P = columns[7]
    stored = energies["stored"]
    lost = energies["lost, law"]
    total = sum(energies.values())
    assert np.ptp(total) < 0.01 * stored.max()
    assert ((P[1:] > 0) & (P[:-1] == 0)).sum() >= 3  # impacts
    assert np.diff(lost).min() > -1e-3 * stored.max()
    assert np.diff(energies["lost, film and friction"]).min() >= 0
    assert (lost[-1] > 0.05 * stored.max()) == (name == "yielding")
    assert np.abs(lost).max() < 1e-3 * stored.max() or name == "yielding"
    assert max(memory) > 0.3 * example["DR"] > 0.0 == min(memory)  # dents on some sides alone

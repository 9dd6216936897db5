"""Facets in space are broken where the facets of the opposite surface end; of many, each rank
breaks a share."""

from typing import Any

import numpy as np
import pytest

from archord.benchmarks.space.joints import CASES
from archord.solver.contact import surface
from archord.solver.path.system import System


def places_of_points(least: int, monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Where contact points of a joint lie, if so many facets of a rank are many."""
    monkeypatch.setattr(surface, "_MANY_FACETS", least)
    (interface,) = System(CASES["elastic"].problem(3.0)).contact.interfaces
    return [(pair.surface.facet_of_pieces, pair.surface.curve_xi) for pair in interface.pairs]


@pytest.mark.mpi
def test_shares_are_what_one_rank_breaks(monkeypatch):
    shared = places_of_points(1, monkeypatch)
    whole = places_of_points(10**9, monkeypatch)
    for (facets, xi), (all_facets, all_xi) in zip(shared, whole, strict=True):
        np.testing.assert_array_equal(facets, all_facets)
        np.testing.assert_allclose(xi, all_xi, rtol=0, atol=1e-12)


@pytest.mark.mpi
def test_a_fault_of_a_share_ends_all_ranks(comm, monkeypatch):
    """It is raised on each of them, and none waits for the others."""
    pieces_rule = surface.pieces_rule

    def faulty(*given: Any, **more: Any) -> Any:
        if comm.rank == comm.size - 1:
            raise surface.ProjectionError("a facet is folded")
        return pieces_rule(*given, **more)

    monkeypatch.setattr(surface, "pieces_rule", faulty)
    with pytest.raises(surface.ProjectionError, match="folded"):
        places_of_points(1, monkeypatch)

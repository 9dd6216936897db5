"""Contact patch tests: two blocks pressed together carry a uniform stress, whether their meshes match or not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from archord.materials.elasticity import contact_modulus
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.solver.bulk import Body, Bulk
from archord.solver.contact.contact import Contact
from archord.solver.contact.surface import ContactSide
from archord.solver.equilibrium import Support
from tests.solver.parts import (
    BASE,
    ELASTIC,
    LEFT,
    LID,
    LOWER,
    LOWER_TOP,
    NU,
    RIGHT,
    UPPER,
    UPPER_BOTTOM,
    E,
    coordinates,
    edge_nodes,
    solve,
    space,
    two_blocks,
)

DEPTH = 0.01
every_kinematics = pytest.mark.parametrize("kinematics", ["current", "reference", "tied"])
every_integration = pytest.mark.parametrize("one_sided", [None, 0, 1], ids=["both", "upper", "lower"])


class Blocks:
    """Two unit squares with ``n_lower`` and ``n_upper`` edges on their common line; the upper side comes first."""

    def __init__(self, n_lower: int, n_upper: int, lower=ELASTIC, upper=ELASTIC, **contact_options) -> None:
        mesh, cells, facets = two_blocks(MPI.COMM_SELF, n_lower, n_upper)
        self.V, self.facets = space(mesh), facets
        self.bulk = Bulk(self.V, cells, [Body(LOWER, lower), Body(UPPER, upper)])
        self.upper = ContactSide(self.V, facets, UPPER_BOTTOM, upper)
        self.lower = ContactSide(self.V, facets, LOWER_TOP, lower)
        self.contact = Contact([self.upper, self.lower], **contact_options)

    def press(self, loads=(DEPTH,)) -> np.ndarray:
        """Lid down by the loads, free to slide sideways from the left edge; returns the displacement."""
        nodes = {tag: edge_nodes(self.V, self.facets, tag) for tag in (BASE, LID, LEFT)}
        supports = [
            Support("base", 1, nodes[BASE]),
            Support("lid", 1, nodes[LID], -1.0),
            Support("left", 0, nodes[LEFT]),
        ]
        self.problem = solve(self.V, self.bulk, supports, self.contact, loads)
        self.force = -self.problem.reaction("lid")[1]
        return self.problem.displacement()

    def pressures(self) -> np.ndarray:
        """Pressure at all points of the integrated sides."""
        return np.concatenate([self.contact.state(pair.side).pressure.ravel() for pair in self.contact.pairings])


def uniform(V):
    """Pressure and displacement of two like elastic blocks in plane strain, free sideways."""
    x = coordinates(V)
    u = DEPTH / 2 * np.stack([NU / (1 - NU) * x[:, 0], -1 - x[:, 1]], axis=1)
    return contact_modulus(E, NU, "strain") * DEPTH / 2, u


@every_kinematics
@every_integration
def test_matching_meshes_pass(one_sided, kinematics):
    """Uniform pressure, linear displacement and the closed form's force, to round-off."""
    blocks = Blocks(4, 4, one_sided=one_sided, kinematics=kinematics)
    u = blocks.press()
    pressure, expected = uniform(blocks.V)
    np.testing.assert_allclose(blocks.pressures(), pressure, rtol=1e-9)
    np.testing.assert_allclose(u, expected, rtol=0, atol=1e-9 * DEPTH)
    assert blocks.force == pytest.approx(pressure, rel=1e-9)


def test_unlike_materials_slide_on_each_other():
    """Frictionless: each block widens by its own Poisson's ratio under the common pressure (reference pairs match)."""
    stiff = replace(ELASTIC, E=5 * E, nu=0.1)
    blocks = Blocks(4, 4, upper=stiff, kinematics="reference")
    u = blocks.press()
    pressure = DEPTH / sum(1 / contact_modulus(m.E, m.nu, "strain") for m in (ELASTIC, stiff))
    assert blocks.force == pytest.approx(pressure, rel=1e-9)
    np.testing.assert_allclose(blocks.pressures(), pressure, rtol=1e-9)
    right = edge_nodes(blocks.V, blocks.facets, RIGHT)
    y = coordinates(blocks.V)[right, 1]
    for m, block in ((stiff, right[y > 0.1]), (ELASTIC, right[y < -0.1])):
        np.testing.assert_allclose(u[block, 0], m.nu * (1 + m.nu) / m.E * pressure, rtol=1e-9)


@every_kinematics
def test_matching_plastic_blocks_pass(kinematics):
    """Beyond yield, with hardening: uniform pressure, stress and PEEQ."""
    plastic = J2Material(E, NU, "strain", LinearHardening(0.005, 0.1 * E))
    blocks = Blocks(3, 3, plastic, plastic, kinematics=kinematics)
    u = blocks.press(DEPTH * np.array([0.5, 1.0, 1.5]))
    fields = blocks.bulk.cell_fields(u)
    assert fields.peeq.min() > 1e-3
    assert np.ptp(fields.peeq) < 1e-8 * fields.peeq.max()
    assert np.ptp(fields.von_mises) < 1e-8 * fields.von_mises.max()
    np.testing.assert_allclose(blocks.pressures(), blocks.force, rtol=1e-8)


@every_kinematics
@every_integration
@pytest.mark.parametrize(("n_lower", "n_upper"), [(4, 7), (9, 5), (2, 7)])
def test_non_matching_meshes_pass(n_lower, n_upper, one_sided, kinematics):
    """The same on meshes that match nowhere, whichever side is integrated."""
    blocks = Blocks(n_lower, n_upper, one_sided=one_sided, kinematics=kinematics)
    u = blocks.press()
    pressure, expected = uniform(blocks.V)
    np.testing.assert_allclose(blocks.pressures(), pressure, rtol=1e-9)
    np.testing.assert_allclose(u, expected, rtol=0, atol=1e-9 * DEPTH)
    assert blocks.force == pytest.approx(pressure, rel=1e-9)


@pytest.mark.parametrize(("n_lower", "n_upper", "one_sided"), [(4, 4, None), (4, 7, None), (9, 5, 0)])
def test_a_tied_line_passes_shear_and_tension(n_lower, n_upper, one_sided):
    """Any linear displacement imposed all around leaves no force on the nodes within: the tie is not seen."""
    blocks = Blocks(n_lower, n_upper, one_sided=one_sided, kinematics="tied")
    x = coordinates(blocks.V)
    around = np.unique(np.concatenate([edge_nodes(blocks.V, blocks.facets, t) for t in (BASE, LID, LEFT, RIGHT)]))
    A = np.array([[0.3, 0.8], [-0.2, 1.0]])
    expected = x @ A.T
    supports = [Support("around", k, around, expected[around, k]) for k in range(2)]
    problem = solve(blocks.V, blocks.bulk, supports, blocks.contact, [DEPTH])
    np.testing.assert_allclose(problem.displacement(), DEPTH * expected, rtol=0, atol=1e-10 * DEPTH)


def test_frictionless_blocks_carry_no_shear_and_no_tension():
    """A lid pulled up leaves the lower block at rest; one pushed aside drags nothing along."""
    blocks = Blocks(4, 4)
    V, facets = blocks.V, blocks.facets
    lid, base = edge_nodes(V, facets, LID), edge_nodes(V, facets, BASE)
    for rates in ((0.0, 1.0), (1.0, 0.0)):
        supports = [Support("base", k, base) for k in range(2)] + [Support("lid", k, lid, rates[k]) for k in range(2)]
        u = solve(V, blocks.bulk, supports, blocks.contact, [DEPTH]).displacement()
        assert np.abs(u[coordinates(V)[:, 1] < -0.1]).max() < 1e-10 * DEPTH

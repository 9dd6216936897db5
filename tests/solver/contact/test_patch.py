"""Contact patch tests: two blocks pressed together carry a uniform stress, whether their meshes
match or not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

from archord.materials.elasticity import contact_modulus
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.output.fields import collect_fields
from archord.solver.path.mesh_order import MeshOrder
from archord.solver.problem import Body, Dirichlet, Interaction, Problem
from tests.solver.parts import ELASTIC, NU, E, blocks, coordinates, solve

DEPTH = 0.01
KINDS = {"current": {}, "reference": {"kinematics": "reference"}, "tied": {"law": "tied"}}
every_kind = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
every_integration = pytest.mark.parametrize(
    "integrated", ["", "upper bottom", "lower top"], ids=["both", "upper", "lower"]
)
PRESSED = [
    Dirichlet("base", "base", 1),
    Dirichlet("lid", "lid", 1, -1.0),
    Dirichlet("left", "left", 0),
]  # free to widen


class Blocks:
    """Two unit squares with ``n_lower`` and ``n_upper`` edges on their common line; the upper side
    comes first."""

    def __init__(
        self,
        n_lower,
        n_upper,
        lower=ELASTIC,
        upper=ELASTIC,
        loads=(DEPTH,),
        supports=PRESSED,
        **contact,
    ):
        mesh = blocks(MPI.COMM_SELF, n_lower, n_upper)
        bodies = [Body("lower", lower), Body("upper", upper)]
        joint = Interaction("joint", ("upper bottom", "lower top"), **contact)
        self.system = solve(Problem(mesh, bodies, [joint], supports), loads)
        self.V, self.u = self.system.V, self.system.equilibrium.displacement()
        self.force = -self.system.reaction("lid")[1]

    def pressures(self) -> np.ndarray:
        """Pressure at all points of the integrated sides."""
        contact = self.system.contact
        return np.concatenate([pair.pressure.ravel() for pair in contact.pairs])


def uniform(V):
    """Pressure and displacement of two like elastic blocks in plane strain, free sideways."""
    x = coordinates(V)
    u = DEPTH / 2 * np.stack([NU / (1 - NU) * x[:, 0], -1 - x[:, 1]], axis=1)
    return contact_modulus(E, NU, "strain") * DEPTH / 2, u


@every_kind
@every_integration
@pytest.mark.parametrize(("n_lower", "n_upper"), [(4, 4), (4, 7), (9, 5), (2, 7)])
def test_meshes_pass_whether_they_match_or_not(n_lower, n_upper, integrated, kind):
    """Uniform pressure, linear displacement and the closed form's force, to round-off, whichever
    side is integrated."""
    blocks = Blocks(n_lower, n_upper, integrated=integrated, **kind)
    pressure, expected = uniform(blocks.V)
    np.testing.assert_allclose(blocks.pressures(), pressure, rtol=1e-9)
    np.testing.assert_allclose(blocks.u, expected, rtol=0, atol=1e-9 * DEPTH)
    assert blocks.force == pytest.approx(pressure, rel=1e-9)


def test_unlike_materials_slide_on_each_other():
    """Frictionless: each block widens by its own Poisson's ratio under the common pressure
    (reference pairs match)."""
    stiff = replace(ELASTIC, E=5 * E, nu=0.1)
    blocks = Blocks(4, 4, upper=stiff, kinematics="reference")
    u = blocks.u
    pressure = DEPTH / sum(1 / contact_modulus(m.E, m.nu, "strain") for m in (ELASTIC, stiff))
    assert blocks.force == pytest.approx(pressure, rel=1e-9)
    np.testing.assert_allclose(blocks.pressures(), pressure, rtol=1e-9)
    x = coordinates(blocks.V)
    right = np.isclose(x[:, 0], 1)
    for m, block in ((stiff, right & (x[:, 1] > 0.1)), (ELASTIC, right & (x[:, 1] < -0.1))):
        np.testing.assert_allclose(u[block, 0], m.nu * (1 + m.nu) / m.E * pressure, rtol=1e-9)


@every_kind
def test_matching_plastic_blocks_pass(kind):
    """Beyond yield, with hardening: uniform pressure, stress and PEEQ."""
    plastic = J2Material(E, NU, "strain", LinearHardening(0.005, 0.1 * E))
    blocks = Blocks(3, 3, plastic, plastic, loads=DEPTH * np.array([0.5, 1.0, 1.5]), **kind)
    fields = collect_fields(MeshOrder(blocks.system), at_points=False)
    assert fields["peeq"].min() > 1e-3
    assert np.ptp(fields["peeq"]) < 1e-8 * fields["peeq"].max()
    assert np.ptp(fields["von_mises"]) < 1e-8 * fields["von_mises"].max()
    np.testing.assert_allclose(blocks.pressures(), blocks.force, rtol=1e-8)


@pytest.mark.parametrize(
    ("n_lower", "n_upper", "integrated"), [(4, 4, ""), (4, 7, ""), (9, 5, "upper bottom")]
)
def test_a_tied_line_passes_shear_and_tension(n_lower, n_upper, integrated):
    """Any linear displacement imposed all around leaves no force on the nodes within: the tie is
    not seen."""
    A = np.array([[0.3, 0.8], [-0.2, 1.0]])
    supports = [
        Dirichlet("around", facets, axis, lambda x, axis=axis: x @ A[axis])
        for facets in ("base", "lid", "left", "right")
        for axis in range(2)
    ]
    blocks = Blocks(n_lower, n_upper, supports=supports, law="tied", integrated=integrated)
    np.testing.assert_allclose(
        blocks.u, DEPTH * coordinates(blocks.V) @ A.T, rtol=0, atol=1e-10 * DEPTH
    )


@pytest.mark.parametrize("rates", [(0.0, 1.0), (1.0, 0.0)], ids=["pulled", "pushed aside"])
def test_frictionless_blocks_carry_no_shear_and_no_tension(rates):
    """A lid pulled up leaves the lower block at rest; one pushed aside drags nothing along."""
    supports = [Dirichlet("base", "base", k) for k in range(2)] + [
        Dirichlet("lid", "lid", k, rates[k]) for k in range(2)
    ]
    blocks = Blocks(4, 4, supports=supports)
    assert np.abs(blocks.u[coordinates(blocks.V)[:, 1] < -0.1]).max() < 1e-10 * DEPTH

"""Decks of problems in space: elements, sides and sets, read back, and solved by CalculiX."""

from __future__ import annotations

import re
from dataclasses import replace

import basix
import numpy as np
import pytest
from dolfinx.mesh import CellType
from mpi4py import MPI

import archord
from archord.benchmarks.peers.calculix import process
from archord.benchmarks.space.drawing import Size
from archord.benchmarks.space.joints import joint
from archord.benchmarks.timing import run_once
from archord.materials.elasticity import Elastic
from archord.materials.hardening import LinearHardening
from archord.materials.j2 import J2Material
from archord.postprocess.decks.deck import deck
from archord.postprocess.decks.mesh import DeckMesh, deck_mesh
from archord.postprocess.decks.numbering import numbering
from archord.presets.words import words_of
from archord.solver.path.stepping import StepRules
from archord.solver.path.system import System
from archord.solver.problem import Body, Coupling, Interaction, Load, Problem, Support
from tests.postprocess.test_deck import ccx
from tests.solver.contact.blocks_in_space import LOWER, UPPER, Box, bodies, tagged

E = 210e3
HIGH = 1.0  # of each block
PRESSED = 1e-3
TILTS = ("rotation x", "rotation y")
KINDS = pytest.mark.parametrize(
    "kind", [CellType.tetrahedron, CellType.hexahedron], ids=["tetrahedra", "hexahedra"]
)
needs_calculix = pytest.mark.skipif(
    ccx is None, reason="CalculiX is not installed (image target peers)"
)


def blocks(kind: CellType, **changes) -> Problem:
    """A block on another with the same cells, pressed down by its lid; both free to widen."""
    mesh = tagged(bodies(MPI.COMM_SELF, upper=Box(UPPER.low, UPPER.high, LOWER.cubes), kind=kind))
    parts = {
        "bodies": [Body(name, Elastic(E, 0.3)) for name in ("lower", "upper")],
        "interactions": [Interaction("joint", ("upper", "lower"))],
        "supports": [
            Support("base", fixed="z"),
            Support("left", fixed="x"),
            Support("front", fixed="y"),
        ],
        "loads": [Load("press", on="lid", direction="z", displacement=-PRESSED)],
        "steps": 1,
    }
    return Problem(mesh, **parts | changes)


def opinion(problem: Problem, folder):
    """CalculiX's results."""
    return run_once(process(words_of(problem, "mesh.msh"), folder, problem)).result


@pytest.mark.parametrize("kind", ["tetrahedron", "hexahedron"])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_mirror_keeps_sides_and_middles(kind, mirrored):
    """Nodes of a side lie on the facet that it is, and middles between the corners of an edge."""
    cell = getattr(basix.CellType, kind)
    corners = basix.geometry(cell)
    edges, facets = basix.topology(cell)[1:3]
    x = np.concatenate([corners, [corners[edge].mean(axis=0) for edge in edges]])
    found = numbering(cell, mirrored=mirrored)
    assert sorted(found.nodes) == list(range(len(x)))
    for facet, side in enumerate(found.side_of):
        on_side = x[found.on_sides[side]]
        n = len(on_side) // 2
        assert {*found.on_sides[side][:n]} == {*facets[facet]}
        following = np.roll(on_side[:n], -1, axis=0)
        np.testing.assert_allclose(on_side[n:], (on_side[:n] + following) / 2)


def volumes(mesh: DeckMesh, body: str) -> np.ndarray:
    """Volumes ``(m,)`` of parallelepipeds, or six times tetrahedra, by corners beside the first."""
    nodes = mesh.elements[body]
    beside = [1, 2, 3] if nodes.shape[1] == 10 else [1, 3, 4]
    return np.linalg.det(mesh.x[nodes[:, beside]] - mesh.x[nodes[:, :1]])


@KINDS
def test_elements_and_sides_of_blocks(kind):
    """No element is turned inside out; sides of surfaces have the area of the face, and lie on it;
    no row is longer than CalculiX reads."""
    system = System(blocks(kind))
    mesh = deck_mesh(system)
    text = deck(system, mesh, [1.0])
    is_tetra = kind == CellType.tetrahedron
    for body in ("lower", "upper"):
        of_body = volumes(mesh, body)
        assert (of_body > 0).all()
        assert of_body.sum() / (6 if is_tetra else 1) == pytest.approx(HIGH)
    for surface in mesh.surfaces.values():
        corners = mesh.x[surface.nodes[:, : 3 if is_tetra else 4]]
        np.testing.assert_allclose(mesh.x[surface.nodes][..., 2], 0, atol=1e-12)
        sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, -1] - corners[:, 0])
        area = np.linalg.norm(sides, axis=1).sum()
        assert area / (2 if is_tetra else 1) == pytest.approx(1.0)
    assert text.count("TYPE=C3D10," if is_tetra else "TYPE=C3D20R,") == 2
    assert "OUTPUT=2D" not in text
    for line in text.splitlines()[2:]:
        assert len([word for word in line.split(",") if word.strip()]) <= 16


@KINDS
def test_a_deck_in_space_is_read_back(kind, tmp_path):
    """By archord's own reader, with its bodies, surfaces and their sides."""
    problem = blocks(kind)
    path = archord.export_deck(problem, tmp_path / "blocks.inp")
    again = archord.Mesh(path).on(MPI.COMM_SELF)
    assert {"LOWER", "UPPER"} <= {*again.cell_sets}
    for name in ("LOWER_SURFACE", "UPPER_SURFACE"):
        own = problem.mesh.facets_in(name.removesuffix("_SURFACE").lower())
        assert len(again.facets_in(name)) == len(own)


@needs_calculix
@KINDS
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"interactions": [Interaction("joint", ("upper", "lower"), law="tied")]},
        {"interactions": [Interaction("joint", ("upper", "lower"), friction=0.2)]},
        {
            "bodies": [
                Body("lower", J2Material(E, 0.3, hardening=LinearHardening(80.0, 1e4))),
                Body("upper", Elastic(E, 0.3)),
            ]
        },
        {"loads": [Load("press", on="lid", direction="z", force=-100.0)]},
    ],
    ids=["frictionless", "tied", "friction", "yielding", "force"],
)
def test_calculix_solves_blocks_to_what_archord_finds(kind, changes, tmp_path):
    """The force, or the displacement of the upper block, to 0.2 %: the deck's contact gives way."""
    problem = blocks(kind, **changes)
    system = System(problem)
    system.solve([1.0], StepRules(minimum=1.0))
    found = opinion(problem, tmp_path / "calculix")
    own = system.equilibrium.displacement()[found.mesh.dofs]
    np.testing.assert_allclose(found.displacement, own, atol=2e-3 * np.abs(own).max())
    if "loads" not in changes:
        assert pytest.approx(system.drive_force("press"), rel=2e-3) == found.P


@pytest.mark.parametrize("gap", [0.0, 0.02])
def test_a_tie_over_a_gap_is_told_how_far_it_reaches(gap, tmp_path):
    """CalculiX leaves nodes loose that are farther away than 0.025 of an element, here all."""
    problem = blocks(
        CellType.tetrahedron,
        interactions=[Interaction("joint", ("upper", "lower"), law="tied")],
        loads=[Load("pull", on="lid", direction="z", displacement=PRESSED)],
    )
    mesh = problem.mesh.mesh
    upper = np.unique(mesh.geometry.dofmap[problem.mesh.cells_in("upper")])
    mesh.geometry.x[upper, 2] += gap
    system = System(problem)
    (tie,) = re.findall(r"\*TIE.*", deck(system, deck_mesh(system), [1.0]))
    reach = tie.partition("POSITION TOLERANCE=")[2]
    assert float(reach or 0.0) == pytest.approx(2 * gap)
    if ccx is None:
        pytest.skip("CalculiX is not installed (image target peers)")
    system.solve([1.0], StepRules(minimum=1.0))
    found = opinion(problem, tmp_path / "calculix")
    assert pytest.approx(system.drive_force("pull"), rel=3e-3) == found.P


def test_a_body_that_moves_as_one_is_what_others_are_tied_to(tmp_path):
    """Its nodes hang on the force already, and CalculiX leaves them loose as tied ones, with the
    whole body."""
    problem = blocks(
        CellType.tetrahedron,
        interactions=[Interaction("joint", ("upper", "lower"), law="tied")],
        supports=[Support("base")],
        loads=[Load("shear", on="upper", direction="x", force=50.0)],
    )
    system = System(problem)
    assert "\nLOWER_SURFACE, UPPER_SURFACE\n" in deck(system, deck_mesh(system), [1.0])
    if ccx is None:
        pytest.skip("CalculiX is not installed (image target peers)")
    system.solve([1.0], StepRules(minimum=1.0))
    found = opinion(problem, tmp_path / "calculix")
    own = system.equilibrium.displacement()[found.mesh.dofs]
    np.testing.assert_allclose(found.displacement, own, atol=0.05 * np.abs(own).max())


@needs_calculix
def test_calculix_presses_the_quarter_of_a_joint_with_the_same_force(tmp_path):
    """On a coarse mesh of tetrahedra of 10 nodes, at two displacements."""
    problem = replace(joint(Size(4.0)), steps=2)
    system = System(problem)
    forces = []
    for load in (0.5, 1.0):
        system.solve([load])
        forces.append(system.drive_force("press"))
    found = opinion(problem, tmp_path / "calculix")
    np.testing.assert_allclose(found.forces["press"], forces, rtol=3e-3)


@KINDS
def test_a_rigid_coupling_hangs_on_nodes_of_its_own(kind):
    """A moment about x and a force along z act on them, and nodes of the lid are equals of them."""
    problem = blocks(
        kind,
        couplings=[Coupling("grip", facets="lid", point=(0.5, 0.5, 1.0))],
        supports=[Support("base"), Support("grip", fixed=["x", "y", "rotation z"])],
        loads=[
            Load("press", on="grip", direction="z", force=-100.0),
            Load("tilt", on="grip", direction="rotation x", force=5.0),
        ],
    )
    system = System(problem)
    text = deck(system, deck_mesh(system), [1.0])
    loads = text.partition("*CLOAD\n")[2].partition("*")[0].splitlines()
    assert sorted(float(row.split(",")[2]) for row in loads) == [-100.0, 0.0, 5.0]
    n_equations = text.count("*EQUATION")
    assert n_equations >= len(problem.mesh.dofs_in(system.V, "lid"))


@pytest.mark.parametrize("length", [1e-3, 1e3])
def test_springs_of_a_deck_are_as_weak_in_any_unit(length):
    """What nothing but contact holds hangs on springs of the same part of the stiffness of the
    bodies, a modulus times a length."""

    def springs(length: float) -> list[float]:
        problem = blocks(
            CellType.tetrahedron,
            supports=[Support("base")],
            loads=[Load("press", on="upper", direction="z", force=-length * length)],
        )
        problem.mesh.mesh.geometry.x[:] *= length
        system = System(problem)
        lines = deck(system, deck_mesh(system), problem.targets).splitlines()
        at = [k for k, line in enumerate(lines) if line.startswith("*SPRING,")]
        return [float(lines[k + 2]) for k in at]

    usual = springs(1.0)
    assert len(usual) == 3
    np.testing.assert_allclose(springs(length), np.multiply(usual, length), rtol=1e-9)


def test_finite_rotations_are_refused():
    coupling = Coupling("grip", facets="lid", point=(0.5, 0.5, 1.0))
    problem = blocks(
        CellType.tetrahedron,
        couplings=[coupling],
        supports=[Support("base"), Support("grip", fixed=["x", "y", "z", *TILTS])],
        loads=[Load("turn", on="grip", direction="rotation z", displacement=0.1)],
        strain="large",
    )
    system = System(problem)
    with pytest.raises(ValueError, match="the finite rotation of 'grip' cannot be exported"):
        deck(system, deck_mesh(system), [1.0])

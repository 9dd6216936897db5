"""Prescribed displacements where sets share nodes: fixing wins, others agree or are refused, in any
order."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from mpi4py import MPI

from archord.solver.path.system import System
from archord.solver.problem import Dirichlet, Drive, Mean
from tests.solver.parts import solve
from tests.solver.test_drives import WALL, bar, drives, reference_point

PULL = {"pull": (0.0, 0.01)}
END = Dirichlet("end", "right", 0, 1.0, "pull")


def found(supports, comm=MPI.COMM_SELF, **options):
    """The drives' displacements and forces by name, and the reactions by name."""
    system = solve(bar(comm, supports, **options), [1.0])
    moved = dict(zip(system.drive_names, np.transpose(system.driven()).tolist(), strict=True))
    return moved | {
        name: system.reaction(name).tolist() for name in sorted({s.name for s in supports})
    }


@pytest.mark.mpi
def test_what_a_support_fixes_stays_whatever_moves_the_rest():
    """Also in a body that is moved as a whole; what moves it has the force that the support
    answers."""
    supports = [*WALL, Dirichlet("body", "bar", 0, 1.0, "pull")]
    for order in permutations(supports):
        problem = bar(MPI.COMM_WORLD, order, drives=drives("displacement", **PULL))
        system = solve(problem, [1.0])
        wall = problem.mesh.dofs_in(system.V, "left")
        assert not system.equilibrium.displacement()[wall].any()
        assert system.drive_force("pull") == pytest.approx(-system.reaction("wall")[0], rel=1e-9)
        assert system.drive_force("pull") > 0
        assert system.force_balance() < 1e-9
        (said,) = system.warnings
        assert said.startswith(
            "'wall' (on 'left') fixes nodes that 'body' (on 'bar') would move in x, as at (0, -1)"
        )


MOVED = [Dirichlet("top", "top", 1, 1.0, "press"), END]
LEGAL = {
    "a displacement ends at a clamp": [*WALL, *MOVED],
    "supports agree": [*WALL, Dirichlet("foot", "bottom", 0), MOVED[1]],
    "a displacement that is zero where a support is": [
        *WALL,
        Dirichlet("shear", "bottom", 0, lambda x: x[:, 0], "pull"),
        MOVED[0],
    ],
    "two sets that move alike": [*WALL, MOVED[1], Dirichlet("foot", "bottom", 0, 1.0, "pull too")],
}


@pytest.mark.mpi
@pytest.mark.parametrize("case", LEGAL)
def test_the_order_of_supports_changes_nothing(case):
    supports = LEGAL[case]
    used = {s.drive for s in supports if s.moves}
    given = [Drive(name, (0.0, 0.01)) for name in ("press", "pull", "pull too") if name in used]
    first, *others = [
        found(order, MPI.COMM_WORLD, drives=given) for order in permutations(supports)
    ]
    for other in others:
        assert other.keys() == first.keys()
        for name, values in first.items():
            np.testing.assert_allclose(other[name], values, rtol=1e-9, atol=1e-12)
    reactions = [first[name] for name in {s.name for s in supports}]
    assert np.abs(np.sum(reactions, axis=0)).max() < 1e-9 * np.abs(reactions).max()


def test_sets_that_move_alike_move_as_one_set_and_have_its_force_together():
    """The work of each is its own: forces at shared nodes are theirs in equal parts."""
    alone = found(
        [*WALL, Dirichlet("body", "bar", 0, 1.0, "pull")], drives=drives("displacement", **PULL)
    )
    paths = {"pull": (0.0, 0.01), "pull too": (0.0, 0.01, 0.01)}
    both = [Dirichlet("body", "bar", 0, 1.0, "pull"), Dirichlet("too", "bar", 0, 1.0, "pull too")]
    shared = found([*WALL, *both], drives=drives("displacement", **paths))
    assert shared["pull"] == pytest.approx([0.01, alone["pull"][1] / 2], rel=1e-9)
    assert shared["pull too"] == pytest.approx(shared["pull"], rel=1e-12)
    assert shared["wall"] == pytest.approx(alone["wall"], rel=1e-9, abs=1e-12)


def test_supports_that_fix_one_node_have_equal_parts_of_its_reaction():
    fixed = found([*WALL, END], drives=drives("displacement", **PULL))
    twice = [*WALL, *(Dirichlet("too", "left", axis) for axis in (0, 1)), END]
    halves = found(twice, drives=drives("displacement", **PULL))
    assert halves["pull"] == pytest.approx(fixed["pull"], rel=1e-12)
    for name in ("wall", "too"):
        np.testing.assert_allclose(halves[name], np.array(fixed["wall"]) / 2, rtol=1e-9, atol=1e-12)


def test_a_rigid_point_may_meet_a_support_that_leaves_it_rigid():
    """It turns about the held corner (4, 0) of the roof; about another point it would lift the
    corner."""
    roof = Dirichlet("roof", "top", 1)
    for X, fits in ((4.0, True), (3.0, False)):
        guide = [Dirichlet("end", "right", axis) for axis in (0, 1)]
        turns = [s for s in reference_point("end", "right", (X, 0.0)) if s.drive == "turn"]
        problem = bar(
            supports=[*WALL, roof, *guide, *turns], drives=drives("force", turn=(0.0, 1e-3))
        )
        if fits:
            assert solve(problem, [1.0]).drive_displacement("turn") > 0
            continue
        with pytest.raises(
            ValueError, match=r"'roof' .on 'top'. fixes the node at .4, 0. in y, which 'end'"
        ):
            System(problem)


def moves(name, facets, axis=0, rate=1.0):
    """A set moved by the drive of its own ``name``."""
    return Dirichlet(name, facets, axis, rate, name)


ALIKE = (
    r"'end' .on 'right'. and 'foot' .on 'bottom'. move their common node at .4, -1. "
    r"differently in x: leave it"
)
RIGID = (
    r"'wall' .on 'left'. fixes the node at .0, 0. in {}, which 'lid' .on 'top'. moves "
    r"together with all its set: fix"
)
REFUSED = {
    "two displacements": (
        ALIKE,
        [moves("end", "right"), moves("foot", "bottom", 0, 3.0)],
        "displacement",
    ),
    "two forces": (ALIKE, [moves("end", "right"), moves("foot", "bottom")], "force"),
    "a force on an edge that a clamp ends": (RIGID.format("y"), [moves("lid", "top", 1)], "force"),
    "a rigid point beside a clamp": (
        RIGID.format("x"),
        reference_point("lid", "top"),
        "displacement",
    ),
    "two rigid points": (
        "'foot' .on 'bottom'. and 'lid' .on 'right'. move their common node at .4, -1. differently "
        "in x",
        [
            *reference_point("lid", "right"),
            *(Dirichlet("foot", "bottom", k, 1.0, f"foot {k}") for k in (0, 1)),
        ],
        "force",
    ),
    "nothing is left to move": (
        "'a' .on 'left'. moves nothing: supports fix all its nodes in x, 'wall' .on 'left'. the "
        "one at .0, -1.; move",
        [moves("a", "left")],
        "displacement",
    ),
    "the same twice": (
        "'end' gives 'right' two rates in x by the drive 'end'",
        [moves("end", "right")] * 2,
        "displacement",
    ),
}


@pytest.mark.mpi
@pytest.mark.parametrize("case", REFUSED)
def test_supports_that_contradict_each_other_are_refused_in_any_order(case):
    said, moving, control = REFUSED[case]
    wall = [] if case in ("two forces", "two rigid points") else WALL
    given = drives(control, **{name: (0.0, 0.1) for name in sorted({s.drive for s in moving})})
    sentences = []
    for order in ([*wall, *moving], [*moving, *wall][::-1]):
        with pytest.raises(ValueError, match=said) as fault:
            System(bar(MPI.COMM_WORLD, order, drives=given))
        sentences += MPI.COMM_WORLD.allgather(str(fault.value))
    assert len({*sentences}) == 1


def test_displacements_on_different_paths_are_different():
    supports = [*WALL, moves("end", "right"), moves("foot", "bottom")]
    with pytest.raises(ValueError, match=ALIKE):
        System(
            bar(
                supports=supports,
                drives=drives("displacement", end=(0.0, 0.1), foot=(0.0, 0.05, 0.1)),
            )
        )


def test_means_that_others_decide_on_are_refused():
    """A singular system, whose forces would be any."""
    for supports, means in (
        ([*WALL], [Mean("edge", "left", 0, drive="a")]),
        ([*WALL], [Mean("edge", "right", 0, drive="a"), Mean("too", "right", 0, drive="b")]),
    ):
        given = [Drive(mean.drive, (0.0, 0.1)) for mean in means]
        with pytest.raises(ValueError, match=r"the mean motions of .* cannot be prescribed"):
            System(bar(supports=supports, means=means, drives=given))

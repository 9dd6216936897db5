"""The meshes of the scaling benchmark: the paper's joint, refined everywhere alike, on one rank and on several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from scipy.optimize import brentq

from archord.benchmarks.case import paper_joint
from archord.scene.errors import InputError
from archord.scene.geometry import JointGeometry
from archord.scene.scene import Scene

ELASTIC = (5_000, 30_000, 100_000, 300_000, 1_000_000)  # dofs
PLASTIC = (5_000, 30_000, 100_000)
UNGUIDED = {False: (30_000, 100_000), True: (30_000,)}  # dofs by whether plastic
WEAK = (30_000, 100_000, 300_000)  # dofs per rank
ELASTIC_STEPS, PLASTIC_STEPS = 2, 5
YIELD_STRESS = 0.002  # over E*
_COARSEST = {"element_size": 0.04, "growth": 0.25}  # both are scaled, so that the meshes are alike
_SCALES = 0.045, 2.0  # of those; growth then stays within its limits
_DOFS_PER_CELL = 4.15  # expected, of fine meshes: two nodes a triangle, and gmsh makes a few more of them


@dataclass(frozen=True)
class Case:
    """The joint with about ``dofs`` unknowns, elastic or ``plastic``, on ``ranks`` ranks.

    ``weak``: only to compare with a mesh smaller by the number of ranks; not ``guided``: to show what a coarse start
    saves.
    """

    dofs: int
    ranks: int
    plastic: bool = False
    weak: bool = False
    guided: bool = True

    @property
    def name(self) -> str:
        """Material, size and ranks, and whether there is no coarse start."""
        material, alone = "plastic" if self.plastic else "elastic", "" if self.guided else "_unguided"
        return f"{material}_{self.dofs}_on_{self.ranks}{alone}"

    def scene(self) -> Scene:
        """The joint to solve."""
        size, growth = refined(self.dofs)
        steps, strength = (PLASTIC_STEPS, YIELD_STRESS) if self.plastic else (ELASTIC_STEPS, None)
        joint, analysis = {"element_size": size, "growth": growth}, {"coarse_start": self.guided}
        return paper_joint(size, steps, strength, joint=joint, analysis=analysis)


def refined(dofs: float) -> tuple[float, float]:
    """Element size on the arcs, over R, and growth of a mesh with about ``dofs`` unknowns."""

    def excess(scale: float) -> float:
        sizes = {name: scale * value for name, value in _COARSEST.items()}
        # without its checks, which refuse meshes beyond the wanted one
        cells = JointGeometry.model_construct(radius=1.0, clearance=0.005, **sizes).expected_cells
        return _DOFS_PER_CELL * cells - dofs

    scale = brentq(excess, *_SCALES, rtol=1e-6)
    return scale * _COARSEST["element_size"], scale * _COARSEST["growth"]


def cases(largest: float, ranks: Sequence[int]) -> list[Case]:
    """All runs up to ``largest`` dofs, the smallest first: every size on every number of ``ranks``, the weak series on
    several, the plastic series and runs without a coarse start on one.

    Raises `InputError` if no size is left, or ``ranks`` do not begin with 1.
    """
    if largest < ELASTIC[0]:
        raise InputError(f"--largest {largest:g}: must be at least {ELASTIC[0]}, the dofs of the smallest mesh.")
    if not ranks or ranks[0] != 1 or sorted(set(ranks)) != list(ranks):
        raise InputError(
            f"--ranks {','.join(map(str, ranks))}: must be numbers of ranks that rise from 1, like 1,2, as everything "
            "is compared with one rank."
        )
    sizes = [n for n in ELASTIC if n <= largest]
    chosen = [Case(n, r) for n in sizes for r in ranks]
    chosen += [
        Case(n * r, r, weak=True)
        for n in WEAK
        for r in ranks[1:]
        if n * r <= largest and n * r not in sizes and n in sizes
    ]
    chosen += [Case(n, 1, plastic=True) for n in PLASTIC if n <= largest]
    chosen += [Case(n, 1, plastic, guided=False) for plastic, sizes in UNGUIDED.items() for n in sizes if n <= largest]
    return sorted(chosen, key=lambda case: case.dofs * (PLASTIC_STEPS if case.plastic else 1))

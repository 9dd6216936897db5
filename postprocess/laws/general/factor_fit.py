"""What friction and large strain do to joints, from joints that were solved with one of them and
without, by least squares of the logarithms of P, p0 and eps over those without.

    python3 -m archord.studies.factor_design > factor.sweep.toml
    mpirun -n 2 archord sweep factor.sweep.toml
    python3 -m archord.postprocess.laws.general.factor_fit runs/factor

Every fifth joint is predicted by the other joints: these errors make the expected error, and are
printed.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from archord.materials.kinematics import Bools
from archord.materials.material import Array, Arrays
from archord.postprocess.laws.general.elastic_model import elastic_model
from archord.postprocess.laws.general.factor_model import (
    FRICTION,
    LARGE_STRAIN,
    N_TERMS,
    TABLE,
    Plain,
    factor_model,
)
from archord.postprocess.laws.general.general_law import NODES, joint_numbers, within_range
from archord.postprocess.laws.general.hardening_model import block_leads, flows
from archord.postprocess.laws.general.joint import LawJoint
from archord.postprocess.laws.general.law_fit import (
    FITTED,
    JUDGED,
    NodeRun,
    rms_largest,
    solved_joints,
    within,
)
from archord.report.by_name import Amounts, ByName
from archord.report.files import read_json
from archord.report.table import Table, in_digits

_PARTS = 5  # of the joints, each of which the other parts predict
_WITHIN = 0.93  # share of errors that the expected error is to contain
_LITTLE = 0.1  # lost to a block that leads
_LIKELY = 3.0  # size of coefficients
_SCATTER = 0.01  # of ln P, against which that counts


@dataclass(frozen=True)
class Changed:
    """A ``joint`` that was solved ``without`` and ``with_`` friction or large strain: nodes ``(k,
    4)`` as `NodeRun` has them; ``back`` and ``back_without`` ``(j, 2)`` are x and y of the way
    back with and without it, from the deepest point on."""

    joint: LawJoint
    without: Array
    with_: Array
    back: Array
    back_without: Array

    @classmethod
    def of(cls, joint: LawJoint, without: NodeRun, with_: NodeRun) -> Changed:
        """The joint of two runs to the same displacements."""
        loading = slice(without.loading)
        inside = within(without.nodes[loading, 0], FITTED)
        return cls(
            joint,
            without.nodes[loading][inside],
            with_.nodes[loading][inside],
            with_.back,
            without.back,
        )

    @property
    def usual(self) -> Bools:
        """Which nodes are in the range that is judged."""
        x = self.without[:, 0]
        return within(x, JUDGED)

    @property
    def added(self) -> Array:
        """``ln(P/P_0)``, and the same of p0 and eps, at the nodes ``(3, k)``."""
        return np.log(self.with_[:, 1:] / self.without[:, 1:]).T

    @property
    def kind(self) -> str:
        """What it was solved with."""
        return FRICTION if self.joint.friction else LARGE_STRAIN

    @property
    def plain(self) -> Plain:
        """What decides it, as it was solved without."""
        numbers = within_range(joint_numbers(self.joint))
        x, y, _, angle = self.without.T
        elastic = numbers.elastic
        lost = np.log(y / elastic_model().at(elastic, x).y)
        leads = block_leads(numbers, flows(self.joint), x)
        return Plain(numbers.plane, self.joint.friction, elastic, x, NODES[1], angle, lost, leads)

    @property
    def way_changed(self) -> Array:
        """What it changes in P on the way back, over the largest P."""
        with_ = self.back[:, 1] / self.back[0, 1]
        without = self.back_without[:, 1] / self.back_without[0, 1]
        return (with_ - without)[1:]


def changed_in(folder: Path) -> list[Changed]:
    """The pairs of runs of the sweep in ``folder``."""
    solved = solved_joints(folder)
    pairs = []
    for joint, (run, *_) in solved.items():
        bare = replace(joint, friction=0.0, large_strain=False)
        if bare != joint and bare in solved:
            pairs.append(Changed.of(joint, solved[bare][0], run))
    return pairs


def planes_of(joints: list[Changed]) -> list[str]:
    """The planes in which ``joints`` were solved."""
    return sorted({joint.joint.plane or "" for joint in joints})


def fit_gain(joints: list[Changed]) -> Arrays:
    """The coefficients of `Plain.terms` ``(3, N_TERMS)`` by plane; each joint counts alike."""
    found = {}
    for plane in planes_of(joints):
        rows = [np.eye(N_TERMS) / _LIKELY]
        right = [np.zeros((N_TERMS, 3))]
        for joint in joints:
            plain = joint.plain
            if plain.plane == plane:
                weight = 1 / (_SCATTER * np.sqrt(len(plain.x) / _PARTS))
                rows.append(weight * (plain.scale(joint.kind) * plain.terms()).T)
                right.append(weight * joint.added.T)
        values, *_ = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right))
        found[plane] = values.T
    return found


def predicted(joints: list[Changed]) -> Iterator[tuple[Changed, Array]]:
    """Each joint, and what is `Changed.added` as the other parts of the joints give it."""
    for part in range(_PARTS):
        others = [joint for i, joint in enumerate(joints) if i % _PARTS != part]
        model = fit_gain(others)
        for joint in joints[part::_PARTS]:
            plain = joint.plain
            yield joint, plain.scale(joint.kind) * (model[plain.plane] @ plain.terms())


def errors_of(joints: list[Changed]) -> tuple[dict[str, list[float]], Table]:
    """The numbers of the expected error by plane; and the errors from 0.1 to 2 dR, in per cent, of
    what friction or large strain does to joints that the others predict, beside the rms and the
    largest of what it does."""
    told = list(predicted(joints))
    factors = {}
    quantities = [f"{name}{what}" for name in ("P", "p0", "eps") for what in ("", ", error")]
    table = Table("plane", "joints", *quantities, "P inside", left=1)
    for plane in planes_of(joints):
        members = [(joint, said) for joint, said in told if joint.plain.plane == plane]
        added = np.concatenate([joint.added[:, joint.usual] for joint, _ in members], axis=1)
        said = np.concatenate([said[:, joint.usual] for joint, said in members], axis=1)
        off = said - added
        plain = [joint.plain for joint, _ in members]
        usual = [joint.usual for joint, _ in members]
        kind = members[0][0].kind
        scale = _joined([own.scale(kind) for own in plain], usual)
        leading = _joined([np.abs(own.lost_to_leading) for own in plain], usual)
        factors[plane] = _expected(np.abs(off[0]) / scale, leading)
        expected = _joined([own.deviation(kind, factors[plane]) for own in plain], usual)
        inside = np.abs(off[0]) <= expected
        cells = [rms_largest(100 * row) for pair in zip(added, off, strict=True) for row in pair]
        table.add(plane, len(members), *cells, f"{inside.mean():.0%}")
    return factors, table


def _joined(values: list[Array], chosen: list[Bools]) -> Array:
    """The ``chosen`` values of all joints."""
    return np.concatenate([own[at] for own, at in zip(values, chosen, strict=True)])


def _expected(off: Array, leading: Array) -> list[float]:
    """The numbers for `Plain.deviation` that errors ``off`` over the scale keep, where ``leading``
    is lost to a block that leads."""
    leads = leading > _LITTLE
    usual = np.quantile(off[~leads], _WITHIN)
    left = np.sqrt(np.maximum(off[leads] ** 2 - usual**2, 0.0)) / leading[leads]
    more = np.quantile(left, _WITHIN) if leads.any() else 0.0
    return [in_digits(value, 3) for value in (usual, more)]


def back_factors(joints: list[Changed]) -> Amounts:
    """The factors of the expected error on the way back by plane: the law lets P fall there as
    without friction or large strain."""
    factors = {}
    for plane in planes_of(joints):
        shares = []
        for joint in joints:
            plain = joint.plain
            if plain.plane == plane and len(joint.back) > 1:
                shares.append(np.abs(joint.way_changed) / plain.scale(joint.kind)[-1])
        factors[plane] = in_digits(np.quantile(np.concatenate(shares), _WITHIN), 3)
    return factors


def store(kind: str, model: ByName) -> None:
    """Write the ``model`` of this ``kind`` beside this file, and use it from now on. Of a plane
    that it leaves out the numbers stay."""
    table = read_json(TABLE)
    table[kind] = {name: table[kind][name] | of_planes for name, of_planes in model.items()}
    TABLE.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    factor_model.cache_clear()


def main(folder: Path) -> None:
    """Fit to the sweep in ``folder``, write the table beside this file, and print how good it is,
    for each kind of its joints."""
    solved = changed_in(folder)
    for kind in sorted({joint.kind for joint in solved}):
        print(f"{kind}\n\n{fit_kind([joint for joint in solved if joint.kind == kind])}\n")


def fit_kind(joints: list[Changed]) -> str:
    """Fit to ``joints`` of one kind and write the table beside this file; how good it is."""
    factors, errors = errors_of(joints)
    gains = {
        plane: [[in_digits(value, 5) for value in row] for row in values]
        for plane, values in fit_gain(joints).items()
    }
    store(joints[0].kind, {"gain": gains, "error": factors, "back error": back_factors(joints)})
    return errors.markdown()


if __name__ == "__main__":
    main(Path(sys.argv[1]))

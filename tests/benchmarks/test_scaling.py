"""The scaling benchmark concludes what its numbers say."""

import csv

import pytest

from archord.benchmarks.cost import scaling
from archord.benchmarks.cost.scaling import (
    PARTS,
    SIZES,
    Setting,
    cost_of,
    exponent,
    refined,
    settings,
    unlike,
)
from archord.benchmarks.timing import Process, Run, Timing
from archord.cli import run


@pytest.mark.parametrize("power", [0.5, 1.0, 1.3])
def test_a_power_law_has_its_exponent(power):
    sizes = [5e3, 3e4, 1e6]
    assert exponent(sizes, [3.7 * n**power for n in sizes]) == pytest.approx(power, rel=1e-12)


def test_every_size_runs_on_every_number_of_ranks():
    """Meshes are refinements of one, which have about as many dofs as is said."""
    found = settings(1e6, 2)
    assert {(s.dofs, s.ranks) for s in found if s.material == "elastic"} == {
        (n, r) for n in SIZES for r in (1, 2)
    }
    assert [(s.dofs, s.ranks) for s in found if s.material == "plastic"] == [
        (5_000, 1),
        (30_000, 1),
        (100_000, 1),
    ]
    assert {s.ranks for s in settings(30_000, 5)} == {1, 2, 4}
    assert max(s.dofs for s in settings(30_000, 1)) == 30_000
    for dofs, size in SIZES.items():
        joint = refined(size, 2).joint
        assert joint.h / joint.growth == pytest.approx(0.16)
        assert 4.15 * joint.expected_cells == pytest.approx(dofs, rel=1e-3)


def test_a_force_that_depends_on_the_ranks_is_told():
    """Also one that is not a number; other materials and sizes are not compared."""
    one = {"name": "a", "material": "elastic", "dofs": 5000, "ranks": 1, "P": 0.0128}
    others = [
        one | {"name": name, "ranks": 2, "P": P}
        for name, P in (("b", 0.0128), ("c", 0.0129), ("d", float("nan")))
    ]
    assert unlike([one, *others, one | {"name": "e", "dofs": 6000, "ranks": 2, "P": 1.0}]) == [
        "c: P differs by 7.8e-03 from that on 1 rank",
        "d: P differs by nan from that on 1 rank",
    ]


def test_the_cost_is_that_of_the_run_in_the_middle():
    """Seconds by part sum up to the time from outside."""
    report = {
        "seconds": {"mesh": 1.0, "contact": 0.5, "assemble contact": 0.5, "checkpoint": 0.25},
        "peak_memory": [1],
    }
    report |= {"totals": {"newton_iterations": 1, "factorisations": 1}, "mesh": {"dofs": 5000}}
    report |= {"model": {"E_star": 2.0}, "steps": [{"P": 1.0, "coarse_iterations": 3}]}
    found = cost_of(
        Setting(5000, 1),
        Timing(Process("a", (), None), [Run(s, s, 0, report) for s in (9.0, 5.0, 7.0)]),
    )
    assert (found["total"], found["P"], found["coarse iterations"]) == (7.0, 0.5, 3)
    assert (found["parts"]["contact"], found["parts"]["rest"]) == (1.0, 4.75)
    assert set(found["parts"]) == {*PARTS, "rest"}


def test_the_command_writes_its_table(tmp_path, capsys, monkeypatch):
    """Of real runs on one rank: no part is negative, and little is in no part. A run that fails is
    told."""
    monkeypatch.setattr(scaling, "SIZES", {5_000: 0.1})
    monkeypatch.setattr(scaling, "PLASTIC_STEPS", 2)
    assert run(["benchmark", "scaling", "--ranks", "1", "-o", str(tmp_path), "-q"]) == 0
    assert {"scaling.csv", "scaling.md", "scaling.png"} <= {p.name for p in tmp_path.iterdir()}
    with (tmp_path / "scaling.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["material"] for row in rows] == ["elastic", "plastic"]
    for row in rows:
        parts = [float(row[f"{part} [s]"]) for part in (*PARTS, "rest")]
        assert min(parts) >= 0
        assert sum(parts) == pytest.approx(float(row["total [s]"]), abs=0.1)
        assert float(row["rest [s]"]) < 0.5 * float(row["total [s]"])
        assert int(row["factorisations"]) <= int(row["iterations"])
    monkeypatch.setattr(scaling, "PLASTIC_LARGEST", 0)
    monkeypatch.setattr(scaling, "launcher", lambda ranks: ["false"])
    assert run(["benchmark", "scaling", "--ranks", "1", "-o", str(tmp_path), "-q"]) == 1
    assert "archord: elastic_5000_on_1: ended with code 1." in capsys.readouterr().err

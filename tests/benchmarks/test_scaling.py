"""The scaling benchmark concludes what its numbers say."""

import csv
from dataclasses import replace
from functools import cache

import pytest

from archord.benchmarks.cost import scaling
from archord.benchmarks.cost.scaling import ELASTIC, PARTS, Cost, Costs, Setting, cost_of, process, refined, settings
from archord.benchmarks.cost.scaling_report import exponent, goals, markdown
from archord.benchmarks.timing import Run, Timing, time_all
from archord.cli import run
from archord.scene.errors import InputError


def cost(dofs: int, ranks: int = 1, *, solve: float = 10.0, contact: float = 0.5, **options) -> Cost:
    """A made-up run of 2 s and the seconds of these parts."""
    seconds = {part: 0.25 for part in PARTS} | {"linear solve": solve, "contact": contact, "rest": 0.25}
    plastic = options.pop("plastic", False)
    return Cost(Setting(dofs, ranks, plastic), dofs=dofs, total=sum(seconds.values()), seconds=seconds,
                memory=[100 * dofs] * ranks, iterations=10, factorisations=8, evaluations=12, force=0.0128,
                **options)  # fmt: skip


@pytest.mark.parametrize("power", [0.5, 1.0, 1.3])
def test_a_power_law_has_its_exponent(power):
    sizes = [5e3, 3e4, 1e6]
    assert exponent(sizes, [3.7 * n**power for n in sizes]) == pytest.approx(power, rel=1e-12)


@pytest.mark.parametrize("dofs", [20_000, 100_000, 1_000_000])
def test_meshes_of_the_series_are_alike(dofs):
    """Element size over growth is the same, so that a quarter of the dofs is twice the size everywhere."""
    size, growth = refined(dofs)
    assert size / growth == pytest.approx(0.04 / 0.25, rel=1e-12)
    assert refined(dofs / 4)[0] / size == pytest.approx(2, rel=0.1)


def test_every_size_runs_on_every_number_of_ranks():
    found = settings(1e6, [1, 2])
    assert {(c.dofs, c.ranks) for c in found if not c.plastic} == {(n, r) for n in ELASTIC for r in (1, 2)}
    assert [(c.dofs, c.ranks) for c in found if c.plastic] == [(5_000, 1), (30_000, 1), (100_000, 1)]
    assert all(c.scene().joint.expected_cells <= 1e6 for c in found)
    assert max(c.dofs for c in settings(30_000, [1])) == 30_000


@pytest.mark.parametrize(("largest", "ranks", "said"), [(100, [1], "--largest 100"), (1e6, [2], "--ranks 2"),
                                                         (1e6, [1, 1], "--ranks 1,1")])  # fmt: skip
def test_what_cannot_be_compared_is_refused(largest, ranks, said):
    with pytest.raises(InputError, match=said):
        settings(largest, ranks)


def test_ranks_take_turns_and_the_median_counts(monkeypatch, tmp_path):
    """Where the speed-up is asked for, every number of ranks is solved several times."""
    seconds, rounds = {1: [9.0, 5.0, 7.0], 2: [8.0, 3.0, 4.0]}, []
    counted = ("newton_iterations", "factorisations", "residual_evaluations")
    report = {"seconds": {}, "mesh": {"dofs": 10**6}, "peak_memory": [1], "totals": dict.fromkeys(counted, 1)}
    report |= {"model": {"E_star": 1.0}, "steps": [{"P": 1.0, "coarse_iterations": 0}]}

    def timed(processes, repeats):
        rounds.append(repeats)
        ranks = [2 if "mpirun" in process.command else 1 for process in processes]
        return [Timing(p, [Run(s, s, 0, report) for s in seconds[r]]) for p, r in zip(processes, ranks, strict=True)]

    monkeypatch.setattr(scaling, "time_all", timed)
    monkeypatch.setattr(scaling, "settings", lambda largest, ranks: [Setting(10**6, 1), Setting(10**6, 2)])
    found = scaling.run(1e6, [1, 2], tmp_path, 1)
    assert rounds == [1, scaling.ROUNDS]
    assert [c.total for c in found] == [7.0, 4.0]
    assert cost_of(Setting(10**6, 1), Timing(process(Setting(10**4, 1), tmp_path), [], "no")).fault == "no"


def test_goals_follow_the_numbers():
    """Too steep, too much contact, a run that failed and a force that depends on the ranks are told."""
    good = Costs([cost(5_000), cost(10**6, solve=200.0), cost(5_000, 2), cost(10**6, 2, solve=100.0)])
    assert [met for _, _, met in goals(good)] == [True] * 6
    assert not good.faults()
    bad = [
        cost(5_000),
        cost(50_000, solve=1e3, contact=500.0),
        cost(5_000, 2, contact=9.0),
        Cost(Setting(50_000, 2), fault="exit code 3: no"),
    ]
    assert [met for _, _, met in goals(Costs(bad))] == [False, True, False, False, False]
    assert Costs(bad).faults() == ["elastic_50000_on_2: exit code 3: no"]
    shifted = Cost(**{**vars(cost(5_000, 2)), "force": 0.0129})
    assert "P differs" in Costs([cost(5_000), shifted]).faults()[0]
    assert "50000" in markdown(Costs(bad))


def test_the_parts_of_a_run_are_its_time(tmp_path):
    """A real run: no part is negative, they sum up to the time from outside, and little is in no part."""
    setting = Setting(3_000, 1)
    (timing,) = time_all([process(setting, tmp_path)], 1)
    found = cost_of(setting, timing)
    assert not found.fault
    assert min(found.seconds.values()) >= 0
    assert sum(found.seconds.values()) == pytest.approx(found.total, rel=1e-12)
    assert found.seconds["rest"] < 0.5 * found.total
    assert found.factorisations <= found.iterations < found.evaluations
    (slow,) = [replace(run, seconds=2 * run.seconds) for run in timing.runs]
    again = cost_of(setting, Timing(timing.process, [slow]))
    assert again.seconds["rest"] == pytest.approx(found.seconds["rest"] + found.total, rel=1e-9)


def test_the_command_writes_its_table(tmp_path, capsys, monkeypatch):
    """Of the smallest meshes, here those of its first, untimed runs, which then need no second one."""
    for name in ("ELASTIC", "PLASTIC"):
        monkeypatch.setattr(scaling, name, (3_000,))
    monkeypatch.setattr(scaling, "PLASTIC_STEPS", 2)
    once = cache(lambda process, repeats: time_all([process], repeats)[0])
    place = {}  # one process object a scene, so that none is solved twice
    monkeypatch.setattr(
        scaling,
        "time_all",
        lambda processes, repeats: [once(place.setdefault(p.command, p), 1) for p in processes],
    )
    assert run(["benchmark", "scaling", "--largest", "5000", "--ranks", "1", "-o", str(tmp_path), "-q"]) == 0
    assert {"scaling.csv", "scaling.md", "scaling.png"} <= {p.name for p in tmp_path.iterdir()}
    with (tmp_path / "scaling.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["material"] for row in rows] == ["elastic", "plastic"]
    assert all(2_000 < int(row["dofs"]) < 5_000 and not row["fault"] for row in rows)
    assert run(["benchmark", "scaling", "--ranks", "1;2", "-o", str(tmp_path)]) == 2
    assert "--ranks 1;2: must be whole numbers" in capsys.readouterr().err

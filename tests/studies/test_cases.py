"""What a sweep file expands to: laws of counting, sampling and naming, before anything is
solved."""

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from archord.report.errors import InputError
from archord.scene.file import load_scene, resolved
from archord.scene.sections.errors import toml_value
from archord.studies.cases import (
    DEFAULTS,
    LatinHypercube,
    SweepFile,
    combinations,
    factors,
    load_sweep,
    read_sweep,
    run_name,
    samples,
)
from archord.studies.sweep import part_of

SCENES = Path(__file__).parents[2] / "scenes"
DOCS = SCENES.parent / "docs"
ELASTIC = str(SCENES / "elastic_pin.toml")
OF_SWEEPS = [f"{key}={toml_value(value)}" for key, value in DEFAULTS.items()]


def written(folder: Path, text: str, base: str = ELASTIC) -> Path:
    path = folder / "some.sweep.toml"
    path.write_text(f'base = "{base}"\n{text}' if base else text)
    return path


def faults(folder: Path, text: str, base: str = ELASTIC, overrides=()) -> list[str]:
    path = written(folder, text, base)
    with pytest.raises(InputError) as caught:
        read_sweep(path, overrides)
    return str(caught.value).replace(f"{path}: ", "FILE: ").splitlines()


def test_everything_is_multiplied(tmp_path):
    """As many cases as the product of all lengths, all different, the last factor varying
    fastest."""
    varied = {
        "grid": {"joint.radius": [1, 2], "load.steps": [1, 2, 3]},
        "zip": {"pin.E": [1, 2, 3], "pin.nu": [1, 2, 3]},
        "list": [{"block.E": 1}, {"block.E": 2}],
        "latin_hypercube": {"number": 4, "ranges": {"block.nu": [0.0, 0.5]}},
    }
    rows = combinations(factors(SweepFile.model_validate({"base": {}} | varied)))
    assert len(rows) == 2 * 3 * (2 * 3) * 4
    order = [
        tuple(row[key] for key in ("block.E", "pin.E", "joint.radius", "load.steps"))
        for row in rows
    ]
    assert order == sorted(order)
    assert len({(*first, row["block.nu"]) for first, row in zip(order, rows, strict=True)}) == len(
        rows
    )
    assert all(row["pin.E"] == row["pin.nu"] for row in rows)
    assert len(read_sweep(written(tmp_path, "")).cases) == 1


@settings(max_examples=20, deadline=None)
@given(
    number=st.integers(1, 40),
    seed=st.integers(0, 2**31),
    low=st.floats(1e-3, 1.0),
    factor=st.floats(1.5, 1e3),
)
def test_every_stratum_of_a_range_holds_one_sample(number, seed, low, factor):
    """On a linear and on a logarithmic scale; the same seed gives the same samples, another one
    others."""
    ends = {"from": low, "to": low * factor}
    ranges = {"joint.radius": ends, "joint.clearance": {**ends, "scale": "log"}}

    def drawn(seed: int) -> list:
        return samples(
            LatinHypercube.model_validate({"number": number, "seed": seed, "ranges": ranges})
        )

    rows = drawn(seed)
    linear, log = (np.array([row[key] for row in rows]) for key in ranges)
    for share in ((linear - low) / (low * (factor - 1)), np.log(log / low) / math.log(factor)):
        # rounded to nine digits, a sample may lie on the edge of its stratum
        assert (np.abs(np.sort(share * number) - np.arange(number) - 0.5) <= 0.5 + 1e-5).all()
    assert rows == drawn(seed) != drawn(seed + 1)


def test_a_heading_has_the_unit_of_its_key():
    """Forces are per unit thickness unless the scene has one."""
    scene = load_scene(ELASTIC)
    assert scene.heading("load.force") == "load.force [E* R]"
    thick = scene.model_copy(
        update={"analysis": scene.analysis.model_copy(update={"thickness": 10.0})}
    )
    assert thick.heading("load.force") == "load.force [E* R2]"


def test_overrides_mean_what_set_means(tmp_path):
    """A case's scene is the base's with --set, alternatives and absent keys included."""
    text = """
        [[list]]
        pin.rigid = true
        joint.relative_clearance = 0.01
        [[list]]
        "block.yield_stress" = 0.002
        [[list]]
        load.displacement = "none"
        load.relative_force = [0.001, 0.002]
    """
    options = [
        ["pin.rigid=true", "joint.relative_clearance=0.01"],
        ["block.yield_stress=0.002"],
        ["load.displacement=none", "load.relative_force=[0.001, 0.002]"],
    ]
    found = read_sweep(written(tmp_path, text)).cases
    assert [resolved(case.scene) for case in found] == [
        resolved(load_scene(ELASTIC, [*some, *OF_SWEEPS])) for some in options
    ]
    text = '[grid]\nblock.yield_stress = ["none", 300.0]'
    plastic = read_sweep(written(tmp_path, text, str(SCENES / "steel_pin.toml")))
    assert [case.scene.block.yield_stress for case in plastic.cases] == [None, 300.0]
    assert all(case.scene.pin.yield_stress for case in plastic.cases)


def test_identical_scenes_are_one_run(tmp_path):
    """However they are written; a scene's name depends on nothing but its content."""
    text = (
        "list = [{ block.hardening = 0 }, { block.hardening = 0.0 }]\n[grid]\njoint.clearance = "
        "[0.005, 5e-3, 0.006]"
    )
    sweep = read_sweep(written(tmp_path, text))
    assert (len(sweep.cases), len(sweep.distinct)) == (6, 2)
    assert [case.number for case in sweep.distinct] == [1, 3]
    assert sweep.cases[0].run == run_name(
        load_scene(ELASTIC, ["joint.clearance=0.005", *OF_SWEEPS])
    )
    assert len({run_name(load_scene(ELASTIC, [f"load.steps={n}"])) for n in range(1, 20)}) == 19


def test_runs_of_version_0_1_have_the_names_that_they_had():
    """Read off a run folder of 0.1: sweeps that it began go on."""
    assert run_name(load_scene(SCENES / "steel_pin.toml")) == "4bccb21874f0"


def test_the_resolved_file_gives_the_same_cases(tmp_path):
    """From another folder, too, though a path of the base counts from the base's folder."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes" / "targets.csv").write_text("displacement\n0.5\n1\n")
    base = tomllib.loads(Path(ELASTIC).read_text())
    base["load"] = {"path": "targets.csv"}
    (tmp_path / "other.csv").write_text("relative_force\n0.001\n")
    path = tmp_path / "scenes" / "base.toml"
    path.write_text(tomli_w.dumps(base))
    text = """
        [grid]
        load.path = ["other.csv"]
        [zip]
        pin.E = [1.0, 2.0]
        [latin_hypercube]
        number = 3
        ranges = { "joint.clearance" = { from = 0.001, to = 0.01, scale = "log" } }
    """
    sweep = read_sweep(written(tmp_path, text, "scenes/base.toml"))
    assert {case.scene.load.kind for case in sweep.cases} == {"relative_force"}
    unchanged = read_sweep(written(tmp_path, "", "scenes/base.toml"))
    assert unchanged.cases[0].scene.load.stages == [0.5, 1.0]
    for number, one in enumerate((sweep, unchanged)):
        folder = tmp_path / f"elsewhere{number}"
        folder.mkdir()
        (folder / "sweep.toml").write_text(one.file.resolved())
        again = read_sweep(folder / "sweep.toml")
        assert [(c.number, c.run) for c in again.cases] == [(c.number, c.run) for c in one.cases]
        assert again.keys == one.keys


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "gird = 3",
            "gird = 3: is not a known key; keys are base, list, zip, grid, latin_hypercube.",
        ),
        ("[grid]\njoint.clearance = 1", "grid.joint.clearance = 1: must be a list."),
        (
            "[grid]\nclearance = [1]",
            "[grid] clearance: must read section.key, like joint.clearance.",
        ),
        (
            "[grid]\njoint.relative_clearence = [0.002, 0.005]",
            "[grid] joint.relative_clearence: there is no key joint.relative_clearence; did you "
            "mean joint.relative_clearance?",
        ),
        (
            "grid.units.length = ['m']",
            "[grid] units.length: cannot vary; all cases of a table have the same units.",
        ),
        (
            "[zip]\npin.E = [1, 2]\npin.nu = [0]",
            "zip: must hold lists of one length, but pin.E has 2, pin.nu has 1.",
        ),
        (
            "[grid]\njoint.clearance = [0.1]\n[[list]]\njoint.relative_clearance = 0.1",
            "[grid] joint.clearance: is varied by [[list]] joint.relative_clearance already.",
        ),
        (
            "latin_hypercube = { number = 0, sed = 1, ranges = { pin.nu = [0.3, 0.1] } }",
            "latin_hypercube.number = 0: must be at least 1.\n"
            "latin_hypercube.ranges.pin.nu = [0.3, 0.1]: must have a from that is less than its "
            "to.\n"
            "latin_hypercube.sed = 1: is not a known key.",
        ),
        (
            "latin_hypercube = { number = 2, ranges = { pin.nu = [0.3] } }",
            "latin_hypercube.ranges.pin.nu = [0.3]: must be [low, high], or a table with from and "
            "to.",
        ),
        (
            '[latin_hypercube]\nnumber = 2\nranges = { "pin.nu" = { from = 0, to = 1, scale = '
            '"log" } }',
            'latin_hypercube.ranges.pin.nu: must have a positive from where scale = "log".',
        ),
        (
            'latin_hypercube = { number = 2, ranges = { pin.E = ["a", 1.0], pin.nu = [0.1, nan] } '
            "}",
            'latin_hypercube.ranges.pin.E.from = "a": must be a number.\n'
            "latin_hypercube.ranges.pin.nu.to = NaN: must be a finite number.",
        ),
        (
            "[grid]\nload.steps = [1, 1.5]\npin.E = [1.82, -1.0]",
            "case 2 and 1 more: pin.E = -1.0 must be greater than 0.\n"
            "case 3 and 1 more: load.steps = 1.5 must be a whole number.",
        ),
        ("[[list]]\nblock.nu = 0.7", "every case: block.nu = 0.7 must be at most 0.499999."),
        (
            f"[grid]\npin.E = {[1.0] * 400}\nload.steps = {[1] * 400}",
            "has 160000 cases; 100000 are allowed.",
        ),
    ],
)
def test_faults_are_told_in_a_sentence(tmp_path, text, said):
    """File, key, value, and what is allowed; each fault once, however many cases have it."""
    assert sorted(faults(tmp_path, text)) == [f"FILE: {fault}" for fault in said.splitlines()]


def test_of_many_faults_the_first_are_told(tmp_path):
    said = faults(tmp_path, "[latin_hypercube]\nnumber = 30\nranges = { load.steps = [5, 6] }")
    assert len(said) == 21
    assert said[0].startswith("FILE: case 1: load.steps = 5.")
    assert said[-1] == "FILE: has 10 more faults."


def test_a_base_is_needed(tmp_path):
    assert faults(tmp_path, "", "") == ["FILE: base: is missing."]
    assert faults(tmp_path, "base = 3", "") == ["FILE: base = 3: must be a table."]
    said = f"{tmp_path}/nowhere.toml: cannot be read: No such file or directory."
    assert faults(tmp_path, "", "nowhere.toml") == [said]


def test_examples_are_sound(tmp_path):
    """Of the scenes' folder and of the documentation."""
    text = re.search(r"```toml\n(base = .*?)```", (DOCS / "sweeps.md").read_text(), re.DOTALL)[1]
    documented = tmp_path / "all.sweep.toml"
    documented.write_text(text.replace("steel_pin.toml", str(SCENES / "steel_pin.toml")))
    files = {
        documented: 240,
        SCENES / "clearance.sweep.toml": 9,
        SCENES / "stiffness.sweep.toml": 24,
        SCENES / "steels.sweep.toml": 24,
    }
    for file, number in files.items():
        sweep = read_sweep(file)
        assert len(sweep.cases) == len(sweep.distinct) == number


def test_a_sweep_asks_for_less_than_a_scene_unless_it_says_so(tmp_path):
    """No contact.h5, no checkpoint, no fields, a wider tolerance; what is solved already stays
    so."""

    def asked(file: Path, *overrides: str) -> tuple[float, bool, bool]:
        scene = read_sweep(file, overrides).cases[0].scene
        assert bool(scene.output.fields) == scene.output.contact
        return scene.analysis.tolerance, scene.output.contact, scene.output.checkpoint

    file = written(tmp_path, "[grid]\njoint.clearance = [0.005, 0.006]")
    assert asked(file) == (1e-6, False, False)
    assert asked(file, "analysis.tolerance=1e-8") == (1e-8, False, False)
    assert asked(file, "analysis.tolerance=none", "output.contact=true", "output.fields=true")[
        :2
    ] == (1e-10, True)
    folder = tmp_path / "solved"
    (folder / "cases").mkdir(parents=True)
    (folder / "sweep.toml").write_text(load_sweep(file).resolved())
    assert asked(folder / "sweep.toml") == (1e-6, False, False)
    base = tomllib.loads(Path(ELASTIC).read_text())
    (folder / "sweep.toml").write_text(tomli_w.dumps({"base": base}))
    assert asked(folder / "sweep.toml") == (1e-10, True, True)
    varied = written(tmp_path, "[grid]\noutput.checkpoint = [true]")
    assert asked(varied) == (1e-6, False, True)


def test_set_changes_the_base_but_nothing_that_varies(tmp_path):
    text = "[grid]\njoint.clearance = [0.005, 0.006]"
    sweep = read_sweep(written(tmp_path, text), ["load.steps=3"])
    assert [case.scene.load.steps for case in sweep.cases] == [3, 3]
    for key in ("joint.clearance", "joint.relative_clearance"):
        said = faults(tmp_path, text, overrides=[f"{key}=0.1"])
        assert said == [f"FILE: --set {key}: is varied by [grid] joint.clearance already."]


def test_scenes_and_sweeps_are_told_apart(tmp_path):
    with pytest.raises(
        InputError, match=r"\A.* is a scene, not a sweep; solve it by archord solve.*\Z"
    ):
        read_sweep(ELASTIC)
    for name in ("lug", "bushing"):
        with pytest.raises(InputError, match=r"\A[^\n]*: is a scene, not a sweep; [^\n]*\.\Z"):
            read_sweep(SCENES / f"{name}.toml")
    sweep = written(tmp_path, "[grid]\npin.E = [1.0]")
    with pytest.raises(InputError) as told:
        load_scene(sweep)
    assert str(told.value) == f"{sweep}: is a sweep, not a scene; archord sweep solves it."


def test_the_parts_of_an_array_are_the_whole(tmp_path):
    """Every case in one part, and the parts take about as long."""
    text = (
        "[grid]\njoint.relative_element_size = [0.3, 0.1, 0.05]\nload.steps = [1, 2, 3, 4, 5, 6, "
        "7, 8]"
    )
    cases = read_sweep(written(tmp_path, text)).cases
    parts = [part_of(cases, f"{i}/3") for i in (1, 2, 3)]
    assert sorted(case.number for part in parts for case in part) == [case.number for case in cases]
    cost = [sum(case.scene.expected_seconds for case in part) for part in parts]
    assert max(cost) < 1.2 * min(cost)
    with pytest.raises(InputError, match="--array 0/3: must be I/N"):
        part_of(cases, "0/3")

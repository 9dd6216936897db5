"""Metals by name: the tables are those of the formulas, the formulas those of their sources."""

import re

import numpy as np
import pytest

from archord.benchmarks.case import paper_joint
from archord.materials.hardening import TabularHardening
from archord.materials.named import metal, metals


def quad_linear(fy: float, fu: float, E: float) -> np.ndarray:
    """Yun and Gardner (2017): points (strain, stress) of hot-rolled steel, engineering."""
    at_fu = max(0.6 * (1 - fy / fu), 0.06)
    at_hardening = min(max(0.1 * fy / fu - 0.055, 0.015), 0.03)
    kink = at_hardening + 0.25 * (at_fu - at_hardening)  # C1 times the strain at fu
    slope = (fu - fy) / (0.4 * (at_fu - at_hardening))  # from the strain C2 times that at fu
    strain = np.array(
        [fy / E, *np.linspace(at_hardening, kink, 3), *np.linspace(kink, at_fu, 5)[1:]]
    )
    stress = np.interp(
        strain,
        [fy / E, at_hardening, kink, at_fu],
        [fy, fy, fy + slope * (kink - at_hardening), fu],
    )
    return np.stack([strain, stress], axis=1)


def exponent(f: float, fu: float, strain: float) -> float:
    """Ramberg and Osgood's n through 0.2 % at the stress ``f`` and ``strain`` at ``fu``."""
    return np.log(strain / 0.002) / np.log(fu / f)


def at_strength(f: float) -> float:
    """EN 1999-1-1, annex E: strain at the strength of an aluminium alloy whose proof strength is
    below 400 MPa."""
    return 0.30 - 0.22 * f / 400


def ramberg_osgood(f: float, n: float, E: float, last: float) -> np.ndarray:
    """Points (strain, stress) of plastic strains from 1e-4 to ``last``: ``strain = s/E + 0.002
    (s/f)^n``."""
    plastic = np.array([1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1])
    plastic = np.append(plastic[plastic < last], last)
    stress = f * (plastic / 0.002) ** (1 / n)
    return np.stack([plastic + stress / E, stress], axis=1)


@pytest.mark.parametrize("name", metals())
def test_tables_are_those_of_the_formulas(name):
    """To the digits printed; true stress over PEEQ, the first point at the stress of first yield
    itself."""
    m = metals()[name]
    f = m["yield"]
    fu = m["tensile"]
    if name.startswith("S"):
        points = quad_linear(f, fu, m["E"])
    else:
        strain = at_strength(f) if "EN 1999" in m["source"] else m["elongation"]
        points = ramberg_osgood(f, exponent(f, fu, strain), m["E"], m["elongation"])
    peeq, stress = np.array(TabularHardening.from_engineering(points, m["E"]).points).T
    stress[0] = points[0, 1]
    table = TabularHardening(tuple(map(tuple, m["hardening"])))
    found = np.array(table.points).T
    assert np.abs(found[0] - peeq).max() <= 0.5e-6 + 1e-12
    assert np.abs(found[1] - stress).max() <= 0.5e-2 + 1e-9
    assert points[-1, 1] <= fu * (1 + 1e-12)


@pytest.mark.parametrize(
    ("f", "fu", "n"),
    [(110, 270, 5), (140, 170, 24), (160, 195, 24), (240, 260, 55), (225, 270, 25), (200, 280, 14)],
)
def test_the_exponent_is_that_of_the_standard(f, fu, n):
    """EN 1999-1-1, table 3.2b: 5083-O, 6060-T6, 6063-T6, 6061-T6, 6005A-T6, 5083-H12."""
    assert exponent(f, fu, at_strength(f)) == pytest.approx(n, abs=0.55)


SCALES = {
    "MPa": 1.0,
    "N/mm2": 1.0,
    "Pa": 1e6,
    "kPa": 1e3,
    "GPa": 1e-3,
    "psi": 145.03773773,
    "ksi": 0.14503773773,
}


@pytest.mark.parametrize(("unit", "scale"), SCALES.items())
def test_stresses_are_in_the_unit_asked_for(unit, scale):
    found = metal("S355", unit)
    m = metals()["S355"]
    assert (found["E"], found["nu"], found["yield"]) == pytest.approx(
        (210000 * scale, 0.3, 355 * scale)
    )
    assert found["tensile"] == pytest.approx(470 * scale)
    assert np.array(found["hardening"]) == pytest.approx(np.array(m["hardening"]) * [1, scale])


@pytest.mark.parametrize(
    ("name", "unit", "said"),
    [
        (
            "S335",
            "MPa",
            r"is not a known material; did you mean S355\? Materials are S235, .*, C63000$",
        ),
        ("cheese", "MPa", "is not a known material; materials are S235"),
        (
            "S355",
            "bar",
            "needs a units.stress that is one of MPa, N/mm2, Pa, kPa, GPa, psi, ksi, not bar",
        ),
    ],
)
def test_unknown_names_and_units_are_refused(name, unit, said):
    with pytest.raises(ValueError, match=said):
        metal(name, unit)


# yield and tensile strength [MPa], and elongation, of the standards: see docs/materials.md
NOMINAL = {
    "S235": (235, 360, None),
    "S275": (275, 410, None),
    "S355": (355, 470, None),
    "S420": (420, 520, None),
    "S460": (460, 540, None),
    "6082-T6": (260, 310, 0.10),
    "5083-H116": (215, 305, 0.10),
    "CuSn12-C": (150, 300, 0.06),
    "Ti-6Al-4V": (827, 896, 0.10),  # 120 and 130 ksi
    "7075-T6": (470, 540, 0.07),
    "7075-T651": (470, 540, 0.06),
    "7050-T7451": (441, 510, 0.10),  # 64 and 74 ksi
    "2024-T3": (290, 435, 0.14),
    "4340": (1496, 1793, 0.10),  # 217 and 260 ksi
    "300M": (1517, 1862, 0.08),  # 220 and 270 ksi
    "17-4PH-H900": (1172, 1310, 0.10),  # 170 and 190 ksi
    "17-4PH-H1025": (1000, 1069, 0.12),  # 145 and 155 ksi
    "Inconel-718": (1034, 1276, 0.12),  # 150 and 185 ksi
    "C63000": (469, 758, 0.10),  # 68 and 110 ksi
}


@pytest.mark.parametrize("name", metals())
def test_every_metal_has_the_numbers_of_its_standard_and_tells_its_sources(name):
    """The thickness too, on which they depend, but of what is cast; of E and nu, which they do not
    ask for, whose."""
    m = metals()[name]
    assert (m["yield"], m["tensile"], m.get("elongation")) == NOMINAL[name]
    assert m["E"] > 0
    assert 0.27 <= m["nu"] <= 0.34
    assert "thick" in m["title"] or "cast" in m["title"]
    assert re.fullmatch(
        r"strengths: least (\(A basis\) )?of (EN|AMS|MMPDS).*; E, nu: (EN|typical).*; curve: .*",
        m["source"],
    )


def test_a_scene_resolves_a_name_to_these_numbers():
    """E, nu, yield stress and points of S355 in a body, and a material that yields there first."""
    block = paper_joint(block={"material": "S355", "E": None, "nu": None}).block
    assert (block.E, block.nu, block.yield_stress) == (210000.0, 0.3, 355.0)
    law = block.constitutive("strain").hardening
    assert law.points == tuple(map(tuple, metals()["S355"]["hardening"]))
    assert law.stress(np.array([0.0, 1.0])) == pytest.approx([355.0, 539.0])


@pytest.mark.parametrize(
    ("name", "ksi"), [(n, (m["yield"], m["tensile"])) for n, m in metals().items()]
)
def test_strengths_listed_in_ksi_are_those_of_the_source(name, ksi):
    """A source that names them, "(74 and 64 ksi)", has them to half a MPa."""
    if found := re.search(r"\((\d+) and (\d+) ksi\)", metals()[name]["source"]):
        said = sorted(float(value) * 6.894757 for value in found.groups())
        assert said == pytest.approx(sorted(ksi), abs=0.6)


@pytest.mark.parametrize("name", [name for name in metals() if not name.startswith("S")])
def test_straight_lines_are_close_to_the_model(name):
    """As near as docs/materials.md says, beyond PEEQ 2e-4."""
    m = metals()[name]
    f = m["yield"]
    last = m["elongation"]
    n = exponent(f, m["tensile"], at_strength(f) if "EN 1999" in m["source"] else last)
    plastic = np.geomspace(2e-4, last, 1000)
    stress = f * (plastic / 0.002) ** (1 / n)
    strain = plastic + stress / m["E"]
    true = stress * (1 + strain)
    peeq = np.log1p(strain) - true / m["E"]
    table = TabularHardening(tuple(map(tuple, m["hardening"])))
    off = np.abs(table.stress(peeq) / true - 1)[peeq > 2e-4]
    assert off.max() < {"CuSn12-C": 0.017, "C63000": 0.012}.get(name, 0.009)

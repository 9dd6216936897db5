"""The pages: their links lead somewhere, their first hour works, and they build as a site."""

import re
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

import archord
from tests.forked import archord as archord_in_a_fork

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
BUILDERS = ("sphinx", "myst_parser", "furo")
# without collections of garbage, which take a fifth of the time
SPHINX = """
import gc, sys
gc.disable()
from sphinx.cmd.build import main
sys.exit(main(sys.argv[1:]))
"""


def code(page: str, language: str) -> list[str]:
    """The blocks of a page in a language."""
    return re.findall(rf"```{language}\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), re.S)


def anchors(page: Path) -> set[str]:
    """What GitHub calls a page's headings."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    headings = (
        re.sub(r"[^\w\- ]", "", line.lower()) for line in re.findall(r"^#+ (.*)$", text, re.M)
    )
    return {heading.strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_the_links_of_a_page_lead_somewhere(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    for link in re.findall(r"\]\(([^)\s]+)\)", text):
        parts = urlsplit(link)
        if parts.scheme:
            continue
        target = (page.parent / parts.path).resolve() if parts.path else page
        assert target.exists(), link
        assert not parts.fragment or parts.fragment in anchors(target), link


def test_readme_is_short_and_its_scene_and_program_are_right():
    assert len((ROOT / "README.md").read_text(encoding="utf-8").splitlines()) <= 80
    [program] = code("README.md", "python")
    compile(program, "README.md", "exec")
    assert "scenes/steel_pin.toml" in program


def test_readme_lists_the_file_that_it_names_and_its_law_can_be_exported(tmp_path):
    """To the letter; also with metals by name."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    [file] = re.findall(r"A scene is a short TOML file \(\[(\S+)\]", text)
    [listed] = code("README.md", "toml")
    assert listed.strip() == (ROOT / file).read_text(encoding="utf-8").strip()
    [words] = re.findall(r"^    docker/run archord (law .*--export \S+)", text, re.M)
    law = words.replace("scenes/", f"{ROOT}/scenes/").split()
    assert archord_in_a_fork(*law, cwd=tmp_path).returncode == 0
    assert (tmp_path / "joint.h").exists()
    metal = ["--set", "pin.material=S355", "--set", "block.material=S235", "--force"]
    before = (tmp_path / "joint.h").read_text(encoding="utf-8")
    assert archord_in_a_fork(*law, *metal, cwd=tmp_path).returncode == 0
    assert (tmp_path / "joint.h").read_text(encoding="utf-8") != before


@pytest.mark.parametrize(
    ("page", "displacement"), [("README.md", 2.0), ("docs/tutorial.md", (2.0, 0.0))]
)
def test_the_scene_of_a_page_is_a_scene(page, displacement, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(code(page, "toml")[0], encoding="utf-8")
    assert archord.load_scene(file).load.displacement == pytest.approx(displacement)


def test_the_tutorials_law_says_in_c_what_the_tutorial_says(tmp_path):
    """Each number of the last line of the program to 5 %, as the law may be fitted to more
    joints."""
    scene, *_ = code("docs/tutorial.md", "toml")
    [program] = code("docs/tutorial.md", "c")
    (tmp_path / "bolt.toml").write_text(scene, encoding="utf-8")
    (tmp_path / "impact.c").write_text(program, encoding="utf-8")
    law = ["law", "--scene", "bolt.toml", "--export", "bolt_pin.h"]
    assert archord_in_a_fork(*law, cwd=tmp_path).returncode == 0
    for command in (["gcc", "-O2", "impact.c", "-lm", "-o", "impact"], ["./impact"]):
        said = subprocess.run(
            command, cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout
    text = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    number = r"\d+\.?\d*"
    [printed] = re.findall(r"^    (largest force \d.*)$", text, re.M)
    assert re.sub(number, "#", said.strip()) == re.sub(number, "#", printed)
    found, expected = ([*map(float, re.findall(number, line))] for line in (said, printed))
    assert found == pytest.approx(expected, rel=0.05)


def test_the_tutorials_ball_is_solved_as_the_tutorial_says(tmp_path):
    """Its mesh, coarser, its scene, in fewer steps, and its field and measure."""
    [drawing] = code("docs/tutorial.md", "text")
    _, scene, _ = code("docs/tutorial.md", "toml")
    [program] = [text for text in code("docs/tutorial.md", "python") if "triaxiality" in text]
    text = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
    [mesh] = re.findall(r"^    docker/run python3 -c '(.*?)'$", text, re.M | re.S)
    (tmp_path / "ball.geo").write_text(drawing.replace("near = 0.04", "near = 0.3"), "utf-8")
    steps = scene.replace("-2000.0", "-200.0").replace("[10, 5]", "[1, 1]")
    (tmp_path / "ball.toml").write_text(steps, encoding="utf-8")
    for words in (mesh, program):
        said = subprocess.run(
            [sys.executable, "-c", words], cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout
    assert "mean pressure" in said
    run = archord.load(tmp_path / "runs" / "own_ball")
    assert run.history["bottom z"].iloc[0] == pytest.approx(200.0, rel=1e-3)
    assert run.fields(step=1).cell["triaxiality"].min() < 0


def test_every_public_name_is_in_the_reference():
    shown = re.findall(
        r"^\.\. auto\w+:: archord\.(\w+)$",
        (ROOT / "docs" / "api.md").read_text(encoding="utf-8"),
        re.M,
    )
    assert set(shown) == set(archord.__all__)


class _Links(HTMLParser):
    """The links and the anchors of an HTML page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.names |= {given[key] for key in ("id", "name") if given.get(key)}
        self.links |= {given[key] for key in ("href", "src") if given.get(key)}


def test_the_site_builds_and_its_links_lead_somewhere(tmp_path):
    if missing := [name for name in BUILDERS if find_spec(name) is None]:
        pytest.skip(f"the site is not built: {', '.join(missing)} missing (pip install '.[docs]').")
    build = [sys.executable, "-c", SPHINX, "-W", "--keep-going", "-q", "docs", str(tmp_path)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    pages = {page: _Links(page.read_text(encoding="utf-8")) for page in tmp_path.rglob("*.html")}
    assert {page.stem for page in (ROOT / "docs").rglob("*.md")} <= {page.stem for page in pages}
    for page, found in pages.items():
        for link in found.links:
            parts = urlsplit(link)
            assert "//" not in link or parts.scheme in ("http", "https"), link
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            if parts.scheme or page.name in ("genindex.html", "search.html"):
                continue
            assert target.exists(), f"{page.name}: {link}"
            if parts.fragment and target in pages:
                assert parts.fragment in pages[target].names, f"{page.name}: {link}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_and_programs_fit_in_the_column_of_the_site(page):
    """What is to be typed; what was printed goes on in the next line."""
    text = page.read_text(encoding="utf-8")
    fenced = "\n".join(re.findall(r"```(?:python|toml|sh|c)\n(.*?)```", text, re.S)).splitlines()
    typed = re.findall(r"^    ((?:docker/run|archord|mpirun|ARCHORD_\w+=\S+) .*)$", text, re.M)
    assert [
        line for line in [*fenced, *typed] if len(line) > 92 and not line.startswith("archord: ")
    ] == []


def test_the_tutorials_lug_in_space_is_the_scene_of_that_name():
    *_, scene = code("docs/tutorial.md", "toml")
    file = ROOT / "scenes" / "lug_in_space.toml"
    assert tomllib.loads(scene) == tomllib.loads(file.read_text(encoding="utf-8"))

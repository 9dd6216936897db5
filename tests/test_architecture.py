"""The house: rooms in layers, arrows one way, everything installed."""

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
# A room a line, from the ground up: a room imports from those above its line in this list, and from
# itself.
ROOMS = [
    "report",
    "kernels",
    "materials",
    "geometry",
    "geometry.meshes",
    "geometry.meshes.formats",
    "geometry.shapes",
    "scene.sections",
    "scene.presets",
    "scene",
    "solver.contact.laws",
    "solver.contact",
    "solver.linear",
    "solver.bulk",
    "solver",
    "solver.equilibrium",
    "solver.path",
    "measures",
    "presets",
    "output.files",
    "output",
    "postprocess.arrays",
    "postprocess.probes",
    "postprocess",
    "postprocess.judgement",
    "postprocess.pictures",
    "postprocess.laws.general",
    "postprocess.laws",
    "postprocess.laws.identification",
    "postprocess.laws.exports",
    "postprocess.laws.page",
    "postprocess.decks",
    "studies",
    "benchmarks",
    "benchmarks.paper",
    "benchmarks.stability",
    "benchmarks.peers",
    "benchmarks.axisymmetric",
    "benchmarks.outside",
    "benchmarks.space",
    "benchmarks.cost",
    "commands",
    "archord",
]

DATA = (".py", ".c", ".h", ".toml", ".json", ".npz", ".csv", ".mjs", ".html", ".css")

FE = ["dolfinx", "petsc4py", "mpi4py", "basix", "ufl", "gmsh"]
# What else a room must not import, beside the rooms below its line.
BANNED = {
    "report": [*FE, "archord"],
    "materials": FE,
    "scene.sections": FE,
    "scene.presets": FE,
    "scene": FE,
    "output.files": FE,
    "solver": ["archord.scene", "archord.presets"],
    "solver.equilibrium": ["archord.scene", "archord.presets"],
    "solver.path": ["archord.scene", "archord.presets"],
    "solver.contact.laws": [*FE, "archord.scene"],
    "solver.contact": ["archord.scene"],
    "solver.linear": ["archord.scene"],
    "solver.bulk": ["archord.scene"],
    "postprocess.laws": [*FE, "archord.solver", "archord.benchmarks"],
    "postprocess.laws.general": [*FE, "archord.solver", "archord.benchmarks"],
    "postprocess.laws.identification": [*FE, "archord.solver", "archord.benchmarks"],
    "postprocess.laws.exports": [*FE, "archord.solver", "archord.benchmarks"],
    "postprocess.laws.page": [*FE, "archord.solver", "archord.benchmarks"],
    "postprocess": ["archord.benchmarks"],
}


def room_of(module: str) -> str:
    """The room of a module's dotted name (without ``archord.``): the longest name in the list that
    it begins with."""
    fitting = [r for r in ROOMS if module == r or module.startswith(f"{r}.")]
    return max(fitting, key=len, default="archord")


def files_of(room: str) -> list[Path]:
    return sorted((ROOT / room.replace(".", "/")).glob("*.py"))


@cache
def tree_of(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


@cache
def imports_in(file: Path) -> list[ast.Import | ast.ImportFrom]:
    """The imports, wherever in the file."""
    nodes = ast.walk(tree_of(file))
    return [node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom)]


def for_type_checking(file: Path) -> set[ast.AST]:
    """The statements of a file that only type checkers read."""
    checks = (
        node
        for node in tree_of(file).body
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    )
    return {statement for check in checks for statement in check.body}


def imported(file: Path) -> set[str]:
    """The rooms that a file imports from, wherever in the file but for type checking; ``import
    archord`` alone, for the version, is none."""
    names = []
    for node in imports_in(file):
        if node in for_type_checking(file):
            continue
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif node.module:
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    return {room_of(name.removeprefix("archord.")) for name in names if name.startswith("archord.")}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_from_those_below_it(room):
    above = set(ROOMS[ROOMS.index(room) + 1 :])
    assert files_of(room)
    assert not {file.name: rooms for file in files_of(room) if (rooms := imported(file) & above)}


@pytest.mark.parametrize("room", BANNED)
def test_a_room_imports_nothing_that_it_must_do_without(room):
    for file in files_of(room):
        nodes = imports_in(file)
        names = {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}
        names |= {
            alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names
        }
        banned = {
            name for name in names for ban in BANNED[room] if f"{name}.".startswith(f"{ban}.")
        }
        assert not banned, file


def test_rooms_that_use_dolfinx_import_what_must_come_before_it():
    """PyPI's dolfinx finds no MPI unless the package that `archord.kernels.compat` imports came
    first. Scripts for peers need nothing of archord, and theirs is Debian's dolfinx."""
    for room in ROOMS[:-1]:
        trees = [tree_of(file) for file in files_of(room)]
        at_top = [node for tree in trees for node in tree.body]
        names = {node.module for node in at_top if isinstance(node, ast.ImportFrom) and node.module}
        packages = {name.partition(".")[0] for name in names}
        needs_none = room in ("kernels", "benchmarks.peers")
        if not needs_none and packages & {"dolfinx", "petsc4py"}:
            parents = [ROOT / room.replace(".", "/"), ROOT / room.partition(".")[0]]
            assert any(
                "import archord.kernels.compat" in (path / "__init__.py").read_text()
                for path in parents
            ), room


def test_no_imports_at_the_top_of_files_make_a_circle():
    known = {
        f"archord.{file.relative_to(ROOT).with_suffix('').as_posix().replace('/', '.')}"
        for room in ROOMS
        for file in files_of(room)
    }
    graph = {}
    for name in known:
        tree = tree_of(ROOT / f"{name.removeprefix('archord.').replace('.', '/')}.py")
        froms = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.module]
        graph[name] = {f"{f.module}.{a.name}" for f in froms for a in f.names} | {
            f.module for f in froms
        }
        graph[name] &= known
    TopologicalSorter(graph).prepare()  # raises CycleError


def test_only_presets_ask_whether_a_scene_is_the_papers_joint():
    """All scenes and their views tell the same things, so that no one else has to ask."""
    asking = re.compile(r"isinstance\(.*\bScene\b")
    files = [file for room in ROOMS if room != "presets" for file in files_of(room)]
    assert not [file for file in files if asking.search(file.read_text(encoding="utf-8"))]


def test_the_plan_of_the_house_names_every_room_and_lists_every_file():
    """The list of docs/rooms.py is made of docstrings: each begins with a sentence."""
    listed = subprocess.run(
        [sys.executable, ROOT / "docs" / "rooms.py"], capture_output=True, text=True, check=True
    ).stdout
    parts = dict(re.findall(r"\*\*`([\w/]+)/`\*\*\n\n((?:- .*\n)+)", listed))
    said = {room.replace("/", "."): lines for room, lines in parts.items()}
    assert set(ROOMS) <= said.keys()
    for room in ROOMS:
        files = {file.name for file in files_of(room)} - {"__init__.py"}
        assert set(re.findall(r"^- `(\w+\.py)`: \S", said[room], re.M)) == files


def test_every_folder_with_code_is_a_room():
    folders = {path.parent.relative_to(ROOT) for path in ROOT.rglob("*/__init__.py")}
    others = {"tests", "archord", ".cache", "build"}
    rooms = {".".join(folder.parts) for folder in folders if folder.parts[0] not in others}
    assert rooms == set(ROOMS) - {"archord"}
    assert {link.name for link in (ROOT / "archord").iterdir() if link.is_symlink()} == {
        r for r in rooms if "." not in r
    }


def test_every_file_that_names_the_version_names_the_same():
    said = {
        "report/version.py": r'VERSION = "(.*)"',
        "pyproject.toml": r'^version = "(.*)"',
        "CITATION.cff": r"^version: (.*)",
        "conda/recipe.yaml": r'^  version: "(.*)"',
        "CHANGELOG.md": r"^## (\d.*)",
    }
    found = {
        file: re.search(regex, (ROOT / file).read_text(encoding="utf-8"), re.M)
        for file, regex in said.items()
    }
    assert len({match and match[1] for match in found.values()}) == 1, found


def test_every_seeded_fault_has_its_text_once_and_its_tests():
    """A fault whose code was rewritten can no longer be seeded: see docs/development."""
    listed = ROOT / "docs" / "development" / "seeded_faults.toml"
    for fault in tomllib.loads(listed.read_text(encoding="utf-8"))["fault"]:
        text = (ROOT / fault["file"]).read_text(encoding="utf-8")
        assert text.count(fault["old"]) == 1, fault["name"]
        assert all((ROOT / tests).exists() for tests in fault["tests"]), fault["name"]


def test_the_requirements_name_all_that_is_imported():
    """petsc4py comes with dolfinx, which PyPI, conda and Debian call differently."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    required = [*project["dependencies"], *extras["solve"], *extras["plots"]]
    names = (re.split(r"[^\w-]", word)[0] for word in required)
    named = {name.removeprefix("fenics-").replace("-", "_") for name in names}
    rooms = [
        room for room in ROOMS if not room.startswith("benchmarks")
    ]  # peers have environments of their own
    nodes = [node for room in rooms for file in files_of(room) for node in imports_in(file)]
    names = [node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module]
    names += [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    used = {name.partition(".")[0] for name in names} - sys.stdlib_module_names - {"archord"}
    assert used - named == {"dolfinx", "dolfinx_solver", "petsc4py"}


def test_an_installation_has_all_data_and_tells_type_checkers_that_archord_is_typed(tmp_path):
    """Kernels, tables, scenes and the marker py.typed (PEP 561) of the checkout, each in its
    package."""
    build = ["build", "--build-base", f"{tmp_path}/build", "--build-lib", f"{tmp_path}/lib"]
    command = [
        sys.executable,
        "-c",
        "import setuptools; setuptools.setup()",
        "-q",
        "egg_info",
        "--egg-base",
        tmp_path,
    ]
    subprocess.run([*command, *build], cwd=ROOT, check=True, capture_output=True)
    for room in ROOMS:
        folder = ROOT / room.replace(".", "/")
        wanted = {path for path in folder.iterdir() if path.suffix in DATA}
        place = tmp_path / "lib" / "archord" / ("" if room == "archord" else room.replace(".", "/"))
        assert not {path.name for path in wanted if not (place / path.name).is_file()}
    assert (tmp_path / "lib" / "archord" / "py.typed").is_file()

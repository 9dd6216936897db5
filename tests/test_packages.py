"""The packages of the project: each listed wherever packages are, each importing only from those below it."""

import ast
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
FOLDERS = {name: ROOT / folder for name, folder in PROJECT["package-dir"].items()}
ORDER = ("kernels", "geometry", "materials", "solver", "postprocess", "results", "sweep", "benchmarks", "archord")
COMMAND_LINE_FUZZER = ROOT / "benchmarks" / "fuzz.py"  # runs the command line, which is what it tests


def imported(file: Path) -> set[str]:
    """The packages of archord that a file imports from, wherever in the file; ``archord`` is the command line's.

    ``import archord`` alone, for the version, is none.
    """
    names = []
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            names += [f"{node.module}.{alias.name}" for alias in node.names]
    parts = [name.split(".")[1] for name in names if name.startswith("archord.")]
    return {part if part in ORDER else "archord" for part in parts}


@pytest.mark.parametrize("package", ORDER)
def test_a_package_imports_only_from_those_below_it(package):
    files = {file for file in (ROOT / package).glob("*.py") if file != COMMAND_LINE_FUZZER}
    above = {file.name: imported(file) & set(ORDER[ORDER.index(package) + 1 :]) for file in files}
    assert files
    assert not {name: packages for name, packages in above.items() if packages}


def test_every_package_is_listed_wherever_packages_are():
    folders = {file.parent.name for file in ROOT.glob("*/__init__.py")} - {"tests"}
    assert folders == set(ORDER) == {folder.name for folder in FOLDERS.values()}
    assert set(PROJECT["packages"]) == set(FOLDERS)
    loop = re.search(r"for p in ([\w ]+);", (ROOT / "docker" / "Dockerfile").read_text(encoding="utf-8"))
    typed = re.search(r"check mypy ([\w ]+)", (ROOT / ".ci" / "run").read_text(encoding="utf-8"))
    assert set(loop[1].split()) == set(typed[1].split()) == folders


def test_an_installation_has_all_data_and_tells_type_checkers_that_archord_is_typed(tmp_path):
    """Kernels, tables, scenes and the marker py.typed (PEP 561) of the checkout, each in its package."""
    build = ["build", "--build-base", f"{tmp_path}/build", "--build-lib", f"{tmp_path}/lib"]
    command = [sys.executable, "-c", "import setuptools; setuptools.setup()", "-q", "egg_info", "--egg-base", tmp_path]
    subprocess.run([*command, *build], cwd=ROOT, check=True, capture_output=True)
    for package, folder in FOLDERS.items():
        wanted = {path.relative_to(folder) for path in folder.rglob("*.*") if path.suffix not in (".pyc", ".so")}
        installed = tmp_path / "lib" / package.replace(".", "/")
        assert not {path for path in wanted if not (installed / path).is_file()}
    assert (tmp_path / "lib" / "archord" / "py.typed").is_file()

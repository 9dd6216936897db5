"""Mesh files gone wrong: read or refused in a sentence, never a traceback, a crash or a hang."""

from __future__ import annotations

import re
import resource
from pathlib import Path
from random import Random

import gmsh
import pytest
from dolfinx import io
from mpi4py import MPI

from archord.geometry.meshes.fenicsx import distribute, gathered
from archord.geometry.meshes.formats.read import read_mesh
from archord.postprocess.pictures.mesh import mesh_text
from tests.forked import _FORKS
from tests.geometry.meshes.test_read import INPUT, MORE, draw

CASES = 300
_MEMORY = 8 * 2**30
_LIMIT = 120.0  # seconds for all
_TOKENS = (
    b"0",
    b"-1",
    b"1",
    b"3",
    b"1e308",
    b"nan",
    b"inf",
    b"2147483648",
    b"99999999999999999999",
    b"",
    b"x",
    b"1.5",
)


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, tuple[bytes, str]]:
    """Good files by name: content, and how the file to read is called."""
    folder = tmp_path_factory.mktemp("good")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    draw(2)
    for name, binary in (("text.msh", 0), ("binary.msh", 1)):
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.write(str(folder / name))
    gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
    gmsh.write(str(folder / "gmsh.inp"))
    gmsh.finalize()
    mesh = read_mesh(folder / "text.msh", MPI.COMM_SELF)
    for name, encoding in (
        ("text", io.XDMFFile.Encoding.ASCII),
        ("binary", io.XDMFFile.Encoding.HDF5),
    ):
        with io.XDMFFile(MPI.COMM_SELF, folder / f"{name}.xdmf", "w", encoding=encoding) as file:
            file.write_mesh(mesh.mesh)
            for tags, called in ((mesh.cells, "cell_tags"), (mesh.facets, "facet_tags")):
                tags.name = called
                file.write_meshtags(tags, mesh.mesh.geometry)
    (folder / "deck.inp").write_text(INPUT.replace("*INCLUDE, INPUT=more.inp\n", MORE))
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def mutate(rng: Random, raw: bytes) -> bytes:
    """One to three changes of bytes, lines or numbers."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        at = rng.randrange(len(raw))
        length = rng.choice((1, 1, 2, 8, 60))
        kind = rng.randrange(6)
        if kind == 0:
            raw = raw[:at] + bytes([raw[at] ^ 1 << rng.randrange(8)]) + raw[at + 1 :]
        elif kind == 1:
            raw = raw[:at] + rng.choice((b"", rng.randbytes(length))) + raw[at + length :]
        elif kind == 2:
            raw = (
                raw[:at]
                if rng.random() < 0.2
                else raw[:at] + raw[: rng.choice((10, 300))] + raw[at:]
            )
        elif kind == 3:
            lines = raw.split(b"\n")
            line = lines.pop(rng.randrange(len(lines)))
            for _ in range(rng.choice((0, 0, 1, 2))):
                lines.insert(rng.randrange(len(lines) + 1), line)
            raw = b"\n".join(lines)
        else:
            numbers = list(re.finditer(rb"(?<![\w.])-?\d+(?:\.\d*)?(?:e[-+]?\d+)?(?![\w.])", raw))
            one, other = (rng.choice(numbers) for _ in range(2)) if numbers else (None, None)
            new = rng.choice((*_TOKENS, other[0])) if other else b""
            raw = raw[: one.start()] + new + raw[one.end() :] if one else raw
        raw = raw or b"\n"
    return raw


def case(number: int, files: dict[str, bytes], folder: Path) -> Path:
    """Write the files of case ``number``; returns the one to read."""
    rng = Random(number)
    name = rng.choice(list(files))
    for beside in files:
        if Path(beside).stem == Path(name).stem and Path(beside).suffix in (".h5", ".xdmf"):
            (folder / beside).write_bytes(files[beside])
    (folder / name).write_bytes(mutate(rng, files[name]))
    return folder / name.replace(".h5", ".xdmf")


def _read_all(files: dict[str, bytes], folder: str, numbers: range) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    for number in numbers:
        with Path(folder, "log").open("a") as log:
            log.write(f"\n{number} ")
        path = case(number, files, Path(folder))
        said = "read"
        try:
            mesh_text(path.name, gathered(read_mesh(path, MPI.COMM_SELF)))
        except ValueError as error:
            said = (
                "refused"
                if str(error).startswith(str(path)) and len(str(error)) < 1000
                else f"oddly {error}"
            )
        except Exception as error:
            said = f"fault {error!r}"
        with Path(folder, "log").open("a") as log:
            log.write(said.replace("\n", " "))


def test_a_mutated_mesh_is_read_or_refused(files, tmp_path):
    assert distribute  # loaded before the fork
    process = _FORKS.Process(
        target=_read_all, args=(files, str(tmp_path), range(CASES)), daemon=True
    )
    process.start()
    process.join(_LIMIT)
    process.kill()
    ends = [
        line.partition(" ")[::2] for line in (tmp_path / "log").read_text().splitlines() if line
    ]
    assert not [(number, said) for number, said in ends if said not in ("read", "refused")]
    assert len(ends) == CASES
    assert 15 < sum(said == "read" for _, said in ends) < CASES - 100


def test_what_is_mutated_was_a_mesh(files, tmp_path):
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    for name in files:
        if not name.endswith(".h5"):
            assert len(read_mesh(tmp_path / name, MPI.COMM_SELF).cell_sets) > 1

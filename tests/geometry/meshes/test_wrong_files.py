"""What is no mesh file, or claims too much: one sentence, at once."""

import os
import time

import h5py
import numpy as np
import pytest
from mpi4py import MPI

from archord.geometry.meshes.formats.read import read_mesh

XDMF = """<Xdmf><Domain><Grid>
<Topology TopologyType="Triangle"><DataItem Dimensions="1 3">0 1 2</DataItem></Topology>
<Geometry><DataItem Dimensions="{rows} 2" Format="HDF">{file}:/x</DataItem></Geometry>
</Grid></Domain></Xdmf>"""
HUGE = 10**12
MSH = (
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n{0} {1} 1 {1}\n2 1 0 {1}\n1\n0 0 0\n$EndNodes\n"
)
OLD_MSH = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{1}\n1 0 0 0\n$EndNodes\n"
SUFFIXES = (".msh", ".inp", ".xdmf", ".npz")


def refused(path):
    """What is said of a file, within seconds, in one sentence that begins with its name."""
    begun = time.perf_counter()
    with pytest.raises(ValueError, match=path.name) as refusal:
        read_mesh(path, MPI.COMM_SELF)
    assert time.perf_counter() - begun < 20
    said = str(refusal.value)
    assert said.startswith(f"{path}: ")
    assert "\n" not in said
    assert len(said) < 600
    return said


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_what_is_no_file(tmp_path, suffix):
    path = tmp_path / f"mesh{suffix}"
    os.mkfifo(path)
    assert "it is a pipe, not a file" in refused(path)
    path.unlink()
    path.symlink_to("/dev/zero")
    assert "it is a device, not a file" in refused(path)
    path.unlink()
    path.mkdir()
    assert "it is a folder" in refused(path)
    path.rmdir()
    assert "No such file" in refused(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_files_of_nothing_and_of_anything(tmp_path, suffix):
    path = tmp_path / f"mesh{suffix}"
    path.touch()
    assert "is empty" in refused(path)
    path.write_bytes(np.random.default_rng(1).bytes(5000))
    refused(path)


@pytest.mark.parametrize("text", [MSH, OLD_MSH])
@pytest.mark.parametrize("nodes", [HUGE, 10**10])
def test_a_gmsh_file_that_claims_too_many_nodes(tmp_path, text, nodes):
    path = tmp_path / "mesh.msh"
    path.write_text(text.format(1, nodes))
    refused(path)


def test_a_script_is_not_run(tmp_path):
    """gmsh takes a file that does not begin as a mesh for a script of its own."""
    path = tmp_path / "mesh.msh"
    path.write_text(f'SystemCall "touch {tmp_path}/run";\n')
    assert "it must begin with $MeshFormat" in refused(path)
    assert not (tmp_path / "run").exists()


def test_hdf5_larger_than_memory_or_elsewhere(tmp_path):
    path = tmp_path / "mesh.xdmf"
    with h5py.File(tmp_path / "mesh.h5", "w") as file:
        file.create_dataset("x", shape=(HUGE, 2), dtype="f8", chunks=(1024, 2))
    path.write_text(XDMF.format(rows=HUGE, file="mesh.h5"))
    assert "claims an array of 1.6e+04 GB, more than half of the machine's" in refused(path)
    for name, said in (
        ("../mesh.h5", "is not in its folder"),
        ("none.h5", "cannot be read: No such file"),
    ):
        path.write_text(XDMF.format(rows=3, file=name))
        assert f"names the file '{name}', which {said}" in refused(path)


def test_input_from_elsewhere_or_without_an_end(tmp_path):
    (tmp_path / "meshes").mkdir()
    path = tmp_path / "meshes" / "mesh.inp"
    for name in ("../nodes.inp", "/etc/passwd"):
        path.write_text(f"*INCLUDE, INPUT={name}\n")
        assert f"names the file '{name}', which is not in its folder" in refused(path)
    os.mkfifo(tmp_path / "meshes" / "pipe")
    path.write_text("*INCLUDE, INPUT=pipe\n")
    assert "names the file 'pipe', which cannot be read: it is a pipe, not a file" in refused(path)
    path.write_text("*NODE\n1, 0., 0.\n2, 1., 0.\n*NSET, NSET=n, GENERATE\n1, 1000000000000\n")
    refused(path)

"""C kernels: compiled once, called with arrays that fit."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from archord.kernels.compiled import (
    CompilerError,
    _loaded,
    cache_folder,
    is_private,
    library,
    pointer,
    structure,
)


@pytest.fixture
def source(tmp_path, monkeypatch):
    """A folder of kernels and a cache of their own."""
    (tmp_path / "doubling.h").write_text("double twice(double x);\n")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    _loaded.cache_clear()
    yield tmp_path / "doubling.c"
    _loaded.cache_clear()


def test_a_kernel_is_compiled_once_and_again_when_its_source_changes(source):
    source.write_text("double twice(double x) { return 2 * x; }\n")
    assert library(source).twice(1.5) == 3.0
    (first,) = (source.parent / "cache" / "archord").iterdir()
    made = first.stat().st_mtime_ns
    _loaded.cache_clear()
    library(source)
    assert first.stat().st_mtime_ns == made
    source.write_text("double twice(double x) { return x + x + 1; }\n")
    _loaded.cache_clear()
    assert library(source).twice(1.5) == 4.0
    assert len(list((source.parent / "cache" / "archord").iterdir())) == 2


def test_a_failing_or_missing_compiler_is_one_sentence_and_leaves_nothing(source, monkeypatch):
    source.write_text("double twice(double x) { return nonsense; }\n")
    with pytest.raises(CompilerError, match=r"doubling\.c could not be compiled: .*nonsense"):
        library(source)
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(CompilerError, match=r"no C compiler .*install gcc, or set CC"):
        library(source)
    assert not list((source.parent / "cache" / "archord").iterdir())


def test_a_cache_that_cannot_be_written_is_no_hindrance(source, monkeypatch):
    source.write_text("double twice(double x) { return 2 * x; }\n")
    monkeypatch.setenv("XDG_CACHE_HOME", "/dev/null/nowhere")
    assert library(source).twice(2.0) == 4.0
    assert cache_folder() == cache_folder()
    assert list(cache_folder().glob("doubling-*.so"))
    code = "from archord.kernels.compiled import cache_folder; print(cache_folder())"
    other = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.strip()
    assert Path(other).name.startswith("archord-")
    assert not Path(other).exists()


def test_what_others_may_have_written_is_not_loaded(source, monkeypatch):
    """A library of another user, or one that others may write, is compiled again; a folder of
    another is not used."""
    source.write_text("double twice(double x) { return 2 * x; }\n")
    library(source)
    (kept,) = (source.parent / "cache" / "archord").iterdir()
    planted = source.with_name("planted.c")
    planted.write_text("double twice(double x) { return -1; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(kept), str(planted)], check=True)
    kept.chmod(0o777)
    _loaded.cache_clear()
    assert library(source).twice(1.5) == 3.0
    assert not kept.stat().st_mode & 0o022
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(kept), str(planted)], check=True)
    me = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: me + 1)
    _loaded.cache_clear()
    assert cache_folder() != kept.parent
    assert not is_private(kept)


def test_the_own_cache_is_closed_to_others(source):
    folder = source.parent / "cache" / "archord"
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    assert cache_folder() == folder
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_structure_has_numbers_and_pointers(source):
    """By the names of its declaration."""
    declared = (
        "typedef struct { int32_t n; const double *x; double by; } Sum; double last(const Sum *s);"
    )
    source.with_suffix(".h").write_text(f"#include <stdint.h>\n{declared}\n")
    source.write_text(
        '#include "doubling.h"\ndouble last(const Sum *s) { return s->by * s->x[s->n - 1]; }\n'
    )
    x = np.array([1.0, 2.0, 4.0])
    assert library(source).last(structure(source, "Sum", {"n": 3, "x": x, "by": 0.5})) == 2.0


@pytest.mark.parametrize(
    ("array", "error"),
    [
        (np.zeros((4, 4)).T[1:], ValueError),
        (np.zeros(4)[::2], ValueError),
        (np.zeros(3, dtype=np.int64), KeyError),
    ],
    ids=["transposed", "strided", "integers"],
)
def test_an_array_that_does_not_fit_is_refused(array, error):
    with pytest.raises(error, match="contiguous" if error is ValueError else "int64"):
        pointer(array)

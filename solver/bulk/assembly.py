"""Matrices of bilinear forms and of contact: how many entries a row has, and their assembly."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from petsc4py import PETSc

from archord.materials.kinematics import Ints

_NO_SLOTS = np.zeros((2, 0), dtype=np.int64)


def matrix(
    V: fem.FunctionSpace, forms: list[fem.Form], extra: Iterable[Ints] = _NO_SLOTS
) -> PETSc.Mat:
    """An empty matrix with room for the bilinear ``forms`` of separate bodies and ``extra`` blocks
    (rows, columns), in global block dofs and rows that this rank owns. PETSc gives back what is not
    written before the first assembly."""
    index_map = V.dofmap.index_map
    block = V.dofmap.index_map_bs
    n = index_map.size_local
    first = index_map.local_range[0]
    rows, columns = extra
    slot_rows = [rows - first]
    slot_owned = [(columns >= first) & (columns < first + n)]
    for form in forms:
        pattern = fem.create_sparsity_pattern(form)
        pattern.finalize()
        columns, offsets = pattern.graph
        slot_rows.append(np.repeat(np.arange(n), np.diff(offsets[: n + 1])))
        slot_owned.append(columns[: offsets[n]] < n)
    row = np.concatenate(slot_rows)
    owned = np.concatenate(slot_owned)
    n_others = index_map.size_global - n
    in_owned = np.minimum(np.bincount(row[owned], minlength=n), n)
    in_ghosts = np.minimum(np.bincount(row[~owned], minlength=n), n_others)
    nnz = [in_owned.astype(PETSc.IntType), in_ghosts.astype(PETSc.IntType)]
    sizes = [[block * n, None]] * 2
    A = PETSc.Mat().createBAIJ(sizes, bsize=block, nnz=nnz, comm=V.mesh.comm)
    local = np.arange(n + index_map.num_ghosts, dtype=np.int32)
    nodes = index_map.local_to_global(local).astype(PETSc.IntType)
    lgmap = PETSc.LGMap().create(nodes, bsize=block, comm=V.mesh.comm)
    A.setLGMap(lgmap, lgmap)
    A.setOption(PETSc.Mat.Option.NEW_NONZERO_ALLOCATION_ERR, True)
    return A


def assemble(A: PETSc.Mat, forms: list[fem.Form], bcs: Sequence[fem.DirichletBC] = ()) -> None:
    """Add bilinear ``forms`` to ``A``, with ones on the diagonal of the rows of ``bcs``. dolfinx
    inserts those ones; without a flush after each form the next one's additions would be dropped
    silently."""
    for form in forms:
        fem_petsc.assemble_matrix(A, form, list(bcs))
        A.assemblyBegin(PETSc.Mat.AssemblyType.FLUSH)
        A.assemblyEnd(PETSc.Mat.AssemblyType.FLUSH)

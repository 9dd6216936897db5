"""VTK's own reader of VTKHDF, as ParaView uses it."""

from __future__ import annotations

from pathlib import Path

import h5py
import pyvista
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader


class VtkFile:
    """A transient file: its ``times``, and the grid at each."""

    def __init__(self, path: Path) -> None:
        self._reader = vtkHDFReader()
        self._reader.SetFileName(str(path))
        assert self._reader.CanReadFile(str(path))
        self._reader.UpdateInformation()
        known = self._reader.GetOutputInformation(0).Get(
            vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        )
        with h5py.File(path) as file:
            self.times = file["VTKHDF/Steps/Values"][()].tolist()
        assert known == (
            tuple(self.times) if len(self.times) > 1 else None
        )  # to VTK, one step is no time

    def at(self, step: int) -> pyvista.UnstructuredGrid:
        """The grid at ``step``, from 1."""
        self._reader.UpdateTimeStep(self.times[step - 1])
        return pyvista.wrap(self._reader.GetOutputDataObject(0)).copy()


def only(grid: pyvista.UnstructuredGrid, dimension: int) -> pyvista.UnstructuredGrid:
    """The cells of a ``dimension``: 2 bodies, 1 contact facets, 0 integration points."""
    kinds = {0: [1], 1: [3, 68], 2: [69, 70]}[dimension]
    return grid.extract_cells([k for k, kind in enumerate(grid.celltypes) if kind in kinds])

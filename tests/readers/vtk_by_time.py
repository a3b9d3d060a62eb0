"""Whether this Python's VTK shows the film of a run by time; `make test-readers` runs it.

python vtk_by_time.py FOLDER        # needs vtk, numpy, h5py; nothing of this project
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import h5py
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader


def check(folder: Path) -> str:
    """Raise AssertionError unless all fields are those of ``fields.h5`` at times to and fro."""
    reader = vtkXdmfReader()
    reader.SetFileName(str(folder / "fields.xdmf"))
    reader.UpdateInformation()
    times = reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    compared = 0
    with h5py.File(folder / "fields.h5", "r", locking=False) as file:
        assert np.array_equal(times, file["times"][...])
        for step in (len(times) - 1, 0, len(times) // 2, 1):
            reader.UpdateTimeStep(times[step])
            blocks = reader.GetOutputDataObject(0)
            for number, name in enumerate(json.loads(file.attrs["parts"])):
                block, grid = file[name], blocks.GetBlock(number)
                begin, count = int(block["first"][step]), int(block["count"][step])
                at_rest = block["points"][begin : begin + count]
                points = vtk_to_numpy(grid.GetPoints().GetData())
                assert np.array_equal(points, at_rest), f"points of {name} at step {step}"
                start = int(block["count"][:step].sum())
                for field in ("uplift", "displacement"):
                    if field in block:
                        found = vtk_to_numpy(grid.GetPointData().GetArray(field))
                        expected = block[field][start : start + count]
                        assert np.array_equal(found, expected), f"{field} of {name} at {step}"
                        compared += 1
    assert compared
    return f"VTK {vtkVersion().GetVTKVersion()}: {len(times)} snapshots, {compared} tables alike"


if __name__ == "__main__":
    print(check(Path(sys.argv[1])))

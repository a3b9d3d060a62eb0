"""What a run gets for ParaView, read back by VTK's reader; the program has its own tests."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

from catenary.postproc.film.film_data import film_data
from catenary.postproc.paraview import open_in_paraview, scenery
from catenary.postproc.read.results import Results
from catenary.postproc.record.fields import FieldRecorder
from catenary.solver.base.errors import InputError

# HDF5's files are examined by a process of its own.
pytestmark = pytest.mark.process


@pytest.fixture
def folder(tmp_path: Path, make_march: Any, record_run: Any) -> Path:
    """A run of two pantographs over half a second with a snapshot every 50 ms."""
    march = make_march(n_steps=500)
    wires, droppers = march.mesh.wires, march.mesh.droppers
    march.drive(FieldRecorder(march.comm, tmp_path / "fields.xdmf", wires, droppers, every=50))
    record_run(tmp_path / "run.h5", march)
    return tmp_path


def test_heads_arms_and_forces_are_where_the_record_has_them(folder: Path) -> None:
    script, *files = open_in_paraview.write_script(folder, None)
    assert script == folder / "paraview" / "view.py"
    with Results(folder) as results:
        data = film_data(results)
    arms, forces = (pyvista.get_reader(path) for path in files[:2])
    np.testing.assert_allclose(arms.time_values, 0.05 * np.arange(11))
    for time in arms.time_values[::5]:
        row = data.row_at(time)
        arms.set_active_time_value(time)
        grid = arms.read()
        height = grid.points[:, 2] + grid.point_data["uplift"]
        # Foot, knee, hinge and both ends of the head of each; the hinge is where the head is.
        np.testing.assert_allclose(height[2::5], data.head_height[row], atol=1e-7)
        np.testing.assert_allclose(grid.points[2::5, 0], data.position[row])
        np.testing.assert_array_equal(grid.cell_data["number"], np.repeat([0, 1], 3))
        np.testing.assert_array_equal(grid.point_data["uplift"][0::5], 0.0)
        forces.set_active_time_value(time)
        vectors = forces.read().point_data["force"]
        np.testing.assert_allclose(vectors[:, 2], data.force[row], rtol=1e-6)
        np.testing.assert_array_equal(vectors[:, :2], 0.0)


def test_masts_stand_at_supports_and_arms_end_on_the_wire(folder: Path) -> None:
    with Results(folder) as results:
        data = film_data(results)
    staggered = data.points.copy()
    staggered[:, 1] = 0.2 * np.cos(np.pi * staggered[:, 0] / 50.0)
    data = dataclasses.replace(data, points=staggered)
    points, cells, kind = scenery.surroundings(data)
    masts, arms = cells[kind == scenery.MAST], cells[kind == scenery.ARM]
    np.testing.assert_allclose(points[masts[:, 0], 0], data.supports)
    assert (points[masts[:, 1], 2] > data.points[:, 2].max()).all()
    ends, wire = points[arms[:, 1]], data.points[data.wires[data.contact]]
    distance = np.abs(wire[None] - ends[:, None]).sum(axis=2).min(axis=1)
    assert distance.max() < 1e-9, "each mast has a node of the contact wire beside it"
    np.testing.assert_allclose(np.abs(ends[:, 1]), 0.2)
    # The reader of pyvista takes files with times only.
    reader = vtkXdmfReader()
    reader.SetFileName(str(open_in_paraview.write_script(folder, None)[3]))
    reader.Update()
    grid = pyvista.wrap(reader.GetOutputDataObject(0))
    np.testing.assert_array_equal(grid.points[:, [0, 2]], points[:, [0, 2]])
    np.testing.assert_array_equal(grid.cell_data["kind"], kind)


def test_the_script_is_python_and_keeps_strangers_words_as_text(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    name = "\"]}\nimport os; os.abort()  # '''"
    monkeypatch.setattr(Results, "pantograph_names", lambda self: [name, "trailing"])
    text = open_in_paraview.write_script(folder, None, motion=70.0)[0].read_text(encoding="utf-8")
    compile(text, "view.py", "exec")
    begin = text.index("SETTINGS = ") + len("SETTINGS = ")
    settings = json.JSONDecoder().raw_decode(text[begin:])[0]
    assert settings["names"] == [name, "trailing"] and settings["motion"] == 70.0
    assert settings["times"] == [0.0, pytest.approx(0.5)]
    assert "@" not in text


def test_a_folder_that_cannot_be_written_is_named(folder: Path) -> None:
    (folder / "paraview").write_text("a file in the way")
    with pytest.raises(InputError, match="paraview cannot be written"):
        open_in_paraview.write_script(folder, None)

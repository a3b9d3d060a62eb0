"""What a run gets for ParaView, read back by VTK's reader; the program has its own tests."""

from __future__ import annotations

import json
import runpy
import subprocess
import sys
import types
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import h5py
import numpy as np
import pytest
import pyvista
from matplotlib.colors import to_rgb
from studies import few
from watched_fields import blocks_at

from catenary import RunBroken
from catenary.postproc.film import open_in_paraview
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.postproc.film.options import View
from catenary.postproc.film.scenery import MOTIONS
from catenary.postproc.read.results import Results
from catenary.postproc.record.snapshots.fields import FieldRecorder

pytestmark = pytest.mark.usefixtures("examined_here")


@pytest.fixture
def folder(tmp_path: Path, make_march: Any, record_run: Any) -> Path:
    """A run of two pantographs over half a second with a snapshot every 50 ms."""
    march = make_march(n_steps=500)
    march.drive(FieldRecorder(march.comm, tmp_path / "fields.xdmf", march.recorded, every=50))
    record_run(tmp_path / "run.h5", march)
    return tmp_path


def test_heads_arms_and_forces_are_where_the_record_has_them(folder: Path) -> None:
    aside = 0.125
    with h5py.File(folder / "fields.h5", "r+") as file:
        file["contact_wire/displacement"][:, 1] = aside
    script, *files = open_in_paraview.write_script(folder, None)
    assert script == folder / "paraview" / "view.py"
    line = folder / "paraview" / "line.xdmf"
    assert line == files[-1] and len(blocks_at(line, 0.5)["droppers"].cell_data) == 0
    assert "contact_wire" in blocks_at(line, 0.5)
    with Results(folder) as results:
        data = FilmData(results)
    nodes = data.wires["contact_wire"]
    arms, forces = (pyvista.get_reader(path) for path in files[:2])
    np.testing.assert_allclose(arms.time_values, 0.05 * np.arange(11))
    for number, time in list(enumerate(arms.time_values))[::5]:
        row = data.row_at(time)
        arms.set_active_time_value(time)
        grid = arms.read()
        moved = grid.point_data["displacement"]
        height = (grid.points[:, 2] + moved[:, 2]).reshape(2, -1)
        # The highest points are those of the head, on the wire that it presses on.
        with Snapshots(folder, len(data.points)) as snapshots:
            lifted = snapshots.uplift(number)[nodes]
        wire = np.interp(data.position[row], data.points[nodes, 0], lifted + data.points[nodes, 2])
        np.testing.assert_allclose(height.max(axis=1), wire, atol=1e-6)
        heads = grid.points.reshape(2, -1, 3)[height == height.max(axis=1, keepdims=True)]
        apart = np.abs(heads[:, :1] - data.position[row])
        assert (apart.min(axis=1) < 0.5).all() and (apart.min(axis=0) < 1e-3).all()
        n_cells = grid.n_cells // 2
        np.testing.assert_array_equal(grid.cell_data["number"], np.repeat([0, 1], n_cells))
        assert set(grid.cell_data["kind"]) == {0, 1, 2}
        # Base and foot stand on the roof.
        foot = moved.reshape(2, -1, 3)[height == height.min(axis=1, keepdims=True)]
        np.testing.assert_array_equal(foot, 0.0)
        forces.set_active_time_value(time)
        found = forces.read()
        vectors = found.point_data["force"]
        np.testing.assert_allclose(found.point_data["displacement"][:, 1], aside, rtol=1e-6)
        np.testing.assert_allclose(vectors[:, 2], data.force[row], rtol=1e-6)
        np.testing.assert_array_equal(vectors[:, :2], 0.0)


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
    assert settings["blocks"] == [
        ["contact_wire", "contact"], ["messenger_wire", "wire"], ["droppers", "droppers"],
        ["steady_arms", "steady_arms"], ["masts", "masts"],
    ]  # fmt: skip
    assert settings["times"] == [0.0, pytest.approx(0.5)]
    assert "@" not in text


@pytest.mark.parametrize(
    ("view", "aside", "component", "coloured"),
    [
        pytest.param(View.SIDE, 0.0, "", "uplift [m]", marks=pytest.mark.study),
        pytest.param(View.PLAN, 0.0, "", "uplift [m]", marks=pytest.mark.study),
        (View.PLAN, 0.0123, "Y", "to the left [m]"),
        pytest.param(View.OBLIQUE, 0.0, "", "uplift [m]", marks=pytest.mark.study),
        (View.ALONG, 0.0123, "", "uplift [m]"),
    ],
)
def test_each_view_is_coloured_by_what_it_shows(
    folder: Path, view: View, aside: float, component: str, coloured: str
) -> None:
    with h5py.File(folder / "fields.h5", "r+") as file:
        file["contact_wire/displacement"][:, 1] = aside
    text = open_in_paraview.write_script(folder, None, look=view)[0].read_text(encoding="utf-8")
    begin = text.index("SETTINGS = ") + len("SETTINGS = ")
    settings = json.JSONDecoder().raw_decode(text[begin:])[0]
    assert (settings["component"], settings["coloured"]) == (component, coloured)
    assert settings["view"] == view and settings["vector"] == 1
    # Where nothing moves sideways widths and motions are drawn alike from above.
    alike = view is View.PLAN and aside == 0.0
    assert (settings["motion"] == settings["size"]) == alike
    if component:
        # Ends of a scale have two digits, and are not below what is shown.
        assert settings["ends_m"] == [0.0, 0.013]
    # Colours are those of films, from end to end of their scale.
    assert settings["ramp"][0::4] == pytest.approx(np.linspace(*settings["ends_m"], len(MOTIONS)))
    assert settings["ramp"][-3:] == pytest.approx(to_rgb(MOTIONS[-1]))
    assert settings["looks"]["masts"] == [2.0, pytest.approx(to_rgb("#b8bcc2"))]


class _AnyParaView(types.ModuleType):
    """Stands for ParaView's module: takes every call, and keeps what cameras were given."""

    def __getattr__(self, name: str) -> Any:
        made = MagicMock(name=name)
        setattr(self, name, made)
        return made


@pytest.mark.parametrize("view", few(list(View), View.ALONG, View.OBLIQUE))
def test_the_script_runs_from_end_to_end(
    folder: Path, view: View, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against a stand-in; `tests/paraview` has the program. The camera looks at the train."""
    script = open_in_paraview.write_script(folder, None, look=view)[0]
    package, simple = _AnyParaView("paraview"), _AnyParaView("paraview.simple")
    package.simple = simple
    window = simple.GetActiveViewOrCreate.return_value
    window.ViewSize = [1280, 640]
    for name, module in (("paraview", package), ("paraview.simple", simple)):
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(sys, "argv", [str(script), "--picture", "x.png", "--time", "0.25"])
    made = runpy.run_path(str(script))
    (x, _, _), at = window.CameraPosition, window.CameraFocalPoint
    with Results(folder) as results:
        data = FilmData(results)
    middle = data.position[data.row_at(0.25)].mean()
    ahead = {View.ALONG: 0.1 * made["WIDTH"]}.get(view, 0.0)
    assert at[0] == pytest.approx(middle + ahead)
    assert (x < at[0] - 1.0) == (view in (View.OBLIQUE, View.ALONG))
    assert simple.SaveScreenshot.call_args.args[0] == "x.png"


def test_a_folder_that_cannot_be_written_is_named(folder: Path) -> None:
    (folder / "paraview").write_text("a file in the way")
    with pytest.raises(RunBroken, match=r"writing .*paraview failed \(File exists\)"):
        open_in_paraview.write_script(folder, None)


@pytest.mark.process
def test_a_full_disk_ends_with_a_sentence(folder: Path) -> None:
    """And not with a crash: HDF5 would write again at the end of the program."""
    script = (
        "import resource, sys\nfrom pathlib import Path\n"
        "from catenary.postproc.film.open_in_paraview import write_script\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, resource.RLIM_INFINITY))\n"
        "write_script(Path(sys.argv[1]), None)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(folder)], capture_output=True, text=True
    )
    last = done.stderr.strip().splitlines()[-1]
    assert done.returncode == 1, last
    assert "RunBroken: writing" in last and "paraview failed (File too large)" in last
    assert not list((folder / "paraview").iterdir())

"""The strips' shares of the contact force: recorded only where a pantograph has several."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures import force_pictures
from catenary.postproc.report.report import write_report
from catenary.solver.time_loop.views.channels import TrainLayout


@pytest.fixture
def with_strips(make_march: Any) -> Any:
    """Two pantographs: one strip, and two that carry 60 and 40 %."""

    class Striped(make_march):  # type: ignore[misc]
        def stage(self, first_step: int = 0) -> Any:
            return replace(super().stage(first_step), train=TrainLayout((1, 2)))

        def more(self, step: int) -> Any:
            leading, trailing = self.force(step * self.dt)
            return {"strip_force": np.array([leading, 0.6 * trailing, 0.4 * trailing])}

    return Striped(n_steps=600)


def test_each_strip_has_a_column(tmp_path: Path, with_strips: Any, record_run: Any) -> None:
    record_run(tmp_path / "run.h5", with_strips)
    with Results(tmp_path) as results:
        assert results.n_strips() == [1, 2]
        assert results.strip_columns() == [range(0, 1), range(1, 3)]
        one, two = np.split(results.channel("strip_force"), [1], axis=1)
        force = results.channel("contact_force")
        np.testing.assert_array_equal(one, force[:, :1])
        np.testing.assert_allclose(two, force[:, 1:] * [0.6, 0.4], rtol=1e-15)
        figure = force_pictures.strip_forces(results)
        assert len(figure.axes) == 1
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["channels/strip_force"].attrs["unit"] == b"N"


@pytest.mark.usefixtures("quick_report")
def test_the_report_shows_them(tmp_path: Path, with_strips: Any, record_run: Any) -> None:
    record_run(tmp_path / "run.h5", with_strips)
    write_report(tmp_path, tmp_path)
    assert (tmp_path / "strip_forces.png").is_file()
    assert "Shares of the collector strips" in (tmp_path / "report.html").read_text()


def test_runs_of_single_strips_have_no_such_channel(run_folder: Path) -> None:
    with h5py.File(run_folder / "run.h5") as file:
        assert "strip_force" not in file["channels"]
    with Results(run_folder) as results:
        assert results.n_strips() == [1, 1]
        assert not results.several_strips and not results.has("strip_force")

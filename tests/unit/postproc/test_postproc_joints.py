"""Open joints: recorded only where all bodies of a pantograph are moved."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from catenary.postproc.read.results import Results
from catenary.postproc.report.report import write_report
from catenary.solver.time_loop.views.channels import TrainLayout

pytestmark = pytest.mark.usefixtures("quick_reports")


@pytest.fixture
def with_joints(make_march: Any) -> Any:
    """Two pantographs: the leading one's joints open by 1e-12 m times the step, no joints."""

    class Jointed(make_march):  # type: ignore[misc]
        def stage(self, first_step: int = 0) -> Any:
            return replace(super().stage(first_step), train=TrainLayout((1, 1), True))

        def more(self, step: int) -> Any:
            return {"constraint_violation": np.array([1e-12 * step, np.nan])}

    return Jointed(n_steps=600)


def test_each_step_has_the_largest_open_joint(
    tmp_path: Path, with_joints: Any, record_run: Any
) -> None:
    record_run(tmp_path / "run.h5", with_joints)
    with Results(tmp_path) as results:
        found = results.channel("constraint_violation")
        np.testing.assert_array_equal(found[:, 0], 1e-12 * np.arange(601))
        assert np.isnan(found[:, 1]).all()
        assert results.largest_violations() == [6e-10, None]
    with h5py.File(tmp_path / "run.h5") as file:
        assert file["channels/constraint_violation"].attrs["unit"] == b"m"


def test_summary_and_report_tell_the_largest(
    tmp_path: Path, with_joints: Any, record_run: Any
) -> None:
    record_run(tmp_path / "run.h5", with_joints)
    write_report(tmp_path, tmp_path)
    told = json.loads((tmp_path / "summary.json").read_text())["pantographs"]
    assert [one["max_constraint_violation_m"] for one in told] == [6e-10, None]
    report = (tmp_path / "report.html").read_text()
    assert "largest open joint, whole run" in report
    assert "6.0e-10" in report


def test_runs_without_joints_have_no_such_channel(run_folder: Path) -> None:
    with h5py.File(run_folder / "run.h5") as file:
        assert "constraint_violation" not in file["channels"]
    with Results(run_folder) as results:
        assert not results.has_violations
        assert results.largest_violations() == [None, None]

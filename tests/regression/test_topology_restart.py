"""Runs over several contact wires that are interrupted and continued, from the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from program import MPIRUN, assert_same_histories, catenary

from catenary import open as open_run

pytestmark = pytest.mark.usefixtures("examined_here")

# Both run over both contact wires, the overlap from one to the other.
RUNS = {
    "dc_twin": [
        "line.n_spans=8", "train.start_m=150", "train.end_m=190", "evaluation.from_m=165",
        "evaluation.to_m=180",
    ],
    "overlap": [
        "line.n_spans=8", "line.overlap.first_span=3", "train.pantographs=[{name='three_masses'}]",
        "train.start_m=190", "train.end_m=250", "evaluation.from_m=205", "evaluation.to_m=240",
    ],
}  # fmt: skip
STEPS = 300


def words(case: str, out: Path) -> list[str]:
    """A run of some hundred steps."""
    given = [*RUNS[case], "numerics.dt_s=1e-3", "train.raise_time_s=0.05"]
    return ["run", case, "-o", str(out), "--no-report", "--set", *given]


@pytest.mark.parametrize(
    ("case", "ranks"),
    [
        pytest.param("overlap", 2, marks=pytest.mark.study),
        pytest.param("dc_twin", 1, marks=pytest.mark.study),
    ],
)
def test_a_run_over_several_contact_wires_is_continued(
    case: str, ranks: int, tmp_path: Path
) -> None:
    if ranks > 1 and MPIRUN is None:
        pytest.skip("there is no mpirun")
    whole, out = tmp_path / "whole", tmp_path / "out"
    done = catenary(*words(case, whole), cwd=tmp_path)
    assert done.code == 0, done.stderr
    stopped = [*words(case, out), "--", "-march_ts_max_steps", str(STEPS)]
    done = catenary(*stopped, cwd=tmp_path, ranks=ranks)
    assert done.code == 1, done.stderr
    done = catenary("restart", str(out), cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert_same_histories(out, whole)
    with open_run(out) as found, open_run(whole) as expected:
        shares = expected.channel("contact_wire_force").values
        assert shares.shape[1] == 2
        # Of twin wires both carry all the time; in the overlap the other one does at the end.
        assert (shares.max(axis=0) > 1.0).all()
        difference = np.abs(found.channel("contact_wire_force").values - shares).max()
        assert difference <= 1e-9 * np.abs(shares).max()

"""A film and a view in ParaView of a run that goes on meanwhile."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import numpy as np
import pytest
from program import catenary, catenary_started, n_rows

from catenary.postproc.film.film_data import Snapshots
from catenary.postproc.read.results import Results

# A run that takes several times as long as film and view, with snapshots 20 ms apart.
LONG = (
    "line.n_spans=60", "train.end_m=3400", "numerics.dt_s=5e-5", "output.field_every_s=0.02",
    "output.flush_every_steps=2000",
)  # fmt: skip
# A picture every 2 m of the 13.9 m that the train travels.
FILM = ("--from", "0.2", "--to", "0.4", "--fps", "10", "--every-m", "2")


@pytest.mark.study
def test_films_and_views_of_a_run_that_goes_on(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["run", "en50318_2002", "-o", str(out), "--no-report", "--set", *LONG]
    with catenary_started(*words, cwd=tmp_path) as program:
        program.wait_for(lambda: n_rows(out / "run.h5") > 10_000)
        before = n_rows(out / "run.h5")
        film = catenary("animate", str(out), *FILM, cwd=tmp_path, pictures=True)
        assert film.code == 0, film.stderr
        assert "7 pictures" in film.stdout
        view = catenary("paraview", str(out), "--no-state", cwd=tmp_path)
        assert view.code == 0, view.stderr
        with Results(out) as results:
            last = float(results.time[-1])
            with Snapshots(out, len(results.line("node_points")), until=last) as snapshots:
                times = snapshots.times
                assert np.isfinite(snapshots.uplift(times.size - 1)).all()
        # The run noticed nothing.
        program.wait_for(lambda: n_rows(out / "run.h5") > before + 4000)
        program.send(signal.SIGTERM)
        done = program.end()
    assert done.code == 1
    assert done.sentences == [
        f"catenary: the run was interrupted; `catenary restart {out}` continues it"
    ]
    np.testing.assert_allclose(times, 0.02 * np.arange(times.size))
    assert 0.4 < last - 0.5 < times[-1] <= last + 1e-9
    script = (out / "paraview" / "view.py").read_text()
    settings = json.loads(script[script.index("{") : script.index("\n}") + 2])
    assert settings["times"][0] == 0.0 and 0.4 < settings["times"][1] <= times[-1]

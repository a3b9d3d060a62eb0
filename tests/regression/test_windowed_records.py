"""A run with a window records the part of the line that moves, unless its scene says otherwise.

The same run with all spans recorded shows that the line beyond is at rest.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import h5py
import numpy as np
import pytest
from program import catenary as called
from scenes import with_words
from studies import few

import catenary
from catenary.postproc.film.film_data import Snapshots
from catenary.postproc.read.results import Results

N_SPANS, SPAN, START, STEPS = 60, 54.0, 1620.0, 800
CASE = "ambrosio2012"
SCENE = (
    f"line.n_spans={N_SPANS}",
    f"train.start_m={START}", f"train.end_m={START + 66.7}", "train.raise_time_s=0.1",
    f"evaluation.from_m={START + 10.0}", f"evaluation.to_m={START + 25.0}", "numerics.dt_s=1e-3",
    "output.field_every_s=0.05", "output.flush_every_steps=100",
)  # fmt: skip
WINDOWS = {
    "spans": ("window.mode=bounded", "window.spans_ahead=6", "window.spans_behind=5"),
    "exact": ("window.mode=exact",),
}
WHOLE = (f"output.field_spans=[1,{N_SPANS}]", f"output.line_channels_spans=[1,{N_SPANS}]")

Made = Callable[[str, bool], Path]
# Of the largest displacement, in the single precision of snapshots.
RESOLVED = 2.0**-24


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, quick_reports: None) -> Made:
    folder = tmp_path_factory.mktemp("windowed")

    @cache
    def made(window: str, whole: bool) -> Path:
        out = folder / f"{window}_{whole}"
        more = WHOLE if whole else ()
        catenary.run(with_words(CASE, (*SCENE, *WINDOWS[window], *more)), out)
        return out

    return made


@pytest.mark.parametrize("window", few(WINDOWS, "spans"))
def test_snapshots_show_what_moves(window: str, run: Made) -> None:
    """No wave has come beyond the spans of a window, 324 m ahead and 270 m behind, within 0.8 s,
    122 m. Short waves are faster, and damping ends them: there they are less than single precision
    tells from the largest displacement. In an exact window the record ends two spans
    beyond the front of the fastest waves, where displacements are below 1e-6 of it
    (``window.choice``)."""
    with Results(run(window, True)) as results:
        points = results.line("node_points")[:, 0]
        n_nodes = points.size
    apart = {"spans": RESOLVED, "exact": 1e-6}[window]
    with (
        Snapshots(run(window, True), n_nodes) as every,
        Snapshots(run(window, False), n_nodes) as part,
    ):
        np.testing.assert_array_equal(part.times, every.times)
        assert part.whole, "what is not recorded is known to be at rest"
        assert part.shown(3) == every.shown(3)
        largest = np.abs(every.uplift(every.times.size - 1)).max()
        assert largest > 0.01
        for number in range(every.times.size):
            shown, known = part.uplift(number), every.uplift(number)
            assert np.abs(shown - known).max() <= apart * largest
        far, near = (np.abs(points - x).argmin() for x in (START + SPAN * 15.0, START))
        assert part.uplift(2)[far] == 0.0
        assert part.uplift(2)[near] != 0.0
    sizes = [(run(window, whole) / "fields.h5").stat().st_size for whole in (False, True)]
    # At most 11 of 60 spans, or 2 * (152 m/s * 0.8 s + 108 m) = 460 m of 3240; tables and
    # points at rest of the whole line, 32 bytes a node, beside 17 snapshots of 16 bytes.
    assert sizes[0] < 0.35 * sizes[1], sizes


def test_channels_of_the_line_are_recorded_where_it_moves(run: Made) -> None:
    """The same numbers within the window, nothing outside; extremes of all arms."""
    with Results(run("spans", True)) as every, Results(run("spans", False)) as part:
        whole, found = every.channel("arm_uplift"), part.channel("arm_uplift")
        recorded = np.isfinite(found)
        np.testing.assert_array_equal(found[recorded], whole[recorded])
        assert recorded.any(axis=1).all() and 0.1 < recorded.mean() < 0.3
        assert np.abs(whole[~recorded]).max() <= RESOLVED * np.abs(whole).max()
        for name in ("arm_uplift", "dropper_force"):
            np.testing.assert_array_equal(part.extremes(name), every.extremes(name))


@pytest.mark.parametrize("window", few(WINDOWS, "spans"))
def test_a_run_that_is_interrupted_goes_on_with_its_snapshots(
    window: str, run: Made, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = ["run", CASE, "-o", str(out), "--no-report", "--set", *SCENE, *WINDOWS[window]]
    begun = called(*words, "--", "-march_ts_max_steps", "450", cwd=tmp_path)
    assert begun.code == 1, begun.stderr
    done = called("restart", str(out), cwd=tmp_path)
    assert done.code == 0, done.stderr
    with (
        h5py.File(out / "fields.h5") as found,
        h5py.File(run(window, False) / "fields.h5") as expected,
    ):
        for name in ("contact_wire/uplift", "droppers/displacement", "times", "masts/first"):
            # Steps after a restart may be single ones, which do not make subnormal numbers zero.
            np.testing.assert_allclose(found[name][...], expected[name][...], rtol=0, atol=1e-37)

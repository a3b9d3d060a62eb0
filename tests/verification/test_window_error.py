"""The error that a window makes in the contact force, over its size."""

from __future__ import annotations

from pathlib import Path

import pytest
from scenes import load_scene

from catenary import InputError
from catenary.cases.studies.sweep.variants import whole_numbers
from catenary.cases.studies.waves import window_error
from catenary.postproc.report.study_table import write_files

# The paper's line with average damping, on which waves fade within a few spans.
SHORT = (
    "line.n_spans=14", "train.pantographs=[{name='lumped'}]", "train.start_m=330",
    "train.end_m=420", "train.raise_time_s=0.2", "evaluation.from_m=360", "evaluation.to_m=410",
)  # fmt: skip


def test_the_error_falls_with_the_size_of_the_window(tmp_path: Path) -> None:
    curve = window_error.curve_of("average", load_scene("ambrosio2012", SHORT), [2, 5])
    sizes = [one.spans for one in curve.errors]
    assert sizes == [2.0, 5.0, 8.0] and [one.is_default for one in curve.errors] == [0, 0, 1]
    small, _, usual = (one.history for one in curve.errors)
    # One span ahead and behind: some tenths of a per cent; the program's own is as good as exact.
    assert 1e-3 < small < 5.0 and usual < 1e-3 * small
    assert all(abs(one.sigma) <= one.history for one in curve.errors)
    told = window_error.as_text([curve])
    assert "chosen by the program" in told.splitlines()[-1] and "REMARK" not in told
    names = {path.name for path in write_files(tmp_path, window_error.files_of([curve]))}
    assert names == {"window_error.csv", "window_error.png"}
    rows = (tmp_path / "window_error.csv").read_text().splitlines()
    assert len(rows) == 4 and rows[0].startswith("with,spans_ahead")


def test_what_marches_tell_of_themselves_is_told_of_the_windows() -> None:
    """The vehicle sinks by a metre, its pantograph with it, and stays down for a span."""
    lost = (
        "effects.vehicle_motion=true",
        "vehicle.vertical.by_place=[[0,0],[335,0],[345,-1.0],[900,-1.0]]",
        "pantographs.lumped.stiffnesses_N_per_m=[4200.0,1000.0]",
    )
    curve = window_error.curve_of("", load_scene("ambrosio2012", (*SHORT, *lost)), [5])
    said, on = curve.remarks
    assert "has not touched a wire for more than a span" in said and "to the end of the run" in on
    assert [one.remarks for one in curve.errors] == [(said, on)] * 2
    names = "whole line, 5 spans, 8 spans"
    told = window_error.as_text([curve]).splitlines()
    assert told[-2:] == [f"REMARK      {names}: {text}" for text in (said, on)]


def test_sizes_that_cannot_be_are_refused() -> None:
    bounds = window_error.LEAST, window_error.MOST
    for text in ("", "8,x", "1,2", "8,8", "4.5"):
        with pytest.raises(InputError, match="--window-error .* must be whole numbers from 2"):
            whole_numbers(text, window_error.OPTION, *bounds, "8,16")
    assert whole_numbers("16,8", window_error.OPTION, *bounds, "8,16") == [8, 16]
    with pytest.raises(InputError, match="window of 14 spans, but the line has 14"):
        window_error.curve_of("", load_scene("ambrosio2012", SHORT), [4, 14])


@pytest.mark.study
def test_forty_spans_are_enough_where_waves_hardly_fade() -> None:
    """The history is off by a tenth of a per cent of sigma at most; 0.26 % with simpler damping."""
    scene = load_scene(
        "en50318_2002",
        ("line.n_spans=100", "train.start_m=1200", "evaluation.from_m=2800",
         "evaluation.to_m=4700"),
    )  # fmt: skip
    (usual,) = (one for one in window_error.curve_of("", scene, [30]).errors if one.is_default)
    print(usual)
    assert usual.spans == 40.0
    assert usual.history < 0.1 and abs(usual.sigma) < 0.01


@pytest.mark.study
@pytest.mark.parametrize("behind", [(), (200.0,)], ids=["one", "two"])
@pytest.mark.parametrize(
    ("case", "name", "words"),
    [
        ("ambrosio2012", "lumped", ()),
        ("ambrosio2012", "lumped", ("line.damping.alpha_s=0.00275",)),
        ("en50318_2002", "reference", ()),
        ("ac_simple", "three_masses", ()),
    ],
    ids=["average", "light", "en50318", "ac_simple"],
)
def test_the_window_that_the_program_chooses_is_good_enough(
    case: str, name: str, words: tuple[str, ...], behind: tuple[float, ...]
) -> None:
    """Window against full line on 100 spans: history within 0.5 % of sigma, sigma within 0.1 %."""
    train = [f"{{name='{name}'}}", *(f"{{name='{name}',behind_m={way:g}}}" for way in behind)]
    scene = load_scene(
        case,
        ("line.n_spans=100", f"train.pantographs=[{','.join(train)}]", "train.start_m=1200",
         "evaluation.from_m=2600", "evaluation.to_m=3800", *words),
    )  # fmt: skip
    (usual,) = (one for one in window_error.curve_of("", scene, [20]).errors if one.is_default)
    print(case, words, behind, usual)
    assert usual.history < 0.5 and abs(usual.sigma) < 0.1

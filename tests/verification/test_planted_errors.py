"""Line tests made from runs, with errors planted in them: each is found, and none is invented.

A run stands for the line test: its forces and heights pass SciPy's own filter, get noise of 5 N and
5 mm, and go through files as a user writes them.
"""

from __future__ import annotations

import functools
import io
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from scenes import load_scene
from scipy import signal

from catenary.cases.run.runner import run_case
from catenary.cases.studies.measured import passage_of, read_description, read_table
from catenary.postproc.measurements.compared import Comparison
from catenary.postproc.measurements.comparison import compare_with
from catenary.postproc.read.results import Results

pytestmark = pytest.mark.usefixtures("quick_reports")

SPEED, DT = 250.0 / 3.6, 1e-3
STRETCH = (180.0, 540.0)
# Ten spans of 60 m, two pantographs 90 m apart, droppers that err by 3 mm.
SCENE = (
    "line.n_spans=11", "mesh.elements_per_gap=2", "train.start_m=130", "train.end_m=640",
    "train.pantographs=[{name='reference'},{name='reference', behind_m=90.0}]",
    "evaluation.from_m=180", "evaluation.to_m=540", "output.field_every_s=0",
    "irregularities.dropper_lengths.standard_deviation_mm=3.0", "effects.dropper_lengths=true",
)  # fmt: skip
FORCE_NOISE, HEIGHT_NOISE = 5.0, 5e-3


@dataclass(frozen=True)
class LineTest:
    """How a line test is made from a run.

    Attributes
    ----------
    by_time : whether it has a clock, not places
    states_filter : whether its description says that values are filtered at 20 Hz
    cut_off : of the filter that they pass, None for none [Hz]
    shift : of places [m], or of the clock [s]
    drift : by how much each of them grows [-]
    gain : of the force of the leading pantograph
    trailing : "there", "lowered", "no numbers", "no column" or "the leading one"
    """

    by_time: bool = False
    states_filter: bool = True
    cut_off: float | None = 20.0
    shift: float = 0.0
    drift: float = 0.0
    gain: float = 1.0
    trailing: str = "there"


@pytest.fixture(scope="module")
def run_folders(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two runs whose droppers err each in their own way."""
    folders = []
    for seed in (11, 12):
        folders.append(tmp_path_factory.mktemp("run"))
        changes = [*SCENE, f"irregularities.dropper_lengths.seed={seed}"]
        scene = load_scene("en50318_2002", changes)
        run_case(scene, folders[-1], MPI.COMM_SELF, only_summary=True)
    return folders


@pytest.fixture(params=[0, 1])
def run_folder(request: Any, run_folders: list[Path]) -> Path:
    return run_folders[request.param]


@functools.cache
def filter_of(cut_off: float) -> np.ndarray:
    return np.asarray(signal.butter(6, cut_off, fs=1.0 / DT, output="sos"))


def passed(values: np.ndarray, cut_off: float | None) -> np.ndarray:
    if cut_off is None:
        return values
    # The slowest pole has died to 1e-4 after six periods of the cut-off.
    return np.asarray(signal.sosfiltfilt(filter_of(cut_off), values, padlen=int(6 / cut_off / DT)))


def noise(rng: np.random.Generator, n: int, deviation: float, own: LineTest) -> np.ndarray:
    """Of raw samples that of each; of filtered values that which passed their filter."""
    white = rng.normal(size=n + 1200)
    if not own.states_filter or own.cut_off is None:
        return deviation * white[600:-600]
    coloured = passed(white, own.cut_off)
    return np.asarray(deviation / coloured.std() * coloured[600:-600])


def made(
    results: Results,
    own: LineTest,
    rng: np.random.Generator,
    folder: Path,
    compared: Results | None = None,
) -> Comparison:
    """Write the files of a line test and compare the run with them, or another one."""
    position = results.channel("contact_position")
    forces = results.channel("contact_force").T
    time = results.time
    if own.trailing == "the leading one":
        forces = forces[[0, 0]]
    # With places both forces of a row are of the same place, with a clock of the same time.
    trailing = forces[1]
    if not own.by_time:
        its = position[:, 0] if own.trailing == "the leading one" else position[:, 1]
        trailing = np.interp(position[:, 0], its, trailing)
    leading = passed(forces[0], own.cut_off)
    trailing = passed(trailing, own.cut_off)
    height = passed(results.column("head_height", 0), own.cut_off)
    n = time.size
    columns = {
        "F1": own.gain * (leading + noise(rng, n, FORCE_NOISE, own)),
        "F2": trailing + noise(rng, n, FORCE_NOISE, own),
        "h": 1e3 * (height + noise(rng, n, HEIGHT_NOISE, own)),
    }
    if own.trailing == "lowered":
        columns["F2"] = noise(rng, n, FORCE_NOISE, own)
    if own.trailing == "no numbers":
        columns["F2"] = np.full(n, np.nan)
    clock = time if own.by_time else position[:, 0]
    columns["clock"] = clock + own.shift + own.drift * (clock - clock.mean())
    step = int(rng.choice([2, 4, 5]))
    rows = np.stack(list(columns.values()), axis=1)[int(rng.integers(100, 300)) : -100 : step]
    stream = io.StringIO()
    np.savetxt(stream, rows, "%.8g", ",", header=",".join(columns), comments="")
    (folder / "m.csv").write_text(stream.getvalue(), encoding="utf-8")
    x, uplift = results.line("arm_x"), results.extremes("arm_uplift")[1]
    uplift = uplift + HEIGHT_NOISE * rng.normal(size=x.size)
    table = [f"{a:.2f};{1e3 * b:.2f}" for a, b in zip(x, uplift, strict=True)]
    (folder / "u.csv").write_text("\n".join(["x;u", *table]) + "\n", encoding="utf-8")
    others = '[[others]]\npantograph = 2\nforce = { column = "F2" }\n'
    (folder / "m.toml").write_text(
        "[measured]\n"
        f'{"time" if own.by_time else "place"} = {{ column = "clock" }}\n'
        'force = { column = "F1", noise = 5.0 }\n'
        'head_height = { column = "h", unit = "mm", noise = 5.0 }\n'
        f"is_filtered = {str(own.states_filter).lower()}\n"
        f"{others if own.trailing != 'no column' else ''}"
        '[uplift]\nfile = "u.csv"\nplace = { column = "x" }\n'
        'largest = { column = "u", unit = "mm", noise = 5.0 }\n',
        encoding="utf-8",
    )
    path = folder / "m.csv"
    description = read_description(folder / "m.toml")
    run = results if compared is None else compared
    passage = passage_of(read_table(path), path, description, folder, run)
    return compare_with(run, passage)


def clean(rng: np.random.Generator) -> LineTest:
    raw = bool(rng.integers(2))
    return LineTest(bool(rng.integers(2)), not raw, None if raw else 20.0)


def planted(number: int, rng: np.random.Generator) -> tuple[LineTest, set[str]]:
    """A line test with the error of a number, and the kinds of findings that name it."""
    own, sign = clean(rng), float(rng.choice([-1.0, 1.0]))
    match number % 10:
        case 0 | 1:
            return replace(own, by_time=False, shift=7.0 * sign), {"shift"}
        case 2 | 3:
            return replace(own, gain=1.0 + 0.03 * sign), {"gain"}
        case 4:
            return replace(own, cut_off=10.0), {"filter"}
        case 5:
            return replace(own, states_filter=True, cut_off=None), {"filter"}
        case 6:
            kinds = ["lowered", "no numbers", "no column"]
            return replace(own, trailing=str(rng.choice(kinds))), {"missing pantograph"}
        case 7:
            return replace(own, trailing="the leading one"), {"other pantograph"}
        case 8:
            return replace(own, by_time=True, shift=30.0 * sign), {"shift"}
        case _:
            return replace(own, drift=sign * rng.uniform(2e-3, 1e-2)), {"drift"}


def is_right(found: Comparison, own: LineTest, kinds: set[str]) -> bool:
    """Whether just these errors are found, with their values."""
    there = {one.kind for one in found.findings}
    # What drifts about the middle of the file is shifted in the middle of the stretch.
    allowed = kinds | ({"shift"} if "drift" in kinds else set())
    if not kinds <= there or not there <= allowed:
        return False
    shift = own.shift * (SPEED if own.by_time else 1.0)
    # Shifts have deviations of some 0.03 m, gains of 0.4 %: the larger ones have five.
    within = {"shift": (shift, 0.15), "gain": (own.gain, 0.02), "drift": (own.drift, 1.5e-3)}
    return all(
        abs(one.value - within[one.kind][0]) < within[one.kind][1]
        for one in found.findings
        if one.kind in within and one.kind in kinds
    )


def share(run_folder: Path, folder: Path, n: int, errors: bool) -> list[str]:
    """What goes wrong in ``n`` line tests, with or without errors."""
    wrong = []
    with Results(run_folder) as results:
        for number in range(n):
            rng = np.random.default_rng(1000 * errors + number)
            own, kinds = planted(number, rng) if errors else (clean(rng), set())
            found = made(results, own, rng, folder)
            if not is_right(found, own, kinds):
                wrong.append(f"{number} {own}: {[one.text for one in found.findings]}")
    return wrong


@pytest.mark.study
@pytest.mark.parametrize(("errors", "run_folder"), [(True, 0), (False, 1)], indirect=["run_folder"])
def test_planted_errors_are_found_and_none_is_invented(
    errors: bool, run_folder: Path, tmp_path: Path
) -> None:
    assert share(run_folder, tmp_path, 10, errors) == []


@pytest.mark.study
def test_a_model_that_is_not_exact_has_no_errors_of_the_measurement(
    run_folders: list[Path], tmp_path: Path
) -> None:
    """The line test is of a line whose droppers err by other 3 mm: the noise floor tells it."""
    with Results(run_folders[0]) as real, Results(run_folders[1]) as model:
        for number in range(4):
            rng = np.random.default_rng(number)
            found = made(real, clean(rng), rng, tmp_path, model)
            assert [one.text for one in found.findings] == []
            alignment = found.overlays[0].alignment
            # Noise alone leaves 2 N of raw samples and 5 N of filtered ones.
            assert alignment is not None and 5.5 < alignment.residual < 12.0
            shifted = replace(clean(rng), by_time=False, shift=7.0)
            found = made(real, shifted, rng, tmp_path, model)
            assert {one.kind for one in found.findings} == {"shift"}
            for one in found.findings:
                assert one.value == pytest.approx(7.0, abs=0.5)


@pytest.mark.study
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("errors", [True, False])
def test_a_hundred_line_tests_of_each_run(errors: bool, run_folder: Path, tmp_path: Path) -> None:
    wrong = share(run_folder, tmp_path, 100, errors)
    print(f"{100 - len(wrong)} of 100 {'with a planted error' if errors else 'clean'} right")
    assert wrong == []

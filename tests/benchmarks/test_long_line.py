"""A line of 540 km from end to end with a window that moves with the train (`make long-runs`).

``CATENARY_LONG_SPANS`` chooses how long the line is, ``CATENARY_LONG_RESULT`` a folder with a
result of such a run that is to be read in place of a new one. The picture is
`results/long_line.png`.
"""

from __future__ import annotations

import os
from pathlib import Path

import h5py
import matplotlib as mpl
import numpy as np
import pytest
from measuring import check
from program import catenary_started
from scenes import load_scene, problem_of

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

SPANS = int(os.environ.get("CATENARY_LONG_SPANS", "10000"))
RESULT = os.environ.get("CATENARY_LONG_RESULT", "")
SHORT, PICTURE = 80, Path("results/long_line.png")
# The paper's light damping; what is not drawn or compared is not recorded.
LIGHT = ["line.damping.alpha_s=0.00275", "window.mode=bounded", "output.field_every_s=0"]
RECORDED = [
    'output.line_channels=["arm_uplift"]',
    "output.line_channels_every_s=0.05",
    "output.line_channels_window_m=[1000,500]",
]
# A stretch of so many spans every 10 km, 972 m long.
STRETCH, EVERY = 18, 10_000.0
# Sigma of these stretches against that of the short line: the window's own error is below 0.1 %,
# and rows stand a millisecond, 83 mm, apart wherever a span begins.
WITHIN = 1e-3


def scene_words(n_spans: int) -> list[str]:
    end = 100.0 + 54.0 * (n_spans - 5) - 600.0
    return [f"line.n_spans={n_spans}", f"evaluation.to_m={end:g}", *LIGHT, *RECORDED]


def run(n_spans: int, out: Path) -> Path:
    words = ["run", "ambrosio2012", "--force", "-o", str(out), *scene_words(n_spans)]
    with catenary_started(*words, cwd=out.parent) as program:
        done = program.end(7200.0)
    assert done.code == 0, done.stderr
    return out


def sigmas(out: Path, n_spans: int, places: np.ndarray) -> np.ndarray:
    """Standard deviation of the force in stretches that begin at the masts behind places [m]."""
    masts = problem_of(load_scene("ambrosio2012", scene_words(n_spans))).line.support_positions
    with h5py.File(out / "run.h5") as file:
        position = file["channels/contact_position"][:, 0]
        force = file["channels/contact_force"][:, 0]
    begins = np.searchsorted(masts, places)
    rows = np.searchsorted(position, masts[np.stack([begins, begins + STRETCH])])
    return np.array([force[a:b].std() for a, b in rows.T])


def draw(out: Path, picture: Path) -> None:
    """Uplift at the arms against place and time, and as the train sees it."""
    with h5py.File(out / "run.h5") as file:
        time, x = file["line_channels/time"][:], file["line/arm_x"][:]
        train = np.interp(time, file["time"][:], file["channels/contact_position"][:, 0])
        uplift, places, times, ahead = [], [], [], []
        table = file["line_channels/arm_uplift"]
        for first in range(0, len(time), 512):
            last = min(first + 512, len(time))
            near = np.searchsorted(x, [train[first] - 1000.0, train[last - 1] + 500.0])
            block = table[first:last, near[0] : near[1]]
            row, column = np.nonzero(np.isfinite(block))
            uplift.append(1e3 * block[row, column])
            places.append(1e-3 * x[near[0] + column])
            times.append(time[first + row] / 60.0)
            ahead.append(x[near[0] + column] - train[first + row])
    mm, km, minutes, way = map(np.concatenate, (uplift, places, times, ahead))
    figure, axes = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
    for axis, across, bins, label in (
        (axes[0], km, 540, "position [km]"),
        (axes[1], way, 300, "position ahead of the train [m]"),
    ):
        counts, *_ = np.histogram2d(minutes, across, bins=(300, bins))
        total, rows, columns = np.histogram2d(minutes, across, bins=(300, bins), weights=mm)
        mean = np.divide(total, counts, out=np.full_like(total, np.nan), where=counts > 0)
        limit = np.nanpercentile(np.abs(mean), 99.5)
        shown = axis.pcolormesh(columns, rows, mean, cmap="RdBu_r", vmin=-limit, vmax=limit)
        axis.set_xlabel(label)
        axis.set_ylabel("time [min]")
        figure.colorbar(shown, ax=axis, label="mean uplift at the arms [mm]")
    axes[1].axvline(0.0, color="k", linewidth=0.8)
    picture.parent.mkdir(exist_ok=True)
    figure.savefig(picture, dpi=110)
    plt.close(figure)


@pytest.mark.timeout(4 * 3600)
def test_sigma_is_that_of_a_short_line_all_the_way(tmp_path: Path) -> None:
    out = Path(RESULT) if RESULT else run(SPANS, tmp_path / "long")
    with h5py.File(out / "run.h5") as file:
        about = dict(file.attrs)
        last = float(file["channels/contact_position"][-1, 0])
    assert about["n_steps"] > 0.9 * about["n_steps_planned"]
    march, marched = float(about["march_wall_s"]), float(about["marched_s"])
    print(f"\n{last / 1e3:.1f} km in {march:.1f} s of march: {marched / march:.1f} x real time")
    print(f"phases [s]: {about['phase_wall_s']}")
    draw(out, PICTURE)
    short = run(SHORT, tmp_path / "short")
    expected = sigmas(short, SHORT, np.array([2000.0]))[0]
    places = np.arange(EVERY, last - 2000.0, EVERY)
    found = sigmas(out, SPANS, places)
    apart = np.abs(found / expected - 1.0)
    print(f"{places.size} stretches of {STRETCH} spans, largest difference {apart.max():.1e}")
    check("sigma of every tenth kilometre", found, expected, within=WITHIN * expected)

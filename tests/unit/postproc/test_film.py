"""Films: what is drawn where, and what is refused. Pictures are drawn by VTK without a screen."""

from __future__ import annotations

import fcntl
import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import pyvista
from PIL import Image

from catenary.base.errors import InputError
from catenary.mbs.lumped_data import LumpedData
from catenary.mbs.shape import BODY, HEAD, shape_of
from catenary.postproc.files.hdf5.array_writes import set_attribute
from catenary.postproc.files.hdf5.checked import seal_attributes
from catenary.postproc.film import animate, beside_line, pantograph_shape, projection, video
from catenary.postproc.film.animate import SIZE, Wish
from catenary.postproc.film.film_data import FilmData, film_data
from catenary.postproc.film.line_view import LineView
from catenary.postproc.film.pantograph_shape import LOWER_ARM, UPPER_ARM, MovingPantographs
from catenary.postproc.film.projection import Projection
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.film.view import View
from catenary.postproc.read.guard import survives
from catenary.postproc.read.results import Results
from catenary.postproc.record.snapshots.field_layout import Course, FieldRecord
from catenary.postproc.record.snapshots.fields import FieldRecorder

# HDF5's files are examined, and films written, by processes of their own.
pytestmark = pytest.mark.process


@pytest.fixture
def folder(tmp_path: Path, make_march: Any, record_run: Any) -> Path:
    """A run of a second with a snapshot every 50 ms."""
    march = make_march(n_steps=1000, separations=(0.0,))
    fields = FieldRecorder(march.comm, tmp_path / "fields.xdmf", march.recorded, every=50)
    march.drive(fields)
    record_run(tmp_path / "run.h5", march)
    return tmp_path


@pytest.mark.parametrize(
    ("value", "expected"), [(1.0, 1.0), (1.99, 1.5), (7.9, 6.0), (62.0, 60.0), (0.45, 0.4)]
)
def test_factors_are_round_and_never_larger(value: float, expected: float) -> None:
    assert projection.round_down(value) == pytest.approx(expected)


def test_a_drawing_lifts_by_the_factor_of_motions() -> None:
    drawn = projection.Scale(8.0, 60.0).drawn(np.array([5.0, 5.0]), np.array([0.0, 0.05]))
    np.testing.assert_allclose(drawn, [40.0, 43.0])


def test_the_largest_uplift_stays_between_the_wires() -> None:
    found = projection.scale_for(110.0, 6.0, 2.5, 1.2, 0.1)
    assert 0.2 * 1.2 * found.size < found.motion * 0.1 < 0.5 * 1.2 * found.size


@pytest.mark.parametrize("head", [4.2, 5.0, 5.6, 6.4])
def test_arms_keep_their_lengths_and_reach_the_head(head: float) -> None:
    (foot, knee, hinge), ends = pantograph_shape.shape(head, 3.6)
    assert np.hypot(*(knee - foot)) == pytest.approx(LOWER_ARM)
    assert np.hypot(*(hinge - knee)) == pytest.approx(UPPER_ARM)
    np.testing.assert_allclose(hinge, ends.mean(axis=0), atol=1e-12)
    assert hinge[1] == pytest.approx(head) and foot[1] == 3.6


def test_arms_that_would_not_reach_are_stretched() -> None:
    (foot, knee, hinge), _ = pantograph_shape.shape(9.0, 3.6)
    lower, upper = np.hypot(*(knee - foot)), np.hypot(*(hinge - knee))
    assert lower / upper == pytest.approx(LOWER_ARM / UPPER_ARM)
    assert lower > LOWER_ARM and hinge[1] == pytest.approx(9.0)


def test_snapshots_are_those_of_the_fields(folder: Path, make_march: Any) -> None:
    march = make_march(n_steps=1000, separations=(0.0,))
    points = march.mesh.points
    with Snapshots(folder, len(points)) as snapshots:
        np.testing.assert_allclose(snapshots.times, 0.05 * np.arange(21))
        expected = march.wave(0.35, points[:, 0])
        np.testing.assert_allclose(snapshots.uplift(7), expected, atol=1e-8)


def test_what_does_not_move_is_not_drawn_larger() -> None:
    found = projection.scale_for(110.0, 6.0, 2.5, 1.2, 0.0)
    assert found.motion == found.size


def test_each_view_shows_its_two_directions() -> None:
    rest, moved = np.array([[7.0, 0.2, 5.0]]), np.array([[0.5, -0.01, 0.02]])
    drawing = projection.Scale(10.0, 50.0)
    seen = {view: Projection(view, drawing).seen(rest, moved, 3.0)[0] for view in View}
    np.testing.assert_allclose(seen[View.SIDE], [7.5, 3.0, 51.0])
    # To the left is up from above, and left from behind the train.
    np.testing.assert_allclose(seen[View.PLAN], [7.5, 3.0, 1.5])
    np.testing.assert_allclose(seen[View.ALONG], [-1.5, 3.0, 51.0])


def _blown(folder: Path, aside: float) -> None:
    """Let the contact wire of all snapshots stand aside by so much [m]."""
    with h5py.File(folder / "fields.h5", "r+") as file:
        file["contact_wire/displacement"][:, 1] = aside


def test_motions_sideways_are_read_and_seen_from_above(folder: Path) -> None:
    _blown(folder, 0.125)
    with Results(folder) as results:
        data = film_data(results)
        nodes = data.wires["contact_wire"]
        with Snapshots(folder, len(data.points)) as snapshots:
            moved = snapshots.displacement(7)
            np.testing.assert_array_equal(moved[nodes, 1], 0.125)
            np.testing.assert_allclose(moved[:, 2], snapshots.uplift(7))
            assert snapshots.aside_at(7, "contact_wire", 61.3) == 0.125
            assert snapshots.aside_at(7, "messenger_wire", 61.3) == 0.0
            assert snapshots.largest(np.arange(3), 1) == 0.125
            assert snapshots.largest(np.arange(3), 0) == 0.0
            schematic = MovingPantographs(data, snapshots, None)
            numbers = np.array([10, 11])
            reach = {}
            for view in (View.PLAN, View.ALONG):
                wish = Wish(width=60.0, view=view)
                films = animate._pictures(data, results, snapshots, numbers, wish, schematic)
                line = list(films)[0][:440]
                if view is View.PLAN:
                    line = np.swapaxes(line, 0, 1)
                reach[view] = np.ptp(columns_of(line, (0xB2, 0x18, 0x2B), slice(None)))
    # The head is seen across its length of 1.6 m, of 2.6 m from above and some 6 m of height.
    assert 200 < reach[View.PLAN] < 300
    assert 90 < reach[View.ALONG] < 160


def _cut_times(file: h5py.File) -> None:
    file["times"][6:] = np.nan


def _drop_times(file: h5py.File) -> None:
    del file["times"]


def test_snapshots_of_a_killed_run_end_where_it_ended(folder: Path) -> None:
    with h5py.File(folder / "fields.h5", "r+") as file:
        _cut_times(file)
    with Snapshots(folder, 10) as snapshots:
        assert snapshots.times.size == 6


def test_a_run_may_go_on_while_its_snapshots_are_read(folder: Path) -> None:
    """HDF5 locks what it writes, as when a run is continued; nobody waits for a film."""
    with (folder / "fields.h5").open("rb") as writer:
        fcntl.flock(writer, fcntl.LOCK_EX | fcntl.LOCK_NB)
        assert survives(folder / "fields.h5")
        with Snapshots(folder, 10) as snapshots:
            assert snapshots.times.size == 21
        fcntl.flock(writer, fcntl.LOCK_UN)
        with Snapshots(folder, 10):
            fcntl.flock(writer, fcntl.LOCK_EX | fcntl.LOCK_NB)


def test_snapshots_later_than_the_records_that_were_read_are_left_out(folder: Path) -> None:
    """In them pantographs would stand where they were last."""
    with Snapshots(folder, 10, until=0.25) as snapshots:
        np.testing.assert_allclose(snapshots.times, 0.05 * np.arange(6))
    with pytest.raises(InputError, match="fewer than two .* wait for more"):
        Snapshots(folder, 10, until=0.02)


def test_what_cannot_be_shown_is_refused(folder: Path) -> None:
    with Results(folder) as results:
        n_nodes = len(results.line("node_points"))
    with (
        Snapshots(folder, n_nodes + 1) as snapshots,
        pytest.raises(InputError, match="does not belong"),
    ):
        snapshots.uplift(0)
    with h5py.File(folder / "fields.h5", "r+") as file:
        n = file["contact_wire/count"][0]
        file["contact_wire/displacement"][3 * n + 5] = np.nan
    with Snapshots(folder, n_nodes) as snapshots, pytest.raises(InputError, match=r"t = 0\.15 s"):
        snapshots.uplift(3)
    with h5py.File(folder / "fields.h5", "r+") as file:
        _drop_times(file)
    with pytest.raises(InputError, match="times is missing"):
        Snapshots(folder, n_nodes)
    (folder / "fields.h5").write_bytes(b"no file of HDF5")
    with pytest.raises(InputError, match="HDF5 does not read it"):
        Snapshots(folder, n_nodes)
    (folder / "fields.h5").unlink()
    with pytest.raises(InputError, match=r"output\.field_every_s"):
        Snapshots(folder, n_nodes)


def test_masses_are_where_the_snapshots_have_them(folder: Path, make_march: Any) -> None:
    march = make_march(n_steps=1000, separations=(0.0,))
    shape = shape_of(LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0)))
    with Results(folder) as results:
        data = film_data(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            moving = MovingPantographs(data, snapshots, [shape])
            (pose,) = moving.poses(7)
    row = data.row_at(0.35)
    boxes = np.unique(shape.cells[shape.kinds == BODY])
    frame = march.places(0.35)[2]
    wire = data.rest_height(data.position[row])[0]
    np.testing.assert_allclose((pose.now - pose.rest)[boxes, 2], frame - wire)
    head = np.unique(shape.cells[shape.kinds == HEAD])
    np.testing.assert_allclose(pose.now[head, 2], data.head_height[row, 0])
    assert pose.now[head, 0].mean() == pytest.approx(data.position[row, 0])


def test_a_picture_wider_than_the_snapshots_is_refused(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    march = make_march(n_steps=500, separations=(0.0,))
    start = float(march.position(0.0)[0])
    record = FieldRecord(window=(40.0, 30.0), course=Course(start, start, march.speed))
    path = tmp_path / "fields.xdmf"
    march.drive(FieldRecorder(march.comm, path, march.recorded, every=50, record=record))
    record_run(tmp_path / "run.h5", march)
    with pytest.raises(InputError, match=r"--width-m, or a larger output\.field_window_m"):
        animate.animate(tmp_path, Wish(width=150.0), None, progress=False)
    film = animate.animate(tmp_path, Wish(0.1, 0.2, width=60.0), None, progress=False)
    assert film.n_pictures == 3


def test_coaches_carry_all_pantographs() -> None:
    for position in (np.array([100.0]), np.array([100.0, 0.0]), np.array([400.0, 200.0, 31.0])):
        spans = beside_line.coaches(position)
        for x in position:
            on = (spans[:, 0] - beside_line.GAP < x) & (x < spans[:, 1])
            assert on.any()
        np.testing.assert_allclose(spans[:, 1] - spans[:, 0], beside_line.COACH)
        assert beside_line.boxes(position, 3.6).shape == (8 * len(spans), 3)


def test_snapshots_are_chosen_by_time() -> None:
    times = 0.05 * np.arange(21)
    assert animate.chosen(times, Wish()).tolist() == list(range(21))
    assert animate.chosen(times, Wish(0.2, 0.3)).tolist() == [4, 5, 6]
    with pytest.raises(
        InputError, match=r"not two snapshots from 2 to 3 s; they reach from 0 to 1 s"
    ):
        animate.chosen(times, Wish(2.0, 3.0))


def columns_of(picture: np.ndarray, colour: tuple[int, int, int], rows: slice) -> np.ndarray:
    """Columns of a picture with pixels of a colour in some rows."""
    near = (np.abs(picture[rows].astype(int) - colour) < 25).all(axis=2)
    return np.flatnonzero(near.any(axis=0))


def test_the_pantograph_stands_above_its_force_and_the_masts_where_they_are(folder: Path) -> None:
    """In a picture of 100 m a column is 0.087 m wide; lines are seven columns wide at most."""
    with Results(folder) as results:
        data = film_data(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            numbers = animate.chosen(snapshots.times, Wish(0.5, 0.6))
            wish, schematic = Wish(width=100.0), MovingPantographs(data, snapshots, None)
            pictures = list(animate._pictures(data, results, snapshots, numbers, wish, schematic))
    assert [picture.shape for picture in pictures] == [(SIZE[1], SIZE[0], 3)] * 3
    picture = pictures[1]
    red = (0xB2, 0x18, 0x2B)
    lower = slice(int(0.68 * SIZE[1]), int(0.93 * SIZE[1]))
    head = columns_of(picture, red, slice(0, int(0.3 * SIZE[1])))
    assert head.size, "there is a head in the picture"
    curve = columns_of(picture, red, lower)
    # The curve ends below the middle of the head; the legend's sample of its colour is right of it.
    ends = curve[np.append(np.diff(curve) > 40, True)]
    assert np.abs(ends - head.mean()).min() <= 8
    # Below the wires only masts are of their colour; they pass by as far as the train runs.
    first, second = (masts_of(picture) for picture in pictures[:2])
    passed = np.subtract.outer(first, second)
    travelled = float(data.position[data.row_at(0.55), 0] - data.position[data.row_at(0.5), 0])
    a_pixel = travelled / float(passed[(passed > 20) & (passed < 120)].mean())
    np.testing.assert_allclose(np.diff(second) * a_pixel, 50.0, atol=1.0)


def masts_of(picture: np.ndarray) -> np.ndarray:
    """Middles of the masts in a picture [columns]."""
    columns = columns_of(picture, (0xB8, 0xBC, 0xC2), slice(240, 290))
    groups = np.split(columns, np.flatnonzero(np.diff(columns) > 20) + 1)
    return np.array([group.mean() for group in groups])


def test_a_film_is_whole_or_not_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from catenary.postproc.film import video

    (folder / "film.mp4").write_bytes(b"an earlier film")

    def broken(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(video, "_write_mp4", broken)
        with pytest.raises(InputError, match="No space left"):
            animate.animate(folder, Wish(), None, progress=False)
    assert (folder / "film.mp4").read_bytes() == b"an earlier film"
    assert not list(folder.glob(".film*"))


def test_films_have_a_picture_for_each_snapshot(folder: Path) -> None:
    import imageio_ffmpeg
    from PIL import Image, ImageSequence

    film = animate.animate(folder, Wish(start=0.2, rate=10.0), None, progress=False)
    assert film.n_pictures == 17
    # Snapshots 0.05 s apart, shown 0.1 s each.
    assert film.slowed == pytest.approx(2.0)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(film.files[0]))
    assert count == 17 and seconds == pytest.approx(1.7, abs=0.11)
    with Image.open(film.files[1]) as gif:
        assert gif.n_frames == 17 and gif.info["duration"] == 100
        pictures = [np.asarray(picture.convert("RGB")) for picture in ImageSequence.Iterator(gif)]
    changed = [(a != b).mean() for a, b in zip(pictures, pictures[1:], strict=False)]
    assert min(changed) > 1e-3


def test_without_its_libraries_a_film_says_what_is_missing(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animate, "_EGL", "libEGL_that_is_not_there.so.1")
    monkeypatch.setattr(animate.sys, "platform", "linux")
    with pytest.raises(InputError, match="apt-get install libegl1"):
        animate.animate(folder, Wish(), None, progress=False)
    assert not (folder / "film.mp4").exists()


def _drawn_droppers(folder: Path, look: View) -> tuple[FilmData, int, np.ndarray]:
    """The run, the record of its fourth snapshot, and which ends of droppers are drawn there."""
    with Results(folder) as results:
        data = film_data(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            schematic = MovingPantographs(data, snapshots, None)
            plotter = pyvista.Plotter(off_screen=True)
            view = LineView(
                plotter, data, Projection(look, projection.Scale(1.0, 1.0)),
                projection.Colours(2, "uplift", 0.01), schematic, snapshots,
            )  # fmt: skip
            row = data.row_at(float(snapshots.times[3]))
            view.update(row, snapshots.displacement(3), None, schematic.poses(3))
            plotter.close()
    return data, row, np.abs(view._droppers.points).max(axis=1).reshape(-1, 2) < 1e3


def test_from_behind_droppers_beyond_what_is_seen_are_not_drawn(folder: Path) -> None:
    data, row, drawn = _drawn_droppers(folder, View.ALONG)
    x, first = data.points[data.droppers[:, 1], 0], float(data.position[row].max())
    seen = (x >= first - 2.0) & (x <= first + 65.0)
    assert 0 < seen.sum() < seen.size
    # Both ends, or none: a line to nowhere crosses the picture.
    np.testing.assert_array_equal(drawn, np.column_stack([seen, seen]))


def test_droppers_that_are_missing_or_broke_are_not_drawn(folder: Path) -> None:
    # The fourth snapshot is that of 0.15 s.
    defects = [{"type": "missing_dropper", "at_m": 60.0, "wire": "contact_wire", "says": "missing"}]
    incidents = [
        {"type": "dropper_break", "time_s": time, "at_m": x, "says": "breaks"}
        for time, x in ((0.1, 115.0), (0.2, 120.0))
    ]
    # Of earlier versions, which did not say where.
    incidents.append({"type": "dropper_break", "time_s": 0.0, "says": "breaks"})
    with h5py.File(folder / "run.h5", "r+") as file:
        set_attribute(file, "defects", json.dumps(defects))
        set_attribute(file, "incidents", json.dumps(incidents))
        seal_attributes(file, ["defects", "incidents"])
    data, _, drawn = _drawn_droppers(folder, View.SIDE)
    x = data.points[data.droppers[:, 1], 0]
    np.testing.assert_allclose(x[~drawn[:, 0]], [60.0, 115.0])
    np.testing.assert_array_equal(drawn[:, 0], drawn[:, 1])


def test_a_gif_has_colours_that_come_later(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    first = rng.integers(0, 100, (90, 160, 3), dtype=np.uint8)
    second = first.copy()
    second[20:60, 40:100] = (0xE0, 0x82, 0x14)
    files = tmp_path / "film.mp4", tmp_path / "film.gif"
    assert video.write([first, second], (160, 90), 10.0, *files, later=["#e08214"]) == 2
    with Image.open(files[1]) as film:
        film.seek(1)
        shown = np.asarray(film.convert("RGB"))[200, 280].astype(int)
    assert np.abs(shown - (0xE0, 0x82, 0x14)).max() < 12

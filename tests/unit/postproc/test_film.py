"""Films: what is drawn where, in which colour, and what is refused; mostly by the data drawn."""

from __future__ import annotations

import errno
import fcntl
import functools
import itertools
import json
import os
import resource
import shutil
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
from PIL import Image, ImageSequence

from catenary import InputError, RunBroken
from catenary.mbs.lumped import LumpedData
from catenary.mbs.shape import HEAD, shape_of
from catenary.postproc.files.hdf5 import seal_attributes, set_attribute
from catenary.postproc.film import animate, drawing, scenery, video
from catenary.postproc.film.animate import Pictures
from catenary.postproc.film.drawing import ForceChart
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.postproc.film.options import FilmOptions, View
from catenary.postproc.film.scenery import FORCES, PANTOGRAPHS, TRAIN, Projection, Scenery
from catenary.postproc.read.guard import survives
from catenary.postproc.read.results import Results
from catenary.postproc.record.snapshots.contents import Course, FieldRecord
from catenary.postproc.record.snapshots.fields import FieldRecorder
from catenary.postproc.report.pictures.figures import stacked

# HDF5's files are examined, and films written, by processes of their own.
pytestmark = [pytest.mark.process, pytest.mark.usefixtures("examined_here")]


@pytest.fixture(scope="module")
def made_once(
    tmp_path_factory: pytest.TempPathFactory, make_march: Any, record_run: Any
) -> Callable[..., Path]:
    @functools.cache
    def made(every: int, *separations: float) -> Path:
        place = tmp_path_factory.mktemp("film")
        march = make_march(n_steps=1000, separations=separations or (0.0,))
        fields = FieldRecorder(march.comm, place / "fields.xdmf", march.recorded, every=every)
        march.drive(fields)
        record_run(place / "run.h5", march)
        return place

    return made


@pytest.fixture
def recorded(tmp_path: Path, made_once: Callable[..., Path]) -> Callable[..., Path]:
    """Makes runs of a second at 300 km/h with snapshots so many milliseconds apart."""

    def made(every: int, *separations: float) -> Path:
        return shutil.copytree(made_once(every, *separations), tmp_path, dirs_exist_ok=True)

    return made


@pytest.fixture
def folder(recorded: Callable[..., Path]) -> Path:
    """A run of a second with a snapshot every 50 ms, 4.2 m apart."""
    return recorded(50)


@contextmanager
def pictures_of(folder: Path, options: FilmOptions, shapes: Any = None) -> Iterator[Pictures]:
    with Results(folder) as results:
        data = FilmData(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            yield Pictures(results, Scenery(data, snapshots, shapes), snapshots, options)


@pytest.mark.parametrize(
    ("value", "expected"), [(1.0, 1.0), (1.99, 1.5), (7.9, 6.0), (62.0, 60.0), (0.45, 0.4)]
)
def test_factors_are_round_and_never_larger(value: float, expected: float) -> None:
    assert scenery.round_down(value) == pytest.approx(expected)


def test_the_largest_uplift_stays_between_the_wires(folder: Path) -> None:
    with pictures_of(folder, FilmOptions()) as made:
        scale, data = made.drawing._projection.scale, made._scenery.data
        largest = made.drawing._colours.high
    between = scenery.room_between(data)
    assert 0.2 * between * scale.size < scale.motion * largest < 0.5 * between * scale.size


def test_what_does_not_move_is_not_drawn_larger(folder: Path) -> None:
    with pictures_of(folder, FilmOptions()) as made:
        picture, data = made.drawing._picture, made._scenery.data
    found = picture.scale(data, np.zeros((2, 3)), None)
    assert found.motion == found.size
    assert picture.scale(data, np.zeros((2, 3)), 70.0).motion == 70.0


def test_snapshots_are_those_of_the_fields(folder: Path, make_march: Any) -> None:
    march = make_march(n_steps=1000, separations=(0.0,))
    points = march.mesh.points
    with Snapshots(folder, len(points)) as snapshots:
        np.testing.assert_allclose(snapshots.times, 0.05 * np.arange(21))
        expected = march.wave(0.35, points[:, 0])
        np.testing.assert_allclose(snapshots.uplift(7), expected, atol=1e-8)


def test_each_view_shows_its_two_directions() -> None:
    rest, moved = np.array([[7.0, 0.2, 5.0]]), np.array([[0.5, -0.01, 0.02]])
    scale = scenery.Scale(10.0, 50.0)
    seen = {view: Projection(view, scale, 4.0).seen(rest, moved, -10.0)[0] for view in View}
    np.testing.assert_allclose(seen[View.SIDE], [7.5, 51.0])
    # To the left is up from above, and farther away from the right and above.
    np.testing.assert_allclose(seen[View.PLAN], [7.5, 1.5])
    np.testing.assert_allclose(seen[View.OBLIQUE], [7.5 + 0.25 * 1.5, 51.0 + 0.35 * 1.5])
    # From behind it is left, and what is 17.5 m from the eye is smaller than at 12 m.
    near = 12.0 / 17.5
    np.testing.assert_allclose(seen[View.ALONG], [-1.5 * near, 40.0 + 11.0 * near])


def _blown(folder: Path, aside: float) -> None:
    """Let the contact wire of all snapshots stand aside by so much [m]."""
    with h5py.File(folder / "fields.h5", "r+") as file:
        file["contact_wire/displacement"][:, 1] = aside


def test_motions_sideways_are_read_and_seen_from_above(folder: Path) -> None:
    _blown(folder, 0.125)
    with Results(folder) as results:
        data = FilmData(results)
        nodes = data.wires["contact_wire"]
        with Snapshots(folder, len(data.points)) as snapshots:
            moved = snapshots.displacement(7)
            np.testing.assert_array_equal(moved[nodes, 1], 0.125)
            np.testing.assert_array_equal(moved[data.wires["messenger_wire"], 1], 0.0)
            np.testing.assert_allclose(moved[:, 2], snapshots.uplift(7))
            extremes = snapshots.extremes(np.arange(3))
            np.testing.assert_array_equal(extremes[:, :2], [[0.0, 0.0], [0.0, 0.125]])
            places = Scenery(data, snapshots).beside(0.35, snapshots.frame(0.35))
    np.testing.assert_allclose(places[FORCES].moved[:, 1], 0.125)
    with pictures_of(folder, FilmOptions(view=View.PLAN, motion=5.0)) as made:
        made.show(0.35)
        lines = np.array(made.drawing.wires.get_segments())
        shown = np.asarray(made.drawing.wires.get_array())
    aside = 5.0 * 0.125
    assert set(np.unique(np.round(lines[..., 1], 9))) == {0.0, aside}
    np.testing.assert_allclose(shown[lines[:, 0, 1] > 0.1], 125.0)


def test_between_snapshots_the_line_moves_on(
    recorded: Callable[..., Path], make_march: Any
) -> None:
    """Of a hump of 60 mm, exp(-(x / 9 m)^2), that moves by h = 1.67 m between two snapshots, four
    points leave an error of some (h / 9 m)^3 / 12 of its height, below 0.1 %.
    """
    march = make_march(n_steps=1000, separations=(0.0,))
    points = march.mesh.points
    with Snapshots(recorded(20), len(points)) as snapshots:
        np.testing.assert_array_equal(snapshots.frame(0.34).moved, snapshots.displacement(17))
        frame = snapshots.frame(0.353)
    ahead = points[:, 0] - march.position(0.353)[0]
    error = np.abs(frame.moved[:, 2] - march.wave(0.353, points[:, 0]))
    # Four points around the bend of the wire at the head see it up to two distances away.
    assert error[np.abs(ahead) > 2.0 * 1.67].max() < 0.06e-3
    # There its slope jumps by 0.02 times 0.35 / m, which a curve rounds off over a distance.
    assert 0.1e-3 < error.max() < 0.02 * 0.35 * 1.67 / 4.0
    ((base, places),) = frame.places
    assert base == 0.0
    np.testing.assert_allclose(places, march.places(0.353)[1:], atol=1e-4)


def test_a_point_that_one_snapshot_lacks_is_taken_from_the_nearest(folder: Path) -> None:
    with Snapshots(folder, 10) as snapshots:
        snapshots._n_nodes = len(snapshots._wires["contact_wire"].block.points) * 2
        snapshots._of_this_line = True
        whole = snapshots.frame(0.36).moved
        snapshots._kept.clear()
        lacking = snapshots._frame(9)
        lacking.moved[3] = np.nan
        found = snapshots.frame(0.36).moved
    np.testing.assert_allclose(np.delete(found, 3, axis=0), np.delete(whole, 3, axis=0))
    assert np.isfinite(found).all()


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
    """But for the head, which is at the wire that it presses on, and its arms in proportion."""
    march = make_march(n_steps=1000, separations=(0.0,))
    shape = shape_of(LumpedData((7.2, 15.0), (4200.0, 50.0), (10.0, 90.0)))
    with Results(folder) as results:
        data = FilmData(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            found = Scenery(data, snapshots, [shape])
            frame = snapshots.frame(0.35)
            places = found.beside(0.35, frame)
    rest, moved = places[PANTOGRAPHS]
    row = data.row_at(0.35)
    x, wire = data.position[row, 0], data.rest_height(data.position[row])[0]
    head = np.unique(shape.cells[shape.kinds == HEAD])
    nodes = data.wires["contact_wire"]
    lifted = np.interp(x, data.points[nodes, 0], frame.moved[nodes, 2])
    np.testing.assert_allclose((rest + moved)[head, 2], wire + lifted)
    assert rest[head, 0].mean() == pytest.approx(x)
    apex = 1 + int(head.max()) + 1
    # The base stands on the roof, whatever the height of the wire above.
    assert rest[:, 2].min() == pytest.approx(found.roof)
    assert wire - rest[apex, 2] == pytest.approx(0.25 / shape.below * (wire - found.roof))
    more = wire + lifted - data.head_height[row, 0]
    expected = march.places(0.35)[2] - wire + (1.0 - 0.25 / shape.below) * more
    assert moved[apex, 2] == pytest.approx(expected)
    np.testing.assert_allclose(places[FORCES].moved[0], [0.0, 0.0, lifted])


def test_a_head_that_touches_nothing_is_where_it_is(folder: Path) -> None:
    with h5py.File(folder / "run.h5", "r+") as file:
        file["channels/contact_force"][...] = 0.0
    with Results(folder) as results:
        data = FilmData(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            rest, moved = Scenery(data, snapshots).beside(0.35, snapshots.frame(0.35))[FORCES]
    row = data.row_at(0.35)
    assert rest[0, 2] + moved[0, 2] == pytest.approx(data.head_height[row, 0])


@pytest.mark.study
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
        animate.animate(tmp_path, FilmOptions(width=150.0), None, progress=False)
    film = animate.animate(tmp_path, FilmOptions(0.1, 0.2, width=60.0), None, progress=False)
    assert film.n_pictures == 3


def test_a_film_of_a_stretch_is_of_the_time_when_the_train_is_there(
    tmp_path: Path, make_march: Any, record_run: Any
) -> None:
    march = make_march(n_steps=1000, separations=(0.0,))
    x = march.position(0.0)[0], march.position(1.0)[0]
    stretch = x[0] + 0.4 * (x[1] - x[0]), x[0] + 0.9 * (x[1] - x[0])
    path = tmp_path / "fields.xdmf"
    march.drive(
        FieldRecorder(
            march.comm, path, march.recorded, every=50, record=FieldRecord(stretch=stretch)
        )
    )
    record_run(tmp_path / "run.h5", march)
    with pictures_of(tmp_path, FilmOptions()) as pictures:
        # Half the stretch fills a picture, 0.55 of which is behind the train; with 50 ms between
        # snapshots, and 3 m by which a picture may reach beyond them.
        assert 0.4 + 0.275 * 0.5 - 0.09 <= pictures.times[0] <= 0.4 + 0.275 * 0.5 + 0.05
        assert 0.9 - 0.225 * 0.5 - 0.05 <= pictures.times[-1] <= 0.9 - 0.225 * 0.5 + 0.09
        assert pictures.left_out + len(pictures) == 21
        for time in pictures.times.tolist():
            pictures.show(time)
    with pytest.raises(InputError, match="where the train is; the first shows it from"):
        animate.animate(tmp_path, FilmOptions(0.0, 0.2), None, progress=False)


def test_a_film_needs_wires(tmp_path: Path, make_march: Any, record_run: Any) -> None:
    march = make_march(n_steps=200, separations=(0.0,))
    path, record = tmp_path / "fields.xdmf", FieldRecord(parts=("droppers",))
    march.drive(FieldRecorder(march.comm, path, march.recorded, every=50, record=record))
    record_run(tmp_path / "run.h5", march)
    with pytest.raises(InputError, match=r"no wire of the line.*output\.field_parts"):
        animate.animate(tmp_path, FilmOptions(), None, progress=False)


def test_coaches_carry_all_pantographs() -> None:
    for position in (np.array([100.0]), np.array([100.0, 0.0]), np.array([400.0, 200.0, 31.0])):
        spans = scenery.coaches(position)
        for x in position:
            on = (spans[:, 0] - scenery.GAP < x) & (x < spans[:, 1])
            assert on.any()
        np.testing.assert_allclose(spans[:, 1] - spans[:, 0], scenery.COACH)


def test_pantographs_stand_on_the_roof_and_reach_the_wire(recorded: Callable[..., Path]) -> None:
    with pictures_of(recorded(50, 0.0, 40.0), FilmOptions()) as made:
        found = made._scenery
        made.show(0.35)
        bodies = np.array(made.drawing.bodies.get_segments())
        train = made.drawing._train.get_paths()
        wires = np.array(made.drawing.wires.get_segments())
        size = made.drawing._projection.scale.size
    number = found.parts[PANTOGRAPHS].fields["number"]
    position = found.data.position[found.data.row_at(0.35)]
    roof = max(path.vertices[:, 1].max() for path in train)
    assert roof == pytest.approx(size * found.roof)
    assert len(found.parts[TRAIN].cells) == 6 * len(train) // 6
    for p, x in enumerate(position):
        own = bodies[number == p]
        assert own[..., 1].min() == pytest.approx(roof)
        near = np.unique(wires[np.abs(wires[:, 0, 0] - x) < 3.0].reshape(-1, 2), axis=0)
        contact = near[near[:, 1] < size * 5.9]
        # The sag of the chord over a node's distance is all that a head is off a wire.
        above = np.interp(x, contact[:, 0], contact[:, 1])
        assert own[..., 1].max() == pytest.approx(above, abs=1e-6)


def test_views_are_chosen_by_what_lies_beside_each_other(folder: Path) -> None:
    with Results(folder) as results:
        data = FilmData(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            assert Scenery(data, snapshots).best_view is View.SIDE
            data.points[3, 1] = 0.2
            assert Scenery(data, snapshots).best_view is View.OBLIQUE


def test_the_camera_goes_with_either_pantograph(recorded: Callable[..., Path]) -> None:
    place = recorded(50, 0.0, 40.0)
    seen = {}
    for camera in (None, "leading", "2"):
        with pictures_of(place, FilmOptions(camera=camera)) as made:
            made.show(0.5)
            position = made._scenery.data.position[made._scenery.data.row_at(0.5)]
            low, high = made.drawing.chart.get_xlim()
        seen[camera] = low + 0.55 * (high - low), high - low
    assert seen[None][0] == pytest.approx(position.mean())
    assert seen["leading"][0] == pytest.approx(position[0])
    assert seen["2"][0] == pytest.approx(position[1])
    assert seen[None][1] == pytest.approx(seen["2"][1] + 1.1 * 40.0)
    for wrong in ("3", "0", "middle"):
        with pytest.raises(InputError, match="'leading', 'trailing', or a number from 1 to 2"):
            animate.followed(made._scenery.data, wrong)


def test_snapshots_are_chosen_by_time() -> None:
    times = 0.05 * np.arange(21)
    assert animate.chosen(times, FilmOptions()).tolist() == list(range(21))
    assert animate.chosen(times, FilmOptions(0.2, 0.3)).tolist() == [4, 5, 6]
    with pytest.raises(
        InputError, match=r"not two snapshots from 2 to 3 s; they reach from 0 to 1 s"
    ):
        animate.chosen(times, FilmOptions(2.0, 3.0))


def test_pictures_are_equally_far_apart_along_the_track() -> None:
    shown = 0.04 * np.arange(26)
    times = animate.times_of_pictures(shown, 80.0, 1.0)
    np.testing.assert_allclose(80.0 * np.diff(times), 1.0)
    assert times[0] == 0.0 and times[-1] == pytest.approx(1.0)
    # Farther than the train travels, the begin and the end.
    np.testing.assert_allclose(animate.times_of_pictures(shown, 80.0, 1e4), [0.0, 1.0])
    # Too far apart to be interpolated, and nothing that travels.
    for speed in (120.0, 0.0):
        np.testing.assert_array_equal(animate.times_of_pictures(shown, speed, 1.0), shown)


def test_the_drawing_has_forces_places_and_colours_of_the_run(
    recorded: Callable[..., Path],
) -> None:
    with pictures_of(recorded(50, 0.0, 40.0), FilmOptions(width=100.0)) as made:
        made.show(0.5)
        found, data = made.drawing, made._scenery.data
        row = data.row_at(0.5)
        texts = [text.get_text() for text in found.values]
        words = found.words.get_text()
        written = [text.get_text() for text in found.figure.texts]
        ends = [curve[0].get_xydata()[-1] for curve in made.chart.curves]
        first = [curve[0].get_xydata()[0, 0] for curve in made.chart.curves]
        limits = made.drawing.chart.get_xlim()
        uplift, lines = np.asarray(found.wires.get_array()), np.array(found.wires.get_segments())
        norm = found.wires.norm
        made.show(0.55)
        later = found.chart.get_xlim()
    assert texts == [f"{force:.0f} N" for force in data.force[row]]
    assert words == "t = 0.50 s   300 km/h"
    assert written[0] == data.title
    assert any("heights × " in own and "motion × " in own and "schematic" in own for own in written)
    np.testing.assert_allclose(ends, np.column_stack([data.position[row], data.force[row]]))
    # Nothing is drawn from before the run or far behind the picture.
    assert min(first) >= min(data.position[0].min(), limits[0]) - 0.1
    assert limits[1] - limits[0] == pytest.approx(100.0)
    assert later[0] - limits[0] == pytest.approx(0.05 * 300.0 / 3.6)
    # Colours are those of the uplift of the nodes, and use their scale.
    node = np.abs(data.points[:, 0] - lines[10, 0, 0]).argmin()
    assert uplift.max() == pytest.approx(60.0, abs=25.0)
    assert norm.vmin <= uplift.min() and 0.75 * norm.vmax < uplift.max() <= 1.05 * norm.vmax
    assert norm.vmin > -0.7 * norm.vmax and node >= 0


def test_the_chart_shows_what_was_before_the_film_and_none_of_what_will_be(
    recorded: Callable[..., Path],
) -> None:
    """A film from 0.5 s on: the force since the left end of its first picture, and nothing of a
    pantograph that is behind it."""
    with pictures_of(
        recorded(50, 0.0, 40.0), FilmOptions(0.5, 0.9, width=50.0, camera="1")
    ) as made:
        made.show(0.5)
        low, high = made.drawing.chart.get_xlim()
        data = made._scenery.data
        leading, trailing = (curve[0].get_xydata() for curve in made.chart.curves)
        at, behind = data.position[data.row_at(0.5)]
    assert behind < low < at < high
    begin = max(low, data.position[0, 0])
    assert leading[0, 0] == pytest.approx(begin, abs=0.1) and leading[-1, 0] == at
    assert np.all(trailing[:, 0] <= behind)


def test_values_of_forces_stand_above_the_wires(folder: Path) -> None:
    """No wire, arrow or body passes through the box of a value, whose height is 17 pt."""
    for view in (View.SIDE, View.OBLIQUE, View.PLAN):
        with pictures_of(folder, FilmOptions(view=view)) as made:
            made.show(0.5)
            made.drawing.pixels()
            drawn = made.drawing
            box = drawn.values[0].get_window_extent()
            ends = [np.concatenate(part.get_segments()) for part in
                    (drawn.wires, drawn.bodies, drawn._arrows)]  # fmt: skip
            seen = drawn._axes.transData.transform(np.concatenate(ends))
        beside = (seen[:, 0] > box.x0) & (seen[:, 0] < box.x1)
        assert beside.sum() > 4 and seen[beside, 1].max() < box.y0


def test_scales_of_colours_are_of_what_pictures_show(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A wire that is lifted 0.5 m where no picture is changes no colour."""
    options = FilmOptions(0.3, 0.5, width=40.0)
    with pictures_of(folder, options) as made:
        before = made.drawing._colours
        unseen = ~np.any([made._seen(number) for number in range(6, 11)], axis=0)
    assert 10 < unseen.sum() < unseen.size - 10
    usual = Snapshots.displacement

    def lifted(self: Snapshots, number: int) -> np.ndarray:
        moved = usual(self, number).copy()
        moved[unseen, 2] = 0.5
        return moved

    monkeypatch.setattr(Snapshots, "displacement", lifted)
    with pictures_of(folder, options) as made:
        assert made.drawing._colours == before
        assert made._snapshots.extremes(np.arange(6, 11))[1, 2] == 0.5


def test_slack_droppers_are_dashed_and_others_have_the_colour_of_their_force(folder: Path) -> None:
    with pictures_of(folder, FilmOptions()) as made:
        made.show(0.5)
        shown, slack = made.drawing.droppers, made.drawing.slack
        taut, loose = (np.array(one.get_segments())[:, 0, 0] for one in (shown, slack))
        forces, (_, dashes) = np.asarray(shown.get_array()), slack.get_linestyles()[0]
        expected, data = made._dropper_forces(0.5), made._scenery.data
        colours = shown.cmap(shown.norm([0.0, shown.norm.vmax]))
    x = data.points[data.droppers[:, 0], 0]
    assert loose.size and dashes is not None
    np.testing.assert_allclose(np.interp(taut, x, expected), forces)
    assert (forces > 0.0).all() and (np.interp(loose, x, expected) <= 0.0).all()
    # Light to dark, which is seen without colours too.
    assert colours[0, :3].sum() > 2.0 > 0.6 > colours[1, :3].sum()


def test_scales_of_colours_grow_lighter_or_darker_all_the_way() -> None:
    weights = np.array([0.2126, 0.7152, 0.0722])
    for stops in (scenery.MOTIONS, scenery.DROPPER_FORCES):
        light = drawing.ramp(stops)(np.linspace(0.0, 1.0, 64))[:, :3] @ weights
        assert (np.diff(light) > 0.0).all() or (np.diff(light) < 0.0).all()


def test_titles_of_any_length_end_before_the_scales(folder: Path) -> None:
    with h5py.File(folder / "run.h5", "r+") as file:
        set_attribute(file, "title", "A line with $ and _ " * 10)
        seal_attributes(file, ["title"])
    with pictures_of(folder, FilmOptions()) as made:
        made.show(0.5)
        made.drawing.pixels()
        figure = made.drawing.figure
        renderer = figure.canvas.get_renderer()
        title = figure.texts[0].get_window_extent(renderer)
        scales = [axes.get_tightbbox(renderer) for axes in figure.axes[2:]]
    assert title.x1 < min(one.x0 for one in scales)
    # Nothing else is where the scales are: the line begins below.
    assert min(one.y0 for one in scales) > made.drawing._axes.get_window_extent(renderer).y1


def test_pixels_are_those_of_what_is_drawn(folder: Path) -> None:
    """The first picture again after others is the same, and its dot has the pantograph's colour."""
    with pictures_of(folder, FilmOptions(0.2, 0.4)) as made:
        shown = iter(made)
        first, second = np.array(next(shown)), np.array(next(shown))
        made.show(float(made.times[0]))
        again = np.array(made.drawing.pixels())
        (raw, _), axes = made.chart.curves[0], made.drawing.chart
        column, height = axes.transData.transform(raw.get_xydata()[-1])
    assert first.shape == (drawing.SIZE[1], drawing.SIZE[0], 4)
    np.testing.assert_array_equal(first, again)
    assert (first != second).any(axis=2).mean() > 1e-3
    dot = again[drawing.SIZE[1] - int(height) - 1, int(column), :3].astype(int)
    assert np.abs(dot - (0x00, 0x72, 0xB2)).max() < 12


def test_every_view_draws_the_line(folder: Path) -> None:
    _blown(folder, 0.05)
    for view in View:
        with pictures_of(folder, FilmOptions(view=view)) as made:
            made.show(0.5)
            low, high = made.drawing._axes.get_xlim()
            lines = np.array(made.drawing.wires.get_segments())
            inside = (lines[..., 0] > low) & (lines[..., 0] < high)
            assert inside.sum() > 50, view
            head = np.array(made.drawing.bodies.get_segments())
            assert ((head[..., 0] > low) & (head[..., 0] < high)).all(), view


def test_a_film_is_whole_or_not_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "film.mp4").write_bytes(b"an earlier film")

    def broken(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(video, "_encode", broken)
        with pytest.raises(RunBroken, match="No space left"):
            animate.animate(folder, FilmOptions(), None, progress=False)
    assert (folder / "film.mp4").read_bytes() == b"an earlier film"
    assert not list(folder.glob(".film*"))


def test_films_have_a_picture_for_each_snapshot_that_is_far_from_others(folder: Path) -> None:
    import imageio_ffmpeg

    film = animate.animate(folder, FilmOptions(start=0.6, rate=10.0), None, progress=False)
    assert film.n_pictures == 9 and not film.smooth
    # Snapshots 0.05 s apart, shown 0.1 s each.
    assert film.slowed == pytest.approx(2.0)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(film.files[0]))
    assert count == 9 and seconds == pytest.approx(0.9, abs=0.11)
    with Image.open(film.files[1]) as gif:
        assert gif.n_frames == 9 and gif.info["duration"] == 100
        pictures = [np.asarray(picture.convert("RGB")) for picture in ImageSequence.Iterator(gif)]
    changed = [(a != b).mean() for a, b in zip(pictures, pictures[1:], strict=False)]
    assert min(changed) > 1e-3
    # A GIF has the colours of the pantograph's curve and of slack droppers, within its palette.
    for colour in ((0x00, 0x72, 0xB2), (0xD6, 0x00, 0x6C)):
        off = np.abs(pictures[4].astype(int) - colour).max(axis=2)
        assert (off < 30).sum() > 20


@pytest.mark.study
def test_a_film_is_smooth_where_snapshots_are_near(recorded: Callable[..., Path]) -> None:
    options = FilmOptions(0.3, 0.4, every=1.0)
    film = animate.animate(recorded(20), options, None, progress=False)
    assert film.smooth and film.n_pictures == 9
    # A metre a picture, 25 pictures a second: 25 m/s of 83.3 m/s.
    assert film.slowed == pytest.approx(83.333 / 25.0, rel=1e-3)


def test_without_its_library_a_film_says_what_is_missing(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(animate.sys.modules, "imageio_ffmpeg", None)
    monkeypatch.delitem(animate.sys.modules, "catenary.postproc.film.video", raising=False)
    monkeypatch.delattr("catenary.postproc.film.video", raising=False)
    with pytest.raises(InputError, match=r"imageio_ffmpeg.*pip install 'catenary\[film\]'"):
        animate.animate(folder, FilmOptions(), None, progress=False)
    assert not (folder / "film.mp4").exists()


def _drawn_droppers(folder: Path, view: View) -> tuple[Any, int, np.ndarray]:
    """The run, the record of its fourth snapshot, and which droppers are drawn there, by their
    forces, which are set to their numbers."""
    with pictures_of(folder, FilmOptions(view=view, width=400.0)) as made:
        data, frame = made._scenery.data, made._snapshots.frame(0.15)
        row = data.row_at(0.15)
        beside = made._scenery.beside(0.15, frame)
        numbers = 1.0 + np.arange(len(data.droppers))
        middle = float(data.position[row, 0])
        made.drawing.update(row, frame.moved, beside, numbers, (middle - 220.0, middle + 180.0))
        found = np.asarray(made.drawing.droppers.get_array()) - 1.0
        lines = np.array(made.drawing.droppers.get_segments())
    assert len(lines) == found.size
    drawn = np.zeros(len(data.droppers), dtype=bool)
    drawn[found.astype(int)] = True
    return data, row, drawn


def test_from_behind_droppers_beyond_what_is_seen_are_not_drawn(folder: Path) -> None:
    data, row, drawn = _drawn_droppers(folder, View.ALONG)
    x, first = data.points[data.droppers[:, 1], 0], float(data.position[row].max())
    seen = (x >= first - 10.0) & (x <= first + 65.0)
    assert 0 < seen.sum() < seen.size
    np.testing.assert_array_equal(drawn, seen)


def test_from_behind_pantographs_behind_the_eye_are_not_drawn(
    recorded: Callable[..., Path],
) -> None:
    """The eye goes with the camera's pantograph; one 40 m behind would fill the picture."""
    place = recorded(50, 0.0, 40.0)
    drawn = {}
    for camera in (None, "leading", "trailing"):
        with pictures_of(place, FilmOptions(camera=camera, view=View.ALONG)) as made:
            made.show(0.5)
            numbers = made._scenery.parts[PANTOGRAPHS].fields["number"]
            shown = [one.size > 0 for one in made.drawing.bodies.get_segments()]
            drawn[camera] = {int(p) for p, there in zip(numbers, shown, strict=True) if there}
            assert [text.get_visible() for text in made.drawing.values] == [
                p in drawn[camera] for p in (0, 1)
            ]
    assert drawn == {None: {0}, "leading": {0}, "trailing": {0, 1}}


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
    np.testing.assert_allclose(x[~drawn & (x < 200.0)], [60.0, 115.0])


@pytest.mark.parametrize(
    ("low", "numbers"), [(-37.0, [-37.0, 0.0, 85.0]), (-7.4, [-7.4, 85.0]), (0.0, [0.0, 85.0])]
)
def test_numbers_below_a_scale_of_colours_do_not_touch(
    folder: Path, low: float, numbers: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    ends = scenery.Colours(2, "uplift", 1e-3 * low, 0.085)
    monkeypatch.setattr(scenery.Picture, "colours", lambda *_: ends)
    with pictures_of(folder, FilmOptions()) as made:
        made.drawing.pixels()
        below = made.drawing.figure.axes[2].xaxis
        assert below.get_majorticklocs() == pytest.approx(numbers)
        boxes = [text.get_window_extent() for text in below.get_ticklabels()]
    assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))


def test_a_gif_has_colours_that_come_later(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    first = rng.integers(0, 100, (90, 160, 4), dtype=np.uint8)
    second = first.copy()
    second[20:60, 40:100, :3] = (0xD6, 0x00, 0x6C)
    files = tmp_path / "film.mp4", tmp_path / "film.gif"
    assert video.write([first, second], (160, 90), 10.0, *files, [scenery.SLACK]) == 2
    with Image.open(files[1]) as film:
        film.seek(1)
        shown = np.asarray(film.convert("RGB"))[200, 350].astype(int)
    assert np.abs(shown - (0xD6, 0x00, 0x6C)).max() < 12


def test_what_ffmpeg_says_is_told(tmp_path: Path) -> None:
    picture = np.zeros((90, 160, 4), dtype=np.uint8)
    files = tmp_path / "nowhere" / "film.mp4", tmp_path / "nowhere" / "film.gif"
    with pytest.raises(RunBroken, match=r"nowhere/film.mp4 failed \(.*No such file or directory"):
        video.write([picture] * 3, (160, 90), 10.0, *files)


def test_a_folder_without_write_access_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On such a disk the removal of files that are not there fails too."""

    def refuse(*_: Any, **__: Any) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "unlink", refuse)
    files = tmp_path / "film.mp4", tmp_path / "film.gif"
    with pytest.raises(RunBroken, match="Read-only file system.*choose another output folder"):
        video.write([np.zeros((90, 160, 4), dtype=np.uint8)], (160, 90), 10.0, *files)


@pytest.mark.study
def test_memory_does_not_grow_with_a_film(tmp_path: Path) -> None:
    """300 pictures are 69 MB, and those of the GIF, 800 pixels wide, 108 MB."""
    ground = np.zeros((180, 320, 4), dtype=np.uint8)
    ground[:, :160, 0] = np.arange(160)
    files = tmp_path / "film.mp4", tmp_path / "film.gif"
    known: list[weakref.ref[Any]] = []

    class Watched(np.ndarray):
        pass

    def pictures(n: int) -> Iterator[np.ndarray]:
        for k in range(n):
            picture = np.roll(ground, k, axis=1).view(Watched)
            known.append(weakref.ref(picture))
            assert sum(one() is not None for one in known) <= 3
            yield picture

    largest = []
    for n in (20, 300):
        assert video.write(pictures(n), (320, 180), 12.5, *files) == n
        # Of all processes that have ended, ffmpeg is the largest [kB].
        largest.append(1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
    assert largest[1] < largest[0] + 25e6


@pytest.mark.parametrize("filtered", [[[5.0], [-12.0], [40.0], [900.0]], [[np.nan]] * 4])
def test_the_chart_holds_the_filtered_force_below_zero(filtered: list[list[float]]) -> None:
    """After a loss of contact the filter swings below zero; later records do not count."""
    force = np.array([[0.0], [0.0], [35.0], [900.0]])
    data: Any = SimpleNamespace(
        force=force, filtered=np.array(filtered), names=["pantograph"], excitation=None
    )
    _, (axes,) = stacked(3.0, 1)
    ForceChart(axes, data, (0, 3), 100.0)
    low, high = axes.get_ylim()
    shown = np.concatenate([force[:3], np.array(filtered)[:3]])
    assert low <= np.nanmin(shown) and np.nanmax(shown) <= high < 100.0

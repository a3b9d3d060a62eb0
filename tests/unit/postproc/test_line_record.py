"""What is recorded of the line: windows, cadence, names, rows, several contact wires."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from contact_wires import overlap, problem_on, twins
from mpi4py import MPI
from small_lines import mesh_of
from studies import few

from catenary.meshgen.line import Line
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate import statistics
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.files.facts import facts_of
from catenary.postproc.files.header import (
    GZIP,
    Header,
    LineRecord,
    line_datasets,
    record_words,
    static_datasets,
    wire_roles,
)
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.read.results import ContactProfile, LineOfRun, Results
from catenary.postproc.record.recorder import LineGather, Recorder
from catenary.postproc.report.pictures import figures, force_pictures, line_pictures
from catenary.postproc.report.report import write_report
from catenary.postproc.report.sections.line import dropper_table
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March
from catenary.solver.time_loop.views.channels import TrainLayout, line_channels_of_all
from catenary.solver.time_loop.views.observers import Stage
from catenary.solver.window.moving_columns import Columns, MovingColumns

# --- what is recorded of the line's channels ------------------------------------------------------


N_STEPS, FLUSH = 3000, 400
# A train on a line without stops, whose wires do not move along the track.
USUAL = TrainLayout((1,))
WINDOW = (120.0, 80.0)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, make_march: Any, record_run: Any) -> Path:
    path = tmp_path_factory.mktemp("whole") / "run.h5"
    return record_run(path, make_march(n_steps=N_STEPS), flush_every=FLUSH)


def expected(whole: Results, name: str, record: LineRecord) -> np.ndarray:
    """A channel as ``record`` has it, from the record of everything."""
    values = whole.channel(name)[:: record.every]
    x = whole.line("arm_x" if name == "arm_uplift" else "dropper_x")
    if name not in record.names:
        return np.full_like(values, np.nan)
    if record.window is not None:
        position = whole.channel("contact_position")[:: record.every]
        low = position.min(axis=1) - record.window[0]
        high = position.max(axis=1) + record.window[1]
        inside = (x >= low[:, None]) & (x <= high[:, None])
        values = np.where(inside, values, np.nan)
    if record.stretch is not None:
        values[:, (x < record.stretch[0]) | (x > record.stretch[1])] = np.nan
    return values


RECORDS = {
    "thinned": LineRecord(every=7),
    "window": LineRecord(window=WINDOW),
    "both": LineRecord(every=5, window=WINDOW, compression=GZIP),
    "stretch": LineRecord(stretch=(250.0, 400.0)),
    "all of them": LineRecord(every=3, window=WINDOW, stretch=(250.0, 400.0), compression=GZIP),
    "one channel": LineRecord(names=("arm_uplift",)),
    "no channel": LineRecord(names=()),
    "compressed": LineRecord(compression=GZIP),
}


@pytest.mark.parametrize("name", few(RECORDS, "all of them", "window", "thinned"))
def test_a_part_of_the_record_is_that_of_the_whole_one(
    tmp_path: Path, make_march: Any, record_run: Any, whole: Path, name: str
) -> None:
    record = RECORDS[name]
    path = record_run(
        tmp_path / "run.h5", make_march(n_steps=N_STEPS), flush_every=FLUSH, record=record
    )
    with Results(whole) as everything, Results(path) as part:
        assert part.line_record == record.of(USUAL)
        np.testing.assert_array_equal(part.line_time, everything.time[:: record.every])
        for channel in line_channels_of_all():
            values = expected(everything, channel, record)
            np.testing.assert_array_equal(part.channel(channel), values, channel)
            blocks = list(part.blocks(channel))
            np.testing.assert_array_equal(np.concatenate([b for _, b in blocks]), values)
            for column in (0, 3, values.shape[1] - 1):
                np.testing.assert_array_equal(part.column(channel, column), values[:, column])
            # Extremes are those of every step, whatever is recorded.
            every_step = everything.channel(channel)
            extremes = np.array([every_step.min(axis=0), every_step.max(axis=0)])
            np.testing.assert_array_equal(part.extremes(channel), extremes)
        first, second = statistics.evaluate(everything), statistics.evaluate(part)
        np.testing.assert_array_equal(first.supports.uplift, second.supports.uplift)
        np.testing.assert_array_equal(first.droppers.lowest, second.droppers.lowest)
        assert first.droppers.n_slackened == second.droppers.n_slackened > 0
    assert path.stat().st_size <= whole.stat().st_size


def test_a_window_takes_room_near_the_train_only(
    tmp_path: Path, make_march: Any, record_run: Any, whole: Path
) -> None:
    record = LineRecord(window=(0.0, 0.0))
    path = record_run(
        tmp_path / "run.h5", make_march(n_steps=N_STEPS), flush_every=FLUSH, record=record
    )
    with h5py.File(path) as part, h5py.File(whole) as everything:
        few, all_of_them = (
            file["line_channels/dropper_force"].id.get_num_chunks() for file in (part, everything)
        )
    # 144 droppers in three blocks; the train of 100 m moves from 60 m to 310 m of 800 m.
    assert all_of_them == 3 * 8
    assert few < 0.7 * all_of_them


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("both", marks=pytest.mark.study),
        "all of them",
        pytest.param("stretch", marks=pytest.mark.study),
    ],
)
def test_a_restarted_run_has_the_same_content(
    tmp_path: Path, make_march: Any, record_run: Any, name: str
) -> None:
    march, record = make_march(n_steps=1500), RECORDS[name]
    known = {"flush_every": FLUSH, "energy_every": 50, "record": record}
    reference = record_run(tmp_path / "whole.h5", march, **known)
    path = tmp_path / "run.h5"
    # It breaks 150 steps after the last state, at step 799, and once more.
    for first, last in ((0, 949), (799, 1250), (1199, None)):
        part = Recorder(march.comm, path, march.header(), resume=first > 0, **known)
        march.drive(part, first_step=first, last=last, outcome="done" if last is None else "broken")
        part.close({})
    with Results(reference) as one, Results(path) as other:
        np.testing.assert_array_equal(one.line_time, other.line_time)
        for channel in line_channels_of_all():
            np.testing.assert_array_equal(one.channel(channel), other.channel(channel))
            np.testing.assert_array_equal(one.extremes(channel), other.extremes(channel))
        np.testing.assert_array_equal(one.energies()["time"], other.energies()["time"])


def test_extremes_of_a_broken_run_are_those_of_its_rows(tmp_path: Path, make_march: Any) -> None:
    """The last flush of a run that broke stores no state, but its rows count."""
    march, path = make_march(n_steps=1000), tmp_path / "run.h5"
    recorder = Recorder(march.comm, path, march.header(), flush_every=300)
    march.drive(recorder, last=450, outcome="no convergence at t = 0.451 s")
    recorder.close({})
    with Results(path) as results:
        assert results.n_steps == 450 and results.checkpoint["step"] == 299
        found = results.extremes("arm_uplift")
        np.testing.assert_array_equal(found[1], results.channel("arm_uplift").max(axis=0))


def test_a_record_is_told_in_words_and_kept_in_the_file() -> None:
    both = LineRecord(every=5, window=(300.0, 200.0), compression=GZIP, by_size=True)
    assert LineRecord.model_validate(both.model_dump(mode="json", by_alias=True)) == both
    assert record_words(both, 1e-3) == (
        "recorded every 5 ms within 300 m behind and 200 m ahead of the train; extremes are kept "
        "of every step; compressed (chosen by size)"
    )
    assert record_words(LineRecord(), 1e-3) == "recorded at every step"
    assert record_words(LineRecord(names=()), 1e-3).startswith("not recorded")


def test_a_closed_file_has_no_room_left_behind_its_end(whole: Path) -> None:
    """Room is claimed a flush ahead; a file that is closed gives it back."""
    with h5py.File(whole) as file:
        stored = 0

        def count(_: str, item: Any) -> None:
            nonlocal stored
            stored += item.id.get_storage_size() if isinstance(item, h5py.Dataset) else 0

        file.visititems(count)
    assert stored < whole.stat().st_size < stored + 150_000


# --- channels of a line of which a window moves ---------------------------------------------------


N, SPEED, BLOCK = 40, 3.0, 7
X = np.arange(N) * 10.0


def stage(moving: MovingColumns) -> Stage:
    columns = np.arange(N)
    return Stage(
        TrainLayout((1,)),
        1.0,
        0.0,
        100,
        X,
        X,
        columns,
        columns,
        np.zeros((0, 3)),
        np.zeros(0),
        moving=moving,
    )


def blocks() -> list[tuple[np.ndarray, np.ndarray, tuple[int, int]]]:
    """Positions, rows and columns that move, of blocks of steps behind a first one."""
    random = np.random.default_rng(7)
    row, result, step = random.normal(size=N), [], 1
    for _ in range(12):
        begin = int(SPEED * step / 10.0) + 2
        rows = np.empty((BLOCK, N))
        for i in range(BLOCK):
            row[begin : begin + 12] = random.normal(size=12) * (1.0 + 0.05 * step)
            rows[i] = row
        result.append((50.0 + SPEED * np.arange(step, step + BLOCK), rows, (begin, begin + 12)))
        step += BLOCK
    return result


@pytest.mark.parametrize(
    "record",
    [
        LineRecord(),
        LineRecord(every=3, window=(30.0, 20.0)),
        LineRecord(window=(30.0, 20.0), stretch=(100.0, 250.0)),
        LineRecord(every=2, names=("dropper_force",)),
    ],
)
def test_what_rests_is_not_looked_at(record: LineRecord) -> None:
    moving = MovingColumns()
    gather = LineGather(MPI.COMM_SELF, stage(moving), record, 1000)
    # A station for each column, of which each follows.
    table = np.tile(np.arange(N + 1)[:, None], (1, 2))
    columns = Columns(np.array([0, N]), np.arange(N + 1), table, table)
    first = np.random.default_rng(7).normal(size=(1, N))
    names = "arm_uplift", "dropper_force"
    parts = {
        "contact_position": slice(0, 1),
        names[0]: slice(1, N + 1),
        names[1]: slice(N + 1, None),
    }
    gather.take(0, np.hstack([[[50.0]], first, first]), parts, all_move=True)
    position, rows, step = [np.array([50.0])], [first], 1
    for at, block, (begin, end) in blocks():
        moving.follow(columns, names, np.array([begin, end]))
        gather.take(step, np.hstack([at[:, None], block, block]), parts, all_move=False)
        position.append(at)
        rows.append(block)
        step += BLOCK
    found, all_rows, all_at = gather(), np.concatenate(rows), np.concatenate(position)
    np.testing.assert_array_equal(found.chosen, np.arange(0, step, record.every))
    for name in names:
        ends = np.array([all_rows.min(axis=0), all_rows.max(axis=0)])
        np.testing.assert_array_equal(found.extremes[name], ends)
    assert set(found.values) == set(record.names) & set(names)
    own = record.columns(X)
    for first_column, values in found.values.values():
        expected = all_rows[:: record.every][:, own]
        edges = record.within(all_at[:: record.every, None])
        inside = np.ones(expected.shape, dtype=bool)
        if edges is not None:
            inside = (X[own] >= edges[0][:, None]) & (X[own] <= edges[1][:, None])
            assert values.shape[1] < own.size or record.stretch is not None
        assert not inside[:, :first_column].any()
        assert not inside[:, first_column + values.shape[1] :].any()
        part = slice(first_column, first_column + values.shape[1])
        near = inside[:, part]
        np.testing.assert_array_equal(values[near], expected[:, part][near])


# --- lines of several contact wires in result files -----------------------------------------------


FIRST, SECOND = "contact_wire", "contact_wire_2"


@pytest.fixture
def usual(march: Any) -> dict[str, Any]:
    """Root attributes that have nothing to do with the line."""
    return dict(march.header().attributes)


def recorded(line: Line, folder: Path, usual: dict[str, Any]) -> Path:
    """A run of 0.15 s on a line, whose first contact wire is damped otherwise than the others.

    It is told so: the march itself is damped alike, for which others have compiled the loops.
    """
    problem = problem_on(line, evaluation=(8.0, 19.0))
    problem = replace(problem, train=replace(problem.train, end=21.0))
    rest = line_at_rest(problem, mesh_of(line, 2))
    datasets = {
        **line_datasets(line, rest.mesh, problem.evaluation),
        "static/dropper_length": rest.form.dropper_length,
        **static_datasets(line, rest.mesh, rest.form, rest.lift),
    }
    told = replace(problem, damping=Damping(2e-4, 0.0, {FIRST: (5e-3, 0.0)}))
    facts = facts_of(told, rest.mesh, rest.model.dropper_lengths)
    header = Header({**usual, "wires": wire_roles(line)}, datasets, facts)
    recorder = Recorder(MPI.COMM_SELF, folder / "run.h5", header)
    with March(MPI.COMM_SELF, *rest) as march:
        outcome = march.run([recorder])
    recorder.close({"march_wall_s": outcome.wall})
    assert outcome.outcome == "done"
    return folder / "run.h5"


def test_each_contact_wire_has_its_name_role_facts_and_profile(
    tmp_path: Path, usual: dict[str, Any]
) -> None:
    line = twins(0.3)
    path = recorded(line, tmp_path, usual)
    with Results(path) as results:
        assert results.damage == []
        assert list(results.roles) == [wire.name for wire in line.wires]
        assert results.wires_of(Role.CONTACT) == [FIRST, SECOND]
        for name, of in (
            ("contact_wire_tension", "tension"),
            ("contact_wire_mass", "mass_per_length"),
            ("contact_wire_bending_stiffness", "bending_stiffness"),
        ):
            told = results.facts_of_wires(name)
            assert told == {wire: getattr(line.wire(wire), of) for wire in (FIRST, SECOND)}
        assert results.facts_of_wires("contact_wire_stiffness_damping") == {
            FIRST: 5e-3, SECOND: 2e-4,
        }  # fmt: skip
        assert results.fact("wave_speed") == min(w.wave_speed for w in line.wires_of(Role.CONTACT))
        points, wires = results.line("node_points"), results.wires()
        for name, profile in results.contact_profiles().items():
            np.testing.assert_allclose(profile.x, points[wires[name], 0], atol=1e-12)
            np.testing.assert_allclose(profile.height, points[wires[name], 2], atol=1e-12)
        own = results.static("elasticity_of_wires")
        assert own.shape == (results.static("elasticity").size, 2)
        # A wire of 0.3 of the stiffness gives way more than one of 0.7, and both together least.
        inner = slice(1, -1)
        assert (own[inner, 0] > own[inner, 1]).all()
        assert (results.static("elasticity")[inner] < own[inner].min(axis=1)).all()


@pytest.mark.usefixtures("quick_report")
def test_the_report_shows_each_wire(tmp_path: Path, usual: dict[str, Any]) -> None:
    path = recorded(twins(0.3), tmp_path, usual)
    write_report(path, tmp_path)
    told = json.loads((tmp_path / "summary.json").read_text())["static"]
    own = told["elasticity_of_wires_mm_per_N"]
    assert own[FIRST]["max"] > own[SECOND]["max"] > told["elasticity_mm_per_N"]["max"]


@pytest.mark.usefixtures("quick_report")
def test_arms_and_droppers_of_several_wires_are_named(
    tmp_path: Path, usual: dict[str, Any]
) -> None:
    """Twins have two of each at a place, of which each tells its wire, and the number that a scene
    gives it."""
    line = twins(0.3)
    path = recorded(line, tmp_path, usual)
    write_report(path, tmp_path)
    supports = json.loads((tmp_path / "summary.json").read_text())["supports"]["per_support"]
    at_one = [row["wire"] for row in supports if row["x_m"] == supports[0]["x_m"]]
    assert sorted(at_one) == [FIRST, SECOND]
    with Results(path) as results:
        rows = dropper_table(results)
        droppers, x = results.line("droppers"), results.line("dropper_x")
        for nth, name in enumerate((FIRST, SECOND)):
            own = [row for row in rows if row.wires[1] == name and row.span == 2]
            assert [row.number for row in own] == [2 * i + 1 + nth for i in range(len(own))]
            places = [line.dropper_of_span(2, row.number) for row in own]
            assert places == [(pytest.approx(row.x), nth) for row in own]
            nodes = results.wires()[name]
            expected = np.sort(x[np.isin(droppers[:, 1], nodes)])
            np.testing.assert_allclose([row.x for row in rows if row.wires[1] == name], expected)
        assert {row.wires[0] for row in rows} == {"messenger_wire"}
    text = (tmp_path / "droppers.csv").read_text()
    assert text.splitlines()[0].endswith(",hangs from,carries") and f",{SECOND}" in text
    assert ">and carries</th>" in (tmp_path / "report.html").read_text()


def test_the_span_that_is_shown_has_the_usual_wires() -> None:
    """Where the middle of the evaluated stretch lies in an overlap, the nearest span outside."""

    class Overlapping(LineOfRun):
        """Five spans of 50 m, two wires that overlap in the third one."""

        def __init__(self, middle: float) -> None:
            self.evaluation = (middle - 10.0, middle + 10.0)

        def line(self, name: str) -> np.ndarray:
            return {"support_x": np.arange(0.0, 251.0, 50.0)}[name]

        def contact_profiles(self) -> dict[str, ContactProfile]:
            x = {FIRST: [0.0, 50.0, 100.0, 150.0], SECOND: [101.0, 150.0, 200.0, 250.0]}
            none = np.zeros(0, dtype=int)
            return {n: ContactProfile(none, np.array(own), np.full(4, 5.0)) for n, own in x.items()}

    shown = {middle: Overlapping(middle).reference_span for middle in (70.0, 120.0, 130.0, 220.0)}
    assert shown == {70.0: 1, 120.0: 1, 130.0: 3, 220.0: 4}


def test_a_picture_of_the_line_names_the_second_section_of_an_overlap_by_words() -> None:
    class Overlapping(LineOfRun):
        span_at_rest = 1

        def __init__(self) -> None:
            pass

        def line(self, name: str) -> np.ndarray:
            return np.arange(0.0, 151.0, 50.0) if name == "support_x" else np.zeros(0)

        def contact_profiles(self) -> dict[str, ContactProfile]:
            x, none = np.array([0.0, 60.0, 90.0, 150.0]), np.zeros(0, dtype=int)
            flat = ContactProfile(none, x, np.full(4, 5.0))
            return {FIRST: flat, f"{FIRST}_next": flat}

    _, (axes,) = figures.stacked(3.0, 1)
    line_pictures._draw_profile(axes, Overlapping())
    labels = [line.get_label() for line in axes.lines]
    assert labels[:2] == ["contact wire at rest", "contact wire (next section) at rest"]


def test_the_force_on_each_wire_is_recorded_told_and_drawn(
    tmp_path: Path, usual: dict[str, Any]
) -> None:
    path = recorded(overlap(), tmp_path, usual)
    with Results(path) as results:
        assert results.damage == []
        shares, force = results.channel("contact_wire_force"), results.channel("contact_force")
        assert (shares.max(axis=0) > 0.0).all() and shares.shape == (force.shape[0], 2)
        np.testing.assert_allclose(shares.sum(axis=1), force[:, 0], rtol=1e-13, atol=1e-10)
        assert results.wire_columns() == [{FIRST: 0, SECOND: 1}]
        curves = {line.get_label() for line in force_pictures.wire_forces(results).axes[0].lines}
    assert {"contact wire", "contact wire 2"} <= curves


def test_indicators_are_those_of_the_less_damped_wire(
    tmp_path: Path, usual: dict[str, Any]
) -> None:
    """Damping lets fewer elements carry the waves ahead: the second wire asks for more."""
    path = recorded(twins(0.5), tmp_path, usual)
    with Results(path) as results:
        found = indicate(results)
    with Results(path) as results:
        results._file.facts["contact_wire_stiffness_damping"] = np.array([5e-3, 5e-3])
        assert indicate(results).required_frequency < found.required_frequency


def test_films_show_the_wire_that_is_touched(tmp_path: Path, usual: dict[str, Any]) -> None:
    """In an overlap the lower one, whatever its name and mean height are."""
    path = recorded(overlap(), tmp_path, usual)
    with Results(path) as results:
        data = FilmData(results)
        profiles = results.contact_profiles()
    assert data.contacts == [FIRST, SECOND]
    assert data.touched(10.0) == FIRST and data.touched(40.0) == SECOND
    x = np.array([2.0, 16.0, 24.0, 32.0, 46.0])
    each = [
        np.interp(x, profile.x, profile.height, left=np.inf, right=np.inf)
        for profile in profiles.values()
    ]
    np.testing.assert_allclose(data.rest_height(x), np.min(each, axis=0), atol=1e-12)
    lowest = data.lowest_contact_nodes()
    at = data.points[lowest, 0]
    assert np.all(np.diff(at) > 0.0) and (at[0], at[-1]) == (0.0, 48.0)
    np.testing.assert_allclose(data.points[lowest, 2], data.rest_height(at), atol=1e-12)
    assert data.touched(16.0) == FIRST and data.touched(32.0) == SECOND

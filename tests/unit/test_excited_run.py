"""A run without a train, which a blow or a force excites: its files, and what is made of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import pytest
from matplotlib.figure import Figure
from measuring import check
from mpi4py import MPI
from pydantic import TypeAdapter, ValidationError
from scenes import load_scene, problem_of

from catenary import InputError
from catenary.cases.run.continuing import state_to_continue
from catenary.cases.run.excited_run import ExcitedRun
from catenary.cases.run.runner import run_case
from catenary.cases.studies.asked import Excited
from catenary.cases.studies.waves.seen import WavesSeen, WireMotion, course_of, waves_seen
from catenary.cases.studies.waves.study import Watch, excitation_of, study_waves, without_train
from catenary.postproc.evaluate.statistics import evaluate
from catenary.postproc.files.run_schema import RunAttributes
from catenary.postproc.film import animate, open_in_paraview
from catenary.postproc.film.drawing import RingingChart
from catenary.postproc.film.film_data import FilmData, Snapshots
from catenary.postproc.film.options import FilmOptions
from catenary.postproc.film.scenery import Scenery
from catenary.postproc.read.results import Results
from catenary.postproc.report.pictures import line_pictures
from catenary.postproc.report.report import write_report
from catenary.solver.statics.line_at_rest import LineAtRest
from catenary.solver.waves.excitation import Blow, MovingForce, as_facts, excitation_of_facts

# HDF5's files are examined by a process of its own.
pytestmark = [pytest.mark.process, pytest.mark.usefixtures("quick_reports")]

AT, FORCE, EVERY = 160.0, 120.0, 0.02
SHORT = ("line.n_spans=6", "train.start_m=130", "train.end_m=170", "train.raise_time_s=0.1",
         "evaluation.from_m=140", "evaluation.to_m=165",
         "train.pantographs=[{name='three_masses'}]")  # fmt: skip


def excited(folder: Path, kind: str, settings: Excited, *words: str) -> WavesSeen:
    """Run a case under an excitation; what was seen in memory meanwhile."""
    scene = load_scene("ac_simple", (*SHORT, *words))
    problem = problem_of(scene)
    excitation = excitation_of(kind, settings, problem, problem.numerics.dt)
    seen: list[WireMotion] = []

    def watching(rest: LineAtRest) -> list[Watch]:
        seen.append(WireMotion(rest.model.contact_nodes, rest.model.contact_x))
        return [Watch(round(EVERY / problem.numerics.dt), [seen[0].add])]

    run = ExcitedRun(without_train(problem, excitation), excitation, EVERY, watching)
    done = run_case(scene, folder, MPI.COMM_SELF, only_summary=True, excited=run)
    assert done.outcome == "done"
    return seen[0].seen(*course_of(excitation))


@pytest.fixture(scope="module")
def struck(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, WavesSeen]:
    folder = tmp_path_factory.mktemp("struck")
    return folder, excited(folder, "hammer", Excited(at=AT, impulse=5.0, duration=0.05))


def test_a_blow_leaves_the_files_of_a_run(struck: tuple[Path, WavesSeen]) -> None:
    """Its snapshots are, in single precision, what was seen in memory."""
    folder, seen = struck
    with Results(folder) as results:
        data = FilmData(results)
        facts = results.attributes["excitation"]
        assert (results.channel("contact_force") == 0.0).all()
        assert results.extremes("dropper_force")[1].max() > 0.0
        with Snapshots(folder, len(data.points)) as snapshots:
            again = waves_seen(data, snapshots)
    assert again.struck == AT and again.position.shape[1] == 0
    np.testing.assert_allclose(again.time, seen.time)
    largest = np.abs(seen.uplift).max()
    assert largest > 1e-3
    check("uplift", again.uplift, seen.uplift, within=1e-6 * largest)
    blow = Blow(AT, 0.05, 0.5 * np.pi * 5.0 / 0.05, True)
    assert excitation_of_facts(facts) == blow
    # A film and ParaView show the blow where a pantograph would stand.
    assert data.names == ["hammer"] and (data.position == AT).all()
    row = data.row_at(0.025)
    assert data.force[row, 0] == pytest.approx(blow.peak, rel=1e-3)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["excitation"]["says"].startswith("a hammer of 5 N s at 160 m")


def test_nothing_continues_a_blow_as_a_run_of_its_train(struck: tuple[Path, WavesSeen]) -> None:
    with pytest.raises(InputError, match="a hammer of .* excites its line, not a train"):
        state_to_continue(struck[0] / "run.h5", True)


def test_paraview_shows_a_blow_without_a_train(struck: tuple[Path, WavesSeen]) -> None:
    script, *files = open_in_paraview.write_script(struck[0], None)
    names = {path.name for path in files}
    assert names == {"line.xdmf", "pantographs.xdmf", "forces.xdmf", "track.xdmf"}
    assert '"train": ""' in script.read_text()


def test_a_film_shows_how_the_wire_rings_where_it_was_struck(
    struck: tuple[Path, WavesSeen],
) -> None:
    folder, seen = struck
    with Results(folder) as results:
        data = FilmData(results)
        assert isinstance(data.excitation, Blow)
        with Snapshots(folder, len(data.points)) as snapshots:
            axes, numbers = Figure().add_subplot(), np.arange(snapshots.times.size)
            chart = RingingChart(axes, data, data.excitation, snapshots, numbers)
    until = seen.time[seen.time.size // 2]
    chart.update(data.row_at(until), 0.0, 1.0)
    shown = seen.time <= until + 1e-9
    np.testing.assert_allclose(chart.curve.get_xdata(), seen.time[shown])
    expected = np.array([np.interp(AT, seen.x, row) for row in seen.uplift[shown]])
    # Of a line between the points of the wire; snapshots are in single precision.
    largest = np.abs(expected).max()
    check("uplift [mm]", chart.curve.get_ydata(), 1e3 * expected, within=1e3 * 1e-6 * largest)
    assert axes.get_ylim()[1] > 1e3 * largest > 1.0


@pytest.mark.study
def test_report_and_film_of_a_blow_have_no_train(struck: tuple[Path, WavesSeen]) -> None:
    folder, _ = struck
    report = write_report(folder, folder)
    page, _, _ = (folder / "report.html").read_text().partition("Full configuration")
    page = page.replace("\N{NO-BREAK SPACE}", " ")
    assert "Nothing is judged" in page and "a hammer of 5 N s at 160 m" in page
    # Neither of a train that stands still, nor of a contact without stiffness.
    for word in ("km/h", "Contact force", "Acceptance", "resonance"):
        assert word not in page, word
    assert report.verdict is None
    assert {one.passed for one in report.criteria} == {None}
    with Results(folder) as results:
        passing, _ = line_pictures.arm_uplift(results, evaluate(results), np.nan).axes
        assert passing.get_xlabel() == "time [s]"
        drawn = max(np.nanmax(line.get_ydata()) for line in passing.get_lines())
        check("uplift [mm]", drawn, 1e3 * evaluate(results).supports.maximum, within=1e-9)
        data = FilmData(results)
        with Snapshots(folder, len(data.points)) as snapshots:
            made = animate.Pictures(
                results, Scenery(data, snapshots), snapshots, FilmOptions(end=0.05)
            )
            first, second = (np.array(one) for one, _ in zip(made, range(2), strict=False))
    assert (first != second).any()


def test_a_force_that_moves_is_seen_on_its_course(tmp_path: Path) -> None:
    seen = excited(
        tmp_path, "force", Excited(force=FORCE, frequency=2.0), "output.field_every_s=0.1"
    )
    with Results(tmp_path) as results:
        data = FilmData(results)
        with Snapshots(tmp_path, len(data.points)) as snapshots:
            # The scene's own cadence.
            again = waves_seen(data, snapshots)
            assert np.diff(snapshots.times) == pytest.approx(0.1)
            options = FilmOptions(start=0.2, end=0.3)
            made = animate.Pictures(results, Scenery(data, snapshots), snapshots, options)
            next(iter(made))
    assert isinstance(data.excitation, MovingForce)
    np.testing.assert_allclose(data.position[:, 0], 130.0 + data.speed * data.time)
    np.testing.assert_allclose(data.force[:, 0], data.excitation.value(data.time))
    np.testing.assert_allclose(again.position[:, 0], data.excitation.place(again.time))
    assert np.abs(seen.uplift).max() > 1e-3
    # After 0.4 of a period it pulls the wire down, and so does its arrow.
    assert data.force[data.row_at(0.2), 0] < 0.0
    begin, tip = made.drawing._arrows.get_segments()[0]
    assert tip[1] < begin[1]


def test_facts_of_an_excitation_are_checked_when_they_are_read() -> None:
    field = RunAttributes.model_fields["excitation"]
    declared = TypeAdapter(Annotated[field.annotation, *field.metadata])
    valid = as_facts(MovingForce(1.0, 0.0, 10.0, 50.0, 0.1))
    assert declared.validate_python({}) == {} and declared.validate_python(valid) == valid
    broken = ({"kind": "bell"}, {"speed": "fast"}, {"force": float("nan")}, {"says": 3})
    for facts in (*({**valid, **own} for own in broken), [1]):
        with pytest.raises(ValidationError):
            declared.validate_python(facts)


def test_a_window_of_spans_around_a_train_is_refused_for_a_blow() -> None:
    scene = load_scene("ac_simple", (*SHORT, "window.mode=bounded"))
    problem = problem_of(scene)
    with pytest.raises(InputError, match="window.mode is bounded.*a pulse has none"):
        excitation_of("pulse", Excited(), problem, problem.numerics.dt)


@pytest.mark.study
@pytest.mark.parametrize("case", ["ac_simple_3d", "tensioned_section"])
def test_energies_of_waves_are_those_of_the_run(case: str, tmp_path: Path) -> None:
    """Of lines whose droppers and arms couple their motions; the uplift alone makes several times
    as much. At most 4 % are lost by the means over 10 ms: (w dt)^2 / 4 of waves of 6 Hz."""
    scene = load_scene(
        case, ["output.field_every_s=0.01", "output.energy_every_s=0.01"], shortened=True
    )
    run_case(scene, tmp_path, MPI.COMM_SELF, only_summary=True)
    study_waves(tmp_path)
    seen = np.genfromtxt(tmp_path / "energy.csv", delimiter=",", names=True)
    with Results(tmp_path) as results:
        parts = results.energies()
    expected = np.interp(seen["time_s"], parts["time"], parts["kinetic"] + parts["elastic"])
    check("energy [J]", seen["total_J"], expected, within=0.04 * expected.max())

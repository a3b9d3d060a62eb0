"""Lines of several contact wires in result files: names, roles, facts and pictures of each."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contact_wires import overlap, problem_on, twins
from mpi4py import MPI
from small_lines import mesh_of

from catenary.meshgen.line import Line
from catenary.meshgen.wires import Role
from catenary.postproc.evaluate.error_indicators import indicate
from catenary.postproc.files.facts import facts_of
from catenary.postproc.files.header import Header, line_datasets, static_datasets, wire_roles
from catenary.postproc.film.film_data import FilmData
from catenary.postproc.read.results import ContactProfile, LineOfRun, Results
from catenary.postproc.record.recorder import Recorder
from catenary.postproc.report.pictures import figures, force_pictures, line_pictures
from catenary.postproc.report.report import write_report
from catenary.postproc.report.sections.line import dropper_table
from catenary.solver.problem.problem import Damping
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.time_loop.march import March

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

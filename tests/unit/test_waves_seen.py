"""The motion of a wire in space and time, and its spectrum, of waves that are given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from program import catenary as program
from scenes import load_scene, mesh_of, problem_of

import catenary
from catenary.cases.studies.waves import obstacles, pictures
from catenary.cases.studies.waves.seen import WavesSeen
from catenary.cases.studies.waves.study import as_rows, study_waves
from catenary.cases.studies.waves.theory import (
    MOST_SPEEDS,
    WaveTheory,
    reflection_rows,
    reflections_of,
    wave_theory,
)
from catenary.solver.statics.line_at_rest import line_at_rest
from catenary.solver.waves.bloch import BlochWaves

pytestmark = pytest.mark.study

SPEED = 40.0


def travelling(wavenumber: float, frequency: float) -> WavesSeen:
    """cos(omega t - k x) on 400 m over 8 s, with a pantograph at 40 m/s."""
    time, x = 0.01 * np.arange(800), 0.5 * np.arange(800)
    phase = 2 * np.pi * frequency * time[:, None] - wavenumber * x
    position = (20.0 + SPEED * time)[:, None]
    return WavesSeen(time, x, np.sin(phase), np.cos(phase), position)


@pytest.mark.parametrize("wavenumber", [0.5, -0.5])
def test_a_wave_with_the_train_stands_at_positive_wavenumbers(wavenumber: float) -> None:
    k, frequency, amplitude = travelling(wavenumber, 7.5).spectrum()
    assert (np.diff(k) > 0).all() and (frequency >= 0).all()
    row, column = np.unravel_index(amplitude.argmax(), amplitude.shape)
    # Lines of the transform are 2 pi / 400 m and 1 / 8 s apart.
    assert k[column] == pytest.approx(wavenumber, abs=0.016)
    assert frequency[row] == pytest.approx(7.5, abs=0.125)
    assert amplitude.max() == 1.0 and np.quantile(amplitude, 0.99) < 1e-2


def test_the_frame_of_the_train_moves_with_it() -> None:
    seen = travelling(0.3, 2.0)
    relative, velocity = seen.in_the_train(10.0, 30.0)
    row = 300
    place = seen.position[row, 0] + relative
    expected = np.cos(2 * np.pi * 2.0 * seen.time[row] - 0.3 * place)
    # Linear interpolation: k^2 h^2 / 8.
    np.testing.assert_allclose(velocity[row], expected, atol=0.3**2 * 0.5**2 / 8 + 1e-12)
    last = seen.position[-1, 0] + relative
    np.testing.assert_array_equal(np.isnan(velocity[-1]), last > seen.x[-1])
    # What moves with the train stands still in its frame.
    _, still = travelling(0.3, 0.3 * SPEED / (2 * np.pi)).in_the_train(10.0, 30.0)
    assert np.ptp(still[:700], axis=0).max() < 0.01


def test_a_line_of_many_wires_has_a_line_of_speed_for_each() -> None:
    frequency = np.array([[1.0], [2.0]])
    waves = BlochWaves(50.0, np.array([0.0, np.pi]), frequency, 90.0 * frequency / 2.0,
                       np.zeros((2, 1, 0), dtype=complex), np.zeros(0))  # fmt: skip
    wires = tuple((f"wire_{n}", 100.0 + n) for n in range(5))
    theory = WaveTheory(SPEED, 100.0, wires, 0.4, np.nan, np.nan, waves, "")
    assert len(theory.speeds()) == MOST_SPEEDS
    few = WaveTheory(SPEED, 100.0, wires[:3], 0.4, np.nan, np.nan, waves, "")
    assert few.speeds()[-1] == (90.0, "greatest group velocity of the line (2.0 Hz)")
    axes = pictures.space_time(travelling(0.5, 7.5), few, np.array([60.0])).axes[0]
    # Each speed runs both ways from the train, beside its own course and a support.
    assert len(axes.get_lines()) == 1 + 2 * len(few.speeds()) + 1
    # Two tension sections have one speed, which is drawn once.
    twice = WaveTheory(SPEED, 100.0, (*wires[:2], ("wire_0_next", 100.0)), 0.4, np.nan, np.nan,
                       None, "")  # fmt: skip
    assert twice.speeds() == [(100.0, "wire 0 as a string"), (101.0, "wire 1 as a string")]
    # What a line of many wires does not have is no row.
    names = {row["name"] for row in as_rows(theory)}
    assert "doppler_factor" in names and "amplification" not in names


@pytest.mark.parametrize(("wave_speed", "side"), [(100.0, 1.0), (30.0, -1.0)])
def test_waves_that_the_train_outruns_fall_behind_it(wave_speed: float, side: float) -> None:
    theory = WaveTheory(SPEED, wave_speed, (), 0.4, np.nan, np.nan, None, "")
    axes = pictures.train_frame(travelling(0.3, 2.0), theory, 30.0, 20.0, "train").axes[0]
    for line, speed in zip(axes.get_lines(), (wave_speed, -wave_speed), strict=True):
        (x, t), (from_x, from_t) = line.get_xydata()[1], line.get_xydata()[0]
        assert from_x == 0.0 and t > from_t
        assert x / (t - from_t) == pytest.approx(speed - SPEED)
    assert np.sign(axes.get_lines()[0].get_xdata()[1]) == side


def test_no_echo_reaches_a_train_that_no_wave_outruns() -> None:
    faster = ("train.speed_km_h=450", "effects.supercritical_speed=true")
    scene = load_scene("en50318_2002", faster, shortened=True)
    rest = line_at_rest(problem_of(scene), mesh_of(scene))
    theory = wave_theory(rest.problem, rest)
    assert theory.speed > theory.wave_speed
    rows = [*as_rows(theory), *reflection_rows(reflections_of(rest), theory.speed)]
    names = [row["name"] for row in rows]
    assert "dropper_reflection" in names
    for name in ("doppler_factor", "amplification", "largest_reflection_end"):
        assert name not in names


@pytest.mark.process
def test_the_end_of_a_window_has_no_energy_of_waves(tmp_path: Path) -> None:
    """Energy from snapshots against that of the march itself, in which nothing steps to rest.

    Snapshots every 10 ms lose (w dt)^2 / 12 of the kinetic energy of waves of angular frequency w,
    0.5 % at 4 Hz, below which a span's waves have most of it.
    """
    words = {"window.mode": "bounded", "window.spans_ahead": 3, "window.spans_behind": 3}
    words |= {"output.field_every_s": 0.01, "evaluation.from_m": 600, "evaluation.to_m": 800}
    scene = catenary.load("ambrosio2012").replace({**words, "line.n_spans": 24})
    with catenary.run(scene, tmp_path / "run", report=False) as run:
        own = run.channel("kinetic") + run.channel("elastic")
    study_waves(tmp_path / "run")
    table = pd.read_csv(tmp_path / "run" / "energy.csv")
    from_start = table.time_s > 3.0
    expected = np.interp(table.time_s, own.time, own)[from_start].mean()
    found = table.total_J[from_start].mean()
    print("energy [J], of snapshots and of the march:", found, expected)
    assert found == pytest.approx(expected, rel=5e-3)


def test_without_a_train_nothing_is_drawn_that_moves_with_it() -> None:
    theory = WaveTheory(SPEED, 100.0, (("contact_wire", 100.0),), 0.4, np.nan, np.nan, None, "")
    with_train = travelling(0.5, 7.5)
    blow = replace(with_train, position=np.zeros((with_train.time.size, 0)), struck=200.0)
    drawn = [
        {line.get_label() for line in pictures.wavenumbers(seen, theory).axes[0].get_lines()}
        for seen in (with_train, blow)
    ]
    moving = "moving with the train"
    assert moving in drawn[0] and moving not in drawn[1]


@pytest.mark.process
def test_the_verb_runs_a_case_and_reads_a_run(tmp_path: Path) -> None:
    out = tmp_path / "waves"
    done = program("waves", "en50318_2002", "--short", "-o", str(out), cwd=tmp_path, pictures=True)
    assert done.code == 0, done.stderr
    assert "slowest wave of the contact wire, sqrt(T / m): 121.7 m/s\n" in done.stdout
    names = ("space_time.png", "train_frame.png", "wavenumbers.png", "waves.csv", "pass_bands.csv",
             "energy.png", "energy.csv",
             "end_reflection.png", "end_reflection.csv")  # fmt: skip
    assert all((out / name).stat().st_size > 100 for name in names)
    rows = (out / "pass_bands.csv").read_text().splitlines()
    assert any(row.startswith("pass band,0.8") for row in rows)
    (out / "waves.csv").unlink()
    assert program("waves", str(out), cwd=tmp_path, pictures=True).code == 0
    assert (out / "waves.csv").is_file()
    for words, sentence in (
        (["waves", "en50318_2002"], "-o is missing"),
        (["waves", str(out), "--short"], "is a run; -o, --set, --short and --excite are for cases"),
        (["waves", "en50318_2002", "--short", "-o", str(out)], "--force"),
        (["waves", "en50318_2002", "--excite", "bell", "-o", "x"], "--excite is bell, but must be"),
        (["waves", "en50318_2002", "--at-m", "3", "-o", "x"], "belong to another --excite than"),
        (
            ["waves", "en50318_2002", "--excite", "pulse", "-o", str(out)],
            "run.h5 holds the results",
        ),
    ):
        refused = program(*words, cwd=tmp_path)
        assert refused.code == 2 and sentence in refused.stderr, refused.stderr


@pytest.mark.process
@pytest.mark.parametrize("kind", ["force", "hammer"])
def test_the_verb_excites_a_line_without_its_train(kind: str, tmp_path: Path) -> None:
    words = ["waves", "en50318_2002", "--short", "--excite", kind, "-o", "struck",
             "--set", "evaluation.to_m=480", "--set", "mesh.elements_per_gap=3"]  # fmt: skip
    done = program(*words, cwd=tmp_path, pictures=True)
    assert done.code == 0, done.stderr
    struck = tmp_path / "struck"
    assert (struck / "train_frame.png").is_file() == (kind == "force")
    rows = np.genfromtxt(struck / "energy.csv", delimiter=",", names=True)
    assert rows["total_J"].max() > 0.1 and (rows["total_J"] > -1e-9).all()
    again = program(*words, cwd=tmp_path)
    assert again.code == 2 and "run.h5 holds the results of an earlier run" in again.stderr
    # What was seen in memory is in the snapshots as well.
    (struck / "waves.csv").unlink()
    read = program("waves", str(struck), cwd=tmp_path)
    assert read.code == 0, read.stderr
    once_more = np.genfromtxt(struck / "energy.csv", delimiter=",", names=True)
    assert np.abs(once_more["total_J"] - rows["total_J"]).max() < 1e-4 * rows["total_J"].max()


def test_shares_of_obstacles_are_told_apart_by_marks_and_stand_clear_of_the_axis() -> None:
    frequency = np.linspace(2.0, 20.0, 19)
    shares = np.full((2, 19, 2, 2), 0.4, dtype=complex)
    result = obstacles.Result("droppers", ("contact_wire", "messenger_wire"), frequency, shares,
                              1e-4 * shares)  # fmt: skip
    axes = obstacles.picture([result]).axes[0]
    named = [line for line in axes.get_lines() if not str(line.get_label()).startswith("_")]
    marks = [str(line.get_marker()) for line in named]
    assert len(set(marks)) == len(marks) == 6
    assert axes.get_ylim()[0] < 0.0


@pytest.mark.process
def test_the_verb_refuses_obstacles_of_a_run(tmp_path: Path) -> None:
    for words, sentence in (
        (["--excite", "pulse", "-o", "x"], "--obstacles runs pulses of its own"),
        ([], "-o is missing"),
    ):
        refused = program("waves", "en50318_2002", "--obstacles", *words, cwd=tmp_path)
        assert refused.code == 2 and sentence in refused.stderr, refused.stderr
    # Its "measured" shares were up to 17 times those of theory.
    refused = program("waves", "conductor_rail", "--obstacles", "-o", "x", cwd=tmp_path)
    assert refused.code == 2 and "contact_wire carries waves by bending" in refused.stderr

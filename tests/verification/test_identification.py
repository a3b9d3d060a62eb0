"""Twin experiments: marches with planted errors in the place of measurements.

Noise is that of filtered values, 5 N and 5 mm below 20 Hz: what a measuring pantograph is off by.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from measuring import check
from mpi4py import MPI
from scenes import Scene, load_scene, problem_of
from scipy import stats
from twin_passages import filtered_noise, write_measurement

from catenary.cases.studies.measured import read_table
from catenary.cases.studies.parameters.identification import (
    FittedMarch,
    Identification,
    Unknown,
    identify,
)
from catenary.cases.studies.parameters.identified import as_text, verdict
from catenary.cases.studies.parameters.measurement import Measurement, Task
from catenary.cases.studies.parameters.parameters import ChangedScenes
from catenary.cases.studies.parameters.posterior import innovations_of, judge, posterior_of
from catenary.cases.studies.task_files import read_task

FORCE_NOISE, HEIGHT_NOISE = 5.0, 5e-3
PASSAGES = int(os.environ.get("CATENARY_PASSAGES", "6"))
CASE = "en50318_2002"
# Eight spans of 60 m with 9 droppers each, run through from 240 to 720 m.
SECTION = (
    "line.n_spans=14", "mesh.elements_per_gap=4", "train.start_m=150", "train.end_m=730",
    "evaluation.from_m=240", "evaluation.to_m=720",
)  # fmt: skip
# Six spans with two elements a gap, run through in 1152 steps.
SMALL = (
    "line.n_spans=6", "mesh.elements_per_gap=2", "train.start_m=65", "train.end_m=225",
    "train.raise_time_s=0.2", "numerics.dt_s=0.002", "evaluation.from_m=80",
    "evaluation.to_m=220",
)  # fmt: skip
FEW = {
    "line.contact_wire.tension_N": 1000.0,
    "pantographs.reference.static_force_N": 5.0,
    "pantographs.reference.masses_kg.0": 0.5,
}


def task_with(priors: dict[str, float], spans: Sequence[int], filtered: bool) -> dict[str, Any]:
    """Parameters with these deviations of their priors, and droppers of spans with 2 mm."""
    task: dict[str, Any] = {
        "measured": {
            "place": {"column": "x_m"},
            "force": {"column": "force_N", "noise": FORCE_NOISE},
            "head_height": {"column": "height_mm", "unit": "mm", "noise": 1e3 * HEIGHT_NOISE},
            "is_filtered": filtered,
        },
        "parameters": [{"key": key, "deviation": own} for key, own in priors.items()],
    }
    if spans:
        task["droppers"] = {"spans": list(spans), "deviation_mm": 2.0}
    return task


def identified(
    scene: Scene,
    file: Path,
    priors: dict[str, float],
    spans: Sequence[int] = (),
    filtered: bool = True,
    starts: int | None = None,
) -> Identification:
    """What is found of these."""
    own = {} if starts is None else {"starts": starts}
    task = read_task(task_with(priors, spans, filtered) | own, Task)
    return identify(scene, file, task, MPI.COMM_SELF)


def planted(
    words: tuple[str, ...],
    priors: dict[str, float],
    spans: Sequence[int],
    rng: np.random.Generator,
) -> tuple[Scene, np.ndarray]:
    """A scene whose parameters are drawn from their priors, and the parameters."""
    scenes = ChangedScenes(load_scene(CASE, words))
    parameters = [scenes.parameter(key) for key in priors]
    parameters += scenes.droppers_of(spans) if spans else []
    deviations = np.array([*priors.values(), *[2.0] * (len(parameters) - len(priors))])
    moved = deviations * rng.normal(size=len(parameters))
    before = np.array([one.values[0] for one in parameters])
    return scenes.all_changed(list(zip(parameters, moved, strict=True))), before + moved


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.study
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(("filtered", "most"), [(True, 1.5), (False, 1.1)])
def test_errors_of_all_droppers_of_a_section_are_found_from_one_passage(
    tmp_path: Path, filtered: bool, most: float
) -> None:
    """72 droppers with errors of 2 mm rms.

    5 N and 5 mm are the noise of values below 20 Hz, or that of 200 independent samples a second.
    """
    rng = np.random.default_rng(7)
    spans = range(5, 13)
    twin, truth = planted(SECTION, {}, spans, rng)
    file = tmp_path / "measured.csv"
    write_measurement(file, twin, rng, FORCE_NOISE, HEIGHT_NOISE, is_filtered=filtered)
    found = identified(load_scene(CASE, SECTION), file, {}, spans, filtered)
    left, expected = rms(found.values - truth), rms(found.widths)
    print(
        f"planted {rms(truth):.2f} mm rms, left {left:.2f}, expected {expected:.2f}; "
        f"{found.n_marches} marches, {found.n_jacobians} Jacobians; "
        f"{found.posterior.n_found:.1f} of {len(truth)} determined"
    )
    print({name: (one.reduced, one.probability) for name, one in found.judged.items()})
    # The mean square of normal errors has the variance 2 tr(C^2) / m^2; 4 deviations.
    covariance = 4.0 * found.posterior.covariance
    spread = np.sqrt(2.0 * (covariance**2).sum()) / len(truth)
    check("mean square of what is left", left**2, expected**2, within=4.0 * spread)
    assert left < most < 1.6 < rms(truth)
    assert found.has_converged and verdict(found).startswith("The model fits")


def small_passage(folder: Path, rng: np.random.Generator, *words: str) -> Path:
    """A passage of the small scene with other values."""
    file = folder / "measured.csv"
    write_measurement(file, load_scene(CASE, [*SMALL, *words]), rng, FORCE_NOISE, HEIGHT_NOISE)
    return file


@pytest.mark.study
def test_planted_errors_lie_within_their_widths(tmp_path: Path) -> None:
    """Parameters of line and train and the droppers of a span, together; by chi-square."""
    rng = np.random.default_rng(21)
    twin, truth = planted(SMALL, FEW, [3], rng)
    file = tmp_path / "measured.csv"
    write_measurement(file, twin, rng, FORCE_NOISE, HEIGHT_NOISE)
    found = identified(load_scene(CASE, SMALL), file, FEW, [3])
    prior = np.array([one.deviation for one in found.unknowns])
    off = (found.values - truth) / prior
    distance = float(off @ np.linalg.solve(found.posterior.covariance, off))
    probability = stats.chi2.sf(distance, len(truth))
    print(f"chi-square {distance:.1f} of {len(truth)}, probability {probability:.2f}")
    assert probability > 1e-3
    assert verdict(found).startswith("The model fits") and found.has_converged
    assert found.posterior.widths[:3].max() < 0.4  # of the priors


@pytest.mark.study
def test_heights_at_supports_are_found(tmp_path: Path) -> None:
    """Errors of 8 mm at three supports; by chi-square."""
    rng = np.random.default_rng(23)
    scene = load_scene(CASE, SMALL)
    scenes, errors = ChangedScenes(scene), 8.0 * rng.normal(size=3)
    twin = scenes.all_changed(list(zip(scenes.heights_at([2, 3, 4]), errors, strict=True)))
    file = tmp_path / "measured.csv"
    write_measurement(file, twin, rng, FORCE_NOISE, HEIGHT_NOISE)
    task = task_with({}, [], True) | {"heights": {"supports": [2, 3, 4], "deviation_mm": 10.0}}
    found = identify(scene, file, read_task(task, Task), MPI.COMM_SELF)
    off = (found.values - errors) / 10.0
    distance = float(off @ np.linalg.solve(found.posterior.covariance, off))
    print(f"{errors}: {found.values} +- {found.widths}; chi-square {distance:.1f} of 3")
    assert stats.chi2.sf(distance, 3) > 1e-3
    # Supports 2 and 3 lie within the stretch; 5 mm and 56 samples a span leave less than 1 mm.
    assert verdict(found).startswith("The model fits") and found.widths[:2].max() < 2.0


@pytest.mark.study
def test_widths_are_right_in_repeated_linear_trials(tmp_path: Path) -> None:
    """Four hundred passages by the tangents of a march, with noise that the filter itself made.

    Estimates are those of a plain least-squares solution. Of n normal deviates a part p lies within
    a bound, give or take sqrt(p (1 - p) / n); estimates of one trial are correlated, so that trials
    count alone: 4 deviations.
    """
    rng, trials = np.random.default_rng(23), 400
    file = small_passage(tmp_path, rng)
    scenes = ChangedScenes(load_scene(CASE, SMALL))
    problem = problem_of(scenes.scene)
    parameters = [*(scenes.parameter(key) for key in FEW), *scenes.droppers_of([3])]
    prior = np.array([*FEW.values(), *[2.0] * 9])
    columns = read_task(task_with(FEW, [3], True), Task).measured
    measurement = Measurement(
        read_table(file), "m", columns, problem.train.speed, 65.0, problem.evaluation
    )
    priors = zip(parameters, prior, strict=True)
    sought = [Unknown(one.key, one.unit, one.values[0], own, one) for one, own in priors]
    march = FittedMarch(scenes, sought, measurement, MPI.COMM_SELF)
    by = march.derivatives([0.0] * len(parameters))
    step = int(round(np.diff(measurement.place)[0] / (problem.train.speed * problem.numerics.dt)))
    n = measurement.place.size
    white = [
        one.whitening.of(own * prior) for one, own in zip(measurement.signals, by, strict=True)
    ]
    jacobian = np.concatenate(white)
    posterior = posterior_of(jacobian)
    off, probabilities, colours = [], [], []
    for _ in range(trials):
        drawn = rng.normal(size=prior.size)
        data = []
        for one, own, deviation in zip(
            measurement.signals, by, (FORCE_NOISE, HEIGHT_NOISE), strict=True
        ):
            noise = filtered_noise(rng, n * step, deviation, problem.numerics.dt)[::step]
            data.append(one.whitening.of(own @ (prior * drawn) + noise))
        stacked = np.concatenate([*data, np.zeros(prior.size)])
        design = np.concatenate([jacobian, np.eye(prior.size)])
        found, least, _, _ = np.linalg.lstsq(design, stacked, rcond=None)
        off.append((found - drawn) / posterior.widths)
        probabilities.append(stats.chi2.sf(least[0], stacked.size - prior.size))
        moved = innovations_of(stacked[: -prior.size] - jacobian @ found, jacobian, found)
        assert float(moved @ moved) == pytest.approx(float(least[0]))
        judged = judge(moved, {"force": slice(0, n), "head height": slice(n, 2 * n)})
        colours.append([judged[one].whiteness_probability for one in ("force", "head height")])
    off = np.array(off)
    for bound, part in ((1.0, 0.6827), (2.0, 0.9545)):
        seen = float((np.abs(off) < bound).mean())
        spread = np.sqrt(part * (1.0 - part) / trials)
        check(f"within {bound:g} widths", seen, part, within=4.0 * spread)
    check("mean square", (off**2).mean(axis=0), 1.0, within=5.0 * np.sqrt(2.0 / trials))
    # Residuals of a right model are called wrong as rarely as said.
    for seen in (probabilities, *np.transpose(colours)):
        assert stats.kstest(seen, "uniform").pvalue > 1e-4


@pytest.mark.study
@pytest.mark.timeout(3600)
def test_widths_are_right_in_repeated_passages(tmp_path: Path) -> None:
    """Passages of other lines, each searched for by marches: distances in all directions, and parts
    within widths.

    Six, or ``CATENARY_PASSAGES`` of them. Kinks catch some searches far off, so that of many
    passages distances have more large ones than chi-square; the first six have none.
    """
    rng, distances, off_by_width, fits = np.random.default_rng(24), [], [], 0
    for number in range(PASSAGES):
        twin, truth = planted(SMALL, FEW, [3], rng)
        file = tmp_path / f"{number}.csv"
        write_measurement(file, twin, rng, FORCE_NOISE, HEIGHT_NOISE)
        found = identified(load_scene(CASE, SMALL), file, FEW, [3])
        prior = np.array([one.deviation for one in found.unknowns])
        off = (found.values - truth) / prior
        distances.append(float(off @ np.linalg.solve(found.posterior.covariance, off)))
        off_by_width.append((found.values - truth) / found.widths)
        fits += verdict(found).startswith("The model fits")
    print(f"chi-square of each, of {truth.size}: {np.round(distances, 1)}; {fits} are called a fit")
    for part in (0.95, 0.99):
        within = np.count_nonzero(distances < stats.chi2.ppf(part, truth.size))
        print(f"within the joint region of {100 * part:g} %: {within} of {PASSAGES}")
    # Of the first six, chi-square with 72 degrees of freedom; both sides at one in a thousand.
    assert 1e-3 < stats.chi2.sf(sum(distances[:6]), 6 * truth.size) < 1.0 - 1e-3
    # Values of one passage are correlated, so that passages count alone: 4 deviations. A right
    # model is called wrong in one of a thousand passages, and a caught search more often.
    for bound, part in ((1.0, 0.6827), (2.0, 0.9545)):
        seen = float((np.abs(off_by_width) < bound).mean())
        spread = np.sqrt(part * (1.0 - part) / PASSAGES)
        check(f"within {bound:g} widths", seen, part, within=4.0 * spread)
    assert fits > 0.9 * PASSAGES


@pytest.mark.study
@pytest.mark.timeout(3600)
def test_an_unlikely_residual_is_left_by_further_searches(tmp_path: Path) -> None:
    """The twelfth of the passages above: from the means of the priors the search is caught between
    kinks, at a sum of squares of 245 of 202 samples and 68 from the truth, which itself has 185. A
    task that names no number of searches leaves it."""
    rng = np.random.default_rng(24)
    for _ in range(12):
        twin, truth = planted(SMALL, FEW, [3], rng)
        write_measurement(tmp_path / "passage.csv", twin, rng, FORCE_NOISE, HEIGHT_NOISE)
    scene = load_scene(CASE, SMALL)
    found = identified(scene, tmp_path / "passage.csv", FEW, [3])
    print(f"sums of squares: {np.round(found.sums, 1)}")
    assert found.sums == sorted(found.sums) and found.sums[-1] > 1.3 * found.sums[0]
    assert "Sums of squares of 3 searches" in as_text(found)
    prior = np.array([one.deviation for one in found.unknowns])
    off = (found.values - truth) / prior
    distance = float(off @ np.linalg.solve(found.posterior.covariance, off))
    print(f"chi-square {distance:.1f} of {truth.size}")
    assert stats.chi2.sf(distance, truth.size) > 1e-3


@pytest.mark.study
@pytest.mark.parametrize(
    ("wrong", "by"),
    [
        (["line.damping.alpha_s=5e-4"], "damping"),
        (["mesh.elements_per_gap=8"], "mesh"),
        pytest.param(
            ["line.dropper.stiffness_N_per_m=1e4"],
            "stiffness of droppers",
            marks=pytest.mark.study,
        ),
    ],
)
def test_a_wrong_model_is_told_by_its_residual(tmp_path: Path, wrong: list[str], by: str) -> None:
    """The passage is one of another model than that whose parameters are looked for."""
    rng = np.random.default_rng(22)
    found = identified(load_scene(CASE, SMALL), small_passage(tmp_path, rng, *wrong), FEW)
    for name, one in found.judged.items():
        print(
            f"{by}, {name}: {one.reduced:.2f} per degree of freedom ({one.probability:.1g}), "
            f"white {one.whiteness_probability:.1g}"
        )
    assert verdict(found).startswith("The model does not fit")


@pytest.mark.study
def test_what_a_passage_cannot_tell_is_told(tmp_path: Path) -> None:
    """Height of the wire and sag of all droppers move it alike."""
    words = [*SMALL, "evaluation.from_m=90"]
    priors = {
        "line.contact_height_m": 0.02,
        "line.dropper.pre_sag_mm": 5.0,
        "line.dropper.pre_sag_mm.4": 5.0,
        "pantographs.three_masses.static_force_N": 5.0,
    }
    scene, file = load_scene("ac_simple", words), tmp_path / "measured.csv"
    rng = np.random.default_rng(25)
    write_measurement(file, scene, rng, FORCE_NOISE, HEIGHT_NOISE)
    found = identified(scene, file, priors)
    assert found.posterior.n_known == 3 and found.posterior.information[-1] < 0.01
    unknown = found.posterior.directions[:, -1]
    # A millimetre higher and a millimetre more sag: 1/20 and 1/5 of the priors' deviations.
    alike = np.array([1.0 / 20.0, 1.0 / 5.0, 0.0, 0.0])
    check("direction", abs(float(unknown @ alike)), float(np.linalg.norm(alike)), within=1e-6)
    assert unknown[0] * unknown[1] > 0.0
    assert found.posterior.correlation[0, 1] > 0.9
    text = as_text(found)
    assert "Not known from these data, where the prior says more:" in text
    (line,) = [one for one in text.splitlines() if "(information" in one]
    assert "line.dropper.pre_sag_mm" in line and "line.contact_height_m" in line

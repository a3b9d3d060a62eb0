"""Twin experiments: marches with planted errors in the place of measurements.

Noise is that of filtered values, 5 N and 5 mm below 20 Hz: what a measuring pantograph is off by.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from measuring import check
from mpi4py import MPI
from scipy import stats
from twin_passages import write_measurement

from catenary.cases.scene.load import load_scene
from catenary.cases.scene.scene import Scene
from catenary.cases.studies.identification.output import verdict
from catenary.cases.studies.identification.study import Identification, identify
from catenary.cases.studies.identification.task import task_of
from catenary.cases.studies.sensitivity.parameters import ChangedScenes

FORCE_NOISE, HEIGHT_NOISE = 5.0, 5e-3
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


def identified(
    scene: Scene, file: Path, priors: dict[str, float], spans: Sequence[int] = ()
) -> Identification:
    """The parameters with these deviations of their priors, and droppers of spans with 2 mm."""
    task = {
        "measured": {
            "place": {"column": "x_m"},
            "force": {"column": "force_N", "noise": FORCE_NOISE},
            "head_height": {"column": "height_mm", "unit": "mm", "noise": 1e3 * HEIGHT_NOISE},
        },
        "parameters": [{"key": key, "deviation": own} for key, own in priors.items()],
    }
    if spans:
        task["droppers"] = {"spans": list(spans), "deviation_mm": 2.0}
    return identify(scene, file, task_of(task, "the task"), MPI.COMM_SELF)


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
def test_errors_of_all_droppers_of_a_section_are_found_from_one_passage(tmp_path: Path) -> None:
    """72 droppers with errors of 2 mm rms, of which the prior alone leaves 2 mm."""
    rng = np.random.default_rng(7)
    spans = range(5, 13)
    twin, truth = planted(SECTION, {}, spans, rng)
    file = tmp_path / "measured.csv"
    write_measurement(file, twin, rng, FORCE_NOISE, HEIGHT_NOISE)
    found = identified(load_scene(CASE, SECTION), file, {}, spans)
    left, expected = rms(found.values - truth), rms(found.widths)
    print(
        f"planted {rms(truth):.2f} mm rms, left {left:.2f}, expected {expected:.2f}; "
        f"{found.n_marches} marches, {found.n_jacobians} Jacobians; "
        f"{found.posterior.n_found:.1f} of {len(truth)} determined"
    )
    print({name: (one.reduced, one.probability) for name, one in found.judged.items()})
    # The rms of 72 errors spreads by 1/sqrt(144) of itself about its expectation, and by as much
    # again as neighbours are correlated: 4 deviations.
    check("rms of what is left", left, expected, within=4.0 * np.sqrt(2.0 / 144.0) * expected)
    assert left < 1.3 < 1.6 < rms(truth)
    assert found.has_converged and verdict(found).startswith("The model fits")

"""The waves of a run: pictures of what is seen, and figures and bands of what theory says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.convert.problem import problem_of
from catenary.cases.scene.input.origin import Origin
from catenary.cases.scene.load import scene_from
from catenary.cases.studies.sweep.output import as_csv
from catenary.cases.studies.waves import pictures
from catenary.cases.studies.waves.seen import waves_seen
from catenary.cases.studies.waves.theory import WaveTheory, wave_theory
from catenary.postproc.files.disk import write_all
from catenary.postproc.film.film_data import film_data
from catenary.postproc.film.snapshots import Snapshots
from catenary.postproc.read.guard import examined
from catenary.postproc.read.results import Results
from catenary.postproc.report import figures
from catenary.solver.statics.line_at_rest import line_at_rest

# Snapshots that show waves up to 20 Hz, and five of them a period at 20 Hz [s].
SNAPSHOT_EVERY = 0.01
# What is shown behind and ahead of the train [m].
_BEHIND, _AHEAD = 300.0, 200.0


def study_waves(folder: Path) -> tuple[WaveTheory, list[Path]]:
    """Analyse the waves in a run's folder and write pictures and tables there. Not collective.

    Raises
    ------
    InputError
        If there is no run with snapshots, or nothing can be written.
    """
    with Results(folder, examined(folder)) as results:
        data = film_data(results)
        config = results.attributes["config"]
        with Snapshots(folder, len(data.points)) as snapshots:
            seen = waves_seen(data, snapshots)
    scene = scene_from(config, Origin(str(folder)))
    problem = problem_of(scene)
    theory = wave_theory(problem, line_at_rest(problem, mesh_of(scene)))
    content: dict[str, bytes | str] = {
        "space_time.png": figures.png(pictures.space_time(seen, theory, data.supports)),
        "train_frame.png": figures.png(pictures.train_frame(seen, theory, _BEHIND, _AHEAD)),
        "wavenumbers.png": figures.png(pictures.wavenumbers(seen, theory)),
        "waves.csv": as_csv(as_rows(theory)),
        "pass_bands.csv": as_csv(band_rows(theory)),
    }
    return theory, write_all(folder, content)


def as_rows(theory: WaveTheory) -> list[dict[str, Any]]:
    """Figures with unit and meaning."""
    rows = [
        ("train_speed", theory.speed, "m/s", "speed of the train"),
        ("wave_speed", theory.wave_speed, "m/s", "sqrt(T/m) of the contact wire"),
        ("doppler_factor", theory.doppler, "-", "(c - v) / (c + v)"),
        ("dropper_reflection", theory.reflection, "-", "Z_m / (Z_c + Z_m), stiff dropper"),
        ("amplification", theory.amplification, "-", "reflection / Doppler factor"),
    ]
    if theory.bloch is not None:
        speed, at = theory.bloch.fastest(20.0)
        rows += [
            ("fastest_group_velocity", speed, "m/s", "of the periodic line up to 20 Hz"),
            ("frequency_of_the_fastest", at, "Hz", "of that wave"),
        ]
    return [
        {"name": name, "value": value, "unit": unit, "meaning": meaning}
        for name, value, unit, meaning in rows
    ]


def band_rows(theory: WaveTheory) -> list[dict[str, Any]]:
    """Pass bands of the periodic line, and ranges that outrun the train [Hz]."""
    rows: list[tuple[str, np.ndarray]] = [
        ("pass band", theory.bands()), ("outruns the train", theory.outrunning())
    ]  # fmt: skip
    return [
        {"what": what, "from_Hz": float(low), "to_Hz": float(high)}
        for what, bands in rows
        for low, high in bands
    ]


def as_text(theory: WaveTheory) -> str:
    """Figures for a terminal."""
    lines = [f"{row['meaning']}: {row['value']:.4g} {row['unit']}" for row in as_rows(theory)]
    for what, bands in (("Pass bands", theory.bands()), ("Outrun the train", theory.outrunning())):
        text = ", ".join(f"{low:.2f}-{high:.2f}" for low, high in bands)
        if text:
            lines.append(f"{what}: {text} Hz")
    if theory.why_not:
        lines.append(f"No pass bands: {theory.why_not}")
    return "\n".join(lines)

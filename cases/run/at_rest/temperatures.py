"""A scene's line over temperatures: what `catenary static --temperatures` prints and draws."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.run.describe.temperatures import temperature_text
from catenary.cases.run.scene_mesh import mesh_of
from catenary.cases.scene.problem import problem_of
from catenary.cases.scene.scene import Scene
from catenary.solver.statics.tension_along import over_temperatures

# Steps between temperatures [K], of which a range has no more than so many.
_STEPS, _MOST_STEPS = (0.1, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0), 8
# Differences that a scene may have [K].
_LEAST, _MOST = -100.0, 150.0
_EFFECTS = ("axial_motion", "temperature")


def range_of(text: str) -> list[float]:
    """The temperatures of "LOW,HIGH", differences from the installation (n,) [K].

    Raises
    ------
    InputError
        If the text is no ascending pair of numbers within what a scene may have.
    """
    try:
        low, high = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"--temperatures {text!r} must be two numbers, such as -20,40: the lowest and the "
            "highest difference from the installation in K"
        ) from None
    if not _LEAST <= low < high <= _MOST:
        raise InputError(
            f"--temperatures {text} must ascend and lie between {_LEAST:g} and {_MOST:g} K"
        )
    step = next(step for step in _STEPS if high - low <= _MOST_STEPS * step)
    between = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)
    found: list[float] = np.unique(np.concatenate([[low], between, [high]])).tolist()
    return found


def temperatures(scene: Scene, differences: Sequence[float], picture: Path | None) -> str:
    """The table over temperatures; the picture is drawn into a new file. Not collective.

    Raises
    ------
    InputError
        If the scene does not let its wires move along the track.
    """
    switches = scene.switches()
    for name in _EFFECTS:
        if not switches[name]:
            raise InputError(
                f"--temperatures needs effects.{name} = true, with what that needs of the scene; "
                f"it is off {scene.origin.of(f'effects.{name}')}"
            )
    problem, mesh = problem_of(scene), mesh_of(scene)
    rests = over_temperatures(problem, mesh, differences)
    if picture is not None:
        # Matplotlib takes long to import.
        from catenary.postproc.report.pictures.line_pictures import draw_temperatures

        draw_temperatures(rests, picture)
    return temperature_text(rests, problem.along.tensioner.ratio)

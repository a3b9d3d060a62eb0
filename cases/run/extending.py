"""A run that goes on beyond its end: its scene with a later one."""

from __future__ import annotations

import copy
import math
from typing import Any

from catenary.base.errors import InputError
from catenary.cases.scene.input.faults import Origin
from catenary.cases.scene.load import scene_from
from catenary.cases.scene.scene import Scene

UNTIL, EVALUATED = "--until-m", "--evaluate"


def extended_scene(
    config: dict[str, Any], file: str, until: float | None, evaluated: str | None
) -> Scene:
    """The checked scene of a run with a later end, or another evaluated stretch. Not collective.

    Parameters
    ----------
    config : of the run's result file
    file : its path, for sentences
    until : where the leading pantograph is to stop [m], None for where it stops now
    evaluated : ``FROM:TO`` [m], None for the stretch as it is

    Raises
    ------
    InputError
        If that is not later, or impossible.
    """
    raw, given = copy.deepcopy(config), []
    if until is not None:
        end = float(raw["train"]["end_m"])
        if not (math.isfinite(until) and until > end):
            raise InputError(
                f"{UNTIL} is {until:g}, but must be greater than {end:g}: the run ends there"
            )
        raw["train"]["end_m"] = until
        given.append(("train.end_m", f"on the command line ({UNTIL})"))
    if evaluated is not None:
        try:
            first, last = (float(part) for part in evaluated.split(":"))
        except ValueError:
            raise InputError(
                f"{EVALUATED} is {evaluated}, but must be two places [m] as from:to, e.g. 360:600"
            ) from None
        raw["evaluation"] |= {"from_m": first, "to_m": last}
        where = f"on the command line ({EVALUATED})"
        given += [("evaluation.from_m", where), ("evaluation.to_m", where)]
    return scene_from(raw, Origin(file, tuple(given), recorded=True))

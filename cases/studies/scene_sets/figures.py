"""Statistics of a run by name, as studies over sets of scenes read them from its summary."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from catenary.cases.studies.scene_sets.evaluate import BROKE
from catenary.cases.studies.sweep.jobs import OF_PANTOGRAPH

OF_EACH_PANTOGRAPH = tuple(column.name for column in OF_PANTOGRAPH)
# Statistics of the line: table and key in a summary.
_OF_LINE = {
    "max_uplift_mm": ("supports", "max_uplift_mm"),
    "n_slackened": ("droppers", "n_slackened"),
    "max_dropper_force_N": ("droppers", "max_force_N"),
    "min_dropper_force_N": ("droppers", "min_force_N"),
}


def values_of(summary: Mapping[str, Any], statistic: str) -> list[float] | None:
    """A statistic of every pantograph of a run, or the only one of its line.

    None if the run broke, or has no such statistic.

    Parameters
    ----------
    summary : of the run, as ``evaluate`` gives it
    statistic : one of ``STATISTICS`` of the tables of sweeps
    """
    if BROKE in summary:
        return None
    if statistic in OF_EACH_PANTOGRAPH:
        found = [one.get(statistic) for one in summary["pantographs"]]
    else:
        table, key = _OF_LINE[statistic]
        found = [summary[table].get(key)]
    return None if None in found else [float(value) for value in found]


def reason(summary: Mapping[str, Any]) -> str:
    """Why a run has no figures."""
    return str(summary.get(BROKE, "the run has no such statistic"))

"""Criteria of a run: by how much each is kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from catenary.base.errors import InputError
from catenary.cases.studies.scene_sets.evaluation import BROKE, values_of
from catenary.cases.studies.scene_sets.scene_set import BoundTable

# A row for each thing that is measured of a run, such as a pantograph: its criterion and margin.
Margins = dict[str, list[float]]


def margins_of(summary: Mapping[str, Any], criteria: Sequence[BoundTable]) -> Margins:
    """How far a run is within each criterion, in its unit, for each pantograph; negative beyond.

    A run that broke keeps no criterion: all are minus infinity, with the name "".

    Parameters
    ----------
    summary : of the run, as ``evaluate`` gives it
    criteria : bounds; those that the standard judges if there are none
    """
    if BROKE in summary:
        return {"": [-np.inf]}
    if criteria:
        return {one.says: _margins(summary, one) for one in criteria}
    found: Margins = {}
    for row in summary["acceptance"]:
        if row["passed"] is not None:
            by = row["limit"] - row["value"]
            margin = -by if row["relation"].startswith(">") else by
            found.setdefault(_without_pantograph(row["criterion"], summary), []).append(margin)
    return found


def _margins(summary: Mapping[str, Any], one: BoundTable) -> list[float]:
    values = values_of(summary, one.statistic)
    return [-np.inf] if values is None else [one.margin(value) for value in values]


def _without_pantograph(criterion: str, summary: Mapping[str, Any]) -> str:
    """A criterion without the name of one of several pantographs at its end."""
    for one in summary["pantographs"]:
        criterion = criterion.removesuffix(f", {one['name']}")
    return criterion


def names_of(margins: Sequence[Margins]) -> list[str]:
    """The criteria of several runs.

    Raises
    ------
    InputError
        If a run broke, or nothing is judged.
    """
    if any("" in one for one in margins):
        raise InputError("a run of the case without errors broke, so that it has no criteria")
    found = list(dict.fromkeys(name for one in margins for name in one))
    if not found:
        raise InputError("the standard judges no run of the set: name criteria in the task")
    return found


def least(margins: Sequence[Margins], name: str) -> float:
    """The least margin of a criterion of all runs of a line; of one that broke minus infinity."""
    return min(min(one.get(name, one.get("", [np.inf]))) for one in margins)

"""Reads the facts of a run against their table; files of earlier formats have some of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from catenary.postproc.channels.facts import FACTS, NONE, Fact
from catenary.postproc.files.checked import sum_is_kept
from catenary.postproc.read.attributes import HDF5_ERRORS
from catenary.solver.time_loop.channels import RUN

# Without these there is no report.
_ESSENTIAL = ("time_step", "speed", "wave_speed")


def read_facts(file: h5py.File) -> tuple[dict[str, np.ndarray], list[str]]:
    """The facts in a file by name, and what is wrong with them, in clauses. Not collective.

    A fact that is missing where the checksum of all is right has been declared since, and is NaN.
    """
    try:
        group = file["facts"]
        found = {name: np.asarray(group[name][()]) for name in group}
        same = sum_is_kept(group, found)
    except HDF5_ERRORS:
        return {}, ["its facts are missing or cannot be read"]
    if same is False:
        return {}, ["its facts differ from their checksum"]
    faults = []
    n_pantographs = np.size(found.get("static_force", 0.0))
    for name, fact in FACTS.items():
        fault = ""
        if name in found:
            fault = _fault(found[name], fact, n_pantographs)
        elif same and name not in _ESSENTIAL:
            found[name] = np.full(() if fact.per == RUN else n_pantographs, NONE)
        else:
            fault = "is missing"
        faults += [f"facts/{name} {fault}"] if fault else []
    return found, faults


def facts_of_earlier(about: Mapping[str, Any]) -> tuple[dict[str, np.ndarray], list[str]]:
    """What root attributes of an earlier format hold of the facts, NaN for all others, and what
    is wrong with them, in clauses. Not collective.

    Parameters
    ----------
    about : sound root attributes
    """
    rows = about.get("pantographs") or [{}]
    found, faults = {}, []
    for name, fact in FACTS.items():
        told = [about] if fact.per == RUN else rows
        values = np.array([_number(row.get(fact.earlier)) for row in told])
        found[name] = values[0] if fact.per == RUN else values
        fault = _fault(found[name], fact._replace(may_be_nan=name not in _ESSENTIAL), len(rows))
        faults += [f'its attribute "{fact.earlier}" {fault}'] if fault else []
    return found, faults


def _number(value: Any) -> float:
    known = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if known else NONE


def _fault(values: np.ndarray, fact: Fact, n_pantographs: int) -> str:
    """What is wrong with the values of a fact, empty if nothing is."""
    if values.dtype.kind != "f":
        return f"holds {values.dtype} where numbers belong"
    if values.shape != (() if fact.per == RUN else (n_pantographs,)):
        return f"has the shape {values.shape}"
    with np.errstate(invalid="ignore"):
        sound = (values >= fact.low) & (values <= fact.high)
    sound |= fact.may_be_nan & np.isnan(values)
    if sound.all():
        return ""
    wrong = np.atleast_1d(values)[~np.atleast_1d(sound)][0]
    return f"holds {wrong:g} in place of {fact.low:g} to {fact.high:g} {fact.unit}"

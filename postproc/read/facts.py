"""Reads the facts of a run against their table; files of earlier formats have some of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from catenary.postproc.channels.facts import FACTS, NONE, WIRE, Fact
from catenary.postproc.files.hdf5.checked import sum_is_kept
from catenary.postproc.read.attributes import HDF5_ERRORS
from catenary.solver.time_loop.views.channels import PANTOGRAPH, RUN

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
    for name, fact in FACTS.items():
        if fact.per == WIRE and name in found:
            # Of one contact wire, before lines had several.
            found[name] = np.atleast_1d(found[name])
    sizes = {
        PANTOGRAPH: (np.size(found.get("static_force", 0.0)),),
        WIRE: (np.size(found.get("contact_wire_tension", 0.0)),),
    }
    for name, fact in FACTS.items():
        fault, shape = "", sizes.get(fact.per, ())
        if name in found:
            fault = _fault(found[name], fact, shape)
        elif same and name not in _ESSENTIAL:
            found[name] = np.full(shape, NONE)
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
        told = rows if fact.per == PANTOGRAPH else [about]
        values = np.array([_number(row.get(fact.earlier)) for row in told])
        found[name] = values[0] if fact.per == RUN else values
        optional = fact._replace(may_be_nan=name not in _ESSENTIAL)
        fault = _fault(found[name], optional, found[name].shape)
        faults += [f'its attribute "{fact.earlier}" {fault}'] if fault else []
    return found, faults


def _number(value: Any) -> float:
    known = isinstance(value, (int, float)) and not isinstance(value, bool)
    return float(value) if known else NONE


def _fault(values: np.ndarray, fact: Fact, shape: tuple[int, ...]) -> str:
    """What is wrong with the values of a fact, empty if nothing is."""
    if values.dtype.kind != "f":
        return f"holds {values.dtype} where numbers belong"
    if values.shape != shape:
        return f"has the shape {values.shape}"
    with np.errstate(invalid="ignore"):
        sound = (values >= fact.low) & (values <= fact.high)
    sound |= fact.may_be_nan & np.isnan(values)
    if sound.all():
        return ""
    wrong = np.atleast_1d(values)[~np.atleast_1d(sound)][0]
    return f"holds {wrong:g} in place of {fact.low:g} to {fact.high:g} {fact.unit}"

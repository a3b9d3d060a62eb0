"""Checks the datasets of a result file that are written once against their table."""

from __future__ import annotations

import h5py
import numpy as np

from catenary.postproc.read.attributes import HDF5_ERRORS, is_there
from catenary.postproc.read.file_schema import BREAKS, CONSTANTS, WIRE, Constant, line_columns


def constant_faults(file: h5py.File) -> tuple[list[str], dict[str, int]]:
    """What is wrong with the constants of a file, and the sizes that their letters stand for."""
    faults: list[str] = []
    sizes: dict[str, int] = {}
    wires = {f"line/wires/{name}": WIRE for name in _names(file, "line/wires")}
    if not wires:
        faults.append("line/wires has no wire")
    breaks = {f"line/breaks/{name}": BREAKS for name in _names(file, "line/breaks")}
    for path, declared in {**CONSTANTS, **wires, **breaks}.items():
        if declared.later and not is_there(file, path):
            continue
        try:
            values = np.asarray(file[path][...])
        except HDF5_ERRORS:
            faults.append(f"{path} is missing or cannot be read")
            continue
        fault = values_fault(values, declared, sizes)
        if fault:
            faults.append(f"{path} {fault}")
    listed = line_columns()
    for path, (recorded, all_of) in listed.items():
        if is_there(file, path):
            faults += _columns(file, path, Constant(recorded, 0, sizes.get(all_of, 0) - 1), sizes)
    for recorded, all_of in listed.values():
        sizes.setdefault(recorded, sizes.get(all_of, 0))
    if not faults:
        faults = _between(file, sizes)
    return faults, sizes


def _columns(file: h5py.File, path: str, declared: Constant, sizes: dict[str, int]) -> list[str]:
    try:
        values = np.asarray(file[path][...])
    except HDF5_ERRORS:
        return [f"{path} cannot be read"]
    fault = values_fault(values, declared._replace(whole=True), sizes)
    return [f"{path} {fault}"] if fault else []


def _names(file: h5py.File, path: str) -> list[str]:
    try:
        return list(file[path])
    except HDF5_ERRORS:
        return []


def values_fault(values: np.ndarray, declared: Constant, sizes: dict[str, int]) -> str:
    """What is wrong with the values, empty if nothing is; letters without a size get theirs."""
    kinds = "iu" if declared.whole else "fiu"
    if values.dtype.kind not in kinds:
        return f"holds {values.dtype} where numbers belong"
    if values.ndim != len(declared.shape):
        return f"has {values.ndim} dimensions in place of {len(declared.shape)}"
    for letter, size in zip(declared.shape, values.shape, strict=True):
        if letter == "*":
            continue
        wanted = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
        if size != wanted:
            return f"has {size} entries in place of {wanted}"
    with np.errstate(invalid="ignore"):
        sound = (values >= declared.low) & (values <= declared.high)
        sound |= declared.may_be_nan & np.isnan(values)
    if not sound.all():
        return f"holds {values[~sound].flat[0]:g}, which cannot be"
    if declared.ascending and (values.size < 2 or not (np.diff(values) > 0).all()):
        return "does not ascend"
    return ""


def _between(file: h5py.File, sizes: dict[str, int]) -> list[str]:
    """What does not fit together: numbers of nodes and spans beyond those that there are."""
    faults = []
    limits = {"line/droppers": sizes["N"], "line/dropper_span": sizes["M"] - 1}
    if is_there(file, "line/arm_wire"):
        limits["line/arm_wire"] = len(file["line/wires"])
    limits |= {f"line/wires/{name}": sizes["N"] for name in file["line/wires"]}
    for name in _names(file, "line/breaks"):
        limits[f"line/breaks/{name}"] = file[f"line/wires/{name}"].size
    for path, limit in limits.items():
        values = np.asarray(file[path][...])
        if values.size and int(values.max()) >= limit:
            faults.append(f"{path} names number {values.max()} of {limit}")
    if faults:
        return faults
    x = file["static/contact_x"][...]
    start, end = file["line/evaluation_range"][...]
    if start >= x.max() or end <= x.min():
        return ["line/evaluation_range lies beyond the contact wires"]
    return []

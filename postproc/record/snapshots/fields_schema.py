"""The attributes and tables of ``fields.h5``, declared once, read against the declaration, and told
to ParaView as XDMF.

As ``run_schema`` and ``result_tables`` do for ``run.h5``. Fields themselves are checked for kind
and length here, and for their values snapshot by snapshot. Not collective.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, NamedTuple

import h5py
import numpy as np
from h5py import h5d
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from catenary.postproc.files import xdmf
from catenary.postproc.files.hdf5 import HDF5_ERRORS, Damage
from catenary.postproc.files.run_schema import JSON, Positive, Table, Text, count_table, largest
from catenary.postproc.read.validation import read_attributes, table_values
from catenary.postproc.record.snapshots.contents import (
    FIXED,
    FORMAT,
    KINDS,
    OTHER_PARTS,
    PLACES,
    SIZES,
    BlockTables,
    FieldKind,
)

# More snapshots or pantographs' numbers than any run has; nothing larger is read.
_MOST_SNAPSHOTS, _MOST_PARTS, _MOST_PLACES = 10**7, 10**4, 10**6
# Times that are read together.
_TIMES = 1 << 16


def _each_once(names: list[str]) -> list[str]:
    if len(set(names)) < len(names) or any(name in ("", ".") or "/" in name for name in names):
        raise ValueError("names")
    return names


class FieldsAttributes(BaseModel):
    """The root attributes, as `RunAttributes` of a result file."""

    model_config = ConfigDict(strict=True)

    format: Literal["catenary-fields-2"] = Field(description=f'"{FORMAT}"')
    n_nodes: Positive
    parts: Annotated[
        list[Text], JSON, AfterValidator(_each_once), Field(min_length=1, max_length=_MOST_PARTS)
    ] = Field(description="a list of names, each of them once")
    rests_beyond: Literal[0, 1] = Field(default=0, description="0 or 1")


BLOCK: dict[str, Table] = {
    "points": Table(("point", "xyz"), "m"),
    "nodes": count_table(("point",)),
    "cells": count_table(("cell", "upper_lower"), most=1e9),
    "first": count_table(("snapshot",)),
    "count": count_table(("snapshot",)),
    "cell_first": count_table(("snapshot",)),
    "cell_count": count_table(("snapshot",)),
}


class FieldTables(NamedTuple):
    """A ``fields.h5`` that is valid.

    Attributes
    ----------
    n_nodes : of the line
    rests_beyond : whether wires are at rest at all points that a snapshot does not show
    times : of the snapshots that are there, ascending (n,) [s]
    n_places : how many numbers of each pantograph there are, (pantographs,)
    blocks : tables of each block by its name, in the order of the file
    """

    n_nodes: int
    rests_beyond: bool
    times: np.ndarray
    n_places: np.ndarray
    blocks: dict[str, BlockTables]


def read_fields(file: h5py.File) -> FieldTables:
    """All of a file of snapshots but the fields and the places of pantographs.

    Raises
    ------
    Damage
        If anything is missing, of another kind, or does not fit the rest.
    """
    about, _ = read_attributes(file, FieldsAttributes)  # all of which are needed
    clock = _table(file, "times", np.dtype("<f8"), (None,))
    n_planned = clock.shape[0]
    if n_planned > _MOST_SNAPSHOTS:
        raise Damage(f"times has {n_planned} rows, and no run has so many snapshots")
    sizes = _read(file, SIZES, count_table(("pantograph",), most=_MOST_PLACES), {})
    _table(file, PLACES, np.dtype("<f8"), (n_planned, sizes.size + int(sizes.sum())))
    n_nodes = int(about["n_nodes"])
    blocks = {name: _block(file, name, n_planned, n_nodes) for name in about["parts"]}
    return FieldTables(n_nodes, bool(about["rests_beyond"]), _times(clock), sizes, blocks)


def _table(
    file: h5py.File, path: str, kind: np.dtype | None, shape: tuple[int | None, ...]
) -> h5py.Dataset:
    """A table, whose numbers stand one after another in the file.

    It must have numbers of this ``kind`` and this ``shape``, where None stands for any.
    """
    try:
        table = file[path]
        there, own = table.shape, table.dtype
        layout = table.id.get_create_plist().get_layout()
    except HDF5_ERRORS as error:
        raise Damage(f"{path} is missing or cannot be read") from error
    if kind is not None and own != kind:
        raise Damage(f"{path} holds {own} in place of {kind}")
    wanted = (
        tuple(size if one is None else one for one, size in zip(shape, there, strict=False))
        + shape[len(there) :]
    )
    if there != wanted:
        raise Damage(f"{path} has the shape {there} in place of {wanted}")
    if layout != h5d.CONTIGUOUS or (table.size and table.id.get_offset() is None):
        raise Damage(f"{path} does not stand in one piece in the file")
    return table


def _read(file: h5py.File, path: str, declared: Table, sizes: dict[str, int]) -> np.ndarray:
    """The values of a table as it is declared; ``sizes`` of dimensions are added."""
    _table(file, path, None, (None,) * len(declared.dimensions))
    return table_values(file, path, declared, sizes)


def _times(clock: h5py.Dataset) -> np.ndarray:
    """The times up to the first that is not there, which ascend [s]."""
    parts = [np.zeros(0)]
    for start in range(0, clock.shape[0], _TIMES):
        part = clock[start : start + _TIMES]
        there = int(np.append(np.isfinite(part), False).argmin())
        parts.append(part[:there])
        if there < part.size:
            break
    times = np.concatenate(parts)
    if not (np.diff(times) > 0.0).all():
        raise Damage("times does not ascend")
    if times.size and not 0.0 <= times[0] <= times[-1] <= largest("s"):
        raise Damage(f"times reaches from {times[0]:g} to {times[-1]:g} s, which cannot be")
    return times


def _block(file: h5py.File, name: str, n_planned: int, n_nodes: int) -> BlockTables:
    """The tables of a block, which fit each other, the line and the block's fields."""
    sizes = {"snapshot": n_planned}
    is_wire = name not in OTHER_PARTS
    lowest = 0 if is_wire else FIXED
    declared = {**BLOCK, "nodes": BLOCK["nodes"]._replace(low=lowest, high=n_nodes - 1)}
    found = BlockTables(
        **{own: _read(file, f"{name}/{own}", how, sizes) for own, how in declared.items()}
    )
    # Of a wire two points at least are shown; of all else two belong together.
    least, step, most = (2, 1, sizes["point"]) if is_wire else (0, 2, sizes["point"])
    wrong = (found.count < least) | (found.first + found.count > most)
    wrong |= (found.first % step != 0) | (found.count % step != 0)
    if wrong.any() or most % step:
        raise Damage(f"{name}/first and {name}/count do not show points out of its {most}")
    fault = _cells_fault(found)
    if fault:
        raise Damage(f"{name}/{fault}")
    for kind in KINDS.values():
        if kind.name in file[name]:
            _field(file, name, kind, int(found.count.sum()))
    return found


def _cells_fault(block: BlockTables) -> str:
    """The fault of the cells of the snapshots, as a clause behind the name of the block."""
    begin, number = block.cell_first, block.cell_count
    if (begin + number > len(block.cells)).any():
        return f"cell_count shows other cells than its {len(block.cells)}"
    largest = np.append(block.cells.max(axis=1, initial=-1), -1)
    if not begin.any():  # all snapshots have the first of the same cells
        reached = np.maximum.accumulate(largest)[number - 1]
    elif (begin == np.cumsum(number) - number).all():  # each has its own
        reached = np.maximum.reduceat(largest, begin)
    else:
        return "cell_first does not ascend by cell_count"
    if (np.where(number > 0, reached, -1) >= block.count).any():
        return "cells join points that a snapshot does not show"
    return ""


def _field(file: h5py.File, name: str, kind: FieldKind, n_points: int) -> None:
    """Raise Damage unless a field has its numbers for all points of all snapshots."""
    rows = kind.values_of(n_points)
    shape = (rows, kind.components)[: 1 + (kind.components > 1)]
    _table(file, f"{name}/{kind.name}", np.dtype(kind.number), shape)


def xdmf_of(file: h5py.File, tables: FieldTables, path: str) -> str:
    """XDMF of the snapshots of a file, which is at ``path`` beside the text."""
    times = tables.times.tolist()
    blocks = [
        xdmf.collection(name, _grids(file[name], name, block, times, path))
        for name, block in tables.blocks.items()
    ]
    return xdmf.document(xdmf.collection("line", blocks, "Spatial"))


def _grids(
    group: h5py.Group, name: str, block: BlockTables, times: list[float], path: str
) -> Iterator[str]:
    """The grids of a block at ``times`` [s]."""
    kinds = [kind for kind in KINDS.values() if kind.name in group]
    names = ("cells", "points", *(kind.name for kind in kinds))
    cells, points, *fields = (
        xdmf.Item(own.shape, own.dtype, path, own.id.get_offset() or 0)
        for own in map(group.__getitem__, names)
    )
    counts = block.count.tolist()
    starts = (np.cumsum(block.count) - block.count).tolist()
    for k, time in enumerate(times):
        first, n = int(block.first[k]), counts[k]
        # The XDMF reader takes a mesh for the one before if its items begin alike.
        mark = f"<!-- {first} {n} -->"
        yield xdmf.grid(
            name,
            cells.rows(int(block.cell_first[k]), int(block.cell_count[k]), mark),
            points.rows(first, n, mark),
            [
                xdmf.Values(
                    kind.name,
                    field.rows(kind.values_of(starts[k]), kind.values_of(n)),
                    kind.of_droppers,
                )
                for kind, field in zip(kinds, fields, strict=True)
            ],
            time,
        )

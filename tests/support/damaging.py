"""Damages result files: attributes and datasets deleted or replaced, bits flipped in tables."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from catenary.postproc.files.hdf5 import ARRAYS_SUM, ATTRIBUTE_SUMS


class Mutation(NamedTuple):
    """A way to damage a file: a name that replays it, and what does it."""

    name: str
    apply: Callable[[h5py.File], None]


# What an attribute is replaced by: other types, shapes, signs, sizes, words.
_VALUES: dict[str, Any] = {
    "nan": float("nan"),
    "negative": -1.0,
    "zero": 0,
    "huge": 1e300,
    "text": "what",
    "empty": "",
    "array": np.arange(3),
    "half JSON": '{"a": [1, ',
    "odd JSON": '{"a": NaN}',
    "list": "[1, null, {}]",
    "table": '{"line": {"damping": 3}}',
    "bytes": np.bytes_(b"\xff\xfe"),
    "none": h5py.Empty("f"),
}


def attribute_mutations(path: Path) -> Iterator[Mutation]:
    """Each root attribute deleted, and replaced by each odd value."""
    with h5py.File(path) as file:
        names = sorted(set(file.attrs) - {ATTRIBUTE_SUMS})
    for name in [*names, ATTRIBUTE_SUMS]:
        yield Mutation(f"{name} deleted", lambda file, name=name: file.attrs.__delitem__(name))
        for word, value in _VALUES.items():
            yield Mutation(
                f"{name} = {word}",
                lambda file, name=name, value=value: file.attrs.__setitem__(name, value),
            )


def dataset_mutations(path: Path) -> Iterator[Mutation]:
    """Each dataset and group deleted or replaced, and values within each replaced."""
    paths: list[str] = []
    with h5py.File(path) as file:
        file.visit(paths.append)
        tables = {p: (file[p].shape, file[p].dtype) for p in paths if hasattr(file[p], "shape")}
    for name in paths:
        yield Mutation(f"{name} deleted", lambda file, name=name: file.__delitem__(name))
    for name, (shape, kind) in tables.items():
        odd: dict[str, Any] = {
            "a scalar": 3.0,
            "text": "what",
            "empty": np.zeros(0),
            "one row": np.zeros((1, *shape[1:])),
            "complex": np.zeros(shape, dtype=complex),
            "more dimensions": np.zeros((*shape, 2)),
            "NaN throughout": np.full(shape, np.nan),
            "negative": np.full(shape, -1, dtype=kind if kind.kind in "if" else float),
        }
        for word, value in odd.items():
            yield Mutation(f"{name} is {word}", _replaced(name, value))
        if 0 in shape:
            continue
        for word, number in (("NaN", np.nan), ("1e156", 1e156), ("-1e200", -1e200)):
            if kind.kind == "f":
                yield Mutation(f"{name} holds {word}", _one(name, number))
        if kind.kind == "i":
            yield Mutation(f"{name} holds 2^40", _one(name, 2**40))


def _replaced(name: str, value: Any) -> Callable[[h5py.File], None]:
    def apply(file: h5py.File) -> None:
        del file[name]
        file[name] = value

    return apply


def _one(name: str, number: float) -> Callable[[h5py.File], None]:
    """Replace one value in the middle."""

    def apply(file: h5py.File) -> None:
        dataset = file[name]
        values = np.array(dataset[...])
        with np.errstate(over="ignore"):  # infinite in single precision
            values.reshape(-1)[values.size // 2] = number
        dataset[...] = values

    return apply


def unseal(file: h5py.File) -> None:
    """Take our checksums away, as in a file of an earlier version."""
    if ATTRIBUTE_SUMS in file.attrs:
        del file.attrs[ATTRIBUTE_SUMS]
    facts = [file["facts"]] if "facts" in file else []
    for group in (*facts, *file.get("checkpoint", {}).values()):
        if ARRAYS_SUM in group.attrs:
            del group.attrs[ARRAYS_SUM]


def raw_ranges(path: Path) -> list[tuple[int, int]]:
    """Places in the file of the numbers of its datasets, all else being tables of HDF5."""
    found: list[tuple[int, int]] = []

    def visit(_: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or item.size is None:
            return
        if item.chunks is None:
            at = item.id.get_offset()
            if at is not None:
                found.append((at, at + item.id.get_storage_size()))
            return
        for number in range(item.id.get_num_chunks()):
            info = item.id.get_chunk_info(number)
            found.append((info.byte_offset, info.byte_offset + info.size))

    with h5py.File(path) as file:
        file.visititems(visit)
        end = file.id.get_filesize()
    return [*sorted(found), (min(end, path.stat().st_size), path.stat().st_size)]


def flip(path: Path, rng: random.Random, *, tables: bool) -> int:
    """Flip one bit, of HDF5's tables or anywhere, and return its place in the file."""
    data = bytearray(path.read_bytes())
    numbers = np.zeros(len(data), dtype=bool)
    for begin, end in raw_ranges(path) if tables else []:
        numbers[begin:end] = True
    # Most of what is no number is room that was claimed: zeros that nobody reads.
    places = np.flatnonzero(~numbers & (np.frombuffer(data, dtype=np.uint8) != 0))
    at = int(rng.choice(places))
    data[at] ^= 1 << rng.randrange(8)
    path.write_bytes(data)
    return at


def as_json(value: Any) -> str:
    """For comparing what two readers made of a file."""
    return json.dumps(value, sort_keys=True, default=str)


def spoil_chunk(path: Path, table: str, offset: tuple[int, ...]) -> None:
    """Flip a bit in the chunk of a table that begins at ``offset``."""
    with h5py.File(path) as file:
        place = file[table].id.get_chunk_info_by_coord(offset).byte_offset
    with path.open("r+b") as file:
        file.seek(place + 40)
        (byte,) = file.read(1)
        file.seek(place + 40)
        file.write(bytes([byte ^ 0x10]))

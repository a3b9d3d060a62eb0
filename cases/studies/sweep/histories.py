"""Histories of an ensemble's variants in one HDF5 file, padded with NaN to the longest.

A piece of work leaves those of its variants in a file beside its record; when all are done they
are joined, a variant at a time, and the files of the pieces go. Those of several sweeps are merged
into one file of the same kind. Names, units and dimensions are those of netCDF-4 and CF, so that
xarray opens the file by names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from catenary.base.files import appears_whole
from catenary.cases.result_folder.output_folder import remove_dead_parts
from catenary.cases.studies.records import KeptRows
from catenary.cases.studies.sweep.jobs import HISTORIES
from catenary.cases.studies.sweep.variants import Variant
from catenary.postproc.files.committed_rows import FILTERED_FORCE
from catenary.postproc.files.dimensions import CONVENTIONS
from catenary.postproc.files.disk import MARGIN, opened, reserve, unwritten
from catenary.postproc.files.hdf5 import HDF5_ERRORS, open_own

FILE = "histories.h5"
# Attribute that says of which sweep a joined file is.
_SWEEP = "sweep"
_TIME, _POSITION, _VARIANT = "time", "position", "variant"
_ALWAYS = {
    _TIME: ("s", "simulated time"),
    _POSITION: ("m", "position of the contact along the track"),
}
_DIMENSIONS = (_VARIANT, "step", "pantograph")
_LONGEST_CHUNK = 1 << 16  # steps

Put = Callable[[int, Mapping[str, np.ndarray]], None]


@contextmanager
def piece_file(path: Path | None, names: Sequence[str]) -> Iterator[Put]:
    """Yield a function that writes histories of a piece of work: of the number of a variant, and
    its tables by their paths in a result file. The file appears whole at the end of the context.
    Not collective.

    Parameters
    ----------
    path : None to keep none
    names : out of ``HISTORIES``

    Raises
    ------
    RunBroken
        If the disk refuses.
    """
    if path is None:
        yield lambda number, tables: None
        return
    with _written(path) as file:

        def put(number: int, tables: Mapping[str, np.ndarray]) -> None:
            group, chosen = file.create_group(str(number)), _chosen(tables, names)
            _reserve(file, chosen.values())
            for name, values in chosen.items():
                group.create_dataset(name, data=values)

        yield put


def _chosen(tables: Mapping[str, np.ndarray], names: Sequence[str]) -> dict[str, np.ndarray]:
    """Time (n_steps,), position and the histories (n_steps, n_pantographs), in single precision."""
    kept = {}
    for name in names:
        path = FILTERED_FORCE if name == "filtered_force" else f"channels/{name}"
        kept[name] = tables[path].astype(np.float32)
    return {_TIME: tables["time"], _POSITION: tables["channels/contact_position"], **kept}


class KeptHistories(KeptRows):
    """Rows of the pieces of an ensemble, and their histories beside them.

    Parameters
    ----------
    out : folder of the sweep
    names : which histories, out of ``HISTORIES``
    sweep : digest that names the sweep
    force : forget what is there
    part : folder within ``out`` of the part of the sweep that these pieces are, None of all
    """

    def __init__(
        self,
        out: Path,
        names: Sequence[str],
        sweep: str,
        force: bool = False,
        part: str | None = None,
    ) -> None:
        super().__init__(out, force)
        self._path = out / (part or "") / FILE
        self._names, self._sweep, self._force = names, sweep, force
        self._is_whole = part is None

    def get(self, depends_on: Any) -> Any:
        """Rows that are there and have their histories. Not collective."""
        there = self.file_of(depends_on).is_file() or self._is_joined()
        return super().get(depends_on) if there else None

    def file_of(self, depends_on: Any) -> Path:
        """File of the histories of a piece of work, until they are joined."""
        record = self.path_of(depends_on)
        assert record is not None
        return record.with_suffix(".h5")

    def remove_parts(self) -> None:
        """As of ``KeptRows``, and those of joined histories."""
        super().remove_parts()
        remove_dead_parts(self._path.parent, [FILE])

    def join(self, variants: Sequence[Variant], pieces: Mapping[Path, Sequence[Variant]]) -> None:
        """Make one file of those of the pieces; those of a whole sweep go. Not collective.

        Where one is missing, of a process that was lost, they wait for the same command.

        Parameters
        ----------
        variants : of all pieces
        pieces : the file of each, and its variants

        Raises
        ------
        RunBroken
            If the disk refuses.
        """
        if not self._is_joined():
            if not all(piece.is_file() for piece in pieces):
                return
            shapes = [shape for piece in pieces for shape in _shapes(piece)]
            n_steps, n = np.max(shapes, axis=0, initial=1).tolist()
            keys = dict.fromkeys(key for one in variants for key in one.varied)
            varied = {  # a slash in the name of a pantograph would make a group
                key.replace("/", "_"): _numbers([one.varied.get(key, "") for one in variants])
                for key in keys
            }
            row_of = {one.name: row for row, one in enumerate(variants)}
            with _written(self._path) as file:
                _describe(file, list(row_of), varied, self._names, (n_steps, n))
                for piece, own in pieces.items():
                    _copy(piece, [row_of[one.name] for one in own], file)
                file.attrs[_SWEEP] = self._sweep
        for piece in pieces if self._is_whole else ():
            piece.unlink(missing_ok=True)

    def _is_joined(self) -> bool:
        """Whether the joined histories of this sweep are there."""
        if self._force:
            return False
        try:
            with open_own(self._path) as file:
                return bool(file.attrs.get(_SWEEP) == self._sweep)
        except HDF5_ERRORS:
            return False


def _shapes(piece: Path) -> list[tuple[int, int]]:
    with open_own(piece) as file:
        return [group[_POSITION].shape for group in file.values()]


def _copy(piece: Path, rows: Sequence[int], file: h5py.File) -> None:
    """Copy the variants of a piece to their rows."""
    with open_own(piece) as source:
        for number, row in enumerate(rows):
            if str(number) not in source:
                continue  # a variant that broke
            tables = {name: table[...] for name, table in source[str(number)].items()}
            _put(file, row, tables)


def _put(file: h5py.File, row: int, tables: Mapping[str, np.ndarray]) -> None:
    """Write the histories of a variant to its row."""
    _reserve(file, tables.values())
    for name, table in tables.items():
        file[name][(row, *(slice(0, size) for size in table.shape))] = table


def _reserve(file: h5py.File, tables: Iterable[np.ndarray]) -> None:
    """Claim room for tables on the disk, behind what was written before."""
    file.flush()
    reserve(file, MARGIN + sum(table.nbytes for table in tables))


@contextmanager
def _written(path: Path) -> Iterator[h5py.File]:
    """A new file that appears whole at the end of a context. Not collective; RunBroken if the disk
    refuses."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with appears_whole(path) as partial, opened(partial, "w") as file:
            yield file
    except (OSError, RuntimeError) as error:  # h5py raises both
        raise unwritten(path, error) from error


def merge_histories(path: Path, folders: Mapping[str, Path]) -> tuple[list[Path], str]:
    """Join histories of several sweeps in a file. Not collective.

    Returns the file, if there are some, and why histories are left out, empty if they are not. An
    earlier file that is none of theirs goes.

    Parameters
    ----------
    path : of the new file
    folders : by the name of each variant, in their order, the folder of the sweep that has its
        history

    Raises
    ------
    RunBroken
        If the disk refuses.
    """
    if path.parent.resolve() not in map(Path.resolve, folders.values()):
        path.unlink(missing_ok=True)
    with ExitStack() as stack:
        sources, rows = dict[Path, h5py.File](), dict[Path, dict[str, int]]()
        for folder in dict.fromkeys(folders.values()):
            try:
                source = stack.enter_context(open_own(folder / FILE))
                rows[folder] = {name: row for row, name in enumerate(source[_VARIANT].asstr())}
            except HDF5_ERRORS:
                continue
            sources[folder] = source
        if not sources:
            return [], ""
        first = next(iter(sources.values()))
        tables = [name for name in first if name not in _DIMENSIONS]
        for variant, folder in folders.items():
            if variant not in rows.get(folder, ()):
                return [], f"histories are left out: {folder} has none of {variant}"
        for folder, source in sources.items():
            if [name for name in source if name not in _DIMENSIONS] != tables:
                return [], f"histories are left out: those of {folder} have other names"
        at = [(sources[folder], rows[folder][name]) for name, folder in folders.items()]
        varied = {key: _joined(key, at) for key in tables if first[key].ndim == 1}
        names = [name for name in tables if name in HISTORIES]
        sizes = [file[_POSITION].shape[1:] for file in sources.values()]
        with _written(path) as file:
            _describe(file, list(folders), varied, names, tuple(np.max(sizes, axis=0).tolist()))
            for row, (source, own) in enumerate(at):
                kept = {name: source[name][own] for name in (_TIME, _POSITION, *names)}
                _put(file, row, kept)
    return [path], ""


def _joined(key: str, at: Sequence[tuple[h5py.File, int]]) -> Any:
    """Values of a varied key at rows of files: numbers, if all are some, else texts."""
    values = [file[key][row] for file, row in at]
    return _numbers([one.decode() if isinstance(one, bytes) else str(one) for one in values])


def _describe(
    file: h5py.File,
    variants: Sequence[str],
    varied: Mapping[str, Any],
    names: Sequence[str],
    sizes: tuple[int, ...],
) -> None:
    """Make tables of NaN with their dimensions and units, and the varied keys of each variant.

    Parameters
    ----------
    variants : their names
    varied : values of each key by variants
    names : of the histories
    sizes : numbers of steps and of pantographs
    """
    shape = (len(variants), *sizes)
    file.attrs["Conventions"] = CONVENTIONS
    file.create_dataset(_VARIANT, data=list(variants), dtype=h5py.string_dtype())
    for name, size in zip(_DIMENSIONS[1:], sizes, strict=True):
        file.create_dataset(name, data=np.arange(size) + (name == "pantograph"))
    for name in _DIMENSIONS:
        file[name].make_scale(name)
    for key, values in varied.items():
        table = file.create_dataset(key, data=values)
        table.dims[0].attach_scale(file[_VARIANT])
    for name in (_TIME, _POSITION, *names):
        n = 2 if name == _TIME else 3
        table = file.create_dataset(
            name,
            shape=shape[:n],
            maxshape=(None, *shape[1:n]),  # a compressed table of a fixed length is refused
            dtype="f8" if name in _ALWAYS else "f4",
            chunks=(1, min(shape[1], _LONGEST_CHUNK), shape[2])[:n],
            fillvalue=np.nan,
            compression="gzip",
            shuffle=True,
        )
        table.attrs["units"], table.attrs["long_name"] = {**_ALWAYS, **HISTORIES}[name]
        if name not in _ALWAYS:
            table.attrs["coordinates"] = " ".join([*_ALWAYS, *varied])
        for axis, dimension in enumerate(_DIMENSIONS[:n]):
            table.dims[axis].attach_scale(file[dimension])


def _numbers(texts: Sequence[str]) -> Any:
    """Numbers, if all texts are some, else the texts."""
    try:
        return np.array([float(text) for text in texts])
    except ValueError:
        return list(texts)

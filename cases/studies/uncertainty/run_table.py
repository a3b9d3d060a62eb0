"""Tables of runs as frames of pandas: from a sweep's folder, a file or rows."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd

from catenary.base.errors import InputError
from catenary.base.files import is_file, is_folder
from catenary.cases.scene.input.plain_text import plain
from catenary.cases.studies.sweep.jobs import OF_LINE
from catenary.cases.studies.sweep.output import PARQUET, TABLE
from catenary.cases.studies.uncertainty.sampling import ChoicesTable, SamplingTable, sampling_of
from catenary.postproc.files.run_schema import DONE
from catenary.postproc.report.study_table import Content

SAMPLING = "sampling.json"
# Columns with a list of words in each cell, which CSV joins.
_LISTS = ("failed", "judged", "remarks")
_JOINT = "; "
_MOST_BYTES = 2_000_000_000
# Pandas reads the numbers that were written from version 3.1 on, before only if asked.
_OLD = tuple(map(int, pd.__version__.split(".")[:2])) < (3, 1)
_EXACT: dict[str, Any] = {"float_precision": "round_trip"} if _OLD else {}
# Columns of a sweep's table that are neither inputs nor statistics.
_OTHERS = ("variant", "outcome", "pantograph", "passed", *_LISTS, "wall_s")


class RunTable(NamedTuple):
    """Rows of runs, one for each variant and pantograph.

    Attributes
    ----------
    frame : columns as in ``sweep.csv``
    inputs : names of the columns that were varied
    sampling : how they were, None if that is not known
    """

    frame: pd.DataFrame
    inputs: tuple[str, ...]
    sampling: SamplingTable | None = None

    @property
    def done(self) -> pd.DataFrame:
        """Rows of variants that were run to their end."""
        return self.frame[self.frame["outcome"] == DONE]

    @property
    def statistics(self) -> list[str]:
        """Names of the columns with figures of the runs."""
        done = self.done
        return [
            name
            for name in self.frame.columns
            if name not in (*_OTHERS, *self.inputs)
            and pd.api.types.is_numeric_dtype(done[name])
            and not pd.api.types.is_bool_dtype(done[name])
            and done[name].notna().any()
        ]

    def of(self, statistic: str) -> dict[str, pd.DataFrame]:
        """Rows that have a statistic, by pantograph; of the line's statistics once a variant."""
        done = self.done
        if statistic in {column.name for column in OF_LINE}:
            return {"": done.drop_duplicates("variant")}
        return {str(name): rows for name, rows in done.groupby("pantograph", sort=False)}

    def figures(self) -> Iterator[tuple[dict[str, str], pd.DataFrame]]:
        """Each statistic with each pantograph, by "statistic" and "pantograph", and their rows."""
        for statistic in self.statistics:
            for pantograph, rows in self.of(statistic).items():
                yield {"statistic": statistic, "pantograph": pantograph}, rows

    @property
    def runs(self) -> pd.DataFrame:
        """A row for each variant."""
        return self.frame.drop_duplicates("variant")


def run_table(
    rows: pd.DataFrame | Iterable[Mapping[str, Any]],
    sampling: SamplingTable | None = None,
    where: str = "the table",
) -> RunTable:
    """A table of runs from rows with the columns of ``sweep.csv``.

    Parameters
    ----------
    rows : at least the column ``variant``; without ``outcome`` all are taken as done
    sampling : names the inputs; else they stand between ``variant`` and ``outcome``
    where : the table's place, for sentences

    Raises
    ------
    InputError
        If columns are missing, a run is there twice, or one has no number for a key that has one.
    """
    frame = rows.copy() if isinstance(rows, pd.DataFrame) else pd.DataFrame(list(rows))
    names = list(frame.columns)
    if "variant" not in names or frame.empty:
        has = f"; its first line has {plain(', '.join(map(str, names)), 100)}" if names else ""
        raise InputError(f"{where} is no table of runs: it needs a column variant, and rows{has}")
    if "outcome" not in names:
        frame["outcome"] = DONE
    if "pantograph" not in names:
        frame["pantograph"] = ""
    frame["pantograph"] = frame["pantograph"].fillna("")
    twice = frame[frame.duplicated(["variant", "pantograph"])]
    if not twice.empty:
        run, who = twice.iloc[0][["variant", "pantograph"]]
        of = f" of {plain(str(who), 100)}" if who else ""
        raise InputError(f"{where} has {plain(str(run), 100)} twice{of}: a run may count once")
    for name in set(_LISTS) & set(names):
        frame[name] = frame[name].map(_words)
    if sampling is not None:
        missing = [name for name in sampling.columns if name not in names]
        if missing:
            raise InputError(f"{where} has no column {missing[0]}, which its sampling varies")
        for name, given in sampling.keys.items():
            if not isinstance(given, ChoicesTable):
                _refuse_words(frame[frame["outcome"] == DONE], name, where)
        return RunTable(frame, sampling.columns, sampling)
    between = names[names.index("variant") + 1 : names.index("outcome")] if (
        "outcome" in names and names.index("outcome") > names.index("variant")
    ) else []  # fmt: skip
    return RunTable(frame, tuple(between))


def _refuse_words(done: pd.DataFrame, name: str, where: str) -> None:
    """Refuse cells of a column without a number."""
    wrong = done[pd.to_numeric(done[name], errors="coerce").isna()]
    if not wrong.empty:
        cell, run = wrong.iloc[0][name], wrong.iloc[0]["variant"]
        has = "no number" if pd.isna(cell) else f'"{plain(str(cell), 40)}"'
        raise InputError(
            f"{where} has {has} in column {name} of {plain(str(run), 100)}; each run needs a number"
        )


def read_run_table(path: Path) -> RunTable:
    """The table of a sweep's folder, or of a CSV or Parquet file, with the sampling beside it.

    Raises
    ------
    InputError
        If there is none, or if it cannot be read.
    """
    file = _file_of(path)
    folder = file.parent
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise InputError(f"{file} is too large for a table of runs")
        if file.suffix == ".parquet":
            frame = pd.read_parquet(file)
        else:
            frame = pd.read_csv(file, keep_default_na=False, na_values=[""], **_EXACT)
    except InputError:
        raise
    except ImportError as error:
        raise InputError(f"{file} needs the package pyarrow: pip install 'pyarrow<22'") from error
    except Exception as error:  # what readers of foreign bytes raise is not of one kind
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(f"{file} cannot be read as a table of runs: {reason}") from error
    return run_table(frame, read_sampling_beside(folder), str(file))


def sampling_file(sampling: SamplingTable) -> dict[str, Content]:
    """File with the sampling of a table, which stands beside the table."""
    return {SAMPLING: sampling.model_dump(exclude_none=True)}


def read_sampling_beside(folder: Path) -> SamplingTable | None:
    """The sampling that a sweep left in its folder, None if there is none."""
    path = folder / SAMPLING
    if not is_file(path):
        return None
    try:
        raw = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path} is damaged; the sweep's command writes it again") from error
    return sampling_of(raw, str(path))


def _file_of(path: Path) -> Path:
    """The file of a table: the path itself, or that of a sweep in a folder."""
    if is_folder(path):
        found = [path / name for name in (PARQUET, TABLE) if is_file(path / name)]
        if not found:
            raise InputError(f"{path} holds no table of a sweep ({TABLE})")
        return found[0]
    if not is_file(path):
        raise InputError(f"{path} is neither a folder of a sweep nor a table of runs")
    if path.suffix not in (".csv", ".parquet"):
        raise InputError(f"{path} must end in .csv or .parquet to be read as a table of runs")
    return path


def _words(cell: Any) -> list[str]:
    """The words of a cell, as a list of Python or Arrow, or as CSV joins them."""
    if isinstance(cell, str):
        return cell.split(_JOINT) if cell else []
    return [str(one) for one in cell] if hasattr(cell, "__len__") else []

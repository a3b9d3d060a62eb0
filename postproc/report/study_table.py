"""Tables of studies: rows below typed columns, as CSV, for terminals and as Markdown."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from catenary.postproc.evaluate.wording import terminal_width, without_sign_of_zero
from catenary.postproc.files.csv_text import csv_text, number_text

Row = Mapping[str, Any]
# More runs than this are not named one by one if a remark is of them all.
_NAMED = 4
# Blanks between columns on a terminal, and columns that words have at least if they are folded.
_GAP, _LEAST_WORDS = 2, 20


class Column(NamedTuple):
    """A column of a table.

    Attributes
    ----------
    name : key of its values in the rows; names of figures end in their unit
    head : above the column where people read it; empty where it stands in files alone
    format : Python's format of a figure where people read it, with which the column stands at the
        right; empty for words at the left
    meaning : with the unit in brackets, for axes of pictures
    in_files : whether CSV and JSON have it
    """

    name: str
    head: str = ""
    format: str = ""
    meaning: str = ""
    in_files: bool = True

    def shown(self, value: Any, unknown: str) -> str:
        """A value as readers see it; ``unknown`` is printed for None."""
        if value is None:
            return unknown
        if isinstance(value, bool):
            return "yes" if value else "no"
        if not self.format:
            return str(cell(value))
        # A count has no decimals among figures that have some.
        form = re.sub(r"\.\d+f$", "d", self.format) if isinstance(value, int) else self.format
        return without_sign_of_zero(format(value, form))


class _Drawn(NamedTuple):
    """A column as a terminal shows it: head, cells, and whether it stands at the right."""

    head: str
    cells: list[str]
    is_right: bool

    def width(self, is_folded: bool) -> int:
        """Columns of the terminal that it takes, with a head that is folded at its words or not."""
        from rich.cells import cell_len

        heads = self.head.split() if is_folded else [self.head]
        return max(cell_len(text) for text in [*self.cells, *heads, ""])


def _pieces(columns: list[_Drawn], width: int | None) -> list[str]:
    """The columns as a table, and where that is wider than ``width`` in pieces below each other.

    Each piece has the columns that name a row. It stays in one where these leave no room beside
    them, and where nobody looks on: what is folded cannot be searched for.
    """
    whole = sum(one.width(False) + _GAP for one in columns) - _GAP
    n_names = _names_of_rows(columns)
    names, others = columns[:n_names], columns[n_names:]
    left = sum(one.width(True) + _GAP for one in names)
    # Words at the left are folded, figures are not.
    least = [
        one.width(True) if one.is_right else min(one.width(True), _LEAST_WORDS) for one in others
    ]
    if width is None or whole <= width or not n_names or left + max(least, default=0) > width:
        return [_rendered(columns, len(columns), whole)]
    pieces, taken = [[*names]], left
    for one, own in zip(others, least, strict=True):
        if len(pieces[-1]) > n_names and taken + own > width:
            pieces.append([*names])
            taken = left
        pieces[-1].append(one)
        taken += own + _GAP
    return [_rendered(piece, n_names, width) for piece in pieces]


def _names_of_rows(columns: list[_Drawn]) -> int:
    """How many columns of words name each row, as variant and pantograph do; 0 if two do not."""
    for n in (1, 2):
        rows = list(zip(*(one.cells for one in columns[:n]), strict=True))
        if len(set(rows)) == len(rows) and not any(one.is_right for one in columns[1:n]):
            return n
    return 0


def _rendered(columns: list[_Drawn], n_whole: int, room: int) -> str:
    """Columns in ``room``, figures and the first ``n_whole`` ones in a line for each row."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    is_folded = n_whole < len(columns)
    table = Table(box=None, pad_edge=False, padding=(0, _GAP, 0, 0), header_style="")
    for number, one in enumerate(columns):
        is_whole = one.is_right or number < n_whole
        table.add_column(
            Text(one.head, no_wrap=not is_folded),
            justify="right" if one.is_right else "left",
            no_wrap=is_whole,
            width=one.width(True) if is_folded and is_whole else None,
        )
    for cells in zip(*(one.cells for one in columns), strict=True):
        table.add_row(*(Text(cell) for cell in cells))
    stream = io.StringIO()
    # Of a width that is known there is none to be taken from the terminal.
    console = Console(file=stream, width=max(room, 1), color_system=None, force_jupyter=False)
    console.print(table)
    return "\n".join(line.rstrip() for line in stream.getvalue().splitlines())


@dataclass(frozen=True)
class StudyTable:
    """Columns, rows by names of columns, title and a note for reports.

    Where ``outcome`` of a row is not "done", people read it in the place of figures.
    """

    columns: Sequence[Column]
    rows: Sequence[Row]
    title: str = ""
    note: str = ""

    def records(self) -> list[dict[str, Any]]:
        """The rows as files have them."""
        names = [column.name for column in self.columns if column.in_files]
        return [{name: row[name] for name in names} for row in self.rows]

    def csv(self) -> str:
        """CSV text with all digits; what is unknown is empty."""
        heads = [column.name for column in self.columns if column.in_files]
        return csv_text(heads, ([cell(row[name]) for name in heads] for row in self.rows))

    def parquet(self) -> bytes | None:
        """Parquet with all digits and types; None where the package pyarrow cannot be loaded."""
        try:
            import pyarrow
            import pyarrow.parquet
        except ImportError:
            return None
        columns = {
            column.name: _of_one_type([row[column.name] for row in self.rows])
            for column in self.columns
            if column.in_files
        }
        stream = io.BytesIO()
        pyarrow.parquet.write_table(pyarrow.table(columns), stream)
        return stream.getvalue()

    @property
    def for_people(self) -> list[Column]:
        """The columns for readers."""
        return [column for column in self.columns if column.head]

    @property
    def head(self) -> list[str]:
        """Heads of the columns for readers."""
        return [column.head for column in self.for_people]

    def texts(self, unknown: str = "") -> list[list[str]]:
        """Cells of the columns for readers, row by row; an outcome is in the second one."""
        people, rows = self.for_people, []
        for row in self.rows:
            if _is_done(row):
                rows.append([column.shown(row.get(column.name), unknown) for column in people])
            else:
                first = people[0].shown(row[people[0].name], unknown)
                rows.append([first, _outcome(row), *[""] * (len(people) - 2)])
        return rows

    def text(self, *, whole: bool = False) -> str:
        """The table for a terminal, in pieces that its width holds; ``whole``, as in a file or a
        pipe, it is the same everywhere."""
        people, width = self.for_people, None if whole else terminal_width()
        columns: list[list[str]] = [[] for _ in people]
        behind = []
        for row, cells in zip(self.rows, self.texts("-"), strict=True):
            shown = cells if _is_done(row) else [cells[0], *[""] * (len(cells) - 1)]
            for own, text in zip(columns, shown, strict=True):
                own.append(text)
            behind.append("" if _is_done(row) else cells[1])
        drawn = [
            _Drawn(own.head, cells, bool(own.format))
            for own, cells in zip(people, columns, strict=True)
        ]
        drawn += [_Drawn("", behind, False)] * any(behind)
        return "\n\n".join(_pieces(drawn, width))

    def markdown(self) -> str:
        """The table of a page, without columns that are empty in all rows."""
        cells = self.texts()
        done = [own for row, own in zip(self.rows, cells, strict=True) if _is_done(row)]
        used = [i for i in range(len(self.head)) if any(own[i] for own in done)] or [0, 1]
        lines = [[self.head[i] for i in used], ["---"] * len(used)]
        lines += [
            [own[i] for i in used] if _is_done(row) else [*own[:2], *[""] * (len(used) - 2)]
            for row, own in zip(self.rows, cells, strict=True)
        ]
        escaped = ([text.replace("|", "\\|") for text in line] for line in lines)
        return "\n".join(f"| {' | '.join(line)} |" for line in escaped)


def file_table(heads: Sequence[str], cells: Iterable[Sequence[Any]]) -> StudyTable:
    """A table for files, with names of columns and the cells of each row."""
    rows = [dict(zip(heads, row, strict=True)) for row in cells]
    return StudyTable([Column(name) for name in heads], rows)


def texts_table(
    heads: Sequence[str],
    rows: Sequence[Sequence[Any]],
    right: Collection[int] = (),
    title: str = "",
    note: str = "",
) -> StudyTable:
    """A table of texts for people.

    Parameters
    ----------
    heads : sequence of str
        Heads of the columns, with units in brackets.
    rows : sequence of sequence
        Texts of the cells.
    right : collection of int, optional
        Numbers of the columns that stand at the right, from 0.
    title, note : str, optional
        What stands above the table.
    """
    columns = [
        Column(str(number), head or " ", ">" if number in right else "")
        for number, head in enumerate(heads)
    ]
    texts = [{str(number): cell for number, cell in enumerate(row)} for row in rows]
    return StudyTable(columns, texts, title, note)


# Content of a file of a study, see ``write_files``.
Content = StudyTable | Mapping[str, Any] | Sequence[Row] | Callable[[], Any] | str | bytes


def write_files(folder: Path, content: Mapping[str, Content]) -> list[Path]:
    """Write what a study leaves, all files or none; returns their paths. Not collective.

    Parameters
    ----------
    folder : Path
        Folder, which is made if it is not there.
    content : mapping
        Content by names of files. A table, or rows with the same keys, become CSV, a mapping JSON,
        and what a function draws a picture; no rows, and a picture that there is none of or that
        fails, are left out, and such a file of an earlier study is removed; texts and bytes are
        written as they are.

    Raises
    ------
    RunBroken
        If the disk refuses.
    """
    from catenary.postproc.files.disk import write_all
    from catenary.postproc.files.own_files import remove_stale

    files: dict[str, bytes | str] = {}
    for name, own in content.items():
        if isinstance(own, str | bytes):
            files[name] = own
        elif isinstance(own, StudyTable):
            files[name] = own.csv()
        elif isinstance(own, Mapping):
            files[name] = json_text(own)
        elif callable(own):
            from catenary.postproc.report.pictures import figures

            files |= figures.painted(name, own)
        elif own:
            files[name] = StudyTable([Column(key) for key in own[0]], own).csv()
    written = write_all(folder, files)
    remove_stale(folder, content.keys() - files.keys())
    return written


def json_text(record: Mapping[str, Any]) -> str:
    """A record as the text of a JSON file."""
    from catenary.postproc.files.disk import plain

    return json.dumps(plain(record), indent=1, ensure_ascii=False) + "\n"


def remark_lines(runs: Iterable[tuple[str, Sequence[str]]]) -> list[str]:
    """Lines for below a table, each remark once with the runs that it is of; none without remarks.

    Of many remarks that differ in numbers alone, the first stands for all.

    Parameters
    ----------
    runs : iterable of tuple
        Name of each run, and its remarks.
    """
    named = list(runs)
    names: dict[str, list[str]] = {}
    for name, remarks in named:
        for text in dict.fromkeys(remarks):
            names.setdefault(text, []).append(name)
    lines = []
    for texts in alike(names):
        if len(texts) > _NAMED:
            runs_of = dict.fromkeys(name for text in texts for name in names[text])
            first = names[texts[0]][0]
            whose = f"{len(runs_of)} of {len(named)} runs, here the numbers of {first}"
            lines.append(f"REMARK      {whose}: {texts[0]}")
        else:
            lines += [f"REMARK      {_of(names[text], len(named))}: {text}" for text in texts]
    return lines


def alike(remarks: Iterable[str]) -> list[list[str]]:
    """Remarks that differ in their numbers alone, together, in the order of the first of each."""
    groups: dict[str, list[str]] = {}
    for text in remarks:
        groups.setdefault(re.sub(r"\d[\d.]*(?:e[-+]?\d+)?", "0", text), []).append(text)
    return list(groups.values())


def _of(names: Sequence[str], n_runs: int) -> str:
    return f"all {n_runs} runs" if len(names) == n_runs > _NAMED else ", ".join(names)


def _of_one_type(values: Sequence[Any]) -> Sequence[Any]:
    """The values of a column of Parquet: cells of CSV where numbers, texts and lists are mixed."""
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    if len(kinds) <= 1 and not kinds & {dict}:
        return values
    return [None if value is None else str(cell(value)) for value in values]


def _is_done(row: Row) -> bool:
    return bool(row.get("outcome", "done") == "done")


def _outcome(row: Row) -> str:
    outcome = str(row["outcome"])
    return outcome if outcome.startswith("not possible") else f"BROKE: {outcome}"


def cell(value: Any) -> Any:
    """A value as a cell of a CSV file."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list) and all(isinstance(entry, str) for entry in value):
        return "; ".join(value)
    if isinstance(value, list | dict):
        return json.dumps(value)
    return number_text(value) if isinstance(value, float) else value

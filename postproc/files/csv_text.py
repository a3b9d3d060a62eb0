"""CSV text in which no cell is a spreadsheet's formula. Every CSV file is written through here."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from typing import Any

# A cell that begins so is run by spreadsheets, unless it is a number or a dash alone: the unit of
# what has none.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def begins_formula(text: str) -> bool:
    """Whether a spreadsheet would run ``text`` in a cell."""
    return text != "-" and text.startswith(_FORMULA) and not _NUMBER.fullmatch(text)


def plain_cell(value: Any) -> Any:
    """``value`` as a cell: a text that a spreadsheet would run gets an apostrophe before it.

    Returns to the start of the line, which Python's ``csv`` leaves without quotes, become spaces.
    """
    if not isinstance(value, str):
        return value
    text = value.replace("\r", " ")
    return f"'{text}" if begins_formula(value) else text


def number_text(value: float) -> str:
    """``value`` with all of its digits, from which the same number is read; zero has no sign."""
    return repr(float(value) + 0.0).removesuffix(".0")


def csv_text(heads: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """A table as CSV text, lines ended by ``\\n``."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([plain_cell(head) for head in heads])
    for row in rows:
        writer.writerow([plain_cell(value) for value in row])
    return stream.getvalue()

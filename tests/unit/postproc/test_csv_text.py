"""CSV text: no cell begins as a formula, numbers stay as they are, every file is written so."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from catenary.postproc.files.csv_text import csv_text, number_text, plain_cell

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    "text", ["=1+1", "+1+1", "-1+1", "@SUM(A1)", "\t=1", "=cmd|' /C calc'!A0", "--", "--1"]
)
def test_a_formula_gets_an_apostrophe(text: str) -> None:
    assert plain_cell(text) == f"'{text}"


@given(st.floats())
def test_a_number_is_read_as_it_was(value: float) -> None:
    read = float(number_text(value))
    assert read == value or read != read and value != value


def test_zero_has_no_sign() -> None:
    assert [number_text(value) for value in (-0.0, 0.0, 250.0, 0.1)] == ["0", "0", "250", "0.1"]


@pytest.mark.parametrize(
    "value", ["-1.5", "+2", "-1e-9", "-.5", "x=1", "-", "", -3.0, 7, None, "'=1"]
)
def test_numbers_and_plain_texts_stay(value: object) -> None:
    assert plain_cell(value) == value


@given(st.lists(st.text(max_size=20), min_size=2, max_size=4))
def test_what_is_read_back_is_never_a_formula(row: list[str]) -> None:
    _, back = csv.reader(io.StringIO(csv_text(["a"] * len(row), [row]), newline=""))
    for cell in back:
        number = cell[:1] in "+-" and cell.strip("+-").replace(".", "").replace("e", "").isdigit()
        assert not cell.startswith(("=", "@", "\t", "\r")) and (
            cell[:1] not in ("+", "-") or number or cell == "-"
        )


def test_no_other_file_writes_csv() -> None:
    writers = [
        path.relative_to(ROOT)
        for part in ("meshgen", "solver", "mbs", "postproc", "cases")
        for path in (ROOT / part).rglob("*.py")
        if "csv.writer(" in path.read_text() or "DictWriter(" in path.read_text()
    ]
    assert writers == [Path("postproc/files/csv_text.py")]

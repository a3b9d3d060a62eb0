"""Texts for people and spreadsheets: numbers, places, tables, terminals of 80 columns."""

from __future__ import annotations

import contextlib
import csv
import fcntl
import io
import math
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from program import ENTRY

from catenary.cases.terminal.terminal_text import summary_text
from catenary.postproc.evaluate.compare import table_row
from catenary.postproc.evaluate.statistics import LateralRange, left_strips_sentence
from catenary.postproc.evaluate.wording import (
    counted,
    decimals_that_tell,
    duration,
    fixed,
    folded,
    of_digits,
    with_minus,
)
from catenary.postproc.files.csv_text import csv_text, number_text, plain_cell
from catenary.postproc.files.header import in_sentence, places_on_train
from catenary.postproc.report import study_table
from catenary.postproc.report.study_table import Column, StudyTable

# --- numbers as people read them ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (-1e-9, 4, "0.0000"),
        (-0.0, 0, "0"),
        (-0.04, 1, "0.0"),
        (-0.05001, 1, "-0.1"),
        (-10.0, 1, "-10.0"),
        (100.0, 0, "100"),
        (math.nan, 2, "nan"),
        (-math.inf, 2, "-inf"),
    ],
)
def test_zero_has_no_sign(value: float, digits: int, text: str) -> None:
    assert fixed(value, digits) == text


def test_one_is_singular() -> None:
    assert [counted(n, "rank") for n in (0, 1, 2)] == ["0 ranks", "1 rank", "2 ranks"]


@pytest.mark.parametrize(
    ("seconds", "said"),
    [(0.83, "0.83 s"), (42.0, "42 s"), (200.0, "3.3 min"), (5300.0, "88 min"), (7560.0, "2.1 h")],
)
def test_times_have_two_digits(seconds: float, said: str) -> None:
    assert duration(seconds) == said


def test_large_numbers_have_no_powers_of_ten() -> None:
    given = (12614.0, 1100.4, 342.4, 0.00874, 0.0)
    assert [of_digits(value, 3) for value in given] == ["12600", "1100", "342", "0.00874", "0"]


# --- numbers that differ look different -----------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "limit", "fewest", "expected"),
    [
        (67.25, 45.29, 2, 2),
        (143.359, 143.356, 2, 3),
        (143.3563, 143.3562, 1, 4),
        (143.356, 143.356, 2, 2),
        (math.nan, 143.356, 2, 2),
        (None, 143.356, 2, 2),
        (math.inf, 350.0, 1, 1),
        (1.0, math.nextafter(1.0, 2.0), 2, 11),
    ],
)
def test_decimals_go_on_until_two_numbers_differ(
    value: float | None, limit: float, fewest: int, expected: int
) -> None:
    assert decimals_that_tell(value, limit, fewest) == expected


def test_negative_numbers_have_a_minus_and_all_else_keeps_its_hyphens() -> None:
    assert with_minus("-7.8 N, from -1 to 2") == "\u22127.8 N, from \u22121 to 2"
    for text in ("0-5 Hz", "2026-11-27", "mean - 3 sigma", "1e-05", "--set a.b=-3", "-o DIR"):
        assert with_minus(text) == text


def test_a_summary_shows_by_how_little_a_limit_is_missed() -> None:
    one = {"name": "pantograph", "loss_percent": 0.0}
    one |= {f"{name}_N": 1.0 for name in ("mean", "std", "max", "min", "stat_max", "stat_min")}
    summary = {
        "case": "made_up",
        "speed_km_h": 275.0,
        "evaluation_m": [0.0, 1.0],
        "pantographs": [one],
        "droppers": {"n_slackened": 0},
        "supports": {"max_uplift_mm": 1.0},
        "n_steps": 1,
        "n_dofs": 1,
        "n_ranks": 1,
        "real_time_factor": 76.2,
        "real_time_factor_with_records": 37.1,
        "acceptance": [
            {
                "criterion": "mean contact force",
                "value": 143.3591,
                "limit": 143.35625,
                "unit": "N",
                "passed": False,
            }
        ],
    }
    text = summary_text(summary, Path("results"), {"march": 0.24, "report": 0.75}, 2.04)
    assert "real-time factor 76.20, with all records 37.10" in text
    assert "2.0 s from the command to this summary: march 0.2, report 0.8" in text
    assert "FAILED      mean contact force: 143.359, limit 143.356 N" in text


@pytest.mark.parametrize(
    ("values", "cells"),
    [
        ([26.8048, 34.6212], ["26.8", "34.6", "7.8"]),  # a deviation is not known to 0.1 mN
        ([119.2703, 119.0911], ["119.27", "119.09", "-0.18"]),
        ([119.2703, 119.2706, 240.0], ["119.2703", "119.2706", "240.0000", "3.0e-04", "120.7297"]),
        ([119.2703, 119.2703], ["119.2703", "119.2703", "0.0000"]),  # equal to all four
        ([0.0, 0.0], ["0.0", "0.0", "0.0"]),
        ([1.0, math.nan], ["1.0000", "nan", "nan"]),
    ],
)
def test_compared_figures_have_the_decimals_of_their_difference(
    values: list[float], cells: list[str]
) -> None:
    assert table_row("mean [N]", values).split()[2:] == cells


# --- pantographs are called by their places on the train ------------------------------------------


@pytest.mark.parametrize(
    ("n", "called"),
    [
        (1, ["the pantograph"]),
        (2, ["the leading pantograph", "the trailing pantograph"]),
        (3, ["the leading pantograph", "pantograph no. 2", "the trailing pantograph"]),
    ],
)
def test_a_sentence_calls_a_pantograph_by_its_place(n: int, called: list[str]) -> None:
    assert [in_sentence(place) for place in places_on_train(n)] == called


def test_a_pantograph_whose_strips_a_wire_leaves_is_called_so_too() -> None:
    second = places_on_train(3)[1]
    left = LateralRange(second, -0.9, 2.0, 150.0, 0.8, left_time=1.5, left_x=125.0)
    assert "leaves the strips of pantograph no. 2, which end 0.8 m" in left_strips_sentence(left)


# --- CSV text -------------------------------------------------------------------------------------


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


def test_zero_in_a_cell_has_no_sign() -> None:
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


# --- text on a terminal of 80 columns -------------------------------------------------------------


REMARK = (
    "REMARK      A head of 7.2 kg on a contact of 50 kN/m has a resonance at 13.3 Hz, inside the "
    "20 Hz band: the contact's stiffness is part of the result."
)


def test_a_sentence_goes_on_below_its_beginning() -> None:
    first, *others = folded(REMARK, 50).splitlines()
    assert first == "REMARK      A head of 7.2 kg on a contact of"
    assert others and all(line.startswith(" " * 12) for line in others)
    assert max(map(len, (first, *others))) <= 50
    assert " ".join([first, *(line.strip() for line in others)]) == REMARK


@pytest.mark.parametrize("width", range(40, 100))
def test_numbers_keep_their_units(width: int) -> None:
    lines = folded(REMARK + " *", width).splitlines()
    for torn in ("7.2", "50", "13.3", "20"):
        assert not any(line.endswith(f" {torn}") for line in lines), torn
    assert not any(line.strip() == "*" for line in lines)


@pytest.mark.parametrize(
    "line",
    [
        "  mean [N]                                119.27        119.09         -0.18",
        "Open it with: paraview --script=results/a_folder_of_some_length/paraview/view.py",
        "results/a_folder/with_a_name_of_more_letters/than_a_terminal_shows/report.html",
    ],
)
def test_rows_commands_and_paths_stay_whole(line: str) -> None:
    assert folded(line, 60) == line


def test_no_width_leaves_text_as_it_is() -> None:
    assert folded(REMARK, None) == REMARK


COLUMNS = [
    Column("variant", "variant"),
    Column("pantograph", "pantograph"),
    *(Column(f"x{n}", f"quantity {n} [N]", ".2f") for n in range(6)),
    Column("accepted", "accepted"),
]
ROWS = [
    {"variant": name, "pantograph": of, **{f"x{n}": 100.0 * n for n in range(6)}}
    | {"accepted": "FAILED the mean contact force, and many other words that take some room"}
    for name in ("speed_km_h_200", "speed_km_h_250")
    for of in ("leading", "trailing")
]


def test_a_wide_table_stands_in_pieces_that_name_their_rows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    table = StudyTable(COLUMNS, ROWS)
    (whole,) = table.text().split("\n\n")  # of a file or pipe, whose lines are searched
    assert max(map(len, whole.splitlines())) > 80
    monkeypatch.setattr(study_table, "terminal_width", lambda: 80)
    pieces = table.text().split("\n\n")
    assert len(pieces) == 2
    for piece in pieces:
        lines = piece.splitlines()
        assert max(map(len, lines)) <= 80
        assert [line.split()[:2] for line in lines if line.startswith("speed")] == [
            [row["variant"], row["pantograph"]] for row in ROWS
        ]
    # No cell is cut, and none is lost.
    assert "\u2026" not in "".join(pieces)
    names = " ".join(f"{row['variant']} {row['pantograph']}" for row in ROWS)
    said = f"{whole} variant pantograph {names}"
    assert sorted(" ".join(pieces).split()) == sorted(said.split())


def test_a_table_whose_rows_have_no_names_stays_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    same = [row | {"variant": "a", "pantograph": "b"} for row in ROWS]
    whole = StudyTable(COLUMNS, same).text()
    monkeypatch.setattr(study_table, "terminal_width", lambda: 80)
    assert StudyTable(COLUMNS, same).text() == whole


@pytest.mark.process
def test_a_verb_writes_lines_as_wide_as_its_terminal() -> None:
    """And into a pipe the same words, in whole lines."""
    words = [sys.executable, "-c", ENTRY, "check", "en50318_2002"]
    piped = subprocess.run(words, capture_output=True, text=True, timeout=240).stdout
    assert max(map(len, piped.splitlines())) > 80
    own, other = pty.openpty()
    fcntl.ioctl(other, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
    with subprocess.Popen(words, stdin=other, stdout=other, stderr=other) as shown:
        os.close(other)
        said = b""
        with contextlib.suppress(OSError):  # the end of a terminal that its program has left
            while chunk := os.read(own, 4096):
                said += chunk
        assert shown.wait(240) == 0, said
    os.close(own)
    lines = said.decode().splitlines()
    assert max(map(len, lines)) <= 80
    assert " ".join(" ".join(lines).split()) == " ".join(piped.split())

"""Text on a terminal of 80 columns: sentences in lines, tables in pieces, commands to copy."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios

import pytest
from program import ENTRY

from catenary.postproc.evaluate.wording import folded
from catenary.postproc.report import study_table
from catenary.postproc.report.study_table import Column, StudyTable

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

"""Tables of studies for files and for people, rows that are kept, remarks, and waiting."""

from __future__ import annotations

import csv
import io
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from mpi4py import MPI
from work_items import work

from catenary.cases.process.workers import WorkerLost
from catenary.cases.studies.hard import checks
from catenary.cases.studies.hard.cases import hard_cases
from catenary.cases.studies.hard.checks import Checked, Criterion, criteria, page
from catenary.cases.studies.records import FOLDER, KeptRows
from catenary.postproc.report.study_table import (
    Column,
    StudyTable,
    remark_lines,
    texts_table,
    write_files,
)

# --- tables of studies for files and for people, and rows that a stopped study keeps --------------


COMM = MPI.COMM_SELF
COLUMNS = [
    Column("run", "run"),
    Column("std_N", "std [N]", ".1f"),
    Column("span_m"),
    Column("none", "never", ".1f"),
    Column("shown", "shown", ">", in_files=False),
]
ROWS = [
    {"run": "[red] slow", "std_N": 0.1 + 0.2, "span_m": [50, 60], "none": None, "shown": "a | b"},
    {"run": "\u5317", "std_N": -0.04, "span_m": None, "none": None, "shown": None},
    {"run": "lost", "outcome": "it fell", "std_N": None, "span_m": None, "none": None},
]
TABLE = StudyTable(COLUMNS, ROWS)


def test_files_of_a_study_are_written_by_what_they_hold(tmp_path: Path) -> None:
    figure = Figure()
    figure.subplots().plot([0.0, 1.0])
    files = write_files(
        tmp_path / "new",
        {
            "table.csv": TABLE,
            "rows.csv": [{"a": 1, "b": 0.1 + 0.2}],
            "none.csv": [],
            "record.json": {"x": np.float64(2.0), "nan": math.nan},
            "picture.png": lambda: figure,
            "nothing.png": lambda: None,
            "page.md": "# A page\n",
        },
    )
    names = [path.name for path in files]
    assert names == ["table.csv", "rows.csv", "record.json", "picture.png", "page.md"]
    assert sorted(names) == sorted(path.name for path in (tmp_path / "new").iterdir())
    texts = {path.name: path.read_bytes() for path in files}
    assert texts["table.csv"].decode() == TABLE.csv()
    assert texts["rows.csv"].decode().splitlines() == ["a,b", f"1,{0.1 + 0.2!r}"]
    assert json.loads(texts["record.json"]) == {"x": 2.0, "nan": None}
    assert texts["picture.png"].startswith(b"\x89PNG") and texts["page.md"] == b"# A page\n"


def test_a_study_leaves_no_picture_of_an_earlier_one(tmp_path: Path) -> None:
    figure = Figure()
    write_files(tmp_path, {"picture.png": lambda: figure, "rows.csv": [{"a": 1}]})
    (tmp_path / "of_others.png").touch()
    assert write_files(tmp_path, {"picture.png": lambda: None, "rows.csv": []}) == []
    assert [path.name for path in tmp_path.iterdir()] == ["of_others.png"]


def test_files_have_all_digits_and_only_their_columns() -> None:
    rows = list(csv.DictReader(TABLE.csv().splitlines()))
    assert list(rows[0]) == ["run", "std_N", "span_m", "none"]
    assert float(rows[0]["std_N"]) == 0.1 + 0.2 and rows[0]["span_m"] == "[50, 60]"
    assert rows[1]["span_m"] == rows[2]["std_N"] == ""
    assert TABLE.records()[0] == {key: ROWS[0][key] for key in rows[0]}
    assert (
        StudyTable([Column("a"), Column("b")], [{"a": True, "b": ["x", "y"]}]).csv()
        == "a,b\ntrue,x; y\n"
    )


def test_a_terminal_has_columns_that_stand_below_their_heads() -> None:
    head, first, second, lost = TABLE.text().splitlines()
    end = head.index("std [N]") + len("std [N]")
    # Text is nobody's markup; a wide letter takes two columns; zero has no sign.
    assert first.startswith("[red] slow") and first[:end].endswith(" 0.3")
    assert second[: end - 1].endswith(" 0.0")
    assert lost.startswith("lost ") and lost.endswith("BROKE: it fell")
    assert not any(line.endswith(" ") for line in (head, first, second, lost))


def test_a_count_has_no_decimals_among_figures() -> None:
    column = Column("change", "change", "+.2f")
    assert [column.shown(value, "") for value in (4, 4.0, -2, 0.001)] == [
        "+4",
        "+4.00",
        "-2",
        "+0.00",
    ]


def test_a_page_has_no_column_that_is_empty() -> None:
    assert TABLE.markdown().splitlines() == [
        "| run | std [N] | shown |",
        "| --- | --- | --- |",
        "| [red] slow | 0.3 | a \\| b |",
        "| \u5317 | 0.0 |  |",
        "| lost | BROKE: it fell |  |",
    ]


def test_parquet_keeps_all_digits_and_types() -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    rows = [
        {"name": "a", "x": 0.1 + 0.2, "n": 3, "mixed": 1, "odd": "text", "failed": ["u", "v"]},
        {"name": "b", "x": None, "n": None, "mixed": 0.5, "odd": [1, 2], "failed": []},
    ]
    content = StudyTable([Column(name) for name in rows[0]], rows).parquet()
    assert content is not None
    found = parquet.read_table(io.BytesIO(content)).to_pylist()
    # A column has one type: whole numbers beside others become numbers, other mixtures texts.
    assert found == [{**rows[0], "mixed": 1.0}, {**rows[1], "odd": "[1, 2]"}]


def test_texts_stand_as_they_are_given() -> None:
    table = texts_table(["", "N"], [["-", 1], ["b", "2.50"]], {1}, "Title", "Note")
    assert table.texts() == [["-", "1"], ["b", "2.50"]]
    assert [column.format for column in table.for_people] == ["", ">"]


def test_rows_are_kept_until_they_are_forgotten(tmp_path: Path) -> None:
    made: list[int] = []

    def make(number: int, comm: object) -> list[list[float]]:
        made.append(number)
        return [[float(number), math.inf, np.float64(0.1), np.bool_(True)]]

    def rows(kept: KeptRows, speed: float, *numbers: int) -> list[object]:
        scene = {"train": {"speed_km_h": speed}}
        found = kept.each(make, numbers, lambda number: [scene, number], 1, COMM)
        return [outcome.get() for outcome in found]

    rows(KeptRows(tmp_path / "out"), 250.0, 1, 2)
    again = KeptRows(tmp_path / "out")
    assert rows(again, 250.0, 3, 2, 1) == [[[n, math.inf, 0.1, True]] for n in (3.0, 2.0, 1.0)]
    rows(again, 251.0, 1)
    assert made == [1, 2, 3, 1]
    rows(KeptRows(tmp_path / "out", force=True), 250.0, 1)
    assert made == [1, 2, 3, 1, 1]
    again.forget()
    assert not (tmp_path / "out" / FOLDER).exists()


@pytest.mark.parametrize(
    "damage", [lambda text: text[:-9], lambda text: text.replace("2.0", "3.0")]
)
def test_rows_that_a_kill_or_disk_has_damaged_are_made_again(damage, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    kept = KeptRows(tmp_path)
    kept.keep("b", [2.0])
    (path,) = (tmp_path / FOLDER).iterdir()
    kept.keep("a", [1.0])
    path.write_text(damage(path.read_text()))
    assert kept.get("a") == [1.0] and kept.get("b") is None
    kept.keep("b", [4.0])
    assert kept.get("b") == [4.0]


@pytest.mark.process
def test_rows_of_several_processes_are_kept_and_come_in_order(tmp_path: Path) -> None:
    words = [1, "be killed", 3, 4]
    found = list(KeptRows(tmp_path).each(work, words, str, 2, COMM))
    assert [one.value for one in found] == [2, None, 6, 8]
    assert isinstance(found[1].error, WorkerLost)
    assert [KeptRows(tmp_path).get(str(word)) for word in words] == [2, None, 6, 8]


def test_a_hard_case_that_was_measured_is_not_measured_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (case,) = hard_cases(["undamped_line"])
    calls: list[bool] = []

    def measured(one: checks._OneCase) -> Checked:
        calls.append(one.short)
        found = [Criterion(one.case.name, "drift", 1e-12, math.inf, True, "a note")]
        return Checked(found, {one.case.name: ["stiff"]})

    monkeypatch.setattr(checks._OneCase, "checked", measured)
    for short in (True, True, False):
        (found,) = checks.check_cases([case], COMM, short, KeptRows(tmp_path))
        assert found == measured(checks._OneCase(case, COMM, short))
    assert calls == [True, True, True, False, False]


# --- what studies tell of their runs --------------------------------------------------------------


def test_a_remark_of_several_runs_is_told_once() -> None:
    told = [("a", ["stiff", "lost"]), ("b", []), ("c", ["lost", "lost"])]
    assert remark_lines(told) == ["REMARK      a: stiff", "REMARK      a, c: lost"]
    assert remark_lines([("a", []), ("b", [])]) == []


def test_many_runs_are_counted_if_a_remark_is_of_them_all() -> None:
    names = "abcde"
    assert remark_lines((name, ["lost"]) for name in names) == ["REMARK      all 5 runs: lost"]
    (line,) = remark_lines((name, ["lost"] if name != "c" else []) for name in names)
    assert line == "REMARK      a, b, d, e: lost"
    assert remark_lines((name, ["lost"]) for name in "ab") == ["REMARK      a, b: lost"]


def test_many_remarks_with_other_numbers_are_one() -> None:
    told = [(f"v{speed}", [f"at {speed}.5 km/h a mesh is coarse"]) for speed in range(300, 306)]
    assert remark_lines([("v200", ["lost"]), *told]) == [
        "REMARK      v200: lost",
        "REMARK      6 of 7 runs, here the numbers of v300: at 300.5 km/h a mesh is coarse",
    ]
    assert len(remark_lines(told[:3])) == 3


def test_tables_of_hard_cases_have_the_remarks_on_them() -> None:
    cases = hard_cases(["undamped_line", "four"])
    found = [Criterion(case.name, "everything is finite", 1.0, 1.0, True) for case in cases]
    told = {"undamped_line": {}, "four": {"four": ["lost"], "four at half the step": ["lost"]}}
    rows = list(csv.DictReader(criteria(found, told).csv().splitlines()))
    assert [row["criterion"] for row in rows] == ["everything is finite"] * 2 + ["remarks"]
    assert rows[2]["case"] == "four" and rows[2]["value"] == "2" and rows[2]["kept"] == ""
    assert rows[2]["note"] == "four: lost; four at half the step: lost"
    lines = page(cases, found, told).splitlines()
    assert lines[-1] == "- four, four at half the step: lost"
    head, sound, lost = ([cell.strip() for cell in lines[n].split("|")] for n in (0, 2, 3))
    assert sound[head.index("remarks")] == "" and lost[head.index("remarks")] == "2"


# --- what a user waits for ------------------------------------------------------------------------


@pytest.mark.process
def test_the_wait_counts_from_the_start_of_the_process() -> None:
    """Not from the import that reads the clock: half a second before that is counted too. The
    system tells the start in hundredths of a second."""
    code = (
        "import time; begin = time.perf_counter(); time.sleep(0.5);"
        "from catenary.cases.terminal.console import waited;"
        "print(waited() - (time.perf_counter() - begin))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert -0.02 < float(done.stdout) < 60.0

"""Runs of a sweep at the same time, ``-j``: the same figures, processes that die, signals."""

from __future__ import annotations

import csv
import io
import signal
from pathlib import Path

import pytest
from measuring import COMM
from program import catenary_started, python, started
from scenes import TINY_WORDS
from verb_runner import invoke
from work_items import die_at_275, measure_steps

from catenary.cases.run.needs import Kept, total_size
from catenary.cases.studies.sweep.jobs import RunOptions, make_jobs
from catenary.cases.studies.sweep.output import table_of
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import parse_vary, product
from catenary.cases.terminal.terminal_text import RunsBar

pytestmark = pytest.mark.usefixtures("quick_reports")

CASE = "en50318_2002"
# Run through in 2300 steps.
TINY = (*TINY_WORDS, "numerics.dt_s=0.001")


def figures(out: Path) -> list[dict[str, str]]:
    """The table of a sweep without the times of its runs."""
    with (out / "sweep.csv").open(encoding="utf-8") as file:
        return [
            {name: cell for name, cell in row.items() if name != "wall_s"}
            for row in csv.DictReader(file)
        ]


THREE = "train.speed_km_h=250,275,300"


@pytest.fixture(scope="module")
def one_by_one(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, str]]:
    out = tmp_path_factory.mktemp("one_by_one")
    done = invoke("sweep", CASE, "-o", str(out), "--vary", THREE, "--set", *TINY)
    assert done.exit_code == 0, done.output
    return figures(out)


@pytest.mark.process
@pytest.mark.parametrize(
    "n_jobs", ["0", *(pytest.param(n, marks=pytest.mark.study) for n in ("2", "3"))]
)
def test_runs_at_the_same_time_have_the_same_figures_to_the_last_digit(
    n_jobs: str, one_by_one: list[dict[str, str]], tmp_path: Path
) -> None:
    words = ["sweep", CASE, "-o", str(tmp_path), "-j", n_jobs, "--vary", THREE, "--set", *TINY]
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    assert figures(tmp_path) == one_by_one
    assert "[3/3] speed_km_h_300: pantograph " in done.stdout and "s left" in done.stdout
    again = invoke(*words)
    assert again.stdout.count("done already") == 3
    assert figures(tmp_path) == one_by_one


@pytest.mark.study
@pytest.mark.process
def test_a_sweep_whose_process_was_killed_tells_and_continues(
    one_by_one: list[dict[str, str]], tmp_path: Path
) -> None:
    """The process of one variant ends for good before its march."""
    jobs = make_jobs(CASE, product([parse_vary(THREE)], {}), TINY)
    lines: list[str] = []
    options = RunOptions(progress=lines.append, n_jobs=2)
    first, lost, third = run_jobs(jobs, tmp_path, COMM, options, measure=die_at_275)
    assert first.done and third.done
    assert lost.outcome == "its process ended by itself with code 9"
    assert any("[2/3] speed_km_h_275: BROKE: its process ended" in line for line in lines)
    again = run_jobs(jobs, tmp_path, COMM, options, measure=measure_steps)
    assert [one.skipped for one in again] == [True, False, True]
    rows = table_of(again).records()
    assert [row["std_N"] for row in rows] == [float(row["std_N"]) for row in one_by_one]


@pytest.mark.study
@pytest.mark.process
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_signal_ends_all_runs_and_the_same_command_continues(
    number: signal.Signals, one_by_one: list[dict[str, str]], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    words = ["sweep", CASE, "-o", str(out), "-j", "2", "--vary", THREE, "--set", *TINY]
    with catenary_started(*words, cwd=tmp_path) as program:
        program.wait_for(lambda: bool(list(out.glob("*/run.h5"))))
        program.send(number)
        ended = program.end()
    assert ended.left == []
    if number != signal.SIGKILL:
        assert ended.code == 1, ended
        assert ended.stderr == (
            "catenary: the sweep was interrupted; the same command continues it\n"
        )
        assert not list(out.rglob("*.lock"))
    done = invoke(*words)
    assert done.exit_code == 0, done.output
    assert figures(out) == one_by_one


def test_many_files_that_do_not_stay_take_room_side_by_side() -> None:
    kept = [
        Kept(job.scene, False, False)
        for job in make_jobs(CASE, product([parse_vary(THREE)], {}), TINY)
    ]
    one, two, many = (total_size(kept, n).n_bytes for n in (1, 2, 9))
    alone = [total_size(kept[i : i + 1]).n_bytes for i in range(3)]
    assert one < two < many == pytest.approx(sum(alone))


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_a_terminal_shows_one_bar_below_the_lines(caplog: pytest.LogCaptureFixture) -> None:
    stream = Terminal()
    with caplog.at_level("INFO", "catenary.progress"):
        with RunsBar(4, lambda line: print(line, file=stream), stream) as bar:
            for name in ("a", "b"):
                bar.ended()
                bar.say(f"{name} has ended")
        shown = stream.getvalue()
        assert "a has ended\n" in shown and "b has ended\n" in shown
        assert "2 of 4, left " in shown and " 50% |" in shown
    with caplog.at_level("ERROR", "catenary.progress"):  # --quiet
        silent = Terminal()
        with RunsBar(4, lambda line: None, silent) as bar:
            bar.ended()
        assert silent.getvalue() == ""


PROGRAM = f"""
import catenary
scene = catenary.load("{CASE}", short=True)
for jobs in (1, 2):
    table = catenary.sweep(scene, {{"train.speed_km_h": [250, 275]}}, jobs=jobs)
    print(table.std_N.tolist())
"""


@pytest.mark.study
@pytest.mark.process
def test_a_program_of_a_user_needs_no_guard_of_its_main_part(tmp_path: Path) -> None:
    """As it would for the processes of ``multiprocessing``, which load the program again."""
    (tmp_path / "program.py").write_text(PROGRAM)
    with started(python("program.py"), tmp_path) as program:
        done = program.end(200.0)
    assert done.code == 0, done.stderr
    one, two = done.stdout.splitlines()
    assert one == two and one.count(",") == 1

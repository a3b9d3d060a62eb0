"""Items of work in processes of their own: order, errors, processes that die, signals."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
from mpi4py import MPI
from work_items import N_SLEEPERS, Count, sleep, sleepers, wait_for_end, work

from catenary import InputError
from catenary.cases.process.workers import Outcome, Pool, WorkerLost, at_once, cores, each, in_order

pytestmark = pytest.mark.process
COMM = MPI.COMM_SELF


@pytest.mark.study
def test_results_come_in_order_from_several_processes() -> None:
    found = list(in_order(each(work, range(7), 3, COMM)))
    assert found == [Outcome(number, 2 * number) for number in range(7)]


@pytest.mark.study
def test_processes_are_others_with_one_rank_and_one_thread() -> None:
    (found,) = each(work, ["describe"], 2, COMM)
    pid, n_ranks, threads = found.get()
    assert pid != os.getpid() and n_ranks == 1 and threads == "1"


@pytest.mark.study
def test_a_function_keeps_what_it_made_for_the_next_item() -> None:
    counts = sorted(outcome.get() for outcome in each(Count(), range(6), 2, COMM))
    assert sum(counts) >= 1 + 1 + 2 + 2 + 3 + 3 and max(counts) >= 3


def test_processes_of_a_pool_last_from_one_series_to_the_next() -> None:
    with Pool(2, work) as pool:
        first, second = (
            {outcome.get()[0] for outcome in pool.of(["describe"] * n)} for n in (4, 1)
        )
        assert second <= first and os.getpid() not in first
        (lost,) = pool.of(["be killed"])
        assert isinstance(lost.error, WorkerLost)
        (found,) = pool.of([3])  # in a new process, or the other one
        assert found.get() == 6
    for pid in first:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


@pytest.mark.parametrize(
    ("item", "told"),
    [
        ("be killed", "its process was ended by SIGKILL, as where no memory is left"),
        pytest.param("leave", "its process ended by itself with code 7", marks=pytest.mark.study),
    ],
)
def test_a_process_that_dies_costs_its_item_only(item: str, told: str) -> None:
    found = list(in_order(each(work, [1, item, 2, item, 3, 4], 2, COMM)))
    assert [one.value for one in found] == [2, None, 4, None, 6, 8]
    assert [str(one.error) for one in found if one.error] == [told, told]
    assert all(isinstance(one.error, WorkerLost) for one in (found[1], found[3]))


@pytest.mark.parametrize("n_at_once", [1, 2])
def test_an_error_that_is_foreseen_is_the_outcome_of_its_item(n_at_once: int) -> None:
    first, second = in_order(each(work, ["refuse", 4], n_at_once, COMM))
    with pytest.raises(InputError, match="the item is wrong"):
        first.get()
    assert second.get() == 8


def test_a_mistake_of_the_program_ends_all_with_its_trace(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="(?s)item 1:.*work_items.py.*a mistake of the program"):
        list(each(work, [1, "fail", 2, 3], 2, COMM))


def test_what_is_logged_there_is_logged_here(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("INFO", "catenary"):
        list(each(work, ["log"], 2, COMM))
    assert ("catenary.runner", logging.WARNING, "from item log") in caplog.record_tuples


@pytest.fixture
def signal_when_asleep(tmp_path: Path) -> Iterator[None]:
    """Sends SIGTERM to this process when the others sleep."""

    def send() -> None:
        sleepers(tmp_path)
        os.kill(os.getpid(), signal.SIGTERM)

    thread = threading.Thread(target=send)
    thread.start()
    yield
    thread.join()


def test_a_signal_ends_all_processes_and_begins_no_item(
    tmp_path: Path, signal_when_asleep: None
) -> None:
    found = list(each(sleep, [tmp_path] * (N_SLEEPERS + 3), N_SLEEPERS, COMM))
    assert found == []
    numbers = sleepers(tmp_path)
    assert len(numbers) == N_SLEEPERS
    wait_for_end(numbers)


@pytest.mark.parametrize(
    "number", [pytest.param(signal.SIGKILL, marks=pytest.mark.study), signal.SIGTERM]
)
def test_processes_end_with_the_one_that_started_them(number: int, tmp_path: Path) -> None:
    start = f"import json, sys; sys.path[:] = json.loads({json.dumps(sys.path)!r}); "
    start += f"from work_items import sleep_in_processes; sleep_in_processes({str(tmp_path)!r})"
    program = subprocess.Popen([sys.executable, "-c", start])
    numbers = sleepers(tmp_path)
    program.send_signal(number)
    program.wait(240.0)
    wait_for_end(numbers)


def test_how_many_at_once() -> None:
    alone, eight = SimpleNamespace(size=1), SimpleNamespace(size=8)
    assert [at_once(wanted, alone) for wanted in (0, 1, 5)] == [cores(), 1, 5]
    assert [at_once(wanted, eight) for wanted in (0, 1, 8)] == [8, 1, 8]
    with pytest.raises(InputError, match="jobs is 3 on 8 ranks; give jobs=8"):
        at_once(3, eight)

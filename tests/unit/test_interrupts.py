"""Signals in every phase of a run: a sentence, a whole folder, and the way to go on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from mpi4py import MPI
from program import SHORT_SCENE
from scenes import Scene, load_scene

from catenary import RunBroken
from catenary.cases.process import interrupts
from catenary.cases.process.interrupts import STOPPING, Interrupted, Phase, Stopped, StopRequest
from catenary.cases.run import runner
from catenary.cases.studies.sweep.jobs import make_jobs
from catenary.cases.studies.sweep.run_jobs import run_jobs
from catenary.cases.studies.sweep.variants import parse_vary, product
from catenary.postproc.read.results import Results
from catenary.postproc.report import report
from catenary.solver.statics import line_at_rest

pytestmark = pytest.mark.usefixtures("quick_reports")

# What is called in each phase of a run before its march.
BEFORE = {
    "the mesh was made": (runner, "mesh_of"),
    "the equilibrium was found": (line_at_rest, "find_form"),
    "the solver was prepared": (runner, "March"),
}


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in STOPPING}
    interrupts.install(several_ranks=False)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)
    interrupts._wish.__init__()  # type: ignore[misc]


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("en50318_2002", SHORT_SCENE)


def signalled(work: Callable[..., Any], number: int) -> Callable[..., Any]:
    """``work``, in which a signal comes."""

    def sends(*args: Any, **kwargs: Any) -> Any:
        os.kill(os.getpid(), number)
        return work(*args, **kwargs)

    return sends


@pytest.mark.parametrize("doing", BEFORE)
@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_before_the_march_leaves_nothing(
    number: signal.Signals,
    doing: str,
    scene: Scene,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module, name = BEFORE[doing]
    monkeypatch.setattr(module, name, signalled(getattr(module, name), number))
    with pytest.raises(Interrupted) as caught:
        runner.run_case(scene, tmp_path / "a" / "out", MPI.COMM_SELF)
    assert str(caught.value) == f"interrupted by {number.name} while {doing}; nothing was written"
    assert caught.value.exit_code == 1
    assert list(tmp_path.iterdir()) == []


def test_with_force_the_earlier_run_stays_as_it_was(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "run.h5").write_text("the earlier run")
    (tmp_path / "summary.json").write_text("{}")
    work = signalled(line_at_rest.find_form, signal.SIGTERM)
    monkeypatch.setattr(line_at_rest, "find_form", work)
    with pytest.raises(Interrupted, match="nothing was written"):
        runner.run_case(scene, tmp_path, MPI.COMM_SELF, force=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.h5", "summary.json"]
    assert (tmp_path / "run.h5").read_text() == "the earlier run"


@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_during_the_march_ends_it_in_good_order(
    number: signal.Signals, scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = runner.March.run
    monkeypatch.setattr(runner.March, "run", signalled(run, number))
    told: list[str] = []
    ended = runner.run_case(
        scene, tmp_path, MPI.COMM_SELF, on_closed=told.append, only_summary=True
    )
    assert ended.outcome == "interrupted" and told == ["interrupted"]
    with Results(tmp_path) as results:
        assert results.outcome == "interrupted"
        step = results.checkpoint["step"]
        assert 0 < results.n_steps == step < results.attributes["n_steps_planned"]


def test_a_signal_during_the_report_leaves_a_whole_result(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(report, "write_report", signalled(report.write_report, signal.SIGHUP))
    with pytest.raises(Interrupted) as caught:
        runner.run_case(scene, tmp_path, MPI.COMM_SELF)
    assert str(caught.value) == (
        f"interrupted by SIGHUP while the report was written; {tmp_path / 'run.h5'} is complete: "
        f"`catenary report {tmp_path}` writes the report again"
    )
    with Results(tmp_path) as results:
        assert results.complete


def test_a_report_of_a_result_that_is_gone_promises_none(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"

    def moves(work: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *args: (out.rename(elsewhere), work(*args))

    monkeypatch.setattr(report, "write_report", moves(report.write_report))
    with pytest.raises(RunBroken, match="moved or removed before its report was written"):
        runner.run_case(scene, out, MPI.COMM_SELF)
    with Results(elsewhere) as results:
        assert results.complete


def test_an_interrupted_variant_interrupts_its_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    variants = product([parse_vary("train.speed_km_h=200,250")], {})
    jobs = make_jobs("en50318_2002", variants, SHORT_SCENE)
    monkeypatch.setattr(runner, "mesh_of", signalled(runner.mesh_of, signal.SIGUSR1))
    ended = run_jobs(jobs, tmp_path, MPI.COMM_SELF)
    assert [one.outcome for one in ended] == ["interrupted"]


@pytest.mark.parametrize("number", [signal.SIGHUP, signal.SIGINT])
def test_a_signal_that_is_ignored_stays_ignored(number: signal.Signals) -> None:
    """As under nohup, and in the background of a script."""
    signal.signal(number, signal.SIG_IGN)
    interrupts.install(several_ranks=False)
    with Phase(MPI.COMM_SELF, "nothing was done", "nothing was written"):
        os.kill(os.getpid(), number)
    assert signal.getsignal(number) == signal.SIG_IGN


def test_what_a_terminal_sends_twice_is_one_wish() -> None:
    with StopRequest() as stop:
        for _ in range(3):
            os.kill(os.getpid(), signal.SIGHUP)
        assert stop()


def test_runs_in_other_threads_leave_signals_to_the_main_thread() -> None:
    entered, leave = threading.Event(), threading.Event()

    def other_run() -> None:
        with Phase(MPI.COMM_SELF, "the mesh was made", "nothing was written"):
            entered.set()
            assert leave.wait(60)

    thread = threading.Thread(target=other_run)
    thread.start()
    assert entered.wait(60)
    try:
        with StopRequest() as stop:
            os.kill(os.getpid(), signal.SIGINT)  # raises Stopped where the thread has changed it
            assert stop()
            leave.set()
            thread.join()
    finally:
        leave.set()
    assert not interrupts._wish.remembering


def test_a_signal_outside_of_a_run_is_raised_as_no_library_catches_it() -> None:
    with pytest.raises(Stopped) as caught:
        try:
            os.kill(os.getpid(), signal.SIGUSR2)
        except Exception:
            pytest.fail("taken for an error")
    assert caught.value.name == "SIGUSR2"


def test_other_programs_get_their_handlers_back() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    interrupts._wish.__init__()  # type: ignore[misc]
    mine = {number: signal.getsignal(number) for number in STOPPING}
    with StopRequest() as stop:
        assert not stop()
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop()
    assert mine == {number: signal.getsignal(number) for number in STOPPING}
    with StopRequest() as stop:
        assert not stop()


def test_a_second_signal_goes_to_the_handler_of_the_other_program() -> None:
    """It ended the process, and with it all that a notebook holds."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    interrupts._wish.__init__()  # type: ignore[misc]
    with pytest.raises(KeyboardInterrupt), StopRequest() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        assert stop()
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with StopRequest() as stop:
        assert not stop()


@pytest.mark.process
def test_libraries_leave_the_handlers_as_they_are(tmp_path: Path) -> None:
    """PETSc and Gmsh set handlers of their own when they start."""
    script = """
import os, signal
from catenary.cases.process import interrupts
from catenary.cases.scene.load import load_scene
interrupts.install(several_ranks=False)
def check(what):
    for number in interrupts.STOPPING:
        try:
            os.kill(os.getpid(), number)
        except interrupts.Stopped as stopped:
            print(what, stopped.name)
        interrupts._wish.number = 0
from catenary.cases.process.petsc_options import start_petsc
start_petsc([])
check("petsc")
from catenary.cases.run.scene_mesh import mesh_of
mesh_of(load_scene("en50318_2002"))
check("gmsh")
os._exit(0)
"""
    done = subprocess.run(
        [sys.executable, "-u", "-c", script], capture_output=True, text=True, cwd=tmp_path
    )
    names = [number.name for number in STOPPING]
    expected = [f"{what} {name}" for what in ("petsc", "gmsh") for name in names]
    assert done.stdout.splitlines() == expected, done.stderr

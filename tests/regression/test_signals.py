"""Signals to the program as a user, a terminal or a batch system sends them."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from program import MPIRUN, Done, assert_sound, catenary, python, short_run, started
from studies import few

# The program, which waits at a place until a file says that it may go on.
WAITING = """
import time
from pathlib import Path
from mpi4py import MPI
from {package} import {module}
from catenary.cases.cli.main import main

before = {module}.{name}

def waits(*args, **kwargs):
    if MPI.COMM_WORLD.rank == 0:
        Path("waiting").touch()
        while not Path("go_on").exists():
            time.sleep(0.01)
    return before(*args, **kwargs)

{module}.{name} = waits
main()
"""
needs_mpirun = pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun")


def signalled(
    folder: Path,
    place: tuple[str, str, str],
    words: list[str],
    number: signal.Signals,
    ranks: int = 1,
    to_rank: int | None = None,
) -> Done:
    """Run the program, send it a signal where it waits; to mpirun if no rank is named."""
    script = folder / "script.py"
    script.write_text(WAITING.format(package=place[0], module=place[1], name=place[2]))
    with started(python(str(script), *words), folder, ranks=ranks) as program:
        program.wait_for((folder / "waiting").exists)
        if to_rank is None:
            program.send(number)
        else:
            os.kill(program.pid_of_rank(to_rank), number)
        if to_rank:  # who is not rank 0 waits for it
            (folder / "go_on").touch()
        return program.end()


# Fewer steps where a march is not what is signalled.
COARSE = "numerics.dt_s=4e-3"
RUN = "catenary.cases.run"
MESH = (RUN, "runner", "mesh_of")
EQUILIBRIUM = ("catenary.solver.statics", "line_at_rest", "find_form")
REPORT = ("catenary.postproc.report", "report", "write_report")


@pytest.mark.parametrize(
    "number", [signal.SIGHUP, pytest.param(signal.SIGXCPU, marks=pytest.mark.study)]
)
def test_before_the_march(number: signal.Signals, tmp_path: Path) -> None:
    done = signalled(tmp_path, MESH, short_run(tmp_path / "out"), number)
    assert done.code == 1
    assert done.sentences == [
        f"catenary: interrupted by {number.name} while the mesh was made; nothing was written"
    ]
    assert not (tmp_path / "out").exists()


def test_after_the_march(tmp_path: Path) -> None:
    out = tmp_path / "out"
    # Without snapshots a report works out no waves.
    words = short_run(out, COARSE, "output.field_every_s=0", report=True)
    done = signalled(tmp_path, REPORT, words, signal.SIGUSR1)
    assert done.code == 1
    (sentence,) = done.sentences
    assert f"interrupted by SIGUSR1 while the report was written; {out / 'run.h5'} is" in sentence
    assert_sound(out / "run.h5")
    again = catenary("report", str(out), cwd=tmp_path)
    assert again.code == 0 and (out / "report.html").exists()
    # Nobody looks at these: `unpainted.py` knows every painter, or tests take minutes more.
    pictures = [*out.glob("*.svg"), *out.glob("*.png")]
    assert pictures and all(path.stat().st_size < 200 for path in pictures)


VERBS = {
    "check": ((RUN, "scene_mesh", "mesh_of"), ["check", "ac_simple"]),
    "static": (EQUILIBRIUM, ["static", "ac_simple"]),
    "hard": (("catenary.cases.studies.hard", "runs", "March"), ["hard", "--short"]),
}


@pytest.mark.parametrize("verb", few(VERBS, "check"))
def test_other_verbs(verb: str, tmp_path: Path) -> None:
    place, words = VERBS[verb]
    done = signalled(tmp_path, place, words, signal.SIGTERM)
    assert done.code == 1
    assert done.stderr.splitlines()[-1] == "catenary: interrupted by SIGTERM"
    assert "Traceback" not in done.stderr
    assert done.left == []


@needs_mpirun
@pytest.mark.parametrize(
    ("place", "to_rank"),
    [
        (MESH, 1),
        pytest.param(EQUILIBRIUM, 0, marks=pytest.mark.study),
        pytest.param(REPORT, 0, marks=pytest.mark.study),
    ],
    ids=["mesh", "rest", "report"],
)
def test_a_signal_to_one_of_several_ranks(
    place: tuple[str, str, str], to_rank: int, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    done = signalled(tmp_path, place, short_run(out, report=True), signal.SIGUSR2, 2, to_rank)
    assert done.code == 1
    assert done.left == []
    (sentence,) = done.sentences
    assert "interrupted by SIGUSR2 while " in sentence
    if place == REPORT:
        assert f"`catenary report {out}`" in sentence
        assert_sound(out / "run.h5")
    else:
        assert sentence.endswith("nothing was written")
        assert not out.exists()


@pytest.mark.study
@needs_mpirun
def test_a_signal_to_mpirun_before_the_march(tmp_path: Path) -> None:
    # Open MPI hands it on, and kills what still runs a second after.
    done = signalled(tmp_path, MESH, short_run(tmp_path / "out"), signal.SIGTERM, 2)
    assert done.code != 0
    assert done.left == []
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out" / "run.h5").exists()


def test_nohup_is_respected(tmp_path: Path) -> None:
    out = tmp_path / "out"
    script = tmp_path / "script.py"
    script.write_text(WAITING.format(package=MESH[0], module=MESH[1], name=MESH[2]))
    with started(["nohup", *python(str(script), *short_run(out, COARSE))], tmp_path) as program:
        program.wait_for((tmp_path / "waiting").exists)
        program.send(signal.SIGHUP)
        (tmp_path / "go_on").touch()
        done = program.end()
    assert done.code == 0, done.stderr
    assert_sound(out / "run.h5")

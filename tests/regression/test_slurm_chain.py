"""The script of ``catenary submit`` under a stand-in of SLURM: three small programs."""

from __future__ import annotations

import os
import stat
import subprocess
from pathlib import Path

import pytest
from program import assert_same_histories, catenary, write_program

from catenary import InputError
from catenary import open as open_run
from catenary.cases.run.planning.slurm_script import SlurmJob, limit_minutes, slurm_script

# Some four seconds of march, so that a signal meets it.
SCENE = ["numerics.dt_s=5e-5"]
# Ends the first step of a job in its march, as SLURM does before a limit; lets others pass.
SRUN = """#!/bin/bash
if [ -e "$STAND_IN/interrupt" ]; then
    rm "$STAND_IN/interrupt"
    "$@" & program=$!
    until [ -s "$OUT/run.h5" ]; do sleep 0.05; kill -0 $program || exit 99; done
    sleep 0.3
    kill -TERM $program
    wait $program
else
    exec "$@"
fi
"""
# Notes what it is called with and prints the number of a job.
NOTED = """#!/bin/bash
echo "$(basename "$0") left=${CATENARY_JOBS_LEFT:-} $*" >> "$STAND_IN/calls"
echo 42
"""


def stand_in(folder: Path) -> Path:
    """A folder of programs by the names of SLURM's, and of this program."""
    folder.mkdir()
    for name, text in (("srun", SRUN), ("sbatch", NOTED), ("scancel", NOTED)):
        (folder / name).write_text(text)
        (folder / name).chmod(0o755 | stat.S_IXUSR)
    write_program(folder / "catenary")
    return folder


def job(script: str, programs: Path, out: Path, **variables: str) -> tuple[int, list[str]]:
    """Exit code of a job, and what it called of SLURM."""
    path = {"PATH": f"{programs}:{os.environ['PATH']}", "STAND_IN": str(programs), "OUT": str(out)}
    calls = programs / "calls"
    calls.unlink(missing_ok=True)
    done = subprocess.run(
        ["bash", "-c", script, "job.sh"],
        env={**os.environ, "SLURM_JOB_ID": "41", **path, **variables},
        cwd=programs.parent, capture_output=True, text=True, timeout=240,
    )  # fmt: skip
    return done.returncode, calls.read_text().splitlines() if calls.exists() else []


@pytest.mark.study
def test_a_run_goes_on_in_the_next_job_to_the_same_end(tmp_path: Path) -> None:
    programs, out, whole = stand_in(tmp_path / "slurm"), tmp_path / "out", tmp_path / "whole"
    words = ["en50318_2002", "--short"] + [word for key in SCENE for word in ("--set", key)]
    printed = catenary("submit", *words, "-o", str(out), "--print", cwd=tmp_path)
    assert printed.code == 0, printed.stderr
    (programs / "interrupt").touch()
    code, calls = job(printed.stdout, programs, out)
    assert code == 1, "the run was interrupted"
    assert len(calls) == 1, "the next job stays"
    assert calls[0].startswith("sbatch left=8 ") and "--dependency=afternotok:41" in calls[0]
    with open_run(out) as run:
        assert run.outcome == "interrupted" and run.force.time.size > 1
    code, calls = job(printed.stdout, programs, out, CATENARY_JOBS_LEFT="8")
    assert code == 0
    # When a job succeeds, SLURM takes away what waits for its failure; cancelling does no harm.
    assert [call.split()[0] for call in calls] == ["sbatch", "scancel"]
    assert calls[0].split()[1] == "left=7"
    assert catenary("run", *words, "-o", str(whole), cwd=tmp_path).code == 0
    assert_same_histories(out, whole)


def test_the_last_job_of_a_chain_has_no_follower(tmp_path: Path) -> None:
    programs, out = stand_in(tmp_path / "slurm"), tmp_path / "out"
    script = slurm_script(["no_such_case"], out, SlurmJob(chain=0), 1.0, 1e9)
    assert job(script, programs, out) == (2, [])


def test_bad_input_ends_the_chain(tmp_path: Path) -> None:
    programs, out = stand_in(tmp_path / "slurm"), tmp_path / "out"
    script = slurm_script(["no_such_case"], out, SlurmJob(), 1.0, 1e9)
    code, calls = job(script, programs, out)
    assert code == 2 and calls[-1] == "scancel left= 42"


def test_words_of_strangers_stay_words(tmp_path: Path) -> None:
    programs, out = stand_in(tmp_path / "slurm"), tmp_path / "it's $(touch bad)"
    words = ["en50318_2002", "--set", "case.title=`touch bad`'$(touch bad)"]
    script = slurm_script(words, out, SlurmJob(chain=0), 1.0, 1e9, ["-x", "$(touch bad)"])
    (programs / "catenary").unlink()
    (programs / "catenary").write_text('#!/bin/bash\nprintf "%s\\n" "$@" > "$STAND_IN/words"\n')
    (programs / "catenary").chmod(0o755)
    job(script, programs, out)
    passed = (programs / "words").read_text().splitlines()
    assert passed == ["run", *words, "-o", str(out), "--", "-x", "$(touch bad)"]
    assert not list(tmp_path.rglob("bad"))


@pytest.mark.parametrize(("march", "minutes"), [(0.0, 10), (400.0, 25), (7200.0, 365)])
def test_limits_leave_room_and_are_whole(march: float, minutes: int) -> None:
    assert limit_minutes(march) == minutes
    assert 60 * limit_minutes(march) >= 3 * march


@pytest.mark.parametrize("directive", ["account=x", "--a\n#SBATCH", "--x y; rm", ""])
def test_a_directive_is_one_option(directive: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="takes one option of sbatch"):
        slurm_script(["x"], tmp_path, SlurmJob(directives=[directive]), 1.0, 1e9)


def test_more_nodes_than_ranks_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--nodes is 3, more than the 2 ranks"):
        slurm_script(["x"], tmp_path, SlurmJob(ranks=2, nodes=3), 1.0, 1e9)


def test_without_slurm_the_script_can_be_printed(tmp_path: Path) -> None:
    done = catenary("submit", "en50318_2002", "-o", str(tmp_path / "out"), cwd=tmp_path)
    assert done.code == 2 and "--print shows the script" in done.stderr
    assert not (tmp_path / "out").exists()

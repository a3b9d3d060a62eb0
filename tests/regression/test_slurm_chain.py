"""The script of ``catenary submit`` under a stand-in of SLURM: three small programs."""

from __future__ import annotations

import json
import os
import stat
import subprocess
from pathlib import Path

import pytest
from program import SHORT_SCENE, assert_same_histories, catenary, short_run, write_program

from catenary import InputError
from catenary import open as open_run
from catenary.cases.run.cluster import SlurmJob, limit_minutes, slurm_script

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


def test_a_job_of_several_clusters_is_cancelled_by_its_number(tmp_path: Path) -> None:
    programs, out = stand_in(tmp_path / "slurm"), tmp_path / "out"
    (programs / "sbatch").write_text("#!/bin/bash\necho '42;cluster'\n")
    script = slurm_script(["no_such_case"], out, SlurmJob(), 1.0, 1e9)
    assert job(script, programs, out) == (2, ["scancel left= 42"])


def test_a_folder_with_the_name_of_a_shipped_case_is_not_the_case(tmp_path: Path) -> None:
    (tmp_path / "ac_simple").mkdir()
    words = ["submit", "ac_simple", "--short", "-o", "ac_simple", "--print"]
    done = catenary(*words, cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert "srun catenary run ac_simple --short -o " in done.stdout


@pytest.mark.parametrize(
    ("code", "begun", "outcome", "goes_on"),
    [
        (1, True, "interrupted", True),
        (1, True, "", True),  # srun tells of a killed task so
        (137, True, "", True),
        (137, False, "", True),
        (143, True, "interrupted", True),
        (1, False, "", False),
        (1, True, "NaN at t = 2 s", False),
        (2, True, "interrupted", False),
    ],
)
def test_a_chain_goes_on_where_the_next_job_may_get_further(
    code: int, begun: bool, outcome: str, goes_on: bool, tmp_path: Path
) -> None:
    """A run that a job before it had left as it is said here ends with ``code``."""
    programs, out = stand_in(tmp_path / "slurm"), tmp_path / "out"
    out.mkdir()
    if begun:
        (out / "run.h5").touch()
    if outcome:
        (out / "summary.json").write_text(json.dumps({"outcome": outcome}, indent=1))
    (programs / "catenary").unlink()
    (programs / "catenary").write_text(f"#!/bin/bash\nexit {code}\n")
    (programs / "catenary").chmod(0o755)
    ended, calls = job(slurm_script(["x"], out, SlurmJob(), 1.0, 1e9), programs, out)
    assert ended == code
    assert [call.split()[0] for call in calls] == (["sbatch"] if goes_on else ["sbatch", "scancel"])


def test_a_job_knows_the_numbers_of_all_before_it(tmp_path: Path) -> None:
    programs, out = stand_in(tmp_path / "slurm"), tmp_path / "out"
    (programs / "sbatch").write_text('#!/bin/bash\necho "$CATENARY_JOBS_ENDED" > "$STAND_IN/calls"')
    script = slurm_script(["no_such_case"], out, SlurmJob(), 1.0, 1e9)
    assert job(script, programs, out)[1] == [" 41"]
    assert job(script, programs, out, CATENARY_JOBS_ENDED=" 7 9")[1] == [" 7 9 41"]


def test_the_fullest_node_has_room_for_its_ranks(tmp_path: Path) -> None:
    """Rank 0, whose memory is that of the plan, stands on one node, whatever their number."""
    script = slurm_script(["x"], tmp_path, SlurmJob(ranks=5, nodes=4), 1.0, 10e9)
    lines = script.splitlines()
    assert "#SBATCH --ntasks-per-node=2" in lines
    assert "#SBATCH --mem=13G" in lines, "1.2 x 10 GB, and 0.3 GB of libraries for two ranks"


def test_a_folder_of_another_run_is_refused(tmp_path: Path) -> None:
    words = ["submit", "en50318_2002", "--print", "-o", str(tmp_path / "out")]
    begun = [*short_run(tmp_path / "out"), "--", "-march_ts_max_steps", "150"]
    assert catenary(*begun, cwd=tmp_path).code == 1
    same = [word for key in SHORT_SCENE for word in ("--set", key)]
    assert catenary(*words, *same, cwd=tmp_path).code == 0
    other = catenary(*words, *same, "--set", "train.speed_km_h=251", cwd=tmp_path)
    assert other.code == 2 and "the beginning of another scene's run" in other.stderr
    assert catenary("restart", str(tmp_path / "out"), "--no-report", cwd=tmp_path).code == 0
    done = catenary(*words, *same, cwd=tmp_path)
    assert done.code == 2 and "is done; name another folder" in done.stderr


def test_ranks_that_make_nothing_faster_are_told(tmp_path: Path) -> None:
    words = ["submit", "en50318_2002", "--print", "-o", "out", "--set", "window.mode=bounded"]
    assert "WARNING" not in catenary(*words, cwd=tmp_path).stderr
    warned = catenary(*words, "--ranks", "4", cwd=tmp_path)
    assert warned.code == 0 and "take --ranks 1" in warned.stderr


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

"""The script of ``catenary submit --array`` under a stand-in of SLURM: four small programs."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from program import SHORT_SCENE, catenary, write_program
from scenes import load_scene

from catenary import InputError
from catenary.cases.run.cluster import SlurmJob, array_script
from catenary.cases.run.needs import NeedsOfRuns, total_needs

pytestmark = pytest.mark.process
CASE, VARIED = "en50318_2002", "train.speed_km_h=230,250,270"
# As SLURM's own: when it gets SIGTERM it kills what it has started, SIGUSR1 it hands on.
SRUN = """#!/bin/bash
"$@" & task=$!
trap 'kill -KILL $task' TERM
trap 'kill -USR1 $task' USR1
while wait $task; code=$?; kill -0 $task 2>/dev/null; do :; done
exit $code
"""
# Notes what it is called with and prints the number of a job.
NOTED = """#!/bin/bash
echo "$(basename "$0") $*" >> "$STAND_IN/calls"
cat > "$STAND_IN/script"
echo "42;cluster"
"""
NEEDS = NeedsOfRuns(3, (3000.0, 1000.0), 1e9)


@pytest.fixture
def programs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of programs by the names of SLURM's, and of this program, first in PATH."""
    folder = tmp_path / "slurm"
    folder.mkdir()
    for name, text in (("srun", SRUN), ("sbatch", NOTED), ("scontrol", NOTED)):
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    write_program(folder / "catenary")
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    monkeypatch.setenv("STAND_IN", str(folder))
    return folder


def submitted(out: Path, cwd: Path, *words: str) -> str:
    """The script of a sweep in two tasks, which bash takes."""
    scene = [word for key in SHORT_SCENE for word in ("--set", key)]
    done = catenary(
        "submit", CASE, "-o", str(out), "--array", "2", "--vary", VARIED, *scene, *words,
        "--print", cwd=cwd,
    )  # fmt: skip
    assert done.code == 0, done.stderr
    checked = subprocess.run(["bash", "-n"], input=done.stdout, text=True, capture_output=True)
    assert checked.returncode == 0, checked.stderr
    return done.stdout


def task(script: str, number: int, **variables: str) -> subprocess.Popen[str]:
    """A task of the array, running."""
    own = {"SLURM_ARRAY_JOB_ID": "41", "SLURM_ARRAY_TASK_ID": str(number), **variables}
    return subprocess.Popen(
        ["bash", "-c", script, "job.sh"],
        env={**os.environ, **own},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def figures(table: Path) -> list[dict[str, str]]:
    """Rows of a sweep's table without the times of its runs."""
    with table.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return [{name: cell for name, cell in row.items() if name != "wall_s"} for row in rows]


def test_tasks_make_the_runs_and_the_last_job_the_table(programs: Path, tmp_path: Path) -> None:
    out, whole = tmp_path / "out", tmp_path / "whole"
    script = submitted(out, tmp_path)
    tasks = [task(script, 1), task(script, 2)]
    said = [one.communicate(timeout=240)[0] for one in tasks]
    assert [one.returncode for one in tasks] == [0, 0]
    assert "[2/2] speed_km_h_270" in said[0] and "[1/1] speed_km_h_250" in said[1]
    assert not (out / "sweep.csv").exists()
    last = task(script, 0)
    said_last, complained = last.communicate(timeout=240)
    assert last.returncode == 0, complained
    assert said_last.count("done already") == 3
    words = ["sweep", CASE, "-o", str(whole), "--vary", VARIED, "--set", *SHORT_SCENE]
    assert catenary(*words, cwd=tmp_path).code == 0
    assert figures(out / "sweep.csv") == figures(whole / "sweep.csv")
    assert not (programs / "calls").exists()


@pytest.mark.parametrize(
    ("restarts", "calls"),
    [("0", "scontrol requeue 41_1\n"), pytest.param("3", "", marks=pytest.mark.study)],
)
def test_a_task_that_is_told_to_end_asks_to_be_started_again(
    restarts: str, calls: str, programs: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    script = submitted(out, tmp_path, "--chain", "3", "--set", "numerics.dt_s=5e-5")
    program = task(script, 1, SLURM_RESTART_COUNT=restarts)
    begin = time.monotonic()
    while not (out / "speed_km_h_230" / "run.h5").exists():
        assert time.monotonic() < begin + 240
        time.sleep(0.03)
    program.send_signal(signal.SIGTERM)
    _, told = program.communicate(timeout=240)
    assert program.returncode == 1
    assert "the sweep was interrupted; the same command continues it" in told
    noted = programs / "calls"
    assert (noted.read_text() if noted.exists() else "") == calls


def test_a_task_that_breaks_is_not_started_again(programs: Path, tmp_path: Path) -> None:
    script = array_script(["sweep", "no_such_case"], tmp_path / "out", SlurmJob(), 3, NEEDS)
    program = task(script, 2)
    program.communicate(timeout=240)
    assert program.returncode == 2 and not (programs / "calls").exists()


def test_the_table_waits_for_all_tasks(programs: Path, tmp_path: Path) -> None:
    words = ["--array", "3", "--vary", VARIED, "--short"]
    done = catenary("submit", CASE, "-o", str(tmp_path / "out"), *words, cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert done.stdout == "job 42: 3 tasks; job 42: the table, after them\n"
    first, last = (programs / "calls").read_text().splitlines()
    assert first == "sbatch --parsable"
    assert last == "sbatch --parsable --array=0 --dependency=afterany:42"
    assert "#SBATCH --array=1-3\n" in (programs / "script").read_text()


def test_an_array_whose_table_is_refused_is_told(programs: Path, tmp_path: Path) -> None:
    refuses = (
        '#!/bin/bash\n[[ "$*" != *afterany* ]] || { echo "too many jobs" >&2; exit 1; }\necho 42\n'
    )
    (programs / "sbatch").write_text(refuses)
    words = ["--array", "3", "--vary", VARIED, "--short"]
    done = catenary("submit", CASE, "-o", "out", *words, cwd=tmp_path)
    assert done.code == 1
    (sentence,) = done.sentences
    assert "job 42 with its 3 tasks is submitted, the job of the table is not" in sentence
    assert "too many jobs" in sentence and "`catenary sweep`" in sentence


def test_a_study_is_made_in_parts_too(tmp_path: Path) -> None:
    words = ["submit", "ambrosio2012", "--study", "--short", "-o", "out", "--array", "4", "--print"]
    done = catenary(*words, cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert "srun catenary run ambrosio2012 --short --study -o " in done.stdout


def test_words_of_strangers_stay_words(programs: Path, tmp_path: Path) -> None:
    out, words = tmp_path / "it's $(touch bad)", ["sweep", "--set", "case.title=`touch bad`'"]
    script = array_script(words, out, SlurmJob(ranks=2), 3, NEEDS, ["-x", "$(touch bad)"])
    (programs / "catenary").unlink()
    (programs / "catenary").write_text('#!/bin/bash\nprintf "%s\\n" "$@" > "$STAND_IN/words"\n')
    (programs / "catenary").chmod(0o755)
    task(script, 3).communicate(timeout=240)
    passed = (programs / "words").read_text().splitlines()
    ending = ["-j", "2", "--part=3/3", "--", "-x", "$(touch bad)"]
    assert passed == [*words, "-o", str(out), *ending]
    assert not list(tmp_path.rglob("bad"))


def test_limits_follow_from_the_share_of_a_task(tmp_path: Path) -> None:
    """The longest run, or the runs of a task one after the other on each of its ranks; three times
    that, five minutes around, in steps of five."""
    for job, n_tasks, limit in (
        (SlurmJob(), 1, "02:35"),
        (SlurmJob(), 3, "00:55"),
        (SlurmJob(ranks=2), 1, "01:20"),
    ):
        script = array_script(["sweep"], tmp_path, job, n_tasks, NEEDS)
        assert f"#SBATCH --time={limit}:00\n" in script, script


def test_needs_of_several_runs_add_up() -> None:
    scenes = [load_scene(CASE, [f"train.end_m={end}"]) for end in (700, 1000)]
    one, other, both = (total_needs(these) for these in (scenes[:1], scenes[1:], scenes))
    assert both.n_runs == 2 and both.march[0] == pytest.approx(one.march[0] + other.march[0])
    assert both.march[1] == other.march[1] > one.march[1]
    assert both.memory == max(one.memory, other.memory)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--array", "4", "--vary", VARIED], "--array is 4, more than the 3 runs"),
        (["--array", "2"], "there is nothing to vary"),
        (["--array", "2", "--study", "--vary", VARIED], "leave --vary and --variants away"),
        (["--vary", VARIED], "--vary, --variants and --study belong to --array"),
    ],
)
def test_what_does_not_fit_together_is_refused(words: list[str], told: str, tmp_path: Path) -> None:
    case = "ambrosio2012" if "--study" in words else CASE
    done = catenary("submit", case, "-o", "out", "--short", *words, "--print", cwd=tmp_path)
    assert done.code == 2 and told in done.stderr
    assert done.stdout == ""


def test_more_nodes_than_ranks_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--nodes is 3, more than the 2 ranks"):
        array_script(["sweep"], tmp_path, SlurmJob(ranks=2, nodes=3), 3, NEEDS)

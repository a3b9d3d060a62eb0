"""Under mpirun one rank speaks, all ranks end with the same exit code, and none is left behind."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from program import ENTRY, MPIRUN, Done, catenary, started

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(MPIRUN is None, reason="there is no mpirun"),
]


def under_mpirun(*words: str, cwd: Path) -> Done:
    return catenary(*words, cwd=cwd, ranks=2)


# A scene that is read wrongly, the command line's own refusal, and a scene whose parts do not fit;
# others of the same kinds in whole studies.
REFUSED = [
    (["check", "en50318_2002", "--set", "line.encumbrance_m=0.1"], "below the contact wire"),
]
MORE_REFUSED = [
    (["run", "no_such_case", "-o", "out"], "there is no case or file"),
    (["run", "en50318_2002"], "Missing option"),
    (["run", "en50318_2002", "-o", "out", "--set", "train.speed_km_h=-1"], "must be at least"),
    (["run", "en50318_2002", "-o", "out", "fast"], "neither key=value nor"),
]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [*REFUSED, *(pytest.param(*one, marks=pytest.mark.study) for one in MORE_REFUSED)],
)
def test_bad_input_is_told_once_and_every_rank_ends_with_2(
    words: list[str], sentence: str, tmp_path: Path
) -> None:
    done = under_mpirun(*words, cwd=tmp_path)
    assert done.code == 2, done.stderr
    assert done.stderr.count(sentence) == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_ranks_with_other_words_are_refused(tmp_path: Path) -> None:
    # One left out an option and ended, and the other one waited for it.
    words = "run en50318_2002 -o out --set train.speed_km_h=20"
    rank = "${OMPI_COMM_WORLD_RANK:-$PMI_RANK}"
    script = f'exec {sys.executable} -c "$0" {words}{rank}'
    with started(["sh", "-c", script, ENTRY], tmp_path, ranks=2) as program:
        done = program.end()
    assert done.code == 2, done.stderr
    assert done.stderr.count("the processes of mpirun have different words") == 1, done.stderr
    assert list(tmp_path.iterdir()) == [] and not done.left


def test_a_serial_verb_is_done_once(tmp_path: Path) -> None:
    done = under_mpirun("mesh", "en50318_2002", "-o", "line.msh", cwd=tmp_path)
    assert done.code == 0, done.stderr
    assert done.stdout.count("line.msh") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["line.msh"]

"""Scenes by people who mean harm, and by people who had bad luck: each is refused in a sentence.

The first line of a file in ``hostile_scenes`` says what it does. None of them may run anything
(what it would run leaves a file ``canary``), write anything, take long, or reach the terminal with
a control character.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from program import catenary
from verb_runner import invoke

FOLDER = Path(__file__).with_name("hostile_scenes")
SCENES = sorted(path.stem for path in FOLDER.glob("*.toml"))
LIMIT = 5.0  # for a refusal [s]
VERBS = {"check": [], "plan": [], "run": ["-o", "out"]}
# Some of each kind are told to the program as a user starts it, without a terminal.
PROCESSES = ("petsc_line_in_value", "text_c1", "file_mesh_terminal", "file_course_kernel",
             "size_elements", "deep_quoted", "kind_template")  # fmt: skip


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)


def assert_refused(output: str, several: bool) -> None:
    sentences = output.rstrip("\n").split("\n")
    assert several or len(sentences) == 1, output
    for sentence in sentences:
        assert sentence.startswith("catenary: ") and 20 < len(sentence) < 2000, sentence
        assert all(letter.isprintable() for letter in sentence), ascii(sentence)
        for word in ("Traceback", "Error", "codec", "pydantic", "<class", "root:", "None"):
            assert word not in sentence, sentence


def test_there_are_sixty_and_each_says_what_it_does() -> None:
    assert len(SCENES) >= 60
    for name in SCENES:
        head = (FOLDER / f"{name}.toml").read_bytes().replace(b"\0", b"")[:100]
        assert b"# " in head[:4], name


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("name", SCENES)
def test_a_hostile_scene_is_refused(name: str, verb: str, tmp_path: Path) -> None:
    before = sorted(os.listdir(FOLDER))
    begin = time.perf_counter(), time.process_time()
    words = [verb, str(FOLDER / f"{name}.toml"), *VERBS[verb]]
    result = invoke(*words)
    waited, worked = time.perf_counter() - begin[0], time.process_time() - begin[1]
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert_refused(result.stderr, several=verb == "check")
    assert list(tmp_path.iterdir()) == [] and sorted(os.listdir(FOLDER)) == before
    # On a loaded machine one waits for a core as well.
    assert worked < LIMIT and waited < 6 * LIMIT, f"{worked:.1f} s of work, {waited:.1f} s in all"


@pytest.mark.parametrize("name", PROCESSES)
def test_the_program_itself_refuses_a_hostile_scene(name: str, tmp_path: Path) -> None:
    done = catenary("run", str(FOLDER / f"{name}.toml"), "-o", "out", cwd=tmp_path)
    assert done.code == 2 and done.stdout == "", done
    assert_refused(done.stderr, several=False)
    assert list(tmp_path.iterdir()) == []

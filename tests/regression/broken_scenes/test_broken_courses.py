"""Courses of a vehicle in files that cannot be: the sentence names the file."""

from __future__ import annotations

from pathlib import Path

import pytest
from refusals import SOUND
from verb_runner import invoke

# What stands in the file, and what the sentence must hold.
CONTENTS = {
    "nothing": (b"", "it holds no pairs of numbers"),
    "words": (b"time,place\nsoon,there\n", "its line 2 must hold two numbers"),
    "semicolons": (b"0;0\n1;0.01\n2;0\n", "its line 2 must hold two numbers"),
    "three columns": (b"0,0,0\n1,0,0\n", "its line 2 must hold two numbers"),
    "no text": (bytes(range(256)), "in UTF-8 (byte 128, in line 2); save it in UTF-8"),
    "one pair": (b"0,0\n", "{file}; it must have at least 4 entries"),
    "not a number": (b"0,0\n1,nan\n2,0\n99,0\n", "by_time.1.1 is nan in {file}"),
    "endless": (b"0,0\n1,0\n2,0\ninf,0\n", "by_time.3.0 is inf in {file}"),
    "huge": (b"0,0\n1,1e300\n2,0\n99,0\n", "by_time.1.1 is 1e+300 in {file}"),
    "a metre and more": (b"0,0\n1,1.5\n2,0\n99,0\n", "within 1 m, but is 1.5 m at 1"),
    "backwards": (b"0,0\n2,0\n1,0\n99,0\n", "{file}; it must list its first numbers in ascending"),
    "ends early": (
        b"0,0\n1,0.01\n2,0\n3,0\n",
        "by_time in {file} holds from 0 to 3 s, but the run",
    ),
    "starts late": (b"1,0\n2,0.01\n3,0\n99,0\n", "by_time in {file} holds from 1 to 99 s"),
}


@pytest.mark.parametrize("name", CONTENTS)
def test_a_course_that_cannot_be_is_told_with_its_file(name: str, tmp_path: Path) -> None:
    content, expected = CONTENTS[name]
    file = tmp_path / "course.csv"
    file.write_bytes(content)
    words = [f"vehicle.vertical.by_time_file={file}", "effects.vehicle_motion=true"]
    words = [word for text in words for word in ("--set", text)]
    result = invoke("check", str(SOUND), *words)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    sentence = result.stderr.strip()
    assert sentence.startswith("catenary: ") and "\n" not in sentence
    assert expected.format(file=file) in sentence
    assert list(tmp_path.iterdir()) == [file]


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    words = ["--set", f"vehicle.vertical.by_time_file={tmp_path / 'none.csv'}"]
    result = invoke("check", str(SOUND), *words)
    assert result.exit_code == 2
    assert "none.csv" in result.stderr and "no such file" in result.stderr


@pytest.mark.parametrize(
    "words",
    [
        ["run", str(SOUND), "-o", ""],
        ["sweep", str(SOUND), "-o", " ", "--vary", "train.speed_km_h=250,260"],
        ["pantograph", str(SOUND), "-o", ""],
    ],
)
def test_an_empty_name_is_no_folder(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such as that of a shell's variable that is not set."""
    monkeypatch.chdir(tmp_path)
    result = invoke(*words)
    assert result.exit_code == 2, result.output
    assert "it is empty; name a folder" in " ".join(result.stderr.split())
    assert list(tmp_path.iterdir()) == []

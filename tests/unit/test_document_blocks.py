"""Reading documents: commands, outputs, elisions and numbers."""

from __future__ import annotations

import pytest
from documents import (
    blocks_of,
    difference,
    edited,
    inline_commands,
    numbers_agree,
    plain_words,
)

PAGE = """
See `catenary run CASE -o DIR` and `catenary plan`.

<!-- test: words -->
```
$ catenary plan x \\
  --short    # sizes
3 spans
  ...
$ catenary list
```

```toml
[line]
n_spans = 3
```

<!-- test: run -->

```
catenary run x -o y \\
  --short
make test
```
"""


def test_blocks_and_their_notes() -> None:
    first, second, third = blocks_of(PAGE)
    assert (first.note, first.line, second.kind, third.verb) == ("words", 5, "toml", "run")
    plan, listing = first.shown()
    assert plan.command == "catenary plan x \\\n  --short    # sizes"
    assert plan.output == "3 spans\n  ..."
    assert (listing.command, listing.output) == ("catenary list", "")
    assert third.commands() == ["catenary run x -o y    --short", "make test"]
    assert inline_commands(PAGE) == ["catenary run CASE -o DIR", "catenary plan"]


def test_a_block_that_takes_long_has_its_other_note_too() -> None:
    notes = ("study", "study after results/a results/b", "after results/a", "")
    blocks = [
        block for note in notes for block in blocks_of(f"<!-- test: {note} -->\n```\nx\n```\n")
    ]
    assert [block.is_study for block in blocks] == [True, True, False, False]
    assert [block.verb for block in blocks] == ["", "after", "after", ""]
    assert blocks[1].rest == "results/a results/b"


def test_a_here_document_belongs_to_its_command() -> None:
    (block,) = blocks_of("```\n$ python - <<'EOF'\nprint(1)\nEOF\n1\n```\n")
    (shown,) = block.shown()
    assert shown.command.endswith("EOF") and shown.output == "1"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("catenary run x \\\n  -o y  # quick", ["catenary", "run", "x", "-o", "y"]),
        (
            "catenary run x --set 'a=[{b=\"$c\"}, 1]'",
            ["catenary", "run", "x", "--set", 'a=[{b="$c"}, 1]'],
        ),
        ("catenary list | head", []),
        ("catenary list > file", []),
        ("catenary run x; catenary list", []),
        ("catenary run x\ncatenary list", []),
        ("python - <<'EOF'\nprint(\"it's\")\nEOF", []),
    ],
)
def test_words_that_need_no_shell(command: str, words: list[str]) -> None:
    assert plain_words(command) == words


@pytest.mark.parametrize(
    ("shown", "actual"),
    [
        ("a  b\nc", "a b c\n"),
        ("mean 26.5 N", "mean 26.53 N"),
        ("mean 26.53 N,", "mean 26.52 N,"),
        ("a\n...\nz", "a\nb\nc\nz"),
        ("...\nz", "a z"),
        ("a\n  ...", "a b c"),
        ("a\n...\nc\n...\ne", "a c b c d e"),
        ("x=1.5e-05", "x=1.6e-05"),
    ],
)
def test_as_shown(shown: str, actual: str) -> None:
    assert difference(shown, actual) == ""


@pytest.mark.parametrize(
    ("shown", "actual"),
    [
        ("a b", "a c"),
        ("a b", "a b c"),
        ("a b c", "a b"),
        ("mean 26.5 N", "mean 26.71 N"),
        ("38 droppers", "37 droppers"),
        ("a\n...\nz", "a\nb\nz\nc"),
        ("...\nz", "z a"),
        ("a\n...", "b a"),
        ("x=1.5e-05", "x=1.5e-04"),
    ],
)
def test_other_than_shown(shown: str, actual: str) -> None:
    assert difference(shown, actual) != ""


def test_words_without_numbers() -> None:
    assert difference("took 3.5 s", "took 99.1 s", with_numbers=False) == ""
    assert difference("took 3.5 s", "took 99.1 ms", with_numbers=False) != ""
    assert numbers_agree("-0.5", "-0.45") and not numbers_agree("0.5", "-0.5")


def test_keys_replace_those_that_are_there() -> None:
    text = '[case]\nname = "a"\n\n[line] # of four\nn = 4\nspan = 60.0\n[line.dropper]\nx = [1]\n'
    found = edited(text, "[line]\nspan = 50.0\nm = 2\n\n[line.dropper]\nx = [2]\n[new]\ny = 1\n")
    assert found == (
        '[case]\nname = "a"\n\n[line] # of four\nm = 2\nn = 4\nspan = 50.0\n'
        "[line.dropper]\nx = [2]\n\n[new]\ny = 1\n"
    )

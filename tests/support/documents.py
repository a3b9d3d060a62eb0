"""Commands shown in documents: read from their blocks, run, and compared with what is shown.

A fenced block whose lines begin with ``$`` shows commands, each with its output up to the next one.
A line of three dots stands for any number of lines; a number agrees within one unit of its last
printed digit, a whole number exactly. A comment before a block tells what the tests do with it:

``<!-- test: run -->``            the block has commands only: run them; a run that is there is kept
``<!-- test: after FOLDER -->``   run the command of any document that makes this folder before
``<!-- test: edit FILE -->``      put the block's TOML keys into this file, in place of those there
``<!-- test: append FILE -->``    append the block to this file
``<!-- test: words -->``          compare words but no numbers, which depend on the machine
``<!-- test: study -->``          run the block with the studies (``make test-studies``) only; one
                                  of the notes above may follow: ``study after FOLDER``
``<!-- test: not run: WHY -->``   it is not run, and the site says why

Blocks of Python are run too, those of a document one after the other with the same names. Commands
of ``make`` are not run: they set up, and run the tests themselves.
"""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

_BLOCK = re.compile(
    r"(?:<!-- test: (?P<note>[^>]*?) -->\n+)?^```(?P<kind>\w*)\n(?P<body>.*?)^```$", re.M | re.S
)
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w]*\.\w)")
_ELISION = "..."
_PROGRAM = r"(?:\S*/)?(?:catenary|python|mpirun|paraview|pvpython|module|pip)\s"
_OF_SHELLS = re.compile(r"[|&;<>()$`*?\[\]{}~!\"\\\n]")


@dataclass(frozen=True)
class Shown:
    """A command and the output that a document shows for it, empty if none."""

    command: str
    output: str


@dataclass(frozen=True)
class Block:
    """A fenced block: its text, what the comment before it says, and where it begins."""

    kind: str
    body: str
    note: str
    line: int

    @property
    def is_study(self) -> bool:
        """Whether it takes so long that it is run with the studies only."""
        return self.note.partition(" ")[0] == "study"

    @property
    def verb(self) -> str:
        """First word of the note behind ``study``, empty if there is none."""
        return self.note.removeprefix("study").strip().partition(" ")[0]

    @property
    def rest(self) -> str:
        """The note's other words."""
        return self.note.removeprefix("study").strip().partition(" ")[2]

    @property
    def has_prompt(self) -> bool:
        """Whether commands are shown with their output."""
        return self.body.startswith("$ ")

    @property
    def is_code(self) -> bool:
        """Whether there is something to run: Python, or a command that is not one of ``make``."""
        lines = self.commands()
        ours = any(re.match(_PROGRAM, line.removeprefix("$ ")) for line in lines)
        return self.kind == "python" or (self.kind in ("", "sh", "bash") and ours)

    def commands(self) -> list[str]:
        """Commands of a block without prompts, lines that go on joined."""
        lines = self.body.replace("\\\n", " ").splitlines()
        return [line.strip() for line in lines if line.strip()]

    def shown(self) -> list[Shown]:
        """Commands with their output."""
        found = []
        for part in re.split(r"^\$ ", self.body, flags=re.M)[1:]:
            end = _end_of_command(part)
            found.append(Shown(part[:end].strip(), part[end:].strip("\n")))
        return found


def _end_of_command(part: str) -> int:
    """Where the output begins: after lines that go on, and after a here-document."""
    here = re.match(r"[^\n]*<<'?(\w+)'?\n.*?^\1$", part, re.M | re.S)
    plain = re.match(r"(?:[^\n]*\\\n)*[^\n]*", part)
    match = here or plain
    assert match is not None
    return match.end()


def blocks_of(text: str) -> list[Block]:
    """All fenced blocks of a document."""
    return [
        Block(m["kind"], m["body"], m["note"] or "", text.count("\n", 0, m.start("body")))
        for m in _BLOCK.finditer(text)
    ]


def plain_words(command: str) -> list[str]:
    """Words of a command of which a shell makes nothing else; none if it would."""
    command = command.replace("\\\n", " ")
    bare = re.sub(r"'[^']*'|#.*", "", command)
    return [] if _OF_SHELLS.search(bare) else shlex.split(command, comments=True)


def inline_commands(text: str) -> list[str]:
    """Commands of the program in the prose of a document, those with gaps left out."""
    prose = _BLOCK.sub("", text)
    found = (" ".join(code.split()) for code in re.findall(r"`(catenary [^`]+)`", prose))
    return [code for code in found if _ELISION not in code and "VERB" not in code]


def difference(shown: str, actual: str, with_numbers: bool = True) -> str:
    """What the first place is at which an output is other than shown; empty if it is as shown.

    Words are compared whatever the white space between them: documents break long lines.
    """
    pieces = re.split(rf"^\s*{re.escape(_ELISION)}\s*$", shown, flags=re.M)
    words, place = actual.split(), 0
    for number, piece in enumerate(pieces):
        wanted = piece.split()
        starts = range(place, len(words) - len(wanted) + 1)
        if number == 0:
            starts = range(1)
        elif number == len(pieces) - 1 and wanted:
            starts = range(max(place, len(words) - len(wanted)), len(words) - len(wanted) + 1)
        start = next((s for s in starts if _same(wanted, words[s:], with_numbers)), None)
        if start is None:
            there = " ".join(words[place : place + len(wanted) + 5])
            return f"shown:  {' '.join(wanted)}\nactual: {there} ..."
        place = start + len(wanted)
    if pieces[-1].strip() and place < len(words):
        return f"not shown: {' '.join(words[place : place + 20])}"
    return ""


def _same(wanted: list[str], found: list[str], with_numbers: bool) -> bool:
    return len(found) >= len(wanted) and all(
        _agree(one, other, with_numbers) for one, other in zip(wanted, found, strict=False)
    )


def _agree(shown: str, actual: str, with_numbers: bool) -> bool:
    """Whether two words agree: the text between their numbers, and each number."""
    if shown == actual:
        return True
    if _NUMBER.sub("#", shown) != _NUMBER.sub("#", actual):
        return False
    pairs = zip(_NUMBER.findall(shown), _NUMBER.findall(actual), strict=True)
    return not with_numbers or all(numbers_agree(one, other) for one, other in pairs)


def numbers_agree(shown: str, actual: str) -> bool:
    """Whether a number is the shown one within a unit of the last digit shown."""
    digits, _, power = shown.partition("e")
    if not power and "." not in digits:
        return float(shown) == float(actual)
    unit = 10.0 ** (int(power or 0) - len(digits.partition(".")[2]))
    return abs(float(shown) - float(actual)) <= unit * (1 + 1e-9)


def edited(text: str, changes: str) -> str:
    """A TOML text with keys of other tables put in; a key that is there is replaced."""
    table = ""
    for line in changes.splitlines():
        if header := re.fullmatch(r"\[([\w.]+)\]", line.strip()):
            table = header[1]
            if not re.search(rf"^\[{re.escape(table)}\]", text, re.M):
                text += f"\n[{table}]\n"
        elif line.strip():
            text = _with_key(text, table, line)
    return text


def _with_key(text: str, table: str, line: str) -> str:
    key = line.partition("=")[0].strip()
    match = re.search(rf"^\[{re.escape(table)}\][^\n]*\n(?P<body>(?:(?!^\[).*\n?)*)", text, re.M)
    assert match is not None
    body = match["body"]
    there = re.search(rf"^{re.escape(key)}\s*=.*$", body, re.M)
    new = body.replace(there[0], line) if there else f"{line}\n{body}"
    return text[: match.start("body")] + new + text[match.end("body") :]


def make_targets(makefile: Path) -> set[str]:
    """Targets that a Makefile explains."""
    return set(re.findall(r"^([a-z0-9-]+):.*##", makefile.read_text(), re.M))

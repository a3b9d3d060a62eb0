"""What README and docs show is what the program does: every block with a command and its output.

All blocks of all documents are run in one folder, which has ``cases`` as a checkout has; runs that
several need are made once. The notes before blocks are explained in ``tests/support/documents.py``.
"""

from __future__ import annotations

import contextlib
import csv
import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import split
from typing import Any

import pytest
import typer
from documents import (
    Block,
    Shown,
    blocks_of,
    difference,
    edited,
    inline_commands,
    make_targets,
    numbers_agree,
    plain_words,
)
from program import catenary, write_program
from scenes import load_scene, shipped

from catenary.cases.cli.main import app

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted(
    path.relative_to(ROOT)
    for pattern in ("*.md", "docs/**/*.md", "cases/*/README.md")
    for path in ROOT.glob(pattern)
    if path.name != "CHANGELOG.md"
)
# For one command on a busy machine [s], and for one of a study; below the limits of pytest.
LIMIT, LIMIT_OF_STUDY = 250.0, 3000.0
RUNS = {"run", "after", "edit", "append", "words"}
# Pages of Python that a test of their own runs, which looks at what they give.
OWN_TEST = {Path("docs/python.md"), Path("docs/tutorials/python.md")}
# Pages whose commands take longest, of verbs that have tests of their own.
LONGEST = {
    Path("cases/tensioned_section/README.md"),
    Path("docs/guide/films.md"),
    Path("docs/guide/identification.md"),
    Path("docs/guide/questions.md"),
    Path("docs/guide/uncertainty.md"),
    Path("docs/tutorials/long_line.md"),
}


def read(document: Path) -> str:
    return (ROOT / document).read_text(encoding="utf-8")


def is_run(block: Block) -> bool:
    is_python = block.kind == "python" and not block.verb
    return block.has_prompt or is_python or block.verb in RUNS


RUN_DOCUMENTS = [
    path for path in DOCUMENTS if path not in OWN_TEST and any(map(is_run, blocks_of(read(path))))
]
# Of these pages a block of those that are run takes long.
WITH_LONG_BLOCKS = [
    path for path in RUN_DOCUMENTS if any(b.is_study and is_run(b) for b in blocks_of(read(path)))
]
STUDIES = [
    (path, block)
    for path in DOCUMENTS
    for block in blocks_of(read(path))
    if block.is_study and not is_run(block)
]


def out_of(command: str) -> str:
    """Folder after -o in a command, empty if there is none."""
    match = re.search(r"\s-o\s+(\S+)", command)
    return match[1] if match else ""


@dataclass
class Workshop:
    """The folder in which commands are run, and the commands that make its runs."""

    folder: Path
    makers: dict[str, str]
    limit: float = LIMIT

    def call(self, command: str) -> subprocess.CompletedProcess[str]:
        """Run a command as a user's shell does, or, if it is one of ours alone, by its words."""
        words = plain_words(command)
        if words[:1] == ["catenary"]:
            done = catenary(*words[1:], cwd=self.folder, limit=self.limit)
            return subprocess.CompletedProcess(words, done.code, done.stdout, done.stderr)
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        return subprocess.run(
            ["bash", "-c", command],
            cwd=self.folder,
            env={**os.environ, "PATH": path},
            capture_output=True,
            text=True,
            check=False,
            timeout=self.limit,
        )

    def make(self, command: str) -> None:
        """Run a command unless the folder that it makes is there; first those that it reads."""
        for word in command.split():
            if word in self.makers and word != out_of(command):
                self.make(self.makers[word])
        if not out_of(command) or not (self.folder / out_of(command)).exists():
            done = self.call(command)
            assert done.returncode == 0, f"{command}\n{done.stderr}"

    def compare(self, shown: Shown, with_numbers: bool) -> str:
        """How a command's output differs from what is shown, empty if it does not."""
        done = self.call(shown.command)
        refused = shown.output.startswith("catenary: ")
        if done.returncode != (2 if refused else 0):
            return f"exit code {done.returncode}\n{done.stderr}"
        if not shown.output:
            return ""
        return difference(shown.output, done.stderr if refused else done.stdout, with_numbers)

    def work_on(self, block: Block, names: dict[str, Any]) -> list[str]:
        """Do what a block says and return what is wrong with it; Python has these names."""
        if block.verb == "after":
            for folder in block.rest.split():
                self.make(self.makers[folder])
        elif block.verb == "run" or (block.is_study and not is_run(block)):
            for command in block.commands():
                self.make(command)
        elif block.verb in ("edit", "append"):
            file = self.folder / block.rest
            before = file.read_text()
            change = edited if block.verb == "edit" else (lambda text, more: f"{text}\n{more}")
            file.write_text(change(before, block.body))
        if block.kind == "python":
            with contextlib.chdir(self.folder):
                exec(compile(block.body, f"block at line {block.line}", "exec"), names)
        wrong = []
        for shown in block.shown() if block.has_prompt else []:
            if found := self.compare(shown, block.verb != "words"):
                wrong.append(f"$ {shown.command}\n{found}")
        return wrong


def workshop_in(folder: Path) -> Workshop:
    """A folder as users have it after they have cloned the repository."""
    (folder / "cases").symlink_to(ROOT / "cases")
    (folder / ".venv").symlink_to(sys.prefix)
    program = folder / "bin" / "catenary"
    program.parent.mkdir()
    write_program(program)
    blocks = [block for document in DOCUMENTS for block in blocks_of(read(document))]
    shown = [one.command for block in blocks if block.has_prompt for one in block.shown()]
    run = [
        one
        for block in blocks
        if block.verb == "run" or (block.is_study and not block.has_prompt)
        for one in block.commands()
    ]
    makers = {out_of(command): command for command in (*shown, *run)}
    return Workshop(folder, makers)


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    return workshop_in(tmp_path_factory.mktemp("documents"))


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "document",
    [
        pytest.param(path, marks=pytest.mark.study if path in LONGEST else ())
        for path in RUN_DOCUMENTS
    ],
    ids=str,
)
def test_what_is_shown_is_what_happens(document: Path, workshop: Workshop) -> None:
    """Blocks that take long are left out, unless the whole page does."""
    whole = document in LONGEST
    run_page(
        document, [block for block in run_blocks(document) if whole or not block.is_study], workshop
    )


@pytest.mark.study
@pytest.mark.timeout(600)
@pytest.mark.parametrize("document", WITH_LONG_BLOCKS, ids=str)
def test_what_takes_long_is_shown_as_it_is(document: Path, tmp_path: Path) -> None:
    """With the other blocks of the page, whose files it may need, in a folder of its own."""
    run_page(document, run_blocks(document), workshop_in(tmp_path))


def run_blocks(document: Path) -> list[Block]:
    return [block for block in blocks_of(read(document)) if is_run(block)]


def run_page(document: Path, blocks: list[Block], workshop: Workshop) -> None:
    names: dict[str, Any] = {}
    wrong = [
        f"{document}:{block.line}\n{text}"
        for block in blocks
        for text in workshop.work_on(block, names)
    ]
    assert not wrong, "\n\n".join(wrong)


@pytest.mark.study
@pytest.mark.timeout(3600)
@pytest.mark.parametrize(
    ("document", "block"), STUDIES, ids=[f"{path}:{block.line}" for path, block in STUDIES]
)
def test_what_takes_long_runs_too(document: Path, block: Block, workshop: Workshop) -> None:
    slow = replace(workshop, limit=LIMIT_OF_STUDY)
    assert not slow.work_on(block, {})


@pytest.mark.parametrize("document", DOCUMENTS, ids=str)
def test_every_block_is_run_or_says_why_not(document: Path) -> None:
    for block in blocks_of(read(document)):
        said = block.is_study or re.match(r"not run: .{10,}", block.note)
        own = document in OWN_TEST and block.kind == "python"
        assert not block.is_code or is_run(block) or said or own, f"{document}:{block.line}"


def test_blocks_with_output_are_found() -> None:
    assert Path("README.md") in RUN_DOCUMENTS and len(RUN_DOCUMENTS) > 3
    assert LONGEST < set(RUN_DOCUMENTS)


# --- commands that are not run -----------------------------------------------------------------


@pytest.mark.parametrize("document", DOCUMENTS, ids=str)
def test_every_command_is_understood(document: Path) -> None:
    text = read(document)
    plain = [
        command
        for block in blocks_of(text)
        if not block.has_prompt and not block.kind and block.verb != "run"
        for command in block.commands()
    ]
    for command in (*plain, *inline_commands(text)):
        judge(command)


def judge(command: str) -> None:
    """Fail if a command of ours has a verb, an option, a case, a key or a target that is not."""
    if command.startswith("make "):
        assert set(split(command, comments=True)[1:]) <= make_targets(ROOT / "Makefile"), command
    match = re.match(r"(?:mpirun [^\n]*?)?(?:\.venv/bin/)?catenary (.*)", command)
    if match:
        verb, *words = split(match[1], comments=True)
        if not verb.startswith("-"):
            judge_words(command, verb, words)


def judge_words(command: str, verb: str, words: list[str]) -> None:
    group: Any = typer.main.get_command(app)
    assert verb in group.commands, f"no verb {verb}: {command}"
    ours = words[: words.index("--")] if "--" in words else words  # the rest is PETSc's
    try:
        with group.commands[verb].make_context(verb, ours) as context:
            values = dict(context.params)
    except Exception as error:
        # Prose may name a verb without what it takes.
        assert type(error).__name__ == "MissingParameter", f"{command}: {error}"
        return
    if values.get("case") in shipped():
        assignments = [*(values.get("assignments") or []), *(values.get("extras") or [])]
        varied = [f"{one.partition('=')[0]}={first_of(one)}" for one in values.get("vary") or []]
        load_scene(values["case"], [*assignments, *varied])


def first_of(variation: str) -> str:
    return variation.partition("=")[2].partition(",")[0]


# --- tables ------------------------------------------------------------------------------------


def rows_of_table(text: str, first: str) -> list[list[str]]:
    """Cells of the table whose header begins with a word, the header left out."""
    table = re.search(rf"^\| {first} \|.*\n\|[-| ]+\n((?:\|.*\n)+)", text, re.M)
    assert table is not None
    lines = table[1].splitlines()
    return [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines]


TABLES = ["README.md", "cases/en50318_2002/README.md"]
QUANTITIES = {
    "mean contact force [N]": "mean_N",
    "standard deviation [N]": "std_N",
    "statistical maximum [N]": "stat_max_N",
    "statistical minimum [N]": "stat_min_N",
    "actual maximum [N]": "max_N",
    "actual minimum [N]": "min_N",
    "largest uplift at a support [mm]": "max_uplift_mm",
    "loss of contact [%]": "loss_percent",
}


@pytest.mark.timeout(600)
@pytest.mark.parametrize("document", TABLES)
def test_the_table_of_en_50318(document: str, workshop: Workshop) -> None:
    summaries: list[dict[str, Any]] = []
    for folder in ("results/en250", "results/en300"):
        workshop.make(workshop.makers[folder])
        summary = json.loads((workshop.folder / folder / "summary.json").read_text())
        summaries.append({**summary["pantographs"][0], **summary["supports"]})
    rows = rows_of_table(read(Path(document)), "quantity")
    assert {row[0] for row in rows} == set(QUANTITIES)
    for name, *cells in rows:
        for shown, summary in zip((cells[0], cells[2]), summaries, strict=True):
            value = summary[QUANTITIES[name]]
            assert numbers_agree(shown, f"{value:.6f}"), f"{name}: shown {shown}, is {value}"


PUBLISHED = [
    (row[0].strip("`"), row[1], row[2])
    for row in rows_of_table(read(Path("docs/validation.md")), "command")
]


@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("command", "mean", "sigma"),
    [
        pytest.param(*row, marks=() if number < 2 else pytest.mark.study)
        for number, row in enumerate(PUBLISHED)
    ],
)
def test_a_published_figure_is_what_its_command_gives(
    command: str, mean: str, sigma: str, tmp_path: Path
) -> None:
    words = [*command.split()[1:], "-o", str(tmp_path / "run")]
    assert catenary(*words, cwd=tmp_path).code == 0
    summary = json.loads((tmp_path / "run/summary.json").read_text())
    leading = summary["pantographs"][0]
    for shown, value in ((mean, leading["mean_N"]), (sigma, leading["std_N"])):
        assert numbers_agree(shown, f"{value:.6f}"), f"{command}: shown {shown}, is {value}"


@pytest.mark.parametrize("document", TABLES)
def test_accepted_ranges_are_those_of_the_case(document: str) -> None:
    with open(ROOT / "cases/en50318_2002/reference/accepted_ranges.csv", newline="") as file:
        ranges = list(csv.DictReader(line for line in file if not line.startswith("#")))
    shown = rows_of_table(read(Path(document)), "quantity")
    for column, speed in ((2, "250"), (4, "300")):
        accepted = [f"{r['lower']} - {r['upper']}" for r in ranges if r["speed_km_h"] == speed]
        cells = [row[column] for row in shown]
        assert [cell for cell in cells if " - " in cell] == [a for a in accepted if a != "0 - 0"]

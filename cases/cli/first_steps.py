"""The verbs ``list``, ``new`` and ``doctor``: what there is to begin with, and whether it works."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from catenary.base.errors import InputError
from catenary.base.parallel import launched_by_mpirun
from catenary.cases.cli import command_words
from catenary.cases.cli.app import serial_verb
from catenary.cases.terminal import console


@serial_verb("list")
def list_cases(
    keys: bool = False,
    pantographs: bool = False,
    schema: bool = False,
    rules: bool = False,
    wanted: Annotated[str | None, typer.Argument(autocompletion=command_words.keys)] = None,
) -> None:
    """List cases, keys, pantographs, rule books or the schema.

    Example: catenary list --keys damping

    Parameters
    ----------
    keys : Every key of a scene, its unit, default and meaning.
    pantographs : Ready pantographs, for pantographs.NAME.model.
    schema : The JSON schema of case.toml, for editors that complete keys.
    rules : Rule books that judge a run, for evaluation.rules.
    wanted FILTER : With --keys: a part of a key, or a pattern with * and ?; prints bounds, accepted
        words and typical values too. With --rules: a book, whose criteria and limits are printed.
    """
    asked = {"--keys": keys, "--pantographs": pantographs, "--rules": rules, "--schema": schema}
    given = [name for name, on in asked.items() if on]
    if len(given) > 1:
        raise InputError(
            "list takes one of --keys, --pantographs, --rules and --schema, not "
            f"{' and '.join(given)}"
        )
    if wanted is not None and not (rules or keys):
        raise InputError(
            f"{wanted} filters keys or names a rule book: write `catenary list --keys {wanted}` or "
            f"`catenary list --rules {wanted}`"
        )
    from catenary.cases.terminal import lists

    if rules:
        text = lists.book_table() if wanted is None else lists.criteria_text(wanted)
    elif keys:
        text = lists.key_table() if wanted is None else lists.key_details(wanted)
    elif schema:
        text = json.dumps(lists.scene_schema(), indent=1)
    elif pantographs:
        text = lists.pantograph_table()
    else:
        from catenary.scenes import shipped_cases

        text = lists.case_table(shipped_cases())
    console.say(text, whole=schema)


@serial_verb("new")
def new(
    folder: Annotated[Path, typer.Argument(parser=console.folder)],
    topology: Annotated[str | None, typer.Option(autocompletion=command_words.beginnings)] = None,
    spans: Path | None = None,
    droppers: Path | None = None,
) -> None:
    """Write a commented case as a beginning of your own.

    `check` and `run` take the new folder NAME with its NAME/case.toml. Without --topology it asks
    which kind of line, on a terminal.

    Example: catenary new my_line --topology stitched --spans spans.csv --droppers droppers.csv

    Parameters
    ----------
    folder NAME : Folder to make.
    topology : Kind of line: simple, stitched, compound, twin, twin_messenger, single, tramway,
        conductor_rail, or a case to begin with.
    spans : CSV file with the column span_m, a line for each span; is copied.
    droppers : CSV file with the columns span, position_m and pre_sag_mm or length_m, a line for
        each dropper; is copied, with the pre-sag that lengths give.
    """
    from catenary.cases.scene.starter import BEGINNINGS, write_case

    if topology is None and sys.stdin.isatty() and sys.stdout.isatty():
        for kind, beginning in BEGINNINGS.items():
            console.say(f"  {kind:15} {beginning.meaning}")
        topology = typer.prompt("Which kind of line", default="simple")

    def complete(inner: Path) -> None:
        """Find the pre-sag of planned lengths."""
        if droppers is None:
            return
        from catenary.cases.run.planned_lengths import take_in_lengths

        left = take_in_lengths(inner)
        if left is not None:
            console.say(f"the pre-sag found gives the lengths of the droppers within {left:.2g} mm")

    try:
        path = write_case(folder, topology or "simple", spans, droppers, complete)
    except OSError as error:
        raise InputError(f"{folder} cannot be made ({(error.strerror or '?').lower()})") from error
    check = shlex.join(["catenary", "check", str(folder)])
    run = shlex.join(["catenary", "run", str(folder), "--short", "-o", str(folder / "results")])
    console.say(f"{path} is written; try:\n  {check}\n  {run}")


@serial_verb("doctor")
def doctor() -> int:
    """Check that Catenary works here.

    Packages, compiled kernels, PETSc, MPI, HDF5, compiler, films, ParaView, file locks, memory:
    each line says OK, missing or broken, and how to mend it; exits with 1 if no run is possible.

    Example: catenary doctor
    """
    from catenary.cases.process.installation import examined

    if launched_by_mpirun():
        raise InputError("doctor starts two ranks itself: call it without mpirun")
    prevented = []
    for finding in examined(Path.cwd()):
        console.say(finding.line())
        if finding.prevents_runs:
            prevented.append(finding.part)
    if prevented:
        console.complain(f"no run is possible before these work: {', '.join(prevented)}")
        return console.BROKEN
    console.say("runs are possible")
    return console.DONE

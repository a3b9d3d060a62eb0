"""The verb ``hard``: runs the collection of hard cases and prints which limits they keep."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli.app import Force, Verbose, app, begin, folder_option
from catenary.cases.result_folder.output_folder import refuse_impossible
from catenary.cases.terminal import console
from catenary.postproc.files.csv_text import csv_text

if TYPE_CHECKING:
    from catenary.cases.studies.hard.cases import HardCase
    from catenary.cases.studies.hard.checks import Criterion

TABLES = ("hard.csv", "hard.md")
# Criteria that nearly all cases have, and the heads of their columns.
_COLUMNS = {
    "largest contact force [N]": "force [N]",
    "largest lift [m]": "lift [m]",
    "energy from nothing": "energy made",
    "the same at half the step": "at half the step",
    "difference after halving the step twice to once": "refinement",
    "fixed-point correction, head height [m]": "schemes [m]",
}
# Criteria without a figure.
_PLAIN = ("runs to its end", "everything is finite", "the fixed-point correction breaks")


@app.command(
    "hard",
    help="Run the collection of hard cases and print which limits they keep: energy, bounds, "
    "refinement, schemes, and ranks under mpirun. Some five minutes; exits with 3 if a limit is "
    "not kept.",
    epilog="Example: catenary hard -o results/hard",
)
@console.guarded
def hard(
    names: Annotated[
        list[str] | None, typer.Argument(metavar="NAME", help="Only the hard cases named.")
    ] = None,
    out: Annotated[
        Path | None, folder_option("Folder for the table as hard.csv and hard.md.")
    ] = None,
    shortened: Annotated[
        bool, typer.Option("--short", help="Shorter runs, steps halved once only.")
    ] = False,
    force: Force = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""

    def read() -> list[HardCase]:
        from catenary.cases.studies.hard.cases import hard_cases

        _refuse_to_write(out, force)
        return hard_cases(names)

    comm, cases, _ = begin(lambda: (read(), []), verbose, lambda cases: cases[0].scene())
    from mpi4py import MPI

    from catenary.base.parallel import on_root
    from catenary.cases.studies.hard.checks import check_case
    from catenary.cases.studies.told_remarks import remark_lines
    from catenary.postproc.files.disk import write_all

    found: list[Criterion] = []
    told: dict[str, dict[str, list[str]]] = {}
    for number, case in enumerate(cases, start=1):
        console.say(f"[{number}/{len(cases)}] {case.name}: {case.what}")
        rows, remarks = check_case(case, comm, MPI.COMM_SELF, shortened)
        console.say("\n".join(_line(row) for row in rows))
        found += rows
        told[case.name] = remarks
    failed = [row for row in found if not row.passed]
    lines = remark_lines(march for remarks in told.values() for march in remarks.items())
    if lines:
        console.say("\n" + "\n".join(lines) + "\n")
    if out is not None:
        folder = out
        texts = dict(
            zip(TABLES, (as_csv(found, told), as_markdown(cases, found, told)), strict=True)
        )
        on_root(comm, lambda: write_all(folder, texts))
        console.say("\n".join(str(folder / name) for name in TABLES))
    console.say(
        f"{len(cases)} hard cases on {comm.size} rank{'s' if comm.size > 1 else ''}: "
        f"{len(found) - len(failed)} of {len(found)} limits kept"
    )
    return console.NOT_ACCEPTED if failed else console.DONE


def as_csv(found: list[Criterion], told: Mapping[str, Mapping[str, list[str]]]) -> str:
    """All that was measured, a line each, and the remarks on each case that has any.

    ``told``: by case and march, what this one told of itself.
    """
    heads = ("case", "criterion", "value", "limit", "kept", "note")
    rows = (
        (row.case, row.name, f"{row.value:.3g}", f"{row.limit:.3g}", _yes(row.passed), row.note)
        for row in found
    )
    remarked = (
        (case, "remarks", len(texts), "", "", "; ".join(texts))
        for case, remarks in told.items()
        if (texts := [f"{march}: {text}" for march, own in remarks.items() for text in own])
    )
    return csv_text(heads, (*rows, *remarked))


def _yes(passed: bool) -> str:
    return "yes" if passed else "no"


def as_markdown(
    cases: list[HardCase], found: list[Criterion], told: Mapping[str, Mapping[str, list[str]]]
) -> str:
    """The same as a table with a line for each case, and below it the remarks."""
    from catenary.cases.studies.told_remarks import remark_lines

    heads = (
        "case", "what is hard; *a right answer*", *_COLUMNS.values(), "others", "remarks", "kept",
    )  # fmt: skip
    lines = [
        f"| {' | '.join(heads)} |",
        "|---|---|" + "---|" * (len(_COLUMNS) + 3),
    ]
    for case in cases:
        rows = {row.name: row for row in found if row.case == case.name}
        columns = [f"{rows[name].value:.2g}" if name in rows else "" for name in _COLUMNS]
        others = "; ".join(
            f"{row.name} {row.value:.3g}"
            for name, row in rows.items()
            if name not in _COLUMNS and (name not in _PLAIN or not row.passed)
        )
        kept = "yes" if all(row.passed for row in rows.values()) else "**no**"
        words = f"`{case.name}` | {case.what}; *{case.right}*"
        remarks = sum(len(own) for own in told.get(case.name, {}).values()) or ""
        lines.append(f"| {words} | {' | '.join(columns)} | {others} | {remarks} | {kept} |")
    below = remark_lines(march for remarks in told.values() for march in remarks.items())
    if below:
        lines += ["", *(f"- {line.split(maxsplit=1)[1]}" for line in below)]
    return "\n".join(lines) + "\n"


def _line(row: Criterion) -> str:
    mark = "kept  " if row.passed else "BROKEN"
    note = f"  ({row.note})" if row.note else ""
    return f"    {mark}  {row.name:48} {row.value:10.3g}  limit {row.limit:9.3g}{note}"


def _refuse_to_write(out: Path | None, force: bool) -> None:
    if out is None:
        return
    refuse_impossible(out)
    if (out / TABLES[0]).exists() and not force:
        raise InputError(
            f"{out / TABLES[0]} is there already; name another folder with -o, or give --force"
        )

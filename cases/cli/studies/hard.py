"""The verb ``hard``: runs the collection of hard cases and prints which limits they keep."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli.app import Force, Jobs, Verbose, app, begin, folder_option
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.studies.hard.cases import HardCase
    from catenary.cases.studies.hard.checks import Criterion

TABLES = ("hard.csv", "hard.md")


@app.command(
    "hard",
    help="Run the hard cases and print which limits they keep. Limits are energy, bounds, "
    "refinement, schemes, and ranks under mpirun. Some five minutes; exits with 3 if a limit "
    "is not kept. With -o the same command continues one that was stopped.",
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
    n_jobs: Jobs = 1,
    force: Force = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""

    def read() -> list[HardCase]:
        from catenary.cases.studies.hard.cases import hard_cases

        if out is not None:
            refuse_table(out / TABLES[0], force)
        return hard_cases(names)

    comm, cases, arguments = begin(lambda: (read(), []), verbose, lambda cases: cases[0].scene())
    from catenary.cases.process.petsc_options import start_petsc
    from catenary.cases.process.workers import at_once
    from catenary.cases.studies.hard import checks
    from catenary.cases.studies.records import held_study
    from catenary.postproc.report.study_table import Content, remark_lines, write_files

    if comm.size > 1 and n_jobs != 1:
        raise InputError(f"-j is {n_jobs} on {comm.size} ranks, of which each case is to take all")
    found: list[Criterion] = []
    told: dict[str, dict[str, list[str]]] = {}
    petsc = partial(start_petsc, arguments)
    with held_study(out, comm, "catenary hard", force) as (kept, write):
        checked = checks.check_cases(cases, comm, shortened, kept, at_once(n_jobs, comm), petsc)
        for number, case in enumerate(cases, start=1):
            console.say(f"[{number}/{len(cases)}] {case.name}: {case.what}")
            rows, told[case.name] = next(checked)
            console.say("\n".join(checks.line(row) for row in rows))
            found += rows
        table, page = TABLES
        content: dict[str, Content] = {table: checks.criteria(found, told)}
        content[page] = checks.page(cases, found, told)
        files = write(lambda folder: write_files(folder, content))
    failed = [row for row in found if not row.passed]
    lines = remark_lines(march for remarks in told.values() for march in remarks.items())
    if lines:
        console.say("\n" + "\n".join(lines) + "\n")
    if files:
        console.say("\n".join(map(str, files)))
    console.say(
        f"{len(cases)} hard cases on {comm.size} rank{'s' if comm.size > 1 else ''}: "
        f"{len(found) - len(failed)} of {len(found)} limits kept"
    )
    return console.NOT_ACCEPTED if failed else console.DONE

"""The verbs ``accuracy`` and ``hard``: errors of settings, and limits that hard cases keep."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli import completion
from catenary.cases.cli.app import (
    Force,
    Jobs,
    Out,
    RunWords,
    Verbose,
    begin,
    folder_option,
    verb,
)
from catenary.cases.result_folder.output_folder import refuse_impossible, refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.studies.accuracy.plan import Plan
    from catenary.cases.studies.hard.cases import HardCase
    from catenary.cases.studies.hard.checks import Criterion


_MOST_REPEATS = 99


@verb(
    "accuracy",
    help="Find the step and mesh that a wanted accuracy needs. Step, mesh, scheme, coupling and "
    "models of a case are varied; the error and time of each setting are printed. The same "
    "command continues one that was stopped.",
    epilog="Example: catenary accuracy en50318_2002 -o results/accuracy --axes dt,grid --target 2%",
)
def accuracy(
    words: RunWords,
    out: Out,
    axes: Annotated[
        str | None,
        typer.Option(
            "--axes",
            metavar="NAME,...",
            autocompletion=completion.axes,
            help="Out of dt, elements, grid, scheme, coupling, adaptive, contact, dropper, "
            "pantograph, planes, lateral_damping, parts; all if absent.",
        ),
    ] = None,
    target: Annotated[
        str, typer.Option("--target", metavar="PERCENT", help="Wanted accuracy.")
    ] = "1%",
    quick: Annotated[
        bool,
        typer.Option(
            "--quick", help="Few levels and a coarser reference, good for targets from 2%."
        ),
    ] = False,
    repeats: Annotated[
        int, typer.Option("--repeats", metavar="N", help="How often short runs are timed.")
    ] = 3,
    n_jobs: Jobs = 1,
    force: Force = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""
    from catenary.cases.studies.accuracy.analysis import parse_target
    from catenary.cases.studies.accuracy.axes import parse_axes
    from catenary.cases.studies.accuracy.plan import make_plan

    wanted = parse_target(target)

    def read() -> tuple[Plan, list[str]]:
        overrides, options = words.split()
        refuse_impossible(out)
        if not 1 <= repeats <= _MOST_REPEATS:
            raise InputError(f"--repeats {repeats} must be between 1 and {_MOST_REPEATS}")
        chosen = parse_axes(axes)
        plan = make_plan(
            words.case, chosen, overrides, words.shortened, quick=quick, repeats=repeats
        )
        return plan, options

    comm, plan, arguments = begin(read, verbose, lambda made: made.jobs[0].scene)
    from catenary.base.parallel import on_root
    from catenary.cases.result_folder.folder_lock import held
    from catenary.cases.studies.accuracy import output as accuracy_output
    from catenary.cases.studies.accuracy import runs as study
    from catenary.cases.studies.sweep.jobs import RunOptions
    from catenary.postproc.evaluate.wording import counted

    with held(out, comm, f"catenary accuracy {words.case}"):
        found, ended = study.run(plan, out, comm, RunOptions(force, arguments, console.say, n_jobs))
        if found is None:
            console.complain("the study was interrupted; the same command continues it")
            return console.BROKEN
        files = on_root(comm, lambda: accuracy_output.write(found, out, wanted), takes_long=True)
    console.say("\n" + accuracy_output.as_text(found, wanted))
    console.say(
        f"\n{counted(len(ended), 'run')}, {found.wall:.0f} s\n" + "\n".join(map(str, files))
    )
    return console.DONE


TABLES = ("hard.csv", "hard.md")


@verb(
    "hard",
    help="Run the hard cases and print which limits they keep. Limits are energy, bounds, "
    "refinement, schemes, and ranks under mpirun. Some five minutes; exits with 3 if a limit "
    "is not kept. With -o the same command continues one that was stopped.",
    epilog="Example: catenary hard -o results/hard",
)
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

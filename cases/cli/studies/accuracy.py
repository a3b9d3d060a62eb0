"""The verb ``accuracy``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli import completion
from catenary.cases.cli.app import Force, Jobs, Out, RunWords, Verbose, app, begin
from catenary.cases.result_folder.output_folder import refuse_impossible
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.studies.accuracy.plan import Plan

_MOST_REPEATS = 99


@app.command(
    "accuracy",
    help="Find the step and mesh that a wanted accuracy needs. Step, mesh, scheme, coupling and "
    "models of a case are varied; the error and time of each setting are printed. The same "
    "command continues one that was stopped.",
    epilog="Example: catenary accuracy en50318_2002 -o results/accuracy --axes dt,grid --target 2%",
)
@console.guarded
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

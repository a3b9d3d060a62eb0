"""The verb ``what-if``."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from catenary.cases.cli.app import Force, Jobs, RunWords, Verbose, app, begin, folder_option, tell
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.studies.sweep.jobs import Job

PAGE = "what_if.html"


@app.command(
    "what-if",
    help="Run a case as it is and with the changes of --set, and show the differences: "
    "statistics, uplift by support, droppers, verdicts. The same command continues runs that were "
    "stopped.",
    epilog="Example: catenary what-if en50318_2002 --set line.contact_wire.tension_N=22000 "
    "-o results/tension",
)
@console.guarded
def what_if(
    words: RunWords,
    out: Annotated[
        Path | None,
        folder_option("Folder for page, tables, pictures and both runs; none is kept if absent."),
    ] = None,
    n_jobs: Jobs = 1,
    force: Force = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""
    from catenary.base.parallel import on_root
    from catenary.cases.studies.questions import what_if as question

    def read() -> tuple[tuple[list[Job], list[str]], list[str]]:
        changes, options = words.split()
        jobs = question.jobs_of(words.case, changes, words.shortened)
        if out is not None:
            refuse_table(out / PAGE, force)
        return (jobs, changes), options

    comm, (jobs, changes), arguments = begin(read, verbose, lambda made: made[0][0].scene)
    from catenary.cases.result_folder.folder_lock import held
    from catenary.cases.studies.sweep.jobs import RunOptions

    options = RunOptions(force, arguments, console.say, n_jobs)
    with ExitStack() as stack:
        folder = out
        if folder is None:
            folder = on_root(
                comm,
                lambda: Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="catenary_"))),
            )
        stack.enter_context(held(folder, comm, f"catenary what-if {words.case}"))
        ended = question.run(jobs, folder, comm, options)
        found = on_root(comm, lambda: question.differences(changes, ended, folder), takes_long=True)
        files = []
        if out is not None:
            files = on_root(comm, lambda: question.write(folder, found), takes_long=True)
    tell(question.as_text(found), files)
    return console.DONE

"""The verb ``separation``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.cases.cli.app import Force, Jobs, RunWords, Verbose, app, begin, folder_option, tell
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.scene.load import Draft
    from catenary.cases.scene.scene import Scene

TABLE = "separation.csv"


@app.command(
    "separation",
    help="Find good and bad distances of two pantographs: deviation, least force and uplift over "
    "the distance, where acceptance criteria fail, and which waves explain it. The same command "
    "continues one that was stopped.",
    epilog="Example: catenary separation en50318_2002 -o results/distances --from 50 --to 200 "
    "--step 5",
)
@console.guarded
def separation(
    words: RunWords,
    nearest: Annotated[
        float, typer.Option("--from", metavar="M", help="Shortest distance [m].")
    ] = 31.0,
    farthest: Annotated[
        float, typer.Option("--to", metavar="M", help="Longest distance [m].")
    ] = 400.0,
    step: Annotated[float, typer.Option(metavar="M", help="From one to the next [m].")] = 1.0,
    out: Annotated[
        Path | None,
        folder_option("Folder for table and picture; without it nothing is written."),
    ] = None,
    n_jobs: Jobs = 1,
    force: Force = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""
    from catenary.cases.studies.questions import separation as question

    distances = question.Distances(nearest, farthest, step)

    def read() -> tuple[tuple[Draft, Scene], list[str]]:
        distances.values()
        if out is not None:
            refuse_table(out / TABLE, force)
        draft, options = words.draft()
        return (draft, draft.scene()), options

    comm, (draft, scene), arguments = begin(read, verbose, lambda made: made[1])
    from catenary.base.parallel import on_root
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.sweep.jobs import RunOptions
    from catenary.cases.studies.sweep.together import Marching

    marching = Marching(draft, out, comm, RunOptions(force, arguments, console.say, n_jobs))
    with held_study(out, comm, f"catenary separation {words.case}") as (_, write):
        found = question.find_separations(marching, scene, distances)
        period = on_root(comm, lambda: question.period_in(found, scene), takes_long=True)
        files = write(lambda folder: question.write(folder, found, period))
    tell(question.as_text(found, period), files)
    return console.DONE

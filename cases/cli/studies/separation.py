"""The verb ``separation``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.cases.cli.app import Force, Jobs, RunWords, Verbose, app, begin, folder_option
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.scene.load import Draft
    from catenary.cases.scene.scene import Scene

TABLE = "separation.csv"


@app.command(
    "separation",
    help="Find good and bad distances of two pantographs: deviation, least force and uplift over "
    "the distance, and where acceptance criteria fail. The same command continues one that was "
    "stopped.",
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
    from catenary.cases.scene.load import load_scene, read_draft
    from catenary.cases.studies.questions.separation import Distances, find_separations

    distances = Distances(nearest, farthest, step)

    def read() -> tuple[tuple[Draft, list[str], Scene], list[str]]:
        distances.values()
        if out is not None:
            refuse_table(out / TABLE, force)
        changes, options = words.split()
        draft = read_draft(words.case)
        draft = draft.shortened() if words.shortened else draft
        return (draft, changes, load_scene(draft, changes)), options

    comm, (draft, changes, scene), arguments = begin(read, verbose, lambda made: made[2])
    from catenary.cases.studies.questions import separation_output
    from catenary.cases.studies.questions.marching import kept_in
    from catenary.cases.studies.sweep.jobs import RunOptions

    options = RunOptions(force, arguments, console.say, n_jobs)
    with kept_in(out, comm, f"catenary separation {words.case}") as write:
        found = find_separations(draft, scene, changes, distances, out, comm, options)
        files = write(lambda folder: separation_output.write(folder, found))
    console.say("\n" + separation_output.as_text(found))
    if files:
        console.say("\n" + "\n".join(map(str, files)))
    return console.DONE

"""The verb ``speed``."""

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

TABLE = "speed.csv"


@app.command(
    "speed",
    help="Find the highest speed at which the acceptance criteria hold, all of them and each by "
    "itself: an ensemble over speeds, then bisection. The same command continues one that was "
    "stopped.",
    epilog="Example: catenary speed en50318_2002 -o results/highest --from 200 --to 360",
)
@console.guarded
def speed(
    words: RunWords,
    slowest: Annotated[
        float, typer.Option("--from", metavar="KM_H", help="Lowest speed [km/h].")
    ] = 200.0,
    fastest: Annotated[
        float, typer.Option("--to", metavar="KM_H", help="Highest speed [km/h].")
    ] = 360.0,
    step: Annotated[
        float, typer.Option(metavar="KM_H", help="Distance of the speeds marched first [km/h].")
    ] = 10.0,
    within: Annotated[
        float, typer.Option(metavar="KM_H", help="How closely speeds are bisected [km/h].")
    ] = 1.0,
    criterion: Annotated[
        list[str] | None,
        typer.Option(
            help="Part of the name of a criterion, such as deviation; repeatable. All if absent."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        folder_option("Folder for tables and picture; without it nothing is written."),
    ] = None,
    n_jobs: Jobs = 1,
    force: Force = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""
    from catenary.cases.studies.questions import highest_speed as question

    speeds = question.Speeds(slowest, fastest, step, within)

    def read() -> tuple[tuple[Draft, Scene], list[str]]:
        speeds.first()
        if out is not None:
            refuse_table(out / TABLE, force)
        draft, options = words.draft()
        return (draft, draft.scene()), options

    comm, (draft, scene), arguments = begin(read, verbose, lambda made: made[1])
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.sweep.jobs import RunOptions
    from catenary.cases.studies.sweep.together import Marching

    marching = Marching(draft, out, comm, RunOptions(force, arguments, console.say, n_jobs))
    with held_study(out, comm, f"catenary speed {words.case}") as (_, write):
        found = question.find_speeds(marching, scene.case.name, speeds, criterion or [])
        files = write(lambda folder: question.write(folder, found))
    tell(question.as_text(found), files)
    return console.DONE

"""The verb ``identify``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.cases.cli.app import (
    Assignments,
    Case,
    Force,
    MoreAssignments,
    Out,
    SceneWords,
    Shortened,
    app,
)
from catenary.cases.terminal import console


@app.command(
    "identify",
    help="Find parameters of a case from a measured passage. Errors of dropper lengths, tensions, "
    "damping, masses and others follow from a measured contact force or head height: most "
    "probable values, their uncertainty, what the data cannot determine, and whether the "
    "model fits.",
    epilog="Example: catenary identify ac_simple measured.csv task.toml -o results/identified",
)
@console.guarded
@console.serial
def identify(
    case: Case,
    measured: Annotated[
        Path, typer.Argument(help="CSV file of a passage: places or times, forces, head heights.")
    ],
    task: Annotated[
        Path,
        typer.Argument(
            help="TOML file: columns, units and noise of the measurement, parameters that are "
            "looked for and their priors."
        ),
    ],
    out: Out,
    extras: MoreAssignments = None,
    assignments: Assignments = None,
    shortened: Shortened = False,
    force: Force = False,
) -> int:
    """Serial."""
    from catenary.cases.result_folder.output_folder import refuse_table
    from catenary.cases.studies.identification.task import Task
    from catenary.cases.studies.task_files import read_task

    wanted = read_task(task, Task)
    scene = SceneWords(case, extras, assignments, shortened).load()
    from catenary.cases.studies.identification.output import PARAMETERS, as_text, files_of
    from catenary.cases.studies.identification.study import identify as identified
    from catenary.postproc.report.study_table import write_files

    refuse_table(out / PARAMETERS, force)
    found = identified(scene, measured, wanted, console.alone())
    console.say(as_text(found))
    console.say("\n".join(map(str, write_files(out, files_of(found)))))
    return console.DONE

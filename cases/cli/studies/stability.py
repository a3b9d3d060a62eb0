"""The verb ``stability-map``."""

from __future__ import annotations

from typing import Annotated

import typer

from catenary.cases.cli.app import Force, Jobs, Out, SceneWords, serial_verb
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

TABLE, PICTURE = "stability_map.csv", "stability_map.png"


@serial_verb(
    "stability-map",
    help="Find the largest stable step of every coupling. It is found against contact stiffness "
    "and head mass, from the matrices of a step and by marching, and drawn. Some three "
    "minutes; exits with 3 if matrices and marches do not agree. The same command continues "
    "one that was stopped.",
    epilog="Example: catenary stability-map en50318_2002 -o results/stability",
)
def stability_map(
    words: SceneWords,
    out: Out,
    quick: Annotated[bool, typer.Option("--quick", help="Few stiffnesses and masses.")] = False,
    n_jobs: Jobs = 1,
    force: Force = False,
) -> int:
    """Serial."""
    from catenary.cases.process.workers import at_once
    from catenary.cases.scene.load import read_draft
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.stability import map as study
    from catenary.postproc.report.study_table import Content, write_files

    refuse_table(out / TABLE, force)
    grid, comm = study.QUICK if quick else study.Grid(), console.alone()
    draft = read_draft(words.case, words.changes, words.shortened)
    with held_study(out, comm, f"catenary stability-map {words.case}", force) as (kept, write):
        found = study.make_map(draft, comm, grid, console.say, kept, at_once(n_jobs, comm))
        content: dict[str, Content] = {TABLE: study.as_rows(found)}
        content[PICTURE] = lambda: study.draw(found)
        files = write(lambda folder: write_files(folder, content))
    console.say("\n" + study.as_text(found) + "\n" + "\n".join(map(str, files)))
    return console.DONE if all(one.agrees for one in found.limits) else console.NOT_ACCEPTED

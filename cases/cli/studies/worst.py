"""The verb ``worst``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli.app import RunFolder, app, folder_option
from catenary.cases.terminal import console


@app.command(
    "worst",
    help="Name the worst spans, supports and droppers of a run, with candidates for the cause: "
    "defects, elasticity, reflections, ends of wires, the pantograph ahead.",
    epilog="Example: catenary worst results/en300",
)
@console.guarded
@console.serial
def worst(
    folder: RunFolder,
    count: Annotated[
        int, typer.Option("-n", "--count", min=1, max=1000, help="Places of each kind.")
    ] = 3,
    out: Annotated[
        Path | None,
        folder_option("Folder for tables of all places; without it nothing is written."),
    ] = None,
) -> None:
    """Serial."""
    from catenary.cases.result_folder.output_folder import refuse_impossible
    from catenary.postproc.read.guard import examined

    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; name the folder of a run")
    if out is not None:
        refuse_impossible(out)
    console.alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.questions import worst_output
    from catenary.postproc.read.results import Results

    with Results(folder, examined(folder)) as results:
        answer = worst_output.answer_of(results, count)
    console.say(answer.text)
    if out is not None:
        console.say("\n" + "\n".join(map(str, worst_output.write(out, answer))))

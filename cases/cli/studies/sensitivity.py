"""The verb ``sensitivity``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.cases.cli import completion
from catenary.cases.cli.app import Force, SceneWords, app, folder_option
from catenary.cases.terminal import console

TABLE = "sensitivity.csv"


@app.command(
    "sensitivity",
    help="Rank what the parameters of a case change. It prints the derivatives of the contact- "
    "force statistics and the largest uplift, from one march: what a millimetre, a "
    "kilonewton of tension, a kilogram or a per cent changes.",
    epilog="Example: catenary sensitivity en50318_2002 -p line.contact_wire.tension_N "
    "-p pantographs.reference.masses_kg.0",
)
@console.guarded
@console.serial
def sensitivity(
    words: SceneWords,
    keys: Annotated[
        list[str] | None,
        typer.Option(
            "-p",
            "--parameter",
            metavar="KEY",
            autocompletion=completion.keys,
            help="Key of a number, or of a list whose entries change together, with .0, .1 ... "
            "for one of its entries; repeatable. Those of pantographs, contact, wires, droppers "
            "and damping if absent.",
        ),
    ] = None,
    droppers: Annotated[
        bool,
        typer.Option(
            "--droppers",
            help="The length of each dropper in the evaluated stretch, besides what -p names.",
        ),
    ] = False,
    out: Annotated[
        Path | None, folder_option(f"Folder for {TABLE}; without it nothing is written.")
    ] = None,
    force: Force = False,
) -> int:
    """Serial."""
    from catenary.cases.result_folder.output_folder import refuse_table

    scene = words.load()
    if out is not None:
        refuse_table(out / TABLE, force)
    from catenary.cases.studies.sensitivity.output import as_text, table_of
    from catenary.cases.studies.sensitivity.study import sensitivity_of
    from catenary.postproc.report.study_table import write_files

    found = sensitivity_of(scene, keys or [], console.alone(), droppers=droppers)
    console.say(as_text(found))
    if out is not None:
        console.say(f"\n{write_files(out, {TABLE: table_of(found)})[0]}")
    return console.DONE

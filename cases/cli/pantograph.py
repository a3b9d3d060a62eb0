"""The verb ``pantograph``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.cases.cli.app import Force, SceneWords, app, folder_option
from catenary.cases.terminal import console


@app.command(
    "pantograph",
    help="Print the frequency response of a case's pantograph. Also its static force, equivalent "
    "masses, natural frequencies, and a lumped model fitted to it; with -o they are written "
    "as files.",
    epilog="Example: catenary pantograph ambrosio2012 --fit 2 -o results/pantograph",
)
@console.guarded
@console.serial
def pantograph(
    words: SceneWords,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="NAME",
            help="Table of [pantographs]; that of the leading pantograph if absent.",
        ),
    ] = None,
    out: Annotated[
        Path | None, folder_option("Folder for receptance.csv, receptance.png and lumped.toml.")
    ] = None,
    masses: Annotated[
        int | None,
        typer.Option(
            "--fit",
            metavar="N",
            help="Masses of the lumped model, 1 to 3; two if absent, a lumped pantograph's own.",
        ),
    ] = None,
    low: Annotated[float, typer.Option("--from", metavar="HZ", help="Lowest frequency.")] = 0.1,
    high: Annotated[float, typer.Option("--to", metavar="HZ", help="Highest frequency.")] = 25.0,
    points: Annotated[
        int, typer.Option("--points", metavar="N", help="Frequencies between them, geometric.")
    ] = 250,
    fit_low: Annotated[
        float,
        typer.Option(
            "--fit-from",
            metavar="HZ",
            help="Lowest frequency of the fit; below it the response is that of the lift.",
        ),
    ] = 0.5,
    force: Force = False,
) -> None:
    """Serial."""
    from catenary.cases.studies.pantograph_response import (
        Range,
        new_files,
        study,
        study_text,
        write_study,
    )

    over = Range(low, high, points, fit_low).checked()
    if out is not None:
        new_files(out, force)
    found = study(words.load(), kind, masses, over)
    console.say(study_text(found))
    if out is not None:
        console.say("\n" + "\n".join(str(path) for path in write_study(found, out)))

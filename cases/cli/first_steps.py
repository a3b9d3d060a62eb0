"""The verbs ``new`` and ``doctor``: a case to begin with, and whether the program works here."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli import completion
from catenary.cases.cli.app import app
from catenary.cases.terminal import console


@app.command(
    "new",
    help="Write a commented case as a beginning of your own. `check` and `run` take the new "
    "folder NAME with its NAME/case.toml. Without --topology it asks which kind of line, on "
    "a terminal.",
    epilog="Example: catenary new my_line --topology stitched --spans spans.csv --droppers "
    "droppers.csv",
)
@console.guarded
@console.serial
def new(
    folder: Annotated[
        Path, typer.Argument(parser=console.folder, metavar="NAME", help="Folder to make.")
    ],
    topology: Annotated[
        str | None,
        typer.Option(
            "--topology",
            help="Kind of line: simple, stitched, compound, twin, twin_messenger, single, tramway, "
            "conductor_rail, or a case to begin with.",
            autocompletion=completion.beginnings,
        ),
    ] = None,
    spans: Annotated[
        Path | None,
        typer.Option(
            "--spans", help="CSV file with the column span_m, a line for each span; is copied."
        ),
    ] = None,
    droppers: Annotated[
        Path | None,
        typer.Option(
            "--droppers",
            help="CSV file with the columns span, position_m and pre_sag_mm or length_m, a line "
            "for each dropper; is copied, with the pre-sag that lengths give.",
        ),
    ] = None,
) -> None:
    """Serial."""
    from catenary.cases.scene.starter import BEGINNINGS, write_case

    if topology is None and sys.stdin.isatty() and sys.stdout.isatty():
        for kind, beginning in BEGINNINGS.items():
            console.say(f"  {kind:15} {beginning.meaning}")
        topology = typer.prompt("Which kind of line", default="simple")

    def complete(inner: Path) -> None:
        """Find the pre-sag of planned lengths."""
        if droppers is None:
            return
        from catenary.cases.run.at_rest.planned_lengths import take_in_lengths

        left = take_in_lengths(inner)
        if left is not None:
            console.say(f"the pre-sag found gives the lengths of the droppers within {left:.2g} mm")

    try:
        path = write_case(folder, topology or "simple", spans, droppers, complete)
    except OSError as error:
        raise InputError(f"{folder} cannot be made ({(error.strerror or '?').lower()})") from error
    console.say(
        f"{path} is written; try:\n  catenary check {folder}\n"
        f"  catenary run {folder} --short -o {folder / 'results'}"
    )


@app.command(
    "doctor",
    help="Check that Catenary works here. Packages, compiled kernels, PETSc, MPI, HDF5, compiler, "
    "films, ParaView, file locks, memory: each line says OK, missing or broken, and how to "
    "mend it; exits with 1 if no run is possible.",
    epilog="Example: catenary doctor",
)
@console.guarded
@console.serial
def doctor() -> int:
    """Serial."""
    from catenary.base.parallel import launched_by_mpirun
    from catenary.cases.process.installation import examined

    if launched_by_mpirun():
        raise InputError("doctor starts two ranks itself: call it without mpirun")
    prevented = []
    for finding in examined(Path.cwd()):
        console.say(finding.line())
        if finding.prevents_runs:
            prevented.append(finding.part)
    if prevented:
        console.complain(f"no run is possible before these work: {', '.join(prevented)}")
        return console.BROKEN
    console.say("runs are possible")
    return console.DONE

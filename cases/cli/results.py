"""The verbs ``report`` and ``compare``: results of runs that were made before."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.cases.cli.app import RunFolder, app
from catenary.cases.terminal import console
from catenary.solver.base.errors import InputError


@app.command(
    "report",
    help="Write the report of a run again, from its result file alone.",
    epilog="Example: catenary report results/en300",
)
@console.guarded
@console.serial
def report(
    folder: RunFolder,
) -> None:
    """Serial."""
    from catenary.postproc.read.guard import examined
    from catenary.postproc.report.report import write_report

    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; name the folder of a run")
    written = write_report(folder, folder, examined(folder))
    console.say("\n".join(str(path) for path in written.files))


@app.command(
    "compare",
    help="Print two runs' figures side by side.",
    epilog="Example: catenary compare results/coarse results/fine",
)
@console.guarded
@console.serial
def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a run.")],
    second: Annotated[Path, typer.Argument(help="Folder of another run.")],
) -> None:
    """Serial."""
    from catenary.postproc.evaluate.compare import compare as compare_runs
    from catenary.postproc.read.guard import examined

    found = examined(first), examined(second)
    console.say(compare_runs(first, second, found).rstrip())

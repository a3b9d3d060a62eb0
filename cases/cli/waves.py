"""The verb ``waves``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.cases.cli.app import Assignments, Force, MoreAssignments, Shortened, app, load
from catenary.cases.result_folder.output_folder import refuse_impossible
from catenary.cases.terminal import console
from catenary.solver.base.errors import InputError


@app.command(
    "waves",
    help="Show the waves that a train sends along a line: its motion over place and time, in the "
    "frame of the train, and over wavenumber and frequency, beside the waves, pass bands and "
    "group velocities of the periodic line.",
    epilog="Example: catenary waves en50318_2002 -o results/waves; catenary waves results/waves",
)
@console.guarded
@console.serial
def waves(
    case: Annotated[
        str,
        typer.Argument(help="A case, which is run with a snapshot each 10 ms, or a run's folder."),
    ],
    extras: MoreAssignments = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", parser=console.folder, metavar="<path>", help="For a case."),
    ] = None,
    assignments: Assignments = None,
    shortened: Shortened = False,
    force: Force = False,
) -> int:
    """Serial."""
    from catenary.cases.studies.waves import study

    given = [*(assignments or []), *(extras or [])]
    folder = console.run_folder(case)
    if (folder / "run.h5").is_file():
        if out is not None or given or shortened:
            raise InputError(f"{folder} is a run; -o, --set and --short are for cases")
    else:
        if out is None:
            raise InputError("-o is missing; it names the folder of the run that shows the waves")
        refuse_impossible(out)
        dense = f"output.field_every_s={study.SNAPSHOT_EVERY}"
        chosen = any(key.startswith("output.field_every") for key in given)
        scene = load(case, given if chosen else [*given, dense], None, shortened)
        if not _run(scene, out, force):
            return console.BROKEN
        folder = out
    theory, files = study.study_waves(folder)
    console.say(study.as_text(theory) + "\n" + "\n".join(map(str, files)))
    return console.DONE


def _run(scene: object, out: Path, force: bool) -> bool:
    """Run the case; whether it came to its end."""
    from mpi4py import MPI

    from catenary.cases.process.petsc_options import start_petsc
    from catenary.cases.run.runner import run_case
    from catenary.cases.scene.scene import Scene

    assert isinstance(scene, Scene)
    start_petsc([])
    result = run_case(scene, out, MPI.COMM_SELF, force=force, only_summary=True)
    if result.outcome != "done":
        console.complain(result.outcome)
    return result.outcome == "done"

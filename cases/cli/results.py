"""The verbs ``report``, ``compare``, ``animate`` and ``paraview``, about runs made before."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import CatenaryError, InputError
from catenary.cases.cli.app import RunFolder, app
from catenary.cases.terminal import console
from catenary.postproc.film.view import View

if TYPE_CHECKING:
    from catenary.mbs.shape import Shape
    from catenary.postproc.read.records import Records


Motion = Annotated[
    float | None,
    typer.Option("--motion", min=1, max=1e5, help="Factor by which motions are drawn larger."),
]
FromWhere = Annotated[
    View, typer.Option(help="From the side, from above, or from behind the train.")
]


@app.command(
    "report",
    help="Write the full report of a run from its result file, with data sheets, worst places, "
    "spectra and vector pictures.",
    epilog="Example: catenary report results/en300 --pdf",
)
@console.guarded
@console.serial
def report(
    folder: RunFolder,
    pdf: Annotated[bool, typer.Option("--pdf", help="Write report.pdf too, on A4.")] = False,
    interactive: Annotated[
        bool,
        typer.Option(
            "--interactive",
            help="Write report_interactive.html too: pictures to zoom and read off, 5 MB.",
        ),
    ] = False,
    accuracy: Annotated[
        Path | None,
        typer.Option(
            "--accuracy",
            metavar="STUDY",
            help="Folder of `catenary accuracy --axes grid`, whose errors stand beside the limits.",
        ),
    ] = None,
) -> None:
    """Serial."""
    records = _records(folder)
    console.alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.full_report.scene_of_run import SceneOfRun, measured_errors
    from catenary.cases.studies.full_report.sections import full_sections
    from catenary.postproc.read.results import Results
    from catenary.postproc.report.report import write_report
    from catenary.postproc.report.sections.run_facts import INPUT

    with Results(folder, records) as results:
        try:
            scene = SceneOfRun(results)
        except CatenaryError as error:
            if accuracy is not None:
                raise
            console.warn(f"the report has no data sheets: {error}")
            scene = None
    measured: tuple[dict[str, float], str] = ({}, "")
    if accuracy is not None and scene is not None:
        measured = measured_errors(scene.scene, accuracy), str(accuracy)
    entries, text = full_sections(scene), scene and scene.input_text
    beside = {INPUT: text} if text else {}
    written = write_report(
        folder,
        folder,
        records,
        entries,
        beside,
        measured=measured,
        vector=True,
        on_paper=pdf,
        interactive=interactive,
    )
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


@app.command(
    "animate",
    help="Make a film of a run, film.mp4 and film.gif: the line and its pantographs, the contact "
    "force beneath. Each picture is a snapshot of fields.h5.",
    epilog="Example: catenary animate results/en300 --from 2 --to 6",
)
@console.guarded
@console.serial
def animate(
    folder: RunFolder,
    start: Annotated[
        float | None, typer.Option("--from", min=0, max=1e7, help="Simulated time to begin at [s].")
    ] = None,
    end: Annotated[
        float | None, typer.Option("--to", min=0, max=1e7, help="Simulated time to end at [s].")
    ] = None,
    rate: Annotated[
        float, typer.Option("--fps", min=1, max=120, help="Snapshots shown a second.")
    ] = 25.0,
    width: Annotated[
        float | None,
        typer.Option(
            "--width-m", min=5, max=2000, help="Line in the picture; some two spans if absent."
        ),
    ] = None,
    motion: Motion = None,
    view: FromWhere = View.SIDE,
) -> None:
    """Serial."""
    from catenary.postproc.film.animate import Wish
    from catenary.postproc.film.animate import animate as make_film

    wish = Wish(start, end, rate, width, motion, view)
    records = _records(folder)
    shapes = _shapes(folder, records)
    film = make_film(folder, wish, records, not console.is_quiet(), shapes)
    pace = (
        f"{film.slowed:.2g} times slower"
        if film.slowed >= 1
        else (f"{1 / film.slowed:.2g} times faster")
    )
    console.say("\n".join(map(str, film.files)))
    console.say(f"{film.n_pictures} pictures; the film runs {pace} than the train.")


@app.command(
    "paraview",
    help="Write paraview/view.py into the folder of a run: a script that opens it in ParaView, "
    "from the side, with pantographs, forces and masts, heights and motions drawn larger.",
    epilog="Example: catenary paraview results/en300",
)
@console.guarded
@console.serial
def paraview(
    folder: RunFolder,
    motion: Motion = None,
    view: FromWhere = View.SIDE,
    state: Annotated[
        bool,
        typer.Option(help="Let ParaView write view.pvsm, which opens the same without Python."),
    ] = True,
) -> None:
    """Serial."""
    import shutil

    from catenary.postproc.paraview.open_in_paraview import write_script
    from catenary.postproc.paraview.state import write_state

    records = _records(folder)
    script, *others = write_script(folder, records, motion, _shapes(folder, records), view)
    made, why = write_state(script) if state else (None, "")
    console.say("\n".join(map(str, (script, *others, *([made] if made else [])))))
    if why and shutil.which("paraview") is not None:
        console.warn(why)
    console.say(f"Open it with: paraview --script={script}")
    if shutil.which("paraview") is None:
        console.warn("paraview is not on this machine (Debian, Ubuntu: apt-get install paraview)")


def _records(folder: Path) -> Records | None:
    """What is in the result file of a folder, None if a quick look is enough."""
    from catenary.postproc.read.guard import examined

    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; name the folder of a run")
    return examined(folder)


def _shapes(folder: Path, records: Records | None) -> list[Shape] | None:
    """How the pantographs of a run are drawn, None if its scene is not one of this version."""
    from catenary.cases.scene.input.faults import Origin
    from catenary.cases.scene.load import scene_from
    from catenary.cases.scene.problem import problem_of
    from catenary.mbs.shape import shape_of
    from catenary.postproc.read.results import Results

    with Results(folder, records) as results:
        config = results.attributes["config"]
    try:
        problem = problem_of(scene_from(config, Origin(str(folder), recorded=True)))
        return [shape_of(placement.data) for placement in problem.train.placements]
    except InputError as error:
        console.warn(f"pantographs are drawn as schematics: {error}")
        return None

"""The verbs ``report``, ``compare``, ``animate`` and ``paraview``, about runs made before."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli.app import RunFolder, app
from catenary.cases.terminal import console
from catenary.postproc.film.wish import View

if TYPE_CHECKING:
    from catenary.mbs.shape import Shape
    from catenary.postproc.read.records import Records


Motion = Annotated[
    float | None,
    typer.Option("--motion", min=1, max=1e5, help="Factor by which motions are drawn larger."),
]
FromWhere = Annotated[
    View | None,
    typer.Option(
        help="From the side, from the side and above, from above, or from behind the train; "
        "oblique if absent where wires lie beside each other, side otherwise."
    ),
]


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
    from catenary.postproc.report.report import write_report

    written = write_report(folder, folder, _records(folder))
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
    "force beneath, from the snapshots of fields.h5.",
    epilog="Example: catenary animate results/en300 --from 2 --to 6 --camera trailing",
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
        float, typer.Option("--fps", min=1, max=120, help="Pictures shown a second.")
    ] = 25.0,
    every: Annotated[
        float | None,
        typer.Option(
            "--every-m",
            min=1e-3,
            max=1e4,
            help="Travel of the train between two pictures; a hundredth of their width if absent.",
        ),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            "--width-m", min=5, max=2000, help="Line in the picture; some two spans if absent."
        ),
    ] = None,
    motion: Motion = None,
    view: FromWhere = None,
    camera: Annotated[
        str | None,
        typer.Option(
            help="Pantograph that the camera goes with: its name, or its number from the front; "
            "the middle of all if absent."
        ),
    ] = None,
) -> None:
    """Serial."""
    from catenary.postproc.film.animate import animate as make_film
    from catenary.postproc.film.wish import Wish

    wish = Wish(start, end, rate, every, width, motion, view, camera)
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
    if not film.smooth:
        console.warn(
            f"snapshots are {film.apart:.2g} m apart, and each is a picture; for a smooth film "
            "run the scene again with output.field_every_m=1"
        )


@app.command(
    "paraview",
    help="Write paraview/view.py into the folder of a run: a script that opens it in ParaView, "
    "with pantographs, forces and masts, heights and motions drawn larger.",
    epilog="Example: catenary paraview results/en300",
)
@console.guarded
@console.serial
def paraview(
    folder: RunFolder,
    motion: Motion = None,
    view: FromWhere = None,
    state: Annotated[
        bool,
        typer.Option(help="Let ParaView write view.pvsm, which opens the same without Python."),
    ] = True,
) -> None:
    """Serial."""
    import shutil

    from catenary.postproc.paraview.open_in_paraview import write_script
    from catenary.postproc.paraview.state import PROGRAM, write_state

    records = _records(folder)
    script, *others = write_script(folder, records, motion, _shapes(folder, records), view)
    console.say("\n".join(map(str, (script, *others))))
    if state and shutil.which(PROGRAM) is not None:
        console.say(
            f"Waiting for {PROGRAM}, which starts ParaView to write view.pvsm: some ten seconds "
            "(--no-state leaves it out)."
        )
        made, why = write_state(script)
        if made:
            console.say(str(made))
        else:
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

"""The verbs ``report``, ``compare``, ``animate`` and ``paraview``, about runs made before."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from catenary.base.errors import CatenaryError, InputError
from catenary.base.files import is_file, is_folder
from catenary.cases.cli.app import serial_verb
from catenary.cases.cli.command_words import Force, OutIfAny, RunFolder, records_of
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console
from catenary.postproc.files.own_files import RUN_FILE
from catenary.postproc.film.options import FilmOptions, Motion, View

if TYPE_CHECKING:
    from catenary.mbs.shape import Shape
    from catenary.postproc.read.validation import Records


@serial_verb("report")
def report(
    folder: RunFolder,
    pdf: bool = False,
    interactive: bool = False,
    accuracy: Path | None = None,
    cost: Path | None = None,
    validation: Path | None = None,
) -> None:
    """Write the full report of a run from its result file.

    It has data sheets, worst places, spectra and vector pictures.

    Example: catenary report results/en300 --pdf

    Parameters
    ----------
    pdf : Write report.pdf too, on A4.
    interactive : Write report_interactive.html too: pictures to zoom and read off, 5 MB.
    accuracy STUDY : Folder of `catenary accuracy --axes grid`, whose errors stand beside the
        limits.
    cost STUDY : Folder of `catenary plan --cost -o STUDY`, whose costs stand beside the effects.
    validation STUDY : Folder of `catenary validate -o STUDY`, whose statement is part of the
        report.
    """
    records = records_of(folder)
    console.alone()  # starts MPI as one process, before anything imports it
    from catenary.cases.studies.full_report import (
        SceneOfRun,
        full_sections,
        measured_costs,
        measured_errors,
        statement_in,
    )
    from catenary.postproc.read.results import Results
    from catenary.postproc.report.report import write_report
    from catenary.postproc.report.sections.run_facts import INPUT

    statement = None if validation is None else statement_in(validation)
    with Results(folder, records) as results:
        try:
            scene = SceneOfRun(results)
        except CatenaryError as error:
            if accuracy is not None or cost is not None:
                raise
            console.warn(f"the report has no data sheets: {error}")
            scene = None
    measured: tuple[dict[str, float], str] = ({}, "")
    if accuracy is not None and scene is not None:
        measured = measured_errors(scene.scene, accuracy), str(accuracy)
    costs: tuple[dict[str, str], str] = ({}, "")
    if cost is not None and scene is not None:
        costs = measured_costs(scene, cost), str(cost)
    entries, text = full_sections(scene, costs, statement), scene and scene.input_text
    beside = {INPUT: text} if text else {}
    with console.waiting("report"):
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


@serial_verb("compare")
def compare(
    first: Path,
    others: list[Path],
    description: Path | None = None,
    out: OutIfAny = None,
    force: Force = False,
) -> None:
    """Compare runs with each other or with a measurement.

    Of several runs it prints the figures side by side, with the statistical significance of their
    differences; of a run and a measured passage, errors of the measurement, figures of both,
    tolerances.

    Example: catenary compare results/coarse results/fine, or with a measurement: catenary compare
    results/en300 measured.csv --description measured.toml -o results/measured

    Parameters
    ----------
    first : Folder of a run.
    others : Folders of other runs, or the CSV file of a measurement.
    description : TOML file: columns, units, filter and pantograph of the measurement.
    out : Folder for page, tables and JSON of a measurement; none if absent.
    """
    from catenary.postproc.read.guard import examined

    tables = [
        one for one in (first, *others) if one.suffix.lower() == ".csv" and not is_folder(one)
    ]
    if tables == others and len(others) == 1:
        _compare_measured(first, others[0], description, out, force)
        return
    if tables:
        raise InputError("a measurement is compared with one run: name the run, then the CSV file")
    if description is not None or out is not None:
        option = "--description" if description is not None else "-o"
        raise InputError(f"{option} belongs to a measurement: name a run and a CSV file")
    from catenary.postproc.evaluate.compare import compare as compare_runs

    folders = [first, *others]
    _refuse_tables(folders)
    console.say(compare_runs(*folders, records=[examined(one) for one in folders]).rstrip())


def _refuse_tables(runs: Sequence[Path]) -> None:
    """Refuse a file that is no result file by its name and its content: a measurement, perhaps."""
    import h5py

    for path in runs:
        if is_file(path) and path.suffix != Path(RUN_FILE).suffix and not h5py.is_hdf5(path):
            raise InputError(
                f"{path} is neither a run nor a measurement: a run is its folder, or {RUN_FILE} "
                "there, and a measurement is a text file whose name ends in .csv"
            )


def _compare_measured(
    folder: Path, file: Path, description: Path | None, out: Path | None, force: bool
) -> None:
    """Compare a run with a measured passage. Serial."""
    from catenary.cases.studies.measured import read_description

    wanted = None if description is None else read_description(description)
    from catenary.cases.studies.measured import passage_of, read_table, usual_description
    from catenary.postproc.measurements import compared
    from catenary.postproc.measurements.comparison import compare_with
    from catenary.postproc.read.results import Results

    refuse_table(out, compared.PAGE, force)
    table = read_table(file)
    if wanted is None:
        wanted = usual_description(table, file)
    beside = (description or file).parent
    with Results(folder, records_of(folder)) as results:
        found = compare_with(results, passage_of(table, file, wanted, beside, results))
    console.say(compared.as_text(found))
    if out is not None:
        console.say("\n" + "\n".join(map(str, compared.write_comparison(out, found))))


@serial_verb("animate")
def animate(folder: RunFolder, options: FilmOptions) -> None:
    """Make a film of a run, film.mp4 and film.gif.

    It shows the line and its pantographs, the contact force beneath, from the snapshots of
    fields.h5.

    Example: catenary animate results/en300 --from 2 --to 6 --camera trailing
    """
    from catenary.postproc.film.animate import animate as make_film

    records = records_of(folder)
    shapes = _shapes(folder, records)
    film = make_film(folder, options, records, not console.is_quiet(), shapes)
    pace = (
        f"{film.slowed:.2g} times slower"
        if film.slowed >= 1
        else (f"{1 / film.slowed:.2g} times faster")
    )
    console.say("\n".join(map(str, film.files)))
    console.say(f"{film.n_pictures} pictures; the film runs {pace} than the train.")
    if film.left_out:
        console.warn(
            f"the film leaves out {film.left_out} snapshots that do not show the line around the "
            "train is; output.field_spans chooses what they show"
        )
    if not film.smooth:
        console.warn(
            f"snapshots are {film.apart:.2g} m apart, and each is a picture; for a smooth film "
            "run the scene again with output.field_every_m=1"
        )


@serial_verb("paraview")
def paraview(
    folder: RunFolder, motion: Motion = None, view: View | None = None, state: bool = True
) -> None:
    """Write a script that opens a run in ParaView.

    paraview/view.py in the folder of the run shows pantographs, forces and masts, heights and
    displacements enlarged.

    Example: catenary paraview results/en300

    Parameters
    ----------
    motion : Factor by which displacements are enlarged.
    view : From the side, from the side and above, from above, or from behind the train; oblique if
        absent where wires lie beside each other, side otherwise.
    state : Let ParaView write view.pvsm, which opens the same without Python.
    """
    import shutil

    from catenary.postproc.film.open_in_paraview import PROGRAM, write_script, write_state

    records = records_of(folder)
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


def _shapes(folder: Path, records: Records | None) -> list[Shape] | None:
    """Shapes of the pantographs of a run, None if its scene is not one of this version."""
    from catenary.cases.scene.load import recorded_scene
    from catenary.cases.scene.scene import problem_of
    from catenary.mbs.shape import shape_of
    from catenary.postproc.read.results import Results

    with Results(folder, records) as results:
        config = results.attributes["config"]
    try:
        problem = problem_of(recorded_scene(config, folder))
        return [shape_of(placement.data) for placement in problem.train.placements]
    except InputError as error:
        console.warn(f"pantographs are drawn as schematics: {error}")
        return None

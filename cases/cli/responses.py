"""The verbs ``pantograph``, ``sensitivity``, ``identify`` and ``waves``: what a line answers to.

Pantographs answer to frequencies, results to parameters, which a measurement tells, and lines to
trains, forces and hammers, by waves.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError
from catenary.base.files import is_file
from catenary.cases.cli import command_words
from catenary.cases.cli.app import leave, serial_verb
from catenary.cases.cli.command_words import Force, Out, OutIfAny, SceneWords
from catenary.cases.result_folder.output_folder import refuse_impossible, refuse_table, run_folder
from catenary.cases.studies.asked import Excited, Frequencies
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.scene.scene import Scene

EXCITATIONS = ("pantograph", "force", "pulse", "hammer")


@serial_verb("pantograph")
def pantograph(
    words: SceneWords,
    over: Frequencies,
    kind: str | None = None,
    out: OutIfAny = None,
    fit: int | None = None,
    force: Force = False,
) -> None:
    """Print the frequency response of a case's pantograph.

    Also its static force, equivalent masses, natural frequencies, and a lumped model fitted to it;
    with -o they are written as files.

    Example: catenary pantograph ambrosio2012 --fit 2 -o results/pantograph

    Parameters
    ----------
    kind NAME : Table of [pantographs]; that of the leading pantograph if absent.
    out : Folder for receptance.csv, receptance.png and lumped.toml.
    fit N : Masses of the lumped model, 1 to 3; if absent two, or a lumped pantograph's own.
    """
    from catenary.cases.studies.pantograph_response import FILES, files_of, study, study_text

    over.checked()
    for name in FILES:
        refuse_table(out, name, force)
    found = study(words.load(), kind, fit, over)
    leave(out, study_text(found), lambda: files_of(found))


@serial_verb("sensitivity")
def sensitivity(
    words: SceneWords,
    keys: Annotated[
        list[str] | None, typer.Option("-p", "--parameter", autocompletion=command_words.keys)
    ] = None,
    droppers: bool = False,
    at_rest: bool = False,
    out: OutIfAny = None,
    force: Force = False,
) -> None:
    """Rank what the parameters of a case change.

    It prints the derivatives of the contact-force statistics and the largest uplift, from one
    march: what a millimetre, a kilonewton of tension, a kilogram or a per cent changes.

    Example: catenary sensitivity en50318_2002 -p line.contact_wire.tension_N -p
    pantographs.reference.masses_kg.0

    Parameters
    ----------
    keys KEY : Key of a number, or of a list whose entries change together, with .0, .1 ... for one
        of its entries; repeatable. Those of pantographs, contact, wires, droppers and damping if
        absent.
    droppers : The length of each dropper in the evaluated stretch, besides what -p names.
    at_rest : Shape and elasticity of the span in the middle of the line, without a march.
    out : Folder for sensitivity.csv, or sensitivity_at_rest.csv; without it nothing is written.
    """
    from catenary.parameters import AT_REST, SENSITIVITIES, derivatives, rest_derivatives

    scene = words.scene()
    refuse_table(out, AT_REST if at_rest else SENSITIVITIES, force)
    if at_rest:
        found = rest_derivatives(scene, keys or [], droppers=droppers)
    else:
        found = derivatives(scene, keys or [], droppers=droppers, progress=not console.is_quiet())
    leave(out, found.text, lambda: {found.file: found.rows})


@serial_verb("identify")
def identify(words: SceneWords, measured: Path, task: Path, out: Out, force: Force = False) -> None:
    """Find parameters of a case from a measured passage.

    Errors of dropper lengths, tensions, damping, masses and others follow from a measured contact
    force or head height: most probable values, their uncertainty, what the data cannot determine,
    and whether the model fits.

    Example: catenary identify ac_simple measured.csv task.toml -o results/identified

    Parameters
    ----------
    measured : CSV file of a passage: places or times, forces, head heights.
    task : TOML file: columns, units and noise of the measurement, parameters that are looked for
        and their priors.
    """
    from catenary.parameters import identified, identified_files, task_of

    wanted = task_of(task)
    scene = words.scene()
    from catenary.cases.studies.parameters.identified import PARAMETERS

    refuse_table(out, PARAMETERS, force)
    found = identified(scene, measured, wanted, console.say)
    leave(out, f"\n{found}", lambda: identified_files(found))


@dataclass
class WaveWords(SceneWords):
    """The scene whose waves are analysed, or the folder of a run in the place of its case.

    Parameters
    ----------
    case : A case, which is run with a snapshot every 10 ms, or a run's folder.
    """

    case: str


@serial_verb("waves")
def waves(
    words: WaveWords,
    excited: Excited,
    out: OutIfAny = None,
    excite: Annotated[str, typer.Option(metavar="|".join(EXCITATIONS))] = EXCITATIONS[0],
    obstacles: bool = False,
    window_error: str | None = None,
    vary: list[str] | None = None,
    force: Force = False,
) -> int:
    """Analyse wave propagation along a line.

    A train, a moving force, a pulse or a hammer excites the line. Pictures show its motion in space
    and time, in the frame of the train, and over wavenumber and frequency, its energy ahead and
    behind, and pass bands and group velocities of the periodic line. `catenary separation` shows
    how two pantographs act on each other.

    Example: catenary waves en50318_2002 -o results/waves; catenary waves results/waves; catenary
    waves en50318_2002 --excite hammer --at-m 630 -o results/hammer

    Parameters
    ----------
    out : Folder for the results of a case.
    excite : What sets the line of a case into motion.
    obstacles : Measure what each kind of obstacle of the line sends back and lets through, beside
        theory, and nothing else.
    window_error SPANS,... : March the whole line and windows of so many moving spans, and draw the
        error of the contact force over their size, and nothing else.
    vary KEY=V1,V2,... : With --window-error: a curve for each value, or combination of those of
        several keys.
    """
    from catenary.cases.process.petsc_options import start_petsc
    from catenary.cases.studies.waves import study

    folder = run_folder(words.case)
    if excite not in EXCITATIONS:
        raise InputError(f"--excite is {excite}, but must be one of {', '.join(EXCITATIONS)}")
    train = excite == EXCITATIONS[0]
    if train and any(value is not None for value in astuple(excited)):
        raise InputError(
            "--force-N, --frequency-Hz, --at-m, --duration-s and --impulse-Ns belong to another "
            "--excite than pantograph; the scene says all about that"
        )
    if obstacles and not train:
        raise InputError("--obstacles runs pulses of its own; leave --excite away")
    if vary and window_error is None:
        raise InputError("--vary belongs to --window-error; vary other runs with catenary sweep")
    if window_error is not None:
        if obstacles or not train:
            raise InputError("--window-error runs the train; leave --obstacles and --excite away")
        if out is None:
            raise InputError("-o is missing; it names the folder of the runs")
        _window_error(words, out, window_error, vary or [], force)
        return console.DONE
    if is_file(folder / "run.h5"):
        if obstacles:
            raise InputError(f"{folder} is a run; --obstacles is for cases")
        if out is not None or words.changes or words.shortened or not train:
            raise InputError(f"{folder} is a run; -o, --set, --short and --excite are for cases")
        text, files = study.study_waves(folder)
    else:
        if out is None:
            raise InputError("-o is missing; it names the folder of the run that shows the waves")
        refuse_impossible(out)
        dense = f"output.field_every_s={study.SNAPSHOT_EVERY}"
        is_dense = any(key.startswith("output.field_every") for key in words.changes)
        scene = words.load(*([] if is_dense or not train or obstacles else [dense]))
        start_petsc([])
        if obstacles:
            text, files = study.study_obstacles(scene, out, force)
        elif not train:
            text, files = study.study_excited(scene, excite, excited, out, force)
        elif _run(scene, out, force):
            text, files = study.study_waves(out)
        else:
            return console.BROKEN
    console.say(text + "\n" + "\n".join(map(str, files)))
    return console.DONE


def _window_error(words: WaveWords, out: Path, text: str, vary: list[str], force: bool) -> None:
    """Runs ``--window-error``."""
    from catenary.cases.process.petsc_options import start_petsc
    from catenary.cases.studies.sweep.variants import check_keys, parse_vary, product, whole_numbers
    from catenary.cases.studies.waves import window_error

    refuse_table(out, window_error.TABLE, force)
    bounds = window_error.LEAST, window_error.MOST
    sizes = whole_numbers(text, window_error.OPTION, *bounds, "8,16,24,40,54")
    variants = product([parse_vary(one) for one in vary], {}) if vary else []
    check_keys(variants, "on the command line (--vary)")
    scenes = [(one.name, words.load(*one.assignments)) for one in variants]
    scenes = scenes or [("", words.load())]
    start_petsc([])
    curves = [window_error.curve_of(name, scene, sizes) for name, scene in scenes]
    leave(out, window_error.as_text(curves), lambda: window_error.files_of(curves))


def _run(scene: Scene, out: Path, force: bool) -> bool:
    """Run the case; whether it came to its end."""
    from catenary.runs import run_into

    made = run_into(out, scene, console.alone(), [], force=force, only_summary=True)
    if made.outcome != "done":
        console.complain(made.outcome)
    return made.outcome == "done"

"""The verbs ``pantograph``, ``sensitivity`` and ``identify``: parameters and what they change."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.cases.cli import command_words
from catenary.cases.cli.app import (
    Force,
    Out,
    OutIfAny,
    SceneWords,
    leave,
    serial_verb,
)
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.studies.asked import Frequencies
from catenary.cases.terminal import console


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
    from catenary.cases.studies.pantograph_response import (
        FILES,
        files_of,
        study,
        study_text,
    )

    over.checked()
    if out is not None:
        for name in FILES:
            refuse_table(out / name, force)
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
) -> int:
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
    if out is not None:
        refuse_table(out / (AT_REST if at_rest else SENSITIVITIES), force)
    if at_rest:
        found = rest_derivatives(scene, keys or [], droppers=droppers)
    else:
        found = derivatives(scene, keys or [], droppers=droppers, progress=not console.is_quiet())
    leave(out, found.text, lambda: {found.file: found.rows})
    return console.DONE


@serial_verb("identify")
def identify(
    words: SceneWords,
    measured: Path,
    task: Path,
    out: Out,
    force: Force = False,
) -> int:
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
    from catenary.cases.studies.identification.output import PARAMETERS

    refuse_table(out / PARAMETERS, force)
    found = identified(scene, measured, wanted, console.say)
    leave(out, f"\n{found}", lambda: identified_files(found))
    return console.DONE

"""The verb ``optimise``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.cases.cli.app import Assignments, Case, Force, Jobs, Out, app
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.scene.load import Draft

TaskFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="TOML file with the task.", show_default=False)
]


def draft_of(case: str, assignments: list[str] | None) -> Draft:
    """The case with its assignments, not shortened."""
    from catenary.cases.scene.input.faults import COMMAND_LINE
    from catenary.cases.scene.input.toml_input import parse_assignment
    from catenary.cases.scene.load import read_draft

    pairs = [parse_assignment(text) for text in assignments or []]
    return read_draft(case).assigned((key, value, COMMAND_LINE) for key, value in pairs)


@app.command(
    "optimise",
    help="Choose droppers, tensions, pantographs or any numbers of a scene for the smallest "
    "standard deviation of the contact force, or another statistic, over both directions, several "
    "speeds, trains and installation errors; check what is found with a finer mesh, a shorter step "
    "and unseen errors. The same command continues one that was stopped.",
    epilog="Example: catenary optimise ac_simple droppers.toml -o results/optimum "
    "--set train.speed_km_h=320",
)
@console.guarded
@console.serial
def optimise(
    case: Case,
    task_file: TaskFile,
    out: Out,
    assignments: Assignments = None,
    n_jobs: Jobs = 1,
    force: Force = False,
) -> int:
    """Serial."""
    from catenary.cases.studies.optimise import study
    from catenary.cases.studies.optimise.task import OptimiseTask
    from catenary.cases.studies.records import KeptRows
    from catenary.cases.studies.scene_sets.task_file import read_task

    refuse_table(out / "optimise.json", force)
    plan = study.make_plan(draft_of(case, assignments), read_task(task_file, OptimiseTask))
    for sentence in plan.warnings:
        console.warn(sentence)
    from catenary.cases.result_folder.folder_lock import held
    from catenary.cases.studies.optimise import output
    from catenary.cases.studies.scene_sets.evaluate import workers

    with held(out, console.alone(), f"catenary optimise {case}"):
        kept = KeptRows(out, force)
        with workers(n_jobs) as pool:
            found = study.optimise(plan, pool, kept, console.say)
        files = output.write(out, plan, found)
        kept.forget()
    console.say("\n" + output.as_text(plan, found) + "\n\n" + "\n".join(map(str, files)))
    return console.DONE

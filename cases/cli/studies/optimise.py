"""The verbs ``optimise`` and ``tolerance``: studies over sets of scenes, by a task in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.cases.cli.app import Assignments, Case, Force, Jobs, Out, SceneWords, app, tell
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

TaskFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="TOML file with the task.", show_default=False)
]


@app.command(
    "optimise",
    help="Choose numbers of a scene for the calmest contact force. Droppers, tensions, "
    "pantographs or any others are chosen for the smallest standard deviation of the contact "
    "force, or another statistic, over both directions, several speeds, trains and "
    "installation errors; the optimum is checked with a finer mesh, a shorter step and "
    "unseen errors. The same command continues one that was stopped.",
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
    from catenary.cases.studies.task_files import read_task

    refuse_table(out / "optimise.json", force)
    draft, _ = SceneWords(case, assignments=assignments).draft()
    plan = study.make_plan(draft, read_task(task_file, OptimiseTask))
    for sentence in plan.warnings:
        console.warn(sentence)
    from catenary.cases.studies.optimise import output
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.scene_sets.evaluation import workers

    command = f"catenary optimise {case}"
    with held_study(out, console.alone(), command, force) as (kept, write), workers(n_jobs) as pool:
        found = study.optimise(plan, pool, kept, console.say)
        files = write(lambda folder: output.write(folder, plan, found))
    tell(output.as_text(plan, found), files)
    return console.DONE


@app.command(
    "tolerance",
    help="Find the tolerances within which the criteria hold. Droppers, heights, tensions or any "
    "numbers of a scene may be off so far that each acceptance criterion holds with a "
    "probability of 99 %, by samples of errors, and in the worst case. The same command "
    "continues one that was stopped.",
    epilog="Example: catenary tolerance en50318_2002 installation.toml -o results/tolerance",
)
@console.guarded
@console.serial
def tolerance(
    case: Case,
    task_file: TaskFile,
    out: Out,
    assignments: Assignments = None,
    n_jobs: Jobs = 1,
    force: Force = False,
) -> int:
    """Serial."""
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.scene_sets.evaluation import workers
    from catenary.cases.studies.task_files import read_task
    from catenary.cases.studies.tolerance import output, study
    from catenary.cases.studies.tolerance.task import ToleranceTask

    refuse_table(out / output.TABLE, force)
    draft, _ = SceneWords(case, assignments=assignments).draft()
    plan = study.make_plan(draft, read_task(task_file, ToleranceTask))
    command = f"catenary tolerance {case}"
    with held_study(out, console.alone(), command, force) as (kept, write), workers(n_jobs) as pool:
        found = study.find_tolerances(plan, pool, kept, console.say)
        files = write(lambda folder: output.write(folder, plan, found))
    tell(output.as_text(plan, found), files)
    return console.DONE

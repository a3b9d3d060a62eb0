"""The verb ``tolerance``."""

from __future__ import annotations

from catenary.cases.cli.app import Assignments, Case, Force, Jobs, Out, app
from catenary.cases.cli.studies.optimise import TaskFile, draft_of
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console


@app.command(
    "tolerance",
    help="Find how far droppers, heights, tensions or any numbers of a scene may be off for each "
    "acceptance criterion to hold with 99 %: by samples of errors, and in the worst case. The same "
    "command continues one that was stopped.",
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
    from catenary.cases.result_folder.folder_lock import held
    from catenary.cases.studies.records import KeptRows
    from catenary.cases.studies.scene_sets.evaluate import workers
    from catenary.cases.studies.scene_sets.task_file import read_task
    from catenary.cases.studies.tolerance import output, study
    from catenary.cases.studies.tolerance.task import ToleranceTask

    refuse_table(out / output.TABLE, force)
    plan = study.make_plan(draft_of(case, assignments), read_task(task_file, ToleranceTask))
    with held(out, console.alone(), f"catenary tolerance {case}"):
        kept = KeptRows(out, force)
        with workers(n_jobs) as pool:
            found = study.find_tolerances(plan, pool, kept, console.say)
        files = output.write(out, plan, found)
        kept.forget()
    console.say("\n" + output.as_text(plan, found) + "\n\n" + "\n".join(map(str, files)))
    return console.DONE

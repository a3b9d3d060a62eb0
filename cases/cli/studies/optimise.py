"""The verbs ``optimise`` and ``tolerance``: studies over sets of scenes, by a task in a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from catenary.cases.cli.app import (
    Assignments,
    Case,
    Force,
    Jobs,
    Out,
    SceneWords,
    serial_verb,
    tell,
)
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console


@dataclass
class TaskWords:
    """A case, the task of a study over a set of its scenes, and how that is made."""

    case: Case
    task_file: Annotated[
        Path, typer.Argument(metavar="FILE", help="TOML file with the task.", show_default=False)
    ]
    out: Out
    assignments: Assignments = None
    n_jobs: Jobs = 1
    force: Force = False

    def run(
        self,
        verb: str,
        table: str,
        task: type,
        make_plan: Callable[..., Any],
        find: Callable[..., Any],
        output: Any,
    ) -> int:
        """Plan the study, find what it looks for, and leave what its ``output`` writes.

        Serial. ``table`` is one of its files, ``task`` the model of the task.
        """
        from catenary.cases.studies.records import held_study
        from catenary.cases.studies.scene_sets import workers
        from catenary.cases.studies.task_files import read_task

        out, command = self.out, f"catenary {verb} {self.case}"
        refuse_table(out / table, self.force)
        draft, _ = SceneWords(self.case, assignments=self.assignments).draft()
        plan = make_plan(draft, read_task(self.task_file, task))
        for sentence in plan.warnings:
            console.warn(sentence)
        with (
            held_study(out, console.alone(), command, self.force) as (kept, write),
            workers(self.n_jobs) as pool,
        ):
            found = find(plan, pool, kept, console.say)
            files = write(lambda folder: output.write(folder, plan, found))
        tell(output.as_text(plan, found), files)
        return console.DONE


@serial_verb(
    "optimise",
    help="Choose numbers of a scene for the calmest contact force. Droppers, tensions, "
    "pantographs or any others are chosen for the smallest standard deviation of the contact "
    "force, or another statistic, over both directions, several speeds, trains and "
    "installation errors; the optimum is checked with a finer mesh, a shorter step and "
    "unseen errors. The same command continues one that was stopped.",
    epilog="Example: catenary optimise ac_simple droppers.toml -o results/optimum "
    "--set train.speed_km_h=320",
)
def optimise(words: TaskWords) -> int:
    """Serial."""
    from catenary.cases.studies.optimise import output
    from catenary.cases.studies.optimise.study import make_plan, optimise
    from catenary.cases.studies.optimise.task import OptimiseTask

    return words.run("optimise", output.RECORD, OptimiseTask, make_plan, optimise, output)


@serial_verb(
    "tolerance",
    help="Find the tolerances within which the criteria hold. Droppers, heights, tensions or any "
    "numbers of a scene may be off so far that each acceptance criterion holds with a "
    "probability of 99 %, by samples of errors, and in the worst case. The same command "
    "continues one that was stopped.",
    epilog="Example: catenary tolerance en50318_2002 installation.toml -o results/tolerance",
)
def tolerance(words: TaskWords) -> int:
    """Serial."""
    from catenary.cases.studies.tolerance import output
    from catenary.cases.studies.tolerance.study import find_tolerances, make_plan
    from catenary.cases.studies.tolerance.task import ToleranceTask

    return words.run("tolerance", output.TABLE, ToleranceTask, make_plan, find_tolerances, output)

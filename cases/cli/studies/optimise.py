"""The verbs ``optimise`` and ``tolerance``: studies over sets of scenes, by a task in a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.cases.cli.app import (
    Force,
    Jobs,
    Out,
    SceneWords,
    print_findings,
    serial_verb,
)
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from collections.abc import Callable

    from catenary.cases.scene.load import Draft
    from catenary.optimising import Made


@dataclass(kw_only=True)
class TaskWords(SceneWords):
    """A case, the task of a study over a set of its scenes, and how that is made."""

    task_file: Annotated[
        Path, typer.Argument(metavar="FILE", help="TOML file with the task.", show_default=False)
    ]
    out: Out
    n_jobs: Jobs = 1
    force: Force = False

    def make(self, verb: str, study: Callable[..., Made]) -> int:
        """Make the study and print what it found. Serial."""

        from catenary.cases.scene.load import read_draft

        def read() -> tuple[Draft, Path]:
            return read_draft(self.case, self.changes, self.shortened), self.task_file

        made = study(
            read,
            self.out,
            command=f"catenary {verb} {self.case}",
            jobs=self.n_jobs,
            force=self.force,
            warn=console.warn,
            say=console.say,
        )
        print_findings(made.text, made.files)
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
    from catenary.optimising import optima

    return words.make("optimise", optima)


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
    from catenary.optimising import tolerances

    return words.make("tolerance", tolerances)

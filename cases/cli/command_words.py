"""Words of a command line: arguments and options that verbs share, and what a shell completes.

A shell completes names of shipped cases, keys after ``--set`` and words that a key takes. That is
called at every press of the tabulator key: nothing here imports more than a list does, and an error
only means that nothing is completed.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

import catenary
from catenary.base.errors import InputError
from catenary.cases.cli.app import begin
from catenary.cases.result_folder.output_folder import refuse_no_folder, run_folder
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from catenary.cases.scene.load import Draft
    from catenary.cases.scene.scene import Scene
    from catenary.cases.studies.sweep.jobs import RunOptions
    from catenary.cases.studies.sweep.variants import Variant
    from catenary.postproc.read.validation import Records

T = TypeVar("T")


def cases(incomplete: str) -> list[tuple[str, str]]:
    """Names of shipped cases with their titles; shells complete paths themselves."""
    from catenary.cases.scene.input.case_files import titles

    return [(name, title) for name, title in titles().items() if name.startswith(incomplete)]


def beginnings(incomplete: str) -> list[tuple[str, str]]:
    """Kinds of line that a new case may begin with."""
    from catenary.cases.scene.starter import BEGINNINGS

    return [(name, one.meaning) for name, one in BEGINNINGS.items() if name.startswith(incomplete)]


def assignments(incomplete: str) -> list[tuple[str, str]]:
    """``key=`` for all keys that fit, or ``key=word`` once the key is whole.

    Keys below what a scene names itself, such as its kinds of pantograph, are left out.
    """
    from catenary.cases.scene.keys.keys import ANY
    from catenary.cases.terminal.lists import keys_of_a_scene, words_of

    name, equals, begun = incomplete.partition("=")
    every = [key for key in keys_of_a_scene() if ANY not in key.name.split(".")]
    if not equals:
        return [(f"{key.name}=", key.meaning) for key in every if key.name.startswith(name)]
    chosen = next((key for key in every if key.name == name), None)
    words = [] if chosen is None else words_of(chosen)
    return [(f"{name}={word}", "") for word in words if word.startswith(begun)]


def keys(incomplete: str) -> list[tuple[str, str]]:
    """All keys of a scene, for the filter of ``list --keys``."""
    from catenary.cases.terminal.lists import keys_of_a_scene

    return [(key.name, key.meaning) for key in keys_of_a_scene() if key.name.startswith(incomplete)]


def axes(incomplete: str) -> list[tuple[str, str]]:
    """Axes of ``accuracy``, the last one of a list with commas."""
    from catenary.cases.studies.accuracy.axes import AXES

    before, comma, begun = incomplete.rpartition(",")
    taken = before.split(",")
    return [
        (f"{before}{comma}{name}", axis.title)
        for name, axis in AXES.items()
        if name.startswith(begun) and name not in taken
    ]


RunFolder = Annotated[
    Path,
    typer.Argument(parser=run_folder, metavar="FOLDER", help="Folder of a run, or its run.h5."),
]
_folder = typer.Option("-o", "--out", parser=console.folder, metavar="<path>")
_folder.help = "Folder for the results."
Out = Annotated[Path, _folder]
OutIfAny = Annotated[Path | None, _folder]
Force = Annotated[bool, typer.Option("--force", help="Overwrite existing results.")]
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with 3 if an acceptance criterion fails.")
]
Jobs = Annotated[
    int,
    typer.Option(
        "-j",
        "--jobs",
        metavar="N",
        min=0,
        max=10**4,
        help="Runs at the same time, each in a process of its own; 0: one on each core. Under "
        "mpirun the number of ranks: a run on each.",
    ),
]
PartOfRuns = Annotated[
    str | None,
    typer.Option(
        "--part",
        metavar="I/N",
        help="Make every N-th run from the I-th on, and no table: a task of a job array.",
    ),
]
NoReport = Annotated[
    bool,
    typer.Option(
        "--no-report", help="Write results and summary.json alone; catenary report does the rest."
    ),
]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Print the time of each phase.")]


@dataclass
class SceneWords:
    """The scene of a verb: a case, and how it is changed.

    Parameters
    ----------
    case : Name of a shipped case, or a case.toml, or a folder with one.
    extras KEY=VALUE : Further assignments after --set.
    assignments KEY=VALUE : Replace a key of the scene, KEY= takes it away; repeatable.
    shortened : Apply the case's [test] table, which shortens it.
    """

    case: Annotated[str, typer.Argument(autocompletion=cases)]
    extras: Annotated[list[str] | None, typer.Argument(autocompletion=assignments)] = None
    assignments: Annotated[list[str] | None, typer.Option("--set", autocompletion=assignments)] = (
        None
    )
    shortened: Annotated[bool, "--short"] = False

    def split(self) -> tuple[list[str], list[str]]:
        """All assignments, and options for PETSc, which only verbs of ``RunWords`` take."""
        from catenary.cases.process.petsc_options import split_extras

        more, options = split_extras(self.extras or [])
        if options and not isinstance(self, RunWords):
            raise InputError(f"{options[0]} after -- is an option for PETSc; this verb takes none")
        return [*(self.assignments or []), *more], options

    @property
    def changes(self) -> list[str]:
        """All assignments."""
        return self.split()[0]

    @property
    def petsc(self) -> list[str]:
        """Options for PETSc."""
        return self.split()[1]

    def draft(self, *further: str) -> Draft:
        """The case with its assignments, and further ones, not checked. Not collective."""
        from catenary.cases.scene.load import read_draft

        return read_draft(self.case, [*self.changes, *further], self.shortened)

    def scene(self, *further: str) -> catenary.Scene:
        """The scene of that, as Python programs have it. Not collective."""
        return catenary.Scene(self.draft(*further))

    def load(self, *further: str) -> Scene:
        """The tables of that scene. Not collective."""
        from catenary.scenes import checked

        return checked(self.scene(*further))


@dataclass
class RunWords(SceneWords):
    """The scene of a verb that runs it, and options for PETSc.

    Parameters
    ----------
    extras KEY=VALUE -- PETSC_OPTION : Further assignments after --set, and after -- options for
        PETSc.
    """


@dataclass
class VariantWords:
    """Variants of a case.

    Parameters
    ----------
    vary KEY=V1,V2,... : Values that a key takes; all combinations are run. Repeatable, or further
        keys with several values follow directly; a word with a single value is an assignment.
    named : TOML file of named variants, each a line name = ["key=value", ...].
    """

    vary: Annotated[list[str] | None, typer.Option("--vary", autocompletion=assignments)] = None
    named: Annotated[Path | None, "--variants"] = None

    def __bool__(self) -> bool:
        """Whether any are given."""
        return bool(self.vary) or self.named is not None

    def read(self) -> list[Variant]:
        """The variants.

        Raises
        ------
        InputError
            If there are none, or if a key is none of a scene.
        """
        from catenary.cases.studies.sweep.variants import (
            VARY,
            check_keys,
            parse_vary,
            product,
            read_named,
        )

        if not self:
            raise InputError(
                "there is nothing to vary: give --vary key=v1,v2,..., --variants or --sample"
            )
        varied = [parse_vary(text) for text in self.vary or []]
        check_keys(product(varied, {}), VARY)
        table = {} if self.named is None else read_named(self.named)
        check_keys(product([], table), f"in {self.named}")
        return product(varied, table)


@dataclass
class StudyRuns:
    """Options for the runs of a study."""

    n_jobs: Jobs = 1
    force: Force = False
    verbose: Verbose = False

    def begin(
        self, read: Callable[[], T], scene_of: Callable[[T], Scene], petsc: Sequence[str] = ()
    ) -> tuple[Any, T, RunOptions]:
        """Communicator, what ``read`` gives, and options of the runs; see ``begin``. Collective."""
        comm, what, arguments = begin(read, scene_of, petsc, self.verbose)
        from catenary.cases.studies.sweep.jobs import RunOptions

        return comm, what, RunOptions(self.force, arguments, console.say, self.n_jobs)


def records_of(folder: Path) -> Records | None:
    """Content of the result file of a run's folder, None if a quick look is enough.

    Raises
    ------
    InputError
        If there is no such folder.
    """
    from catenary.postproc.read.guard import examined

    refuse_no_folder(folder)
    return examined(folder)


def names_in(text: str | None) -> list[str]:
    """The names of a list with commas, none without it."""
    return [] if text is None else [name.strip() for name in text.split(",")]

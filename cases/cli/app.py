"""The application of the command line, options that verbs share, and how a verb starts.

Backends are imported inside the verbs, so that --help stays quick.
"""

from __future__ import annotations

import dataclasses
import inspect
import os
import re
from copy import copy
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import typer
from typer.models import ArgumentInfo, ParameterInfo

import catenary
from catenary.base.errors import InputError
from catenary.base.options import Bounds
from catenary.base.parallel import (
    abort_on_unforeseen_error,
    launched_by_mpirun,
    on_root,
    set_up_logging,
)
from catenary.cases.cli import command_words
from catenary.cases.cli.command_words import Verb
from catenary.cases.result_folder.output_folder import refuse_no_folder, run_folder
from catenary.cases.terminal import console
from catenary.postproc.evaluate.wording import counted

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from catenary.cases.scene.load import Draft
    from catenary.cases.scene.scene import Scene
    from catenary.cases.studies.sweep.jobs import RunOptions
    from catenary.cases.studies.sweep.variants import Variant
    from catenary.postproc.read.validation import Records
    from catenary.postproc.report.study_table import Content

    Command = Callable[..., int | None]

T = TypeVar("T")
# A line of a docstring, ``name : help`` or ``name METAVAR : help``, with those that go on.
_PARAMETER = re.compile(r"^(\w+)(?: (?!:)(.+?))? : (.+(?:\n +.+)*)", re.MULTILINE)

app: typer.Typer = typer.Typer(
    name="catenary",
    help="Finite elements for railway overhead lines coupled with pantographs.",
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def narrowed(application: typer.Typer, words: Sequence[str]) -> typer.Typer:
    """The application with the verb alone with which ``words`` begin, if they begin with one.

    Typer makes the commands of all verbs before it calls one, which takes longer than quick verbs.
    """
    called = [one for one in application.registered_commands if one.name == next(iter(words), None)]
    if called:
        application = copy(application)
        application.registered_commands = called
    return application


def verb(name: str, *, serial: bool = False) -> Callable[[Command], Any]:
    """Adds a function as a verb, see ``console.guarded``; a serial one runs on rank 0 alone.

    Its docstring is the help: sentences, then an example, then for each parameter ``name : help``
    or ``name METAVAR : help``. A parameter with a default is an option of its name, one without an
    argument; ``Annotated`` has other flags as texts, ``Bounds``, or all that Typer knows. One that
    is a dataclass stands for its fields.
    """

    def added(function: Command) -> Any:
        paragraphs, about = _documented(function)
        about["quiet"] = None, "Print nothing but errors."
        groups: dict[str, tuple[Any, dict[str, str]]] = {}
        parameters = []
        for one in inspect.signature(function, eval_str=True).parameters.values():
            if not dataclasses.is_dataclass(one.annotation):
                parameters.append(_parameter(one.name, one.annotation, one.default, about))
                continue
            own = _fields_of(one.name, one.annotation)
            groups[one.name] = one.annotation, {field: own[field].name for field in own}
            parameters += own.values()
        quiet = Annotated[bool, typer.Option("-q", "--quiet")]
        parameters.append(_parameter("quiet", quiet, False, about))
        parameters.sort(key=_takes_the_rest)
        if about:
            raise ValueError(f"{name} has no parameter {', '.join(about)}")
        run = console.serial(function) if serial else function

        def gathered(**words: Any) -> int | None:
            for group, (make, fields) in groups.items():
                words[group] = make(**{field: words.pop(own) for field, own in fields.items()})
            return run(**words)

        command: Any = console.guarded(gathered)
        # The command line is made from signature and annotations.
        command.__signature__ = inspect.Signature(parameters)
        command.__annotations__ = {one.name: one.annotation for one in parameters}
        example = paragraphs.pop() if paragraphs[-1].startswith("Example: ") else None
        app.command(name, cls=Verb, help=" ".join(paragraphs), epilog=example)(command)
        return function

    return added


serial_verb = partial(verb, serial=True)


def _documented(own: Any) -> tuple[list[str], dict[str, tuple[str | None, str]]]:
    """Paragraphs of a docstring; metavar and help of its parameters by their names."""
    text, _, section = inspect.cleandoc(own.__doc__ or "").partition("\n\nParameters\n----------\n")
    about = {
        name: (metavar or None, " ".join(help.split()))
        for name, metavar, help in _PARAMETER.findall(section)
    }
    return [" ".join(paragraph.split()) for paragraph in text.split("\n\n")], about


def _parameter(
    name: str, hint: Any, default: Any, about: dict[str, tuple[str | None, str]]
) -> inspect.Parameter:
    """A parameter of a command, with its help out of ``about``, where that has more to say."""
    kind, *marks = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    flags = [mark for mark in marks if isinstance(mark, str)]
    least, most = next((mark for mark in marks if isinstance(mark, Bounds)), (None, None))
    if marks and isinstance(marks[0], ParameterInfo):
        mark: Any = copy(marks[0])
    elif default is inspect.Parameter.empty and not flags:
        mark = typer.Argument()
    elif default is True:  # of which Typer makes a pair: --state and --no-state
        mark = typer.Option()
    else:
        own = flags or ["--" + name.strip("_").replace("_", "-")]
        mark = typer.Option(*own, min=least, max=most)
    metavar, mark.help = about.pop(name, (None, mark.help))
    mark.metavar = metavar or mark.metavar
    hint = Annotated[kind, mark]  # type: ignore[valid-type]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _fields_of(name: str, group: Any) -> dict[str, inspect.Parameter]:
    """The fields of a dataclass as parameters, of other names where they state an option."""
    about: dict[str, tuple[str | None, str]] = {}
    for own in reversed(group.__mro__):
        about |= _documented(own)[1]
    found = {}
    for field, hint in get_type_hints(group, include_extras=True).items():
        default = getattr(group, field, inspect.Parameter.empty)
        found[field] = _parameter(field, hint, default, about)
        if isinstance(getattr(hint, "__metadata__", (None,))[0], str):
            found[field] = found[field].replace(name=f"{name}_{field}")
    return found


def _takes_the_rest(one: inspect.Parameter) -> bool:
    """Whether a parameter stands for all further arguments, so that it comes behind the others."""
    kind, mark = get_args(one.annotation)
    return isinstance(mark, ArgumentInfo) and any(
        get_origin(own) is list for own in (kind, *get_args(kind))
    )


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

    case: Annotated[str, typer.Argument(autocompletion=command_words.cases)]
    extras: Annotated[
        list[str] | None, typer.Argument(autocompletion=command_words.assignments)
    ] = None
    assignments: Annotated[
        list[str] | None, typer.Option("--set", autocompletion=command_words.assignments)
    ] = None
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

    vary: Annotated[
        list[str] | None, typer.Option("--vary", autocompletion=command_words.assignments)
    ] = None
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


def _version(wanted: bool) -> None:
    """Print all versions and end, with ``--version``."""
    if wanted:
        from catenary.cases.process.libraries import versions_text

        console.say(versions_text())
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_version,
            is_eager=True,
            help="Print the versions of Catenary, PETSc, MPI, HDF5 and packages.",
        ),
    ] = False,
) -> None:
    """Not collective."""


def lone_task(n_ranks: int) -> str:
    """The sentence for a process that SLURM started as one of several and MPI as a single one.

    "" for all others, and for tasks but the first, so that it is printed once. Not collective.

    Parameters
    ----------
    n_ranks : ranks that MPI sees
    """
    # A step of one task within a larger job is meant so.
    n_stated = os.environ.get("SLURM_STEP_NUM_TASKS") or os.environ.get("SLURM_NTASKS", "")
    n_tasks = int(n_stated) if n_stated.isascii() and n_stated.isdigit() else 1
    if n_ranks > 1 or n_tasks == 1 or os.environ.get("SLURM_PROCID", "0") != "0":
        return ""
    return (
        f"SLURM has {n_tasks} tasks here and MPI sees one rank: each task simulates the whole line "
        "by itself; start ranks with `srun --mpi=pmix`, or as `srun --mpi=list` and your site say, "
        "or with mpirun"
    )


def crowded(comm: Any) -> str:
    """The sentence for ranks that have fewer cores on the machine of rank 0 than they are.

    "" for all others. Collective.
    """
    if comm.size == 1 or not hasattr(os, "sched_getaffinity"):  # the latter: not Linux
        return ""
    from catenary.base.mpi import MPI

    here = comm.Split_type(MPI.COMM_TYPE_SHARED)
    n_ranks, n_cores = here.size, len(set().union(*here.allgather(os.sched_getaffinity(0))))
    here.Free()
    if n_ranks <= n_cores:
        return ""
    return (
        f"{n_ranks} ranks share {counted(n_cores, 'core')} of this machine: in every step each "
        "waits for the others' turns on a core, which takes many times as long as the step; start "
        "no more ranks than there are cores"
    )


def begin(
    read: Callable[[], T], scene_of: Callable[[T], Scene], petsc: Sequence[str], verbose: bool
) -> tuple[Any, T, list[str]]:
    """Communicator, what ``read`` gives on rank 0, the options with which PETSc now runs.

    Collective. These are those of the ``[petsc]`` table of a scene, then those of the command line.
    """
    from catenary.cases.process.petsc_options import (
        as_arguments,
        idle_options,
        refuse_unwritable,
        start_petsc,
    )

    is_alone = not launched_by_mpirun()
    if is_alone:  # it is refused before MPI has started
        what = read()
    comm = console.world()
    if lone := lone_task(comm.size):
        console.warn(lone)
    abort_on_unforeseen_error(comm)
    set_up_logging(comm, verbose, console.is_quiet())
    if not is_alone:
        what = on_root(comm, read, takes_long=True)
    table = scene_of(what).petsc.given()
    arguments = as_arguments(table, petsc)
    on_root(comm, lambda: refuse_unwritable(petsc))
    start_petsc(arguments)

    def warn() -> None:
        for sentence in idle_options(table) if comm.rank == 0 else ():
            console.warn(sentence)

    console.at_end(warn)
    return comm, what, arguments


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


def print_findings(text: str, files: Sequence[Path]) -> None:
    """Print what a study found, below its progress, and the files that it has written.

    Not collective.
    """
    console.say("\n" + text)
    if files:
        console.say("\n" + "\n".join(map(str, files)))


def leave(out: Path | None, text: str, content: Callable[[], Mapping[str, Content]]) -> None:
    """Print what a study found that shows no progress, and leave its files in a folder, if any.

    Not collective.
    """
    console.say(text)
    if out is not None:
        from catenary.postproc.report.study_table import write_files

        console.say("\n" + "\n".join(map(str, write_files(out, content()))))

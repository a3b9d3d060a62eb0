"""The application of the command line: how functions become its verbs, and how these start.

Backends are imported inside the verbs, so that --help stays quick.
"""

from __future__ import annotations

import dataclasses
import inspect
import os
import re
import sys
from copy import copy
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import typer
from typer.core import TyperCommand
from typer.models import ArgumentInfo, ParameterInfo

from catenary.base.options import Bounds
from catenary.base.parallel import (
    abort_on_unforeseen_error,
    launched_by_mpirun,
    on_root,
    set_up_logging,
)
from catenary.cases.terminal import console
from catenary.postproc.evaluate.wording import counted

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from catenary.cases.scene.scene import Scene
    from catenary.postproc.report.study_table import Content

    Command = Callable[..., int | None]

T = TypeVar("T")
# A line of a docstring, ``name : help`` or ``name METAVAR : help``, with those that go on.
_PARAMETER = re.compile(r"^(\w+)(?: (?!:)(.+?))? : (.+(?:\n +.+)*)", re.MULTILINE)

VARY = "--vary"
# Options of PETSc, whose first letter would be taken for an option of the verb, the rest for its
# value: -options_view for -o.
_OF_PETSC = re.compile(r"-(?!o)[a-z]+(_[a-z]+)+|-(options|on_error)_[a-z]+")

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
    name = next(iter(words), None)
    called = [command for command in application.registered_commands if command.name == name]
    if called:
        application = copy(application)
        application.registered_commands = called
    return application


class Verb(TyperCommand):
    """A verb; if it has ``--vary``, words directly after that one's value may be varied, too."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Take the words of a command line apart. Not collective."""
        for word in args[: args.index("--")] if "--" in args else args:
            if _OF_PETSC.fullmatch(word):
                ctx.fail(f"{word} is no option of {self.name}: those of PETSc stand after --")
            if word.partition("=")[0] == "--set" and self._is_of_a_run():
                ctx.fail(
                    "the keys of a run stay as it recorded them: --set belongs to `catenary run`, "
                    "with another folder for the new results"
                )
        if any(VARY in one.opts for one in self.params):
            args = each_varied(args)
        return super().parse_args(ctx, args)

    def _is_of_a_run(self) -> bool:
        """Whether the verb takes the folder of a run in place of a case."""
        return any(one.metavar == "FOLDER" for one in self.params)  # type: ignore[attr-defined]


def each_varied(words: Sequence[str]) -> list[str]:
    """The words of a command line with ``--vary`` before each key that takes several values.

    Words belong to the option that stands before them. Of those of ``--vary`` a word with a single
    value stays a further assignment, as without ``--vary`` before it.
    """
    found: list[str] = []
    is_value = follows = False
    for number, word in enumerate(words):
        if is_value:  # of --vary, whatever it is
            is_value, follows = False, True
        elif word == "--":  # behind it stand options for PETSc
            return [*found, *words[number:]]
        elif word.startswith("-"):
            is_value, follows = word == VARY, word.startswith(f"{VARY}=")
        elif follows and _has_several_values(word):
            found.append(VARY)
        found.append(word)
    return found


def _has_several_values(word: str) -> bool:
    if "=" not in word or "," not in word:
        return False
    from catenary.cases.studies.sweep.variants import split_values

    return len(split_values(word.partition("=")[2])) > 1


def verb(name: str, *, serial: bool = False) -> Callable[[Command], Any]:
    """Adds a function as a verb, see ``console.guarded``; a serial one runs on rank 0 alone.

    Its docstring is the help: sentences, then an example, then for each parameter, none left out,
    ``name : help`` or ``name METAVAR : help``. A parameter with a default is an option of its
    name, one without an argument; ``Annotated`` has other flags as texts, ``Bounds``, or all that
    Typer knows. One that is a dataclass stands for its fields.
    """

    def added(function: Command) -> Any:
        paragraphs, about = _documented(function)
        about["quiet"] = None, "Print nothing but errors."
        groups: dict[str, tuple[Any, dict[str, str]]] = {}
        parameters = []
        for given in inspect.signature(function, eval_str=True).parameters.values():
            if not dataclasses.is_dataclass(given.annotation):
                parameters.append(_parameter(given.name, given.annotation, given.default, about))
                continue
            fields = _fields_of(given.name, given.annotation)
            names = {field: parameter.name for field, parameter in fields.items()}
            groups[given.name] = given.annotation, names
            parameters += fields.values()
        quiet = Annotated[bool, typer.Option("-q", "--quiet")]
        parameters.append(_parameter("quiet", quiet, False, about))
        parameters.sort(key=_takes_the_rest)
        if about:
            raise ValueError(f"{name} has no parameter {', '.join(about)}")
        unexplained = [one.name for one in parameters if not get_args(one.annotation)[1].help]
        if unexplained and sys.flags.optimize < 2:  # above that there are no docstrings
            raise ValueError(f"{name} has no help for {', '.join(unexplained)}")
        run = console.serial(function) if serial else function

        def with_groups(**words: Any) -> int | None:
            for group, (make, names) in groups.items():
                words[group] = make(**{field: words.pop(named) for field, named in names.items()})
            return run(**words)

        command: Any = console.guarded(with_groups)
        # The command line is made from signature and annotations.
        command.__signature__ = inspect.Signature(parameters)
        command.__annotations__ = {one.name: one.annotation for one in parameters}
        example = paragraphs.pop() if paragraphs[-1].startswith("Example: ") else None
        app.command(name, cls=Verb, help=" ".join(paragraphs), epilog=example)(command)
        return function

    return added


serial_verb = partial(verb, serial=True)


def _documented(what: Any) -> tuple[list[str], dict[str, tuple[str | None, str]]]:
    """Paragraphs of a docstring; metavar and help of its parameters by their names."""
    whole = inspect.cleandoc(what.__doc__ or "")
    text, _, section = whole.partition("\n\nParameters\n----------\n")
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
        flags = flags or ["--" + name.strip("_").replace("_", "-")]
        mark = typer.Option(*flags, min=least, max=most)
    metavar, mark.help = about.pop(name, (None, mark.help))
    mark.metavar = metavar or mark.metavar
    hint = Annotated[kind, mark]  # type: ignore[valid-type]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _fields_of(name: str, group: Any) -> dict[str, inspect.Parameter]:
    """The fields of a dataclass as parameters, of other names where they state an option."""
    about: dict[str, tuple[str | None, str]] = {}
    for base in reversed(group.__mro__):
        about |= _documented(base)[1]
    found = {}
    for field, hint in get_type_hints(group, include_extras=True).items():
        default = getattr(group, field, inspect.Parameter.empty)
        found[field] = _parameter(field, hint, default, about)
        if isinstance(getattr(hint, "__metadata__", (None,))[0], str):
            found[field] = found[field].replace(name=f"{name}_{field}")
    if about:
        raise ValueError(f"{group.__name__} has no field {', '.join(about)}")
    return found


def _takes_the_rest(one: inspect.Parameter) -> bool:
    """Whether a parameter stands for all further arguments, so that it comes behind the others."""
    kind, mark = get_args(one.annotation)
    return isinstance(mark, ArgumentInfo) and any(
        get_origin(part) is list for part in (kind, *get_args(kind))
    )


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

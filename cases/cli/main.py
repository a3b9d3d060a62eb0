"""The command line ``catenary``. Backends are imported inside the commands: --help stays quick."""

from __future__ import annotations

import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from catenary.cases.process import interrupts, matplotlib_folder, memory_limit
from catenary.cases.result_folder.output_folder import refuse_impossible
from catenary.cases.terminal import completion, console
from catenary.postproc.report.wording import counted
from catenary.solver.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from catenary.cases.run.runner import RunOutcome
    from catenary.cases.scene.scene import Scene

T = TypeVar("T")

app: typer.Typer = typer.Typer(
    name="catenary",
    help="Finite elements for railway overhead lines coupled with pantographs.",
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

RunFolder = Annotated[
    Path,
    typer.Argument(
        parser=console.run_folder, metavar="FOLDER", help="Folder of a run, or its run.h5."
    ),
]
Case = Annotated[
    str,
    typer.Argument(
        help="Name of a shipped case, or a case.toml, or a folder with one.",
        autocompletion=completion.cases,
    ),
]
Assignments = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Replace a key of the scene, KEY= takes it away; repeatable.",
        autocompletion=completion.assignments,
    ),
]
Out = Annotated[
    Path,
    typer.Option(
        "-o", "--out", parser=console.folder, metavar="<path>", help="Folder for the results."
    ),
]
MoreAssignments = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="KEY=VALUE",
        help="Further assignments after --set.",
        autocompletion=completion.assignments,
    ),
]
Shortened = Annotated[
    bool, typer.Option("--short", help="Apply the case's [test] table, which shortens it.")
]
Force = Annotated[bool, typer.Option("--force", help="Replace what is there.")]


def load(
    case: str, assignments: list[str] | None, extras: list[str] | None, shortened: bool = False
) -> Scene:
    """The scene of a verb that takes no options for PETSc. Not collective."""
    from catenary.cases.process.petsc_options import split_extras
    from catenary.cases.scene.scene import load_scene

    more, options = split_extras(extras or [])
    if options:
        raise InputError(f"{options[0]} after -- is a PETSc option; only run takes those")
    return load_scene(case, [*(assignments or []), *more], shortened)


PetscOptions = Annotated[
    list[str] | None,
    typer.Argument(metavar="-- PETSC_OPTION", help="Options for PETSc, after --."),
]
MoreAndPetscOptions = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="KEY=VALUE -- PETSC_OPTION",
        help="Further assignments after --set, and after -- options for PETSc.",
        autocompletion=completion.assignments,
    ),
]
Strict = Annotated[
    bool, typer.Option("--strict", help="Exit with 3 if an acceptance criterion fails.")
]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say more.")]


def _version(wanted: bool) -> None:
    """Print all versions and end, if that is wanted."""
    if wanted:
        from catenary.cases.process.versions import versions_text

        if console.speaks():
            typer.echo(versions_text())
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            callback=_version,
            is_eager=True,
            help="Versions of Catenary, PETSc, MPI, HDF5, Numba and others.",
        ),
    ] = False,
) -> None:
    """Not collective."""


@app.command(
    "run",
    help="Simulate a case and write its results into a folder.",
    epilog="Example: catenary run en50318_2002 -o results/en300 --set train.speed_km_h=300 "
    "-- -log_view; catenary run ambrosio2012 --study -o results/study",
)
@console.guarded
def run(
    case: Case,
    out: Out,
    extras: MoreAndPetscOptions = None,
    assignments: Assignments = None,
    shortened: Shortened = False,
    force: Force = False,
    strict: Strict = False,
    study: Annotated[
        bool, typer.Option("--study", help="Run the case's study: variants, figures, verdicts.")
    ] = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""
    from catenary.cases.process.petsc_options import split_extras
    from catenary.cases.scene.scene import load_scene

    if study:
        if strict:
            raise InputError("a study is not judged as a whole: give --study without --strict")
        words = (extras or [], assignments or [])
        return sweep.run_study(case, out, *words, shortened, force, verbose)

    def read() -> tuple[Scene, list[str]]:
        more, options = split_extras(extras or [])
        refuse_impossible(out)
        return load_scene(case, [*(assignments or []), *more], shortened), options

    comm, scene, arguments = begin(read, verbose, lambda scene: scene)
    from catenary.cases.run.describe_arrivals import arrival_warnings
    from catenary.cases.run.runner import run_case

    for text in arrival_warnings(scene):
        console.warn(text)
    tell = _teller(out)
    result = run_case(scene, out, comm, force=force, petsc_options=arguments, tell=tell)
    return _end(result, out, strict)


@app.command(
    "restart",
    help="Continue an interrupted or broken run from the last state in its result file.",
    epilog="Example: catenary restart results/en300",
)
@console.guarded
def restart(
    folder: RunFolder,
    extras: PetscOptions = None,
    strict: Strict = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""
    from catenary.cases.process.petsc_options import split_extras
    from catenary.cases.scene.error_sentences import Origin
    from catenary.cases.scene.scene import scene_from

    def read() -> tuple[Scene, list[str]]:
        from catenary.postproc.read.guard import examined
        from catenary.postproc.read.results import Results

        more, options = split_extras(extras or [])
        if more:
            raise InputError(f"{more[0]} cannot be changed when a run is continued")
        refuse_impossible(folder)
        if not folder.is_dir():
            raise InputError(f"{folder} is no folder; name the folder of a run")
        with Results(folder, examined(folder)) as results:
            config = results.attributes["config"]
        return scene_from(config, Origin(str(results.path))), options

    comm, scene, arguments = begin(read, verbose, lambda scene: scene)
    from catenary.cases.run.runner import restart_case

    result = restart_case(scene, folder, comm, petsc_options=arguments, tell=_teller(folder))
    return _end(result, folder, strict)


def begin(
    read: Callable[[], tuple[T, list[str]]], verbose: bool, scene_of: Callable[[T], Scene]
) -> tuple[Any, T, list[str]]:
    """Communicator, what ``read`` gives on rank 0, the options with which PETSc now runs.

    Collective. ``read`` also gives the command line's options for PETSc, ``scene_of`` the scene
    whose ``[petsc]`` table stands before them.
    """
    from catenary.cases.process.petsc_options import as_arguments, start_petsc
    from catenary.solver.base.parallel import (
        abort_on_unforeseen_error,
        launched_by_mpirun,
        on_root,
        set_up_logging,
    )

    # A process of its own is refused before MPI has started.
    read_before = None if launched_by_mpirun() else read()
    comm = console.world()
    abort_on_unforeseen_error(comm)
    set_up_logging(comm, verbose, console.is_quiet())
    what, options = read_before or on_root(comm, read)
    arguments = as_arguments(scene_of(what).petsc.given(), options)
    start_petsc(arguments)
    return comm, what, arguments


def _teller(folder: Path) -> Callable[[str], None]:
    """What says how a run ended unless it is done. Not collective."""

    def tell(outcome: str) -> None:
        if outcome == "interrupted":
            outcome = f"the run was interrupted; `catenary restart {folder}` continues it"
        if outcome != "done":
            console.complain(outcome)

    return tell


def _end(result: RunOutcome, folder: Path, strict: bool) -> int:
    """Print the summary of a run that is done and return the exit code. Not collective."""
    from catenary.cases.terminal import terminal_text

    if result.outcome != "done":
        return console.BROKEN
    console.say(terminal_text.summary_text(result.summary, folder))
    return console.NOT_ACCEPTED if strict and result.accepted is False else console.DONE


@app.command(
    "plan",
    help="Print what a case simulates and what not, and what it will cost.",
    epilog="Example: catenary plan ac_simple --set train.speed_km_h=320",
)
@console.guarded
@console.serial
def plan(
    case: Case,
    extras: MoreAssignments = None,
    assignments: Assignments = None,
    shortened: Shortened = False,
) -> None:
    """Serial."""
    scene = load(case, assignments, extras, shortened)
    from catenary.cases.run.plan import make_plan, plan_text

    console.say(plan_text(make_plan(scene)))


@app.command(
    "check",
    help="Check a case: keys, bounds, geometry, effects, mesh, pantographs, and that no dropper is "
    "slack at rest. Writes nothing.",
    epilog="Example: catenary check my_line/case.toml --set line.dropper.pre_sag_mid_mm=60",
)
@console.guarded
@console.serial
def check(
    case: Case,
    extras: MoreAssignments = None,
    assignments: Assignments = None,
    shortened: Shortened = False,
) -> int:
    """Serial."""
    from catenary.cases.scene.faults import SceneError

    try:
        scene = load(case, assignments, extras, shortened)
    except SceneError as error:
        for line in error.lines():
            console.complain(line)
        return console.BAD_INPUT
    # What a refusal does not need is imported once the scene is sound.
    from catenary.cases.run.describe_arrivals import arrival_facts
    from catenary.cases.run.describe_pantographs import kind_lines
    from catenary.cases.run.scene_mesh import mesh_of
    from catenary.solver.statics.equilibrium import find_form

    problem = scene.to_problem()
    mesh = mesh_of(scene)
    find_form(problem, mesh)
    console.say(
        f"{scene.case.name} is sound: {counted(problem.line.n_spans, 'span')}, "
        f"{problem.line.support_positions[-1]:g} m, {counted(mesh.droppers.shape[0], 'dropper')}, "
        f"{mesh.n_nodes} nodes"
    )
    for name, lines in kind_lines(scene, problem).items():
        console.say(f"pantograph {name}, " + "\n  ".join(lines))
    waves = arrival_facts(scene, problem)
    for fact in waves["pantographs"]:
        console.say(fact["says"])
    for text in waves["warnings"]:
        console.warn(text)
    return console.DONE


@app.command(
    "mesh",
    help="Write the mesh of a case as a Gmsh file.",
    epilog="Example: catenary mesh ac_simple -o ac_simple.msh --set mesh.elements_per_gap=6",
)
@console.guarded
@console.serial
def mesh(
    case: Case,
    out: Annotated[Path, typer.Option("-o", "--out", help="Mesh file to write, *.msh.")],
    extras: MoreAssignments = None,
    assignments: Assignments = None,
    force: Force = False,
) -> None:
    """Serial."""
    scene = load(case, assignments, extras)
    from catenary.cases.run.scene_mesh import write_mesh_of

    made = write_mesh_of(scene, out, force)
    console.say(f"{out}: {made.n_nodes} nodes, {counted(made.droppers.shape[0], 'dropper')}")


@app.command(
    "static",
    help="Print the dropper table, the sag and the elasticity of a case at rest.",
    epilog="Example: catenary static ac_simple -o droppers.csv",
)
@console.guarded
@console.serial
def static(
    case: Case,
    extras: MoreAssignments = None,
    assignments: Assignments = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            help="Also write a file: *.csv holds the dropper table, *.json everything.",
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Serial."""
    from catenary.cases.result_folder.output_files import new_file, write_static
    from catenary.cases.terminal import terminal_text

    if out is not None:
        new_file(out, (".csv", ".json"), force)
    scene = load(case, assignments, extras)
    from catenary.cases.run.runner import static_table

    table = static_table(scene)
    if out is not None:
        write_static(out, table)
    console.say(terminal_text.static_text(table, scene.to_line()))


@app.command(
    "report",
    help="Write the report of a run again, from its result file alone.",
    epilog="Example: catenary report results/en300",
)
@console.guarded
@console.serial
def report(
    folder: RunFolder,
) -> None:
    """Serial."""
    from catenary.postproc.read.guard import examined
    from catenary.postproc.report.report import write_report

    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; name the folder of a run")
    written = write_report(folder, folder, examined(folder))
    console.say("\n".join(str(path) for path in written.files))


@app.command(
    "compare",
    help="Print two runs' figures side by side.",
    epilog="Example: catenary compare results/coarse results/fine",
)
@console.guarded
@console.serial
def compare(
    first: Annotated[Path, typer.Argument(help="Folder of a run.")],
    second: Annotated[Path, typer.Argument(help="Folder of another run.")],
) -> None:
    """Serial."""
    from catenary.postproc.evaluate.compare import compare as compare_runs
    from catenary.postproc.read.guard import examined

    found = examined(first), examined(second)
    console.say(compare_runs(first, second, found).rstrip())


# The verbs of other files, which take what is above.
from catenary.cases.cli import (
    accuracy,  # noqa: E402
    hard,  # noqa: E402
    lists,  # noqa: E402, F401
    stability,  # noqa: E402
    sweep,  # noqa: E402
)
from catenary.cases.cli import pantograph as cli_pantograph  # noqa: E402


def _complain_of_usage(error: Any) -> None:
    """A mistake in the options in one sentence; for a command without any word its help."""
    context = getattr(error, "ctx", None)
    if type(error).__name__ == "NoArgsIsHelpError":
        if console.speaks():
            error.show()
        return
    said = error.format_message().rstrip(".")
    command = context.command_path if context is not None else "catenary"
    console.complain(f"{said}; see `{command} --help`")


def main() -> None:
    """Entry point. Exit codes: 0 done, 1 the run broke, 2 bad input, 3 not accepted (--strict)."""
    from catenary.solver.base.parallel import launched_by_mpirun

    # One thread a process unless the user says otherwise, before a library reads it: matrices are
    # small here, and MPI is what runs in parallel.
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # A crash ends the process: Open MPI's handler, which prints a trace, may wait for ever.
    os.environ.setdefault("OMPI_MCA_opal_signal", "")
    logging.getLogger("catenary").addHandler(console.LogHandler())
    interrupts.install(several_ranks=launched_by_mpirun())
    matplotlib_folder.settle()
    if too_little := memory_limit.complaint():
        console.complain(too_little)
        sys.exit(console.BAD_INPUT)
    if launched_by_mpirun():
        # From here on the end of each rank waits for the others', so that a sentence of rank 0
        # is out before the launcher sees the exit code of another.
        console.world()
    command: Any = typer.main.get_command(app)
    try:
        code = command(prog_name="catenary", standalone_mode=False)
    except interrupts.Stopped as stopped:
        console.complain(f"interrupted by {stopped.name}")
        sys.stdout.flush()
        sys.stderr.flush()
        # What was in the making holds objects of PETSc, which is not to free them half made.
        os._exit(console.BROKEN)
    except typer.Abort:
        code = console.BROKEN
    except Exception as error:
        if not hasattr(error, "format_message") or not hasattr(error, "exit_code"):
            raise
        _complain_of_usage(error)
        code = console.BAD_INPUT
    sys.exit(code if isinstance(code, int) else console.DONE)

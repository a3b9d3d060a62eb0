"""The verbs ``run``, ``restart`` and ``submit``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError, RunBroken
from catenary.cases.cli.app import (
    NamedVariants,
    NoReport,
    Out,
    PartOfRuns,
    PetscOptions,
    RunFolder,
    RunWords,
    Strict,
    StudyRuns,
    Vary,
    Verbose,
    begin,
    crowded,
    serial_verb,
    verb,
)
from catenary.cases.result_folder.output_folder import refuse_impossible
from catenary.cases.terminal import console
from catenary.postproc.evaluate.wording import duration
from catenary.postproc.files.own_files import RUN_FILE

if TYPE_CHECKING:
    import catenary
    from catenary.cases.run.cluster import SlurmJob
    from catenary.cases.scene.scene import Scene


@verb(
    "run",
    help="Simulate a case and write its results into a folder.",
    epilog="Example: catenary run en50318_2002 -o results/en300 --set train.speed_km_h=300 "
    "-- -log_view; catenary run ambrosio2012 --study -o results/study",
)
def run(
    words: RunWords,
    out: Out,
    strict: Strict = False,
    no_report: NoReport = False,
    study: Annotated[
        bool, typer.Option("--study", help="Run the case's study: variants, figures, verdicts.")
    ] = False,
    part: PartOfRuns = None,
    *,
    runs: StudyRuns,
) -> int:
    """Collective."""
    from catenary.cases.scene.load import load_scene

    if study:
        from catenary.cases.cli.studies.variants import run_study

        if strict:
            raise InputError("a study is not judged as a whole: give --study without --strict")
        if no_report:
            raise InputError("a study has a page of its own: give --study without --no-report")
        return run_study(words, out, runs, part)
    if runs.n_jobs != 1 or part is not None:
        raise InputError("-j and --part belong to --study; mpirun shares a single run among ranks")

    def read() -> tuple[Scene, list[str]]:
        changes, options = words.split()
        refuse_impossible(out)
        return load_scene(words.case, changes, words.shortened), options

    comm, scene, arguments = begin(read, runs.verbose, lambda scene: scene)
    from catenary.cases.run.arrivals import arrival_warnings
    from catenary.runs import run_into
    from catenary.solver.problem.problem import OFF

    crowd = crowded(comm)

    def warn() -> None:
        if crowd and scene.window.mode == OFF:  # else one rank computes, and says so
            console.warn(crowd)
        for text in arrival_warnings(scene):
            console.warn(text)

    made = run_into(
        out,
        scene,
        comm,
        arguments,
        force=runs.force,
        only_summary=no_report,
        on_closed=_outcome_printer(out),
        ready=warn,
    )
    return _end(made, strict)


@verb(
    "restart",
    help="Continue an interrupted run, or prolong a finished one. It goes on from the last state "
    "in the result file of a run that was interrupted, broke or is done.",
    epilog="Example: catenary restart results/en300; catenary restart results/en300 --until-m 900 "
    "--evaluate 600:840",
)
def restart(
    folder: RunFolder,
    extras: PetscOptions = None,
    until_m: Annotated[
        float | None,
        typer.Option("--until-m", help="Go on until the leading pantograph is there."),
    ] = None,
    evaluate: Annotated[
        str | None,
        typer.Option(metavar="FROM:TO", help="With --until-m: the stretch to evaluate [m]."),
    ] = None,
    strict: Strict = False,
    no_report: NoReport = False,
    force: Annotated[
        bool, typer.Option("--force", help="Continue even without room for all results.")
    ] = False,
    verbose: Verbose = False,
) -> int:
    """Collective."""
    from catenary.cases.process.petsc_options import split_extras

    def read() -> tuple[Scene, list[str]]:
        from catenary.runs import scene_to_continue

        more, options = split_extras(extras or [])
        if more:
            raise InputError(f"{more[0]} cannot be changed when a run is continued")
        return scene_to_continue(folder, until_m, evaluate), options

    comm, scene, arguments = begin(read, verbose, lambda scene: scene)
    from catenary.runs import go_on
    from catenary.solver.problem.problem import OFF

    if (crowd := crowded(comm)) and scene.window.mode == OFF:
        console.warn(crowd)
    made = go_on(
        folder,
        scene,
        comm,
        arguments,
        force=force,
        extends=until_m is not None,
        only_summary=no_report,
        on_closed=_outcome_printer(folder),
    )
    return _end(made, strict)


def _outcome_printer(folder: Path) -> Callable[[str], None]:
    """Prints how a run ended unless it is done. Not collective."""

    def print_outcome(outcome: str) -> None:
        if outcome == "interrupted":
            outcome = (
                f"the run was interrupted; `catenary restart {quote(str(folder))}` continues it"
            )
        if outcome != "done":
            console.complain(outcome)

    return print_outcome


def _end(made: catenary.Run, strict: bool) -> int:
    """Print the summary of a run that is done and return the exit code. Not collective."""
    from catenary.cases.terminal import terminal_text

    if made.outcome != "done":
        return console.BROKEN
    assert made.folder is not None
    text = terminal_text.summary_text(made.summary, made.folder, made.phase_wall, console.waited())
    console.say(text)
    return console.NOT_ACCEPTED if strict and made.passed is False else console.DONE


@serial_verb(
    "submit",
    help="Hand a run to SLURM, with time and memory from the plan. Jobs that wait continue it "
    "where a limit of time or a lost node ends one. With --array a sweep or study: a job "
    "array whose tasks make the runs, and a job that makes the table.",
    epilog="Example: catenary submit en50318_2002 -o results/en300 --ranks 4 --print > job.sh; "
    "catenary submit en50318_2002 -o results/speeds --array 10 --vary train.speed_km_h=200,250,300",
)
def submit(
    words: RunWords,
    out: Out,
    ranks: Annotated[
        int,
        typer.Option(
            "--ranks",
            min=1,
            max=10**6,
            help="MPI ranks; with --array those of each task, one run on each.",
        ),
    ] = 1,
    nodes: Annotated[
        int, typer.Option("--nodes", min=1, max=10**5, help="Number of cluster nodes.")
    ] = 1,
    minutes: Annotated[
        int | None,
        typer.Option(
            "--minutes", min=5, max=10**5, help="Limit of a job; from the plan if absent."
        ),
    ] = None,
    chain: Annotated[
        int,
        typer.Option(
            "--chain",
            min=0,
            max=1000,
            help="Jobs that may follow the first, or how often a task may be started again.",
        ),
    ] = 9,
    array: Annotated[
        int | None,
        typer.Option("--array", metavar="N", min=1, max=10**5, help="Tasks of a sweep or study."),
    ] = None,
    vary: Vary = None,
    named: NamedVariants = None,
    study: Annotated[
        bool, typer.Option("--study", help="With --array: the case's study, not a sweep.")
    ] = False,
    directives: Annotated[
        list[str] | None,
        typer.Option("--sbatch", metavar="OPTION", help="Option of sbatch; repeatable."),
    ] = None,
    before: Annotated[
        list[str] | None,
        typer.Option("--before", metavar="LINE", help="Line of shell before the run; repeatable."),
    ] = None,
    only_print: Annotated[
        bool, typer.Option("--print", help="Print the script and submit nothing.")
    ] = False,
) -> None:
    """Serial."""
    import shutil

    from catenary.cases.run.cluster import SlurmJob, slurm_script
    from catenary.cases.scene.input.case_files import find_case, shipped

    refuse_impossible(out)
    if array is None and (vary or named or study):
        raise InputError("--vary, --variants and --study belong to --array")
    chosen, options = words.split()
    # A folder in this place may have the name of a shipped case, as one for its results.
    own = words.case not in shipped()
    case_words = [str(find_case(words.case).absolute()) if own else words.case]
    case_words += ["--short"] if words.shortened else []
    # The folder comes last, so that nothing is taken for a further assignment.
    case_words += [word for value in chosen for word in ("--set", value)]
    job = SlurmJob(
        ranks, nodes, minutes, chain, directives or [], before or [], "B:" if array else ""
    )
    if array is None:
        from catenary.cases.run.continuing import refuse_other_scene
        from catenary.cases.scene.load import load_scene

        scene = load_scene(words.case, chosen, words.shortened)
        refuse_other_scene(out / RUN_FILE, scene)
        script = slurm_script(case_words, out, job, *_needs_on(scene, job), options)
    else:
        script = _array_script(words, case_words, out, job, array, vary, named, study)
    if only_print:
        console.print_as_is(script)
        return
    if shutil.which("sbatch") is None:
        raise InputError("sbatch is not on this machine; --print shows the script instead")
    if array is None:
        console.say(_sbatch(script))
        return
    number = _sbatch(script, "--parsable").partition(";")[0]
    try:
        last = _sbatch(script, "--parsable", "--array=0", f"--dependency=afterany:{number}")
    except InputError as error:
        verb = "run --study" if study else "sweep"
        raise RunBroken(
            f"job {number} with its {array} tasks is submitted, the job of the table is not: "
            f"{error}; once the tasks have ended, `catenary {verb}` with the same words and "
            f"-o {out} writes the table"
        ) from error
    console.say(f"job {number}: {array} tasks; job {last.partition(';')[0]}: the table, after them")


def _needs_on(scene: Scene, job: SlurmJob) -> tuple[float, float]:
    """Time of the march on the ranks of a job [s], and memory of its fullest node [B]."""
    from catenary.cases.run.cluster import march_on
    from catenary.cases.run.plan import make_plan
    from catenary.cases.scene.checks.mesh_size import MEMORY_OF_RANK_PER_UNKNOWN
    from catenary.cases.scene.scene import problem_of

    plan = make_plan(scene)
    n_unknowns = int(plan.figures["n_unknowns"])
    march = march_on(problem_of(scene), plan.needs, n_unknowns, job.ranks)
    if job.ranks > 1 and march >= plan.needs.march:
        console.warn(
            f"On {job.ranks} ranks the march takes about {duration(march)}, on one "
            f"{duration(plan.needs.march)}: take --ranks 1."
        )
    others = (job.a_node - 1) * MEMORY_OF_RANK_PER_UNKNOWN * n_unknowns
    return march, plan.needs.memory + others


def _array_script(
    words: RunWords,
    case_words: list[str],
    out: Path,
    job: SlurmJob,
    n_tasks: int,
    vary: list[str] | None,
    named: Path | None,
    study: bool,
) -> str:
    """The script of a sweep or study whose scenes are all checked."""
    from catenary.cases.cli.studies.variants import read_variants
    from catenary.cases.run.cluster import array_script
    from catenary.cases.run.needs import total_needs
    from catenary.cases.studies.case_study import make_plan
    from catenary.cases.studies.sweep.jobs import whole_runs_of
    from catenary.cases.studies.sweep.sweep import refuse_other_sweep

    chosen, options = words.split()
    if study:
        if vary or named:
            raise InputError("--study has runs of its own; leave --vary and --variants away")
        jobs = make_plan(words.case, chosen, words.shortened).jobs
        verb = ["run", *case_words, "--study"]
    else:
        variants = read_variants(vary, named)
        jobs = whole_runs_of(words.draft()[0], variants).jobs
        refuse_other_sweep(out, variants, force=False)
        verb = ["sweep", *case_words, *(word for text in vary or [] for word in ("--vary", text))]
        verb += [] if named is None else ["--variants", str(named.absolute())]
    needs = total_needs(each.scene for each in jobs)
    return array_script(verb, out, job, n_tasks, needs, options)


def _sbatch(script: str, *options: str) -> str:
    """The answer of sbatch to a script that it takes."""
    import subprocess

    done = subprocess.run(
        ["sbatch", *options], input=script, text=True, capture_output=True, check=False
    )
    if done.returncode:
        raise InputError(f"sbatch refused the job: {' '.join(done.stderr.split())}")
    return done.stdout.strip()

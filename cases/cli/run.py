"""The verbs ``run``, ``restart`` and ``submit``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError, RunBroken
from catenary.base.options import Bounds
from catenary.cases.cli.app import begin, crowded, serial_verb, verb
from catenary.cases.cli.command_words import (
    NoReport,
    Out,
    PartOfRuns,
    RunFolder,
    RunWords,
    Strict,
    StudyRuns,
    VariantWords,
    Verbose,
)
from catenary.cases.result_folder.output_folder import refuse_impossible
from catenary.cases.terminal import console
from catenary.postproc.evaluate.wording import duration
from catenary.postproc.files.own_files import RUN_FILE

if TYPE_CHECKING:
    import catenary
    from catenary.cases.run.cluster import SlurmJob
    from catenary.cases.scene.scene import Scene


@verb("run")
def run(
    words: RunWords,
    out: Out,
    strict: Strict = False,
    no_report: NoReport = False,
    study: bool = False,
    part: PartOfRuns = None,
    *,
    runs: StudyRuns,
) -> int:
    """Simulate a case and write its results into a folder.

    Example: catenary run en50318_2002 -o results/en300 --set train.speed_km_h=300 -- -log_view;
    catenary run ambrosio2012 --study -o results/study

    Parameters
    ----------
    study : Run the case's study: variants, figures, verdicts.
    """
    from catenary.cases.scene.load import load_scene

    if study:
        from catenary.cases.cli.variants import run_study

        if strict:
            raise InputError("a study is not judged as a whole: give --study without --strict")
        if no_report:
            raise InputError("a study has a page of its own: give --study without --no-report")
        return run_study(words, out, runs, part)
    if runs.n_jobs != 1 or part is not None:
        raise InputError("-j and --part belong to --study; mpirun shares a single run among ranks")

    def read() -> Scene:
        refuse_impossible(out)
        return load_scene(words.case, words.changes, words.shortened)

    comm, scene, arguments = begin(read, lambda scene: scene, words.petsc, runs.verbose)
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


@verb("restart")
def restart(
    folder: RunFolder,
    extras: Annotated[list[str] | None, typer.Argument()] = None,
    until_m: float | None = None,
    evaluate: str | None = None,
    strict: Strict = False,
    no_report: NoReport = False,
    force: bool = False,
    verbose: Verbose = False,
) -> int:
    """Continue an interrupted run, or prolong a finished one.

    It goes on from the last state in the result file of a run that was interrupted, broke or is
    done.

    Example: catenary restart results/en300; catenary restart results/en300 --until-m 900 --evaluate
    600:840

    Parameters
    ----------
    extras -- PETSC_OPTION : Options for PETSc, after --.
    until_m : Go on until the leading pantograph is there.
    evaluate FROM:TO : With --until-m: the stretch to evaluate [m].
    force : Continue even without room for all results.
    """
    from catenary.cases.process.petsc_options import split_extras
    from catenary.runs import run_into, scene_to_continue

    more, petsc = split_extras(extras or [])
    if more:
        raise InputError(f"{more[0]} cannot be changed when a run is continued")
    comm, scene, arguments = begin(
        lambda: scene_to_continue(folder, until_m, evaluate), lambda scene: scene, petsc, verbose
    )
    from catenary.solver.problem.problem import OFF

    if (crowd := crowded(comm)) and scene.window.mode == OFF:
        console.warn(crowd)
    made = run_into(
        folder,
        scene,
        comm,
        arguments,
        goes_on=True,
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


@serial_verb("submit")
def submit(
    words: RunWords,
    out: Out,
    ranks: Annotated[int, Bounds(1, 10**6)] = 1,
    nodes: Annotated[int, Bounds(1, 10**5)] = 1,
    minutes: Annotated[int | None, Bounds(5, 10**5)] = None,
    chain: Annotated[int, Bounds(0, 1000)] = 9,
    array: Annotated[int | None, Bounds(1, 10**5)] = None,
    *,
    varied: VariantWords,
    study: bool = False,
    sbatch: list[str] | None = None,
    before: list[str] | None = None,
    print_: bool = False,
) -> None:
    """Hand a run to SLURM, with time and memory from the plan.

    Jobs that wait continue it where a limit of time or a lost node ends one. With --array a sweep
    or study: a job array whose tasks make the runs, and a job that makes the table.

    Example: catenary submit en50318_2002 -o results/en300 --ranks 4 --print > job.sh; catenary
    submit en50318_2002 -o results/speeds --array 10 --vary train.speed_km_h=200,250,300

    Parameters
    ----------
    ranks : MPI ranks; with --array those of each task, one run on each.
    nodes : Number of cluster nodes.
    minutes : Limit of a job; from the plan if absent.
    chain : Jobs that may follow the first, or how often a task may be started again.
    array N : Tasks of a sweep or study.
    study : With --array: the case's study, not a sweep.
    sbatch OPTION : Option of sbatch; repeatable.
    before LINE : Line of shell before the run; repeatable.
    print_ : Print the script and submit nothing.
    """
    import shutil

    from catenary.cases.run.cluster import SlurmJob, slurm_script
    from catenary.cases.scene.input.case_files import find_case, shipped

    refuse_impossible(out)
    if array is None and (varied or study):
        raise InputError("--vary, --variants and --study belong to --array")
    chosen, options = words.split()
    # A folder in this place may have the name of a shipped case, as one for its results.
    own = words.case not in shipped()
    case_words = [str(find_case(words.case).absolute()) if own else words.case]
    case_words += ["--short"] if words.shortened else []
    # The folder comes last, so that nothing is taken for a further assignment.
    case_words += [word for value in chosen for word in ("--set", value)]
    job = SlurmJob(ranks, nodes, minutes, chain, sbatch or [], before or [], "B:" if array else "")
    if array is None:
        from catenary.cases.run.continuing import refuse_other_scene
        from catenary.cases.scene.load import load_scene

        scene = load_scene(words.case, chosen, words.shortened)
        refuse_other_scene(out / RUN_FILE, scene)
        script = slurm_script(case_words, out, job, *_needs_on(scene, job), options)
    else:
        script = _array_script(words, case_words, out, job, array, varied, study)
    if print_:
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
    varied: VariantWords,
    study: bool,
) -> str:
    """The script of a sweep or study whose scenes are all checked."""
    from catenary.cases.run.cluster import array_script
    from catenary.cases.run.needs import total_needs
    from catenary.cases.studies.case_study import make_plan
    from catenary.cases.studies.sweep.jobs import whole_runs_of
    from catenary.cases.studies.sweep.sweep import refuse_other_sweep

    chosen, options = words.split()
    if study:
        if varied:
            raise InputError("--study has runs of its own; leave --vary and --variants away")
        jobs = make_plan(words.case, chosen, words.shortened).jobs
        verb = ["run", *case_words, "--study"]
    else:
        variants = varied.read()
        jobs = whole_runs_of(words.draft(), variants).jobs
        refuse_other_sweep(out, variants, force=False)
        given = (word for text in varied.vary or [] for word in ("--vary", text))
        verb = ["sweep", *case_words, *given]
        verb += [] if varied.named is None else ["--variants", str(varied.named.absolute())]
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

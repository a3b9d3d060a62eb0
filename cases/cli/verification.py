"""The verbs that verify and validate the program: errors, stability and time of its steps.

``accuracy``, ``hard``, ``stability-map`` and ``scaling`` are about errors and time of steps,
``reference``, ``judge`` and ``validate`` about the reference solutions.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from catenary.base.errors import InputError
from catenary.base.parallel import launched_by_mpirun, on_root
from catenary.cases.cli import command_words
from catenary.cases.cli.app import leave, print_findings, serial_verb, verb
from catenary.cases.cli.command_words import (
    Force,
    Jobs,
    Out,
    OutIfAny,
    RunWords,
    SceneWords,
    Strict,
    StudyRuns,
)
from catenary.cases.result_folder.output_folder import refuse_impossible, refuse_table
from catenary.cases.terminal import console
from catenary.postproc.evaluate.wording import counted

_MOST_REPEATS = 99
HARD, HARD_PAGE = "hard.csv", "hard.md"
MAP, MAP_PICTURE = "stability_map.csv", "stability_map.png"


@verb("accuracy")
def accuracy(
    words: RunWords,
    out: Out,
    axes: Annotated[str | None, typer.Option(autocompletion=command_words.axes)] = None,
    target: str = "1%",
    quick: bool = False,
    repeats: int = 3,
    *,
    runs: StudyRuns,
) -> None:
    """Find the step and mesh that a wanted accuracy needs.

    Step, mesh, scheme, coupling and models of a case are varied; the error and time of each setting
    are printed. The same command continues one that was stopped.

    Example: catenary accuracy en50318_2002 -o results/accuracy --axes dt,grid --target 2%

    Parameters
    ----------
    axes NAME,... : Out of dt, elements, grid, scheme, coupling, adaptive, contact, dropper,
        pantograph, planes, lateral_damping, parts; all if absent.
    target PERCENT : Wanted accuracy.
    quick : Few levels and a coarser reference, good for targets from 2%.
    repeats N : How often short runs are timed.
    """
    from catenary.cases.studies.accuracy.analysis import parse_target
    from catenary.cases.studies.accuracy.axes import parse_axes
    from catenary.cases.studies.accuracy.runs import Plan, make_plan

    wanted = parse_target(target)

    def read() -> Plan:
        refuse_impossible(out)
        if not 1 <= repeats <= _MOST_REPEATS:
            raise InputError(f"--repeats {repeats} must be between 1 and {_MOST_REPEATS}")
        chosen, changes = parse_axes(axes), words.changes
        return make_plan(words.case, chosen, changes, words.shortened, quick=quick, repeats=repeats)

    comm, plan, options = runs.begin(read, lambda made: made.jobs[0].scene, words.petsc)
    from catenary.cases.studies.accuracy import output
    from catenary.cases.studies.accuracy import runs as study
    from catenary.cases.studies.records import held_study

    with held_study(out, comm, f"catenary accuracy {words.case}") as held:
        found, ended = study.run(plan, out, comm, options)
        files = held.write(lambda: output.files_of(found, wanted))
    time_of_all = f"{counted(len(ended), 'run')}, {found.wall:.0f} s"
    print_findings(f"{output.as_text(found, wanted)}\n\n{time_of_all}", files)


@verb("hard")
def hard(
    names: Annotated[list[str] | None, typer.Argument()] = None,
    out: OutIfAny = None,
    shortened: Annotated[bool, "--short"] = False,
    *,
    runs: StudyRuns,
) -> int:
    """Run the hard cases and print which limits they keep.

    Limits are energy, bounds, refinement, schemes, and ranks under mpirun. Some five minutes; exits
    with 3 if a limit is not kept. With -o the same command continues one that was stopped.

    Example: catenary hard -o results/hard

    Parameters
    ----------
    names NAME : Only these hard cases; with * and ? all that fit: 'twin_*'.
    out : Folder for the table as hard.csv and hard.md.
    shortened : Shorter runs, steps halved once only.
    """
    from catenary.cases.studies.hard.cases import HardCase, hard_cases

    def read() -> list[HardCase]:
        refuse_table(out, HARD, runs.force)
        return hard_cases(names)

    comm, cases, options = runs.begin(read, lambda cases: cases[0].scene())
    from catenary.cases.process.petsc_options import start_petsc
    from catenary.cases.process.workers import at_once
    from catenary.cases.studies.hard import checks
    from catenary.cases.studies.records import held_study
    from catenary.cases.terminal.terminal_text import RunsBar
    from catenary.postproc.report.study_table import remark_lines

    if comm.size > 1 and runs.n_jobs != 1:
        raise InputError(
            f"-j is {runs.n_jobs} on {comm.size} ranks, of which each case is to take all"
        )
    found: list[checks.Criterion] = []
    remarks_of: dict[str, dict[str, list[str]]] = {}
    petsc = partial(start_petsc, list(options.petsc))
    with held_study(out, comm, "catenary hard", runs.force) as held:
        checked = checks.check_cases(
            cases, comm, shortened, held.kept, at_once(runs.n_jobs, comm), petsc
        )
        with RunsBar(len(cases) if console.speaks() else 0, console.say, what="hard cases") as bar:
            for number, case in enumerate(cases, start=1):
                bar.say(f"[{number}/{len(cases)}] {case.name}: {case.what}")
                rows, remarks_of[case.name] = next(checked)
                bar.say("\n".join(checks.line(row) for row in rows))
                bar.ended()
                found += rows
        files = held.write(
            lambda: {
                HARD: checks.criteria(found, remarks_of),
                HARD_PAGE: checks.page(cases, found, remarks_of),
            }
        )
    failed = [row for row in found if not row.passed]
    lines = remark_lines(march for remarks in remarks_of.values() for march in remarks.items())
    if lines:
        console.say("\n" + "\n".join(lines) + "\n")
    if files:
        console.say("\n".join(map(str, files)))
    console.say(
        f"{counted(len(cases), 'hard case')} on {counted(comm.size, 'rank')}: "
        f"{len(found) - len(failed)} of {len(found)} limits kept"
    )
    return console.NOT_ACCEPTED if failed else console.DONE


@serial_verb("stability-map")
def stability_map(
    words: SceneWords, out: Out, quick: bool = False, n_jobs: Jobs = 1, force: Force = False
) -> int:
    """Find the largest stable step of every coupling.

    It is found against contact stiffness and head mass, from the matrices of a step and by
    marching, and drawn. Some three minutes; exits with 3 if matrices and marches do not agree. The
    same command continues one that was stopped.

    Example: catenary stability-map en50318_2002 -o results/stability

    Parameters
    ----------
    quick : Few stiffnesses and masses.
    """
    from catenary.cases.process.workers import at_once
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.stability import map as study

    refuse_table(out, MAP, force)
    grid, comm = study.QUICK if quick else study.Grid(), console.alone()
    draft = words.draft()
    with held_study(out, comm, f"catenary stability-map {words.case}", force) as held:
        found = study.make_map(draft, comm, grid, console.say, held.kept, at_once(n_jobs, comm))
        files = held.write(
            lambda: {MAP: study.as_rows(found), MAP_PICTURE: lambda: study.draw(found)}
        )
    print_findings(study.as_text(found), files)
    return console.DONE if all(one.agrees for one in found.limits) else console.NOT_ACCEPTED


@verb("scaling")
def scaling(
    words: SceneWords,
    ranks: str = "64,512,4096",
    latency_us: float | None = None,
    bandwidth_GB_per_s: float | None = None,
) -> None:
    """Predict the time of a step on many ranks.

    It follows from latency and bandwidth of messages: those between the ranks that it is started
    on, or given ones. On several ranks it also times all messages of a step between them.

    Example: mpirun -n 8 --oversubscribe catenary scaling ambrosio2012 --ranks 64,512,4096 --set
    line.n_spans=10000

    Parameters
    ----------
    ranks N,... : Numbers of ranks.
    latency_us : Latency of a message; measured on several ranks if absent.
    bandwidth_GB_per_s : Bandwidth of a message; given with the latency.
    """
    from catenary.cases.run.cluster import Wire, Work, work_of
    from catenary.cases.studies import scaling as study
    from catenary.cases.studies.sweep.variants import whole_numbers

    if (latency_us is None) != (bandwidth_GB_per_s is None):
        raise InputError("--latency-us and --bandwidth-GB-per-s belong together; give both")
    given = None
    if latency_us is not None and bandwidth_GB_per_s is not None:
        if not (0.0 < latency_us <= 1e6 and 1e-6 <= bandwidth_GB_per_s <= 1e6):
            raise InputError(
                f"--latency-us {latency_us:g} must be above 0 and at most 1e6, "
                f"--bandwidth-GB-per-s {bandwidth_GB_per_s:g} between 1e-6 and 1e6"
            )
        given = Wire(1e-6 * latency_us, 1e-9 / bandwidth_GB_per_s)
    numbers = whole_numbers(ranks, "--ranks", 1, study.MOST_RANKS, "64,512,4096")
    comm = console.world() if launched_by_mpirun() else None
    several = comm is not None and comm.size > 1
    if not several and given is None:
        raise InputError(
            "on one rank no message can be timed: start it with mpirun -n 2 or more, or give "
            "--latency-us and --bandwidth-GB-per-s"
        )

    def work() -> Work:
        return work_of(words.load())

    found = on_root(comm, work, takes_long=True) if comm is not None else work()
    wire, exchange = given, None
    if several:
        assert comm is not None
        wire = given or study.wire_between(comm)
        exchange = (comm.size, *study.time_of_exchange(comm, found.sizes))
    assert wire is not None
    console.say(study.as_text(found, wire, numbers, given is None, exchange))


@verb("reference")
def reference(
    out: Out, names: Annotated[list[str] | None, typer.Argument()] = None, *, runs: StudyRuns
) -> None:
    """Make the reference solutions anew.

    Models of EN 50318 at two speeds under one and two pantographs are refined in step and mesh,
    with error bars. Takes an hour; the same command continues what was stopped.

    Example: catenary reference ac_simple -o results/reference -j 0

    Parameters
    ----------
    names NAME : Models (ac_simple, ac_stitched, dc_simple) or configurations (ac_simple_275_one);
        all if absent.
    """
    from catenary.cases.studies.reference import solutions
    from catenary.cases.studies.sweep.jobs import Job, all_ended

    def read() -> tuple[list[solutions.Configuration], list[Job]]:
        chosen = solutions.configurations(names or ())
        return chosen, solutions.jobs_of(chosen)

    comm, (chosen, jobs), options = runs.begin(read, lambda made: made[1][0].scene)
    from catenary.cases.studies.accuracy.runs import RUNS, measure
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.sweep.run_jobs import run_jobs

    with held_study(out, comm, "catenary reference") as held:
        ended = all_ended(run_jobs(jobs, out / RUNS, comm, options, measure=measure))
        files = held.write(lambda: solutions.files_of(chosen, ended))
    console.say("\n".join(map(str, files)))


@serial_verb("judge")
def judge(
    files: list[Path],
    of: str | None = None,
    unfiltered: bool = False,
    out: OutIfAny = None,
    strict: Strict = False,
    force: Force = False,
) -> int:
    """Compare results of any program with reference solutions.

    It prints differences, error bars, tolerances of EN 50318 and verdicts.

    Example: catenary judge forces.csv --of ac_simple_275_one -o results/judged

    Parameters
    ----------
    files FILE : CSV files: forces (place_m or time_s, pantograph_N or leading_N and trailing_N) or
        statistics (configuration, of, quantity, value).
    of NAME : Configuration of the files, such as ac_simple_275_one.
    unfiltered : Forces have not passed the 20 Hz filter of EN 50317.
    out : Folder for page, table and picture; none if absent.
    """
    refuse_table(out, "judged.csv", force)
    from catenary.cases.studies.reference import validation
    from catenary.cases.studies.reference.judgement import any_failed, read_results

    found = read_results(files, of, not unfiltered)
    if unfiltered and not any(one.forces for one in found):
        raise InputError("--unfiltered belongs to forces over time; these files hold statistics")
    leave(out, validation.judged_text(found), lambda: validation.judged_files(found))
    return (
        console.NOT_ACCEPTED if strict and any_failed(validation.rows_of(found)) else console.DONE
    )


@verb("validate")
def validate(
    out: Out, measured: Path | None = None, strict: Strict = False, *, runs: StudyRuns
) -> int:
    """Validate this installation by the steps of EN 50318.

    Line at rest, reference model of 2002, reference models in the manner of 2018, a line test; it
    writes the statement with all figures.

    Example: catenary validate -o results/validation -j 0

    Parameters
    ----------
    measured FOLDER : Folder of `catenary compare RUN FILE -o FOLDER`: a line test beside its run.
    """
    from catenary.cases.studies.reference import validation
    from catenary.cases.studies.sweep.jobs import Job, all_ended

    def read() -> tuple[list[Job], validation.Step]:
        refuse_table(out, "validation.csv", runs.force)
        return validation.jobs_of_validation(), validation.line_test(measured)

    comm, (jobs, tested), options = runs.begin(read, lambda made: made[0][0].scene)
    from catenary.cases.studies.accuracy.runs import RUNS
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.reference.judgement import any_failed
    from catenary.cases.studies.sweep.run_jobs import run_jobs

    with held_study(out, comm, "catenary validate") as held:
        ended = all_ended(run_jobs(jobs, out / RUNS, comm, options), "validation")
        found = on_root(comm, lambda: validation.validate(ended, tested), takes_long=True)
        files = held.write(lambda: validation.validation_files(found))
    print_findings(validation.validation_text(found), files)
    return console.NOT_ACCEPTED if strict and any_failed(found.rows) else console.DONE

"""The verbs ``reference``, ``judge`` and ``validate``, about the reference solutions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli.app import (
    Force,
    Out,
    Strict,
    StudyRuns,
    folder_option,
    leave,
    print_findings,
    serial_verb,
    verb,
)
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from catenary.cases.studies.reference.configurations import Configuration
    from catenary.cases.studies.sweep.jobs import Job


@verb(
    "reference",
    help="Make the reference solutions anew. Models of EN 50318 at two speeds under one and two "
    "pantographs are refined in step and mesh, with error bars. Takes an hour; the same "
    "command continues what was stopped.",
    epilog="Example: catenary reference ac_simple -o results/reference -j 0",
)
def reference(
    out: Out,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="NAME",
            help="Models (ac_simple, ac_stitched, dc_simple) or configurations "
            "(ac_simple_275_one); all if absent.",
        ),
    ] = None,
    *,
    runs: StudyRuns,
) -> int:
    """Collective."""
    from catenary.cases.studies.reference.configurations import configurations
    from catenary.cases.studies.reference.convergence import jobs_of

    def read() -> tuple[tuple[list[Configuration], list[Job]], list[str]]:
        chosen = configurations(names or ())
        return (chosen, jobs_of(chosen)), []

    comm, (chosen, jobs), options = runs.begin(read, lambda made: made[1][0].scene)
    from catenary.cases.studies.accuracy.runs import RUNS, measure
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.reference import solutions
    from catenary.cases.studies.sweep.jobs import all_ended
    from catenary.cases.studies.sweep.run_jobs import run_jobs

    with held_study(out, comm, "catenary reference") as held:
        ended = all_ended(run_jobs(jobs, out / RUNS, comm, options, measure=measure))
        files = held.write(lambda: solutions.files_of(chosen, ended))
    console.say("\n".join(map(str, files)))
    return console.DONE


@serial_verb(
    "judge",
    help="Compare results of any program with reference solutions. It prints differences, error "
    "bars, tolerances of EN 50318 and verdicts.",
    epilog="Example: catenary judge forces.csv --of ac_simple_275_one -o results/judged",
)
def judge(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE",
            help="CSV files: forces (place_m or time_s, pantograph_N or leading_N and trailing_N) "
            "or statistics (configuration, of, quantity, value).",
        ),
    ],
    configuration: Annotated[
        str | None,
        typer.Option(
            "--of", metavar="NAME", help="Configuration of the files, such as ac_simple_275_one."
        ),
    ] = None,
    unfiltered: Annotated[
        bool,
        typer.Option("--unfiltered", help="Forces have not passed the 20 Hz filter of EN 50317."),
    ] = False,
    out: Annotated[
        Path | None, folder_option("Folder for page, table and picture; none if absent.")
    ] = None,
    strict: Strict = False,
    force: Force = False,
) -> int:
    """Serial."""
    if out is not None:
        refuse_table(out / "judged.csv", force)
    from catenary.cases.studies.reference import pages
    from catenary.cases.studies.reference.judgement import any_failed
    from catenary.cases.studies.reference.others_results import read_results

    found = read_results(files, configuration, not unfiltered)
    if unfiltered and not any(one.forces for one in found):
        raise InputError("--unfiltered belongs to forces over time; these files hold statistics")
    leave(out, pages.judged_text(found), lambda: pages.judged_files(found))
    return console.NOT_ACCEPTED if strict and any_failed(pages.rows_of(found)) else console.DONE


@verb(
    "validate",
    help="Validate this installation by the steps of EN 50318. Line at rest, reference model of "
    "2002, reference models in the manner of 2018, a line test; it writes the statement with "
    "all figures.",
    epilog="Example: catenary validate -o results/validation -j 0",
)
def validate(
    out: Out,
    measured: Annotated[
        Path | None,
        typer.Option(
            "--measured",
            metavar="FOLDER",
            help="Folder of `catenary compare RUN FILE -o FOLDER`: a line test beside its run.",
        ),
    ] = None,
    strict: Strict = False,
    *,
    runs: StudyRuns,
) -> int:
    """Collective."""
    from catenary.cases.studies.reference import validation as study

    def read() -> tuple[tuple[list[Job], study.Step], list[str]]:
        refuse_table(out / "validation.csv", runs.force)
        return (study.jobs_of_validation(), study.line_test(measured)), []

    comm, (jobs, tested), options = runs.begin(read, lambda made: made[0][0].scene)
    from catenary.base.parallel import on_root
    from catenary.cases.studies.accuracy.runs import RUNS
    from catenary.cases.studies.records import held_study
    from catenary.cases.studies.reference import pages
    from catenary.cases.studies.reference.judgement import any_failed
    from catenary.cases.studies.sweep.jobs import all_ended
    from catenary.cases.studies.sweep.run_jobs import run_jobs

    with held_study(out, comm, "catenary validate") as held:
        ended = all_ended(run_jobs(jobs, out / RUNS, comm, options), "validation")
        found = on_root(comm, lambda: study.validate(ended, tested), takes_long=True)
        files = held.write(lambda: pages.validation_files(found))
    print_findings(pages.validation_text(found), files)
    return console.NOT_ACCEPTED if strict and any_failed(found.rows) else console.DONE

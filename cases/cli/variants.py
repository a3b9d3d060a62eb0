"""Verbs of many runs: ``sweep``, ``uncertainty``, ``merge``, ``optimise`` and ``tolerance``.

The last two read a task from a file. What ``run --study`` does stands here as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import catenary
from catenary.base.errors import InputError
from catenary.base.files import is_folder
from catenary.base.process import alone
from catenary.cases.cli.app import leave, print_findings, serial_verb, verb
from catenary.cases.cli.command_words import (
    Force,
    Jobs,
    Out,
    OutIfAny,
    PartOfRuns,
    RunWords,
    SceneWords,
    StudyRuns,
    VariantWords,
    names_in,
)
from catenary.cases.result_folder.folder_lock import held
from catenary.cases.result_folder.output_folder import refuse_impossible, refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from catenary.cases.studies.sweep.jobs import Ended
    from catenary.optimising import Made

_SHOWN_BROKEN, _SHOWN_REFUSED = 3, 20


@verb("sweep")
def sweep(
    words: RunWords,
    out: Out,
    varied: VariantWords,
    sample: Path | None = None,
    plot: str | None = None,
    reports: bool = False,
    only_statistics: bool = False,
    histories: str | None = None,
    histogram: bool = False,
    part: PartOfRuns = None,
    *,
    runs: StudyRuns,
) -> int:
    """Run variants of a case and tabulate their statistics.

    The same command continues a sweep that was stopped.

    Example: catenary sweep en50318_2002 -o results/speeds --vary train.speed_km_h=200,250,300
    --vary contact.stiffness_N_per_m=2e4,5e4

    Parameters
    ----------
    sample : TOML file of distributions by keys, with n, seed and method: samples are run, and their
        table evaluated.
    plot STATISTIC,... : Columns of sweep.csv to draw; mean_N,std_N,max_N,min_N,max_uplift_mm if
        absent.
    reports : Also write the report of each run.
    only_statistics : Write the table but no result files: for thousands of variants. Variants that
        share a line march side by side.
    histories NAME,... : With --only-statistics, also keep histories of all variants in one file,
        histories.h5: contact_force, filtered_force, head_height, wire_height.
    histogram : Also write force_histogram.csv, the share of time in bins of the filtered contact
        force, and a picture of it.
    """
    from catenary.cases.studies.sweep.jobs import STATISTICS, check_names, parse_part
    from catenary.cases.studies.sweeps import PlannedSweep, plan_sweep
    from catenary.sweeps import samples_of

    own = None if part is None else parse_part(part)
    if own is not None and (plot is not None or histogram):
        raise InputError(
            "a part has no pictures: leave --plot and --histogram to the sweep after all parts"
        )

    def read() -> PlannedSweep:
        draft = words.draft()
        check_names(names_in(plot), STATISTICS, "statistic")
        sampling = None
        if sample is None:
            variants = varied.read()
        elif varied:
            raise InputError(
                "--sample makes all variants itself: give neither --vary nor --variants"
            )
        else:
            variants, sampling = samples_of(sample, draft)
        if reports and only_statistics:
            raise InputError("--only-statistics leaves nothing that --reports could draw")
        return plan_sweep(
            draft,
            variants,
            out,
            sampling,
            full_report=reports,
            only_statistics=only_statistics,
            histories=names_in(histories),
            force=runs.force,
        )

    comm, made, options = runs.begin(read, lambda made: made.own.first, words.petsc)
    refused = made.own.refused
    for one in refused[:_SHOWN_REFUSED]:
        console.warn(f"variant {one.variant.name} is not run: {one.outcome}")
    if len(refused) > _SHOWN_REFUSED:
        console.warn(f"{len(refused) - _SHOWN_REFUSED} more variants are not run")
    if own is not None:
        return verdict(made.run_part(own, comm, options), "sweep")
    command = f"catenary sweep {words.case}"
    found = made.run(comm, options, command, names_in(plot), histogram)
    print_findings(found.text, found.files)
    return verdict(found.ended, "sweep")


def run_study(words: RunWords, out: Path, runs: StudyRuns, part: str | None) -> int:
    """Run ``catenary run CASE --study`` and return its exit code. Collective."""
    from catenary.cases.studies.case_study import Plan, find_study, make_plan
    from catenary.cases.studies.sweep.jobs import parse_part

    own = None if part is None else parse_part(part)

    def read() -> Plan:
        refuse_impossible(out)
        console.say(
            f"--study runs the program {find_study(words.case)}, which may do all that you may"
        )
        return make_plan(words.case, words.changes, words.shortened)

    comm, plan, options = runs.begin(read, lambda made: made.jobs[0].scene, words.petsc)
    from catenary.cases.studies import case_study

    if own is not None:
        return verdict(case_study.run(plan, out, comm, options, own)[1], "study")
    with held(out, comm, f"catenary run {words.case} --study"):
        report, ended = case_study.run(plan, out, comm, options)
    if report is not None:
        console.say("\n" + report)
    return verdict(ended, "study")


def verdict(ended: Sequence[Ended], what: str) -> int:
    """The exit code; prints which variants broke. Raises ``Interrupted``. Not collective."""
    from catenary.cases.studies.sweep.jobs import all_ended

    broken = [one for one in all_ended(ended, what) if not one.done]
    if not broken:
        return console.DONE
    names = ", ".join(f"{one.variant.name} ({one.outcome})" for one in broken[:_SHOWN_BROKEN])
    more = len(broken) - _SHOWN_BROKEN
    console.complain(
        f"{len(broken)} of {len(ended)} variants broke: {names}"
        + (f" and {more} more" if more > 0 else "")
    )
    return console.BROKEN


@serial_verb("uncertainty")
def uncertainty(table: Path, sample: Path | None = None, out: OutIfAny = None) -> None:
    """Evaluate the table of a sweep with uncertain keys.

    It prints quantiles, probabilities that acceptance criteria fail and sensitivity indices, all
    with 95 % bounds, and draws pictures.

    Example: catenary uncertainty results/tolerances

    Parameters
    ----------
    table : Folder of a sweep, or a table like its sweep.csv, as .csv or .parquet.
    sample : Sampling file of the table, if none is beside it.
    out : Folder for uncertainty.json and pictures, the table's if absent.
    """
    from catenary.sweeps import estimate_files

    if out is not None:
        refuse_impossible(out)
    found = catenary.uncertainty(table, sample)
    folder = out or (table if is_folder(table) else table.parent)
    leave(folder, str(found), lambda: estimate_files(found))


@serial_verb("merge")
def merge(folders: list[Path], out: Out, force: Force = False) -> None:
    """Join sweeps of one case that ran in several folders.

    Folders such as the parts of --part become one table, with their histories if all have some;
    those that contradict each other are refused.

    Example: catenary merge results/part_1 results/part_2 -o results/tolerances

    Parameters
    ----------
    folders : Folders of sweeps, at least two, or one with parts.
    out : Folder for the table.
    """
    from catenary.cases.studies import sweeps
    from catenary.cases.studies.sweep.sweep import RECORD
    from catenary.cases.studies.uncertainty import output

    parts = sweeps.parts_of(folders)
    if len(parts) < 2:
        raise InputError(f"there is only {folders[0]} to merge: name at least two folders")
    refuse_impossible(out)
    # A sweep that runs there would replace the table when it ends.
    with held(out, alone(), "catenary merge"):
        refuse_table(out, RECORD, force)
        merged = sweeps.merge(parts)
        files, found, lacks = sweeps.write_merged(out, merged)
    if found is not None:
        console.say(output.as_text(found) + "\n")
    if lacks:
        console.say(lacks)
    console.say(f"{len(merged.folders)} variants of {merged.record['case']}")
    console.say("\n".join(str(path) for path in files))


@dataclass(kw_only=True)
class TaskWords(SceneWords):
    """A case, the task of a study over a set of its scenes, and how that is made."""

    task_file: Annotated[
        Path, typer.Argument(metavar="FILE", help="TOML file with the task.", show_default=False)
    ]
    out: Out
    n_jobs: Jobs = 1
    force: Force = False

    def make(self, verb: str, study: Callable[..., Made]) -> None:
        """Make the study and print what it found. Serial."""
        made = study(
            lambda: (self.draft(), self.task_file),
            self.out,
            command=f"catenary {verb} {self.case}",
            jobs=self.n_jobs,
            force=self.force,
            warn=console.warn,
            say=console.say,
        )
        print_findings(made.text, made.files)


@serial_verb("optimise")
def optimise(words: TaskWords) -> None:
    """Choose numbers of a scene for the calmest contact force.

    Droppers, tensions, pantographs or any others are chosen for the smallest standard deviation of
    the contact force, or another statistic, over both directions, several speeds, trains and
    installation errors; the optimum is checked with a finer mesh, a shorter step and unseen errors.
    The same command continues one that was stopped.

    Example: catenary optimise ac_simple droppers.toml -o results/optimum --set train.speed_km_h=320
    """
    from catenary.optimising import optima

    words.make("optimise", optima)


@serial_verb("tolerance")
def tolerance(words: TaskWords) -> None:
    """Find the tolerances within which the criteria hold.

    Droppers, heights, tensions or any numbers of a scene may be off so far that each acceptance
    criterion holds with a probability of 99 %, by samples of errors, and in the worst case. The
    same command continues one that was stopped.

    Example: catenary tolerance en50318_2002 installation.toml -o results/tolerance
    """
    from catenary.optimising import tolerances

    words.make("tolerance", tolerances)

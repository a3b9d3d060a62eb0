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
from catenary.cases.cli.app import (
    Force,
    Jobs,
    NamedVariants,
    Out,
    PartOfRuns,
    RunWords,
    SceneWords,
    StudyRuns,
    Vary,
    folder_option,
    leave,
    names_in,
    print_findings,
    serial_verb,
    verb,
)
from catenary.cases.result_folder.folder_lock import held
from catenary.cases.result_folder.output_folder import refuse_impossible, refuse_table
from catenary.cases.terminal import console

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from catenary.cases.scene.load import Draft
    from catenary.cases.studies.sweep.jobs import Ended
    from catenary.cases.studies.sweep.variants import Variant
    from catenary.cases.studies.sweeps import PlannedSweep
    from catenary.optimising import Made

_SHOWN_BROKEN, _SHOWN_REFUSED = 3, 20


@verb(
    "sweep",
    help="Run variants of a case and tabulate their statistics. The same command continues a "
    "sweep that was stopped.",
    epilog="Example: catenary sweep en50318_2002 -o results/speeds --vary "
    "train.speed_km_h=200,250,300 --vary contact.stiffness_N_per_m=2e4,5e4",
)
def sweep(
    words: RunWords,
    out: Out,
    vary: Vary = None,
    named: NamedVariants = None,
    sample: Annotated[
        Path | None,
        typer.Option(
            "--sample",
            help="TOML file of distributions by keys, with n, seed and method: samples are run, "
            "and their table evaluated.",
        ),
    ] = None,
    plotted: Annotated[
        str | None,
        typer.Option(
            "--plot",
            metavar="STATISTIC,...",
            help="Columns of sweep.csv to draw; mean_N,std_N,max_N,min_N,max_uplift_mm if absent.",
        ),
    ] = None,
    reports: Annotated[
        bool, typer.Option("--reports", help="Also write the report of each run.")
    ] = False,
    only_statistics: Annotated[
        bool,
        typer.Option(
            "--only-statistics",
            help="Write the table but no result files: for thousands of variants. "
            "Variants that share a line march side by side.",
        ),
    ] = False,
    histories: Annotated[
        str | None,
        typer.Option(
            "--histories",
            metavar="NAME,...",
            help="With --only-statistics, also keep histories of all variants in one file, "
            "histories.h5: contact_force, filtered_force, head_height, wire_height.",
        ),
    ] = None,
    histogram: Annotated[
        bool,
        typer.Option(
            "--histogram",
            help="Also write force_histogram.csv, the share of time in bins of the filtered "
            "contact force, and a picture of it.",
        ),
    ] = False,
    part: PartOfRuns = None,
    *,
    runs: StudyRuns,
) -> int:
    """Collective."""
    from catenary.cases.studies.sweep.jobs import STATISTICS, check_names, parse_part
    from catenary.cases.studies.sweeps import plan_sweep
    from catenary.sweeps import samples_of

    own = None if part is None else parse_part(part)
    if own is not None and (plotted is not None or histogram):
        raise InputError(
            "a part has no pictures: leave --plot and --histogram to the sweep after all parts"
        )

    def read() -> tuple[PlannedSweep, list[str]]:
        draft, options = words.draft()
        check_names(names_in(plotted), STATISTICS, "statistic")
        sampling = None
        if sample is None:
            variants = read_variants(vary, named)
        elif vary or named is not None:
            raise InputError(
                "--sample makes all variants itself: give neither --vary nor --variants"
            )
        else:
            variants, sampling = samples_of(sample, draft)
        if reports and only_statistics:
            raise InputError("--only-statistics leaves nothing that --reports could draw")
        made = plan_sweep(
            draft,
            variants,
            out,
            sampling,
            full_report=reports,
            only_statistics=only_statistics,
            histories=names_in(histories),
            force=runs.force,
        )
        return made, options

    comm, made, options = runs.begin(read, lambda made: made.own.first)
    refused = made.own.refused
    for one in refused[:_SHOWN_REFUSED]:
        console.warn(f"variant {one.variant.name} is not run: {one.outcome}")
    if len(refused) > _SHOWN_REFUSED:
        console.warn(f"{len(refused) - _SHOWN_REFUSED} more variants are not run")
    if own is not None:
        return verdict(made.run_part(own, comm, options), "sweep")
    command = f"catenary sweep {words.case}"
    found = made.run(comm, options, command, names_in(plotted), histogram)
    print_findings(found.text, found.files)
    return verdict(found.ended, "sweep")


def read_variants(vary: Sequence[str] | None, named: Path | None) -> list[Variant]:
    """The variants of ``--vary`` and ``--variants``.

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

    if not vary and named is None:
        raise InputError(
            "there is nothing to vary: give --vary key=v1,v2,..., --variants or --sample"
        )
    varied = [parse_vary(text) for text in vary or []]
    check_keys(product(varied, {}), VARY)
    table = {} if named is None else read_named(named)
    check_keys(product([], table), f"in {named}")
    return product(varied, table)


def run_study(words: RunWords, out: Path, runs: StudyRuns, part: str | None) -> int:
    """Run ``catenary run CASE --study`` and return its exit code. Collective."""
    from catenary.cases.studies.case_study import Plan, find_study, make_plan
    from catenary.cases.studies.sweep.jobs import parse_part

    own = None if part is None else parse_part(part)

    def read() -> tuple[Plan, list[str]]:
        refuse_impossible(out)
        changes, options = words.split()
        console.say(
            f"--study runs the program {find_study(words.case)}, which may do all that you may"
        )
        return make_plan(words.case, changes, words.shortened), options

    comm, plan, options = runs.begin(read, lambda made: made.jobs[0].scene)
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


@serial_verb(
    "uncertainty",
    help="Evaluate the table of a sweep with uncertain keys. It prints quantiles, probabilities "
    "that acceptance criteria fail and sensitivity indices, all with 95 % bounds, and draws "
    "pictures.",
    epilog="Example: catenary uncertainty results/tolerances",
)
def uncertainty(
    table: Annotated[
        Path,
        typer.Argument(
            help="Folder of a sweep, or a table like its sweep.csv, as .csv or .parquet."
        ),
    ],
    sample: Annotated[
        Path | None,
        typer.Option("--sample", help="Sampling file of the table, if none is beside it."),
    ] = None,
    out: Annotated[
        Path | None,
        folder_option("Folder for uncertainty.json and pictures, the table's if absent."),
    ] = None,
) -> None:
    """Serial."""
    from catenary.sweeps import estimate_files

    if out is not None:
        refuse_impossible(out)
    found = catenary.uncertainty(table, sample)
    folder = out or (table if is_folder(table) else table.parent)
    leave(folder, str(found), lambda: estimate_files(found))


@serial_verb(
    "merge",
    help="Join sweeps of one case that ran in several folders. Folders such as the parts of "
    "--part become one table, with their histories if all have some; those that contradict each "
    "other are refused.",
    epilog="Example: catenary merge results/part_1 results/part_2 -o results/tolerances",
)
def merge(
    folders: Annotated[
        list[Path], typer.Argument(help="Folders of sweeps, at least two, or one with parts.")
    ],
    out: Annotated[Path, folder_option("Folder for the table.")],
    force: Force = False,
) -> None:
    """Serial."""
    from catenary.cases.studies import sweeps
    from catenary.cases.studies.sweep.sweep import RECORD
    from catenary.cases.studies.uncertainty import output

    parts = sweeps.parts_of(folders)
    if len(parts) < 2:
        raise InputError(f"there is only {folders[0]} to merge: name at least two folders")
    refuse_impossible(out)
    # A sweep that runs there would replace the table when it ends.
    with held(out, alone(), "catenary merge"):
        refuse_table(out / RECORD, force)
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

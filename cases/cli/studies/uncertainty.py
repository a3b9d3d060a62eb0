"""The verbs ``uncertainty`` and ``merge``, about tables of sweeps made before."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from catenary.base.errors import InputError
from catenary.cases.cli.app import Force, folder_option, serial_verb
from catenary.cases.result_folder.output_folder import refuse_table
from catenary.cases.terminal import console


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
    from catenary.cases.studies.sampling.tables import read_sampling
    from catenary.cases.studies.uncertainty import output
    from catenary.cases.studies.uncertainty.evaluation import evaluate
    from catenary.cases.studies.uncertainty.run_table import read_run_table, run_table

    runs = read_run_table(table)
    if sample is not None:
        runs = run_table(runs.frame, read_sampling(sample), str(table))
    found = evaluate(runs)
    folder = out or (table if table.is_dir() else table.parent)
    files = output.write(folder, runs, found)
    console.say(output.as_text(found))
    console.say("\n" + "\n".join(str(path) for path in files))


@serial_verb(
    "merge",
    help="Join sweeps of one case that ran in several folders. Folders such as the parts of "
    "--part become one table, with their histories if all have some; those that contradict each "
    "other are refused.",
    epilog="Example: catenary merge results/part_1 results/part_2 -o results/tolerances",
)
def merge(
    folders: Annotated[list[Path], typer.Argument(help="Folders of sweeps, at least two.")],
    out: Annotated[Path, folder_option("Folder for the table.")],
    force: Force = False,
) -> None:
    """Serial."""
    from catenary.cases.studies import merged_sweeps
    from catenary.cases.studies.sweep.output import RECORD
    from catenary.cases.studies.uncertainty import output

    if len(folders) < 2:
        raise InputError(f"there is only {folders[0]} to merge: name at least two folders")
    refuse_table(out / RECORD, force)
    merged = merged_sweeps.merge(folders)
    files, found, lacks = merged_sweeps.write(out, merged)
    if found is not None:
        console.say(output.as_text(found) + "\n")
    if lacks:
        console.say(lacks)
    console.say(f"{len(merged.folders)} variants of {merged.record['case']}")
    console.say("\n".join(str(path) for path in files))
